//! One candidate in f64: trajectories, phases, costs, and their exact sensitivities.

use super::STATE_LIMIT;
use super::problem::{Data, Problem, Series, Tone, Wave};
use super::simulate::{outputs, response, series, squares, with_states};
use crate::model::real::{Dual, PASS};
use crate::model::{Plant, Real, Structure};

/// The outputs of every row of every record, in the order of [`crate::model::Output::ALL`], for values of all parameters.
pub fn trajectories(
    structure: &Structure,
    values: &[f64],
    records: &[Series],
) -> Vec<Vec<[f64; 3]>> {
    records
        .iter()
        .map(|record| outputs(structure, values, record))
        .collect()
}

/// Phase (degrees) and gain of the response to every tone, for values of all parameters.
pub fn responses(structure: &Structure, values: &[f64], tones: &[Tone]) -> Vec<(f64, f64)> {
    let plant = Plant::new(structure, values);
    let wave = Wave::new(tones);
    let one = |tone: &Tone| {
        let [re, im] = response(&plant, tone, &wave, |_| false);
        (im.atan2(re).to_degrees(), re.hypot(im))
    };
    tones.iter().map(one).collect()
}

/// The cost of a candidate's free values, or `None` where it diverges.
pub fn cost(problem: &Problem, free: &[f64]) -> Option<f64> {
    let values = problem.complete(free, |fixed| fixed);
    let plant = Plant::new(&problem.structure, &values);
    let mut diverged = false;
    let mut watch = |state: &[f64]| {
        diverged |= state
            .iter()
            .any(|value| value.is_nan() || value.abs() >= STATE_LIMIT);
        diverged
    };
    let total = match &*problem.data {
        Data::Series(records) => {
            let mut sums = [0.0; 3];
            let mut add = |slice: [f64; 3]| {
                for (sum, part) in sums.iter_mut().zip(slice) {
                    *sum += part;
                }
            };
            for record in records {
                with_states!(
                    &problem.structure,
                    squares::<f64>(
                        &problem.structure,
                        &plant,
                        record,
                        problem.own_loss(),
                        &mut add,
                        &mut watch
                    )
                );
            }
            problem.cost_of_squares(sums)
        }
        Data::Tones(tones) => {
            let wave = Wave::new(tones);
            let all: Vec<[f64; 2]> = tones
                .iter()
                .map(|tone| response(&plant, tone, &wave, &mut watch))
                .collect();
            problem.cost_of_responses(tones, all)
        }
    };
    (!diverged && total.is_finite()).then_some(total)
}

/// Hands every weighted residual, measured minus simulated, and its gradient with respect to the free parameters to
/// `row`; the squares of the residuals add up to [`cost`]. False where the candidate diverges.
pub fn residuals(problem: &Problem, free: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
    if free.len() <= PASS {
        return pass(problem, free, 0, &mut |residual, gradient| {
            row(residual, &gradient[..free.len()])
        });
    }
    // More parameters than one pass carries: keep the gradients of each pass until all are there.
    let mut rows: Vec<(f64, Vec<f64>)> = Vec::new();
    for first in (0..free.len()).step_by(PASS) {
        let count = PASS.min(free.len() - first);
        let mut next = 0;
        let finished = pass(problem, free, first, &mut |residual, gradient| {
            if first == 0 {
                rows.push((residual, Vec::with_capacity(free.len())));
            }
            rows[next].1.extend_from_slice(&gradient[..count]);
            next += 1;
        });
        if !finished {
            return false;
        }
    }
    for (residual, gradient) in &rows {
        row(*residual, gradient);
    }
    true
}

/// The residuals with their derivatives with respect to the [`PASS`] free parameters from number `first` on.
fn pass(
    problem: &Problem,
    free: &[f64],
    first: usize,
    row: &mut dyn FnMut(f64, &[f64; PASS]),
) -> bool {
    type Number = Dual<PASS>;
    let variable = |(index, &value): (usize, &f64)| match index.checked_sub(first) {
        Some(slot) if slot < PASS => Number::variable(value, slot),
        _ => Number::constant(value),
    };
    let free: Vec<Number> = free.iter().enumerate().map(variable).collect();
    let plant = Plant::new(
        &problem.structure,
        &problem.complete(&free, Number::constant),
    );
    let wild = |state: &[Number]| {
        state
            .iter()
            .any(|x| x.value.is_nan() || x.value.abs() >= STATE_LIMIT)
    };
    let mut finished = true;
    match &*problem.data {
        Data::Series(records) => {
            let observed = problem.observed();
            let loss = problem.own_loss();
            for record in records {
                let mut hand_over = |k: usize, state: &[Number], outputs: [Number; 3]| {
                    let sample = &record.samples[k];
                    for i in 0..3 {
                        let factor = (sample.weight * problem.scale[i]).sqrt();
                        if observed[i] && factor > 0.0 {
                            let mut error = Number::constant(sample.target[i]) - outputs[i];
                            if let Some((loss, sizes)) = loss
                                && error.value != 0.0
                            {
                                let cost = loss(error, Number::constant(sizes[i]));
                                error = error.if_positive(cost.sqrt(), -cost.sqrt());
                            }
                            let error = error * Number::constant(factor);
                            row(error.value, &error.gradient);
                        }
                    }
                    finished &= !wild(state);
                    finished
                };
                with_states!(
                    &problem.structure,
                    series::<Number>(&problem.structure, &plant, record, &mut hand_over)
                );
            }
        }
        Data::Tones(tones) => {
            let wave = Wave::new(tones);
            for tone in tones {
                let [re, im] = response(&plant, tone, &wave, |state| {
                    finished &= !wild(state);
                    !finished
                });
                let phase = im.atan2(re);
                let factor = tone.weight.sqrt();
                let gradient = phase.gradient.map(|slope| -slope.to_degrees() * factor);
                row(tone.error(phase.value) * factor, &gradient);
            }
        }
    }
    finished
}
