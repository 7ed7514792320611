//! The time loops, over [`Real`]: one candidate, or a vector of them, on one record or one tone. Their twins on the
//! GPU are the loops of `shaders/evaluate.wgsl`; what is summed where is the same in both.

use crate::evaluate::problem::loss::SizedLoss;
use crate::evaluate::problem::{SAMPLES_PER_PERIOD, Sample, Series, Tone, Wave};
use crate::evaluate::simulation::exact_step::{travel, travel_late};
use crate::evaluate::simulation::transport_delay::TransportDelay;
use crate::model::integrate::RungeKutta;
use crate::model::{
    Complete, Dynamics, Hold, Input, Output, Outputs, Real, Structure, Valued, View,
};

/// A state beyond this magnitude (in its own unit) has diverged: far from any valve, and its square still a finite f32.
pub const STATE_LIMIT: f64 = 1e9;

/// Rows whose squared errors are summed before they are added to the slice's sum: bounds the rounding in `f32`.
pub const CHUNK: usize = 128;
/// Rows whose errors are summed in the evaluator's precision; sums over slices are taken in `f64`.
pub const SLICE: usize = 8192;

/// Calls `$f::<.., N, View>(..)` with the number of states and the view of the plant of `$structure`: exact for a servo
/// valve alone, with room to spare for what is attached to it and for other base models.
macro_rules! with_states {
    ($structure:expr, $f:ident::<$($generic:tt),+>($($argument:expr),* $(,)?)) => {{
        use $crate::model::{Alone, MOST_STATES, Whole};
        let structure: &$crate::model::Structure = $structure;
        match (structure.states().len(), structure.is_servo_valve_alone()) {
            (0, true) => $f::<$($generic),+, 0, Alone>($($argument),*),
            (2, true) => $f::<$($generic),+, 2, Alone>($($argument),*),
            (3, true) => $f::<$($generic),+, 3, Alone>($($argument),*),
            (0..=5, _) => $f::<$($generic),+, 5, Whole>($($argument),*),
            (6..=MOST_STATES, _) => $f::<$($generic),+, MOST_STATES, Whole>($($argument),*),
            (more, _) => unreachable!("effects have been registered for {more} states"),
        }
    }};
}
pub(in crate::evaluate) use with_states;

/// What is told of each row: its number, the state, which it may change, and the outputs; false ends the simulation. Every loop
/// over one kind of number that takes this is the same function.
pub type Row<'a, R> = &'a mut dyn FnMut(usize, &mut [R], &Outputs<R>) -> bool;

/// Integrates `series` and hands every row's number and outputs to `row`, until that returns false.
#[inline(always)]
pub fn series<R: Valued, const N: usize, D: Dynamics<R>>(
    structure: &Structure,
    series: &Series,
    mut row: impl FnMut(usize, &mut [R; N], &Outputs<R>) -> bool,
    plant: &D,
) {
    let samples = &series.samples;
    let mut input = Input::constant(&samples[0].input);
    let mut measured = Outputs::all(R::constant(0.0));
    for i in 0..Output::COUNT {
        measured.0[i] = R::constant(samples[0].target.0[i]);
    }
    let mut state: [R; N] = plant.initial(&input, &measured);
    let delay = plant.delay();
    let exact_steps = plant.exact_step::<N>(structure);
    let steps = structure.steps_of_an_exact_step();
    let mut stride = None;
    let mut integrator = RungeKutta::new();
    for (k, sample) in samples.iter().enumerate() {
        #[allow(
            clippy::manual_map,
            reason = "a closure is not always inlined, and only what is inlined is compiled for wide vectors"
        )]
        let delayed = match delay {
            None => None,
            Some(delay) => Some(TransportDelay::new(series, k, delay, structure.hold)),
        };
        let arrived = match delayed {
            None => input.command,
            Some(delayed) if structure.hold == Hold::Held => delayed.held(),
            Some(delayed) => delayed.interpolated(0, R::constant(0.0)),
        };
        input.command = plant.command(&mut state, arrived);
        let shown = plant.observe(&state, &input);
        if !row(k, &mut state, &shown) {
            return;
        }
        let Some(next) = samples.get(k + 1) else {
            return;
        };
        let end;
        let straight = match structure.hold.is_straight() {
            true => {
                end = sample.straight_to(next, structure.hold);
                Some([&sample.input, &end])
            }
            false => None,
        };
        match (delayed, exact_steps) {
            (Some(delayed), Some(actuator)) if D::DELAYS => {
                let parts = sample.parts(steps);
                travel_late(
                    plant,
                    actuator,
                    &mut state,
                    input,
                    parts,
                    sample.pieces,
                    delayed,
                );
            }
            (Some(delayed), None) if D::DELAYS => {
                let late = [sample, next];
                interval(
                    structure,
                    plant,
                    &mut integrator,
                    &mut state,
                    input,
                    late,
                    delayed,
                );
            }
            (Some(_), _) => unreachable!("nothing delays"),
            (None, Some(actuator)) => {
                let parts = sample.parts(steps);
                let length = parts.0;
                let known = match &stride {
                    Some((known, _)) => *known == length,
                    None => false,
                };
                if !known {
                    stride = Some((length, actuator.stride(R::constant(length))));
                }
                // Not copied: it is longer than the state.
                let Some((_, stride)) = &stride else {
                    unreachable!("just set")
                };
                travel(plant, actuator, stride, &mut state, &input, parts, straight);
            }
            (None, None) => {
                let step = R::constant(sample.step);
                for j in 0..sample.substeps {
                    let on_the_way;
                    // A held input is not copied: it is longer than the state.
                    let inputs = match straight {
                        None => [&input; 3],
                        Some([from, to]) => {
                            let mut along = [input; 3];
                            for (half, input) in along.iter_mut().enumerate() {
                                let half_steps = f64::from(2 * j + half as u32);
                                let share = half_steps / f64::from(2 * sample.substeps);
                                *input = Input::between(from, to, R::constant(share));
                                input.command = plant.command(&mut state, input.command);
                            }
                            on_the_way = along;
                            on_the_way.each_ref()
                        }
                    };
                    integrator.advance(plant, &mut state, inputs, step);
                }
            }
        }
        input = Input::constant(&next.input);
    }
}

/// Integrates from one row to the next while commands arrive late. `input` has the command that acts at the row.
#[inline(always)]
fn interval<R: Valued, const N: usize, D: Dynamics<R>>(
    structure: &Structure,
    plant: &D,
    integrator: &mut RungeKutta<R, N>,
    state: &mut [R; N],
    input: Input<R>,
    samples: [&Sample; 2],
    delayed: TransportDelay<R>,
) {
    R::outlined(
        #[inline(always)]
        || interval_inline(structure, plant, integrator, state, input, samples, delayed),
    );
}

#[inline(always)]
fn interval_inline<R: Valued, const N: usize, D: Dynamics<R>>(
    structure: &Structure,
    plant: &D,
    integrator: &mut RungeKutta<R, N>,
    state: &mut [R; N],
    mut input: Input<R>,
    [sample, next]: [&Sample; 2],
    delayed: TransportDelay<R>,
) {
    let seconds = next.input.time - sample.input.time;
    let whole = R::constant(sample.step * f64::from(sample.substeps));
    let mut begin = R::constant(0.0);
    let mut command = match structure.hold {
        Hold::Held => delayed.held(),
        Hold::Interpolated | Hold::BetweenJumps => delayed.interpolated(0, begin),
    };
    for piece in 0..sample.pieces as usize {
        let end = match piece + 1 == sample.pieces as usize {
            true => whole,
            false => delayed.end(piece, 1, whole),
        };
        if structure.hold == Hold::Held && piece > 0 {
            command = delayed.held_in(piece, command);
            input.command = plant.command(state, command);
        }
        for j in 0..sample.substeps {
            let [from, to] = in_step(sample, j, begin - whole, end - whole);
            let step = to - from;
            if step.is_zero() {
                continue;
            }
            let straight;
            let inputs = match structure.hold {
                Hold::Held => [&input; 3],
                Hold::Interpolated | Hold::BetweenJumps => {
                    let mut along = [input; 3];
                    for (half, input) in along.iter_mut().enumerate() {
                        let begun = R::constant(sample.step * f64::from(j));
                        let after = begun + (from + R::constant(0.5 * half as f64) * step);
                        let share = after * R::constant(1.0 / seconds);
                        *input = Input::between(&sample.input, &next.input, share);
                        let arrived = delayed.interpolated(piece, after);
                        command = (whole - begin).if_positive(arrived, command);
                        input.command = plant.command(state, command);
                    }
                    straight = along;
                    straight.each_ref()
                }
            };
            integrator.advance(plant, state, inputs, step);
        }
        begin = end;
    }
}

/// What step number `j` from a row to the next has of a piece that lies between two times, s after the next row: where it begins
/// and ends, s after the step does; alike where the step has nothing of it. What begins or ends just with a step knows in one of
/// two steps how that depends on the delay.
#[inline(always)]
fn in_step<R: Real>(sample: &Sample, j: u32, begin: R, end: R) -> [R; 2] {
    let steps = sample.substeps - j;
    let from = R::constant(0.0).max(into_step(sample, steps, begin));
    [from, from.max(into_step(sample, steps, end))]
}

/// Where a `moment`, s after the next row, is in the step that has `steps` before that row, itself among them: s after it begins,
/// no later than its end.
#[inline(always)]
fn into_step<R: Real>(sample: &Sample, steps: u32, moment: R) -> R {
    // From the next row on, so that the last step of a piece that ends there has no other length by rounding.
    let here = moment + R::constant(sample.step * f64::from(steps));
    if steps == 1 {
        return here;
    }
    let beyond = moment + R::constant(sample.step * f64::from(steps - 1));
    (-beyond).if_positive(here, R::constant(sample.step))
}

/// The outputs at every row of `record`, in `f64`. `values` are those of all parameters. What has diverged is not finite.
pub fn outputs(
    structure: &Structure,
    values: &Complete<f64>,
    record: &Series,
) -> Vec<Outputs<f64>> {
    let mut rows = Vec::with_capacity(record.samples.len());
    let mut keep = |_: usize, _: &mut [f64], outputs: &Outputs<f64>| {
        rows.push(*outputs);
        true
    };
    let keep: Row<f64> = &mut keep;
    with_states!(structure, run::<f64>(structure, values, record, keep));
    rows
}

/// Integrates `record` for these values of all parameters.
pub(in crate::evaluate) fn run<R: Valued, const N: usize, V: View>(
    structure: &Structure,
    values: &Complete<R>,
    record: &Series,
    row: Row<R>,
) {
    let plant = V::plant(structure, values);
    let row = |k: usize, state: &mut [R; N], outputs: &Outputs<R>| row(k, state, outputs);
    series::<R, N, _>(structure, record, row, &plant);
}

/// What becomes of the outputs of a row that counts.
pub enum Counted<'a, R> {
    /// The squares of its errors are summed.
    Squared,
    /// What the loss makes of an error and of the size of the output's noise is summed.
    Lost(SizedLoss<R>),
    /// They are handed over, and nothing is summed.
    Kept(&'a mut dyn FnMut(&Outputs<R>)),
}

impl<R> Counted<'_, R> {
    /// Summed, with its own loss where there is one.
    #[inline(always)]
    pub fn summed(loss: Option<SizedLoss<R>>) -> Self {
        match loss {
            None => Self::Squared,
            Some(loss) => Self::Lost(loss),
        }
    }
}

/// Sums of the weighted squared errors of each output over a record, or of what a loss makes of them.
pub struct Squares<'a, R> {
    record: &'a Series,
    observed: Outputs<bool>,
    counted: Counted<'a, R>,
    chunk: Outputs<R>,
    slice: Outputs<R>,
}

impl<'a, R: Real> Squares<'a, R> {
    /// Nothing summed yet.
    #[inline(always)]
    pub fn new(structure: &Structure, record: &'a Series, counted: Counted<'a, R>) -> Self {
        let zero = Outputs::all(R::constant(0.0));
        Self {
            record,
            observed: Outputs::from_fn(|output| {
                structure.observes(output) && record.measured[output]
            }),
            counted,
            chunk: zero,
            slice: zero,
        }
    }

    /// The sums of this slice's chunks that are done.
    pub(in crate::evaluate) fn slice(&self) -> Outputs<R> {
        self.slice
    }

    /// Adds row `k`. `slice_done` gets the sums of every slice of [`SLICE`] rows. After every chunk `diverged` looks at the
    /// state, and ends the simulation by returning true: then this returns false.
    #[inline(always)]
    pub fn add(
        &mut self,
        k: usize,
        outputs: &Outputs<R>,
        slice_done: impl FnOnce(Outputs<R>),
        diverged: impl FnOnce() -> bool,
    ) -> bool {
        let sample = &self.record.samples[k];
        let last = k + 1 == self.record.samples.len();
        let weight = R::constant(sample.weight);
        match &mut self.counted {
            Counted::Squared => Output::each(
                #[inline(always)]
                |output| {
                    if self.observed[output] {
                        let error = R::constant(sample.target[output]) - outputs[output];
                        self.chunk[output] = self.chunk[output] + weight * (error * error);
                    }
                },
            ),
            // Nothing stays in registers across the call of somebody else's function: not in the row's own code.
            counted => R::outlined(
                #[inline(always)]
                || match counted {
                    Counted::Lost((loss, sizes)) => {
                        for output in Output::ALL {
                            if self.observed[output] {
                                let error = R::constant(sample.target[output]) - outputs[output];
                                let cost = loss(error, R::constant(sizes[output]));
                                self.chunk[output] = self.chunk[output] + weight * cost;
                            }
                        }
                    }
                    Counted::Kept(keep) if sample.weight > 0.0 => keep(outputs),
                    Counted::Kept(_) | Counted::Squared => {}
                },
            ),
        }
        if !(k + 1).is_multiple_of(CHUNK) && !last {
            return true;
        }
        let zero = Outputs::all(R::constant(0.0));
        Output::each(
            #[inline(always)]
            |output| self.slice[output] = self.slice[output] + self.chunk[output],
        );
        self.chunk = zero;
        if (k + 1).is_multiple_of(SLICE) || last {
            slice_done(self.slice);
            self.slice = zero;
        }
        !diverged()
    }
}

/// Sums a record's [`Squares`].
#[inline(always)]
pub fn squares<'a, R: Valued, const N: usize, D: Dynamics<R>>(
    structure: &Structure,
    record: &'a Series,
    counted: Counted<'a, R>,
    mut slice_done: impl FnMut(Outputs<R>),
    mut diverged: impl FnMut(&[R]) -> bool,
    plant: &D,
) {
    let mut squares = Squares::new(structure, record, counted);
    series::<R, N, D>(
        structure,
        record,
        #[inline(always)]
        |k, state, outputs| {
            squares.add(
                k,
                outputs,
                &mut slice_done,
                #[inline(always)]
                || {
                    // A copy, only where it is looked at: the state itself stays in registers.
                    let state = *state;
                    diverged(&state)
                },
            )
        },
        plant,
    );
}

/// What drives the model where the sine is `sin`.
#[inline(always)]
fn on_tone<R: Real>(amplitude: R, [sin, _]: [f64; 2]) -> Input<R> {
    let mut input = Input::constant(&Input::default());
    input.command = amplitude * R::constant(sin);
    input
}

/// Correlates the spool's response to a tone with the sine: its (in-phase, quadrature) parts per unit of command
/// amplitude. The tone starts from equilibrium with zero command. After every period `diverged` looks at the state.
#[inline(always)]
pub fn response<R: Real>(
    plant: &impl Dynamics<R>,
    tone: &Tone,
    wave: &Wave,
    mut diverged: impl FnMut(&[R]) -> bool,
) -> [R; 2] {
    let interval = 1.0 / (tone.frequency * f64::from(SAMPLES_PER_PERIOD));
    let step = R::constant(interval / f64::from(tone.substeps));
    let stride = (wave.substeps / tone.substeps) as usize;
    let amplitude = R::constant(tone.amplitude);
    let at_rest = on_tone(amplitude, wave.table[0]);
    let nothing = Outputs::all(R::constant(0.0));
    let mut state: [R; 2] = plant.initial(&at_rest, &nothing);
    let mut sum = [R::constant(0.0); 2];
    let mut integrator = RungeKutta::new();
    for period in 0..tone.settle + tone.measure {
        let mut chunk = [R::constant(0.0); 2];
        for sample in 0..SAMPLES_PER_PERIOD {
            let first = (2 * sample * tone.substeps) as usize;
            let [sin, cos] = wave.table[first * stride];
            let mut start = on_tone(amplitude, wave.table[first * stride]);
            let output = plant.observe(&state, &start)[Output::Spool];
            chunk[0] = chunk[0] + output * R::constant(sin);
            chunk[1] = chunk[1] + output * R::constant(cos);
            for j in 0..tone.substeps as usize {
                let half_step = first + 2 * j;
                let middle = on_tone(amplitude, wave.table[(half_step + 1) * stride]);
                let end = on_tone(amplitude, wave.table[(half_step + 2) * stride]);
                integrator.advance(plant, &mut state, [&start, &middle, &end], step);
                start = end;
            }
        }
        if period >= tone.settle {
            sum = [sum[0] + chunk[0], sum[1] + chunk[1]];
        }
        if diverged(&state) {
            break;
        }
    }
    let norm = R::constant(2.0 / f64::from(tone.measure * SAMPLES_PER_PERIOD)) / amplitude;
    [sum[0] * norm, sum[1] * norm]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::real::Dual;
    use pulp::Scalar;

    #[test]
    fn a_late_command_cuts_one_step_and_each_side_knows_it_once() {
        let sample = Sample {
            step: 0.1,
            substeps: 5,
            ..Sample::default()
        };
        let whole = Dual::<Scalar>::constant(sample.step * 5.0);
        for late in [0.0, 0.04, 0.1, 0.2, 0.25, 0.3, 0.4, 0.41, 0.5] {
            let arrives = Dual::variable(late, 0);
            let begins = Dual::constant(0.0);
            let lengths = [[begins, arrives], [arrives, whole]].map(|[begin, end]| {
                let steps = 0..sample.substeps;
                let pieces = steps.map(|j| in_step(&sample, j, begin - whole, end - whole));
                pieces.map(|[from, to]| to - from).collect::<Vec<_>>()
            });
            let sums = lengths.each_ref().map(|lengths| {
                let begun = (0.0, 0.0);
                lengths.iter().fold(begun, |(sum, slope), length| {
                    (sum + length.value(), slope + length.gradient()[0])
                })
            });
            for ((sum, slope), expected) in sums.into_iter().zip([(late, 1.0), (0.5 - late, -1.0)])
            {
                assert!((sum - expected.0).abs() < 1e-15, "{late}: {sum}");
                assert_eq!(slope, expected.1, "{late}");
            }
            let all = lengths.iter().flatten();
            let count = all.filter(|length| length.value() > 1e-12).count();
            assert!(count == 5 || count == 6, "{late}: {count}");
        }
    }
}
