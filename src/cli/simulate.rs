//! `servobee simulate`.

use super::colour;
use super::reading::ReadingOptions;
use super::table::{number, table};
use servobee::Result;
use servobee::record::{Record, check_mappings};
use servobee::report::{ModelFile, OutputFile};
use servobee::session::{Simulated, SimulatedChannel};
use std::path::PathBuf;

/// Simulates a record with a model and compares the two
///
/// Prints for every output of the model its root mean squared error against the measurement, the fit
/// (100 * (1 - |e| / |y - mean y|)), and the integration error: the largest change when the integration steps are
/// halved. A record with time and command alone is simulated without a comparison.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee simulate model.toml record.csv
  servobee simulate model.toml run.csv --map \"x_cmd_mm=command [mm]\" --out simulated.csv")]
pub(super) struct Arguments {
    /// The model, as identify writes it
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// The record: a CSV file whose header names channel and unit, "time [s],command [V],spool [%]"
    #[arg(value_name = "RECORD.csv")]
    record: PathBuf,
    #[command(flatten)]
    reading: ReadingOptions,
    /// Write time, command, measured and simulated outputs to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Replace the file of --out if it exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let file = ModelFile::read(&arguments.model)?;
    let reading = arguments.reading.reading();
    let record = Record::read_as(&arguments.record, &reading)?;
    check_mappings(&reading.mappings, &[&record])?;
    let path = arguments.out.as_ref();
    let output = path.map(|path| OutputFile::create(path, arguments.force));
    let output = output.transpose()?;
    let remarks = record.remarks();
    let simulated = Simulated::new(&file, record)?;
    for remark in remarks {
        colour::warning(remark);
    }
    tell!("{}", comparison(&simulated));
    match output {
        Some(output) => output.finish(&simulated.to_csv()),
        None => Ok(()),
    }
}

/// One line for each observed output.
fn comparison(simulated: &Simulated) -> String {
    let heads = ["channel", "unit", "RMSE", "fit %", "integration error"];
    let row = |channel: SimulatedChannel| {
        let score = channel.score;
        let fit = score.and_then(|score| score.fit_percent);
        vec![
            channel.name.into(),
            channel.unit,
            score.map_or("not measured".into(), |score| number(score.rmse)),
            fit.map_or("-".into(), |fit| format!("{fit:.3}")),
            number(channel.integration_error),
        ]
    };
    table(&heads, simulated.channels().into_iter().map(row))
}
