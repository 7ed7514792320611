//! How far costs on the GPU are from the CPU's, in both modes of the driver's checks.

use super::{Setting, differences, on_cpu, quantile};
use servobee::evaluate::gpu::{Checks, GpuEvaluator};
use servobee::evaluate::{Evaluator, PARITY, Precision, workload};
use servobee::model::effects::CATALOGUE;
use servobee::{Error, Result};

/// Rows: lightly damped candidates in saturation are chaotic, and in time make any rounding large.
const ROWS: usize = 200;
/// Share of the candidates that must agree within [`PARITY`].
const SHARE: f64 = 0.9;

pub(crate) fn stage(setting: &Setting) -> Result<()> {
    let mut problems = vec![
        ("base model".to_string(), workload::actuator(ROWS)),
        ("with valve".into(), workload::actuator_and_valve(ROWS)),
    ];
    let effects = CATALOGUE.iter().take(setting.pick(CATALOGUE.len(), 3));
    problems.extend(effects.map(|entry| {
        let problem = workload::with_effects(&[entry.name], ROWS);
        (format!("with valve, {}", entry.name), problem)
    }));
    println!(
        "Relative difference of costs, candidates anywhere inside the bounds, {ROWS} rows. The cross-check of a search \
         asks again where a cost is off by more than {PARITY:.0e}.\n"
    );
    println!(
        "| structure | checks | GPU - f32: half | 99 % | worst | GPU - f64: half | 99 % | worst |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut wrong = Vec::new();
    for (name, problem) in &problems {
        let population = workload::population(problem, setting.pick(16_384, 256));
        let single = on_cpu(Precision::F32, problem, &population)?;
        let double = on_cpu(Precision::F64, problem, &population)?;
        for checks in [Checks::Off, Checks::On] {
            let costs = GpuEvaluator::new(&setting.adapter, checks)?.costs(problem, &population)?;
            let found = [&single, &double].map(|other| differences(&costs, other));
            let figures: Vec<String> = found
                .iter()
                .flat_map(|all| [0.5, 0.99, 1.0].map(|share| quantile(all, share)))
                .map(|difference| format!("{difference:.1e}"))
                .collect();
            println!("| {name} | {checks:?} | {} |", figures.join(" | "));
            if found.iter().any(|all| quantile(all, SHARE) > PARITY) {
                wrong.push(format!("{name}, checks {checks:?}"));
            }
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    let share = 100.0 * SHARE;
    Err(Error::failed(
        format!(
            "fewer than {share} % of the costs agree within {PARITY:.0e}: {}",
            wrong.join("; ")
        ),
        "do not trust this device's figures",
    ))
}
