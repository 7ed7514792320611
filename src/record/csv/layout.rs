//! Where a file's cells end, and where its header, its units and its samples begin.
//!
//! The samples say it: the right delimiter is the one with which most lines fall into as many cells, all of them numbers,
//! text or empty. The header is the nearest line of names above the first such line, and what stands above it is not read,
//! unless it is a table of its own.

use super::cells::{DELIMITERS, Look, is_comment, look, split};
use crate::record::label::unit_cell;
use crate::record::text::quoted;
use crate::record::unit;
use crate::{Error, Result};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A line of the file with its number, from 1.
pub(super) type Line<'a> = (usize, &'a str);

/// Longest line that is read, in bytes.
const LONGEST_LINE: usize = 1 << 20;

/// Lines that are looked at, and about how many bytes of them: the delimiter shows long before.
const LINES: (usize, usize) = (1000, 4 << 20);

/// What was found; lines are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layout {
    pub(super) delimiter: char,
    pub(super) header: usize,
    pub(super) units: Option<usize>,
}

impl Layout {
    /// Whether what it takes for the header of `lines` are units.
    pub(super) fn has_no_names(&self, lines: &[Line<'_>]) -> bool {
        let cells = split(lines[self.header].1, self.delimiter);
        self.units.is_none() && cells.is_some_and(|cells| are_units(&cells))
    }

    /// Whether the first of `lines` is the header, and of what is below it.
    pub(super) fn heads(&self, lines: &[Line<'_>]) -> bool {
        let below = self.units.map_or(1, |units| units + 1);
        let cut = |line: usize| Some(Cut::of(lines.get(line)?.1, self.delimiter));
        let fits = cut(0)
            .zip(cut(below))
            .is_some_and(|(header, below)| header.fits(below));
        self.header == 0 && fits
    }
}

/// What a line is if cells are separated by a certain delimiter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// At least two numbers, or one and a moment.
    Sample,
    Names,
    Units,
    Neither,
}

/// A line, cut into cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cut {
    kind: Kind,
    cells: usize,
    /// The same without an empty last cell, which may be a cell or the end of the one before, and without that of comments.
    width: usize,
    /// Whether it holds nothing but numbers.
    bare: bool,
}

impl Cut {
    fn of(line: &str, delimiter: char) -> Self {
        let mut cells = split(line, delimiter).unwrap_or_default();
        let number = cells.len();
        cells.pop_if(|cell| cell.is_empty());
        let looks: Vec<Look> = cells.iter().map(|cell| look(cell, delimiter)).collect();
        let count = |wanted| looks.iter().filter(|&&look| look == wanted).count();
        let (numbers, moments) = (count(Look::Number), count(Look::Moment));
        let kind = match (numbers, numbers + moments, moments + count(Look::Text)) {
            _ if cells.len() < 2 || count(Look::Debris) > 0 => Kind::Neither,
            _ if are_units(&cells) => Kind::Units,
            (0, _, 1..) => Kind::Names,
            (1.., 2.., _) => Kind::Sample,
            _ => Kind::Neither,
        };
        Self {
            kind,
            cells: number,
            width: match cells.last() {
                Some(last) if kind == Kind::Names && is_comment(last) => cells.len() - 1,
                _ => cells.len(),
            },
            bare: kind == Kind::Sample && count(Look::Number) == cells.len(),
        }
    }

    fn is_label(self) -> bool {
        matches!(self.kind, Kind::Names | Kind::Units)
    }

    /// Whether the two can have the same columns.
    fn fits(self, other: Self) -> bool {
        self.width <= other.cells && other.width <= self.cells
    }
}

/// All in brackets, or most of them known units; some, at least, are no numbers.
fn are_units(cells: &[Cow<'_, str>]) -> bool {
    let given: Vec<&str> = cells
        .iter()
        .map(|cell| &**cell)
        .filter(|cell| !cell.is_empty())
        .collect();
    let bracketed = |cell: &&&str| unit_cell(cell) != **cell;
    let known = |cell: &&&str| cell.parse::<f64>().is_err() && unit::is_known(unit_cell(cell));
    let all = given.len();
    all > 0
        && (given.iter().filter(bracketed).count() == all
            || 2 * given.iter().filter(known).count() > all)
}

/// A way to read the file.
struct Reading {
    delimiter: char,
    /// Samples of as many cells as most have.
    samples: usize,
    first: usize,
    cuts: Vec<Cut>,
    /// The nearest line of labels above the first sample that fits it.
    labels: Option<usize>,
}

impl Reading {
    /// The best with this delimiter; `None` where no line is a sample.
    fn with(delimiter: char, lines: &[Line<'_>]) -> Option<Self> {
        let cuts: Vec<Cut> = lines
            .iter()
            .map(|(_, line)| Cut::of(line, delimiter))
            .collect();
        let mut alike = BTreeMap::new();
        for (line, cut) in cuts.iter().enumerate() {
            if cut.kind == Kind::Sample {
                alike.entry(cut.cells).or_insert((line, 0)).1 += 1;
            }
        }
        let labels = |first: usize| {
            (0..first).rfind(|&line| cuts[line].is_label() && cuts[line].fits(cuts[first]))
        };
        let (first, samples) = alike
            .into_values()
            .max_by_key(|&(first, samples)| (labels(first).is_some(), samples))?;
        Some(Self {
            delimiter,
            samples,
            first,
            labels: labels(first),
            cuts,
        })
    }

    /// The order in which readings are believed. Blanks also stand beside other delimiters.
    fn rank(&self) -> (bool, usize, bool) {
        (self.labels.is_some(), self.samples, self.delimiter != ' ')
    }

    /// Header and units, whatever the width; `None` where nothing but numbers stands above the first sample.
    fn layout(&self) -> Option<Layout> {
        let any = || (0..self.first).rfind(|&line| self.cuts[line].is_label());
        let nearest = self.labels.or_else(any)?;
        let above = nearest.checked_sub(1).map(|line| self.cuts[line]);
        let named = |above: Cut| above.kind == Kind::Names && above.fits(self.cuts[nearest]);
        let (header, units) = match self.cuts[nearest].kind {
            Kind::Units if above.is_some_and(named) => (nearest - 1, Some(nearest)),
            _ => (nearest, None),
        };
        Some(Layout {
            delimiter: self.delimiter,
            header,
            units,
        })
    }
}

/// The first of `lines`, from which the layout shows.
///
/// # Errors
/// One of all lines is over 1 MiB.
pub(super) fn first_lines<'a>(
    path: &str,
    lines: impl Iterator<Item = Line<'a>>,
) -> Result<Vec<Line<'a>>> {
    let mut bytes = 0;
    let mut first = Vec::new();
    for (row, line) in lines {
        if line.len() > LONGEST_LINE {
            return Err(Error::input(
                format!("{path}, row {row}"),
                "is longer than 1 MiB",
                "give a CSV file with one sample a line",
            ));
        }
        if first.len() < LINES.0 && bytes < LINES.1 {
            bytes += line.len();
            first.push((row, line));
        }
    }
    Ok(first)
}

/// The layout of the file called `path`, which begins with `lines`: one at least.
///
/// # Errors
/// Two delimiters do as well; numbers without a header; two tables.
pub(super) fn layout(path: &str, lines: &[Line<'_>]) -> Result<Layout> {
    let mut readings: Vec<Reading> = DELIMITERS
        .into_iter()
        .filter_map(|delimiter| Reading::with(delimiter, lines))
        .collect();
    readings.sort_by_key(|reading| std::cmp::Reverse(reading.rank()));
    let Some(best) = readings.first() else {
        return by_the_header(path, lines);
    };
    let rival = readings[1..].iter().find(|other| {
        other.delimiter != ' '
            && other.labels.is_some() == best.labels.is_some()
            && 2 * other.samples > best.samples
    });
    if let Some(rival) = rival {
        let (row, line) = lines[best.first];
        let cells = |reading: &Reading| {
            let cells = split(line, reading.delimiter).unwrap_or_default();
            let shown: Vec<String> = cells.iter().take(3).map(|cell| quoted(cell)).collect();
            format!("{} at {:?}", shown.join(" "), reading.delimiter)
        };
        return Err(Error::input(
            format!("{path}, row {row}"),
            format!(
                "can be split in two ways: {}, or {}",
                cells(best),
                cells(rival)
            ),
            "separate cells by semicolons or tabs, and use these nowhere else",
        ));
    }
    let layout = best.layout().ok_or_else(|| {
        let above = &lines[..best.first];
        match above
            .iter()
            .rfind(|(_, line)| split(line, best.delimiter).is_none())
        {
            Some(&(row, _)) => broken_quote(path, row),
            None => without_header(path, lines[best.first].0),
        }
    })?;
    let mut bare = (0..layout.header).filter(|&line| best.cuts[line].bare);
    match (bare.next(), bare.next()) {
        (Some(first), Some(_)) => Err(Error::input(
            format!("{path}, row {}", lines[first].0),
            format!(
                "holds numbers above the header in row {}, as if another table stood there",
                lines[layout.header].0
            ),
            "keep one table a file",
        )),
        _ => Ok(layout),
    }
}

/// The layout of a file without a sane sample: its first line is the header.
fn by_the_header(path: &str, lines: &[Line<'_>]) -> Result<Layout> {
    let (row, header) = lines[0];
    let count = |delimiter: char| {
        let outside_quotes = header.split('"').step_by(2);
        outside_quotes
            .map(|part| part.matches(delimiter).count())
            .sum::<usize>()
    };
    let delimiter = ['|', ',', '\t', ';']
        .into_iter()
        .max_by_key(|&delimiter| count(delimiter))
        .unwrap_or(',');
    let mut cells = split(header, delimiter).unwrap_or_default().into_iter();
    if cells.len() > 0 && cells.all(|cell| cell.parse::<f64>().is_ok()) {
        return Err(without_header(path, row));
    }
    Ok(Layout {
        delimiter,
        header: 0,
        units: None,
    })
}

/// The error that a quote in row `row` does not close a cell.
pub(super) fn broken_quote(path: &str, row: usize) -> Error {
    Error::input(
        format!("{path}, row {row}"),
        "has a quote that is left open or has text behind it",
        "quote whole cells, each within its row",
    )
}

fn without_header(path: &str, row: usize) -> Error {
    Error::input(
        format!("{path}, row {row}"),
        "holds numbers where the header should be",
        "put a header such as \"time [s],command [V],spool [%]\" first, without a # before it",
    )
}
