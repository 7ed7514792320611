//! The noise floor: what no model can explain.

/// Rows in a window that is looked at for quiet.
const WINDOW: usize = 128;
/// A window is quiet if the command moves by less than this fraction of its range over the record.
const QUIET: f64 = 0.025;
/// As many windows must be quiet, one after another, before their noise is believed: the first of a run still settles.
const SETTLING: usize = 2;

/// A noise floor and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// How it was estimated.
    pub method: &'static str,
}

/// The standard deviation of the noise in `measured`: from stretches where the `command` rests, where there are any,
/// otherwise from what is left of `residual` above a quarter of the sampling rate.
pub fn noise_floor(
    _starts: &[usize],
    command: &[f64],
    measured: &[f64],
    residual: &[f64],
) -> Noise {
    let still = QUIET * range(command);
    let mut squares = Vec::new();
    let mut run = 0;
    for (command, measured) in command
        .chunks_exact(WINDOW)
        .zip(measured.chunks_exact(WINDOW))
    {
        run = if range(command) <= still { run + 1 } else { 0 };
        if run > SETTLING {
            squares.push(detrended_variance(measured));
        }
    }
    if squares.is_empty() {
        return Noise {
            value: high_pass(residual),
            method: "high-pass residual",
        };
    }
    squares.sort_by(f64::total_cmp);
    // The median: a window in which something moved all the same does not count.
    Noise {
        value: squares[squares.len() / 2].sqrt(),
        method: "quiet stretches",
    }
}

fn range(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
    high - low
}

/// Variance about a straight line.
fn detrended_variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / n;
    let along = values
        .iter()
        .enumerate()
        .map(|(i, v)| (i as f64 - middle) * (v - mean))
        .sum::<f64>();
    let slope = along / (n * (n * n - 1.0) / 12.0);
    let left = |(i, v): (usize, &f64)| (v - mean - slope * (i as f64 - middle)).powi(2);
    values.iter().enumerate().map(left).sum::<f64>() / (n - 2.0)
}

/// Second differences of white noise have six times its variance; smooth signals hardly have any.
fn high_pass(values: &[f64]) -> f64 {
    let second = |triple: &[f64]| (triple[0] - 2.0 * triple[1] + triple[2]).powi(2);
    let sum: f64 = values.windows(3).map(second).sum();
    (sum / 6.0 / values.len().saturating_sub(2).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Noise of variance 1, uniform.
    fn noise(count: usize) -> Vec<f64> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        (0..count)
            .map(|_| (rng.random::<f64>() - 0.5) * 12f64.sqrt())
            .collect()
    }

    #[test]
    fn quiet_stretches_show_the_noise_under_a_drift() {
        let noise = noise(8000);
        let command: Vec<f64> = (0..8000)
            .map(|k| {
                if k < 4000 {
                    0.0
                } else {
                    (k as f64 * 0.05).sin() * 9.0
                }
            })
            .collect();
        let measured: Vec<f64> = (0..8000)
            .map(|k| command[k] + 0.02 * noise[k] + 1e-5 * k as f64)
            .collect();
        let found = noise_floor(&[0], &command, &measured, &measured);
        assert_eq!(found.method, "quiet stretches");
        assert!((found.value / 0.02 - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn without_quiet_the_residual_above_the_signal_shows_it() {
        let noise = noise(8000);
        let command: Vec<f64> = (0..8000).map(|k| (k as f64 * 0.01).sin() * 9.0).collect();
        let residual: Vec<f64> = (0..8000)
            .map(|k| 0.02 * noise[k] + 0.1 * (k as f64 * 0.02).sin())
            .collect();
        let found = noise_floor(&[0], &command, &command, &residual);
        assert_eq!(found.method, "high-pass residual");
        assert!((found.value / 0.02 - 1.0).abs() < 0.1, "{found:?}");
    }
}
