//! Parses the call, hands it to a command, and lets `main` print what went wrong.

mod bench;
mod datasheet;
mod devices;
mod identify;
mod options;
mod simulate;
mod table;

use clap::{Parser, Subcommand};
use comfy_table::{CellAlignment, Table, presets};
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

/// A table without lines. The first row and column are heads; the rest is aligned to the right.
fn table(rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).add_rows(rows);
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        if i > 0 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.trim_fmt()
}

/// `value` with five significant digits.
fn significant(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&magnitude) {
        let decimals = 4 - magnitude.log10().floor() as i32;
        format!("{value:.*}", decimals.max(0) as usize)
    } else {
        format!("{value:.4e}")
    }
}
