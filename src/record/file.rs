//! Files of every format that is read.

use super::table::Table;
use super::{csv, mat};
use crate::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// The columns of the file at `path`, which is a MAT file if it begins or is called so, and CSV otherwise.
///
/// # Errors
/// A file that is missing or unreadable, and all that [`csv::parse`] and [`mat::parse`] refuse.
pub(super) fn read(path: &Path) -> Result<Table> {
    let shown = path.display().to_string();
    let unreadable = |error: std::io::Error| {
        Error::input(
            &shown,
            format!("cannot be read: {error}"),
            "check the path and that it is a readable file",
        )
    };
    let mut reader = BufReader::new(File::open(path).map_err(unreadable)?);
    let named_mat = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("mat"));
    if named_mat || mat::is_mat(reader.fill_buf().map_err(unreadable)?) {
        mat::parse(&shown, &mat::bytes_of(&shown, reader, unreadable)?)
    } else {
        let bytes = csv::lines_of(&shown, &mut reader, unreadable)?;
        csv::decode(&shown, bytes)
    }
}
