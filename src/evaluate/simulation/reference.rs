//! One candidate in f64: trajectories, phases, costs, and their exact sensitivities.

use crate::evaluate::STATE_LIMIT;
use crate::evaluate::problem::loss::SizedLoss;
use crate::evaluate::problem::{DEGREES_PER_DECIBEL, Data, Problem, Sample, Series, Tone, Wave};
use crate::evaluate::simulation::Lead;
use crate::evaluate::simulation::instructions::{
    LongVectors, ShortVectors, in_vectors, long_vectors, short_vectors, with_short_vectors,
};
use crate::evaluate::simulation::simulate::{
    CHUNK, Counted, Row, Squares, outputs, response, run, series, with_states,
};
use crate::model::real::Dual;
use crate::model::{
    Alone, Complete, MOST_STATES, Output, Outputs, Real, Structure, Valued, View, Whole,
};
use pulp::{Scalar, Simd, WithSimd};
use std::f64::consts::LN_10;
use std::marker::PhantomData;

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
    led_cost_up_to(problem, &Lead::default(), free, most)
}

/// The same of a simulation that is led.
pub(crate) fn led_cost_up_to(
    problem: &Problem,
    lead: &Lead,
    free: &[f64],
    most: f64,
) -> Option<f64> {
    let cost = cost_in::<f64>(problem, lead, free, most);
    cost.filter(|total| total.is_finite() && *total <= most)
}

/// The cost of a candidate's free values as it is computed in `R`, or `None` where a state has left all bounds, or the first
/// rows alone cost more than `most`.
pub(in crate::evaluate) fn cost_in<R: Valued + Into<f64>>(
    problem: &Problem,
    lead: &Lead,
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
                let counted = Counted::summed(problem.own_loss());
                let mut squares = Squares::new(structure, record, counted);
                let mut above = false;
                let pull = lead.along(record, structure, &values);
                let mut row = |k: usize, state: &mut [R], outputs: &Outputs<R>| {
                    // Between two chunks nothing is added.
                    if k.is_multiple_of(CHUNK) {
                        let mut so_far = sums;
                        add(&mut so_far, squares.slice());
                        above = problem.cost_of_squares(so_far) > most;
                    }
                    let goes_on = !above
                        && squares.add(k, outputs, |slice| add(&mut sums, slice), || watch(state));
                    pull.draw(k, outputs, state);
                    goes_on
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
    led_residuals(problem, &Lead::default(), free, row)
}

/// The residuals alone; `None` where the candidate diverges.
pub(in crate::evaluate) fn residuals_alone(problem: &Problem, free: &[f64]) -> Option<Vec<f64>> {
    let mut all = Vec::with_capacity(problem.values());
    residuals(problem, free, &mut |residual, _| all.push(residual)).then_some(all)
}

/// The residuals of `count` candidates of which the rows of records were simulated side by side: of every output that
/// [counts](Problem::compares) of every row that does the values of `width` candidates, one after another.
pub(in crate::evaluate) fn residuals_side_by_side(
    problem: &Problem,
    simulated: &[impl Copy + Into<f64>],
    [width, count]: [usize; 2],
) -> Vec<Vec<f64>> {
    let Data::Series(records) = &*problem.data else {
        unreachable!("tones have phases and gains")
    };
    let loss = problem.own_loss();
    let room = || Vec::with_capacity(simulated.len() / width);
    let mut residuals: Vec<Vec<f64>> = (0..count).map(|_| room()).collect();
    let mut values = simulated.chunks(width);
    for record in records {
        let counts = problem.compares(record);
        let outputs: Vec<Output> = Output::ALL.into_iter().filter(|o| counts[*o]).collect();
        for row in record.samples.iter().filter(|row| row.weight > 0.0) {
            for &output in &outputs {
                let factor = (row.weight * problem.scale[output]).sqrt();
                // What has diverged together was not simulated to the end.
                let values = values.next().into_iter().flatten();
                for (own, &value) in residuals.iter_mut().zip(values) {
                    own.push(residual(row, output, value.into(), factor, loss));
                }
            }
        }
    }
    residuals
}

/// What is measured of an `output` in a `row` less what is `simulated`, or the root of what that costs with its sign, times a
/// `factor`.
#[inline(always)]
fn residual<R: Real>(
    row: &Sample,
    output: Output,
    simulated: R,
    factor: f64,
    loss: Option<SizedLoss<R>>,
) -> R {
    let mut error = R::constant(row.target[output]) - simulated;
    if let Some((loss, sizes)) = loss
        && error.abs().any_positive()
    {
        let cost = loss(error, R::constant(sizes[output]));
        error = error.if_positive(cost.sqrt(), -cost.sqrt());
    }
    error * R::constant(factor)
}

/// The same of a simulation that is led.
pub(crate) fn led_residuals(
    problem: &Problem,
    lead: &Lead,
    free: &[f64],
    row: &mut dyn FnMut(f64, &[f64]),
) -> bool {
    let vectors = Vectors::of(problem, free.len());
    let width = vectors.sensitivities();
    let pass = |first, row: &mut dyn FnMut(f64, &[f64])| {
        finished(Pass {
            problem,
            lead,
            free,
            first,
            row,
            vectors,
        })
    };
    if free.len() <= width {
        return pass(0, row);
    }
    // More parameters than one pass carries: keep what each pass finds until all is there.
    let mut residuals = Vec::new();
    let mut gradients: Vec<Vec<f64>> = Vec::new();
    for first in (0..free.len()).step_by(width) {
        residuals.clear();
        let mut own = Vec::new();
        let finished = pass(first, &mut |residual, gradient| {
            residuals.push(residual);
            own.extend_from_slice(gradient);
        });
        if !finished {
            return false;
        }
        gradients.push(own);
    }
    let mut gradient = vec![0.0; free.len()];
    for (k, residual) in residuals.into_iter().enumerate() {
        for (own, part) in gradients.iter().zip(gradient.chunks_mut(width)) {
            let begin = k * part.len();
            part.copy_from_slice(&own[begin..begin + part.len()]);
        }
        row(residual, &gradient);
    }
    true
}

/// What a pass computes sensitivities with.
#[derive(Clone, Copy)]
enum Vectors {
    Long(LongVectors),
    Short(ShortVectors),
    None,
}

impl Vectors {
    /// Those that are best for derivatives with respect to `count` parameters: long ones where one pass over records in short ones has no
    /// room for all of them.
    fn of(problem: &Problem, count: usize) -> Self {
        let Some(short) = short_vectors() else {
            return Self::None;
        };
        let in_time = matches!(&*problem.data, Data::Series(_));
        let many = count > Dual::<ShortVectors>::COUNT;
        match long_vectors().filter(|_| in_time && many) {
            Some(long) => Self::Long(long),
            None => Self::Short(short),
        }
    }

    /// How many sensitivities one pass carries.
    fn sensitivities(self) -> usize {
        match self {
            Self::Long(_) => Dual::<LongVectors>::COUNT,
            Self::Short(_) => Dual::<ShortVectors>::COUNT,
            Self::None => Dual::<Scalar>::COUNT,
        }
    }
}

/// A pass over all residuals with their derivatives with respect to as many free parameters as there is room for, from number
/// `first` on.
struct Pass<'a> {
    problem: &'a Problem,
    lead: &'a Lead,
    free: &'a [f64],
    first: usize,
    row: &'a mut dyn FnMut(f64, &[f64]),
    vectors: Vectors,
}

impl Pass<'_> {
    /// Values of all parameters.
    fn values<S: Simd>(&self) -> Complete<Dual<S>> {
        let variable = |(index, &value): (usize, &f64)| match index.checked_sub(self.first) {
            Some(slot) if slot < Dual::<S>::COUNT => Dual::variable(value, slot),
            _ => Dual::constant(value),
        };
        let free: Vec<Dual<S>> = self.free.iter().enumerate().map(variable).collect();
        self.problem.complete(&free, Dual::constant)
    }

    /// How many parameters it has derivatives with respect to.
    fn count<S: Simd>(&self) -> usize {
        (self.free.len() - self.first).min(Dual::<S>::COUNT)
    }
}

/// Whether a pass came to its end; false where the candidate diverges.
fn finished(pass: Pass<'_>) -> bool {
    match &*pass.problem.data {
        Data::Series(records) => {
            let structure = &pass.problem.structure;
            match pass.vectors {
                Vectors::Long(simd) => with_room(pass, records, simd),
                Vectors::Short(simd) => {
                    with_states!(structure, finished_in_time::<_>(pass, records, simd))
                }
                Vectors::None => finished_without_vectors(pass, records),
            }
        }
        Data::Tones(tones) => with_short_vectors(PassOnTones { pass, tones }),
    }
}

/// Whether a state has left all bounds.
fn wild<S: Simd>(state: &[Dual<S>]) -> bool {
    state
        .iter()
        .any(|x| x.value().is_nan() || x.value().abs() >= STATE_LIMIT)
}

fn finished_in_time<'a, S: Simd, const N: usize, V: View>(
    pass: Pass<'a>,
    records: &'a [Series],
    simd: S,
) -> bool {
    let view = PhantomData::<V>;
    let pass = PassInTime::<N, V> {
        pass,
        records,
        view,
    };
    in_vectors(simd, pass)
}

/// The same for any structure, in two functions where there might be five.
fn with_room<'a, S: Simd>(pass: Pass<'a>, records: &'a [Series], simd: S) -> bool {
    match pass.problem.structure.states().len() {
        0..=5 => finished_in_time::<S, 5, Whole>(pass, records, simd),
        _ => finished_in_time::<S, MOST_STATES, Whole>(pass, records, simd),
    }
}

/// The same on a CPU that has no such vectors: one function for all structures, since few have such a CPU and all compile it.
fn finished_without_vectors<'a>(pass: Pass<'a>, records: &'a [Series]) -> bool {
    let view = PhantomData::<Whole>;
    let pass = PassInTime::<MOST_STATES, Whole> {
        pass,
        records,
        view,
    };
    pass.with_simd(Scalar::new())
}

/// A pass over records, of a structure with room for `N` states: each a function of its own, small enough for the compiler.
struct PassInTime<'a, const N: usize, V> {
    pass: Pass<'a>,
    records: &'a [Series],
    view: PhantomData<V>,
}

impl<const N: usize, V: View> WithSimd for PassInTime<'_, N, V> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let problem = self.pass.problem;
        let values = self.pass.values::<S>();
        let plant = V::plant(&problem.structure, &values);
        let loss = problem.own_loss();
        let lead = self.pass.lead;
        let count = self.pass.count::<S>();
        let row = self.pass.row;
        for record in self.records {
            let mut finished = true;
            let counts = problem.compares(record);
            let pull = lead.along(record, &problem.structure, &values);
            let hand_over = |k: usize, state: &mut [Dual<S>; N], outputs: &Outputs<Dual<S>>| {
                let sample = &record.samples[k];
                for output in Output::ALL {
                    if !counts[output] {
                        continue;
                    }
                    let factor = (sample.weight * problem.scale[output]).sqrt();
                    if factor > 0.0 {
                        let error = residual(sample, output, outputs[output], factor, loss);
                        row(error.value(), &error.gradient()[..count]);
                    }
                }
                finished &= !wild(state);
                pull.draw(k, outputs, state);
                finished
            };
            series::<Dual<S>, N, _>(&problem.structure, record, hand_over, &plant);
            if !finished {
                return false;
            }
        }
        true
    }
}

/// A pass over the tones of a sine stream.
struct PassOnTones<'a> {
    pass: Pass<'a>,
    tones: &'a [Tone],
}

impl WithSimd for PassOnTones<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let plant = Alone::plant(&self.pass.problem.structure, &self.pass.values::<S>());
        let wave = Wave::new(self.tones);
        let count = self.pass.count::<S>();
        let row = self.pass.row;
        let scaled = |number: Dual<S>, factor: f64| -> Vec<f64> {
            let slopes = number.gradient()[..count].iter();
            slopes.map(|slope| slope * factor).collect()
        };
        let mut finished = true;
        for tone in self.tones {
            let [re, im] = response(&plant, tone, &wave, |state: &[Dual<S>]| {
                finished &= !wild(state);
                !finished
            });
            let factor = tone.weight.sqrt();
            let phase = im.atan2(re);
            if let Some(error) = tone.phase_error(phase.value()) {
                row(error * factor, &scaled(phase, -factor * 1f64.to_degrees()));
            }
            if let Some(error) = tone.gain_error(re.value().hypot(im.value())) {
                let factor = DEGREES_PER_DECIBEL * factor;
                let square = re * re + im * im;
                let decibels = 10.0 / (LN_10 * square.value());
                row(error * factor, &scaled(square, -decibels * factor));
            }
        }
        finished
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    #[test]
    fn without_vectors_sensitivities_are_the_same() {
        let bare = workload::actuator(300);
        let mut sticking = bare.clone();
        sticking.structure = bare.structure.with("friction~windup".parse().unwrap());
        sticking.parameters = sticking.structure.parameters();
        let without = |pass: Pass<'_>| match &*pass.problem.data {
            Data::Series(records) => finished_without_vectors(pass, records),
            Data::Tones(_) => unreachable!("a record in time"),
        };
        for problem in [&bare, &sticking] {
            let free = &problem.start();
            let [wide, narrow] = [finished, without].map(|finish| {
                let mut rows = Vec::new();
                let pass = Pass {
                    problem,
                    lead: &Lead::default(),
                    free,
                    first: 0,
                    row: &mut |residual, gradient| rows.push((residual, gradient[..2].to_vec())),
                    vectors: Vectors::of(problem, free.len()),
                };
                assert!(finish(pass));
                rows
            });
            assert_eq!(wide.len(), 300);
            assert_eq!(wide, narrow);
        }
    }
}
