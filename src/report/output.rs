//! The folder of results: asked for before the run starts, filled in one go when it has ended.

use crate::{Error, Result};
use std::fs;
use std::path::{Path, PathBuf};

/// How the names of folders begin that are being filled.
const DRAFT: &str = ".servobee-";

/// Where the results go.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// Checks that `path` can become the folder of results, and changes nothing. An existing one is taken only with
    /// `force`.
    ///
    /// # Errors
    /// It exists (without `force`), it is no folder, or its parent is missing or cannot be written.
    pub fn reserve(path: &Path, force: bool) -> Result<Self> {
        let place = || format!("--out {}", path.display());
        if path.exists() {
            if !path.is_dir() {
                return Err(Error::input(place(), "is a file", "name a folder"));
            }
            if !force {
                return Err(Error::input(
                    place(),
                    "exists",
                    "name another folder, or add --force to overwrite",
                ));
            }
        }
        let parent = parent(path);
        if !parent.is_dir() {
            let problem = format!("its parent folder {} does not exist", parent.display());
            return Err(Error::input(place(), problem, "create it first"));
        }
        tempfile::tempfile_in(parent).map_err(|error| {
            Error::input(
                place(),
                format!("cannot write there: {error}"),
                "name a folder that you may write to",
            )
        })?;
        Ok(Self {
            path: path.to_owned(),
        })
    }

    /// Deletes the folders in `parent` that nobody fills any more: whoever did was killed. One that cannot be deleted harms nobody.
    pub(crate) fn forget_drafts(parent: &Path) {
        let entries = fs::read_dir(parent).into_iter().flatten().flatten();
        for entry in entries {
            if entry.file_name().to_string_lossy().starts_with(DRAFT) {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes all `files` (name and content), or none: they are made aside and moved into place at the end.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn write(&self, files: &[(String, String)]) -> Result<()> {
        let attempt = || -> std::io::Result<()> {
            let mut builder = tempfile::Builder::new();
            builder.prefix(DRAFT);
            as_any_new(&mut builder, 0o777);
            let aside = builder.tempdir_in(parent(&self.path))?;
            for (name, content) in files {
                let path = aside.path().join(name);
                fs::write(&path, content)?;
                fs::File::open(&path)?.sync_all()?;
            }
            if !self.path.exists() {
                // All at once.
                fs::rename(aside.path(), &self.path)?;
                let _ = aside.keep();
                return Ok(());
            }
            for (name, _) in files {
                fs::rename(aside.path().join(name), self.path.join(name))?;
            }
            Ok(())
        };
        attempt().map_err(|error| {
            Error::failed(
                format!("writing {}: {error}", self.path.display()),
                "free some space or check its rights",
            )
        })
    }
}

/// Gives what is made the permissions that the user's mask leaves of `mode`, not those of something temporary.
pub(super) fn as_any_new(builder: &mut tempfile::Builder, mode: u32) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = (builder, mode);
}

/// The folder that a path lies in.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
