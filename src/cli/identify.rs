//! `servobee identify`.

mod files;
mod print;

use super::options::{self, Options, spinner};
use super::reading::ReadingOptions;
use super::table::number;
use super::work::interrupted;
use super::{colour, interrupt};
use servobee::card::{Accuracy, Card, Measured};
use servobee::diagnose::{self, Cut, IdentificationProblem, ROWS, identify};
use servobee::evaluate::problem::Series;
use servobee::evaluate::{Fingerprint, parameters_for, structure_for};
use servobee::model::effects::{CATALOGUE, Entry, entry};
use servobee::record::{Channel, HOLD_OUT, Reading, Record, check_mappings, usual_full_scale};
use servobee::report::{Call, Document, InputFile, ModelFile};
use servobee::search::Plan;
use servobee::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Fit a model to measurements, find out which effects it lacks, and score it on data that was never fitted
///
/// The base model follows from the channels that the records have. Without --hold-out the last 30 % of each record are
/// held out.
#[derive(clap::Args)]
#[command(after_help = examples())]
pub(super) struct Arguments {
    /// Records to fit; a.csv+b.csv is one from two files with the same times
    #[arg(required = true, value_name = "RECORD")]
    records: Vec<PathBuf>,
    /// Records to score the model on, which are not fitted
    #[arg(long, value_name = "RECORD", num_args = 1..)]
    hold_out: Vec<PathBuf>,
    /// Share of each record that is held out where no record is
    #[arg(long, value_name = "SHARE", default_value_t = HOLD_OUT, value_parser = share)]
    hold_out_share: f64,
    /// Largest number of rows that are fitted and held out; of records that have more, stretches all along them are
    #[arg(long, value_name = "N", default_value_t = ROWS, value_parser = rows)]
    max_rows: usize,
    #[command(flatten)]
    reading: ReadingOptions,
    /// A model file: a whole model, or just the settings and parameters that differ from the base model's
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Effects that may be added to the base model
    #[arg(long, value_name = "all|none|NAME,...", default_value = "all")]
    effects: String,
    /// Largest number of effects that are added
    #[arg(long, value_name = "N", default_value_t = 4)]
    max_effects: usize,
    /// How far sensors may be off (95 %), which joins the intervals of the valve card: "flow=0.5 %, pressure=0.2 %", in % of
    /// the largest value of the curve, of the command in % of full scale
    #[arg(long, value_name = "SENSOR=PERCENT,...")]
    accuracy: Option<Accuracy>,
    #[command(flatten)]
    options: Options,
}

fn examples() -> String {
    format!(
        "\
Examples:
  servobee identify tests/data/bench.csv
  servobee identify run1.csv --hold-out run2.csv --map \"t_ms=time [ms]\" --map \"u=command [V]\" --out result

A record's header names channel and unit: time [s], {}.
Needed are time, command and one of {}.",
        Channel::ALL.map(Channel::column).join(", "),
        Channel::RESPONSES.map(Channel::name).join(", ")
    )
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    let entries = entries(&arguments.effects)?;
    let output = arguments.options.output()?;
    let reading = arguments.reading.reading();
    let read = |paths: &[PathBuf]| {
        paths
            .iter()
            .map(|path| read(path, &reading))
            .collect::<Result<Vec<Record>>>()
    };
    let (records, held_out) = (read(&arguments.records)?, read(&arguments.hold_out)?);
    let all: Vec<&Record> = records.iter().chain(&held_out).collect();
    check_mappings(&reading.mappings, &all)?;
    for record in &records {
        record.check_excited()?;
    }
    let mut warnings: Vec<String> = records
        .iter()
        .chain(&held_out)
        .flat_map(Record::remarks)
        .collect();
    let file = arguments
        .model
        .as_deref()
        .map(ModelFile::read)
        .transpose()?;
    let call = Call {
        arguments: options::arguments(),
        files: arguments
            .model
            .iter()
            .map(|path| InputFile::at(path))
            .collect(),
    };
    let mut structure = match &file {
        Some(file) => file.structure(|| structure_for(&records))?,
        None => structure_for(&records)?,
    };
    let says_full_scale = file.as_ref().is_some_and(ModelFile::says_full_scale);
    match arguments.options.full_scale {
        Some(full_scale) => structure.full_scale = full_scale,
        None if says_full_scale => {}
        None => all
            .iter()
            .try_for_each(|record| record.check_live_zeros())?,
    }
    let parameters = parameters_for(&structure, &records);
    let parameters = match &file {
        Some(file) => file.parameters(parameters)?,
        None => parameters,
    };
    let cut = Cut {
        hold_out: arguments.hold_out_share,
        rows: arguments.max_rows,
    };
    let full_scale = arguments.options.full_scale.is_some()
        || says_full_scale
        || usual_full_scale(&structure.command_unit).is_some();
    let mut problem = IdentificationProblem {
        hold_known: file.as_ref().is_some_and(ModelFile::says_hold),
        ..IdentificationProblem::new(structure, parameters, &records, &held_out, cut)?
    };
    let all: Vec<&Record> = records.iter().chain(&held_out).collect();
    let measured = Measured::of(
        &problem.structure,
        &all,
        &arguments.accuracy.clone().unwrap_or_default(),
    );
    if !full_scale {
        problem.measurements.bench.push(format!(
            "full scale is taken to be the largest |command|, {} {}: what the valve card has in shares of it is not \
             determined until --full-scale or a model file gives it",
            number(problem.structure.full_scale),
            problem.structure.command_unit
        ));
    }
    drop((records, held_out));
    let measurements = &problem.measurements;
    let used = measurements.used();
    if used < measurements.rows {
        let stretches = measurements.fit.len() + measurements.hold_out.len();
        warnings.push(format!(
            "of {} rows {used} are used, in {stretches} stretches all along the records: --max-rows sets how many",
            measurements.rows
        ));
    }

    let mut chosen = arguments.options.evaluator()?;
    let mut plan = Plan::of_records(arguments.options.seed);
    let options = diagnose::Options::on(&problem.structure, &entries, arguments.max_effects);
    let mut fingerprint = Fingerprint::default();
    fingerprint.text(&format!(
        "identify {:?} {:?} {} {plan:?} {options:?}",
        problem.structure, problem.parameters, problem.hold_known
    ));
    for series in measurements.fit.iter().chain(&measurements.hold_out) {
        tell_of(&mut fingerprint, series);
    }
    let work = arguments.options.begin(fingerprint.finish())?;
    plan.memory = work.memory.clone();
    let bar = spinner();
    let result = work.run(&mut chosen, |evaluator| {
        identify(problem.clone(), evaluator, &plan, &options, &mut |stage| {
            bar.set_message(stage.to_owned());
            interrupt::goes_on()
        })
    });
    bar.set_message("valve card");
    let result = result.map(|(identified, of_run)| {
        let after = &identified.after;
        let hold = after.problem.structure.hold;
        let card = Card::of(&after.problem, &after.fit).beside(measured, hold);
        let card = match full_scale {
            true => card,
            false => card.without_full_scale(),
        };
        (identified, card, of_run)
    });
    bar.finish_and_clear();
    let (identified, card, of_run) = result?;
    warnings.extend(of_run);
    if let Some(stage) = &identified.broken_off {
        warnings.push(interrupted(stage));
    }
    let seconds = started.elapsed().as_secs_f64();
    let document = Document::of(
        &identified,
        &card,
        &chosen,
        arguments.options.seed,
        seconds,
        call,
        warnings,
    );
    if arguments.options.talks() {
        print::print(&identified, &document);
    }
    for warning in &document.warnings {
        colour::warning(warning);
    }
    arguments.options.hand_over(&document, output, || {
        files::files(&identified, &document, &card)
    })?;
    work.end(identified.broken_off.as_deref())
}

/// Tells `fingerprint` what is measured.
fn tell_of(fingerprint: &mut Fingerprint, series: &Series) {
    fingerprint.text(&series.name).values(&series.time);
    for sample in &series.samples {
        fingerprint
            .values(&sample.input.numbers())
            .values(&sample.target.0)
            .values(&[sample.weight]);
    }
}

fn share(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.05..=0.9).contains(&share) => Ok(share),
        _ => Err("a number from 0.05 to 0.9".into()),
    }
}

fn rows(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(rows) if rows >= 1000 => Ok(rows),
        _ => Err("a whole number from 1000 on".into()),
    }
}

fn read(path: &PathBuf, reading: &Reading) -> Result<Record> {
    let record = Record::read_as(path, reading)?;
    record.check_response()?;
    Ok(record)
}

/// The entries of the catalogue that `--effects` names.
fn entries(text: &str) -> Result<Vec<&'static Entry>> {
    match text {
        "all" => return Ok(CATALOGUE.to_vec()),
        "none" => return Ok(Vec::new()),
        _ => {}
    }
    let find = |name: &str| {
        entry(name.trim()).ok_or_else(|| {
            let names: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
            Error::input(
                format!("--effects {text}"),
                format!("there is no effect {:?}", name.trim()),
                format!("give all, none, or some of {}", names.join(",")),
            )
        })
    };
    text.split(',').map(find).collect()
}
