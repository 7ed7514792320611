//! Standard output, which may be a pipe that nobody reads any more, or a disk that is full.

use servobee::{Error, Result};
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::Mutex;

/// What has gone wrong first; after it nothing more is written.
static FAILURE: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a line on standard output. Styles reach terminals only.
macro_rules! tell {
    () => { $crate::cli::out::write(format_args!("\n")) };
    ($($text:tt)+) => {
        $crate::cli::out::write(format_args!("{}\n", format_args!($($text)+)))
    };
}

/// Prints `text` on standard output.
pub(super) fn write(text: Arguments) {
    let mut failure = FAILURE.lock().expect("nothing in here panics");
    if failure.is_none() {
        *failure = anstream::stdout().write_fmt(text).err();
    }
}

/// Brings what was printed to where it goes. A reader that has gone, as `head` does, is no failure.
///
/// # Errors
/// If something could not be written.
pub(crate) fn finish() -> Result<()> {
    let failure = FAILURE.lock().expect("nothing in here panics").take();
    match failure.map_or_else(|| io::stdout().flush(), Err) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::failed(
            format!("standard output cannot be written: {error}"),
            "free some space there",
        )),
        _ => Ok(()),
    }
}
