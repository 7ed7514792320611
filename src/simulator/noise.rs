//! Noise and quantisation of what is measured.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Gaussian noise on every measured channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation, % of the channel's full scale.
    pub percent: f64,
    /// The corner frequency of its coloured part in Hz, where it has one.
    pub colour: Option<f64>,
    /// The share of the variance that is white all the same.
    pub white: f64,
}

impl Noise {
    /// White noise of `percent` % of full scale.
    pub fn white(percent: f64) -> Self {
        Self {
            percent,
            colour: None,
            white: 1.0,
        }
    }

    /// The same, but that 70 % of its variance are first-order noise with a corner at `corner` Hz.
    pub fn coloured(percent: f64, corner: f64) -> Self {
        Self {
            percent,
            colour: Some(corner),
            white: 0.3,
        }
    }

    /// `rows` values of standard deviation 1, `interval` s apart.
    pub(super) fn draw(&self, rows: usize, interval: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let Some(corner) = self.colour else {
            return (0..rows).map(|_| normal(rng)).collect();
        };
        let keep = (-TAU * corner * interval).exp();
        let (white, coloured) = (self.white.sqrt(), (1.0 - self.white).sqrt());
        let mut state = normal(rng);
        let mut next = || {
            let value = white * normal(rng) + coloured * state;
            state = keep * state + (1.0 - keep * keep).sqrt() * normal(rng);
            value
        };
        (0..rows).map(|_| next()).collect()
    }
}

/// How measured values are rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantisation {
    /// By a converter of so many bits over ± full scale.
    Bits(u32),
    /// To multiples of so many % of full scale.
    Percent(f64),
}

impl Quantisation {
    /// The step as a share of full scale.
    pub(super) fn step(self) -> f64 {
        match self {
            Self::Bits(bits) => 2.0 / 2f64.powi(bits as i32),
            Self::Percent(percent) => percent / 100.0,
        }
    }
}

/// A standard normal deviate, after Box and Muller.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn noise_has_its_deviation_and_its_colour() {
        let rows = 200_000;
        let correlation = |values: &[f64]| {
            let sum: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
            sum / rows as f64
        };
        for (noise, expected) in [
            (Noise::white(0.3), 0.0),
            (Noise::coloured(0.3, 50.0), 0.7 * (-TAU * 0.05).exp()),
        ] {
            let values = noise.draw(rows, 1e-3, &mut ChaCha8Rng::seed_from_u64(3));
            let variance = values.iter().map(|y| y * y).sum::<f64>() / rows as f64;
            assert!((variance - 1.0).abs() < 0.02, "{variance}");
            let found = correlation(&values);
            assert!((found - expected).abs() < 0.02, "{found} {expected}");
        }
    }
}
