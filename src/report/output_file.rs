//! A file to be written: refused before the work starts, whole or not there after it.

use super::output::{as_any_new, parent};
use crate::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A result file that is announced. Until [`OutputFile::finish`] nothing lies in its folder, so that an interrupted run
/// leaves nothing.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    force: bool,
}

impl OutputFile {
    /// Makes sure that a file can be written to `path`; with `force` it may replace one.
    ///
    /// # Errors
    /// The file exists and `force` is not given, it is no regular file, or its folder cannot be written to.
    pub fn create(path: impl AsRef<Path>, force: bool) -> Result<Self> {
        let path = path.as_ref();
        let refuse = |problem, remedy| Err(Error::input(path.display(), problem, remedy));
        match path.symlink_metadata() {
            Ok(_) if !force => return refuse("exists already", "give another name or --force"),
            Ok(file_type) if !file_type.is_file() => {
                return refuse("is no regular file", "give another name");
            }
            _ => {}
        }
        // One without a name: it is gone with the process, whatever ends that.
        tempfile::tempfile_in(parent(path)).map_err(|error| cannot_write(path, &error))?;
        Ok(Self {
            path: path.into(),
            force,
        })
    }

    /// Puts the file with this text into its place, all at once.
    ///
    /// # Errors
    /// The text cannot be written, or another file has taken the place meanwhile.
    pub fn finish(self, text: &str) -> Result<()> {
        self.finish_bytes(text.as_bytes())
    }

    /// [`OutputFile::finish`] with contents that are no text.
    ///
    /// # Errors
    /// As [`OutputFile::finish`].
    pub fn finish_bytes(self, contents: &[u8]) -> Result<()> {
        let wrong = |error: &std::io::Error| {
            Error::failed(
                format!("writing {}: {error}", self.path.display()),
                "free some space or check its rights",
            )
        };
        let mut draft = draft(parent(&self.path)).map_err(|error| wrong(&error))?;
        draft.write_all(contents).map_err(|error| wrong(&error))?;
        draft.as_file().sync_all().map_err(|error| wrong(&error))?;
        let placed = match self.force {
            true => draft.persist(&self.path),
            false => draft.persist_noclobber(&self.path),
        };
        placed.map_err(|error| wrong(&error.error))?;
        Ok(())
    }
}

/// A file beside the place that it will take.
fn draft(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    as_any_new(&mut builder, 0o666);
    builder.tempfile_in(folder)
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Error {
    Error::input(
        path.display(),
        format!("cannot be written: {error}"),
        "check the path, its permissions and the space left",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_only_with_force_and_an_unfinished_one_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let output = OutputFile::create(&path, false).unwrap();
        // An interrupt drops nothing: there must not be a draft while the run lasts.
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
        output.finish("1").unwrap();
        assert_eq!(folder.path().read_dir().unwrap().count(), 1);
        let error = OutputFile::create(&path, false).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        OutputFile::create(&path, true)
            .unwrap()
            .finish("2")
            .unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "2");
        assert!(OutputFile::create(folder.path(), true).is_err());
    }

    #[test]
    fn a_file_that_appears_meanwhile_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let output = OutputFile::create(&path, false).unwrap();
        std::fs::write(&path, "theirs").unwrap();
        assert!(output.finish("ours").is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
    }
}
