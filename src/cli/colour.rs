//! What stands out on a terminal. Elsewhere, and where `NO_COLOR` is set, it is plain text.

use anstyle::{AnsiColor, Style};
use std::fmt::Display;
use std::io::Write;

const ANSWER: Style = Style::new().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
const ERROR: Style = AnsiColor::Red.on_default().bold();

/// Prints the answer to what was asked.
pub(crate) fn answer(text: impl Display) {
    tell!("{ANSWER}{text}{ANSWER:#}");
}

/// Prints what undermines a result.
pub(crate) fn warning(text: impl Display) {
    complain(format_args!(
        "servobee: {WARNING}warning:{WARNING:#} {text}"
    ));
}

/// Prints why there is no result.
pub(crate) fn error(text: impl Display) {
    complain(format_args!("{ERROR}servobee:{ERROR:#} {text}"));
}

fn complain(text: std::fmt::Arguments) {
    // Where nobody listens there is nobody to tell.
    let _ = writeln!(anstream::stderr(), "{text}");
}
