//! One large population on many devices at once: each evaluates a slice. The devices of one machine stand on a thread each, those
//! of many in the processes that a launcher of MPI has started.
//!
//! Costs come back in the order of the candidates. What a candidate costs does not depend on its neighbours, so that they are those
//! of one device, to the bit, where all are alike; where they are not, within what these differ, and the description says so.

#[cfg(feature = "mpi")]
mod mpi;
mod slices;
mod thread;
#[cfg(any(feature = "mpi", test))]
mod wire;

#[cfg(feature = "mpi")]
pub use mpi::World;
pub use thread::OnThread;

use crate::evaluate::checking::warnings::Warnings;
use crate::evaluate::{Cost, Evaluator, Job, Population};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a rank answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The cost of every candidate of its slice, in order; infinite where it diverged.
    #[serde(skip)]
    pub costs: Vec<f64>,
    /// What it computes on.
    pub device: String,
    /// What a user should know, and was not told yet.
    pub warnings: Vec<String>,
    /// How often costs that it had handed out turned out to be wrong.
    pub refusals: u32,
}

impl Answer {
    /// What `evaluator` finds for `jobs`.
    ///
    /// # Errors
    /// The device fails, or the program.
    pub fn of(evaluator: &mut dyn Evaluator, jobs: &[Job<'_>]) -> Result<Self> {
        let attempt = catch_unwind(AssertUnwindSafe(|| evaluator.costs_of(jobs)));
        let costs = attempt.unwrap_or_else(|_| {
            Err(Error::failed(
                "the program failed there",
                "send what it printed to its makers",
            ))
        })?;
        Ok(Self {
            costs: costs.iter().flatten().map(|cost| cost.value).collect(),
            device: evaluator.describe(),
            warnings: evaluator.take_warnings(),
            refusals: evaluator.refusals(),
        })
    }
}

/// One of many devices that evaluate at once. One that has been opened answers first, without costs, whether that went well.
pub trait Rank {
    /// Begins to evaluate `jobs`.
    ///
    /// # Errors
    /// It cannot be told.
    fn begin(&mut self, jobs: &[Job<'_>]) -> Result<()>;

    /// What it has found; waits for it.
    ///
    /// # Errors
    /// It has failed.
    fn end(&mut self) -> Result<Answer>;
}

/// The rank of whoever asks the others: it evaluates when they have been told.
pub struct Own {
    evaluator: Box<dyn Evaluator>,
    answer: Option<Result<Answer>>,
}

impl Own {
    /// One that computes with `evaluator`.
    pub fn new(mut evaluator: Box<dyn Evaluator>) -> Self {
        let answer = Some(Answer::of(evaluator.as_mut(), &[]));
        Self { evaluator, answer }
    }
}

impl Rank for Own {
    fn begin(&mut self, jobs: &[Job<'_>]) -> Result<()> {
        self.answer = Some(Answer::of(self.evaluator.as_mut(), jobs));
        Ok(())
    }

    fn end(&mut self) -> Result<Answer> {
        self.answer.take().expect("it was asked before")
    }
}

/// Many ranks as one evaluator.
pub struct Ranks {
    /// What the user calls them: `rank` or `device`.
    word: &'static str,
    ranks: Vec<Box<dyn Rank>>,
    /// What each computes on, and how often its costs turned out to be wrong.
    devices: Vec<String>,
    refusals: Vec<u32>,
    warnings: Warnings,
}

impl Ranks {
    /// Those that are opened right now. The user calls each a `word`, such as `rank`, and counts them from 0.
    ///
    /// # Errors
    /// One of them cannot be opened.
    pub fn new(word: &'static str, ranks: Vec<Box<dyn Rank>>) -> Result<Self> {
        let mut all = Self {
            word,
            devices: vec![String::new(); ranks.len()],
            refusals: vec![0; ranks.len()],
            ranks,
            warnings: Warnings::default(),
        };
        all.gather(&vec![true; all.ranks.len()])?;
        Ok(all)
    }

    /// The costs of those that were `asked`, one after another.
    fn gather(&mut self, asked: &[bool]) -> Result<Vec<f64>> {
        let mut costs = Vec::new();
        let mut failed = None;
        for (number, rank) in self.ranks.iter_mut().enumerate() {
            if !asked[number] {
                continue;
            }
            let place = format!("{} {number}", self.word);
            // All are heard: none shall find its answer taken for that to a later question.
            match rank.end() {
                Ok(answer) => {
                    costs.extend(answer.costs);
                    self.devices[number] = answer.device;
                    self.refusals[number] = answer.refusals;
                    for warning in answer.warnings {
                        self.warnings.add(format!("{place}: {warning}"));
                    }
                }
                Err(error) => {
                    failed.get_or_insert(at(&place, error));
                }
            }
        }
        failed.map_or(Ok(costs), Err)
    }
}

/// The same error, of the rank at this `place`. What is wrong with the call says itself where.
fn at(place: &str, error: Error) -> Error {
    match error {
        Error::Failed { problem, remedy } => Error::failed(format!("{place}: {problem}"), remedy),
        other => other,
    }
}

impl Evaluator for Ranks {
    fn describe(&self) -> String {
        let mut kinds: Vec<(&str, Vec<String>)> = Vec::new();
        for (number, device) in self.devices.iter().enumerate() {
            match kinds.iter_mut().find(|(kind, _)| kind == device) {
                Some((_, numbers)) => numbers.push(number.to_string()),
                None => kinds.push((device, vec![number.to_string()])),
            }
        }
        let (count, word) = (self.devices.len(), self.word);
        if let [(kind, _)] = kinds[..] {
            return format!("{count} {word}s, each on {kind}");
        }
        let kinds = kinds
            .iter()
            .map(|(kind, numbers)| format!("{} on {kind}", numbers.join(", ")));
        let kinds: Vec<String> = kinds.collect();
        format!(
            "{count} {word}s: {}; their costs may differ in the last bits",
            kinds.join("; ")
        )
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let candidates: Vec<usize> = jobs.iter().map(|job| job.population.len()).collect();
        let count = self.ranks.len();
        let mut asked = vec![false; count];
        // The first one evaluates at once, when the others have been told.
        for (number, rank) in self.ranks.iter_mut().enumerate().rev() {
            let slices = slices::of_rank(&candidates, number, count);
            asked[number] = !slices.is_empty();
            if slices.is_empty() {
                continue;
            }
            let parts: Vec<(usize, Population)> = slices
                .into_iter()
                .map(|(job, part)| (job, jobs[job].population.part(part)))
                .collect();
            let parts: Vec<Job<'_>> = parts
                .iter()
                .map(|(job, population)| Job {
                    problem: jobs[*job].problem,
                    population,
                })
                .collect();
            let place = format!("{} {number}", self.word);
            rank.begin(&parts).map_err(|error| at(&place, error))?;
        }
        let mut costs = self.gather(&asked)?.into_iter().map(Cost::finished);
        let of_job = |&count: &usize| costs.by_ref().take(count).collect();
        Ok(candidates.iter().map(of_job).collect())
    }

    fn take_warnings(&mut self) -> Vec<String> {
        self.warnings.take()
    }

    fn refusals(&self) -> u32 {
        self.refusals.iter().sum()
    }
}

#[cfg(test)]
mod tests;
