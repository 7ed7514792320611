//! The scorecard's file: a line for every case, written as the cases are done.

use super::case::{COVERED, Row};
use super::plan::Group;
use crate::diagnose::Place;
use crate::{Error, Result, input};
use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Changes with the cases that a seed stands for: a file of another edition is not gone on with.
const EDITION: u32 = 2;

/// Longest file that is read, in bytes: hundreds of thousands of lines.
const LONGEST: u64 = 64 << 20;

/// Rows that are done, and the file in which they lie.
#[derive(Debug)]
pub struct Ledger {
    seed: u64,
    rows: Vec<Row>,
    file: Option<(PathBuf, File)>,
}

impl Ledger {
    /// One that lasts as long as the program.
    pub fn in_memory(seed: u64) -> Self {
        Self {
            seed,
            rows: Vec::new(),
            file: None,
        }
    }

    /// The one in the file at `path`, which is made if there is none. A last line that was not finished is dropped.
    ///
    /// # Errors
    /// The file is no scorecard, one of another seed or edition, or cannot be written.
    pub fn open(path: &Path, seed: u64) -> Result<Self> {
        let wrong = |error: std::io::Error| {
            Error::input(
                path.display(),
                format!("cannot be read and written: {error}"),
                "check the path, its permissions and the space left",
            )
        };
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(wrong)?;
        let text = input::text(path, LONGEST, "give the name of a new file")?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let rows = match text.is_empty() {
            true => Vec::new(),
            false => read(path, &text[..whole], seed)?,
        };
        file.set_len(whole as u64).map_err(wrong)?;
        if whole == 0 {
            writeln!(file, "{}", heads()).map_err(wrong)?;
        }
        Ok(Self {
            seed,
            rows,
            file: Some((path.to_owned(), file)),
        })
    }

    /// The rows that are done.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Whether the case of this name is done.
    pub fn has(&self, case: &str) -> bool {
        self.rows.iter().any(|row| row.case == case)
    }

    /// Adds a row, and writes it at once.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn push(&mut self, row: Row) -> Result<()> {
        if let Some((path, file)) = &mut self.file {
            let line = format!("{}\n", line(&row, self.seed));
            let written = file.write_all(line.as_bytes()).and_then(|()| file.flush());
            written.map_err(|error| {
                Error::failed(
                    format!("writing {}: {error}", path.display()),
                    "free some space, then call it again: what is done is kept",
                )
            })?;
        }
        self.rows.push(row);
        Ok(())
    }
}

fn heads() -> String {
    let first = "edition,seed,case,group,planted,values,conditions,base,after,floor,verdict,named,outcome,place,located";
    let covered = COVERED.map(|name| format!("covers_{name}")).join(",");
    format!("{first},{covered},seconds")
}

fn line(row: &Row, seed: u64) -> String {
    let covered = row.covered.map(|covered| match covered {
        Some(true) => "1",
        Some(false) => "0",
        None => "",
    });
    let cells = [
        EDITION.to_string(),
        seed.to_string(),
        row.case.clone(),
        row.group.to_string(),
        row.planted.clone(),
        row.values.clone(),
        row.conditions.clone(),
        row.base.to_string(),
        row.after.to_string(),
        row.floor.to_string(),
        row.verdict.clone(),
        row.named.clone(),
        row.outcome.to_string(),
        row.place.map_or("", Place::name).into(),
        row.located.map_or("", Place::name).into(),
        covered.join(","),
        format!("{:.2}", row.seconds),
    ];
    cells.join(",")
}

fn read(path: &Path, text: &str, seed: u64) -> Result<Vec<Row>> {
    let place = path.display();
    let mut lines = text.lines().enumerate();
    if lines.next().is_none_or(|(_, line)| line != heads()) {
        return Err(Error::input(
            place,
            "is no scorecard's file, or one of another version",
            "give the name of a new file",
        ));
    }
    let mut rows = Vec::new();
    let mut known = HashSet::new();
    for (index, line) in lines {
        let place = format!("{place}, line {}", index + 1);
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != heads().split(',').count() {
            return Err(Error::input(
                place,
                format!("has {} cells", cells.len()),
                "remove the line, or give the name of a new file",
            ));
        }
        for (what, is, expected) in [
            ("edition", cells[0], EDITION.to_string()),
            ("seed", cells[1], seed.to_string()),
        ] {
            if is != expected {
                return Err(Error::input(
                    place,
                    format!("is of {what} {is}, not {expected}"),
                    "give the name of a new file, or the seed that this one has",
                ));
            }
        }
        let row = parse(&cells[2..]).ok_or_else(|| {
            Error::input(
                &place,
                "cannot be read",
                "remove the line, or give the name of a new file",
            )
        })?;
        if !known.insert(row.case.clone()) {
            return Err(Error::input(
                place,
                format!("has the case {} again", row.case),
                "remove the line",
            ));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn parse(cells: &[&str]) -> Option<Row> {
    let covered = |cell: &str| match cell {
        "" => Some(None),
        "1" => Some(Some(true)),
        "0" => Some(Some(false)),
        _ => None,
    };
    let place = |cell: &str| match cell {
        "" => Some(None),
        name => Place::ALL
            .into_iter()
            .find(|one| one.name() == name)
            .map(Some),
    };
    let text = |index: usize| cells[index].to_owned();
    Some(Row {
        case: text(0),
        group: cells[1].parse::<Group>().ok()?,
        planted: text(2),
        values: text(3),
        conditions: text(4),
        base: cells[5].parse().ok()?,
        after: cells[6].parse().ok()?,
        floor: cells[7].parse().ok()?,
        verdict: text(8),
        named: text(9),
        outcome: cells[10].parse().ok()?,
        place: place(cells[11])?,
        located: place(cells[12])?,
        covered: [
            covered(cells[13])?,
            covered(cells[14])?,
            covered(cells[15])?,
            covered(cells[16])?,
        ],
        seconds: cells[17].parse().ok()?,
    })
}
