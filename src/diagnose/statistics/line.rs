//! The strongest line in a residual's spectrum.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Bins to either side that a line is compared with.
const AROUND: usize = 25;
/// Periods of a line in the rows, at least: what is slower is a movement.
const FEWEST_PERIODS: usize = 3;
/// The residual is padded to this many times its length, so that a line between two bins is not lost.
const PADDING: usize = 4;

/// The frequency (Hz) of the line that stands out most from the spectrum around it, for rows `interval` seconds apart.
pub(in crate::diagnose) fn strongest_line(residual: &[f64], interval: f64) -> Option<f64> {
    let count = residual.len();
    if count < 8 * AROUND {
        return None;
    }
    let power = spectrum(residual);
    let reach = AROUND * PADDING;
    let first = FEWEST_PERIODS * PADDING;
    let stands_out = |k: usize| {
        let from = k.saturating_sub(reach).max(first);
        let mut near: Vec<f64> = power[from..(k + reach).min(power.len())].to_vec();
        let middle = near.len() / 2;
        let median = *near.select_nth_unstable_by(middle, f64::total_cmp).1;
        power[k] / median.max(f64::MIN_POSITIVE)
    };
    let peak = |&k: &usize| power[k] > power[k - 1] && power[k] >= power[k + 1];
    let mut peaks: Vec<usize> = (first + 1..power.len() - 1).filter(peak).collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    peaks.truncate(200);
    let best = peaks
        .into_iter()
        .max_by(|a, b| stands_out(*a).total_cmp(&stands_out(*b)))?;
    Some(best as f64 / ((PADDING * count) as f64 * interval))
}

/// Rows a period of what is strongest in a rest; `None` of a rest in which nothing comes to three periods.
pub(in crate::diagnose) fn strongest_period(rest: &[f64]) -> Option<f64> {
    let power = spectrum(rest);
    let first = FEWEST_PERIODS * PADDING;
    let bins = power.iter().enumerate().skip(first);
    let (best, _) = bins.max_by(|a, b| a.1.total_cmp(b.1))?;
    // What falls from there is slower still.
    (best > first).then(|| (PADDING * rest.len()) as f64 / best as f64)
}

/// The power of some rows over frequency, in bins of one over the padded length.
fn spectrum(rows: &[f64]) -> Vec<f64> {
    let count = rows.len();
    let mean = rows.iter().sum::<f64>() / count as f64;
    let length = PADDING * count;
    let mut spectrum = vec![Complex::default(); length];
    for (k, (bin, value)) in spectrum.iter_mut().zip(rows).enumerate() {
        // Hann's window, or a slow residual would leak over the lines.
        let window = (std::f64::consts::PI * k as f64 / count as f64)
            .sin()
            .powi(2);
        *bin = ((value - mean) * window).into();
    }
    FftPlanner::new()
        .plan_fft_forward(length)
        .process(&mut spectrum);
    spectrum[..length / 2]
        .iter()
        .map(|bin| bin.norm_sqr())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::white;

    #[test]
    fn a_line_between_two_bins_is_found_under_noise_and_drift() {
        let noise = white(4000, 3);
        let value = |k: usize| {
            let t = k as f64 * 1e-3;
            0.4 * (std::f64::consts::TAU * 47.3141 * t).sin() + noise[k] + 3.0 * t
        };
        let residual: Vec<f64> = (0..4000).map(value).collect();
        let found = strongest_line(&residual, 1e-3).unwrap();
        assert!((found - 47.3141).abs() < 0.05, "{found}");
    }
}
