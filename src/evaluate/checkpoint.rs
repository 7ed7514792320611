//! What was computed so far, kept on disk: a run that is cut off goes on from there.
//!
//! Everything in a run follows from its input and its seed. So it is enough to remember what took long: the costs of a
//! generation, a polish, a screening, each under a key that tells what was asked. Called again, the run finds them in the file
//! and ends with the same bytes as a run that was never cut off.
//!
//! ```text
//! servobee/checkpoint/2 VERSION RUN⏎     16 hexadecimal digits name the run: what is fitted, and how
//! size u32 | key u64 | result | check u64     for everything remembered, little-endian; results as postcard writes them
//! ```
//!
//! Run, keys and checks are the first eight bytes of SHA-256: the same with every compiler and on every machine.
//!
//! A frame that is not whole, or whose check is wrong, ends the file: what follows is computed again.

use crate::evaluate::problem::{Data, Problem};
use crate::evaluate::{Cost, Evaluator, Interrupt, Job};
use crate::{Error, Result, input};
use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What a checkpoint begins with.
const SCHEMA: &str = "servobee/checkpoint/2";
/// How long what was written may wait until it is brought to the disk: it outlives the program at once, and the machine
/// after this.
const SYNC: Duration = Duration::from_secs(1);
/// What to do about one that another run is writing.
const OTHER: &str = "wait for it, or name another --checkpoint";
/// Largest file that is read.
const LARGEST: u64 = 1 << 30;

/// Tells one run from another: the same things told in the same order give the same number.
#[derive(Debug, Clone, Default)]
pub struct Fingerprint(Sha256);

impl Fingerprint {
    /// Tells the fingerprint of `text`.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.0.update(text);
        self.0.update([0xff]);
        self
    }

    /// Tells the fingerprint of `problem`, among those of one run: of its rows only how they are cut into steps.
    pub fn problem(&mut self, problem: &Problem) -> &mut Self {
        let Problem {
            structure,
            parameters,
            data,
            scale,
            loss,
        } = problem;
        let loss = loss.map(|loss| loss.name());
        self.text(&format!("{structure:?} {parameters:?} {loss:?}"));
        self.values(&scale.0);
        match &**data {
            Data::Series(records) => {
                for record in records {
                    let rows = record.samples.len();
                    self.text(&record.name).values(&[rows as f64]);
                    for row in [0, rows / 2, rows.saturating_sub(2)] {
                        let sample = record.samples.get(row).copied().unwrap_or_default();
                        self.values(&[sample.step, sample.weight, f64::from(sample.substeps)]);
                    }
                }
                self
            }
            Data::Tones(tones) => self.text(&format!("{tones:?}")),
        }
    }

    /// Tells the fingerprint of `values`, bit by bit.
    pub fn values(&mut self, values: &[f64]) -> &mut Self {
        values
            .iter()
            .for_each(|value| self.0.update(value.to_le_bytes()));
        self.0.update((values.len() as u64).to_le_bytes());
        self
    }

    /// The number.
    pub fn finish(&self) -> u64 {
        first_bytes(self.0.clone())
    }
}

/// Results under their keys, as postcard writes them.
type Results = HashMap<u64, Vec<u8>>;

/// What is read of a checkpoint.
#[derive(Debug)]
struct Contents {
    version: String,
    run: u64,
    known: Results,
    /// Bytes up to the end of the last whole frame.
    whole: usize,
}

/// What is said of a run that was interrupted in this `stage`.
pub fn interrupted(stage: &str) -> String {
    format!("interrupted in \"{stage}\": this is what was known then")
}

/// The file in which a run keeps what it has computed.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    /// What it held when it was opened, until a run remembers it.
    found: Results,
    /// Bytes of its first line.
    begin: u64,
    synced: Instant,
    /// Why it is not written any more.
    broken: Option<std::io::Error>,
}

impl Checkpoint {
    /// A new one at `path` for the run of this fingerprint. With `force` it replaces what lies there.
    ///
    /// # Errors
    /// There is a file, or none can be written.
    pub fn create(path: &Path, run: u64, force: bool) -> Result<Self> {
        let wrong = |error: &std::io::Error| match error.kind() {
            ErrorKind::AlreadyExists => Error::input(
                path.display(),
                "is the checkpoint of a run that was cut off",
                "add --resume to go on with it, or --force to begin again",
            ),
            _ => cannot_write(path, error),
        };
        let folder = path.parent().unwrap_or(Path::new("."));
        // Written aside and moved: there is never a checkpoint without its first line.
        let draft = tempfile::Builder::new()
            .prefix(".servobee-")
            .tempfile_in(folder);
        let mut draft = draft.map_err(|error| wrong(&error))?;
        draft
            .write_all(first_line(run).as_bytes())
            .map_err(|error| wrong(&error))?;
        draft.as_file().sync_all().map_err(|error| wrong(&error))?;
        input::lock(path, draft.as_file(), OTHER)?;
        let placed = match force {
            true => draft.persist(path),
            false => draft.persist_noclobber(path),
        };
        let file = placed.map_err(|error| wrong(&error.error))?;
        Ok(Self::of(path, file, HashMap::new(), run))
    }

    /// The one at `path`, to go on from; a new one where there is none.
    ///
    /// # Errors
    /// The file is no checkpoint, one of another run or version, in use, or cannot be read and written.
    pub fn resume(path: &Path, run: u64) -> Result<Self> {
        let wrong = |error: std::io::Error| cannot_write(path, &error);
        let mut file = match OpenOptions::new().read(true).write(true).open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Self::create(path, run, false);
            }
            Err(error) => return Err(wrong(error)),
        };
        input::lock(path, &file, OTHER)?;
        let size = file.metadata().map_err(wrong)?.len();
        if size > LARGEST {
            return Err(foreign(path, &format!("has {size} bytes")));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(wrong)?;
        let contents = parse(path, &bytes)?;
        let version = env!("CARGO_PKG_VERSION");
        if contents.version != version || contents.run != run {
            let whose = match contents.version == version {
                true => "another run: other files, other settings".to_owned(),
                false => format!("servobee {}", contents.version),
            };
            return Err(Error::input(
                path.display(),
                format!("is a checkpoint of {whose}"),
                "repeat the call that was cut off, or leave out --resume and add --force to begin again",
            ));
        }
        file.set_len(contents.whole as u64).map_err(wrong)?;
        file.seek(SeekFrom::End(0)).map_err(wrong)?;
        Ok(Self::of(path, file, contents.known, run))
    }

    fn of(path: &Path, file: File, found: Results, run: u64) -> Self {
        Self {
            path: path.to_owned(),
            file,
            found,
            begin: first_line(run).len() as u64,
            synced: Instant::now(),
            broken: None,
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many results it held when it was opened.
    pub fn results(&self) -> usize {
        self.found.len()
    }

    /// Deletes the file: the run has ended.
    ///
    /// # Errors
    /// If the system refuses.
    fn remove(&self) -> Result<()> {
        std::fs::remove_file(&self.path).map_err(|error| {
            Error::failed(
                format!("{} cannot be deleted: {error}", self.path.display()),
                "delete it: the run has ended",
            )
        })
    }

    /// Empties the file.
    fn clear(&mut self) {
        let cleared = self.file.set_len(self.begin);
        let sought = self.file.seek(SeekFrom::Start(self.begin));
        self.broken = cleared.and(sought).err();
    }

    fn keep(&mut self, key: u64, result: &[u8]) {
        if self.broken.is_some() {
            return;
        }
        // In one piece: whatever ends the program, the frame is there or is seen not to be.
        let mut written = self.file.write_all(&frame(key, result));
        if written.is_ok() && self.synced.elapsed() >= SYNC {
            written = self.file.sync_data();
            self.synced = Instant::now();
        }
        self.broken = written.err();
    }
}

/// Results, and the file in which they are kept too, if there is one.
#[derive(Default)]
struct Store {
    known: Results,
    checkpoint: Option<Checkpoint>,
}

/// What a run remembers, and in its checkpoint if it has one. Clones share it. It is with everything that takes long, and
/// so it also says whether the run shall stop: what is broken off is not remembered.
#[derive(Clone, Default)]
pub struct Memory {
    /// None remembers nothing.
    store: Option<Arc<Mutex<Store>>>,
    interrupt: Interrupt,
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Memory")
    }
}

impl From<Checkpoint> for Memory {
    fn from(mut checkpoint: Checkpoint) -> Self {
        let store = Store {
            known: std::mem::take(&mut checkpoint.found),
            checkpoint: Some(checkpoint),
        };
        Self {
            store: Some(Arc::new(Mutex::new(store))),
            ..Self::default()
        }
    }
}

impl Memory {
    /// The same, of a run that `interrupt` may stop.
    pub fn stopped_by(self, interrupt: Interrupt) -> Self {
        Self { interrupt, ..self }
    }

    /// The same of one run, which without a checkpoint remembers until it ends: it asks many things twice.
    #[must_use]
    pub(crate) fn of_one_run(&self) -> Self {
        let mut own = self.clone();
        own.store.get_or_insert_default();
        own
    }

    /// What may stop the run.
    pub fn interrupt(&self) -> &Interrupt {
        &self.interrupt
    }

    fn store(&self) -> Option<MutexGuard<'_, Store>> {
        let store = self.store.as_ref()?;
        Some(store.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What is remembered under this `key`.
    fn known<T: DeserializeOwned>(&self, key: u64) -> Option<T> {
        postcard::from_bytes(self.store()?.known.get(&key)?).ok()
    }

    /// What `compute` gives, or what is remembered where it is known under this `key`. What is remembered as `None` is known
    /// to be none.
    pub fn once<T: Serialize + DeserializeOwned>(
        &self,
        key: impl FnOnce() -> u64,
        compute: impl FnOnce() -> T,
    ) -> T {
        let never = |error| match error {};
        let result: std::result::Result<T, std::convert::Infallible> =
            self.try_once(key, || Ok(compute()));
        result.unwrap_or_else(never)
    }

    /// [`Memory::once`] of what can fail. Neither a failure is remembered nor what an interrupt may have broken off.
    ///
    /// # Errors
    /// As `compute`.
    pub fn try_once<T: Serialize + DeserializeOwned, E>(
        &self,
        key: impl FnOnce() -> u64,
        compute: impl FnOnce() -> std::result::Result<T, E>,
    ) -> std::result::Result<T, E> {
        if self.store.is_none() {
            return compute();
        }
        let key = key();
        if let Some(known) = self.known(key) {
            return Ok(known);
        }
        let result = compute()?;
        if self.interrupt.asked() {
            return Ok(result);
        }
        if let (Some(mut store), Ok(bytes)) = (self.store(), postcard::to_stdvec(&result)) {
            if let Some(checkpoint) = &mut store.checkpoint {
                checkpoint.keep(key, &bytes);
            }
            store.known.insert(key, bytes);
        }
        Ok(result)
    }

    /// Forgets everything: it was wrong.
    pub fn clear(&self) {
        if let Some(mut store) = self.store() {
            store.known.clear();
            if let Some(checkpoint) = &mut store.checkpoint {
                checkpoint.clear();
            }
        }
    }

    /// Where it is kept, if anything was computed and written there.
    pub fn kept(&self) -> Option<PathBuf> {
        let store = self.store()?;
        let checkpoint = store.checkpoint.as_ref()?;
        (!store.known.is_empty()).then(|| checkpoint.path.clone())
    }

    /// Why it is not kept any more, where that has failed.
    pub fn failure(&self) -> Option<String> {
        let store = self.store()?;
        let checkpoint = store.checkpoint.as_ref()?;
        let error = checkpoint.broken.as_ref()?;
        Some(format!(
            "the checkpoint {} cannot be written any more: {error}; --resume goes on from before that",
            checkpoint.path.display()
        ))
    }

    /// Refuses what was broken off in a stage, if it was, with the way to go on.
    ///
    /// # Errors
    /// It was.
    pub fn check(&self, broken_off: Option<&str>) -> Result<()> {
        let Some(stage) = broken_off else {
            return Ok(());
        };
        Err(Error::failed(
            interrupted(stage),
            match self.kept() {
                Some(path) => format!(
                    "add --resume to go on; {} has what was computed",
                    path.display()
                ),
                None => "give it an --out or --checkpoint to go on from another time".into(),
            },
        ))
    }

    /// Deletes the checkpoint, if there is one: the run has ended.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn forget(&self) -> Result<()> {
        let store = self.store();
        let checkpoint = store.as_ref().and_then(|own| own.checkpoint.as_ref());
        checkpoint.map_or(Ok(()), Checkpoint::remove)
    }
}

/// An evaluator whose costs are remembered. Where it has handed out costs that turn out to be wrong it fails: what was found
/// with them is worth nothing.
pub struct Remembering<'a> {
    evaluator: &'a mut dyn Evaluator,
    memory: Memory,
    misled: bool,
}

impl<'a> Remembering<'a> {
    /// `evaluator`, whose costs `memory` remembers.
    pub fn new(evaluator: &'a mut dyn Evaluator, memory: Memory) -> Self {
        Self {
            evaluator,
            memory,
            misled: false,
        }
    }

    /// Whether it has failed because costs were wrong that it had handed out, while others are computed right now: what was
    /// done with it is to be done again.
    pub fn misled(&self) -> bool {
        self.misled
    }
}

impl Evaluator for Remembering<'_> {
    fn describe(&self) -> String {
        self.evaluator.describe()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let key = || {
            let mut fingerprint = Fingerprint::default();
            fingerprint.text("costs");
            for Job {
                problem,
                population,
            } in jobs
            {
                fingerprint.problem(problem);
                fingerprint.values(&[population.len() as f64]);
                for candidate in population.iter() {
                    fingerprint.values(candidate);
                }
            }
            fingerprint.finish()
        };
        let (evaluator, misled, memory) = (&mut self.evaluator, &mut self.misled, &self.memory);
        let before = evaluator.refusals();
        let values: Vec<Vec<f64>> = memory.try_once(key, || {
            let costs = evaluator.costs_of(jobs);
            if evaluator.refusals() > before {
                memory.clear();
                *misled = costs.is_ok();
            }
            let costs = costs?;
            if *misled {
                return Err(Error::failed(
                    "costs that the search has used were wrong",
                    "begin anew",
                ));
            }
            let of_job = |costs: &Vec<Cost>| costs.iter().map(|cost| cost.value).collect();
            Ok(costs.iter().map(of_job).collect())
        })?;
        let of_job = |values: Vec<f64>| values.into_iter().map(Cost::finished).collect();
        Ok(values.into_iter().map(of_job).collect())
    }

    fn take_warnings(&mut self) -> Vec<String> {
        self.evaluator.take_warnings()
    }

    fn refusals(&self) -> u32 {
        self.evaluator.refusals()
    }
}

fn first_line(run: u64) -> String {
    format!("{SCHEMA} {} {run:016x}\n", env!("CARGO_PKG_VERSION"))
}

fn check(bytes: &[u8]) -> u64 {
    first_bytes(Sha256::new_with_prefix(bytes))
}

/// The first eight bytes of a hash, as a number.
fn first_bytes(hash: Sha256) -> u64 {
    let hash: [u8; 32] = hash.finalize().into();
    let first = hash.first_chunk().expect("32 bytes have eight");
    u64::from_le_bytes(*first)
}

/// What is appended to a checkpoint for a result. For tests.
#[doc(hidden)]
pub fn frame(key: u64, result: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(20 + result.len());
    bytes.extend((result.len() as u32).to_le_bytes());
    bytes.extend(key.to_le_bytes());
    bytes.extend(result);
    bytes.extend(check(&bytes).to_le_bytes());
    bytes
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Contents> {
    let line = bytes.iter().take(200).position(|&byte| byte == b'\n');
    let first = line.and_then(|end| std::str::from_utf8(&bytes[..end]).ok());
    let words: Vec<&str> = first.unwrap_or_default().split(' ').collect();
    let (Some(end), &[SCHEMA, version, run]) = (line, words.as_slice()) else {
        return Err(foreign(path, "does not begin like one"));
    };
    let number = u64::from_str_radix(run, 16).ok();
    let Some(run) = number.filter(|number| format!("{number:016x}") == run) else {
        return Err(foreign(path, "names no run"));
    };
    let mut contents = Contents {
        version: version.into(),
        run,
        known: HashMap::new(),
        whole: end + 1,
    };
    while let Some((key, result, size)) = next(&bytes[contents.whole..]) {
        contents.known.insert(key, result.to_vec());
        contents.whole += size;
    }
    Ok(contents)
}

/// Key, result and size of the frame that `bytes` begin with; `None` where it is not whole.
fn next(bytes: &[u8]) -> Option<(u64, &[u8], usize)> {
    let (size, rest) = bytes.split_first_chunk()?;
    let (key, rest) = rest.split_first_chunk()?;
    let size = u32::from_le_bytes(*size) as usize;
    let (result, rest) = rest.split_at_checked(size)?;
    let (expected, _) = rest.split_first_chunk()?;
    let whole = check(&bytes[..12 + size]) == u64::from_le_bytes(*expected);
    whole.then(|| (u64::from_le_bytes(*key), result, 20 + size))
}

/// How many results a checkpoint at `path` with these `bytes` holds. For tests.
///
/// # Errors
/// They are no checkpoint.
#[doc(hidden)]
pub fn results_in(path: &Path, bytes: &[u8]) -> Result<usize> {
    Ok(parse(path, bytes)?.known.len())
}

fn foreign(path: &Path, problem: &str) -> Error {
    Error::input(
        path.display(),
        format!("is no checkpoint: it {problem}"),
        "name the one that the run has written, or leave out --resume",
    )
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Error {
    Error::input(
        path.display(),
        format!("cannot be read and written: {error}"),
        "check the path, its permissions and the space left",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_a_checkpoint_asks_nothing_twice_and_the_next_one_anew() {
        let mut asked = 0;
        let mut ask = |memory: &Memory, key| {
            memory.once(
                || key,
                || {
                    asked += 1;
                    Some(0.1 + key as f64)
                },
            )
        };
        let none = Memory::default();
        let run = none.of_one_run();
        let answers = [&none, &none, &run, &run, &run.of_one_run()].map(|memory| ask(memory, 7));
        assert_eq!(answers, [Some(7.1); 5]);
        assert_eq!(ask(&run, 8), Some(8.1));
        run.clear();
        assert_eq!(ask(&run, 8), Some(8.1));
        ask(&none.of_one_run(), 7);
        assert_eq!(asked, 6);
    }

    /// With a hash that is not stated anywhere, what is kept would be lost with the next compiler.
    #[test]
    fn keys_and_checks_are_the_first_bytes_of_sha_256() {
        // The digests of "abc" and of "run", 0xff, 1.0 and -2.5 and the number 2 in eight bytes each, little-endian.
        assert_eq!(
            check(b"abc").to_le_bytes(),
            [0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea]
        );
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("run").values(&[1.0, -2.5]);
        assert_eq!(fingerprint.finish(), 0x56b21cc471bf6bc2);
    }
}
