//! `servobee identify`.

use super::options::{self, Options, spinner};
use super::table::{number, table};
use super::work::interrupted;
use super::{card, colour, interrupt};
use servobee::card::Card;
use servobee::diagnose::{self, Compared, Cut, Identified, Question, ROWS, Verdict, identify};
use servobee::evaluate::problem::Series;
use servobee::evaluate::{Fingerprint, parameters_for, structure_for};
use servobee::model::effects::{CATALOGUE, Entry, entry};
use servobee::record::{HOLD_OUT, Mapping, Record, check_mappings};
use servobee::report::{
    Call, ConsideredEffect, Document, FreeFormReport, ImprovementReport, InputFile, Knot,
    ModelFile, ParameterReport, explain, not_diagnosed, page, unexplained,
};
use servobee::search::Plan;
use servobee::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Fit a model to measurements, find out which effects it lacks, and score it on data that was never fitted
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

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    let entries = entries(&arguments.effects)?;
    let output = arguments.options.output()?;
    let read = |paths: &[PathBuf]| {
        paths
            .iter()
            .map(|path| read(path, &arguments.map))
            .collect::<Result<Vec<Record>>>()
    };
    let (records, held_out) = (read(&arguments.records)?, read(&arguments.hold_out)?);
    let all: Vec<&Record> = records.iter().chain(&held_out).collect();
    check_mappings(&arguments.map, &all)?;
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
    structure.full_scale = arguments.options.full_scale.unwrap_or(structure.full_scale);
    let parameters = parameters_for(&structure, &records);
    let parameters = match &file {
        Some(file) => file.parameters(parameters)?,
        None => parameters,
    };
    let cut = Cut {
        hold_out: arguments.hold_out_share,
        rows: arguments.max_rows,
    };
    let question = Question {
        hold_known: file.as_ref().is_some_and(ModelFile::says_hold),
        ..Question::new(structure, parameters, &records, &held_out, cut)?
    };
    drop((records, held_out));
    let measurements = &question.measurements;
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
    let options = diagnose::Options::on(&question.structure, &entries, arguments.max_effects);
    let mut fingerprint = Fingerprint::default();
    fingerprint.text(&format!(
        "identify {:?} {:?} {} {plan:?} {options:?}",
        question.structure, question.parameters, question.hold_known
    ));
    for series in measurements.fit.iter().chain(&measurements.hold_out) {
        tell_of(&mut fingerprint, series);
    }
    let work = arguments.options.begin(fingerprint.finish())?;
    plan.memory = work.memory.clone();
    let bar = spinner();
    let result = work.run(&mut chosen, |evaluator| {
        identify(question.clone(), evaluator, &plan, &options, &mut |stage| {
            bar.set_message(stage.to_owned());
            interrupt::goes_on()
        })
    });
    bar.set_message("valve card");
    let result = result.map(|(identified, of_run)| {
        let after = &identified.after;
        let card = Card::of(&after.problem, &after.fit);
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
        print(&identified, &document);
    }
    for warning in &document.warnings {
        colour::warning(warning);
    }
    arguments.options.hand_over(&document, output, || {
        vec![
            ("report.json".into(), document.to_json()),
            ("report.html".into(), page(&identified, &document, &card)),
            ("model.toml".into(), model_toml(&identified)),
            ("residual.csv".into(), residual_csv(&identified)),
        ]
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

fn read(path: &PathBuf, mappings: &[Mapping]) -> Result<Record> {
    let record = Record::read(path, mappings)?;
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

fn print(identified: &Identified, document: &Document) {
    let structure = &identified.after.problem.structure;
    let count = |records: &[servobee::evaluate::problem::Series]| {
        let rows = records.iter().flat_map(|r| &r.samples);
        rows.filter(|s| s.weight > 0.0).count()
    };
    tell!(
        "Fitted {} rows of {} record(s), held out {} rows; full scale {} {}.",
        count(&identified.measurements.fit),
        identified.measurements.fit.len(),
        count(&identified.measurements.hold_out),
        number(structure.full_scale),
        structure.command_unit,
    );
    if let Some(hold) = &document.hold {
        tell!("{}", hold.sentence());
    }
    tell!("{}", explain::HELD_OUT);
    tell!(
        "{}\n",
        explain::base_model(&identified.before.problem.structure)
    );
    print_effects(identified, document);
    print_errors(identified);
    print_parameters(document);
    card::print(document);
    print_rest(identified, document);
}

/// The answer, and the chain of effects that it stands on.
fn print_effects(identified: &Identified, document: &Document) {
    let added = &identified.added;
    if let Some(cut) = &document.cut_short {
        colour::answer("No verdict: the run was cut short.");
        tell!("{}", cut.sentence());
    }
    match identified.verdict {
        _ if document.cut_short.is_some() => {}
        Verdict::None => {
            colour::answer("Verdict: none. The base model lacks nothing that this data shows.");
        }
        Verdict::Found => {
            let names: Vec<String> = added.iter().map(|one| one.effect.to_string()).collect();
            let names = names.join(" and ");
            colour::answer(format_args!(
                "Verdict: found. The base model lacks {names}."
            ));
        }
        Verdict::Unexplained => {
            let why = unexplained(identified);
            colour::answer(format_args!("Verdict: unexplained. {why}"));
        }
        Verdict::NotDiagnosed => {
            let why = not_diagnosed(identified);
            colour::answer(format_args!("Verdict: not diagnosed. {why}"));
        }
    }
    let error = |side: &ImprovementReport| {
        let ImprovementReport { percent, low, high } = side;
        format!("{percent:.1} % ({low:.1} .. {high:.1})")
    };
    if let Some(improvement) = &document.error.improvement.hold_out {
        let explained = identified.explained.map_or(String::new(), |share| {
            let percent = 100.0 * share;
            format!("; {percent:.0} % of what was above the noise is explained")
        });
        tell!("Held-out error lower by {}{explained}.", error(improvement));
    }
    tell!();
    if let Some(form) = &document.free_form {
        print_free_form(form);
    }
    if !added.is_empty() {
        let rows = added.iter().map(|one| {
            let tied: Vec<String> = one.tied_with.iter().map(ToString::to_string).collect();
            vec![
                one.effect.to_string(),
                one.effect.entry.port.to_string(),
                format!("{:.3}", one.error_before),
                format!("{:.3}", one.error_after),
                if tied.is_empty() {
                    "-".into()
                } else {
                    tied.join(", ")
                },
            ]
        });
        let head = [
            "effect",
            "port",
            "error before",
            "after",
            "cannot be told from",
        ];
        tell!("{}", table(&head, rows.collect::<Vec<_>>()));
        tell!("(held-out RMS over all channels, in units of the noise floor)\n");
        for one in added {
            tell!(
                "{}: {}. It shows as {}.",
                one.effect,
                one.effect.entry.summary,
                one.effect.entry.shows
            );
        }
        tell!();
    }
}

fn print_free_form(form: &FreeFormReport) {
    let place = match &form.channel {
        Some(channel) => format!("the measured {channel}"),
        None => format!("the {} port", form.port),
    };
    tell!(
        "A curve of the {} added at {place} takes the held-out error from {:.3} to {:.3} times the noise floor:\n",
        form.signal,
        form.error_before,
        form.error_after
    );
    let row = |knot: &Knot| vec![number(knot.signal), number(knot.value)];
    let signal = format!("{} [{}]", form.signal, form.signal_unit);
    let added = format!("added [{}]", form.unit);
    let rows: Vec<Vec<String>> = form.curve.iter().map(row).collect();
    tell!("{}\n", table(&[signal.as_str(), added.as_str()], rows));
}

fn print_errors(identified: &Identified) {
    let structure = &identified.after.problem.structure;
    let (before, after) = (&identified.before.errors, &identified.after.errors);
    let mut rows = Vec::new();
    for &output in &structure.observed {
        let channel = output.name();
        let Some(held) = after.hold_out.get(channel) else {
            continue;
        };
        let percent = |fit: Option<f64>| fit.map_or("-".into(), |fit| format!("{fit:.2}"));
        rows.push(vec![
            format!("{channel} [{}]", structure.unit(output)),
            number(before.fit[channel].rmse),
            number(after.fit[channel].rmse),
            number(before.hold_out[channel].rmse),
            number(held.rmse),
            percent(held.fit_percent),
            number(identified.noise[channel].value),
            identified.noise[channel].method.into(),
        ]);
    }
    let head = [
        "channel",
        "fitted: before",
        "after",
        "held out: before",
        "after",
        "fit %",
        "noise floor",
        "from",
    ];
    tell!("{}\n", table(&head, rows));
}

fn print_parameters(document: &Document) {
    let row = |parameter: &ParameterReport| {
        let mut notes = Vec::new();
        if parameter.at_bound {
            notes.push("at its bound");
        }
        if parameter.moved {
            notes.push("moved");
        }
        vec![
            parameter.name.clone(),
            parameter.unit.clone(),
            parameter.before.map_or("-".into(), number),
            number(parameter.value),
            parameter.interval(".."),
            notes.join(", "),
        ]
    };
    let rows: Vec<Vec<String>> = document.parameters.iter().map(row).collect();
    let head = ["parameter", "unit", "before", "after", "95 % interval", ""];
    tell!("{}", table(&head, rows));
    if document.parameters.iter().any(|parameter| parameter.moved) {
        tell!("(moved: out of the interval of the base model, which was wrong and sure)");
    }
    for line in &document.not_identifiable {
        tell!("Not identifiable: {line}");
    }
    tell!();
}

fn print_rest(identified: &Identified, document: &Document) {
    let first: Vec<&ConsideredEffect> = document
        .considered
        .iter()
        .filter(|one| one.error_after.is_some())
        .collect();
    if !first.is_empty() {
        let rows = first.iter().map(|one| {
            vec![
                one.round.to_string(),
                one.name.clone(),
                format!("{:.1} %", one.promise_percent),
                format!("{:.3}", one.p_value),
                one.error_after
                    .map_or("-".into(), |error| format!("{error:.3}")),
                one.decision.into(),
            ]
        });
        let head = [
            "round",
            "effect",
            "promise",
            "p",
            "held-out error",
            "decision",
        ];
        tell!("{}", explain::PROMISE);
        tell!("{}", table(&head, rows.collect::<Vec<_>>()));
        let others = document.considered.len() - first.len();
        tell!("({others} more were screened and not refitted; report.json has them all)\n");
    }
    let known = &document.remaining.correlates_with;
    match (document.remaining.structured, known.is_empty()) {
        (true, false) => tell!(
            "What is left in the residual is more than noise: {}.",
            known.join(", ")
        ),
        (true, true) => tell!(
            "What is left is far above the noise floor, but follows nothing that this record shows."
        ),
        (false, _) => {
            tell!("Only noise is left.")
        }
    }
    for (channel, change) in &identified.after.integration_error {
        tell!(
            "Halving the integration steps changes {channel} by at most {}.",
            number(*change)
        );
    }
}

fn model_toml(identified: &Identified) -> String {
    let after = &identified.after;
    let problem = &after.problem;
    ModelFile::to_toml(&problem.structure, &problem.parameters, &after.values)
}

/// Every row of every record: measured, simulated before, simulated after.
fn residual_csv(identified: &Identified) -> String {
    let (before, after) = (&identified.before, &identified.after);
    let structure = &after.problem.structure;
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
        let old = Compared::all(&before.problem.structure, &before.values, records);
        let new = Compared::all(structure, &after.values, records);
        for (old, new) in old.iter().zip(&new) {
            let series = new.series;
            let name = cell(&series.name);
            for (row, sample) in series.samples.iter().enumerate() {
                if sample.weight == 0.0 {
                    continue;
                }
                text += &format!("{name},{part},{}", series.time[row]);
                for &output in &structure.observed {
                    let (measured, old, new) = (
                        sample.target[output],
                        old.simulated[row][output],
                        new.simulated[row][output],
                    );
                    text += &format!(",{measured},{old},{new}");
                }
                text.push('\n');
            }
        }
    }
    text
}

/// `text` as a cell of a CSV file, in quotes where it needs them.
fn cell(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.into(),
    }
}
