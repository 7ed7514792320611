//! A long run: its evaluator, and the checkpoint from which it goes on if it is cut off.

use super::options::Options;
use super::{colour, interrupt};
use servobee::evaluate::{Checkpoint, Chosen, Evaluator, Memory, Remembering};
use servobee::{Error, Result};
use std::path::PathBuf;

/// A long run.
pub(super) struct Work {
    /// What it remembers, for its searches.
    pub(super) memory: Memory,
}

impl Work {
    /// One that leaves nothing behind if it is cut off.
    pub(super) fn in_memory() -> Self {
        Self {
            memory: Memory::default().stopped_by(interrupt::interrupt()),
        }
    }
}

impl Options {
    /// Begins, or goes on with, the run of the fingerprint `run`.
    ///
    /// # Errors
    /// The checkpoint is there and not asked for, of another run, or cannot be written.
    pub(super) fn begin(&self, run: u64) -> Result<Work> {
        let path = self.checkpoint_path();
        if self.run.resume && path.is_none() {
            return Err(Error::input(
                "--resume",
                "there is no checkpoint to go on from",
                "add the --out or --checkpoint of the run that was cut off",
            ));
        }
        let open = |path: PathBuf| match self.run.resume {
            true => Checkpoint::resume(&path, run),
            false => Checkpoint::create(&path, run, self.run.force),
        };
        let checkpoint = path.map(open).transpose()?;
        if let Some(checkpoint) = &checkpoint
            && self.run.resume
            && self.talks()
        {
            tell!(
                "Going on with {} results from {}",
                checkpoint.results(),
                checkpoint.path().display()
            );
        }
        interrupt::watch()?;
        let memory = checkpoint.map(Memory::from).unwrap_or_default();
        Ok(Work {
            memory: memory.stopped_by(interrupt::interrupt()),
        })
    }

    /// Where the checkpoint lies: beside the folder of results, unless it is named.
    pub(super) fn checkpoint_path(&self) -> Option<PathBuf> {
        self.checkpoint.clone().or_else(|| {
            let mut name = self.out.as_ref()?.file_name()?.to_owned();
            name.push(".checkpoint");
            Some(self.out.as_ref()?.with_file_name(name))
        })
    }
}

impl Work {
    /// What `run` computes with the evaluator, and what the user has to be told of it. Where costs turn out to be wrong that
    /// it has used, it is run again, with what the evaluator has put in the place of what gave them.
    ///
    /// # Errors
    /// As `run`. Where the run failed after a while, the remedy names the checkpoint.
    pub(super) fn run<T>(
        &self,
        chosen: &mut Chosen,
        run: impl Fn(&mut dyn Evaluator) -> Result<T>,
    ) -> Result<(T, Vec<String>)> {
        let evaluator = chosen.evaluator.as_mut();
        let result = loop {
            let mut remembering = Remembering::new(evaluator, self.memory.clone());
            let result = run(&mut remembering);
            if !remembering.misled() {
                break result;
            }
        };
        let mut warnings = evaluator.take_warnings();
        warnings.extend(self.memory.failure());
        match result {
            Ok(result) => Ok((result, warnings)),
            Err(error) => {
                warnings.iter().for_each(colour::warning);
                Err(self.failed(error))
            }
        }
    }

    /// Ends the run: its results are written. `broken_off` says where it was interrupted, if it was.
    ///
    /// # Errors
    /// As of [`Work::check`].
    pub(super) fn end(self, broken_off: Option<&str>) -> Result<()> {
        self.check(broken_off)?;
        self.memory.forget()
    }

    /// # Errors
    /// If the run was interrupted, and how it can be gone on with.
    pub(super) fn check(&self, broken_off: Option<&str>) -> Result<()> {
        let Some(stage) = broken_off else {
            return Ok(());
        };
        Err(Error::failed(
            interrupted(stage),
            match self.memory.kept() {
                Some(path) => format!(
                    "add --resume to go on; {} has what was computed",
                    path.display()
                ),
                None => "give it an --out or --checkpoint to go on from another time".into(),
            },
        ))
    }

    /// `error` with the way to go on. Where nothing was computed, nothing is left behind.
    fn failed(&self, error: Error) -> Error {
        let Error::Failed { problem, remedy } = error else {
            return error;
        };
        let remedy = match self.memory.kept() {
            Some(path) => format!(
                "{remedy}; --resume goes on with what was computed, in {}",
                path.display()
            ),
            None => {
                // That the run failed matters more than that an empty file stays.
                let _ = self.memory.forget();
                remedy
            }
        };
        Error::Failed { problem, remedy }
    }
}

/// What is said of a run that was interrupted in this `stage`.
pub(super) fn interrupted(stage: &str) -> String {
    format!("interrupted in \"{stage}\": this is what was known then")
}
