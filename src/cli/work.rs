//! A long run: its evaluator, and the checkpoint from which it goes on if it is cut off.

use super::interrupt;
use super::options::Options;
use servobee::evaluate::{Checkpoint, Checkpointed, Chosen, Evaluator};
use servobee::{Error, Result};
use std::path::PathBuf;

/// A long run.
pub(super) struct Work {
    checkpoint: Option<Checkpoint>,
}

impl Options {
    /// Begins, or goes on with, the run of the fingerprint `run`.
    ///
    /// # Errors
    /// The checkpoint is there and not asked for, of another run, or cannot be written.
    pub(super) fn begin(&self, run: u64) -> Result<Work> {
        let path = self.checkpoint_path();
        if self.resume && path.is_none() {
            return Err(Error::input(
                "--resume",
                "there is no checkpoint to go on from",
                "add the --out or --checkpoint of the run that was cut off",
            ));
        }
        let open = |path: PathBuf| match self.resume {
            true => Checkpoint::resume(&path, run),
            false => Checkpoint::create(&path, run, self.force),
        };
        let checkpoint = path.map(open).transpose()?;
        if let Some(checkpoint) = &checkpoint
            && self.resume
            && self.talks()
        {
            tell!(
                "Going on after {} generations, from {}",
                checkpoint.calls(),
                checkpoint.path().display()
            );
        }
        interrupt::watch()?;
        Ok(Work { checkpoint })
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
    /// What `run` computes with the evaluator, and what the user has to be told of it.
    ///
    /// # Errors
    /// As `run`. Where the run failed after a while, the remedy names the checkpoint.
    pub(super) fn run<T>(
        &mut self,
        chosen: &mut Chosen,
        run: impl FnOnce(&mut dyn Evaluator) -> Result<T>,
    ) -> Result<(T, Vec<String>)> {
        let evaluator = chosen.evaluator.as_mut();
        let Some(checkpoint) = &mut self.checkpoint else {
            let result = run(evaluator)?;
            return Ok((result, evaluator.take_warnings()));
        };
        let mut evaluator = Checkpointed::new(evaluator, checkpoint);
        let result = run(&mut evaluator);
        let warnings = evaluator.take_warnings();
        match result {
            Ok(result) => Ok((result, warnings)),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// Ends the run: its results are written. `broken_off` says where it was interrupted, if it was.
    ///
    /// # Errors
    /// If it was, and with what it can be gone on from.
    pub(super) fn end(self, broken_off: Option<&str>) -> Result<()> {
        match (broken_off, self.checkpoint) {
            (None, None) => Ok(()),
            (None, Some(checkpoint)) => checkpoint.remove(),
            (Some(stage), None) => Err(Error::failed(
                format!("interrupted in \"{stage}\": what it says is what was known then"),
                "give it an --out or --checkpoint to go on from another time",
            )),
            (Some(stage), Some(checkpoint)) => Err(Error::failed(
                format!("interrupted in \"{stage}\": what it says is what was known then"),
                format!(
                    "add --resume to go on; {} has what was computed",
                    checkpoint.path().display()
                ),
            )),
        }
    }

    /// `error` with the way to go on. Where nothing was computed, nothing is left behind.
    fn failed(&mut self, error: Error) -> Error {
        match (error, self.checkpoint.take()) {
            (Error::Failed { problem, remedy }, Some(checkpoint)) if checkpoint.holds_work() => {
                let path = checkpoint.path().display();
                let remedy =
                    format!("{remedy}; --resume goes on with what was computed, in {path}");
                Error::Failed { problem, remedy }
            }
            (error @ Error::Failed { .. }, Some(checkpoint)) => {
                // That the run failed matters more than that an empty file stays.
                let _ = checkpoint.remove();
                error
            }
            (error, _) => error,
        }
    }
}
