//! `servobee matlab`.

use servobee::Result;

/// Prints a MATLAB function that calls this program: servobee.m
///
/// It takes timetables, tables, structs, matrices or files, and returns the report as a struct; in Octave, too. `help servobee`
/// there says how.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee matlab > servobee.m")]
pub(super) struct Arguments {}

pub(super) fn run(_: &Arguments) -> Result<()> {
    super::out::write(format_args!("{}", include_str!("matlab/servobee.m")));
    Ok(())
}
