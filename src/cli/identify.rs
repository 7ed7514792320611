//! `servobee identify`.

pub(super) mod files;
mod print;

use super::colour;
use super::diagnosis::DiagnosisOptions;
use super::options::{Options, spinner};
use servobee::Result;
use servobee::record::Channel;
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
    let started = Instant::now();
    let Arguments {
        diagnosis, options, ..
    } = arguments;
    let setup = diagnosis.setup(&options.run)?;
    let output = options.output()?;
    let prepared = {
        let records = setup.read(&arguments.records)?;
        let held_out = setup.read(&arguments.hold_out)?;
        setup.prepare(&records, &held_out)?
    };
    let mut chosen = options.evaluator()?;
    let work = options.begin(prepared.fingerprint())?;
    let bar = spinner();
    let diagnosed = prepared.diagnose(&mut chosen, &work, &bar);
    bar.finish_and_clear();
    let diagnosed = diagnosed?;
    let document = diagnosed.document(&chosen, &options.run, started, setup.call);
    let identified = &diagnosed.identified;
    let edition = options.run.edition();
    if options.talks() {
        print::print(identified, &document, &edition.units);
    }
    for warning in &document.warnings {
        colour::warning(edition.units.text(warning));
    }
    options.hand_over(&document.to_json(), output, || {
        files::files(identified, &document, &diagnosed.card, &edition)
    })?;
    work.end(identified.broken_off.as_deref())?;
    document.check_limits()
}
