//! What was computed so far, kept on disk: a run that is cut off goes on from there.
//!
//! A search is the same whatever evaluates it, and everything random in it follows from its seed. So the costs that an
//! evaluator has given are all that a run has to remember: called again, it takes them from the file until they are used
//! up, and ends with the same bytes as a run that was never cut off.
//!
//! ```text
//! servobee/checkpoint/1 VERSION RUN⏎     16 hexadecimal digits name the run: what is fitted, and how
//! count u32 | key u64 | costs f64 × count | check u64     for every call, little-endian; the key tells its candidates
//! ```
//!
//! A frame that is not whole, or whose check is wrong, ends the file: what follows is computed again.

use super::{Cost, Evaluator, Job};
use crate::{Error, Result};
use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::hash::{DefaultHasher, Hasher};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a checkpoint begins with.
const SCHEMA: &str = "servobee/checkpoint/1";
/// How long what was written may wait until it is brought to the disk: it outlives the program at once, and the machine
/// after this.
const SYNC: Duration = Duration::from_secs(1);
/// Largest file that is read: a hundred million costs.
const LARGEST: u64 = 1 << 30;

/// Tells one run from another: the same things told in the same order give the same number.
#[derive(Debug, Clone, Default)]
pub struct Fingerprint(DefaultHasher);

impl Fingerprint {
    /// Tells the fingerprint of `text`.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.0.write(text.as_bytes());
        self.0.write_u8(0xff);
        self
    }

    /// Tells the fingerprint of `values`, bit by bit.
    pub fn values(&mut self, values: &[f64]) -> &mut Self {
        self.0.write(bytemuck::cast_slice(values));
        self.0.write_usize(values.len());
        self
    }

    /// The number.
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}

/// The costs of one call.
#[derive(Debug, Clone, PartialEq)]
struct Frame {
    key: u64,
    costs: Vec<f64>,
}

/// What is read of a checkpoint.
#[derive(Debug, PartialEq)]
struct Contents {
    version: String,
    run: u64,
    frames: VecDeque<Frame>,
    /// Bytes up to the end of the last whole frame.
    whole: usize,
}

/// The file in which the costs of a run are kept.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    file: File,
    frames: VecDeque<Frame>,
    holds_work: bool,
    synced: Instant,
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
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        // Written aside and moved: there is never a checkpoint without its first line.
        let draft = tempfile::Builder::new()
            .prefix(".servobee-")
            .tempfile_in(folder);
        let mut draft = draft.map_err(|error| wrong(&error))?;
        let version = env!("CARGO_PKG_VERSION");
        writeln!(draft, "{SCHEMA} {version} {run:016x}").map_err(|error| wrong(&error))?;
        draft.as_file().sync_all().map_err(|error| wrong(&error))?;
        lock(path, draft.as_file())?;
        let placed = match force {
            true => draft.persist(path),
            false => draft.persist_noclobber(path),
        };
        Ok(Self {
            path: path.to_owned(),
            file: placed.map_err(|error| wrong(&error.error))?,
            frames: VecDeque::new(),
            holds_work: false,
            synced: Instant::now(),
        })
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
        lock(path, &file)?;
        let size = file.metadata().map_err(wrong)?.len();
        if size > LARGEST {
            return Err(foreign(path, format!("has {size} bytes")));
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
        Ok(Self {
            path: path.to_owned(),
            file,
            holds_work: !contents.frames.is_empty(),
            frames: contents.frames,
            synced: Instant::now(),
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Calls whose costs it still has.
    pub fn calls(&self) -> usize {
        self.frames.len()
    }

    /// Whether it holds, or has held, any costs.
    pub fn holds_work(&self) -> bool {
        self.holds_work
    }

    /// Deletes the file: the run has ended.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn remove(self) -> Result<()> {
        std::fs::remove_file(&self.path).map_err(|error| {
            Error::failed(
                format!("{} cannot be deleted: {error}", self.path.display()),
                "delete it: the run has ended",
            )
        })
    }

    fn push(&mut self, frame: &Frame) -> std::io::Result<()> {
        // In one piece: whatever ends the program, the frame is there or is seen not to be.
        self.file.write_all(&bytes_of(frame))?;
        self.holds_work = true;
        if self.synced.elapsed() >= SYNC {
            self.file.sync_data()?;
            self.synced = Instant::now();
        }
        Ok(())
    }
}

/// An evaluator whose costs are kept in a checkpoint, and taken from it as long as it has them.
pub struct Checkpointed<'a> {
    evaluator: &'a mut dyn Evaluator,
    checkpoint: &'a mut Checkpoint,
    calls: u64,
    warnings: Vec<String>,
    broken: bool,
}

impl<'a> Checkpointed<'a> {
    /// `evaluator`, whose costs `checkpoint` keeps.
    pub fn new(evaluator: &'a mut dyn Evaluator, checkpoint: &'a mut Checkpoint) -> Self {
        Self {
            evaluator,
            checkpoint,
            calls: 0,
            warnings: Vec::new(),
            broken: false,
        }
    }
}

impl Evaluator for Checkpointed<'_> {
    fn describe(&self) -> String {
        self.evaluator.describe()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let key = key(self.calls, jobs);
        self.calls += 1;
        if let Some(frame) = self.checkpoint.frames.pop_front() {
            let count: usize = jobs.iter().map(|job| job.population.len()).sum();
            if frame.key != key || frame.costs.len() != count {
                return Err(Error::input(
                    self.checkpoint.path.display(),
                    format!("has other candidates in generation {}", self.calls),
                    "repeat the call that was cut off, or leave out --resume and add --force to begin again",
                ));
            }
            let mut costs = frame.costs.into_iter().map(Cost::finished);
            let of_job = |job: &Job<'_>| costs.by_ref().take(job.population.len()).collect();
            return Ok(jobs.iter().map(of_job).collect());
        }
        let costs = self.evaluator.costs_of(jobs)?;
        if !self.broken {
            let costs = costs.iter().flatten().map(|cost| cost.value).collect();
            if let Err(error) = self.checkpoint.push(&Frame { key, costs }) {
                self.broken = true;
                self.warnings.push(format!(
                    "the checkpoint {} cannot be written any more: {error}; --resume goes on from before that",
                    self.checkpoint.path.display()
                ));
            }
        }
        Ok(costs)
    }

    fn take_warnings(&mut self) -> Vec<String> {
        let mut warnings = std::mem::take(&mut self.warnings);
        warnings.extend(self.evaluator.take_warnings());
        warnings
    }
}

/// Tells the candidates of a call from those of another.
fn key(call: u64, jobs: &[Job<'_>]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write_u64(call);
    for job in jobs {
        hasher.write_usize(job.population.dimension());
        hasher.write_usize(job.population.len());
        for candidate in job.population.iter() {
            hasher.write(bytemuck::cast_slice(candidate));
        }
    }
    hasher.finish()
}

fn check(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    hasher.finish()
}

fn bytes_of(frame: &Frame) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(20 + 8 * frame.costs.len());
    bytes.extend((frame.costs.len() as u32).to_le_bytes());
    bytes.extend(frame.key.to_le_bytes());
    for cost in &frame.costs {
        bytes.extend(cost.to_le_bytes());
    }
    bytes.extend(check(&bytes).to_le_bytes());
    bytes
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Contents> {
    let line = bytes.iter().take(200).position(|&byte| byte == b'\n');
    let first = line.and_then(|end| std::str::from_utf8(&bytes[..end]).ok());
    let words: Vec<&str> = first.unwrap_or_default().split(' ').collect();
    let (Some(end), &[SCHEMA, version, run]) = (line, words.as_slice()) else {
        return Err(foreign(path, "does not begin like one".into()));
    };
    let Some(run) = u64::from_str_radix(run, 16)
        .ok()
        .filter(|number| format!("{number:016x}") == run)
    else {
        return Err(foreign(path, "names no run".into()));
    };
    let mut contents = Contents {
        version: version.into(),
        run,
        frames: VecDeque::new(),
        whole: end + 1,
    };
    while let Some((frame, size)) = frame(&bytes[contents.whole..]) {
        contents.frames.push_back(frame);
        contents.whole += size;
    }
    Ok(contents)
}

/// The frame that `bytes` begin with, and its size; `None` where it is not whole.
fn frame(bytes: &[u8]) -> Option<(Frame, usize)> {
    let (count, rest) = bytes.split_first_chunk()?;
    let (key, rest) = rest.split_first_chunk()?;
    let size = usize::try_from(u32::from_le_bytes(*count))
        .ok()?
        .checked_mul(8)?;
    let (costs, rest) = rest.split_at_checked(size)?;
    let (expected, _) = rest.split_first_chunk()?;
    let body = &bytes[..12 + size];
    let frame = Frame {
        key: u64::from_le_bytes(*key),
        costs: costs
            .as_chunks()
            .0
            .iter()
            .map(|bytes| f64::from_le_bytes(*bytes))
            .collect(),
    };
    (check(body) == u64::from_le_bytes(*expected)).then_some((frame, body.len() + 8))
}

/// What a checkpoint at `path` with these `bytes` holds: the number of its calls and their costs. For tests.
///
/// # Errors
/// They are no checkpoint.
#[doc(hidden)]
pub fn read_bytes(path: &Path, bytes: &[u8]) -> Result<Vec<Vec<f64>>> {
    let frames = parse(path, bytes)?.frames;
    Ok(frames.into_iter().map(|frame| frame.costs).collect())
}

fn lock(path: &Path, file: &File) -> Result<()> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(Error::input(
            path.display(),
            "is in use by a run that has not ended",
            "wait for it, or name another --checkpoint",
        )),
        // A file system without locks takes no harm but from two runs that are given the same file.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

fn foreign(path: &Path, problem: String) -> Error {
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
