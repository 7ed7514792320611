//! The file in which a batch keeps its rows, one line each, as they are done.

use super::{BATCH_SCHEMA, BatchRow, RowStatus};
use crate::{Error, Result, input};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Longest file that is read, in bytes: a hundred thousand rows.
const LONGEST: u64 = 1 << 30;

/// The first line.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    schema: String,
    version: String,
    call: String,
}

/// The rows that are done, and the file in which they lie.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    rows: Vec<BatchRow>,
}

impl Journal {
    /// A new one at `path`, of the batch whose options have this fingerprint.
    ///
    /// # Errors
    /// The file cannot be written, or is in use.
    pub fn create(path: &Path, call: &str) -> Result<Self> {
        let file = OpenOptions::new().append(true).create(true).open(path);
        let file = file.map_err(|error| refused(path, &error))?;
        Self::of(path, file, call, Written::default())
    }

    /// The one that a batch with the same options has left at `path`. A last line that was not finished is dropped, and what
    /// failed is tried again.
    ///
    /// # Errors
    /// There is none, or one of another version or other options; it cannot be read and written, or is in use.
    pub fn resume(path: &Path, call: &str) -> Result<Self> {
        let written = Written::read(path, call)?;
        let file = OpenOptions::new().append(true).open(path);
        let file = file.map_err(|error| refused(path, &error))?;
        Self::of(path, file, call, written)
    }

    fn of(path: &Path, file: File, call: &str, written: Written) -> Result<Self> {
        input::lock(path, &file, "wait for it, or name another --out")?;
        file.set_len(written.bytes as u64)
            .map_err(|error| refused(path, &error))?;
        let mut journal = Self {
            path: path.into(),
            file,
            rows: written.rows,
        };
        if written.bytes == 0 {
            journal.write(&head(call))?;
        }
        Ok(journal)
    }

    /// Knows what the one at `path` has, too, to which others may be adding.
    ///
    /// # Errors
    /// It is of another version or other options, or cannot be read.
    pub fn know(&mut self, path: &Path, call: &str) -> Result<()> {
        self.rows.extend(Written::read(path, call)?.rows);
        Ok(())
    }

    /// Takes over what the one at `path` has, to which nobody adds any more.
    ///
    /// # Errors
    /// It is in use, of another version or other options, or cannot be read; this one cannot be written.
    pub fn take_over(&mut self, path: &Path, call: &str) -> Result<()> {
        let rows = Self::resume(path, call)?.rows;
        rows.into_iter().try_for_each(|row| self.push(row))
    }

    /// The row of the `file` with this content, where it is done: the last one that was written.
    pub fn row(&self, file: &str, sha256: &str, baseline: bool) -> Option<&BatchRow> {
        let same = |row: &&BatchRow| {
            row.file == file && row.sha256.as_deref() == Some(sha256) && row.baseline == baseline
        };
        self.rows.iter().rev().find(same)
    }

    /// The folders that reports have.
    pub fn folders(&self) -> impl Iterator<Item = (&str, &str)> {
        let rows = self.rows.iter();
        rows.filter_map(|row| Some((row.file.as_str(), row.folder.as_deref()?)))
    }

    /// Adds a row, and writes it at once.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn push(&mut self, row: BatchRow) -> Result<()> {
        self.write(&row)?;
        self.rows.push(row);
        Ok(())
    }

    fn write(&mut self, what: &impl Serialize) -> Result<()> {
        let written = self.file.write_all(line(what).as_bytes());
        written.and_then(|()| self.file.flush()).map_err(|error| {
            Error::failed(
                format!("writing {}: {error}", self.path.display()),
                "free some space, then add --resume: what is done is kept",
            )
        })
    }
}

/// What a file holds: the rows of its whole lines but those that failed, and how many bytes these lines have.
#[derive(Default)]
struct Written {
    rows: Vec<BatchRow>,
    bytes: usize,
}

impl Written {
    fn read(path: &Path, call: &str) -> Result<Self> {
        let text = input::text(path, LONGEST, "name the folder of a batch that was cut off")?;
        let bytes = text.rfind('\n').map_or(0, |end| end + 1);
        // One that was cut off, or that is being read, before its first line was whole.
        if bytes == 0 && line(&head(call)).starts_with(&text) {
            return Ok(Self::default());
        }
        let mut lines = text[..bytes].lines().enumerate();
        let first = lines.next().map(|(_, line)| serde_json::from_str(line));
        if !matches!(first, Some(Ok(found)) if head(call) == found) {
            return Err(Error::input(
                path.display(),
                "was written by a batch with other options, or by another version",
                "call it as then, or begin anew with --force",
            ));
        }
        let row = |(index, line): (usize, &str)| {
            serde_json::from_str(line).map_err(|error| {
                Error::input(
                    format!("{}, line {}", path.display(), index + 1),
                    format!("is no row of a batch: {error}"),
                    "begin anew with --force",
                )
            })
        };
        let mut rows: Vec<BatchRow> = lines.map(row).collect::<Result<_>>()?;
        rows.retain(|row| row.status != RowStatus::Failed);
        Ok(Self { rows, bytes })
    }
}

fn line(what: &impl Serialize) -> String {
    serde_json::to_string(what).expect("a row is plain data") + "\n"
}

fn head(call: &str) -> Head {
    Head {
        schema: BATCH_SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        call: call.into(),
    }
}

fn refused(path: &Path, error: &std::io::Error) -> Error {
    Error::input(
        path.display(),
        format!("cannot be written: {error}"),
        "check the path, its permissions and the space left",
    )
}
