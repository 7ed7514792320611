//! A long run: the checkpoint from which it goes on if it is cut off, and what is shown and told of it.

use super::options::{Options, spinner};
use super::{colour, interrupt};
use servobee::evaluate::{Checkpoint, Chosen, Memory};
use servobee::{Error, Result};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// What a long run does with whom it tells its stages.
type Progress<'a> = &'a mut dyn FnMut(&str) -> ControlFlow<()>;

impl Options {
    /// Begins, or goes on with, the run of the fingerprint `run`: what it remembers.
    ///
    /// # Errors
    /// The checkpoint is there and not asked for, of another run, or cannot be written.
    pub(super) fn begin(&self, run: u64) -> Result<Memory> {
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
        Ok(memory.stopped_by(interrupt::interrupt()))
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

/// What `run` gives, whose stages are shown meanwhile, and which Ctrl-C breaks off.
pub(super) fn shown<T>(run: impl FnOnce(Progress) -> T) -> T {
    let bar = spinner();
    let result = run(&mut |stage| {
        bar.set_message(stage.to_owned());
        interrupt::goes_on()
    });
    bar.finish_and_clear();
    result
}

/// The `result` of a run. Of one that has failed the user is told what came before, and its error names the way to go on:
/// after a while that is the checkpoint, and where nothing was computed nothing is left behind.
///
/// # Errors
/// That of the run.
pub(super) fn told<T>(result: Result<T>, chosen: &mut Chosen, memory: &Memory) -> Result<T> {
    result.map_err(|error| {
        chosen.warnings(memory).iter().for_each(colour::warning);
        let Error::Failed { problem, remedy } = error else {
            return error;
        };
        let remedy = match memory.kept() {
            // Who has broken it off was told.
            Some(_) if remedy.contains("--resume") => remedy,
            Some(path) => format!(
                "{remedy}; --resume goes on with what was computed, in {}",
                path.display()
            ),
            None => {
                // That the run failed matters more than that an empty file stays.
                let _ = memory.forget();
                remedy
            }
        };
        Error::Failed { problem, remedy }
    })
}

/// Ends a run: its results are written. `broken_off` says where it was interrupted, if it was.
///
/// # Errors
/// As of [`Memory::check`].
pub(super) fn end(memory: &Memory, broken_off: Option<&str>) -> Result<()> {
    memory.check(broken_off)?;
    memory.forget()
}
