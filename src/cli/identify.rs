//! `servobee identify`.

mod print;

use super::colour;
use super::diagnosis::DiagnosisOptions;
use super::options::Options;
use super::work::{end, shown, told};
use servobee::Result;
use servobee::record::Channel;
use std::path::PathBuf;

/// Fit a model to measurements, find out which effects it lacks, and score it on data that was held out
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
    #[command(flatten)]
    diagnosis: DiagnosisOptions,
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
    let Arguments {
        diagnosis, options, ..
    } = arguments;
    let session = diagnosis.session(&options.run)?;
    let output = options.output()?;
    let prepared = {
        let records = session.read(&arguments.records)?;
        let held_out = session.read(&arguments.hold_out)?;
        session.prepare(&records, &held_out)?
    };
    let mut chosen = options.evaluator()?;
    let memory = options.begin(prepared.fingerprint())?;
    let prepared = prepared.remembering(memory.clone());
    let diagnosed = shown(|stage| prepared.diagnose(&mut chosen, stage));
    let diagnosed = told(diagnosed, &mut chosen, &memory)?;
    let document = &diagnosed.document;
    let units = options.run.edition().units;
    if options.talks() {
        print::print(&diagnosed.identified, document, &units);
    }
    for warning in &document.warnings {
        colour::warning(units.text(warning));
    }
    options.hand_over(&document.to_json(), output, || diagnosed.files())?;
    end(&memory, diagnosed.identified.broken_off.as_deref())?;
    document.check_limits()
}
