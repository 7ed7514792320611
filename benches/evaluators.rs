//! Candidate-steps per second of every evaluator: `cargo bench --bench evaluators`.
//!
//! The same problems and populations as `servobee bench`, which reaches larger populations in less time.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{CpuEvaluator, Evaluator, Precision, workload};

const SAMPLES: usize = 200;
const SIZES: [usize; 3] = [64, 1024, 8192];

/// Every evaluator with a name that is short enough for criterion.
fn evaluators() -> Vec<(String, Box<dyn Evaluator>)> {
    let mut list: Vec<(String, Box<dyn Evaluator>)> = vec![
        (
            "CPU f64".into(),
            Box::new(CpuEvaluator::new(Precision::F64)),
        ),
        (
            "CPU f32".into(),
            Box::new(CpuEvaluator::new(Precision::F32)),
        ),
    ];
    for adapter in gpu::adapters() {
        let evaluator =
            GpuEvaluator::new(&adapter, Checks::Off).expect("the adapter gives a device");
        list.push((adapter.get_info().name, Box::new(evaluator)));
    }
    list
}

fn populations(criterion: &mut Criterion) {
    let mut evaluators = evaluators();
    for (structure, problem) in [
        ("actuator", workload::actuator(SAMPLES)),
        ("actuator_and_valve", workload::actuator_and_valve(SAMPLES)),
    ] {
        let mut group = criterion.benchmark_group(structure);
        group.sample_size(10);
        for size in SIZES {
            let population = workload::population(&problem, size);
            group.throughput(Throughput::Elements(problem.steps() * size as u64));
            for (name, evaluator) in &mut evaluators {
                let id = BenchmarkId::new(name.as_str(), size);
                group.bench_function(id, |bencher| {
                    bencher.iter(|| evaluator.costs(&problem, &population).expect("costs"));
                });
            }
        }
        group.finish();
    }
}

criterion_group!(benches, populations);
criterion_main!(benches);
