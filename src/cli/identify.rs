//! `servobee identify`.

use super::options::{Options, progress};
use super::table::{number, table};
use servobee::diagnose::{Compared, Identified, Measurements, identify};
use servobee::evaluate::{parameters_for, structure_for};
use servobee::model::Output;
use servobee::record::{Mapping, Record};
use servobee::report::{Document, ModelFile};
use servobee::search::{Plan, Settings, Start};
use servobee::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Fit a model to measurements and score it on data that was never fitted
///
/// The base model follows from the channels that the records have. Without --hold-out the last 30 % of each record are
/// held out.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee identify tests/data/bench.csv
  servobee identify run1.csv --hold-out run2.csv --map \"t_ms=time [ms]\" --map \"u=command [V]\" --out result

A record's header names channel and unit: time [s], command [V], spool [%], flow [L/min], supply_pressure [bar],
return_pressure, pressure_a, pressure_b, position [mm], temperature [degC]. Needed are time, command and one of spool,
flow and position.")]
pub(super) struct Arguments {
    /// Records to fit
    #[arg(required = true, value_name = "RECORD.csv")]
    records: Vec<PathBuf>,
    /// Records to score the model on, which are not fitted
    #[arg(long, value_name = "RECORD.csv", num_args = 1..)]
    hold_out: Vec<PathBuf>,
    /// A column of the files and what it is: "x_cmd_mm=command [mm]"
    #[arg(long, value_name = "COLUMN=CHANNEL [UNIT]")]
    map: Vec<Mapping>,
    /// A model file: a whole model, or just the settings and parameters that differ from the base model's
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Effects that may be added to the base model
    #[arg(long, value_name = "all|none|NAME,...", default_value = "all")]
    effects: String,
    /// Largest number of effects that are added
    #[arg(long, value_name = "N", default_value_t = 4)]
    max_effects: usize,
    #[command(flatten)]
    options: Options,
}

/// The search of a measurement: enough to find the valley, whose bottom the polish finds.
const SETTINGS: Settings = Settings {
    itr: 60,
    ..Settings::standard()
};

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    if !matches!(arguments.effects.as_str(), "all" | "none") {
        let place = format!("--effects {}", arguments.effects);
        return Err(Error::input(
            place,
            "this version's catalogue of effects is empty",
            "give all or none",
        ));
    }
    let output = arguments.options.output()?;
    let read = |paths: &[PathBuf]| {
        paths
            .iter()
            .map(|path| read(path, &arguments.map))
            .collect::<Result<Vec<Record>>>()
    };
    let (records, held_out) = (read(&arguments.records)?, read(&arguments.hold_out)?);
    for record in &records {
        record.check_excited()?;
    }
    let warnings = records
        .iter()
        .chain(&held_out)
        .flat_map(Record::remarks)
        .collect();
    let file = arguments
        .model
        .as_deref()
        .map(ModelFile::read)
        .transpose()?;
    let mut structure = match &file {
        Some(file) => file.structure(|| structure_for(&records))?,
        None => structure_for(&records)?,
    };
    structure.full_scale = arguments.options.full_scale.unwrap_or(structure.full_scale);
    let parameters = parameters_for(&structure, &records);
    let parameters = match &file {
        Some(file) => file.parameters(parameters)?,
        None => parameters,
    };
    let rate = structure.fastest_rate(&parameters);
    let measurements = Measurements::new(&records, &held_out, &structure, rate)?;

    let mut chosen = arguments.options.evaluator()?;
    let plan = Plan {
        settings: SETTINGS,
        start: Start::Uniform,
        seed: arguments.options.seed,
        polish: true,
        coloured: true,
    };
    let (bar, mut tick) = progress("searching", SETTINGS.itr);
    let result = identify(
        structure,
        parameters,
        measurements,
        chosen.evaluator.as_mut(),
        &plan,
        &mut tick,
    );
    bar.finish_and_clear();
    let identified = result?;
    let seconds = started.elapsed().as_secs_f64();
    let document = Document::of(
        &identified,
        &chosen,
        arguments.options.seed,
        seconds,
        warnings,
    );
    print(&identified, &document);
    if let Some(output) = output {
        let files = [
            ("report.json", document.to_json()),
            ("model.toml", model_toml(&identified)),
            ("residual.csv", residual_csv(&identified)),
        ];
        output.write(&files)?;
        println!(
            "\nWritten to {}: report.json, model.toml, residual.csv",
            output.path().display()
        );
    }
    Ok(())
}

fn read(path: &PathBuf, mappings: &[Mapping]) -> Result<Record> {
    let record = Record::read(path, mappings)?;
    record.check_response()?;
    Ok(record)
}

fn print(identified: &Identified, document: &Document) {
    let structure = &identified.problem.structure;
    let count = |records: &[servobee::evaluate::problem::Series]| {
        records
            .iter()
            .flat_map(|r| &r.samples)
            .filter(|s| s.weight > 0.0)
            .count()
    };
    println!(
        "Fitted {} rows of {} record(s), held out {} rows; full scale {} {}.",
        count(&identified.measurements.fit),
        identified.measurements.fit.len(),
        count(&identified.measurements.hold_out),
        number(structure.full_scale),
        structure.command_unit,
    );
    let mut rows = Vec::new();
    for &output in &structure.observed {
        let channel = output.name();
        let Some(held) = identified.errors.hold_out.get(channel) else {
            continue;
        };
        let fit = &identified.errors.fit[channel];
        rows.push(vec![
            format!("{channel} [{}]", structure.unit(output)),
            number(fit.rmse),
            number(held.rmse),
            held.fit_percent
                .map_or("-".into(), |fit| format!("{fit:.2}")),
            number(identified.noise[channel].value),
            identified.noise[channel].method.into(),
        ]);
    }
    let head = [
        "channel",
        "RMS fitted",
        "RMS held out",
        "fit % held out",
        "noise floor",
        "from",
    ];
    println!("\n{}\n", table(&head, rows));
    let rows: Vec<Vec<String>> = document
        .parameters
        .iter()
        .map(|parameter| {
            let interval = format!("{} .. {}", number(parameter.low), number(parameter.high));
            vec![
                parameter.name.clone(),
                parameter.unit.clone(),
                number(parameter.value),
                if parameter.fixed {
                    "fixed".into()
                } else {
                    interval
                },
                if parameter.at_bound {
                    "at its bound".into()
                } else {
                    String::new()
                },
            ]
        })
        .collect();
    println!(
        "{}",
        table(&["parameter", "unit", "value", "95 % interval", ""], rows)
    );
    for line in &document.not_identifiable {
        println!("Not identifiable: {line}");
    }
    println!();
    let known = &document.remaining.correlates_with;
    match (document.remaining.structured, known.is_empty()) {
        (true, false) => println!(
            "The residual is more than noise: it depends on {}. The base model lacks something.",
            known.join(", ")
        ),
        (true, true) => println!(
            "The residual is far above the noise floor, but follows neither the command, its powers, rate and direction \
             nor time: the base model lacks something."
        ),
        (false, _) => {
            println!("The residual depends on nothing that this record shows: nothing is missing.")
        }
    }
    for (channel, change) in &identified.integration_error {
        println!(
            "Halving the integration steps changes {channel} by at most {}.",
            number(*change)
        );
    }
    for warning in &document.warnings {
        eprintln!("servobee: warning: {warning}");
    }
}

fn model_toml(identified: &Identified) -> String {
    let problem = &identified.problem;
    ModelFile::to_toml(&problem.structure, &problem.parameters, &identified.values)
}

/// Every row of every record: measured, simulated before, simulated after.
fn residual_csv(identified: &Identified) -> String {
    let structure = &identified.problem.structure;
    let mut text = String::from("record,part,time [s]");
    for output in &structure.observed {
        let (name, unit) = (output.name(), structure.unit(*output));
        for kind in ["measured", "before", "after"] {
            text += &format!(",{name} {kind} [{unit}]");
        }
    }
    text.push('\n');
    let parts = [
        ("fit", &identified.measurements.fit),
        ("hold_out", &identified.measurements.hold_out),
    ];
    for (part, records) in parts {
        for compared in Compared::all(structure, &identified.values, records) {
            let rows = compared
                .series
                .time
                .iter()
                .zip(&compared.series.samples)
                .zip(&compared.simulated);
            for ((time, sample), simulated) in rows.filter(|((_, sample), _)| sample.weight > 0.0) {
                text += &format!("{},{part},{time}", compared.series.name);
                for &output in &structure.observed {
                    let output: Output = output;
                    let value = simulated[output as usize];
                    text += &format!(",{},{value},{value}", sample.target[output as usize]);
                }
                text.push('\n');
            }
        }
    }
    text
}
