//! Noise in a measured command or pressure: how much there is, the input without most of it, and what a model makes of the rest.

use super::left_over::{CHANCE, left_over};
use super::measurements::Measurements;
use super::simulation::{Compared, Trajectories, residual};
use super::statistics::noise::{Noise, OfInputs};
use crate::evaluate::problem::Series;
use crate::evaluate::reference;
use crate::model::{Complete, Input, Output, Structure};
use crate::record::Channel;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;

/// Orders of the differences that leave noise of an input, and nothing that is smooth.
const ORDERS: [usize; 2] = [6, 8];
/// Of white noise both say the same, up to this factor; of what is smooth the higher one says less.
const WHITE: f64 = 1.25;
/// What is more than this share of the command's range is commanded,
const MOST: f64 = 0.005;
/// and what is more than this share of a pressure is there.
const MOST_OF_PRESSURE: f64 = 0.02;
/// Intervals between rows are even up to this share: a command that was taken at other times than noted is not smooth.
const EVEN: f64 = 0.01;
/// Rows to one side of a row that it is smoothed over, the fewest first.
const REACH: [usize; 5] = [2, 4, 8, 16, 32];
/// Estimates over more and more rows agree while their intervals of so many standard errors have something in common (Goldenshluger
/// and Nemirovski 1997, intersection of confidence intervals).
const AGREE: f64 = 2.0;
/// Valves that are simulated with noise of a command.
const TWINS: usize = 3;

/// The inputs that are smoothed, together where a valve gets all or none of their noise.
pub(super) const QUIETENED: [&[Channel]; 2] = [
    &[Channel::Command],
    &[
        Channel::SupplyPressure,
        Channel::ReturnPressure,
        Channel::PressureA,
        Channel::PressureB,
    ],
];

/// A model, and what it gives for the records that are fitted.
pub(super) struct Driven<'a> {
    pub structure: &'a Structure,
    pub values: &'a Complete<f64>,
    pub simulated: &'a Trajectories,
}

/// The noise of an input of `series`; 0 where there is none.
pub(super) fn noise_in(series: &Series, channel: Channel) -> f64 {
    noise_of(&values(series, channel), &series.time, most(channel)).unwrap_or(0.0)
}

/// Of how much at most, of some values, what is white among them is noise.
fn most(channel: Channel) -> fn(low: f64, high: f64) -> f64 {
    match channel {
        Channel::Command => |low, high| MOST * (high - low),
        _ => |low, high| MOST_OF_PRESSURE * high.abs().max(low.abs()),
    }
}

/// Smooths an input of `series`, where it has `noise`.
pub(super) fn quieten(series: &mut Series, channel: Channel, noise: f64) {
    if noise > 0.0 {
        let quiet = smoothed(&values(series, channel), noise);
        for (sample, quiet) in series.samples.iter_mut().zip(quiet) {
            if let Some(value) = sample.input.of_mut(channel) {
                *value = quiet;
            }
        }
    }
}

fn values(series: &Series, channel: Channel) -> Vec<f64> {
    let inputs = series.samples.iter().map(|sample| sample.input);
    inputs
        .map(|mut input| input.of_mut(channel).map_or(0.0, |value| *value))
        .collect()
}

pub(super) fn steps(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|two| two[1] - two[0]).collect()
}

pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn root_mean_square(values: &[f64]) -> f64 {
    (product(values, values) / values.len().max(1) as f64).sqrt()
}

/// The `noise` of the channels that the model `driven` observes, with what it makes of what is left of the noise of smoothed inputs.
pub(super) fn with_what_passes(
    driven: &Driven,
    measurements: &Measurements,
    noise: BTreeMap<String, Noise>,
) -> BTreeMap<String, Noise> {
    if measurements.input_noise.is_empty() {
        return noise;
    }
    let of_channel = |(name, noise): (String, Noise)| (name, noise.of_the_channel());
    let mut noise: BTreeMap<String, Noise> = noise.into_iter().map(of_channel).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(CHANCE);
    let twins = (0..TWINS).map(|_| twin(driven, measurements, &noise, &mut rng));
    let twins: Vec<_> = twins.collect();
    let of = which(&measurements.input_noise);
    for (k, output) in driven.structure.observed.iter().enumerate() {
        let values: Vec<f64> = twins.iter().map(|twin| twin[k].0).collect();
        let of_inputs = OfInputs {
            of,
            value: root_mean_square(&values),
            shown: twins.iter().flat_map(|twin| twin[k].1.clone()).collect(),
        };
        let own = noise.remove(output.name()).expect("of the same channels");
        noise.insert(output.name().into(), own.with(of_inputs));
    }
    noise
}

/// Which inputs have this noise.
fn which(noise: &[Input<f64>]) -> &'static str {
    let has = |channels: &[Channel]| {
        let of =
            |noise: &Input<f64>, channel| { *noise }.of_mut(channel).is_some_and(|one| *one > 0.0);
        noise
            .iter()
            .any(|noise| channels.iter().any(|&channel| of(noise, channel)))
    };
    match QUIETENED.map(has) {
        [true, true] => "measured command and pressures",
        [false, true] => "measured pressures",
        _ => "measured command",
    }
}

/// What the noise of the inputs makes of each channel of a valve that is the model `driven`, got the smoothed ones, and is
/// measured with this `noise`.
fn twin(
    driven: &Driven,
    measurements: &Measurements,
    noise: &BTreeMap<String, Noise>,
    rng: &mut ChaCha8Rng,
) -> Vec<(f64, Vec<(String, f64)>)> {
    let mut normal = || Normal::standard().inverse_cdf(rng.random::<f64>());
    let Driven {
        structure,
        values,
        simulated,
    } = *driven;
    let observed = &structure.observed;
    let mut twins = measurements.fit.clone();
    let own = twins.iter_mut().zip(simulated);
    for ((twin, simulated), noise) in own.zip(&measurements.input_noise) {
        for (sample, simulated) in twin.samples.iter_mut().zip(simulated) {
            sample.target = *simulated;
        }
        for channel in QUIETENED.into_iter().flatten().copied() {
            let noise = { *noise }.of_mut(channel).map_or(0.0, |noise| *noise);
            if noise == 0.0 {
                continue;
            }
            for sample in &mut twin.samples {
                if let Some(value) = sample.input.of_mut(channel) {
                    *value += noise * normal();
                }
            }
            quieten(twin, channel, noise);
        }
    }
    let simulated = reference::trajectories(structure, values, &twins);
    let compared = Compared::all(&twins, &simulated);
    let made = |&output: &Output| root_mean_square(&residual(&compared, output));
    let made: Vec<f64> = observed.iter().map(made).collect();
    for sample in twins.iter_mut().flat_map(|twin| &mut twin.samples) {
        for &output in observed {
            sample.target[output] += noise[output.name()].value * normal();
        }
    }
    let shown = left_over(&Compared::all(&twins, &simulated), observed, noise);
    let each = made.into_iter().zip(shown);
    each.map(|(value, left)| (value, left.correlates_with))
        .collect()
}

/// Standard deviation of white noise in `values` whose rows have these times; `None` where there is none, or more than `most` allows.
fn noise_of(values: &[f64], time: &[f64], most: fn(f64, f64) -> f64) -> Option<f64> {
    let mean = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let [lower, higher] = ORDERS.map(|order| left_by_differences(values, order));
    let is_white = lower < WHITE * higher && higher < WHITE * lower;
    let high = values.iter().copied().fold(f64::MIN, f64::max);
    let low = values.iter().copied().fold(f64::MAX, f64::min);
    let is_noise = higher > 0.0 && is_white && higher < most(low, high);
    let is_even = steps(time)
        .iter()
        .all(|one| (one / mean - 1.0).abs() < EVEN);
    (is_noise && is_even).then_some(higher)
}

/// Standard deviation of the white noise whose differences of this `order` have the median that those of an input have: where
/// it jumps they say nothing, and a median does not mind.
fn left_by_differences(values: &[f64], order: usize) -> f64 {
    let mut all = values.to_vec();
    for _ in 0..order {
        all = steps(&all);
    }
    if all.is_empty() {
        return 0.0;
    }
    all.iter_mut().for_each(|value| *value = value.abs());
    let middle = all.len() / 2;
    let (_, median, _) = all.select_nth_unstable_by(middle, f64::total_cmp);
    // The sum of the squares of the binomial coefficients, (2n over n).
    let gain = (1..=order).fold(1.0, |gain, k| gain * (order + k) as f64 / k as f64);
    *median / Normal::standard().inverse_cdf(0.75) / gain.sqrt()
}

/// `values` without most of their white noise of standard deviation `noise`: each on the parabola through as many rows around it,
/// or the line through as many behind it or before it, as agree with fewer.
fn smoothed(values: &[f64], noise: f64) -> Vec<f64> {
    // Weights of rows to be added up, and which of them is the row's own: its weight is the variance of the sum, too.
    type Window = (usize, Vec<f64>);
    let centred = REACH.map(|reach| -> Window { (reach, parabola(reach)) });
    let ahead = REACH.map(|reach| -> Window { (0, line(2 * reach)) });
    let behind = REACH.map(|reach| -> Window {
        let mut weights = line(2 * reach);
        weights.reverse();
        (2 * reach - 1, weights)
    });
    let windows = [centred, ahead, behind];
    let one = |row: usize| {
        let widest = |windows: &[Window; REACH.len()]| {
            let (mut value, mut variance) = (values[row], 1.0);
            let (mut low, mut high) = (value - AGREE * noise, value + AGREE * noise);
            for (own, weights) in windows {
                let Some(first) = row.checked_sub(*own) else {
                    break;
                };
                let Some(rows) = values.get(first..first + weights.len()) else {
                    break;
                };
                let sum: f64 = rows.iter().zip(weights).map(|(a, b)| a * b).sum();
                let error = AGREE * noise * weights[*own].sqrt();
                (low, high) = (low.max(sum - error), high.min(sum + error));
                if low > high {
                    break;
                }
                (value, variance) = (sum, weights[*own]);
            }
            (value, variance)
        };
        let best = windows.each_ref().map(widest);
        let least = best.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        least.map_or(values[row], |(value, _)| value)
    };
    (0..values.len()).map(one).collect()
}

/// Weights by which the parabola nearest to `reach` rows on either side of one, and to itself, is found at that one (Savitzky and
/// Golay 1964).
fn parabola(reach: usize) -> Vec<f64> {
    let h = reach as f64;
    let whole = (2.0 * h + 3.0) * (2.0 * h + 1.0) * (2.0 * h - 1.0);
    let weight = |row: usize| {
        let from = row as f64 - h;
        (3.0 * (3.0 * h * h + 3.0 * h - 1.0) - 15.0 * from * from) / whole
    };
    (0..=2 * reach).map(weight).collect()
}

/// Weights by which the straight line nearest to so many rows is found at the first of them.
fn line(rows: usize) -> Vec<f64> {
    let n = rows as f64;
    let weight = |row: usize| (2.0 * (2.0 * n - 1.0) - 6.0 * row as f64) / (n * (n + 1.0));
    (0..rows).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::white;
    use std::f64::consts::TAU;

    const NOISE: f64 = 0.02;

    fn sweep(t: f64) -> f64 {
        9.0 * (TAU * 2.0 * t * t).sin()
    }

    fn steps(t: f64) -> f64 {
        5.0 * (8.0 * t + 0.5).floor().rem_euclid(3.0)
    }

    fn sampled(command: fn(f64) -> f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..5000).map(|row| 1e-3 * f64::from(row)).collect();
        let all = white(5000, 7).into_iter().zip(&time);
        let command = all.map(|(one, &t)| command(t) + noise * one).collect();
        (command, time)
    }

    #[test]
    fn white_noise_is_measured_and_mostly_taken_out() {
        // At 20 Hz and 9 V no parabola is near more than a few rows; between two steps a line is near 64.
        for (of, share) in [(sweep as fn(f64) -> f64, 0.7), (steps, 0.35)] {
            let (command, time) = sampled(of, NOISE);
            let found = noise_of(&command, &time, most(Channel::Command)).unwrap();
            assert!((found / NOISE - 1.0).abs() < 0.1, "{found}");
            let quiet = smoothed(&command, found);
            let off = quiet.iter().zip(&time).map(|(one, &t)| one - of(t));
            let left = (off.map(|off| off * off).sum::<f64>() / 5000.0).sqrt();
            assert!(left < share * NOISE, "{left}");
        }
    }

    #[test]
    fn what_is_commanded_is_no_noise() {
        for of in [sweep as fn(f64) -> f64, steps, |t| {
            9.0 * (TAU * 12.0 * t * t).sin()
        }] {
            let (command, time) = sampled(of, 0.0);
            assert_eq!(noise_of(&command, &time, most(Channel::Command)), None);
        }
        // Noise that is half a hundredth of the range and more is commanded; and at uneven times nothing is known.
        let (command, mut time) = sampled(steps, 0.1);
        assert_eq!(noise_of(&command, &time, most(Channel::Command)), None);
        let (command, _) = sampled(steps, 0.005);
        assert!(noise_of(&command, &time, most(Channel::Command)).is_some());
        time[100] += 2e-4;
        assert_eq!(noise_of(&command, &time, most(Channel::Command)), None);
    }

    #[test]
    fn lines_and_parabolas_are_kept() {
        let at = |row: f64| 3.0 + 0.5 * row - 0.1 * row * row;
        let sum = |weights: &[f64], of: &dyn Fn(f64) -> f64| -> f64 {
            let rows = weights.iter().enumerate();
            rows.map(|(row, weight)| weight * of(row as f64)).sum()
        };
        for reach in REACH {
            let middle = reach as f64;
            let found = sum(&parabola(reach), &at);
            assert!((found - at(middle)).abs() < 1e-9, "{reach}: {found}");
            let found = sum(&line(2 * reach), &|row| 3.0 + 0.5 * row);
            assert!((found - 3.0).abs() < 1e-9, "{reach}: {found}");
        }
    }
}
