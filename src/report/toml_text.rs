//! The text of a TOML file that a user wrote, and what is wrong with it at which place.

use crate::record::quoted;
use crate::{Error, Result, input};
use std::ops::Range;
use std::path::Path;
use toml::de::DeTable;

/// Longest file that is read, in bytes.
const LONGEST: u64 = 1 << 20;

/// Longest message of the TOML reader that is passed on, in characters.
const LONGEST_MESSAGE: usize = 400;

/// A TOML file as text.
#[derive(Debug)]
pub(super) struct TomlText {
    pub(super) path: String,
    pub(super) text: String,
    /// What shows how such a file is written.
    example: &'static str,
}

impl TomlText {
    /// The file at `path`; `kind` says which file to give instead of one that cannot be read.
    pub(super) fn read(path: &Path, kind: &str, example: &'static str) -> Result<Self> {
        let text = input::text(path, LONGEST, kind)?;
        Ok(Self::new(&path.display().to_string(), &text, example))
    }

    pub(super) fn new(path: &str, text: &str, example: &'static str) -> Self {
        Self {
            path: path.into(),
            text: text.into(),
            example,
        }
    }

    /// The file's keys, with their places in the text.
    pub(super) fn table(&self) -> Result<DeTable<'_>> {
        let table = DeTable::parse(&self.text).map_err(|error| self.toml_error(&error))?;
        Ok(table.into_inner())
    }

    /// What the TOML reader refuses.
    pub(super) fn toml_error(&self, error: &toml::de::Error) -> Error {
        // What the message repeats of the file may be anything.
        let message = error
            .message()
            .trim()
            .replace('\n', ", ")
            .replace("; ", ", ");
        let shown = message.chars().take(LONGEST_MESSAGE);
        let shown = shown.map(|c| if c.is_control() { '\u{fffd}' } else { c });
        self.error(
            error.span().unwrap_or(0..0),
            shown.collect::<String>(),
            format!("correct the line; {}", self.example),
        )
    }

    /// An error at a place of the text: its line, as it stands there.
    pub(super) fn error(
        &self,
        span: Range<usize>,
        problem: impl ToString,
        remedy: impl ToString,
    ) -> Error {
        let start = span.start.min(self.text.len());
        let number = 1 + self.text[..start].matches('\n').count();
        let line = self.text.lines().nth(number - 1).unwrap_or_default().trim();
        Error::input(
            format!("{}, line {number}, {}", self.path, quoted(line)),
            problem.to_string(),
            remedy.to_string(),
        )
    }
}
