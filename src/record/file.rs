//! Files of every format that is read.

use super::join::join;
use super::reading::Reading;
use super::table::Table;
use super::text::quoted;
use super::{csv, mat, tdms, xlsx};
use crate::{Error, Result, input};
use std::path::{Path, PathBuf};

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
    Ok(read_one(path)?.0)
}

/// The columns of the file at `path`, and its content. `a.xlsx#Sheet 2` is that sheet of a workbook, if no file is called so.
fn read_one(path: &Path) -> Result<(Table, Vec<u8>)> {
    let name = path.display().to_string();
    match sheet(path) {
        Some((file, sheet)) => {
            let content = bytes(Path::new(file))?;
            if !xlsx::is_xlsx(&content) {
                let problem = format!(
                    "is no Excel workbook, which has sheets such as {}",
                    quoted(sheet)
                );
                return Err(Error::input(
                    file,
                    problem,
                    "leave out what stands behind #",
                ));
            }
            let mut table = xlsx::parse(file, &content, Some(sheet))?;
            table.path = name;
            Ok((table, content))
        }
        None => {
            let content = bytes(path)?;
            Ok((parse(&name, &content)?, content))
        }
    }
}

/// `a.xlsx` and `Sheet 2` of `a.xlsx#Sheet 2`.
fn sheet(path: &Path) -> Option<(&str, &str)> {
    let (file, sheet) = path.to_str()?.rsplit_once('#')?;
    let is_one = !path.exists() && !file.is_empty() && !sheet.is_empty();
    is_one.then_some((file, sheet))
}

/// The columns of the file at `path`, and its content. `a.csv+b.csv` are the columns of both, if no file is called so.
///
/// # Errors
/// As of [`read`], and of [`join`] of several files.
pub(super) fn read_joined(path: &Path, reading: &Reading) -> Result<(Table, Vec<u8>)> {
    let parts = parts(path);
    let (first, more) = parts.split_first().expect("a path is one part at least");
    let mut all = read_one(first)?;
    for path in more {
        let (table, content) = read_one(path)?;
        all.0 = join(all.0, table, reading)?;
        all.1.extend(content);
    }
    Ok(all)
}

/// `a.csv` and `b.csv` of `a.csv+b.csv`, and a file's path otherwise.
fn parts(path: &Path) -> Vec<PathBuf> {
    let parts: Vec<&str> = path.to_str().unwrap_or_default().split('+').collect();
    match parts.len() > 1 && !path.exists() && !parts.contains(&"") {
        true => parts.into_iter().map(PathBuf::from).collect(),
        false => vec![path.into()],
    }
}

/// The columns in `bytes`, the content of the file called `path`, which is a MAT file if it begins or is called so, an Excel
/// workbook if it begins so, and CSV otherwise.
///
/// # Errors
/// All that [`csv::parse`], [`mat::parse`] and [`xlsx::parse`] refuse; a TDMS file, or a workbook of the old kind.
pub(super) fn parse(path: &str, bytes: &[u8]) -> Result<Table> {
    const OLD_WORKBOOK: &[u8] = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1";
    if let Some(refusal) = tdms::refusal(path, bytes) {
        return Err(refusal);
    }
    if bytes.starts_with(OLD_WORKBOOK) {
        let remedy = "save it as .xlsx, or its sheet as CSV in UTF-8";
        return Err(Error::input(
            path,
            "is an Excel workbook of before 2007",
            remedy,
        ));
    }
    let named_mat = Path::new(path)
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("mat"));
    match named_mat || mat::is_mat(bytes) {
        true => mat::parse(path, bytes),
        false if xlsx::is_xlsx(bytes) => xlsx::parse(path, bytes, None),
        false => csv::parse(path, bytes),
    }
}
