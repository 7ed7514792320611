//! Reading the files that a user gives: never more of one than a file of its kind can hold.

use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::fs::{File, TryLockError};
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

/// The content of the file at `path`, which may have `longest` bytes; `shorter` says what to do about one that has more.
/// Its size is asked for before it is read, and what has no size, such as a pipe, is not read any further.
///
/// # Errors
/// It is missing, unreadable or longer.
pub(crate) fn bytes(path: &Path, longest: u64, shorter: &str) -> Result<Vec<u8>> {
    let unreadable = |error: std::io::Error| {
        Error::input(
            path.display(),
            format!("cannot be read: {error}"),
            "check the path and that it is a readable file",
        )
    };
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    if file.metadata().map_err(unreadable)?.len() <= longest {
        file.take(longest + 1)
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        if bytes.len() as u64 <= longest {
            return Ok(bytes);
        }
    }
    Err(Error::input(
        path.display(),
        format!("is longer than {} MiB", longest >> 20),
        shorter,
    ))
}

/// Keeps other runs from writing the `file` at `path` as long as it is open; `remedy` says what to do about one that does.
///
/// A lock that is taken is asked for again for half a second: a program that is being started has every file of its parent open
/// until it runs, so that what has been closed here may be locked a moment longer.
///
/// # Errors
/// Another run has it open.
pub(crate) fn lock(path: &Path, file: &File, remedy: &str) -> Result<()> {
    let asked = Instant::now();
    while let Err(TryLockError::WouldBlock) = file.try_lock() {
        if asked.elapsed() > Duration::from_millis(500) {
            return Err(Error::input(
                path.display(),
                "is in use by a run that has not ended",
                remedy,
            ));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    // A file system without locks takes no harm but from two runs that are given the same file.
    Ok(())
}

/// The SHA-256 of `bytes`, in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let digits = |byte: u8| format!("{byte:02x}");
    Sha256::digest(bytes).into_iter().map(digits).collect()
}

/// [`bytes`] as text.
///
/// # Errors
/// As [`bytes`]; a line that is not UTF-8.
pub(crate) fn text(path: &Path, longest: u64, shorter: &str) -> Result<String> {
    String::from_utf8(bytes(path, longest, shorter)?).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let before = &error.as_bytes()[..valid];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::input(
            format!("{}, line {line}", path.display()),
            "is not UTF-8 text",
            "save the file as text in UTF-8",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_that_is_held_a_moment_longer_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("locked");
        let held = File::create(&path).unwrap();
        held.try_lock().unwrap();
        let file = File::open(&path).unwrap();
        assert!(lock(&path, &file, "wait for it").is_err());
        let holder = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            drop(held);
        });
        lock(&path, &file, "wait for it").unwrap();
        holder.join().unwrap();
    }
}
