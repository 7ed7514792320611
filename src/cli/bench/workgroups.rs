//! How fast a GPU is with workgroups of several sizes.

use super::super::table::table;
use super::phases::POPULATION;
use super::{Timing, time};
use serde::Serialize;
use servobee::Result;
use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{Evaluator, Problem, wgsl, workload};
use std::time::Duration;

/// Sizes that are tried.
const SIZES: [u32; 4] = [32, 64, 128, 256];

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
    #[serde(flatten)]
    timing: Timing,
}

/// Measures every adapter with every size that it allows, and prints the rates.
///
/// # Errors
/// If there is no adapter or a device fails.
pub(super) fn run(problem: &Problem, share: Duration, json: bool) -> Result<()> {
    let all = gpu::adapters();
    if all.is_empty() {
        return Err(gpu::none_found());
    }
    let population = workload::population(problem, POPULATION);
    let budget = share / (all.len() * SIZES.len()) as u32;
    let mut adapters = Vec::new();
    for adapter in &all {
        let mut evaluator = GpuEvaluator::new(adapter, Checks::Off)?;
        let mut results = Vec::new();
        for workgroup in SIZES {
            // Every adapter allows the smaller ones.
            if evaluator.set_workgroup(workgroup).is_err() {
                break;
            }
            // The first call compiles, and learns the pace.
            evaluator.costs(problem, &population)?;
            let timing = time(&mut evaluator, problem, &population, budget)?;
            results.push(Sized { workgroup, timing });
        }
        adapters.push(Swept {
            name: evaluator.describe(),
            results,
        });
    }
    let report = Report {
        schema: "servobee/bench-workgroups/1",
        adapters,
    };
    if json {
        let text = serde_json::to_string_pretty(&report).expect("a report is JSON");
        println!("{text}");
    } else {
        print(&report);
    }
    Ok(())
}

fn print(report: &Report) {
    println!(
        "Million candidate-steps per second with {POPULATION} candidates; the default is {} invocations.\n",
        wgsl::WORKGROUP
    );
    for swept in &report.adapters {
        let row = |one: &Sized| {
            let rate = one.timing.candidate_steps_per_second / 1e6;
            vec![
                one.workgroup.to_string(),
                format!("{rate:.1}"),
                one.timing.runs.to_string(),
            ]
        };
        let heads = ["workgroup", "rate", "runs"];
        println!(
            "{}\n{}",
            swept.name,
            table(&heads, swept.results.iter().map(row))
        );
    }
}
