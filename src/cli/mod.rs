//! Parses the call, hands it to a command, and lets `main` print what went wrong.

#[macro_use]
mod out;

mod batch;
mod bench;
mod card;
pub(crate) mod colour;
mod compare;
mod completions;
mod datasheet;
mod devices;
mod diagnosis;
mod effects;
mod export;
mod identify;
mod inspect;
mod interrupt;
mod matlab;
mod options;
mod plot;
mod ranks;
mod reading;
mod scorecard;
mod simulate;
mod synthesize;
mod table;
mod work;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use servobee::{Error, Result};

const HELP_WITHOUT_COMMAND: ErrorKind = ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;

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
    Compare(compare::Arguments),
    Batch(batch::Arguments),
    Inspect(inspect::Arguments),
    Datasheet(datasheet::Arguments),
    Simulate(simulate::Arguments),
    Export(export::Arguments),
    Matlab(matlab::Arguments),
    Synthesize(synthesize::Arguments),
    Scorecard(scorecard::Arguments),
    Effects(effects::Arguments),
    Devices(devices::Arguments),
    Bench(bench::Arguments),
    Completions(completions::Arguments),
}

/// Runs the command that the process was called with, or serves the process that does.
pub(crate) fn run() -> Result<()> {
    if ranks::join()? {
        return Ok(());
    }
    let done = command();
    ranks::leave();
    done
}

fn command() -> Result<()> {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version are no errors, and come with their own exit code.
        Err(error) if !error.use_stderr() || error.kind() == HELP_WITHOUT_COMMAND => {
            ranks::leave();
            error.exit()
        }
        Err(error) => return Err(wrong_call(&error)),
    };
    let done = match cli.command {
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Batch(arguments) => batch::run(&arguments),
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Datasheet(arguments) => datasheet::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Matlab(arguments) => matlab::run(&arguments),
        Command::Synthesize(arguments) => synthesize::run(&arguments),
        Command::Scorecard(arguments) => scorecard::run(&arguments),
        Command::Effects(arguments) => effects::run(&arguments),
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, Cli::command()),
    };
    // What was printed before a failure is printed too.
    let printed = out::finish();
    done.and(printed)
}

/// A call that clap refuses, in one line.
fn wrong_call(error: &clap::Error) -> Error {
    let text = error.render().to_string();
    let cause: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty())
        .collect();
    let cause = cause.join(" ");
    Error::input(
        "call",
        cause.trim_start_matches("error: "),
        "servobee --help and servobee COMMAND --help say more",
    )
}
