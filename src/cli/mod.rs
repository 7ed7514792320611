//! Parses the call, hands it to a command, and lets `main` print what went wrong.

mod bench;
mod datasheet;
mod devices;
mod identify;
mod options;
mod simulate;
mod table;

use clap::{Parser, Subcommand};
use servobee::Result;

/// Finds the parameters of electro-hydraulic servo valves with the Bees Algorithm.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Identify(identify::Arguments),
    Datasheet(datasheet::Arguments),
    Simulate(simulate::Arguments),
    Devices(devices::Arguments),
    Bench(bench::Arguments),
}

/// Runs the command that the process was called with.
pub(crate) fn run() -> Result<()> {
    match Cli::parse().command {
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Datasheet(arguments) => datasheet::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
    }
}
