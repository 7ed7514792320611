//! From valley to valley: where many parameters are free, the valley that a search has found need not be the deepest. Basin
//! hopping (Wales and Doye, 1997): some of the parameters are drawn again, all are polished, and the better of both is kept.

use super::fit::{Fit, Plan, Stoppable, fit, refine};
use super::polish::{PolishOptions, polish};
use crate::Result;
use crate::evaluate::{Evaluator, Fingerprint, Interrupt, Memory, Problem, reference};
use crate::model::Parameter;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Most free parameters of which a single search nearly always finds the deepest valley.
const FEW: usize = 8;
/// Hops that are tried at once; whatever the number of cores, so that the result is the same on each.
const TRIES: usize = 8;
/// A chain of hops ends after so many times that many in which the cost did not fall by [`NOTABLE`] of it, and after [`MOST`].
const STAGNANT: usize = 5;
const MOST: usize = 30;
const NOTABLE: f64 = 1e-3;
/// Chains from different starts, until two have found valleys equally deep and none has found a deeper one.
const CHAINS: u64 = 4;
/// Chances by turns of each parameter to be drawn again, and how far from where it is, or from its start value, as a share of
/// its range.
const CHANCES: [f64; 3] = [0.15, 0.3, 0.5];
const REACH: f64 = 0.2;
/// Only which valley is deepest matters.
const ROUGH: PolishOptions = PolishOptions {
    max_iterations: 60,
    gradient_tolerance: 1e-6,
    step_tolerance: 1e-7,
    cost_tolerance: 1e-6,
    damping: 1e-3,
    edge_tolerance: 0.03,
};

/// [`fit`], and where there are many free parameters on from what it found, and from their start values, to deeper valleys.
///
/// # Errors
/// As [`fit`].
pub fn fit_and_hop(
    problem: &Problem,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Fit> {
    let found = fit(problem, evaluator, plan, progress)?;
    let free = problem.free();
    if free.len() <= FEW || found.polished.is_none() {
        return Ok(found);
    }
    let key = || {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("hops").problem(problem);
        fingerprint.values(found.values()).finish()
    };
    let interrupt = plan.memory.interrupt();
    let (values, evaluations): (Vec<f64>, usize) = plan.memory.once(key, || {
        let mut hops = Hops::new(problem, &free, plan.seed, interrupt);
        let deepest = hops.deepest(&found);
        (deepest.values, hops.evaluations)
    });
    if interrupt.asked() || values == found.values() {
        return Ok(found);
    }
    let deepest = refine(problem, &values, plan)?;
    Ok(Fit {
        cost_at_start: found.cost_at_start,
        search: found.search,
        evaluations: found.evaluations + evaluations + deepest.evaluations,
        ..deepest
    })
}

/// Where hops lead to from the valley at `values`, and the candidates evaluated; `None` where there are so few free parameters
/// that a search finds the deepest valley, or no hop leads deeper.
pub(crate) fn hop_on(
    problem: &Problem,
    values: &[f64],
    seed: u64,
    memory: &Memory,
) -> (Option<Vec<f64>>, usize) {
    let free = problem.free();
    if free.len() <= FEW {
        return (None, 0);
    }
    let key = || {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("hops on").problem(problem);
        fingerprint.values(values).finish()
    };
    let (found, evaluations): (Vec<f64>, usize) = memory.once(key, || {
        let mut hops = Hops::new(problem, &free, seed, memory.interrupt());
        let mut valley = Valley {
            values: values.to_vec(),
            cost: reference::cost(problem, values).unwrap_or(f64::INFINITY),
        };
        hops.polish_all(&mut valley, vec![problem.start()]);
        let end = hops.chain(valley, &mut ChaCha8Rng::seed_from_u64(seed));
        (end.values, hops.evaluations)
    });
    (Some(found).filter(|found| found != values), evaluations)
}

/// A valley's bottom.
struct Valley {
    values: Vec<f64>,
    cost: f64,
}

/// Hops under way.
struct Hops<'a> {
    problem: &'a Problem,
    free: &'a [Parameter],
    seed: u64,
    interrupt: &'a Interrupt,
    evaluations: usize,
}

impl<'a> Hops<'a> {
    fn new(
        problem: &'a Problem,
        free: &'a [Parameter],
        seed: u64,
        interrupt: &'a Interrupt,
    ) -> Self {
        Self {
            problem,
            free,
            seed,
            interrupt,
            evaluations: 0,
        }
    }

    /// The deepest valley that chains of hops lead to, from the one that was `found`, from the start values, and from around
    /// these.
    fn deepest(&mut self, found: &Fit) -> Valley {
        let mut valley = Valley {
            values: found.values().to_vec(),
            cost: found.cost().unwrap_or(f64::INFINITY),
        };
        self.polish_all(&mut valley, vec![self.problem.start()]);
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut deepest = self.chain(valley, &mut random);
        for _ in 1..CHAINS {
            if self.interrupt.asked() {
                break;
            }
            let mut valley = Valley {
                values: self.problem.start(),
                cost: f64::INFINITY,
            };
            let start = self.drawn(&valley.values, 1.0, true, &mut random);
            self.polish_all(&mut valley, vec![start]);
            let end = self.chain(valley, &mut random);
            let least = deepest.cost.min(end.cost);
            let meet = deepest.cost.max(end.cost) <= (1.0 + NOTABLE) * least;
            if end.cost < deepest.cost {
                deepest = end;
            }
            if meet {
                break;
            }
        }
        deepest
    }

    /// Hops from `valley` until they lead no deeper.
    fn chain(&mut self, mut valley: Valley, random: &mut ChaCha8Rng) -> Valley {
        let mut stagnant = 0;
        for _ in 0..MOST {
            let before = valley.cost;
            let start = |number: usize| {
                let chance = CHANCES[number % CHANCES.len()];
                self.drawn(&valley.values, chance, number.is_multiple_of(2), random)
            };
            let starts = (0..TRIES).map(start).collect();
            self.polish_all(&mut valley, starts);
            stagnant = match valley.cost < (1.0 - NOTABLE) * before {
                true => 0,
                false => stagnant + 1,
            };
            if stagnant == STAGNANT || self.interrupt.asked() {
                break;
            }
        }
        valley
    }

    /// `values` of which each is drawn again by `chance`, around its start or around where it is.
    fn drawn(
        &self,
        values: &[f64],
        chance: f64,
        around_start: bool,
        random: &mut ChaCha8Rng,
    ) -> Vec<f64> {
        let draw = |(parameter, &value): (&Parameter, &f64)| {
            if random.random::<f64>() >= chance {
                return value;
            }
            let about = if around_start {
                parameter.nominal()
            } else {
                value
            };
            let moved = parameter.to_unit(about) + REACH * random.random_range(-1.0..1.0);
            parameter.from_unit(moved.clamp(0.0, 1.0))
        };
        self.free.iter().zip(values).map(draw).collect()
    }

    /// Polishes from each of `starts`, and keeps the deepest of their valleys and this one.
    fn polish_all(&mut self, valley: &mut Valley, starts: Vec<Vec<f64>>) {
        let polished = |start: Vec<f64>| {
            let mut stoppable = Stoppable::new(self.problem, self.interrupt);
            polish(&mut stoppable, self.free, &start, &ROUGH).ok()
        };
        let found: Vec<_> = starts.into_par_iter().filter_map(polished).collect();
        for one in found {
            self.evaluations += one.evaluations;
            if one.cost < valley.cost {
                (valley.values, valley.cost) = (one.values, one.cost);
            }
        }
    }
}
