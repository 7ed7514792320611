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
    /// The file cannot be written.
    pub fn create(path: &Path, call: &str) -> Result<Self> {
        let mut journal = Self {
            file: File::create(path).map_err(|error| refused(path, &error))?,
            path: path.into(),
            rows: Vec::new(),
        };
        journal.write(&head(call))?;
        Ok(journal)
    }

    /// The one that a batch with the same options has left at `path`. A last line that was not finished is dropped, and what
    /// failed is tried again.
    ///
    /// # Errors
    /// There is none, or one of another version or other options; it cannot be read and written.
    pub fn resume(path: &Path, call: &str) -> Result<Self> {
        let text = input::text(path, LONGEST, "name the folder of a batch that was cut off")?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines().enumerate();
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
        let file = OpenOptions::new().append(true).open(path);
        let file = file.map_err(|error| refused(path, &error))?;
        file.set_len(whole as u64)
            .map_err(|error| refused(path, &error))?;
        Ok(Self {
            path: path.into(),
            file,
            rows,
        })
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

    fn write(&mut self, line: &impl Serialize) -> Result<()> {
        let mut line = serde_json::to_string(line).expect("a row is plain data");
        line.push('\n');
        let written = self.file.write_all(line.as_bytes());
        written.and_then(|()| self.file.flush()).map_err(|error| {
            Error::failed(
                format!("writing {}: {error}", self.path.display()),
                "free some space, then add --resume: what is done is kept",
            )
        })
    }
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
