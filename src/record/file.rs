//! Files of every format that is read.

use super::table::Table;
use super::{csv, mat};
use crate::{Result, input};
use std::path::Path;

/// Longest file that is read, in bytes.
const LONGEST: u64 = 256 << 20;

/// The content of the file at `path`.
///
/// # Errors
/// A file that is missing, unreadable or longer than 256 MiB.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>> {
    let shorter = "save only the record's columns, or fewer samples";
    input::bytes(path, LONGEST, shorter)
}

/// The columns of the file at `path`.
///
/// # Errors
/// As of [`bytes`], and all that [`parse`] refuses.
pub(super) fn read(path: &Path) -> Result<Table> {
    parse(&path.display().to_string(), &bytes(path)?)
}

/// The columns in `bytes`, the content of the file called `path`, which is a MAT file if it begins or is called so, and
/// CSV otherwise.
///
/// # Errors
/// All that [`csv::parse`] and [`mat::parse`] refuse.
pub(super) fn parse(path: &str, bytes: &[u8]) -> Result<Table> {
    let named_mat = Path::new(path)
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("mat"));
    match named_mat || mat::is_mat(bytes) {
        true => mat::parse(path, bytes),
        false => csv::parse(path, bytes),
    }
}
