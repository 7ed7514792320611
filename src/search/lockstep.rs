//! Several searches on one evaluator, in lockstep: one evaluation for the populations of all of them.

use super::{Method, Search, Start};
use crate::Result;
use crate::evaluate::{Evaluator, Job, Population, Problem};
use std::ops::ControlFlow;

/// A search under way on its problem.
pub struct RunningSearch<'a> {
    /// What its candidates are evaluated on.
    pub problem: &'a Problem,
    /// The search over the problem's free parameters.
    pub search: Box<dyn Search>,
}

impl<'a> RunningSearch<'a> {
    /// Begins a search by `method` over the free parameters of `problem`.
    ///
    /// # Errors
    /// As [`Method::begin`].
    pub fn begin(
        problem: &'a Problem,
        method: &dyn Method,
        start: Start,
        seed: u64,
    ) -> Result<Self> {
        let search = method.begin(&problem.free(), start, seed)?;
        Ok(Self { problem, search })
    }
}

/// Runs all searches until each is finished, generation by generation in lockstep: many small searches fill a device
/// that each alone would leave idle. Each finds, bit by bit, what it finds alone. `progress` is told each generation
/// that is done, and may break off: what was found until then stands.
///
/// # Errors
/// If the evaluator fails.
pub fn run_in_lockstep<'s, 'p: 's>(
    searches: impl IntoIterator<Item = &'s mut RunningSearch<'p>>,
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<()> {
    let mut running: Vec<_> = searches.into_iter().collect();
    for generation in 0.. {
        running.retain(|one| !one.search.finished());
        if running.is_empty() {
            break;
        }
        let populations: Vec<Population> = running.iter_mut().map(|s| s.search.ask()).collect();
        let jobs: Vec<Job> = running
            .iter()
            .zip(&populations)
            .map(|(one, population)| Job {
                problem: one.problem,
                population,
            })
            .collect();
        let costs = evaluator.costs_of(&jobs)?;
        for (one, costs) in running.iter_mut().zip(costs) {
            one.search.tell(&costs);
        }
        if progress(generation).is_break() {
            break;
        }
    }
    Ok(())
}
