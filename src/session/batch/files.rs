//! The files of a batch, and the folders of their reports.

use crate::report::Journal;
use crate::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The files that are named, and those of the folders that are, each once and in order; none that lies in `out` or is hidden.
///
/// # Errors
/// A folder that cannot be read; there is no file.
pub fn found(named: &[PathBuf], out: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    // A folder that is not there yet holds nothing.
    let out = out.canonicalize().ok();
    for path in named {
        match path.is_dir() {
            true => add(path, out.as_deref(), &mut files)?,
            false => files.push(path.clone()),
        }
    }
    let mut known = BTreeSet::new();
    files.retain(|file| known.insert(file.clone()));
    match files.is_empty() {
        true => Err(Error::input(
            named[0].display(),
            "has no files",
            "name a folder with records, or records",
        )),
        false => Ok(files),
    }
}

/// Adds the files in a `folder` and its folders, by name.
fn add(folder: &Path, out: Option<&Path>, files: &mut Vec<PathBuf>) -> Result<()> {
    if out.is_some() && folder.canonicalize().ok().as_deref() == out {
        return Ok(());
    }
    let unreadable = |error: std::io::Error| {
        Error::input(
            folder.display(),
            format!("cannot be read: {error}"),
            "check the path and its permissions",
        )
    };
    let entries: std::io::Result<Vec<_>> = folder.read_dir().map_err(unreadable)?.collect();
    let mut entries = entries.map_err(unreadable)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        let own = entry.file_type().map_err(unreadable)?;
        // A pipe or a device would be waited for; what leads nowhere is refused in its turn.
        let path = entry.path();
        let is_other = path
            .metadata()
            .is_ok_and(|what| !what.is_file() && !what.is_dir());
        match (hidden || is_other, own.is_dir()) {
            (true, _) => {}
            (false, true) => add(&path, out, files)?,
            (false, false) => files.push(path),
        }
    }
    Ok(())
}

/// The folders of reports that are taken, by the file that has each.
#[derive(Debug)]
pub(super) struct Folders(BTreeMap<String, String>);

impl Folders {
    /// Those of an earlier run.
    pub(super) fn of(journal: &Journal) -> Self {
        let taken = journal.folders();
        Self(
            taken
                .map(|(file, folder)| (folder.to_owned(), file.to_owned()))
                .collect(),
        )
    }

    /// The folder of the report of `file`, below that of the batch: called like it, and like no other's.
    pub(super) fn of_file(&mut self, file: &str) -> String {
        let plain = |c: char| match c {
            '/' | '\\' | ':' => '_',
            c if c.is_control() => '_',
            c => c,
        };
        let name: String = file
            .trim_start_matches(['.', '/'])
            .chars()
            .map(plain)
            .collect();
        // No file system takes names without end; the end is what tells files apart.
        let from = name.char_indices().rev().nth(99).map_or(0, |(at, _)| at);
        let name = &name[from..];
        let names = std::iter::once(name.to_owned())
            .chain((2..).map(|number| format!("{name} {number}")))
            .map(|name| format!("records/{name}"));
        let free = |folder: &String| self.0.get(folder).is_none_or(|taken| taken == file);
        let folder = names.into_iter().find(free).expect("numbers do not end");
        self.0.insert(folder.clone(), file.into());
        folder
    }
}
