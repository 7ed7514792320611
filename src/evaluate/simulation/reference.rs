//! One candidate in f64: trajectories, phases, costs, and their exact sensitivities.

use crate::evaluate::STATE_LIMIT;
use crate::evaluate::problem::{DEGREES_PER_DECIBEL, Data, Problem, Series, Tone, Wave};
use crate::evaluate::simulation::simulate::{
    Row, Squares, outputs, response, run, series, with_states,
};
use crate::model::real::{Dual, PASS};
use crate::model::{Alone, BarePlant, Complete, Output, Outputs, Real, Structure, Valued, View};
use std::f64::consts::LN_10;

/// The outputs of every row of every record, for values of all parameters.
pub fn trajectories(
    structure: &Structure,
    values: &Complete<f64>,
    records: &[Series],
) -> Vec<Vec<Outputs<f64>>> {
    records
        .iter()
        .map(|record| outputs(structure, values, record))
        .collect()
}

/// Phase (degrees) and gain of the response to every tone, for values of all parameters.
pub fn responses(structure: &Structure, values: &Complete<f64>, tones: &[Tone]) -> Vec<(f64, f64)> {
    let plant = Alone::plant(structure, values);
    let wave = Wave::new(tones);
    let one = |tone: &Tone| {
        let watch: &mut dyn FnMut(&[f64]) -> bool = &mut |_| false;
        let [re, im] = response(&plant, tone, &wave, watch);
        (im.atan2(re).to_degrees(), re.hypot(im))
    };
    tones.iter().map(one).collect()
}

/// The cost of a candidate's free values, or `None` where it diverges.
pub fn cost(problem: &Problem, free: &[f64]) -> Option<f64> {
    cost_up_to(problem, free, f64::INFINITY)
}

/// The same, or `None` where it is above `most`: most such candidates show that after a few rows.
pub fn cost_up_to(problem: &Problem, free: &[f64], most: f64) -> Option<f64> {
    let cost = cost_in::<f64>(problem, free, most);
    cost.filter(|total| total.is_finite() && *total <= most)
}

/// The cost of a candidate's free values as it is computed in `R`, or `None` where a state has left all bounds, or the first
/// rows alone cost more than `most`.
pub(in crate::evaluate) fn cost_in<R: Valued + Into<f64>>(
    problem: &Problem,
    free: &[f64],
    most: f64,
) -> Option<f64> {
    let structure = &problem.structure;
    let free: Vec<R> = free.iter().map(|&value| R::constant(value)).collect();
    let values = problem.complete(&free, R::constant);
    let mut given_up = false;
    let mut watch = |state: &[R]| {
        let wild = |value: f64| value.is_nan() || value.abs() >= STATE_LIMIT;
        given_up |= state.iter().any(|&value| wild(value.into()));
        given_up
    };
    let total = match &*problem.data {
        Data::Series(records) => {
            let mut sums = Outputs::all(0.0);
            for record in records {
                let mut squares = Squares::new(structure, record, problem.own_loss());
                let mut above = false;
                let mut row = |k: usize, state: &[R], outputs: Outputs<R>| {
                    let mut so_far = sums;
                    add(&mut so_far, squares.slice());
                    above = problem.cost_of_squares(so_far) > most;
                    !above
                        && squares.add(k, state, outputs, |slice| add(&mut sums, slice), &mut watch)
                };
                let row: Row<R> = &mut row;
                with_states!(structure, run::<R>(structure, &values, record, row));
                if above {
                    return None;
                }
            }
            problem.cost_of_squares(sums)
        }
        Data::Tones(tones) => {
            let wave = Wave::new(tones);
            let plant = Alone::plant(structure, &values);
            let mut all = Vec::with_capacity(tones.len());
            for tone in tones {
                let watch: &mut dyn FnMut(&[R]) -> bool = &mut watch;
                all.push(response(&plant, tone, &wave, watch).map(R::into));
            }
            problem.cost_of_responses(tones, all)
        }
    };
    (!given_up).then_some(total)
}

/// Adds a slice's sums to those of all before it.
fn add<R: Into<f64>>(sums: &mut Outputs<f64>, slice: Outputs<R>) {
    for (sum, part) in sums.0.iter_mut().zip(slice.0) {
        *sum += part.into();
    }
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

/// A parameter's value with its derivatives with respect to the [`PASS`] that one pass carries.
type Number = Dual<PASS>;

/// The residuals with their derivatives with respect to the [`PASS`] free parameters from number `first` on.
fn pass(
    problem: &Problem,
    free: &[f64],
    first: usize,
    row: &mut dyn FnMut(f64, &[f64; PASS]),
) -> bool {
    let variable = |(index, &value): (usize, &f64)| match index.checked_sub(first) {
        Some(slot) if slot < PASS => Number::variable(value, slot),
        _ => Number::constant(value),
    };
    let free: Vec<Number> = free.iter().enumerate().map(variable).collect();
    let values = problem.complete(&free, Number::constant);
    match &*problem.data {
        Data::Series(records) => records.iter().all(|record| {
            with_states!(
                &problem.structure,
                pass_in_time::<Number>(problem, &values, record, row)
            )
        }),
        Data::Tones(tones) => pass_on_tones(&Alone::plant(&problem.structure, &values), tones, row),
    }
}

/// Whether a state has left all bounds.
fn wild(state: &[Number]) -> bool {
    state
        .iter()
        .any(|x| x.value.is_nan() || x.value.abs() >= STATE_LIMIT)
}

/// A pass over one record, of a structure with room for `N` states: each a function of its own, small enough for the
/// compiler.
#[allow(
    clippy::extra_unused_type_parameters,
    reason = "with_states names the numbers first"
)]
#[inline(never)]
fn pass_in_time<R, const N: usize, V: View>(
    problem: &Problem,
    values: &Complete<Number>,
    record: &Series,
    row: &mut dyn FnMut(f64, &[f64; PASS]),
) -> bool {
    let observed = problem.observed();
    let loss = problem.own_loss();
    let mut finished = true;
    let hand_over = |k: usize, state: &[Number], outputs: Outputs<Number>| {
        let sample = &record.samples[k];
        for output in Output::ALL {
            let factor = (sample.weight * problem.scale[output]).sqrt();
            if observed[output] && record.measured[output] && factor > 0.0 {
                let mut error = Number::constant(sample.target[output]) - outputs[output];
                if let Some((loss, sizes)) = loss
                    && error.value != 0.0
                {
                    let cost = loss(error, Number::constant(sizes[output]));
                    error = error.if_positive(cost.sqrt(), -cost.sqrt());
                }
                let error = error * Number::constant(factor);
                row(error.value, &error.gradient);
            }
        }
        finished &= !wild(state);
        finished
    };
    let plant = V::plant(&problem.structure, values);
    series::<Number, N, _>(&problem.structure, record, hand_over, &plant);
    finished
}

#[inline(never)]
fn pass_on_tones(
    plant: &BarePlant<Number>,
    tones: &[Tone],
    row: &mut dyn FnMut(f64, &[f64; PASS]),
) -> bool {
    let wave = Wave::new(tones);
    let mut finished = true;
    for tone in tones {
        let [re, im] = response(plant, tone, &wave, |state| {
            finished &= !wild(state);
            !finished
        });
        let factor = tone.weight.sqrt();
        let phase = im.atan2(re);
        if let Some(error) = tone.phase_error(phase.value) {
            let gradient = phase.gradient.map(|slope| -slope.to_degrees() * factor);
            row(error * factor, &gradient);
        }
        if let Some(error) = tone.gain_error(re.value.hypot(im.value)) {
            let factor = DEGREES_PER_DECIBEL * factor;
            let square = re * re + im * im;
            let decibels = 10.0 / (LN_10 * square.value);
            let gradient = square.gradient.map(|slope| -slope * decibels * factor);
            row(error * factor, &gradient);
        }
    }
    finished
}
