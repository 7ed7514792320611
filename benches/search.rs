//! What a search costs beside its evaluations, and whole fits: `cargo bench --bench search`.

#[path = "shared/evaluators.rs"]
mod evaluators;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use servobee::evaluate::problem::{Data, Series, Stream};
use servobee::evaluate::{
    Cost, CpuEvaluator, Evaluator, Precision, Problem, parameters_for, structure_for, workload,
};
use servobee::model::Parameter;
use servobee::search::datasheet::{Case, FULL_SCALE};
use servobee::search::{Bees, Fit, Plan, Search, Settings, Start, fit, fit_all};
use servobee::simulator::Setup;
use std::ops::ControlFlow;
use std::sync::Arc;

const GENERATIONS: usize = 20;
/// Fits one after another and together.
const FITS: u64 = 64;

/// Ask and tell alone: the cost of a candidate is one multiplication a parameter.
fn generations(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ask and tell");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    for (name, settings) in [
        ("standard", Settings::standard()),
        ("large", Settings::large()),
    ] {
        for dimension in [3, 21] {
            let space = vec![Parameter::linear("x", "1", -1.0, 0.5, 1.0); dimension];
            let bees = || Bees::new(&space, settings, Start::Uniform, 1).expect("good settings");
            let candidates = settings.n + GENERATIONS * settings.per_generation();
            group.throughput(Throughput::Elements(candidates as u64));
            group.bench_function(format!("{name}, {dimension} parameters"), |bencher| {
                bencher.iter_batched(
                    bees,
                    |mut bees| {
                        for _ in 0..=GENERATIONS {
                            let cost = |x: &[f64]| Cost::finished(x.iter().map(|x| x * x).sum());
                            let costs: Vec<_> = bees.ask().iter().map(cost).collect();
                            bees.tell(&costs);
                        }
                        bees
                    },
                    BatchSize::SmallInput,
                );
            });
        }
    }
}

/// The paper's settings, without polish.
fn paper(seed: u64) -> Plan {
    Plan {
        method: Arc::new(Settings::paper()),
        polish: false,
        coloured: false,
        ..Plan::of_records(seed)
    }
}

/// The paper's search for K, T and S of the D675, from the phases at 90 %.
fn datasheet(criterion: &mut Criterion) {
    let sheets = Case::D675
        .sheets(FULL_SCALE, Stream::Paper)
        .expect("a built-in case");
    let problem = &sheets[1].problem;
    let plan = paper(1);
    let mut group = criterion.benchmark_group("fit");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5));
    for (name, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let mut evaluator = CpuEvaluator::new(precision);
        group.bench_function(format!("d675 response, paper, CPU {name}"), |bencher| {
            bencher.iter(|| {
                fit(black_box(problem), &mut evaluator, &plan, &mut |_| {
                    ControlFlow::Continue(())
                })
                .expect("a fit")
            });
        });
    }
}

/// The base model of `identify` on 2000 rows: bees and polish.
fn record(criterion: &mut Criterion) {
    let setup = Setup {
        seconds: 2.0,
        ..Setup::default()
    };
    let records = [setup.record().expect("a record")];
    let structure = structure_for(&records).expect("a structure");
    let parameters = parameters_for(&structure, &records);
    let mut series = Series::from_record(&records[0], &structure).expect("a series");
    series.set_steps(structure.fastest_rate(&parameters), 1);
    let problem = Problem::new(structure, parameters, Data::Series(vec![series]));
    let mut evaluator = CpuEvaluator::new(Precision::F32);
    let plan = Plan::of_records(1);
    let gain = fit(&problem, &mut evaluator, &plan, &mut |_| {
        ControlFlow::Continue(())
    })
    .expect("a fit")
    .values()[0];
    assert!(
        (gain / setup.valve.gain - 1.0).abs() < 0.05,
        "the fit finds the gain, not {gain}"
    );
    let mut group = criterion.benchmark_group("fit");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5));
    group.bench_function("record of 2000 rows, spool and flow", |bencher| {
        bencher.iter(|| {
            fit(black_box(&problem), &mut evaluator, &plan, &mut |_| {
                ControlFlow::Continue(())
            })
            .expect("a fit")
        });
    });
}

/// The paper's search on 200 rows, for many valves: one after another and together.
fn many(criterion: &mut Criterion) {
    // Each has its data on the device.
    let problems: Vec<Problem> = (0..FITS).map(|_| workload::actuator(200)).collect();
    let plans: Vec<Plan> = (0..FITS).map(paper).collect();
    let tasks: Vec<(&Problem, &Plan)> = problems.iter().zip(&plans).collect();
    let apart = |evaluator: &mut dyn Evaluator| -> Vec<Fit> {
        let one = |(problem, plan): &(&Problem, &Plan)| {
            fit(problem, evaluator, plan, &mut |_| ControlFlow::Continue(()))
        };
        let fits: servobee::Result<_> = tasks.iter().map(one).collect();
        fits.expect("fits")
    };
    let together = |evaluator: &mut dyn Evaluator| {
        fit_all(black_box(&tasks), evaluator, &mut |_| {
            ControlFlow::Continue(())
        })
        .expect("fits")
    };
    let mut group = criterion.benchmark_group(format!("{FITS} fits"));
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(5))
        .throughput(Throughput::Elements(FITS));
    for (name, mut evaluator) in evaluators::evaluators() {
        let evaluator = &mut *evaluator;
        // Written out, an f64 is told from every other.
        let [one, other] = [apart(evaluator), together(evaluator)].map(|fits| format!("{fits:?}"));
        assert!(one == other, "{name}: fits together differ from fits apart");
        group.bench_function(BenchmarkId::new(&name, "one after another"), |bencher| {
            bencher.iter(|| apart(evaluator));
        });
        group.bench_function(BenchmarkId::new(&name, "together"), |bencher| {
            bencher.iter(|| together(evaluator));
        });
    }
}

criterion_group!(benches, generations, datasheet, record, many);
criterion_main!(benches);
