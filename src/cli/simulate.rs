//! `servobee simulate`.

use servobee::Result;

/// TODO
#[derive(clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run(_: &Arguments) -> Result<()> {
    Ok(())
}
