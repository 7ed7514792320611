//! `servobee batch`.

use super::diagnosis::DiagnosisOptions;
use super::options::RunOptions;
use super::{colour, interrupt};
use indicatif::{ProgressBar, ProgressStyle};
use servobee::evaluate::{Chosen, Memory};
use servobee::report::{Batch, RowStatus};
use servobee::session::{RunningBatch, Task, found};
use servobee::{Error, Result};
use std::path::{Path, PathBuf};

/// Identify many records one after the other, each on its own, and say which valve departs from the others
///
/// Every file has a row in batch.csv and a place in index.html, with a link to its report; one that is refused or fails stops
/// none of the others. Exit code 1 if any failed, else 2 if any was refused, else 3 if any does not meet its --limits. With
/// --task it is one of many calls, on one machine or on many, which share nothing but the folder; one that dies is called again.
/// Its exit code is 0 once each of its files has a row; the call without --task, with --resume, gathers the rows.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee batch records --out result
  servobee batch monday/*.csv tuesday --baseline good.csv --limits limits.toml --out result
  servobee batch records --out result --resume      goes on where it was interrupted, or with what has been added
  servobee batch records --out result --task 3/40   takes every 40th file, from the third on; of a job array of Slurm:
  servobee batch records --out result --task $SLURM_ARRAY_TASK_ID/40
  servobee batch records --out result --resume      after the last task: does what is missing, writes the table and the page")]
pub(super) struct Arguments {
    /// Records, and folders whose files are all taken, with those of the folders in them
    #[arg(required = true, value_name = "FOLDER|FILE")]
    files: Vec<PathBuf>,
    /// Folder for the results, which is made
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A record of a valve that is as it should be, with which the others are compared; otherwise they are with one another
    #[arg(long, value_name = "RECORD")]
    baseline: Option<PathBuf>,
    /// Take only every N-th file, from the I-th on, into a folder that other tasks share
    #[arg(long, value_name = "I/N", conflicts_with = "force")]
    task: Option<Task>,
    #[command(flatten)]
    diagnosis: DiagnosisOptions,
    #[command(flatten)]
    run: RunOptions,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { out, run, .. } = arguments;
    let mut session = arguments.diagnosis.session(run)?;
    session.plan.memory = Memory::default().stopped_by(interrupt::interrupt());
    let files = found(&arguments.files, out)?;
    let mut batch = match (arguments.task, run.resume) {
        (Some(task), _) => RunningBatch::task(&session, out, task)?,
        (None, true) => RunningBatch::resume(&session, out)?,
        (None, false) => RunningBatch::begin(&session, out, run.force)?,
    };
    let files = batch.share(arguments.baseline.as_deref(), &files);
    let mut chosen = run.evaluator()?;
    interrupt::watch()?;
    if !run.quiet {
        tell!("{} files; results go to {}", files.len(), out.display());
    }
    let bar = bar(files.len());
    let result = all(&mut batch, arguments, &files, &mut chosen, &bar);
    bar.finish_and_clear();
    let written = batch.write()?;
    result?;
    if let Some(task) = arguments.task {
        if !run.quiet {
            tally(&written);
            tell!(
                "Task {task} is done; after the last one --resume without --task writes the table and the page"
            );
        }
        return Ok(());
    }
    if !run.quiet {
        tally(&written);
        print(&written, out);
    }
    outcome(&written)
}

fn bar(files: usize) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{wide_bar} {pos}/{len} records, {elapsed} gone, {eta} left  {msg}",
    );
    ProgressBar::new(files as u64).with_style(style.expect("a valid template"))
}

/// Takes every file in its turn, and says what became of it.
fn all(
    batch: &mut RunningBatch,
    arguments: &Arguments,
    files: &[&Path],
    chosen: &mut Chosen,
    bar: &ProgressBar,
) -> Result<()> {
    let mut progress = |stage: &str| {
        bar.set_message(stage.to_owned());
        interrupt::goes_on()
    };
    if let Some(path) = &arguments.baseline {
        batch.baseline(path, chosen, &mut progress)?;
    }
    for (i, path) in files.iter().enumerate() {
        let row = batch.take(path, chosen, &mut progress)?;
        let (place, word) = (i + 1, row.status.word());
        let line = format!(
            "{place}/{} {}: {word}: {}",
            files.len(),
            row.file,
            row.summary()
        );
        bar.suspend(|| {
            batch.take_warnings().iter().for_each(colour::warning);
            if !arguments.run.quiet {
                tell!("{line}");
            }
        });
        bar.inc(1);
    }
    Ok(())
}

/// How it went.
fn tally(batch: &Batch) {
    let count = |status: RowStatus| batch.count(|row| row.status == status);
    colour::answer(format_args!(
        "\n{} ok, {} refused, {} failed.",
        count(RowStatus::Ok),
        count(RowStatus::Refused),
        count(RowStatus::Failed)
    ));
}

/// Which valves depart.
fn print(batch: &Batch, out: &Path) {
    tell!("Valves are {}.", batch.compared);
    for (row, departures) in batch.rows.iter().zip(&batch.departures) {
        let Some(own) = departures else { continue };
        let names: Vec<&str> = own.all().map(|one| one.name.as_str()).collect();
        if names.is_empty() {
            continue;
        }
        let cause = own.cause.as_ref();
        let cause = cause.map_or(String::new(), |cause| format!("; cause: {cause}"));
        tell!("{} departs in {}{cause}.", row.file, names.join(", "));
    }
    tell!(
        "\nWritten to {}: index.html, batch.csv, batch.json, records",
        out.display()
    );
}

/// What the call comes to: the worst that happened to any file.
fn outcome(batch: &Batch) -> Result<()> {
    let all = batch.count(|_| true);
    let failed = batch.count(|row| row.status == RowStatus::Failed);
    let refused = batch.count(|row| row.status == RowStatus::Refused);
    let missing = batch.count(|row| row.status == RowStatus::Ok && !row.limits.all_met());
    let table = "batch.csv says which and why";
    if failed > 0 {
        let problem = format!("{failed} of {all} records failed, {refused} were refused");
        return Err(Error::failed(problem, table));
    }
    if refused > 0 {
        let problem = format!("{refused} of {all} records were refused");
        return Err(Error::input("batch", problem, table));
    }
    if missing > 0 {
        let problem = format!("{missing} of {all} records do not meet every limit");
        return Err(Error::unmet(problem, table));
    }
    Ok(())
}
