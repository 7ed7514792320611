//! A whole diagnosis, as `servobee identify` makes it, of 2000 rows with one planted effect:
//! `cargo bench --bench diagnosis`.

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use servobee::evaluate::{CpuEvaluator, Precision};
use servobee::scorecard::{Outcome, Plan};

fn diagnosis(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("identify 2000 rows");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(1))
        .measurement_time(Duration::from_secs(10));
    let plan = Plan::default();
    for effect in ["hysteresis", "delay"] {
        let case = plan.case(&format!("single/{effect}/6x/1")).expect("a case");
        let mut setup = case.setup(plan.seed).expect("a setup");
        setup.seconds = 2.0;
        let mut cpu = CpuEvaluator::new(Precision::F32);
        let mut diagnose = || case.diagnose(&setup, &mut cpu).expect("a diagnosis").0;
        let row = diagnose();
        assert!(
            matches!(row.outcome, Outcome::Right | Outcome::Tied),
            "{effect}: {:?}, named {}",
            row.outcome,
            row.named
        );
        group.bench_function(effect, |bencher| {
            // Without making the record, which the row's seconds leave out.
            bencher.iter_custom(|count| {
                let seconds: f64 = (0..count).map(|_| diagnose().seconds).sum();
                Duration::from_secs_f64(seconds)
            });
        });
    }
}

criterion_group!(benches, diagnosis);
criterion_main!(benches);
