//! Ctrl-C, and the signal by which a system asks a program to end.

use super::colour;
use servobee::{Error, Result};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// What a shell is told of a program that a signal has ended.
const INTERRUPTED: i32 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C only asks to stop, and [`goes_on`] says so; the second ends the program. Where whoever
/// started the program has it ignore such signals, as `nohup` does, it goes on ignoring them.
///
/// # Errors
/// If the system refuses.
pub(super) fn watch() -> Result<()> {
    let handler = || {
        if ASKED.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED);
        }
        colour::warning("stopping with what is known so far; Ctrl-C again quits at once");
    };
    match ctrlc::try_set_handler(handler) {
        Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(()),
        Err(error) => Err(Error::failed(
            format!("Ctrl-C cannot be watched: {error}"),
            "try again",
        )),
    }
}

/// Breaks off once that was asked for.
pub(super) fn goes_on() -> ControlFlow<()> {
    match ASKED.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}
