//! Ctrl-C, and the signal by which a system asks a program to end.

use super::colour;
use servobee::evaluate::Interrupt;
use servobee::{Error, Result};
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// What a shell is told of a program that a signal has ended.
const INTERRUPTED: i32 = 130;

/// Signals this close together are one: `timeout` asks the program and then its group, a terminal asks the whole group, and
/// who has started it may pass that on.
const ONE: Duration = Duration::from_secs(1);

/// When the program was asked to stop.
static ASKED: OnceLock<Instant> = OnceLock::new();

/// From now on the first Ctrl-C only asks to stop, and [`asked`] says so; one that comes later ends the program. Where whoever
/// started the program has it ignore such signals, as `nohup` does, it goes on ignoring them.
///
/// # Errors
/// If the system refuses.
pub(super) fn watch() -> Result<()> {
    let handler = || match ASKED.get() {
        None => {
            ASKED.get_or_init(Instant::now);
            colour::warning("stopping with what is known so far; Ctrl-C again quits at once");
        }
        Some(first) if first.elapsed() < ONE => {}
        Some(_) => std::process::exit(INTERRUPTED),
    };
    match ctrlc::try_set_handler(handler) {
        Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(()),
        Err(error) => Err(Error::failed(
            format!("Ctrl-C cannot be watched: {error}"),
            "try again",
        )),
    }
}

/// Whether the program was asked to stop.
fn asked() -> bool {
    ASKED.get().is_some()
}

/// What tells a run that.
pub(super) fn interrupt() -> Interrupt {
    Interrupt::new(asked)
}

/// Breaks off once that was asked for.
pub(super) fn goes_on() -> ControlFlow<()> {
    match asked() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}
