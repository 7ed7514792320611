//! `servobee simulate`.

use super::colour;
use super::reading::ReadingOptions;
use super::table::{number, table};
use servobee::evaluate::problem::Series;
use servobee::evaluate::{STATE_LIMIT, Score, simulate};
use servobee::model::{Complete, Output, Outputs, Structure};
use servobee::record::{self, Record, check_mappings};
use servobee::report::{ModelFile, OutputFile};
use servobee::{Error, Result};
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
    let structure = file.complete_structure()?;
    let parameters = file.parameters(structure.parameters())?;
    let reading = arguments.reading.reading();
    let record = Record::read_as(&arguments.record, &reading)?;
    check_mappings(&reading.mappings, &[&record])?;
    let mut series = Series::to_simulate(&record, &structure)?;
    let path = arguments.out.as_ref();
    let file = path.map(|path| OutputFile::create(path, arguments.force));
    let file = file.transpose()?;
    for remark in record.remarks() {
        colour::warning(remark);
    }

    // The steps that identify takes within the same bounds, so that its errors come out again.
    let rate = structure.fastest_rate(&parameters);
    let values = Complete::nominal(&parameters);
    let mut simulated = |refine| {
        series.set_steps(rate, refine);
        let outputs = simulate::outputs(&structure, &values, &series);
        match outputs
            .iter()
            .position(|row| !row.0.iter().all(|y| y.abs() < STATE_LIMIT))
        {
            None => Ok(outputs),
            Some(row) => Err(Error::failed(
                format!(
                    "the simulation of {} diverges at {} s",
                    record.path,
                    record.time()[row]
                ),
                "check the model's values and the units of the record",
            )),
        }
    };
    let outputs = simulated(1)?;
    let finer = simulated(2)?;
    tell!("{}", comparison(&structure, &record, &outputs, &finer));
    match file {
        Some(file) => file.finish(&csv(&structure, &record, &outputs)),
        None => Ok(()),
    }
}

/// One line for each observed output.
fn comparison(
    structure: &Structure,
    record: &Record,
    outputs: &[Outputs<f64>],
    finer: &[Outputs<f64>],
) -> String {
    let heads = ["channel", "unit", "RMSE", "fit %", "integration error"];
    let mut rows = Vec::new();
    for &output in &structure.observed {
        let own =
            |rows: &[Outputs<f64>]| -> Vec<f64> { rows.iter().map(|row| row[output]).collect() };
        let (outputs, finer) = (own(outputs), own(finer));
        let score = measured(record, output).map(|measured| {
            Score::new(measured.values.iter().copied().zip(outputs.iter().copied()))
        });
        let fit = score.and_then(|score| score.fit_percent);
        let change = outputs
            .iter()
            .zip(&finer)
            .map(|(y, finer)| (y - finer).abs());
        rows.push(vec![
            output.name().into(),
            structure.unit(output).into(),
            score.map_or("not measured".into(), |score| number(score.rmse)),
            fit.map_or("-".into(), |fit| format!("{fit:.3}")),
            number(change.fold(0.0, f64::max)),
        ]);
    }
    table(&heads, rows)
}

/// What `record` has measured of `output`.
fn measured(record: &Record, output: Output) -> Option<&record::Series> {
    let channel = output.channel();
    record
        .get(channel)
        .filter(|_| record.responses().contains(&channel))
}

/// Time, command, and every observed output: measured, where it is, and simulated.
fn csv(structure: &Structure, record: &Record, outputs: &[Outputs<f64>]) -> String {
    let command = record.command();
    let mut columns = vec![
        ("time [s]".to_string(), record.time().to_vec()),
        (
            format!("command [{}]", command.unit),
            command.values.clone(),
        ),
    ];
    for &output in &structure.observed {
        let unit = structure.unit(output);
        if let Some(measured) = measured(record, output) {
            columns.push((
                format!("{} [{unit}]", output.name()),
                measured.values.clone(),
            ));
        }
        let simulated = outputs.iter().map(|row| row[output]).collect();
        columns.push((format!("simulated_{} [{unit}]", output.name()), simulated));
    }
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..record.samples() {
        let cells: Vec<String> = columns
            .iter()
            .map(|(_, values)| values[row].to_string())
            .collect();
        text += &(cells.join(",") + "\n");
    }
    text
}
