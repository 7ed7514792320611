//! Commands and pressures that were measured with noise which the valve did not get: a model that is driven by it moves as the valve did
//! not. They are smoothed, and what is left of it counts as noise of the channels.

use super::fitted::Fitted;
use super::input_noise::{QUIETENED, noise_in, product, quieten, root_mean_square, steps};
use super::measurements::Measurements;
use super::problem::IdentificationProblem;
use super::simulation::{Compared, residual};
use crate::evaluate::reference;
use crate::model::Input;
use crate::record::Channel;

/// What a model makes of the noise counts from this share of a channel's noise on.
const COUNTS: f64 = 0.1;
/// Standard error from which on the share of the noise that the valve got is not known. Most valves then get none of it: what a
/// logger adds is seldom beside what a generator does.
const UNKNOWN: f64 = 0.5;

/// `problem` with its noisy commands or pressures smoothed, where their noise counts in what `fitted` gives, and the measured valve does
/// not show that it got the noise; otherwise `None`.
pub(super) fn with_quiet_inputs(
    problem: &IdentificationProblem,
    fitted: &Fitted,
) -> Option<IdentificationProblem> {
    let mut groups = QUIETENED.into_iter();
    groups.find_map(|channels| with_quiet(problem, fitted, channels))
}

fn with_quiet(
    problem: &IdentificationProblem,
    fitted: &Fitted,
    channels: &[Channel],
) -> Option<IdentificationProblem> {
    let measurements = &problem.measurements;
    let mut all = measurements.input_noise.clone();
    all.resize(measurements.fit.len(), Input::default());
    let mut largest: f64 = 0.0;
    for (series, noise) in measurements.fit.iter().zip(&mut all) {
        for &channel in channels {
            let noise = noise.of_mut(channel)?;
            if *noise > 0.0 {
                return None;
            }
            *noise = noise_in(series, channel);
            largest = largest.max(*noise);
        }
    }
    if largest == 0.0 {
        return None;
    }
    let mut quiet = measurements.clone();
    for &channel in channels {
        for series in quiet.fit.iter_mut().chain(&mut quiet.hold_out) {
            let noise = noise_in(series, channel);
            quieten(series, channel, noise);
        }
    }
    quiet.input_noise = all;
    is_of_the_logger(fitted, measurements, &quiet).then(|| {
        let (what, unit) = match channels {
            [Channel::Command] => ("the command was", &*problem.structure.command_unit),
            _ => ("pressures were", "bar"),
        };
        quiet.beginnings.push(format!(
            "{what} measured with noise of {largest:.3} {unit}, which the valve did not get: it is smoothed, and what a model \
             makes of the rest counts as noise"
        ));
        IdentificationProblem {
            measurements: quiet,
            ..problem.clone()
        }
    })
}

/// Whether the noise that the `quiet` inputs lack counts in what `fitted` gives, and less than half of that was measured, or
/// nobody knows how much: a slope of the residual over it, both from row to row, where what the model lacks is small.
fn is_of_the_logger(fitted: &Fitted, measurements: &Measurements, quiet: &Measurements) -> bool {
    let structure = &fitted.problem.structure;
    let simulated = reference::trajectories(structure, &fitted.values, &quiet.fit);
    let without = Compared::all(&measurements.fit, &simulated);
    let with = fitted.beside(measurements).fit;
    let noise = fitted.noise(measurements, false);
    let mut counts = false;
    let (mut information, mut slope) = (0.0, 0.0);
    for &output in &structure.observed {
        let left = residual(&with, output);
        let made: Vec<f64> = residual(&without, output)
            .iter()
            .zip(&left)
            .map(|(without, with)| without - with)
            .collect();
        counts |= root_mean_square(&made) > COUNTS * noise[output.name()].value;
        let (left, made) = (steps(&left), steps(&made));
        let variance = root_mean_square(&left).powi(2);
        if variance > 0.0 {
            information += product(&made, &made) / variance;
            slope += product(&left, &made) / variance;
        }
    }
    // 0 where the valve got the noise, −1 where it did not.
    counts && (slope / information < -0.5 || information.sqrt().recip() > UNKNOWN)
}
