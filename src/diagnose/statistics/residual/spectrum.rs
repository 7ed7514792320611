//! Power spectra: smoothed, drawn from, and searched for lines.

use rand::{Rng, RngExt};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Neighbours whose median is the level about a frequency. With 51 of them its logarithm is known to 20 %, and noise
/// with a corner at 20 Hz is still flat across them in a record of 3 s.
const NEIGHBOURS: usize = 51;
/// Which of the ordered neighbours is the median.
const MIDDLE: usize = NEIGHBOURS.div_ceil(2);
/// Slower than this many periods in the record, a line is a drift.
const SLOWEST_LINE: usize = 4;
/// A peak of the command's spectrum is one that white noise shows with this chance, at any one frequency.
const OWN_PEAK: f64 = 1e-6;

/// Transforms between rows and frequencies.
pub(super) struct Spectrum {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    count: usize,
    /// What the median of the neighbours is for unit mean power.
    median: f64,
}

impl Spectrum {
    pub(super) fn new(count: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(count),
            inverse: planner.plan_fft_inverse(count),
            count,
            median: (0..MIDDLE).map(|i| 1.0 / (NEIGHBOURS - i) as f64).sum(),
        }
    }

    pub(super) fn of(&self, values: &[f64]) -> Vec<Complex<f64>> {
        let mut spectrum: Vec<Complex<f64>> = values.iter().map(|&value| value.into()).collect();
        self.forward.process(&mut spectrum);
        spectrum
    }

    pub(super) fn forward(&self, values: &mut [Complex<f64>]) {
        self.forward.process(values);
    }

    pub(super) fn inverse(&self, values: &mut [Complex<f64>]) {
        self.inverse.process(values);
    }

    /// The rows of a spectrum.
    pub(super) fn back(&self, spectrum: &[Complex<f64>]) -> Vec<f64> {
        let mut values = spectrum.to_vec();
        self.inverse.process(&mut values);
        let scale = 1.0 / self.count as f64;
        values.iter().map(|value| value.re * scale).collect()
    }

    /// Frequencies above 0 and below half the sampling rate.
    fn inner(&self) -> std::ops::Range<usize> {
        1..self.count.div_ceil(2)
    }

    /// The median power of each frequency's neighbours, without its own.
    fn medians(&self, spectrum: &[Complex<f64>]) -> Vec<f64> {
        let powers: Vec<f64> = spectrum.iter().map(Complex::norm_sqr).collect();
        let inner = self.inner();
        let mut around = Vec::with_capacity(NEIGHBOURS + 1);
        let mut result = vec![0.0; inner.end];
        for k in inner.clone() {
            let first = k
                .saturating_sub(NEIGHBOURS / 2)
                .clamp(inner.start, inner.end - NEIGHBOURS - 1);
            around.clear();
            around.extend_from_slice(&powers[first..k]);
            around.extend_from_slice(&powers[k + 1..first + NEIGHBOURS + 1]);
            let (_, median, _) = around.select_nth_unstable_by(MIDDLE - 1, f64::total_cmp);
            result[k] = *median;
        }
        result
    }

    /// The mean power about each frequency, blind to lines.
    pub(super) fn smooth(&self, spectrum: &[Complex<f64>]) -> Vec<f64> {
        let mut smooth = self.medians(spectrum);
        smooth.iter_mut().for_each(|power| *power /= self.median);
        smooth
    }

    /// The spectrum of Gaussian noise with mean powers `smooth`, scaled so that its rows have sum of squares 1.
    pub(super) fn draw(&self, smooth: &[f64], rng: &mut impl Rng) -> Vec<Complex<f64>> {
        let mut result = vec![Complex::new(0.0, 0.0); self.count];
        let mut total = 0.0;
        for k in self.inner() {
            let power = -smooth[k] * (1.0 - rng.random::<f64>()).ln();
            result[k] = Complex::from_polar(power.sqrt(), rng.random::<f64>() * TAU);
            total += 2.0 * power;
        }
        let scale = (self.count as f64 / total).sqrt();
        for k in self.inner() {
            result[k] *= scale;
            result[self.count - k] = result[k].conj();
        }
        result
    }

    /// Logarithm of the chance that noise has a power at frequency `k` that exceeds its neighbours' median by as much.
    ///
    /// Powers are exponential, and so is the r-th of n ordered ones a sum of exponentials over n, n − 1, …: the power
    /// exceeds g times it with chance Π (n − i) / (n − i + g), i < r. No estimate of the level enters.
    fn log_chance(power: f64, median: f64) -> f64 {
        if median <= 0.0 {
            return 0.0;
        }
        let ratio = power / median;
        (0..MIDDLE)
            .map(|i| -(ratio / (NEIGHBOURS - i) as f64).ln_1p())
            .sum()
    }

    /// Frequencies at which a spectrum has a peak, or lies next to one.
    pub(super) fn peaks(&self, spectrum: &[Complex<f64>]) -> Vec<bool> {
        let medians = self.medians(spectrum);
        let mut peaks = vec![false; medians.len() + 1];
        for k in self.inner() {
            if Self::log_chance(spectrum[k].norm_sqr(), medians[k]) < OWN_PEAK.ln() {
                peaks[k - 1..=k + 1].fill(true);
            }
        }
        peaks
    }

    /// The strongest line outside `known` peaks and its chance over all frequencies (as Fisher 1929, "Tests of
    /// significance in harmonic analysis", with a level that may vary over frequency).
    pub(super) fn strongest_line(
        &self,
        spectrum: &[Complex<f64>],
        known: &[bool],
    ) -> Option<(usize, f64)> {
        let medians = self.medians(spectrum);
        let lines = (SLOWEST_LINE..medians.len())
            .filter(|&k| !known[k])
            .map(|k| (k, Self::log_chance(spectrum[k].norm_sqr(), medians[k])));
        let tried = lines.clone().count() as f64;
        let (bin, chance) = lines.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((bin, -(tried * (-chance.exp()).ln_1p()).exp_m1()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn with_powers(power: impl Fn(usize) -> f64) -> Vec<Complex<f64>> {
        (0..400)
            .map(|k| Complex::new(power(k).sqrt(), 0.0))
            .collect()
    }

    #[test]
    fn a_level_is_that_of_a_frequencys_neighbours_without_its_own() {
        let spectrum = Spectrum::new(400);
        let ramp = spectrum.medians(&with_powers(|k| k as f64));
        assert_eq!(ramp.len(), 200);
        // 25 below and 26 above; at the ends the 51 nearest on one side.
        for (k, median) in [
            (100, 101.0),
            (1, 27.0),
            (26, 27.0),
            (27, 28.0),
            (199, 173.0),
        ] {
            assert!((ramp[k] - median).abs() < 1e-9, "{k}: {}", ramp[k]);
        }
    }

    #[test]
    fn a_line_marks_itself_and_both_its_neighbours() {
        let spectrum = Spectrum::new(400);
        let line = with_powers(|k| if k == 100 { 1e4 } else { 1.0 });
        let peaks = spectrum.peaks(&line);
        let marked: Vec<usize> = (0..peaks.len()).filter(|&k| peaks[k]).collect();
        assert_eq!(marked, [99, 100, 101]);
        let (bin, chance) = spectrum.strongest_line(&line, &vec![false; 201]).unwrap();
        assert!(bin == 100 && chance < 1e-6, "{bin} {chance}");
        // What is known is no line, and what is slower than four periods is a drift.
        let (bin, chance) = spectrum.strongest_line(&line, &peaks).unwrap();
        assert!(bin != 100 && chance > 0.9, "{bin} {chance}");
        let drift = with_powers(|k| if k == 3 { 1e4 } else { 1.0 });
        let (bin, _) = spectrum.strongest_line(&drift, &vec![false; 201]).unwrap();
        assert!(bin != 3);
    }

    #[test]
    fn the_chance_of_a_power_is_how_often_noise_has_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut exponential = || -(1.0 - rng.random::<f64>()).ln();
        let rounds = 20_000;
        let ratios: Vec<f64> = (0..rounds)
            .map(|_| {
                let mut around: Vec<f64> = (0..NEIGHBOURS).map(|_| exponential()).collect();
                around.sort_by(f64::total_cmp);
                exponential() / around[MIDDLE - 1]
            })
            .collect();
        for ratio in [1.0, 3.0, 6.0] {
            let seen = ratios.iter().filter(|&&one| one > ratio).count() as f64 / rounds as f64;
            let chance = Spectrum::log_chance(5.0 * ratio, 5.0).exp();
            let deviation = (chance / rounds as f64).sqrt();
            assert!(
                (seen - chance).abs() < 4.0 * deviation,
                "{ratio}: {seen} of {chance}"
            );
        }
    }

    #[test]
    fn noise_is_drawn_with_the_power_that_it_is_asked_for() {
        let spectrum = Spectrum::new(400);
        let shape: Vec<f64> = (0..200).map(|k| if k < 50 { 9.0 } else { 1.0 }).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut powers = [0.0; 2];
        for _ in 0..200 {
            let drawn = spectrum.draw(&shape, &mut rng);
            let rows = spectrum.back(&drawn);
            assert!((rows.iter().map(|row| row * row).sum::<f64>() - 1.0).abs() < 1e-12);
            let power = |range: std::ops::Range<usize>| {
                let count = range.len() as f64;
                drawn[range].iter().map(Complex::norm_sqr).sum::<f64>() / count
            };
            powers[0] += power(1..50);
            powers[1] += power(50..200);
        }
        let ratio = powers[0] / powers[1];
        assert!((ratio - 9.0).abs() < 0.5, "{ratio}");
    }
}
