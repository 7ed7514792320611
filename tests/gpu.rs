//! Many jobs at once on every evaluator, and what the GPU evaluator does with time, memory and a device that is lost.
//!
//! `SERVOBEE_SKIP_GPU=1` lets these tests pass on a machine without an adapter, and says so.

mod common;

use common::{case, random};
use servobee::evaluate::gpu::{Checks, GpuEvaluator, adapters, best};
use servobee::evaluate::{Cost, CpuEvaluator, Evaluator, Job, Population, Precision, Problem};

/// An evaluator on the best adapter; none where there is no adapter and the caller has allowed that.
fn gpu() -> Option<GpuEvaluator> {
    let adapters = adapters();
    let Some(adapter) = best(&adapters) else {
        assert!(
            std::env::var("SERVOBEE_SKIP_GPU").is_ok_and(|value| value == "1"),
            "no GPU adapter: install a Vulkan driver (mesa-vulkan-drivers is one in software), or set \
             SERVOBEE_SKIP_GPU=1"
        );
        println!("SKIPPED: no GPU adapter and SERVOBEE_SKIP_GPU=1: nothing was tested on a GPU");
        return None;
    };
    Some(GpuEvaluator::new(adapter, Checks::Off).expect("a device"))
}

/// Every evaluator of this machine.
fn evaluators() -> Vec<Box<dyn Evaluator>> {
    let mut list: Vec<Box<dyn Evaluator>> = vec![
        Box::new(CpuEvaluator::new(Precision::F64)),
        Box::new(CpuEvaluator::new(Precision::F32)),
    ];
    if let Some(gpu) = gpu() {
        list.push(Box::new(gpu));
    }
    list
}

fn bits(costs: &[Cost]) -> Vec<u64> {
    costs.iter().map(|cost| cost.value.to_bits()).collect()
}

#[test]
fn a_job_costs_among_others_what_it_costs_alone() {
    // Records and tones of several structures; the same problem twice, and one job without candidates.
    let names = [
        ("actuator, held", 70),
        ("tones, paper", 3),
        ("records of many lengths", 5),
        ("actuator, held", 1),
        ("table valve", 0),
        ("actuator and table valve", 130),
        ("tones, settled", 65),
    ];
    let problems = names.map(|(name, _)| case(name).problem);
    let populations: Vec<Population> = problems
        .iter()
        .zip(names)
        .zip(1..)
        .map(|((problem, (_, count)), seed)| random(problem, count, seed))
        .collect();
    let jobs: Vec<Job> = problems
        .iter()
        .zip(&populations)
        .map(|(problem, population)| Job {
            problem,
            population,
        })
        .collect();
    for mut evaluator in evaluators() {
        let name = evaluator.describe();
        let together = evaluator.costs_of(&jobs).expect("costs");
        assert_eq!(together.len(), jobs.len());
        for (costs, job) in together.iter().zip(&jobs) {
            assert_eq!(costs.len(), job.population.len(), "{name}");
            let alone = evaluator.costs(job.problem, job.population).expect("costs");
            assert_eq!(bits(costs), bits(&alone), "{name}");
        }
    }
}

#[test]
fn many_small_jobs_at_once_cost_what_each_costs_alone() {
    let problem = case("actuator, held").problem;
    // Constants of their own on data that all share.
    let problems: Vec<Problem> = (0..40)
        .map(|i| Problem {
            scale: [1.0 + f64::from(i), 1.0, 1.0],
            ..problem.clone()
        })
        .collect();
    let populations: Vec<Population> = (0..40).map(|i| random(&problem, 1 + i % 5, 9)).collect();
    let jobs: Vec<Job> = problems
        .iter()
        .zip(&populations)
        .map(|(problem, population)| Job {
            problem,
            population,
        })
        .collect();
    for mut evaluator in evaluators() {
        let together = evaluator.costs_of(&jobs).expect("costs");
        for (costs, job) in together.iter().zip(&jobs) {
            let alone = evaluator.costs(job.problem, job.population).expect("costs");
            assert_eq!(bits(costs), bits(&alone));
        }
    }
}

#[test]
fn no_jobs_have_no_costs() {
    for mut evaluator in evaluators() {
        assert!(evaluator.costs_of(&[]).expect("costs").is_empty());
    }
}
