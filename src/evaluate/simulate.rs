//! The time loops, over [`Real`]: one candidate, or a vector of them, on one record or one tone. Their twins on the
//! GPU are the loops of `shaders/evaluate.wgsl`; what is summed where is the same in both.

use super::arrival::Arrival;
use super::leaps::{travel, travel_late, travel_outlined};
use super::loss::SizedLoss;
use super::problem::{SAMPLES_PER_PERIOD, Sample, Series, Tone, Wave};
use crate::model::integrate::advance;
use crate::model::{Hold, Input, Output, Plant, Real, Structure, Valued};

/// Rows whose squared errors are summed before they are added to the slice's sum: bounds the rounding in `f32`.
pub const CHUNK: usize = 128;
/// Rows whose errors are summed in the evaluator's precision; sums over slices are taken in `f64`.
pub const SLICE: usize = 8192;

/// Calls `$f::<.., N, EFFECTS>(..)` for `$structure`: exact for the base model, with room to spare for effects.
macro_rules! with_states {
    ($structure:expr, $f:ident::<$($generic:tt),+>($($argument:expr),* $(,)?)) => {{
        use $crate::model::MOST_STATES;
        let structure: &$crate::model::Structure = $structure;
        match (structure.states().len(), structure.is_base()) {
            (0, true) => $f::<$($generic),+, 0, false>($($argument),*),
            (2, true) => $f::<$($generic),+, 2, false>($($argument),*),
            (3, true) => $f::<$($generic),+, 3, false>($($argument),*),
            (0..=5, _) => $f::<$($generic),+, 5, true>($($argument),*),
            (6..=MOST_STATES, _) => $f::<$($generic),+, MOST_STATES, true>($($argument),*),
            (more, _) => unreachable!("effects have been registered for {more} states"),
        }
    }};
}
pub(super) use with_states;

/// What is told of each row: its number, the state and the outputs; false ends the simulation. Every loop over one kind of
/// number that takes this is the same function.
pub type Row<'a, R> = &'a mut dyn FnMut(usize, &[R], [R; 3]) -> bool;

/// Integrates `series` and hands every row's number and outputs to `row`, until that returns false.
#[inline(always)]
pub fn series<R: Valued, const N: usize, const EFFECTS: bool>(
    structure: &Structure,
    plant: &Plant<R>,
    series: &Series,
    mut row: impl FnMut(usize, &[R], [R; 3]) -> bool,
) {
    let samples = &series.samples;
    let mut input = Input::constant(samples[0].input);
    let mut state: [R; N] = plant.initial::<N, EFFECTS>(&input, R::constant(samples[0].target[2]));
    let delay = if EFFECTS { plant.delay() } else { None };
    // Without effects two states are an actuator's alone: what follows is known when this is compiled.
    let leaps = if EFFECTS { structure.leaps() } else { N == 2 };
    let mut stride = None;
    for (k, sample) in samples.iter().enumerate() {
        #[allow(
            clippy::manual_map,
            reason = "a closure is not always inlined, and only what is inlined is compiled for wide vectors"
        )]
        let arrival = match delay {
            None => None,
            Some(delay) => Some(Arrival::new(series, k, delay)),
        };
        if EFFECTS {
            let command = match arrival {
                None => input.command,
                Some(arrival) if structure.hold == Hold::Held => arrival.held(),
                Some(arrival) => arrival.interpolated(0, R::constant(0.0)),
            };
            input.command = plant.command(&mut state, command);
        }
        if !row(k, &state, plant.observe::<EFFECTS>(&state, &input)) {
            return;
        }
        let Some(next) = samples.get(k + 1) else {
            return;
        };
        match arrival {
            Some(arrival) if leaps => {
                travel_late(plant, &mut state, input.command, sample, arrival);
            }
            Some(arrival) => {
                interval(structure, plant, &mut state, input, [sample, next], arrival);
            }
            None if leaps => {
                let (length, _) = sample.parts(true);
                let stride = match stride {
                    Some((known, stride)) if known == length => stride,
                    _ => {
                        let new = plant.actuator().stride(R::constant(length));
                        stride = Some((length, new));
                        new
                    }
                };
                let change =
                    (structure.hold == Hold::Interpolated).then(|| next.input[0] - sample.input[0]);
                match EFFECTS {
                    true => {
                        travel_outlined(plant, &stride, &mut state, input.command, change, sample);
                    }
                    false => travel(plant, &stride, &mut state, input.command, change, sample),
                }
            }
            None => {
                let step = R::constant(sample.step);
                for j in 0..sample.substeps {
                    let mut inputs = [input; 3];
                    if structure.hold == Hold::Interpolated {
                        for (half, input) in inputs.iter_mut().enumerate() {
                            *input = Input::constant(between(sample, next, 2 * j + half as u32));
                            if EFFECTS {
                                input.command = plant.command(&mut state, input.command);
                            }
                        }
                    }
                    state = advance::<R, N, EFFECTS>(plant, state, inputs.each_ref(), step);
                }
            }
        }
        input = Input::constant(next.input);
    }
}

/// Integrates from one row to the next while commands arrive late. `input` has the command that acts at the row.
#[inline(always)]
fn interval<R: Valued, const N: usize>(
    structure: &Structure,
    plant: &Plant<R>,
    state: &mut [R; N],
    input: Input<R>,
    samples: [&Sample; 2],
    arrival: Arrival<R>,
) {
    R::outlined(
        #[inline(always)]
        || interval_inline(structure, plant, state, input, samples, arrival),
    );
}

#[inline(always)]
fn interval_inline<R: Valued, const N: usize>(
    structure: &Structure,
    plant: &Plant<R>,
    state: &mut [R; N],
    mut input: Input<R>,
    [sample, next]: [&Sample; 2],
    arrival: Arrival<R>,
) {
    let substeps = R::constant(f64::from(sample.substeps));
    let whole = R::constant(sample.step);
    let seconds = next.input[6] - sample.input[6];
    let mut begin = R::constant(0.0);
    let mut command = match structure.hold {
        Hold::Held => arrival.held(),
        Hold::Interpolated => arrival.interpolated(0, begin),
    };
    for piece in 0..sample.pieces as usize {
        let end = match piece + 1 == sample.pieces as usize {
            true => whole,
            false => arrival.end(piece, sample.substeps, whole),
        };
        let step = end - begin;
        if structure.hold == Hold::Held && piece > 0 {
            command = arrival.held_in(piece, command);
            input.command = plant.command(state, command);
        }
        for j in 0..sample.substeps {
            let mut inputs = [input; 3];
            if structure.hold == Hold::Interpolated {
                for (half, input) in inputs.iter_mut().enumerate() {
                    let steps = R::constant(f64::from(j) + 0.5 * half as f64);
                    let after = begin * substeps + steps * step;
                    let share = after * R::constant(1.0 / seconds);
                    let mut values = [R::constant(0.0); 7];
                    for (value, (from, to)) in values
                        .iter_mut()
                        .zip(sample.input.into_iter().zip(next.input))
                    {
                        *value = R::constant(from) + share * R::constant(to - from);
                    }
                    *input = Input::new(values);
                    let arrived = arrival.interpolated(piece, after);
                    command = (whole - begin).if_positive(arrived, command);
                    input.command = plant.command(state, command);
                }
            }
            *state = advance::<R, N, true>(plant, *state, inputs.each_ref(), step);
        }
        begin = end;
    }
}

/// The input `half_steps` half integration steps after `sample`, on the way to `next`.
fn between(sample: &Sample, next: &Sample, half_steps: u32) -> [f64; 7] {
    let share = f64::from(half_steps) / f64::from(2 * sample.substeps);
    let mut input = sample.input;
    for (value, next) in input.iter_mut().zip(next.input) {
        *value += share * (next - *value);
    }
    input
}

/// The outputs at every row of `record`, in `f64`, in the order of [`crate::model::Output::ALL`]. `values` are those of
/// all parameters. What has diverged is not finite.
pub fn outputs(structure: &Structure, values: &[f64], record: &Series) -> Vec<[f64; 3]> {
    fn run<R: Valued, const N: usize, const EFFECTS: bool>(
        structure: &Structure,
        values: &[R],
        record: &Series,
    ) -> Vec<[R; 3]> {
        let plant = Plant::new(structure, values);
        let mut rows = Vec::with_capacity(record.samples.len());
        let mut keep = |_: usize, _: &[R], outputs: [R; 3]| {
            rows.push(outputs);
            true
        };
        series::<R, N, EFFECTS>(structure, &plant, record, &mut keep as Row<R>);
        rows
    }
    with_states!(structure, run::<f64>(structure, values, record))
}

/// Sums of the weighted squared errors of each output over a record, or of what a loss makes of an error and of the size of
/// the output's noise.
pub struct Squares<'a, R> {
    record: &'a Series,
    observed: [bool; 3],
    loss: Option<SizedLoss<R>>,
    chunk: [R; 3],
    slice: [R; 3],
}

impl<'a, R: Real> Squares<'a, R> {
    /// Nothing summed yet.
    #[inline(always)]
    pub fn new(structure: &Structure, record: &'a Series, loss: Option<SizedLoss<R>>) -> Self {
        let zero = [R::constant(0.0); 3];
        let mut observed = [false; 3];
        for (output, observed) in Output::ALL.into_iter().zip(&mut observed) {
            *observed = structure.observes(output);
        }
        Self {
            record,
            observed,
            loss,
            chunk: zero,
            slice: zero,
        }
    }

    /// The sums of this slice's chunks that are done.
    pub(super) fn slice(&self) -> [R; 3] {
        self.slice
    }

    /// Adds row `k`. `slice_done` gets the sums of every slice of [`SLICE`] rows. After every chunk `diverged` looks at the
    /// state, and ends the simulation by returning true: then this returns false.
    #[inline(always)]
    pub fn add(
        &mut self,
        k: usize,
        state: &[R],
        outputs: [R; 3],
        slice_done: impl FnOnce([R; 3]),
        diverged: impl FnOnce(&[R]) -> bool,
    ) -> bool {
        let sample = &self.record.samples[k];
        let last = k + 1 == self.record.samples.len();
        let weight = R::constant(sample.weight);
        for i in 0..3 {
            if self.observed[i] {
                let error = R::constant(sample.target[i]) - outputs[i];
                let cost = match self.loss {
                    None => weight * (error * error),
                    Some((loss, sizes)) => weight * loss(error, R::constant(sizes[i])),
                };
                self.chunk[i] = self.chunk[i] + cost;
            }
        }
        if !(k + 1).is_multiple_of(CHUNK) && !last {
            return true;
        }
        let zero = [R::constant(0.0); 3];
        for i in 0..3 {
            self.slice[i] = self.slice[i] + self.chunk[i];
        }
        self.chunk = zero;
        if (k + 1).is_multiple_of(SLICE) || last {
            slice_done(self.slice);
            self.slice = zero;
        }
        !diverged(state)
    }
}

/// Sums a record's [`Squares`].
#[inline(always)]
pub fn squares<R: Valued, const N: usize, const EFFECTS: bool>(
    structure: &Structure,
    plant: &Plant<R>,
    record: &Series,
    loss: Option<SizedLoss<R>>,
    mut slice_done: impl FnMut([R; 3]),
    mut diverged: impl FnMut(&[R]) -> bool,
) {
    let mut squares = Squares::new(structure, record, loss);
    series::<R, N, EFFECTS>(
        structure,
        plant,
        record,
        #[inline(always)]
        |k, state, outputs| squares.add(k, state, outputs, &mut slice_done, &mut diverged),
    );
}

/// What drives the model where the sine is `sin`.
#[inline(always)]
fn on_tone<R: Real>(amplitude: R, [sin, _]: [f64; 2]) -> Input<R> {
    let mut input = Input::constant([0.0; 7]);
    input.command = amplitude * R::constant(sin);
    input
}

/// Correlates the spool's response to a tone with the sine: its (in-phase, quadrature) parts per unit of command
/// amplitude. The tone starts from equilibrium with zero command. After every period `diverged` looks at the state.
#[inline(always)]
pub fn response<R: Real>(
    plant: &Plant<R>,
    tone: &Tone,
    wave: &Wave,
    mut diverged: impl FnMut(&[R]) -> bool,
) -> [R; 2] {
    let interval = 1.0 / (tone.frequency * f64::from(SAMPLES_PER_PERIOD));
    let step = R::constant(interval / f64::from(tone.substeps));
    let stride = (wave.substeps / tone.substeps) as usize;
    let amplitude = R::constant(tone.amplitude);
    let at_rest = on_tone(amplitude, wave.table[0]);
    let mut state: [R; 2] = plant.initial::<2, false>(&at_rest, R::constant(0.0));
    let mut sum = [R::constant(0.0); 2];
    for period in 0..tone.settle + tone.measure {
        let mut chunk = [R::constant(0.0); 2];
        for sample in 0..SAMPLES_PER_PERIOD {
            let first = (2 * sample * tone.substeps) as usize;
            let [sin, cos] = wave.table[first * stride];
            let mut start = on_tone(amplitude, wave.table[first * stride]);
            let output = plant.observe::<false>(&state, &start)[0];
            chunk[0] = chunk[0] + output * R::constant(sin);
            chunk[1] = chunk[1] + output * R::constant(cos);
            for j in 0..tone.substeps as usize {
                let half_step = first + 2 * j;
                let middle = on_tone(amplitude, wave.table[(half_step + 1) * stride]);
                let end = on_tone(amplitude, wave.table[(half_step + 2) * stride]);
                state = advance::<R, 2, false>(plant, state, [&start, &middle, &end], step);
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
