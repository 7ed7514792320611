//! `servobee batch`.

mod files;

use super::diagnosis::DiagnosisOptions;
use super::options::RunOptions;
use super::work::told;
use super::{colour, interrupt};
use files::{Folders, found};
use indicatif::{ProgressBar, ProgressStyle};
use servobee::evaluate::{Chosen, Memory};
use servobee::report::{
    Batch, BatchRow, InputFile, Journal, OutputFile, OutputFolder, RowStatus, batch_csv, batch_page,
};
use servobee::session::Diagnosed;
use servobee::{Error, Result, Session};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What the batch goes on from, beside what it is for.
const JOURNAL: &str = "batch.rows";

/// No record has so many bytes: of a longer file nothing is read but its head.
const LONGEST: u64 = 1 << 28;

/// How long what is written may be behind what is done.
const BEHIND: Duration = Duration::from_secs(20);

/// Identify many records one after the other, each on its own, and say which valve departs from the others
///
/// Every file has a row in batch.csv and a place in index.html, with a link to its report; one that is refused or fails stops
/// none of the others. Exit code 1 if any failed, else 2 if any was refused, else 3 if any does not meet its --limits.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee batch records --out result
  servobee batch monday/*.csv tuesday --baseline good.csv --limits limits.toml --out result
  servobee batch records --out result --resume      goes on where it was interrupted, or with what has been added")]
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
    #[command(flatten)]
    diagnosis: DiagnosisOptions,
    #[command(flatten)]
    run: RunOptions,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { out, run, .. } = arguments;
    let session = arguments.diagnosis.session(run)?;
    let files = found(&arguments.files, out)?;
    let journal = journal(out, run, &session.fingerprint())?;
    let chosen = run.evaluator()?;
    interrupt::watch()?;
    let mut batch = Running {
        out,
        run,
        folders: Folders::of(&journal),
        journal,
        chosen,
        session,
        rows: Vec::new(),
        bar: bar(files.len()),
        written: Instant::now(),
    };
    if !run.quiet {
        tell!("{} files; results go to {}", files.len(), out.display());
    }
    let result = batch.all(arguments.baseline.as_deref(), &files);
    batch.bar.finish_and_clear();
    let written = batch.write()?;
    result?;
    if !run.quiet {
        print(&written, out);
    }
    outcome(&written)
}

/// The file of the rows that are done, in the folder `out`.
fn journal(out: &Path, run: &RunOptions, call: &str) -> Result<Journal> {
    let path = out.join(JOURNAL);
    if run.resume {
        return Journal::resume(&path, call);
    }
    OutputFolder::reserve(out, run.force)?;
    std::fs::create_dir_all(out.join("records")).map_err(|error| {
        Error::input(
            format!("--out {}", out.display()),
            format!("cannot be made: {error}"),
            "name another folder",
        )
    })?;
    Journal::create(&path, call)
}

fn bar(files: usize) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{wide_bar} {pos}/{len} records, {elapsed} gone, {eta} left  {msg}",
    );
    ProgressBar::new(files as u64).with_style(style.expect("a valid template"))
}

/// A batch under way.
struct Running<'a> {
    out: &'a Path,
    run: &'a RunOptions,
    session: Session,
    journal: Journal,
    folders: Folders,
    chosen: Chosen,
    rows: Vec<BatchRow>,
    bar: ProgressBar,
    written: Instant,
}

impl Running<'_> {
    /// Takes every file in its turn.
    fn all(&mut self, baseline: Option<&Path>, files: &[PathBuf]) -> Result<()> {
        if let Some(path) = baseline {
            let row = self.row(path, true)?;
            if let Some(problem) = row.problem {
                return Err(Error::input(
                    format!("--baseline {}", path.display()),
                    problem.trim_end_matches('.'),
                    "give a record that identify takes",
                ));
            }
            self.rows.push(row);
        }
        for (i, path) in files.iter().enumerate() {
            let row = self.row(path, false)?;
            if !self.run.quiet {
                let (place, word) = (i + 1, row.status.word());
                let line = format!(
                    "{place}/{} {}: {word}: {}",
                    files.len(),
                    row.file,
                    row.summary()
                );
                self.bar.suspend(|| tell!("{line}"));
            }
            self.rows.push(row);
            self.bar.inc(1);
            if self.written.elapsed() > BEHIND {
                self.write()?;
                self.written = Instant::now();
            }
        }
        Ok(())
    }

    /// The row of the record at `path`: the one that is there from an earlier run, or a new one.
    fn row(&mut self, path: &Path, baseline: bool) -> Result<BatchRow> {
        let file = path.display().to_string();
        let short = path.metadata().is_ok_and(|file| file.len() <= LONGEST);
        let sha256 = short.then(|| InputFile::at(path).sha256).flatten();
        let known = sha256
            .as_deref()
            .and_then(|sha256| self.journal.row(&file, sha256, baseline));
        if let Some(known) = known {
            return Ok(known.clone());
        }
        self.bar.set_message(file.clone());
        // A fault of the program in one record says nothing of the others.
        let attempt = catch_unwind(AssertUnwindSafe(|| self.identify(path, &file)));
        let found = attempt.unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().cloned();
            let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).into()));
            Err(Error::failed(
                format!("the program failed: {}", said.unwrap_or_default()),
                "send the file to its makers",
            ))
        });
        if let ControlFlow::Break(()) = interrupt::goes_on() {
            return Err(Error::failed(
                format!("interrupted in {file}: the table and the page have what is done"),
                "add --resume to go on",
            ));
        }
        let row = match found {
            Ok(row) => BatchRow { sha256, ..row },
            Err(error) => BatchRow::without_report(&file, sha256, &error),
        };
        let row = BatchRow { baseline, ..row };
        self.journal.push(row.clone())?;
        Ok(row)
    }

    /// Identifies the record at `path` and writes its report.
    fn identify(&mut self, path: &Path, file: &str) -> Result<BatchRow> {
        let prepared = {
            let record = self.session.read(&[path])?;
            self.session.prepare(&record, &[])?
        };
        let memory = Memory::default().stopped_by(interrupt::interrupt());
        let prepared = prepared.remembering(memory.clone());
        let bar = self.bar.clone();
        let diagnosed = prepared.diagnose(&mut self.chosen, &mut |stage| {
            bar.set_message(stage.to_owned());
            interrupt::goes_on()
        });
        let diagnosed = told(diagnosed, &mut self.chosen, &memory)?;
        let folder = self.folders.of_file(file);
        let files = diagnosed.report_files();
        OutputFolder::reserve(&self.out.join(&folder), true)?.write(&files)?;
        let Diagnosed { document, card, .. } = &diagnosed;
        Ok(BatchRow::of(file, document, card, folder))
    }

    /// Writes the table and the page of what is done.
    fn write(&self) -> Result<Batch> {
        let batch = Batch::of(self.rows.clone(), self.session.call.arguments.clone());
        for (name, text) in [
            ("batch.csv", batch_csv(&batch)),
            ("batch.json", batch.to_json()),
            ("index.html", batch_page(&batch, &self.run.edition())),
        ] {
            OutputFile::create(self.out.join(name), true)?.finish(&text)?;
        }
        Ok(batch)
    }
}

/// How it went, and which valves depart.
fn print(batch: &Batch, out: &Path) {
    let count = |status: RowStatus| batch.count(|row| row.status == status);
    colour::answer(format_args!(
        "\n{} ok, {} refused, {} failed.",
        count(RowStatus::Ok),
        count(RowStatus::Refused),
        count(RowStatus::Failed)
    ));
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
