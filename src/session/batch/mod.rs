//! Many records in one folder of results: a row and a report for each, and which valve departs from the others.

mod files;

pub use files::found;

use super::{Diagnosed, Session};
use crate::evaluate::Chosen;
use crate::report::{
    Batch, BatchRow, InputFile, Journal, OutputFile, OutputFolder, batch_csv, batch_page,
};
use crate::{Error, Result};
use files::Folders;
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

/// What a batch is told: the stage of the record under way. It may break off.
type Progress<'a> = &'a mut dyn FnMut(&str) -> ControlFlow<()>;

/// A batch under way.
#[derive(Debug)]
pub struct RunningBatch<'a> {
    session: &'a Session,
    out: PathBuf,
    journal: Journal,
    folders: Folders,
    rows: Vec<BatchRow>,
    warnings: Vec<String>,
    written: Instant,
}

impl<'a> RunningBatch<'a> {
    /// One that begins in the folder `out`, which is made; in one that exists only by `force`.
    ///
    /// # Errors
    /// As of [`Session::check`]; the folder exists, or cannot be written.
    pub fn begin(session: &'a Session, out: &Path, force: bool) -> Result<Self> {
        session.check()?;
        OutputFolder::reserve(out, force)?;
        std::fs::create_dir_all(out.join("records")).map_err(|error| {
            Error::input(
                format!("--out {}", out.display()),
                format!("cannot be made: {error}"),
                "name another folder",
            )
        })?;
        let journal = Journal::create(&out.join(JOURNAL), &session.fingerprint())?;
        Ok(Self::of(session, out, journal))
    }

    /// One that goes on in the folder `out`, with what was done there.
    ///
    /// # Errors
    /// There is none, or another one.
    pub fn resume(session: &'a Session, out: &Path) -> Result<Self> {
        let journal = Journal::resume(&out.join(JOURNAL), &session.fingerprint())?;
        Ok(Self::of(session, out, journal))
    }

    fn of(session: &'a Session, out: &Path, journal: Journal) -> Self {
        Self {
            session,
            out: out.to_owned(),
            folders: Folders::of(&journal),
            journal,
            rows: Vec::new(),
            warnings: Vec::new(),
            written: Instant::now(),
        }
    }

    /// Takes the record at `path` as that of a valve with which the others are compared.
    ///
    /// # Errors
    /// It is refused, or fails.
    pub fn baseline(&mut self, path: &Path, chosen: &mut Chosen, progress: Progress) -> Result<()> {
        let row = self.row(path, true, chosen, progress)?;
        if let Some(problem) = row.problem {
            return Err(Error::input(
                format!("--baseline {}", path.display()),
                problem.trim_end_matches('.'),
                "give a record that identify takes",
            ));
        }
        self.rows.push(row);
        Ok(())
    }

    /// Takes the record at `path` and says what became of it: one that is refused or fails has a row, too. What is done is
    /// written now and then.
    ///
    /// # Errors
    /// The run was stopped, or nothing can be written.
    pub fn take(
        &mut self,
        path: &Path,
        chosen: &mut Chosen,
        progress: Progress,
    ) -> Result<&BatchRow> {
        let row = self.row(path, false, chosen, progress)?;
        self.rows.push(row);
        if self.written.elapsed() > BEHIND {
            self.write()?;
            self.written = Instant::now();
        }
        Ok(self.rows.last().expect("just pushed"))
    }

    /// What has to be said of records that have failed, beside why, and was not said yet.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Writes the table and the page of what is done.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn write(&self) -> Result<Batch> {
        let batch = Batch::of(self.rows.clone(), self.session.call.arguments.clone());
        for (name, text) in [
            ("batch.csv", batch_csv(&batch)),
            ("batch.json", batch.to_json()),
            ("index.html", batch_page(&batch, &self.session.edition)),
        ] {
            OutputFile::create(self.out.join(name), true)?.finish(&text)?;
        }
        Ok(batch)
    }

    /// The row of the record at `path`: the one that is there from an earlier run, or a new one.
    fn row(
        &mut self,
        path: &Path,
        baseline: bool,
        chosen: &mut Chosen,
        progress: Progress,
    ) -> Result<BatchRow> {
        let file = path.display().to_string();
        let short = path.metadata().is_ok_and(|file| file.len() <= LONGEST);
        let sha256 = short.then(|| InputFile::at(path).sha256).flatten();
        let known = sha256
            .as_deref()
            .and_then(|sha256| self.journal.row(&file, sha256, baseline));
        if let Some(known) = known {
            return Ok(known.clone());
        }
        let _ = progress(&file);
        // A fault of the program in one record says nothing of the others.
        let attempt = AssertUnwindSafe(|| self.identify(path, &file, chosen, progress));
        let found = catch_unwind(attempt).unwrap_or_else(|panic| {
            let said = panic.downcast_ref::<String>().cloned();
            let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).into()));
            Err(Error::failed(
                format!("the program failed: {}", said.unwrap_or_default()),
                "send the file to its makers",
            ))
        });
        let memory = &self.session.plan.memory;
        if memory.interrupt().asked() {
            return Err(Error::failed(
                format!("interrupted in {file}: the table and the page have what is done"),
                "add --resume to go on",
            ));
        }
        let row = match found {
            Ok(row) => BatchRow { sha256, ..row },
            Err(error) => {
                // The reports of others shall not have them.
                self.warnings.extend(chosen.warnings(memory));
                BatchRow::without_report(&file, sha256, &error)
            }
        };
        let row = BatchRow { baseline, ..row };
        self.journal.push(row.clone())?;
        Ok(row)
    }

    /// Identifies the record at `path` and writes its report.
    fn identify(
        &mut self,
        path: &Path,
        file: &str,
        chosen: &mut Chosen,
        progress: Progress,
    ) -> Result<BatchRow> {
        let prepared = {
            let record = self.session.read(&[path])?;
            self.session.prepare(&record, &[])?
        };
        let diagnosed = prepared.diagnose(chosen, progress)?;
        let folder = self.folders.of_file(file);
        let files = diagnosed.report_files();
        OutputFolder::reserve(&self.out.join(&folder), true)?.write(&files)?;
        let Diagnosed { document, card, .. } = &diagnosed;
        Ok(BatchRow::of(file, document, card, folder))
    }
}
