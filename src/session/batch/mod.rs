//! Many records in one folder of results: a row and a report for each, and which valve departs from the others.

mod files;
mod task;

pub use files::found;
pub use task::Task;

use super::{Diagnosed, Session};
use crate::evaluate::Chosen;
use crate::report::{
    Batch, BatchRow, InputFile, Journal, OutputFile, OutputFolder, batch_csv, batch_page,
};
use crate::{Error, Result};
use files::Folders;
use std::fs::{create_dir_all, read_dir, remove_dir_all};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use task::TASKS;

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
    task: Option<Task>,
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
        make(out, "records")?;
        let journal = Journal::create(&out.join(JOURNAL), &session.fingerprint())?;
        forget_tasks(out)?;
        Ok(Self::of(session, None, out, journal))
    }

    /// One that goes on in the folder `out`, with what was done there, and gathers what tasks have done.
    ///
    /// # Errors
    /// There is none, or another one; a task has not ended.
    pub fn resume(session: &'a Session, out: &Path) -> Result<Self> {
        let (path, call) = (out.join(JOURNAL), session.fingerprint());
        let tasks = journals(out)?;
        let mut journal = match path.exists() || tasks.is_empty() {
            true => Journal::resume(&path, &call)?,
            false => Journal::create(&path, &call)?,
        };
        for task in tasks {
            journal.take_over(&task, &call)?;
        }
        forget_tasks(out)?;
        OutputFolder::forget_drafts(&out.join("records"));
        Ok(Self::of(session, None, out, journal))
    }

    /// One `task` of a job array in the folder `out`, which is made. It goes on where it was cut off, and knows what others have
    /// done before it began; what it does itself [`RunningBatch::resume`] gathers.
    ///
    /// # Errors
    /// As of [`Session::check`]; the folder holds something else, or a batch with other options; the same task is under way.
    pub fn task(session: &'a Session, out: &Path, task: Task) -> Result<Self> {
        session.check()?;
        let (whole, call) = (out.join(JOURNAL), session.fingerprint());
        let is_empty = read_dir(out).map_or(true, |mut entries| entries.next().is_none());
        // One that is not there yet another task may make right now: it is no other's then, either.
        OutputFolder::reserve(out, is_empty || whole.exists() || out.join(TASKS).exists())?;
        // In this order: whoever finds something in the folder finds that it is a job array's.
        make(out, TASKS)?;
        make(out, "records")?;
        let (path, others) = (out.join(task.journal()), journals(out)?);
        let mut journal = match path.exists() {
            true => Journal::resume(&path, &call)?,
            false => Journal::create(&path, &call)?,
        };
        let others = others.into_iter().filter(|other| *other != path);
        for other in others.chain(whole.exists().then_some(whole)) {
            journal.know(&other, &call)?;
        }
        Ok(Self::of(session, Some(task), out, journal))
    }

    fn of(session: &'a Session, task: Option<Task>, out: &Path, journal: Journal) -> Self {
        Self {
            session,
            task,
            out: out.to_owned(),
            folders: Folders::of(&journal),
            journal,
            rows: Vec::new(),
            warnings: Vec::new(),
            written: Instant::now(),
        }
    }

    /// Gives the report of the `baseline` and of each of `files` a folder, which does so not depend on what becomes of the others.
    /// Returns the files that are to be taken: all, or those of the task.
    pub fn share<'f>(&mut self, baseline: Option<&Path>, files: &'f [PathBuf]) -> Vec<&'f Path> {
        for path in baseline
            .into_iter()
            .chain(files.iter().map(PathBuf::as_path))
        {
            self.folders.of_file(&path.display().to_string());
        }
        let (numbered, task) = (files.iter().enumerate(), self.task);
        let own = numbered.filter(|(index, _)| task.is_none_or(|task| task.takes(*index)));
        own.map(|(_, path)| path.as_path()).collect()
    }

    /// Takes the record at `path` as that of a valve with which the others are compared; of tasks only the first one does.
    ///
    /// # Errors
    /// It is refused, or fails.
    pub fn baseline(&mut self, path: &Path, chosen: &mut Chosen, progress: Progress) -> Result<()> {
        if self.task.is_some_and(|task| !task.takes(0)) {
            return Ok(());
        }
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

    /// Writes the table and the page of what is done, but for a task, which has not got everything.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn write(&self) -> Result<Batch> {
        let batch = Batch::of(self.rows.clone(), self.session.call.arguments.clone());
        if self.task.is_some() {
            return Ok(batch);
        }
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

/// Makes the folder `name` below `out`.
fn make(out: &Path, name: &str) -> Result<()> {
    create_dir_all(out.join(name)).map_err(|error| {
        Error::input(
            format!("--out {}", out.display()),
            format!("cannot be made: {error}"),
            "name another folder",
        )
    })
}

/// The files of rows that tasks have left below `out`, by name.
fn journals(out: &Path) -> Result<Vec<PathBuf>> {
    let folder = out.join(TASKS);
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let read = || -> std::io::Result<Vec<PathBuf>> {
        let entries = read_dir(&folder)?.map(|entry| Ok(entry?.path()));
        let mut paths: Vec<PathBuf> = entries.collect::<std::io::Result<_>>()?;
        paths.retain(|path| path.extension().is_some_and(|end| end == "rows"));
        paths.sort();
        Ok(paths)
    };
    read().map_err(|error| {
        Error::input(
            folder.display(),
            format!("cannot be read: {error}"),
            "check its permissions",
        )
    })
}

/// Deletes the rows of tasks below `out`: another file has them, or they are to be done anew.
fn forget_tasks(out: &Path) -> Result<()> {
    let folder = out.join(TASKS);
    match folder.exists().then(|| remove_dir_all(&folder)) {
        Some(Err(error)) => Err(Error::failed(
            format!("{} cannot be deleted: {error}", folder.display()),
            "delete it, and add --resume: what is done is kept",
        )),
        _ => Ok(()),
    }
}
