//! Whether the residual is larger in some rows than in others.

use super::family::{Family, Sign};
use super::signals::{Bins, Signals};
use crate::diagnose::statistics::rows::{standardised, stretches};
use rand::Rng;
use rand::seq::SliceRandom;

/// Permutations that make up the null distribution.
const PERMUTATIONS: usize = 63;
/// Order of the autoregression that whitens the residual.
const ORDER: usize = 8;
/// Bins by magnitude, speed and time.
const BINS: usize = 16;
/// Rows in a bin that shows bursts.
const BURST: usize = 24;

/// The size of the residual's innovations against |command|, |command rate| and time, in 16 stretches and in many.
///
/// Innovations are what a linear prediction from the rows before leaves: of noise of any colour they are independent,
/// so that permuting them shows what chance gives. Their magnitude is taken, not the square, so that a few outliers do
/// not drown the rest.
pub(super) fn signs(
    residual: &[f64],
    starts: &[usize],
    signals: &Signals,
    rng: &mut impl Rng,
) -> Vec<Sign> {
    let innovations = innovations(residual, starts);
    let magnitudes: Vec<f64> = innovations.iter().map(|value| value.abs()).collect();
    let mut values = standardised(&magnitudes);
    let count = values.len();
    let speed: Vec<f64> = signals.rate.iter().map(|rate| rate.abs()).collect();
    let rows: Vec<f64> = (0..count).map(|k| k as f64).collect();
    let bursts = (count / BURST).min(usize::from(u16::MAX));
    let all = [
        Bins::new("size with |command|", BINS, &[], &signals.magnitude),
        Bins::new("size with |command rate|", BINS, &[], &speed),
        Bins::new("size with time", BINS, &[], &rows),
        Bins::new("size in bursts", bursts, &[], &rows),
    ];
    let ratios =
        |values: &[f64]| -> Vec<f64> { all.iter().map(|bins| bins.ratio(values)).collect() };
    let found = ratios(&values);
    let null: Vec<Vec<f64>> = (0..PERMUTATIONS)
        .map(|_| {
            values.shuffle(rng);
            ratios(&values)
        })
        .collect();
    let family = Family::new(&null);
    let p_values = family.p_values(&found);
    let sign = |(i, bins): (usize, &Bins)| Sign {
        name: bins.name.clone(),
        strength: (found[i] - family.mean(i)).max(0.0).sqrt(),
        p_value: p_values[i],
    };
    all.iter().enumerate().map(sign).collect()
}

/// What an autoregression fitted to all records leaves of each (Levinson 1946).
fn innovations(residual: &[f64], starts: &[usize]) -> Vec<f64> {
    let centred = standardised(residual);
    let records = stretches(&centred, starts);
    let products: Vec<f64> = (0..=ORDER)
        .map(|lag| {
            let one = |record: &&[f64]| -> f64 {
                record
                    .iter()
                    .zip(record.iter().skip(lag))
                    .map(|(a, b)| a * b)
                    .sum()
            };
            records.iter().map(one).sum()
        })
        .collect();
    let mut coefficients: Vec<f64> = Vec::new();
    let mut left = products[0];
    for order in 1..=ORDER {
        // A residual that is predicted exactly needs no more terms.
        if left <= 1e-12 * products[0] {
            break;
        }
        let known: f64 = coefficients
            .iter()
            .enumerate()
            .map(|(i, a)| a * products[order - 1 - i])
            .sum();
        let reflection = (products[order] - known) / left;
        let turned: Vec<f64> = coefficients.iter().rev().map(|a| reflection * a).collect();
        coefficients
            .iter_mut()
            .zip(turned)
            .for_each(|(a, turned)| *a -= turned);
        coefficients.push(reflection);
        left *= 1.0 - reflection * reflection;
    }
    let one = |record: &&[f64]| -> Vec<f64> {
        (0..record.len())
            .map(|k| {
                let before = record[..k].iter().rev();
                record[k]
                    - coefficients
                        .iter()
                        .zip(before)
                        .map(|(a, b)| a * b)
                        .sum::<f64>()
            })
            .collect()
    };
    records.iter().flat_map(one).collect()
}
