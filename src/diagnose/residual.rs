//! Whether the residual depends on anything that is known.

use crate::search::polish::autocorrelation_inflation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Surrogates that make up the null distribution.
const SURROGATES: usize = 99;
/// Longest lag that is looked at, as a fraction of the record and in rows.
const LONGEST_LAG: (usize, usize) = (50, 200);
/// Correlations weaker than this explain less than a thousandth of the residual's variance, whatever their certainty.
const WEAKEST: f64 = 0.03;

/// A mean this many of its standard errors from zero is an offset.
const OFFSET_ERRORS: f64 = 4.0;

/// What is left in the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Remaining {
    /// Whether it depends on any of the signals, or is far above the noise floor.
    pub structured: bool,
    /// The signals that it depends on, the strongest first, with their largest correlation coefficient over the lags.
    pub correlates_with: Vec<(&'static str, f64)>,
}

/// Correlates `residual` with the command, its powers, rate and direction, and time, over lags: a fit makes its residual
/// orthogonal to what its own parameters could do at lag zero.
///
/// Residuals are coloured even when the model is right, so the threshold comes from the data: surrogates with the
/// residual's spectrum and random phases keep its colour and lose its bond with the signals. A signal counts if its
/// largest correlation, in units of its chance level, exceeds the 95th percentile of the largest such figure over *all*
/// signals and lags under surrogates. An offset counts beside them.
pub fn remaining(command: &[f64], residual: &[f64], seed: u64) -> Remaining {
    let count = residual.len();
    let lags = (count / LONGEST_LAG.0).clamp(1, LONGEST_LAG.1);
    let mut planner = FftPlanner::new();
    let transform = Transform {
        forward: planner.plan_fft_forward(count),
        inverse: planner.plan_fft_inverse(count),
        lags,
    };
    let constant = offset(residual);
    let residual = transform.spectrum(&standardised(residual));
    let signals: Vec<(&'static str, Vec<Complex<f64>>)> = signals(command)
        .into_iter()
        .map(|(name, signal)| (name, transform.spectrum(&signal)))
        .collect();
    let found: Vec<(&'static str, f64)> = signals
        .iter()
        .map(|(name, signal)| (*name, transform.largest_correlation(signal, &residual)))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let null: Vec<Vec<f64>> = (0..SURROGATES)
        .map(|_| {
            let surrogate = randomised(&residual, &mut rng);
            let largest =
                |(_, signal): &(_, Vec<_>)| transform.largest_correlation(signal, &surrogate).abs();
            signals.iter().map(largest).collect()
        })
        .collect();
    // A slow residual correlates with slow signals by chance far more than with fast ones: each signal is measured by
    // its own chance level, so that one of them does not hide the others.
    let chance: Vec<f64> = (0..signals.len())
        .map(|i| percentile(null.iter().map(|row| row[i]), 0.5).max(f64::MIN_POSITIVE))
        .collect();
    let most = |row: &Vec<f64>| {
        row.iter()
            .zip(&chance)
            .map(|(value, chance)| value / chance)
            .fold(0.0, f64::max)
    };
    let threshold = percentile(null.iter().map(most), 0.95);
    let exceeds = |(value, chance): (f64, &f64)| value > WEAKEST && value / chance > threshold;
    let mut found: Vec<(&'static str, f64)> = found
        .into_iter()
        .zip(&chance)
        .filter(|(f, chance)| exceeds((f.1.abs(), chance)))
        .map(|(f, _)| f)
        .collect();
    found.extend(constant);
    found.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    Remaining {
        structured: !found.is_empty(),
        correlates_with: found,
    }
}

fn percentile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[(values.len() as f64 * share) as usize]
}

/// The mean over the root mean square, where it is further from zero than coloured noise brings it.
fn offset(residual: &[f64]) -> Option<(&'static str, f64)> {
    let count = residual.len() as f64;
    let mean = residual.iter().sum::<f64>() / count;
    let centred: Vec<f64> = residual.iter().map(|value| value - mean).collect();
    let variance = centred.iter().map(|value| value * value).sum::<f64>() / count;
    let error = (variance * autocorrelation_inflation(&[&centred]) / count).sqrt();
    let share = mean / (variance + mean * mean).sqrt();
    (mean.abs() > OFFSET_ERRORS * error && share.abs() > WEAKEST).then_some(("a constant", share))
}

struct Transform {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    lags: usize,
}

impl Transform {
    fn spectrum(&self, values: &[f64]) -> Vec<Complex<f64>> {
        let mut spectrum: Vec<Complex<f64>> = values.iter().map(|&value| value.into()).collect();
        self.forward.process(&mut spectrum);
        spectrum
    }

    /// The correlation coefficient of largest magnitude, with its sign, over lags up to the longest either way.
    fn largest_correlation(&self, signal: &[Complex<f64>], residual: &[Complex<f64>]) -> f64 {
        let mut product: Vec<Complex<f64>> = signal
            .iter()
            .zip(residual)
            .map(|(s, r)| s.conj() * r)
            .collect();
        self.inverse.process(&mut product);
        let count = product.len();
        let near = product[..=self.lags]
            .iter()
            .chain(&product[count - self.lags..]);
        near.map(|value| value.re / count as f64)
            .fold(0.0, |most, value| {
                if value.abs() > most.abs() {
                    value
                } else {
                    most
                }
            })
    }
}

/// The spectrum of a real signal with the same magnitudes and random phases.
fn randomised(spectrum: &[Complex<f64>], rng: &mut ChaCha8Rng) -> Vec<Complex<f64>> {
    let count = spectrum.len();
    let mut result = spectrum.to_vec();
    for k in 1..count.div_ceil(2) {
        let turned = spectrum[k] * Complex::from_polar(1.0, rng.random::<f64>() * TAU);
        result[k] = turned;
        result[count - k] = turned.conj();
    }
    result
}

fn signals(command: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let rate: Vec<f64> = (0..command.len())
        .map(|k| command[(k + 1).min(command.len() - 1)] - command[k.saturating_sub(1)])
        .collect();
    let each = |f: fn(f64) -> f64, from: &[f64]| {
        standardised(&from.iter().map(|&v| f(v)).collect::<Vec<f64>>())
    };
    vec![
        ("command", standardised(command)),
        ("command^2", each(|u| u * u, command)),
        ("command^3", each(|u| u * u * u, command)),
        ("|command|", each(f64::abs, command)),
        ("command rate", standardised(&rate)),
        (
            "command direction",
            each(|r| if r == 0.0 { 0.0 } else { r.signum() }, &rate),
        ),
        (
            "time",
            standardised(&(0..command.len()).map(|k| k as f64).collect::<Vec<f64>>()),
        ),
    ]
}

/// With mean 0 and sum of squares 1; all zero for a constant.
fn standardised(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let norm = values
        .iter()
        .map(|v| (v - mean).powi(2))
        .sum::<f64>()
        .sqrt();
    let scale = if norm > 0.0 { 1.0 / norm } else { 0.0 };
    values.iter().map(|v| (v - mean) * scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coloured noise that has nothing to do with the command.
    fn coloured(seed: u64, count: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut state = 0.0;
        (0..count)
            .map(|_| {
                state = 0.95 * state + rng.random::<f64>() - 0.5;
                state
            })
            .collect()
    }

    fn chirp(count: usize) -> Vec<f64> {
        (0..count)
            .map(|k| 5.0 * (2e-6 * (k * k) as f64).sin())
            .collect()
    }

    #[test]
    fn coloured_noise_seldom_looks_structured() {
        let command = chirp(4000);
        let alarms = (0..100)
            .filter(|&seed| remaining(&command, &coloured(seed, 4000), seed).structured)
            .count();
        assert!(alarms <= 10, "{alarms} of 100");
    }

    #[test]
    fn a_slow_drift_does_not_hide_a_dependence_on_the_command() {
        let count = 16_000;
        let command = chirp(count);
        let noise = coloured(8, count);
        let drift = |k: usize| 2.0 * k as f64 / count as f64 - 5.0;
        let residual: Vec<f64> = (0..count)
            .map(|k| 0.2 * noise[k] + drift(k) + 0.1 * command[k])
            .collect();
        let found = remaining(&command, &residual, 1).correlates_with;
        for name in ["a constant", "command"] {
            assert!(found.iter().any(|(found, _)| *found == name), "{found:?}");
        }
    }

    #[test]
    fn a_dependence_on_the_rate_is_seen_and_named() {
        let command = chirp(4000);
        let noise = coloured(3, 4000);
        let residual: Vec<f64> = (1..4000)
            .map(|k| 0.3 * noise[k] + 20.0 * (command[k] - command[k - 1]))
            .collect();
        let found = remaining(&command[1..], &residual, 1);
        assert!(found.structured);
        assert_eq!(found.correlates_with[0].0, "command rate");
    }
}
