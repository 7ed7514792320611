//! Swarms that forage together: one evaluation for the generation of all of them.

use super::Bees;
use crate::Result;
use crate::evaluate::{Evaluator, Job, Population, Problem};
use std::ops::ControlFlow;

/// A search under way on its problem.
#[derive(Debug, Clone)]
pub struct Swarm<'a> {
    /// What its candidates are evaluated on.
    pub problem: &'a Problem,
    /// The search over the problem's free parameters.
    pub bees: Bees,
}

/// Lets all swarms forage until each is finished, generation by generation in lockstep: many small swarms fill a device
/// that each alone would leave idle. Each finds, bit by bit, what it finds alone. `progress` is told each generation
/// that is done, and may break off: what was found until then stands.
///
/// # Errors
/// If the evaluator fails.
pub fn forage<'s, 'p: 's>(
    swarms: impl IntoIterator<Item = &'s mut Swarm<'p>>,
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<()> {
    let mut swarms: Vec<_> = swarms.into_iter().collect();
    for generation in 0.. {
        swarms.retain(|swarm| !swarm.bees.finished());
        if swarms.is_empty() {
            break;
        }
        let populations: Vec<Population> = swarms.iter_mut().map(|s| s.bees.ask()).collect();
        let jobs: Vec<Job> = swarms
            .iter()
            .zip(&populations)
            .map(|(swarm, population)| Job {
                problem: swarm.problem,
                population,
            })
            .collect();
        let costs = evaluator.costs_of(&jobs)?;
        for (swarm, costs) in swarms.iter_mut().zip(costs) {
            swarm.bees.tell(&costs);
        }
        if progress(generation).is_break() {
            break;
        }
    }
    Ok(())
}
