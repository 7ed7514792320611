//! The time loops, over [`Real`]: one candidate, or a vector of them, on one record or one tone. Their twins on the
//! GPU are the loops of `shaders/evaluate.wgsl`; what is summed where is the same in both.

use super::problem::{SAMPLES_PER_PERIOD, Sample, Series, Tone, Wave};
use crate::model::integrate::advance;
use crate::model::{Hold, Input, Output, Plant, Real, Structure};

/// Rows whose squared errors are summed before they are added to the slice's sum: bounds the rounding in `f32`.
pub const CHUNK: usize = 128;
/// Rows that one dispatch integrates; sums over slices are taken in `f64`.
pub const SLICE: usize = 8192;

/// Calls the function `$f::<.., N>(..)` for a structure with `$states` states.
macro_rules! with_states {
    ($states:expr, $f:ident::<$($generic:tt),+>($($argument:expr),* $(,)?)) => {
        match $states {
            0 => $f::<$($generic),+, 0>($($argument),*),
            1 => $f::<$($generic),+, 1>($($argument),*),
            2 => $f::<$($generic),+, 2>($($argument),*),
            3 => $f::<$($generic),+, 3>($($argument),*),
            more => unreachable!("no structure has {more} states"),
        }
    };
}
pub(super) use with_states;

/// Integrates `series` and hands every row's number and outputs to `row`, until that returns false.
#[inline(always)]
pub fn series<R: Real, const N: usize>(
    structure: &Structure,
    plant: &Plant<R>,
    series: &Series,
    mut row: impl FnMut(usize, &[R], [R; 3]) -> bool,
) {
    let samples = &series.samples;
    let mut input = Input::constant(samples[0].input);
    let mut state: [R; N] = plant.initial(&input, R::constant(samples[0].target[2]));
    for (k, sample) in samples.iter().enumerate() {
        if !row(k, &state, plant.observe(&state, &input)) {
            return;
        }
        let Some(next) = samples.get(k + 1) else {
            return;
        };
        let step = R::constant(sample.step);
        for j in 0..sample.substeps {
            let mut inputs = [input; 3];
            if structure.hold == Hold::Interpolated {
                for (half, input) in inputs.iter_mut().enumerate() {
                    *input = Input::constant(between(sample, next, 2 * j + half as u32));
                }
            }
            state = advance(plant, state, inputs.each_ref(), step);
        }
        input = Input::constant(next.input);
    }
}

/// The input `half_steps` half integration steps after `sample`, on the way to `next`.
fn between(sample: &Sample, next: &Sample, half_steps: u32) -> [f64; 5] {
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
    fn run<R: Real, const N: usize>(
        structure: &Structure,
        values: &[R],
        record: &Series,
    ) -> Vec<[R; 3]> {
        let plant = Plant::new(structure, values);
        let mut rows = Vec::with_capacity(record.samples.len());
        series::<R, N>(structure, &plant, record, |_, _, outputs| {
            rows.push(outputs);
            true
        });
        rows
    }
    with_states!(
        structure.states().len(),
        run::<f64>(structure, values, record)
    )
}

/// Sums weighted squared errors of each output over a record: `slice_done` gets the sums of every slice of [`SLICE`]
/// rows. After every chunk `diverged` looks at the state, and ends the simulation by returning true.
#[inline(always)]
pub fn squares<R: Real, const N: usize>(
    structure: &Structure,
    plant: &Plant<R>,
    record: &Series,
    mut slice_done: impl FnMut([R; 3]),
    mut diverged: impl FnMut(&[R]) -> bool,
) {
    let observed = Output::ALL.map(|output| structure.observes(output));
    let zero = [R::constant(0.0); 3];
    let (mut chunk, mut slice) = (zero, zero);
    let last = record.samples.len() - 1;
    series::<R, N>(structure, plant, record, |k, state, outputs| {
        let sample = &record.samples[k];
        let weight = R::constant(sample.weight);
        for i in (0..3).filter(|&i| observed[i]) {
            let error = R::constant(sample.target[i]) - outputs[i];
            chunk[i] = chunk[i] + weight * error * error;
        }
        if (k + 1) % CHUNK == 0 || k == last {
            for i in 0..3 {
                slice[i] = slice[i] + chunk[i];
            }
            chunk = zero;
            if (k + 1) % SLICE == 0 || k == last {
                slice_done(slice);
                slice = zero;
            }
            return !diverged(state);
        }
        true
    });
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
    let input = |half_step: usize| {
        let [sin, _] = wave.table[half_step * stride];
        let mut input = Input::constant([0.0; 5]);
        input.command = amplitude * R::constant(sin);
        input
    };
    let mut state: [R; 2] = plant.initial(&input(0), R::constant(0.0));
    let mut sum = [R::constant(0.0); 2];
    for period in 0..tone.settle + tone.measure {
        let mut chunk = [R::constant(0.0); 2];
        for sample in 0..SAMPLES_PER_PERIOD {
            let first = (2 * sample * tone.substeps) as usize;
            let [sin, cos] = wave.table[first * stride];
            let mut start = input(first);
            let output = plant.observe(&state, &start)[0];
            chunk[0] = chunk[0] + output * R::constant(sin);
            chunk[1] = chunk[1] + output * R::constant(cos);
            for j in 0..tone.substeps as usize {
                let (middle, end) = (input(first + 2 * j + 1), input(first + 2 * j + 2));
                state = advance(plant, state, [&start, &middle, &end], step);
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
