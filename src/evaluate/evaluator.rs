//! What every evaluator does: the costs of whole populations.

use crate::Result;
use crate::evaluate::population::{Cost, Population};
use crate::evaluate::problem::Problem;

/// A population to evaluate on a problem.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// What the candidates are evaluated on.
    pub problem: &'a Problem,
    /// Values of the problem's free parameters.
    pub population: &'a Population,
}

/// Computes the costs of populations.
pub trait Evaluator {
    /// What it is, for a report: the device and how it computes.
    fn describe(&self) -> String;

    /// The cost of every candidate of every job, in order. What a job costs does not depend on its neighbours; many
    /// small jobs at once fill a device that each alone would not.
    ///
    /// # Errors
    /// If the device fails.
    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>>;

    /// The cost of every candidate of `population` (values of the problem's free parameters), in order.
    ///
    /// # Errors
    /// If the device fails.
    fn costs(&mut self, problem: &Problem, population: &Population) -> Result<Vec<Cost>> {
        let jobs = [Job {
            problem,
            population,
        }];
        Ok(self.costs_of(&jobs)?.pop().expect("one list for one job"))
    }

    /// What a user should know of the calls so far, and was not told yet: devices that failed, and what went on instead.
    fn take_warnings(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// How often costs that had been handed out turned out to be wrong, as far as this is known. A search that has used
    /// costs from before this number grew does best to start anew.
    fn refusals(&self) -> u32 {
        0
    }
}
