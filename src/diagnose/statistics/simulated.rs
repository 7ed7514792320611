//! Signals for the tests of the statistics.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Gaussian noise of variance 1.
pub(in crate::diagnose) fn white(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || {
        let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
        radius * (TAU * rng.random::<f64>()).cos()
    };
    (0..count).map(|_| normal()).collect()
}

/// What a first-order filter with a corner in Hz at 1 kHz makes of `values`; white noise of variance 1 keeps it.
pub(in crate::diagnose) fn filtered(values: &[f64], corner: f64) -> Vec<f64> {
    let rho = (-TAU * corner * 1e-3).exp();
    let mut state = values[0];
    values
        .iter()
        .map(|value| {
            state = rho * state + (1.0 - rho * rho).sqrt() * value;
            state
        })
        .collect()
}

/// A bench's command at 1 kHz, in V: steps with rests, triangles both ways and chirps of two amplitudes.
pub(in crate::diagnose) fn command(count: usize) -> Vec<f64> {
    let part = count as f64 / 4.0;
    let heights = [0.0, 4.0, -7.0, 0.0];
    (0..count)
        .map(|k| {
            let (quarter, at) = ((k as f64 / part) as usize, (k as f64 / part).fract());
            let triangle = |x: f64| 4.0 * ((x + 0.75).fract() - 0.5).abs() - 1.0;
            let chirp = |at: f64| (TAU * part * 1e-3 * (0.5 * at + 12.0 * at * at)).sin();
            match quarter {
                0 => heights[(at * 4.0) as usize],
                1 => 9.0 * triangle(2.0 * at),
                2 => 1.0 * chirp(at),
                _ => 6.0 * chirp(at),
            }
        })
        .collect()
}
