//! `servobee compare`.

use super::diagnosis::DiagnosisOptions;
use super::options::Options;
use super::table::{number, table};
use super::work::{end, shown, told};
use super::{card, colour};
use servobee::Result;
use servobee::compare::{Change, Comparison, Fate, Outcome};
use servobee::report::{ComparisonDocument, Units};
use std::path::PathBuf;

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
    let Arguments {
        diagnosis, options, ..
    } = arguments;
    let session = diagnosis.session(&options.run)?;
    let output = options.output()?;
    let pair = {
        let before = session.read(&arguments.before)?;
        let after = session.read(&arguments.with)?;
        session.pair(&before, &after)?
    };
    let mut chosen = options.evaluator()?;
    let memory = options.begin(pair.fingerprint())?;
    let pair = pair.remembering(&memory);
    let compared = shown(|stage| pair.compare(&mut chosen, stage));
    let compared = told(compared, &mut chosen, &memory)?;
    let document = &compared.document;
    let units = options.run.edition().units;
    if options.talks() {
        print(&compared.comparison, document, &units);
    }
    for warning in &document.warnings {
        colour::warning(units.text(warning));
    }
    options.hand_over(&document.to_json(), output, || compared.files())?;
    end(&memory, None)?;
    compared.after.document.check_limits()
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
