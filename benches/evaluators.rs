//! Candidate-rows per second of every evaluator, over population, rows and structure: `cargo bench --bench evaluators`.

#[path = "shared/evaluators.rs"]
mod evaluators;

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use servobee::evaluate::{CpuEvaluator, Evaluator, Precision, Problem, Status, workload};

const POPULATIONS: [usize; 3] = [64, 1024, 8192];
const ROWS: [usize; 2] = [200, 2000];
/// Rows and candidates that vary nothing where something else does.
const USUAL: (usize, usize) = (200, 1024);
/// Largest relative difference of a cost from that in f64, on few rows: lightly damped candidates in saturation are
/// chaotic.
const TOLERANCE: f64 = 1e-4;

fn population(criterion: &mut Criterion) {
    let mut group = group(criterion, "population");
    let problem = workload::actuator(USUAL.0);
    for size in POPULATIONS {
        measure(&mut group, &size.to_string(), &problem, size);
    }
}

fn rows(criterion: &mut Criterion) {
    let mut group = group(criterion, "rows");
    for rows in ROWS {
        measure(
            &mut group,
            &rows.to_string(),
            &workload::actuator(rows),
            USUAL.1,
        );
    }
}

fn structure(criterion: &mut Criterion) {
    let mut group = group(criterion, "structure");
    let (rows, size) = USUAL;
    let problems = [
        ("actuator", workload::actuator(rows)),
        ("actuator and valve", workload::actuator_and_valve(rows)),
        (
            "with hysteresis",
            workload::with_effects(&["hysteresis"], rows),
        ),
        ("with delay", workload::with_effects(&["delay"], rows)),
        (
            "with three effects",
            workload::with_effects(&["null_bias", "friction", "overlap"], rows),
        ),
    ];
    for (name, problem) in problems {
        measure(&mut group, name, &problem, size);
    }
}

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    check();
    let mut group = criterion.benchmark_group(name);
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    group
}

/// Costs must be right before their speed counts.
fn check() {
    let effects = ["null_bias", "friction", "overlap"];
    for problem in [
        workload::actuator(USUAL.0),
        workload::with_effects(&effects, USUAL.0),
    ] {
        let population = workload::population(&problem, 256);
        let expected = CpuEvaluator::new(Precision::F64)
            .costs(&problem, &population)
            .expect("costs");
        for (name, mut evaluator) in evaluators::evaluators() {
            let costs = evaluator.costs(&problem, &population).expect("costs");
            for (i, (cost, expected)) in costs.iter().zip(&expected).enumerate() {
                assert_eq!(cost.status, expected.status, "{name}, candidate {i}");
                let difference = (cost.value / expected.value - 1.0).abs();
                assert!(
                    cost.status == Status::Diverged || difference <= TOLERANCE,
                    "{name}, candidate {i}: a cost that differs by {difference:.1e} of it"
                );
            }
        }
    }
}

fn measure(group: &mut BenchmarkGroup<WallTime>, case: &str, problem: &Problem, size: usize) {
    let population = workload::population(problem, size);
    group.throughput(Throughput::Elements((problem.rows() * size) as u64));
    for (name, mut evaluator) in evaluators::evaluators() {
        group.bench_function(BenchmarkId::new(name, case), |bencher| {
            bencher.iter(|| {
                evaluator
                    .costs(black_box(problem), black_box(&population))
                    .expect("costs")
            });
        });
    }
}

criterion_group!(benches, population, rows, structure);
criterion_main!(benches);
