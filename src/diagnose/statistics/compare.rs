//! Whether a record can tell two models apart.

use super::bootstrap::losses;
use super::rows::coloured;
use statrs::function::erf::erfc;
use std::f64::consts::SQRT_2;

/// Two models are told apart below this chance.
const LEVEL: f64 = 0.05;

/// How two models compare on the same rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Mean weighted squared residual of the first model less that of the second: negative where the first is better.
    pub difference: f64,
    /// The difference in units of its standard error.
    pub z: f64,
    /// The chance of a difference as large, either way, between two models that are equally far from the truth.
    pub p_value: f64,
}

impl Comparison {
    /// Compares the residuals of two models, one series a channel over the same rows, whose squares count `weights`
    /// times (Diebold and Mariano 1995, "Comparing predictive accuracy"; for models that are not nested it is the test
    /// of Vuong 1989). Neighbouring rows depend on each other: the standard error is that of Newey and West, whitened,
    /// with an automatic width.
    ///
    /// On rows that were fitted, a model with more free parameters has an advantage that this does not see: compare on
    /// rows held out.
    pub fn new(first: &[Vec<f64>], second: &[Vec<f64>], weights: &[f64], starts: &[usize]) -> Self {
        let losses = losses(first, weights)
            .into_iter()
            .zip(losses(second, weights));
        let loss: Vec<f64> = losses.map(|(first, second)| first - second).collect();
        let count = loss.len().max(1) as f64;
        let difference = loss.iter().sum::<f64>() / count;
        let variance = loss.iter().map(|v| (v - difference).powi(2)).sum::<f64>() / count;
        let error = (variance * coloured(&loss, starts) / count).sqrt();
        // Models that do the same are not told apart.
        let z = if error > 0.0 { difference / error } else { 0.0 };
        Self {
            difference,
            z,
            p_value: erfc(z.abs() / SQRT_2),
        }
    }
}

/// Whether the rows cannot tell, with 95 % confidence, which of two models is better.
pub fn indistinguishable(
    first: &[Vec<f64>],
    second: &[Vec<f64>],
    weights: &[f64],
    starts: &[usize],
) -> bool {
    Comparison::new(first, second, weights, starts).p_value > LEVEL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::{filtered, white};

    const ROWS: usize = 3000;

    /// How many of 200 pairs of models are told apart, and how often the first is called better. What each misses is a
    /// sine with this RMS, in units of the noise.
    fn told_apart(corner: Option<f64>, missed: [f64; 2]) -> (usize, usize) {
        let results: Vec<Comparison> = (0..200)
            .map(|seed| {
                let white = white(ROWS, seed);
                let noise = corner.map_or(white.clone(), |corner| filtered(&white, corner));
                let model = |rms: f64, frequency: f64, phase: f64| -> Vec<f64> {
                    let missed =
                        |k: usize| rms * 2f64.sqrt() * (k as f64 * frequency + phase).sin();
                    (0..ROWS).map(|k| noise[k] + missed(k)).collect()
                };
                let phase = seed as f64;
                let first = vec![model(missed[0], 0.021, phase)];
                let second = vec![model(missed[1], 0.034, 2.0 * phase)];
                assert_eq!(
                    indistinguishable(&first, &second, &[1.0], &[0]),
                    Comparison::new(&first, &second, &[1.0], &[0]).p_value > 0.05
                );
                Comparison::new(&first, &second, &[1.0], &[0])
            })
            .collect();
        let apart = results.iter().filter(|result| result.p_value <= 0.05);
        (
            apart.clone().count(),
            apart.filter(|result| result.difference < 0.0).count(),
        )
    }

    #[test]
    fn equally_good_models_are_seldom_told_apart() {
        for corner in [None, Some(20.0)] {
            let (apart, _) = told_apart(corner, [0.5, 0.5]);
            println!("equal models told apart: {corner:?} {apart} of 200");
            assert!(apart <= 16, "{corner:?}: {apart} of 200");
        }
    }

    #[test]
    fn a_better_model_is_told_from_a_worse_one() {
        for (corner, least) in [(None, 190), (Some(20.0), 100)] {
            let (apart, better) = told_apart(corner, [0.2, 0.6]);
            println!("better model told: {corner:?} {apart} of 200");
            assert!(apart >= least, "{corner:?}: {apart} of 200");
            assert_eq!(apart, better, "{corner:?}: the worse is called better");
        }
    }

    #[test]
    fn a_model_is_not_told_from_itself() {
        let residual = vec![white(ROWS, 1)];
        let found = Comparison::new(&residual, &residual, &[1.0], &[0]);
        assert_eq!((found.z, found.p_value), (0.0, 1.0));
    }
}
