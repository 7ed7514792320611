//! The CPU evaluator: vectors of candidates, one vector a task, tasks on all cores.

use super::problem::{Data, Problem, Wave};
use super::simulate::{response, squares, with_states};
use super::{Cost, Evaluator, Job, Population};
use crate::Result;
use crate::model::real::{Element, IN_FLIGHT, Lanes};
use crate::model::{Plant, Real};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::marker::PhantomData;

/// A state beyond this magnitude (in its own unit) has diverged: far from any valve, and its square still a finite f32.
pub const STATE_LIMIT: f64 = 1e9;

/// The numbers that the CPU evaluator computes with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// The reference.
    F64,
    /// The GPU's twin: the same operations in the same order and precision.
    F32,
}

/// Evaluates populations on the CPU.
#[derive(Debug, Clone)]
pub struct CpuEvaluator {
    precision: Precision,
    instructions: Arch,
}

impl CpuEvaluator {
    /// An evaluator that computes with `precision`.
    pub fn new(precision: Precision) -> Self {
        Self {
            precision,
            instructions: Arch::new(),
        }
    }

    /// The same without the CPU's vector instructions: slower, and a witness of what these compute.
    pub(super) fn without_vectors(precision: Precision) -> Self {
        Self {
            precision,
            instructions: Arch::Scalar,
        }
    }
}

impl Evaluator for CpuEvaluator {
    fn describe(&self) -> String {
        let name = match self.precision {
            Precision::F64 => "f64",
            Precision::F32 => "f32",
        };
        format!("CPU ({name} lanes, {})", name_of(self.instructions))
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        Ok(match self.precision {
            Precision::F64 => all_batches::<f64>(jobs, self.instructions),
            Precision::F32 => all_batches::<f32>(jobs, self.instructions),
        })
    }
}

/// The name of vector instructions.
fn name_of(instructions: Arch) -> &'static str {
    struct Bits;
    impl WithSimd for Bits {
        type Output = usize;
        fn with_simd<S: Simd>(self, _: S) -> usize {
            size_of::<S::f32s>() * 8
        }
    }
    match instructions.dispatch(Bits) {
        512 => "512-bit vectors",
        256 => "256-bit vectors",
        128 => "128-bit vectors",
        _ => "no vectors",
    }
}

/// The costs of all jobs: the batches of all of them are one list of tasks, so that small jobs fill the cores together.
fn all_batches<E: Element>(jobs: &[Job<'_>], instructions: Arch) -> Vec<Vec<Cost>> {
    let wave = |job: &Job<'_>| match &*job.problem.data {
        Data::Tones(tones) => Wave::new(tones),
        Data::Series(_) => Wave::new(&[]),
    };
    let waves: Vec<Wave> = jobs.iter().map(wave).collect();
    let width = instructions.dispatch(Width(PhantomData::<E>));
    let batches_of = |(number, job): (usize, &Job<'_>)| {
        let starts = (0..job.population.len()).step_by(width);
        starts.map(move |first| (number, first)).collect::<Vec<_>>()
    };
    let batches: Vec<(usize, usize)> = jobs.iter().enumerate().flat_map(batches_of).collect();
    let evaluate = |&(number, first): &(usize, usize)| {
        instructions.dispatch(Batch {
            problem: jobs[number].problem,
            wave: &waves[number],
            population: jobs[number].population,
            first,
            element: PhantomData::<E>,
        })
    };
    let found: Vec<Vec<Cost>> = batches.par_iter().map(evaluate).collect();
    let mut costs = vec![Vec::new(); jobs.len()];
    for ((number, _), batch) in batches.into_iter().zip(found) {
        costs[number].extend(batch);
    }
    costs
}

/// Asks how many candidates a batch has.
struct Width<E>(PhantomData<E>);

impl<E: Element> WithSimd for Width<E> {
    type Output = usize;
    fn with_simd<S: Simd>(self, _: S) -> usize {
        Lanes::<E, S, IN_FLIGHT>::WIDTH
    }
}

/// The candidates from number `first` that are evaluated in lockstep; lanes past the population's end repeat the last.
struct Batch<'a, E> {
    problem: &'a Problem,
    wave: &'a Wave,
    population: &'a Population,
    first: usize,
    element: PhantomData<E>,
}

impl<E: Element> WithSimd for Batch<'_, E> {
    type Output = Vec<Cost>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Cost> {
        with_states!(&self.problem.structure, run::<E, S>(&self))
    }
}

#[inline(always)]
fn run<E: Element, S: Simd, const N: usize, const EFFECTS: bool>(batch: &Batch<E>) -> Vec<Cost> {
    let Batch {
        problem,
        wave,
        population,
        first,
        ..
    } = *batch;
    let width = Lanes::<E, S, IN_FLIGHT>::WIDTH;
    let count = width.min(population.len() - first);
    let free: Vec<Lanes<E, S, IN_FLIGHT>> = (0..population.dimension())
        .map(|j| Lanes::from_fn(|i| E::constant(population.candidate(first + i.min(count - 1))[j])))
        .collect();
    let plant = Plant::new(
        &problem.structure,
        &problem.complete(&free, Lanes::constant),
    );
    let mut diverged = vec![false; width];
    let mut watch = |state: &[Lanes<E, S, IN_FLIGHT>]| {
        for value in state {
            for (flag, &value) in diverged.iter_mut().zip(value.lanes()) {
                let value: f64 = value.into();
                *flag |= value.is_nan() || value.abs() >= STATE_LIMIT;
            }
        }
        diverged.iter().all(|&flag| flag)
    };
    let mut costs = vec![0.0; count];
    match &*problem.data {
        Data::Series(all) => {
            let mut sums = vec![[0.0; 3]; count];
            let loss = problem.own_loss();
            for series in all {
                let add = |slice: [Lanes<E, S, IN_FLIGHT>; 3]| {
                    for (output, part) in slice.iter().enumerate() {
                        for (sum, &lane) in sums.iter_mut().zip(part.lanes()) {
                            sum[output] += lane.into();
                        }
                    }
                };
                squares::<_, N, EFFECTS>(&problem.structure, &plant, series, loss, add, &mut watch);
            }
            for (cost, sums) in costs.iter_mut().zip(sums) {
                *cost = problem.cost_of_squares(sums);
            }
        }
        Data::Tones(tones) => {
            // A loop, not an iterator's closure: only what is inlined here is compiled for the wide vectors.
            let mut responses = Vec::with_capacity(tones.len());
            for tone in tones {
                responses.push(response(&plant, tone, wave, &mut watch));
            }
            for (i, cost) in costs.iter_mut().enumerate() {
                let own = responses
                    .iter()
                    .map(|parts| parts.each_ref().map(|part| part.lanes()[i].into()));
                *cost = problem.cost_of_responses(tones, own);
            }
        }
    }
    let judge = |(cost, diverged)| {
        if diverged {
            Cost::DIVERGED
        } else {
            Cost::finished(cost)
        }
    };
    costs.into_iter().zip(diverged).map(judge).collect()
}
