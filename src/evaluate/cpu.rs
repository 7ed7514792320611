//! The CPU evaluator: vectors of candidates, one vector a task, tasks on all cores.

use super::problem::{Data, Problem, Wave};
use super::simulate::{response, squares, with_states};
use super::{Cost, Evaluator, Population};
use crate::Result;
use crate::model::real::Lanes;
use crate::model::{Plant, Real};
use rayon::prelude::*;

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
}

impl CpuEvaluator {
    /// An evaluator that computes with `precision`.
    pub fn new(precision: Precision) -> Self {
        Self { precision }
    }
}

impl Evaluator for CpuEvaluator {
    fn describe(&self) -> String {
        let name = match self.precision {
            Precision::F64 => "f64",
            Precision::F32 => "f32",
        };
        format!(
            "CPU ({name} lanes, {}, {} threads)",
            Width::detect().name(),
            rayon::current_num_threads()
        )
    }

    fn costs(&mut self, problem: &Problem, population: &Population) -> Result<Vec<Cost>> {
        let width = Width::detect();
        Ok(match self.precision {
            Precision::F64 => all_batches::<f64, 16>(width, problem, population),
            Precision::F32 => all_batches::<f32, 32>(width, problem, population),
        })
    }
}

/// The vector instructions that a batch is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Width {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    /// The widest that this CPU has.
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
            {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Baseline
    }

    fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline vectors",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "AVX-512",
        }
    }
}

fn all_batches<T, const W: usize>(
    width: Width,
    problem: &Problem,
    population: &Population,
) -> Vec<Cost>
where
    T: Real + Into<f64> + Send + Sync,
{
    let wave = match &*problem.data {
        Data::Tones(tones) => Wave::new(tones),
        Data::Series(_) => Wave::new(&[]),
    };
    let states = problem.structure.states().len();
    let batches: Vec<Vec<Cost>> = (0..population.len().div_ceil(W))
        .into_par_iter()
        .map(|batch| {
            let candidates: Vec<&[f64]> = (batch * W..population.len().min((batch + 1) * W))
                .map(|i| population.candidate(i))
                .collect();
            let mut costs =
                with_states!(states, dispatch::<T, W>(width, problem, &wave, &candidates));
            costs.truncate(candidates.len());
            costs
        })
        .collect();
    batches.concat()
}

fn dispatch<T, const W: usize, const N: usize>(
    width: Width,
    problem: &Problem,
    wave: &Wave,
    candidates: &[&[f64]],
) -> Vec<Cost>
where
    T: Real + Into<f64>,
{
    match width {
        Width::Baseline => batch::<T, W, N>(problem, wave, candidates),
        // SAFETY: `Width::detect` found these instructions on this CPU.
        #[cfg(target_arch = "x86_64")]
        Width::Avx2 => unsafe { batch_avx2::<T, W, N>(problem, wave, candidates) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Width::Avx512 => unsafe { batch_avx512::<T, W, N>(problem, wave, candidates) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn batch_avx2<T, const W: usize, const N: usize>(
    problem: &Problem,
    wave: &Wave,
    candidates: &[&[f64]],
) -> Vec<Cost>
where
    T: Real + Into<f64>,
{
    batch::<T, W, N>(problem, wave, candidates)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn batch_avx512<T, const W: usize, const N: usize>(
    problem: &Problem,
    wave: &Wave,
    candidates: &[&[f64]],
) -> Vec<Cost>
where
    T: Real + Into<f64>,
{
    batch::<T, W, N>(problem, wave, candidates)
}

/// The costs of up to `W` candidates, in lockstep; lanes without a candidate repeat the last one.
#[inline(always)]
fn batch<T, const W: usize, const N: usize>(
    problem: &Problem,
    wave: &Wave,
    candidates: &[&[f64]],
) -> Vec<Cost>
where
    T: Real + Into<f64>,
{
    let lane = |parameter: usize| {
        Lanes::<T, W>(std::array::from_fn(|i| {
            T::constant(candidates[i.min(candidates.len() - 1)][parameter])
        }))
    };
    let free: Vec<Lanes<T, W>> = (0..candidates[0].len()).map(lane).collect();
    let plant = Plant::new(
        &problem.structure,
        &problem.complete(&free, Lanes::constant),
    );
    let mut diverged = [false; W];
    let mut watch = |state: &[Lanes<T, W>; N]| {
        for value in state {
            for (flag, value) in diverged.iter_mut().zip(value.0) {
                let magnitude: f64 = value.into().abs();
                *flag |= !(magnitude < STATE_LIMIT);
            }
        }
        diverged.iter().all(|&flag| flag)
    };
    let mut costs = [0.0; W];
    match &*problem.data {
        Data::Series(all) => {
            let mut sums = [[0.0; 3]; W];
            for series in all {
                let add = |slice: [Lanes<T, W>; 3]| {
                    for (i, sum) in sums.iter_mut().enumerate() {
                        for (total, part) in sum.iter_mut().zip(slice) {
                            *total += part.0[i].into();
                        }
                    }
                };
                squares::<_, N>(&problem.structure, &plant, series, add, &mut watch);
            }
            for (cost, sums) in costs.iter_mut().zip(sums) {
                *cost = problem.cost_of_squares(sums);
            }
        }
        Data::Tones(tones) => {
            let responses: Vec<[Lanes<T, W>; 2]> = tones
                .iter()
                .map(|tone| response::<_, N>(&plant, tone, wave, &mut watch))
                .collect();
            for (i, cost) in costs.iter_mut().enumerate() {
                let own = responses
                    .iter()
                    .map(|[re, im]| [re.0[i].into(), im.0[i].into()]);
                *cost = problem.cost_of_responses(tones, own);
            }
        }
    }
    costs
        .iter()
        .zip(diverged)
        .map(|(&cost, diverged)| {
            if diverged {
                Cost::DIVERGED
            } else {
                Cost::finished(cost)
            }
        })
        .collect()
}
