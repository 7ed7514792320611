//! `servobee compare`.

use super::diagnosis::{DiagnosisOptions, Prepared, Setup};
use super::identify::files::report;
use super::options::{Options, spinner};
use super::table::{number, table};
use super::{card, colour, interrupt};
use servobee::Result;
use servobee::compare::{Change, Comparison, Fate, Outcome, check_alike, compare};
use servobee::evaluate::Fingerprint;
use servobee::record::Record;
use servobee::report::{ComparisonDocument, Units, comparison_page};
use std::path::PathBuf;
use std::time::Instant;

/// Compare a valve before and after a repair: one model fitted to both, what changed, and what did not
///
/// Parameters, effects that came or went, and figures of the valve card, each with its interval, tested as one family: the
/// chance that anything is said to have changed where nothing has is 5 %. Limits are those that the valve has to keep after.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee compare before.csv --with after.csv --out repair
  servobee compare monday1.csv monday2.csv --with friday.csv --limits limits.toml

Both sides need the same channels in the same units.")]
pub(super) struct Arguments {
    /// Records of the valve before
    #[arg(required = true, value_name = "BEFORE")]
    before: Vec<PathBuf>,
    /// Records of the valve after
    #[arg(long, value_name = "AFTER", required = true, num_args = 1..)]
    with: Vec<PathBuf>,
    #[command(flatten)]
    diagnosis: DiagnosisOptions,
    #[command(flatten)]
    options: Options,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    let Arguments {
        diagnosis, options, ..
    } = arguments;
    let setup = diagnosis.setup(&options.run)?;
    let output = options.output()?;
    let prepared = sides(&setup, arguments)?;
    let mut chosen = options.evaluator()?;
    let mut fingerprint = Fingerprint::default();
    fingerprint.text("compare");
    for side in &prepared {
        fingerprint.text(&format!("{:x}", side.fingerprint()));
    }
    let work = options.begin(fingerprint.finish())?;
    let bar = spinner();
    let measured = prepared.each_ref().map(Prepared::measured);
    let plan = prepared[0].plan(&work);
    let [first, mut second] = prepared;
    let before = first.diagnose(&mut chosen, &work, &bar);
    let result = before.and_then(|before| {
        second.takes_hold_of(&before.identified);
        let after = second.diagnose(&mut chosen, &work, &bar)?;
        work.check(before.identified.broken_off.as_deref())?;
        work.check(after.identified.broken_off.as_deref())?;
        let sides = [&before.identified, &after.identified];
        let comparison = compare(sides, measured, &plan, &mut |stage| {
            bar.set_message(stage.to_owned());
            interrupt::goes_on()
        })?;
        Ok((before, after, comparison))
    });
    bar.finish_and_clear();
    let (before, after, comparison) = result?;
    let [old, new] = [&before, &after]
        .map(|side| side.document(&chosen, &options.run, started, setup.call.clone()));
    let seconds = started.elapsed().as_secs_f64();
    let document = ComparisonDocument::of(&comparison, [&old, &new], setup.call, seconds);
    let edition = options.run.edition();
    if options.talks() {
        print(&comparison, &document, &edition.units);
    }
    for warning in &document.warnings {
        colour::warning(edition.units.text(warning));
    }
    options.hand_over(&document.to_json(), output, || {
        let mut files = vec![
            ("compare.json".to_owned(), document.to_json()),
            (
                "compare.html".to_owned(),
                comparison_page(&comparison, &document, &edition),
            ),
        ];
        for (name, side, own) in [("before", &before, &old), ("after", &after, &new)] {
            for (file, text) in report(&side.identified, own, &side.card, &edition) {
                let end = file.rsplit('.').next().unwrap_or_default();
                files.push((format!("{name}.{end}"), text));
            }
        }
        files
    })?;
    work.end(None)?;
    new.check_limits()
}

/// The problems of both sides, on the base model that all records together ask for.
fn sides(setup: &Setup, arguments: &Arguments) -> Result<[Prepared; 2]> {
    let before = setup.read(&arguments.before)?;
    let after = setup.read(&arguments.with)?;
    let all: Vec<Record> = before.iter().chain(&after).cloned().collect();
    check_alike(&before, &after)?;
    Ok([
        setup.prepare_among(&all, &before, &[])?,
        setup.prepare_among(&all, &after, &[])?,
    ])
}

fn print(comparison: &Comparison, document: &ComparisonDocument, units: &Units) {
    let document = &document.in_units(units);
    colour::answer(units.text(&document.answer));
    for one in &document.confounded {
        tell!("Mind: {}.", units.text(&one.sentence));
    }
    tell!();
    let row = |one: &Change| {
        let interval = match (one.low, one.high) {
            (Some(low), Some(high)) => format!("{} .. {}", number(low), number(high)),
            _ => "not determined".into(),
        };
        vec![
            units.text(&one.label),
            one.of.into(),
            one.unit.clone(),
            number(one.before.value),
            number(one.after.value),
            number(one.difference),
            interval,
            one.p_value.map_or("-".into(), |p| format!("{p:.3}")),
        ]
    };
    for (title, outcome) in [
        ("changed", Outcome::Changed),
        ("did not change", Outcome::NotChanged),
        ("not determined", Outcome::NotDetermined),
    ] {
        let rows: Vec<Vec<String>> = document.with(outcome).map(row).collect();
        if rows.is_empty() {
            continue;
        }
        let heads = [
            title,
            "",
            "unit",
            "before",
            "after",
            "difference",
            "95 % interval",
            "p",
        ];
        tell!("{}\n", table(&heads, rows));
    }
    for one in &comparison.effects {
        let said = match one.fate {
            Fate::Came => "came",
            Fate::Went => "went",
            Fate::Changed => "changed",
            Fate::Stayed => "shows no change beyond chance",
        };
        tell!("{} {said}: {}.", one.effect, one.effect.entry.summary);
    }
    card::print_limits(&document.limits, units);
}
