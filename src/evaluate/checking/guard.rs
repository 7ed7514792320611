//! Evaluators that take over from each other: one that fails or computes wrong costs is given up, by name.

use crate::evaluate::checking::cross_check::{CrossCheck, Thoroughness};
use crate::evaluate::checking::warnings::Warnings;
use crate::evaluate::evaluator::{Evaluator, Job};
use crate::evaluate::population::Cost;
use crate::{Error, Result};
use std::collections::VecDeque;
use std::time::Instant;

/// What may evaluate, made when its turn comes.
pub struct Standby {
    name: String,
    thoroughness: Thoroughness,
    open: Box<dyn FnOnce() -> Result<Box<dyn Evaluator>>>,
}

impl Standby {
    /// The evaluator that `open` makes, called `name` in messages, whose costs are checked with this `thoroughness`.
    pub fn new<E: Evaluator + 'static>(
        name: impl Into<String>,
        thoroughness: Thoroughness,
        open: impl FnOnce() -> Result<E> + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            thoroughness,
            open: Box::new(|| Ok(Box::new(open()?))),
        }
    }
}

/// The first of several evaluators that works. Where it fails, or samples of its costs that are computed again in f64
/// show that they are wrong, the next computes what it should have computed, and whatever follows.
pub struct Guarded {
    current: Box<dyn Evaluator>,
    name: String,
    check: CrossCheck,
    standbys: VecDeque<Standby>,
    /// Names of those that have failed.
    failed: Vec<String>,
    warnings: Warnings,
    refusals: u32,
}

impl Guarded {
    /// An evaluator that is `first`, or the first of the `others` that works.
    ///
    /// # Errors
    /// If none can be made: what the last one says.
    pub fn new(first: Standby, others: impl IntoIterator<Item = Standby>) -> Result<Self> {
        let mut standbys: VecDeque<Standby> = others.into_iter().collect();
        standbys.push_front(first);
        let mut failed = Vec::new();
        let mut warnings = Warnings::default();
        let (current, name, check) = take_over(&mut standbys, &mut failed, None, &mut warnings)?;
        Ok(Self {
            current,
            name,
            check,
            standbys,
            failed,
            warnings,
            refusals: 0,
        })
    }
}

/// Makes the first of the `standbys` that can be made. Each error, of those that cannot and of what they take over from,
/// becomes a warning.
///
/// # Errors
/// If none can: the last error.
fn take_over(
    standbys: &mut VecDeque<Standby>,
    failed: &mut Vec<String>,
    before: Option<Error>,
    warnings: &mut Warnings,
) -> Result<(Box<dyn Evaluator>, String, CrossCheck)> {
    let mut errors: Vec<Error> = before.into_iter().collect();
    while let Some(Standby {
        name,
        thoroughness,
        open,
    }) = standbys.pop_front()
    {
        match open() {
            Ok(evaluator) => {
                for error in errors {
                    let (Error::Failed { problem, .. }
                    | Error::Input { problem, .. }
                    | Error::Unmet { problem, .. }) = error;
                    warnings.add(format!("{problem}; going on with {}", evaluator.describe()));
                }
                return Ok((evaluator, name, CrossCheck::new(thoroughness)));
            }
            Err(error) => {
                failed.push(name);
                errors.push(error);
            }
        }
    }
    Err(errors.pop().expect("at least one that failed"))
}

impl Evaluator for Guarded {
    /// What computes now, and in whose place.
    fn describe(&self) -> String {
        let now = self.current.describe();
        match self.failed.is_empty() {
            true => now,
            false => format!("{now} in place of {}", self.failed.join(" and ")),
        }
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        loop {
            let start = Instant::now();
            let costs = self.current.costs_of(jobs);
            let time = start.elapsed();
            for warning in self.current.take_warnings() {
                self.warnings.add(warning);
            }
            let error = match costs {
                Ok(costs) => match self.check.check(jobs, &costs, time) {
                    None => return Ok(costs),
                    Some(fault) => {
                        self.refusals += 1;
                        Error::failed(
                            format!("{} computes wrong costs: {fault}", self.name),
                            "update its driver, and use --evaluator cpu until then",
                        )
                    }
                },
                Err(error) => error,
            };
            if self.standbys.is_empty() {
                return Err(error);
            }
            self.failed.push(self.name.clone());
            (self.current, self.name, self.check) = take_over(
                &mut self.standbys,
                &mut self.failed,
                Some(error),
                &mut self.warnings,
            )?;
        }
    }

    fn take_warnings(&mut self) -> Vec<String> {
        self.warnings.take()
    }

    fn refusals(&self) -> u32 {
        self.refusals
    }
}
