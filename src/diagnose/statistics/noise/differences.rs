//! Noise from the differences of neighbouring residuals.

use super::moments::{mean, mean_square, middle_square};
use crate::diagnose::statistics::rows::stretches;

/// Largest correlation of neighbouring rows that differences can tell from a drift.
const MAX_CORRELATION: f64 = 0.97;
/// The same of second and third differences: their ratio hardly depends on a larger one.
const MAX_CORRELATION_OF_THIRD: f64 = 0.8;
/// Most votes on a mean square: a few long blocks know noise best, but what a missing effect does may be over soon after each step, so
/// that only short ones are without it.
const VOTES: [usize; 2] = [9, 36];
/// The ratio of third to second differences has a standard error of 2.5 to 3 over the root of the rows: beyond three of them it is
/// not that of noise which makes the first ones.
const BEYOND_CHANCE: f64 = 9.0;

/// The variance of noise that a first-order filter coloured, and how many independent rows show it.
///
/// With correlation ρ of neighbouring rows, first differences have 2 (1 − ρ) times the variance of the noise, second ones
/// 2 (1 − ρ)(3 − ρ) times, third ones 2 (1 − ρ)(10 − 5ρ + ρ²) times; smooth signals hardly have any. Where the second are less
/// than twice the first, or the third more than the correlation of those allows, no noise has made the first: a movement has, and
/// the second and third are taken. The noise is no more than all that is left: steps of a slow movement have differences, and a
/// correlation, that no filter gives.
pub(super) fn variance(starts: &[usize], values: &[f64]) -> (f64, f64) {
    let records = stretches(values, starts);
    let differences = |coefficients: &[f64]| -> Vec<f64> {
        let windows = records
            .iter()
            .flat_map(|one| one.windows(coefficients.len()));
        let difference = |window: &[f64]| -> f64 {
            window
                .iter()
                .zip(coefficients)
                .map(|(value, c)| value * c)
                .sum()
        };
        windows.map(difference).collect()
    };
    let first = differences(&[-1.0, 1.0]);
    let second = differences(&[1.0, -2.0, 1.0]);
    let third = differences(&[-1.0, 3.0, -3.0, 1.0]);
    let middle = mean(values);
    let about: Vec<f64> = values.iter().map(|value| value - middle).collect();
    let all = mean_square(&about);
    let by = |votes: usize| {
        let squares = [&first, &second, &third].map(|values| middle_square(values, votes));
        let (variance, rows) = of_squares(squares, values.len() as f64);
        (variance.min(all), rows)
    };
    let [few, many] = VOTES.map(by);
    if many.0 < few.0 { many } else { few }
}

/// The same of the mean squares of the first to third differences of so many `rows`, whatever all that is left comes to.
fn of_squares([first, second, third]: [f64; 3], rows: f64) -> (f64, f64) {
    if first == 0.0 {
        return (0.0, 1.0);
    }
    let correlation = (3.0 - second / first).max(0.0);
    let beyond = third / second - ratio_of_third(correlation);
    let a_movement = correlation > 1.0 || beyond * rows.sqrt() > BEYOND_CHANCE;
    let (variance, correlation) = if a_movement {
        let correlation = correlation_of(third / second);
        let share = 2.0 * (1.0 - correlation) * (3.0 - correlation);
        (second / share, correlation)
    } else {
        let correlation = correlation.min(MAX_CORRELATION);
        (first / (2.0 * (1.0 - correlation)), correlation)
    };
    // The correlation is known to about one over the root of the rows, and 1 − ρ divides.
    let free = (1.0 - correlation).powi(2);
    (variance, (rows * free / (1.0 + free)).max(1.0))
}

/// How many times the square of second differences third ones have with this `correlation`.
fn ratio_of_third(correlation: f64) -> f64 {
    (10.0 - 5.0 * correlation + correlation.powi(2)) / (3.0 - correlation)
}

/// The correlation with which third differences have `ratio` times the square of second ones: the smaller root of
/// 10 − 5ρ + ρ² = ratio (3 − ρ).
fn correlation_of(ratio: f64) -> f64 {
    let half = (5.0 - ratio) / 2.0;
    let root = (half * half - (10.0 - 3.0 * ratio)).max(0.0).sqrt();
    (half - root).clamp(0.0, MAX_CORRELATION_OF_THIRD)
}
