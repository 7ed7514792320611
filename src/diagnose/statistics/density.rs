//! The spectrum of a residual, in its unit.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Segments that are averaged, at least, in the longest stretch.
const SEGMENTS: usize = 6;
/// Longest and shortest segment.
const SEGMENT: (usize, usize) = (4096, 32);

/// Amplitude spectral density of `stretches` of rows `interval` seconds apart: (Hz, unit/√Hz), without the mean
/// (Welch 1967: overlapping segments with Hann's window). Empty where no stretch is long enough.
pub fn spectral_density(stretches: &[&[f64]], interval: f64) -> Vec<(f64, f64)> {
    let longest = stretches.iter().map(|rows| rows.len()).max().unwrap_or(0);
    let wanted = (longest / SEGMENTS * 2).clamp(SEGMENT.1, SEGMENT.0);
    // The largest power of two that is not longer.
    let length = 1 << wanted.ilog2();
    let hann =
        |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / length as f64).cos();
    let window: Vec<f64> = (0..length).map(hann).collect();
    let transform = FftPlanner::new().plan_fft_forward(length);
    let mut power = vec![0.0; length / 2];
    let mut segments = 0.0;
    for rows in stretches {
        let mean = rows.iter().sum::<f64>() / rows.len().max(1) as f64;
        let mut from = 0;
        while from + length <= rows.len() {
            let mut spectrum: Vec<Complex<f64>> = rows[from..from + length]
                .iter()
                .zip(&window)
                .map(|(value, weight)| ((value - mean) * weight).into())
                .collect();
            transform.process(&mut spectrum);
            for (sum, bin) in power.iter_mut().zip(&spectrum) {
                *sum += bin.norm_sqr();
            }
            segments += 1.0;
            from += length / 2;
        }
    }
    if segments == 0.0 {
        return Vec::new();
    }
    // One-sided: the power of negative frequencies is added to that of the positive ones.
    let scale = 2.0 * interval / (segments * window.iter().map(|w| w * w).sum::<f64>());
    let bin = 1.0 / (length as f64 * interval);
    (1..power.len())
        .map(|k| (k as f64 * bin, (power[k] * scale).sqrt()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::white;

    #[test]
    fn white_noise_is_level_at_its_density_and_a_line_stands_where_it_is() {
        let noise = white(60_000, 5);
        let density = spectral_density(&[&noise[..40_000], &noise[40_000..]], 1e-3);
        let expected = (2.0 * 1e-3f64).sqrt();
        let mean = density.iter().map(|(_, d)| d * d).sum::<f64>() / density.len() as f64;
        assert!((mean.sqrt() / expected - 1.0).abs() < 0.02, "{mean}");

        let line: Vec<f64> = (0..60_000)
            .map(|k| (std::f64::consts::TAU * 50.0 * k as f64 * 1e-3).sin())
            .collect();
        let density = spectral_density(&[&line], 1e-3);
        let peak = density.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((peak.0 - 50.0).abs() < 0.2, "{peak:?}");
        // All of its power, 1/2, is in the spectrum.
        let step = density[1].0 - density[0].0;
        let power: f64 = density.iter().map(|(_, d)| d * d * step).sum();
        assert!((power - 0.5).abs() < 0.01, "{power}");
    }

    #[test]
    fn too_few_rows_have_no_spectrum() {
        assert!(spectral_density(&[&[1.0; 20]], 1e-3).is_empty());
        assert!(spectral_density(&[], 1e-3).is_empty());
    }
}
