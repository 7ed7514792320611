//! The CPU evaluator: vectors of candidates, one vector a task, tasks on all cores.

use crate::Result;
use crate::evaluate::order::side_by_side;
use crate::evaluate::problem::{Data, Problem, Series, Tone, Wave};
use crate::evaluate::simulation::Lead;
use crate::evaluate::simulation::instructions::with_vectors;
use crate::evaluate::simulation::reference::{self, cost_in};
use crate::evaluate::simulation::simulate::{Counted, STATE_LIMIT, response, squares, with_states};
use crate::evaluate::{Cost, Evaluator, Job, Population, Status};
use crate::model::real::{Element, Lanes};
use crate::model::{Alone, Output, Outputs, Real, View};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::marker::PhantomData;

/// Rows from which on candidates are sorted.
const LEAST_ROWS_TO_SORT: usize = 256;

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
    pub(in crate::evaluate) fn without_vectors(precision: Precision) -> Self {
        Self {
            precision,
            instructions: Arch::Scalar,
        }
    }

    /// The residuals of every candidate, those of [`reference::residuals`] without their gradients; `None` where it diverges.
    pub(crate) fn residuals(
        &self,
        problem: &Problem,
        population: &Population,
    ) -> Vec<Option<Vec<f64>>> {
        match self.precision {
            Precision::F64 => all_residuals::<f64>(problem, population, self.instructions),
            Precision::F32 => all_residuals::<f32>(problem, population, self.instructions),
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
        side_by_side(jobs, LEAST_ROWS_TO_SORT, |jobs| {
            Ok(match self.precision {
                Precision::F64 => all_batches::<f64>(jobs, self.instructions),
                Precision::F32 => all_batches::<f32>(jobs, self.instructions),
            })
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
    match with_vectors(instructions, Bits) {
        Some(512) => "512-bit vectors",
        Some(256) => "256-bit vectors",
        Some(128) => "128-bit vectors",
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
    let width = with_vectors(instructions, Width(PhantomData::<E>)).unwrap_or(1);
    let batches_of = |(number, job): (usize, &Job<'_>)| {
        let starts = (0..job.population.len()).step_by(width);
        starts.map(move |first| (number, first)).collect::<Vec<_>>()
    };
    let batches: Vec<(usize, usize)> = jobs.iter().enumerate().flat_map(batches_of).collect();
    let evaluate = |&(number, first): &(usize, usize)| {
        let batch = Batch {
            problem: jobs[number].problem,
            wave: &waves[number],
            population: jobs[number].population,
            first,
            element: PhantomData::<E>,
        };
        batch
            .costs(instructions, None)
            .unwrap_or_else(|| vec![batch.cost_of_first()])
    };
    let found: Vec<Vec<Cost>> = batches.par_iter().map(evaluate).collect();
    let mut costs = vec![Vec::new(); jobs.len()];
    for ((number, _), batch) in batches.into_iter().zip(found) {
        costs[number].extend(batch);
    }
    costs
}

/// The residuals of all candidates on records.
fn all_residuals<E: Element>(
    problem: &Problem,
    population: &Population,
    instructions: Arch,
) -> Vec<Option<Vec<f64>>> {
    let Some(width) = with_vectors(instructions, Width(PhantomData::<E>)) else {
        return population
            .iter()
            .map(|one| reference::residuals_alone(problem, one))
            .collect();
    };
    let starts: Vec<usize> = (0..population.len()).step_by(width).collect();
    let batches = starts.into_par_iter().flat_map_iter(|first| {
        let batch = Batch {
            problem,
            wave: &Wave::new(&[]),
            population,
            first,
            element: PhantomData::<E>,
        };
        let mut kept = Vec::with_capacity(problem.values() * width);
        let costs = batch.costs(instructions, Some(&mut kept));
        let costs = costs.expect("there are vectors");
        let all = reference::residuals_side_by_side(problem, &kept, [width, costs.len()]);
        let finished =
            |(one, cost): (Vec<f64>, Cost)| (cost.status == Status::Finished).then_some(one);
        all.into_iter().zip(costs).map(finished)
    });
    batches.collect()
}

/// Asks how many candidates a batch has.
struct Width<E>(PhantomData<E>);

impl<E: Element> WithSimd for Width<E> {
    type Output = usize;
    fn with_simd<S: Simd>(self, _: S) -> usize {
        Lanes::<E, S>::WIDTH
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

impl<E: Element> Batch<'_, E> {
    /// Chooses the loop by the structure first and by the instructions then: each is a function of its own, small enough
    /// for the compiler. `None` without vector instructions. Where what counts of records is to be `kept`, all lanes of one value
    /// after those of another, nothing of it is summed.
    fn costs(&self, instructions: Arch, kept: Option<&mut Vec<E>>) -> Option<Vec<Cost>> {
        match &*self.problem.data {
            Data::Series(all) => with_states!(
                &self.problem.structure,
                in_time::<E>(self, all, instructions, kept)
            ),
            Data::Tones(tones) => with_vectors(instructions, OnTones { batch: self, tones }),
        }
    }

    /// The cost of the first candidate alone.
    fn cost_of_first(&self) -> Cost {
        let cost = cost_in::<E>(
            self.problem,
            &Lead::default(),
            self.population.candidate(self.first),
            f64::INFINITY,
        );
        cost.map_or(Cost::DIVERGED, Cost::finished)
    }
}

fn in_time<E: Element, const N: usize, V: View>(
    batch: &Batch<'_, E>,
    all: &[Series],
    instructions: Arch,
    kept: Option<&mut Vec<E>>,
) -> Option<Vec<Cost>> {
    let task = InTime::<E, N, V> {
        batch,
        all,
        kept,
        view: PhantomData,
    };
    with_vectors(instructions, task)
}

/// A batch on records in time, of a structure with room for `N` states.
struct InTime<'a, E, const N: usize, V> {
    batch: &'a Batch<'a, E>,
    all: &'a [Series],
    kept: Option<&'a mut Vec<E>>,
    view: PhantomData<V>,
}

impl<E: Element, const N: usize, V: View> WithSimd for InTime<'_, E, N, V> {
    type Output = Vec<Cost>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Vec<Cost> {
        let problem = self.batch.problem;
        let mut lanes = Lockstep::<E, S>::new(self.batch);
        let plant = lanes.plant::<V>();
        let mut sums = vec![Outputs::all(0.0); lanes.count];
        let loss = problem.own_loss();
        for series in self.all {
            let counts = problem.compares(series);
            let mut keep;
            let counted = match &mut self.kept {
                None => Counted::summed(loss),
                Some(kept) => {
                    keep = |outputs: &Outputs<Lanes<E, S>>| {
                        for output in Output::ALL.into_iter().filter(|output| counts[*output]) {
                            kept.extend_from_slice(outputs[output].lanes());
                        }
                    };
                    Counted::Kept(&mut keep)
                }
            };
            let add = |slice: Outputs<Lanes<E, S>>| {
                for (output, part) in slice.iter() {
                    for (sum, &lane) in sums.iter_mut().zip(part.lanes()) {
                        sum[output] += lane.into();
                    }
                }
            };
            let watch = |state: &[Lanes<E, S>]| watch(&mut lanes.diverged, state);
            squares::<_, N, _>(&problem.structure, series, counted, add, watch, &plant);
        }
        let costs = sums.into_iter().map(|sums| problem.cost_of_squares(sums));
        lanes.judged(costs)
    }
}

/// A batch on the tones of a sine stream.
struct OnTones<'a, E> {
    batch: &'a Batch<'a, E>,
    tones: &'a [Tone],
}

impl<E: Element> WithSimd for OnTones<'_, E> {
    type Output = Vec<Cost>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Cost> {
        let mut lanes = Lockstep::<E, S>::new(self.batch);
        let plant = lanes.plant::<Alone>();
        // A loop, not an iterator's closure: only what is inlined here is compiled for the wide vectors.
        let mut responses = Vec::with_capacity(self.tones.len());
        for tone in self.tones {
            let watch = |state: &[Lanes<E, S>]| watch(&mut lanes.diverged, state);
            responses.push(response(&plant, tone, self.batch.wave, watch));
        }
        let cost = |lane: usize| {
            let own = responses
                .iter()
                .map(|parts| parts.each_ref().map(|part| part.lanes()[lane].into()));
            self.batch.problem.cost_of_responses(self.tones, own)
        };
        lanes.judged((0..lanes.count).map(cost))
    }
}

/// The candidates of a batch, one a lane.
struct Lockstep<'a, E: Element, S: Simd> {
    problem: &'a Problem,
    /// Values of the free parameters.
    free: Vec<Lanes<E, S>>,
    /// Lanes that hold a candidate of their own: the first ones.
    count: usize,
    /// Which lanes' states have left all bounds.
    diverged: Vec<bool>,
}

impl<'a, E: Element, S: Simd> Lockstep<'a, E, S> {
    fn new(batch: &Batch<'a, E>) -> Self {
        let width = Lanes::<E, S>::WIDTH;
        let population = batch.population;
        let count = width.min(population.len() - batch.first);
        let value = |j: usize, lane: usize| {
            let candidate = population.candidate(batch.first + lane.min(count - 1));
            E::constant(candidate[j])
        };
        Self {
            problem: batch.problem,
            free: (0..population.dimension())
                .map(|j| Lanes::from_fn(|lane| value(j, lane)))
                .collect(),
            count,
            diverged: vec![false; width],
        }
    }

    #[inline(always)]
    fn plant<V: View>(&self) -> V::Plant<Lanes<E, S>> {
        let values = self.problem.complete(&self.free, Lanes::constant);
        V::plant(&self.problem.structure, &values)
    }

    fn judged(&self, costs: impl Iterator<Item = f64>) -> Vec<Cost> {
        let judge = |(cost, &diverged)| match diverged {
            true => Cost::DIVERGED,
            false => Cost::finished(cost),
        };
        costs.zip(&self.diverged).map(judge).collect()
    }
}

/// Marks the lanes whose state has left all bounds; whether all have.
#[inline(always)]
fn watch<E: Element, S: Simd>(diverged: &mut [bool], state: &[Lanes<E, S>]) -> bool {
    for value in state {
        for (flag, &value) in diverged.iter_mut().zip(value.lanes()) {
            let value: f64 = value.into();
            *flag |= value.is_nan() || value.abs() >= STATE_LIMIT;
        }
    }
    diverged.iter().all(|&flag| flag)
}
