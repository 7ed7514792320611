//! How fast a GPU is with workgroups of several sizes.

use super::super::table::table;
use super::phases::POPULATION;
use serde::Serialize;
use servobee::Result;
use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{Evaluator, Problem, wgsl, workload};
use std::time::{Duration, Instant};

/// Sizes that are tried.
const SIZES: [u32; 4] = [32, 64, 128, 256];
/// Runs of each at most.
const MOST_RUNS: usize = 50;

#[derive(Serialize)]
struct Report {
    schema: &'static str,
    adapters: Vec<Swept>,
}

#[derive(Serialize)]
struct Swept {
    name: String,
    results: Vec<Sized>,
}

#[derive(Serialize)]
struct Sized {
    workgroup: u32,
    runs: usize,
    /// The shortest of the runs.
    seconds: f64,
    candidate_steps_per_second: f64,
}

/// Measures every adapter with every size that it allows, and prints the rates.
///
/// # Errors
/// If there is no adapter or a device fails.
pub(super) fn run(problem: &Problem, budget: Duration, json: bool) -> Result<()> {
    let all = gpu::adapters();
    if all.is_empty() {
        return Err(gpu::none_found());
    }
    let share = budget / all.len() as u32;
    let sweep = |adapter| sweep(adapter, problem, share);
    let adapters = all.iter().map(sweep).collect::<Result<_>>()?;
    let report = Report {
        schema: "servobee/bench-workgroups/1",
        adapters,
    };
    if json {
        let text = serde_json::to_string_pretty(&report).expect("a report is JSON");
        tell!("{text}");
    } else {
        print(&report);
    }
    Ok(())
}

/// Runs all sizes in turn, so that whatever else the machine does slows all of them.
fn sweep(adapter: &wgpu::Adapter, problem: &Problem, share: Duration) -> Result<Swept> {
    let population = workload::population(problem, POPULATION);
    let mut evaluators = Vec::new();
    for workgroup in SIZES {
        let mut evaluator = GpuEvaluator::new(adapter, Checks::Off)?;
        // Every adapter allows the smaller ones.
        if evaluator.set_workgroup(workgroup).is_err() {
            break;
        }
        // The first call compiles, and learns the pace.
        evaluator.costs(problem, &population)?;
        evaluators.push((workgroup, evaluator, Vec::new()));
    }
    let start = Instant::now();
    for round in 0..MOST_RUNS {
        if round > 0 && start.elapsed() > share {
            break;
        }
        for (_, evaluator, runs) in &mut evaluators {
            let start = Instant::now();
            evaluator.costs(problem, &population)?;
            runs.push(start.elapsed().as_secs_f64());
        }
    }
    let steps = problem.steps() as f64 * population.len() as f64;
    let of_size = |(workgroup, _, runs): &(u32, GpuEvaluator, Vec<f64>)| {
        let seconds = runs.iter().copied().fold(f64::INFINITY, f64::min);
        Sized {
            workgroup: *workgroup,
            runs: runs.len(),
            seconds,
            candidate_steps_per_second: steps / seconds,
        }
    };
    Ok(Swept {
        name: gpu::describe(&adapter.get_info()),
        results: evaluators.iter().map(of_size).collect(),
    })
}

fn print(report: &Report) {
    tell!(
        "Million candidate-steps per second with {POPULATION} candidates, the best run; the default is {} \
         invocations.\n",
        wgsl::WORKGROUP
    );
    for swept in &report.adapters {
        let row = |one: &Sized| {
            let rate = one.candidate_steps_per_second / 1e6;
            vec![
                one.workgroup.to_string(),
                format!("{rate:.1}"),
                one.runs.to_string(),
            ]
        };
        let heads = ["workgroup", "rate", "runs"];
        tell!(
            "{}\n{}",
            swept.name,
            table(&heads, swept.results.iter().map(row))
        );
    }
}
