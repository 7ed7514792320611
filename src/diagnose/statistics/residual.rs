//! Whether the residual depends on anything that is known.

mod family;
mod signals;
mod size;
mod spectrum;

use super::rows::{coloured, standardised};
use family::{Family, Sign};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use rustfft::num_complex::Complex;
pub use signals::Residuals;
use signals::{Bins, Pair, Pattern, Signals};
use spectrum::Spectrum;
use statrs::function::erf::erfc;
use std::f64::consts::SQRT_2;

/// Surrogates that make up the null distribution of one channel.
const SURROGATES: usize = 99;
/// So many of them are in memory at once: the cores share them.
const AT_ONCE: usize = 16;
/// Structure is reported below this chance that noise alone shows as much, over all tests and channels of a record.
const LEVEL: f64 = 0.02;
/// The tests of a channel that share [`LEVEL`]: dependence, size, line, constant.
const FAMILIES: f64 = 4.0;
/// Structure that explains a smaller share of the residual's variance is not reported, however certain it is. Removing
/// it would change the residual's RMS by half a percent: a tenth of what the noise floor itself is known to, and a
/// twentieth of the margin over it that a fit is given.
const MATERIAL: f64 = 0.01;
/// What shows by chance, of what is known to, varies by less than this factor of its share of the variance.
const HARDLY: f64 = 2.0;
/// Fewer rows show nothing.
const FEWEST: usize = 128;

/// What is left in the residual of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Remaining {
    /// Whether it is more than noise.
    pub structured: bool,
    /// What it depends on, the strongest first: the correlation coefficient, with its sign where the dependence has
    /// one. Its square is the share of the variance that is explained.
    pub correlates_with: Vec<(String, f64)>,
    /// The chance that noise alone shows as much in any test and channel of the record.
    pub p_value: f64,
}

impl Remaining {
    /// Nothing is left.
    pub fn nothing() -> Self {
        Self {
            structured: false,
            correlates_with: Vec::new(),
            p_value: 1.0,
        }
    }

    /// Leaves out what is hardly stronger than the strongest of what is `known` to be shown: signals that are alike share it.
    pub(in crate::diagnose) fn leave_out(&mut self, known: &[(String, f64)]) {
        let squares = known.iter().map(|(_, strength)| strength.powi(2));
        let least = MATERIAL + HARDLY * squares.fold(0.0, f64::max);
        self.correlates_with
            .retain(|(_, strength)| strength.powi(2) > least);
        self.structured = !self.correlates_with.is_empty();
    }
}

/// Tests the residual of every channel for structure:
///
/// - dependence: correlation over lags with the command, its powers, rate and direction, time and the known signals (a
///   fit makes its residual orthogonal to what its own parameters could do at lag zero); its means in bins of those
///   signals (correlation ratio), which see any function of one; its spectrum over the *value* of the command, where a
///   coarse converter leaves a line;
/// - size: whether it is larger in motion, at large commands, or at some times;
/// - a line in its spectrum where the command has none;
/// - a constant.
///
/// Residuals are coloured even when the model is right, so the chance level comes from the data: surrogates with
/// random phases and a power spectrum that is the residual's, smoothed, which keeps the colour of noise and not the
/// lines and drifts of structure. Each statistic is measured by its own mean and spread under the surrogates, and the
/// largest over all of them by a Gumbel distribution fitted to its values there (Westfall and Young 1993,
/// "Resampling-based multiple testing", single-step maxT).
pub fn remaining(residuals: &Residuals, seed: u64) -> Vec<Remaining> {
    let count = residuals.command.len();
    if count < FEWEST {
        return vec![Remaining::nothing(); residuals.channels.len()];
    }
    let signals = Signals::new(residuals);
    let tests = Tests::new(residuals, &signals);
    let share = FAMILIES * residuals.channels.len() as f64;
    let one = |(channel, residual): (usize, &&[f64])| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(channel as u64);
        let mut signs = tests.signs(residual, &mut rng);
        let chance = signs.iter().map(|sign| sign.p_value).fold(1.0, f64::min);
        signs.retain(|sign| sign.p_value * share < LEVEL && sign.strength.powi(2) > MATERIAL);
        signs.sort_by(|a, b| b.strength.abs().total_cmp(&a.strength.abs()));
        let mut found: Vec<(String, f64)> = Vec::new();
        for sign in signs {
            if found.iter().all(|(name, _)| *name != sign.name) {
                found.push((sign.name, sign.strength));
            }
        }
        Remaining {
            structured: !found.is_empty(),
            correlates_with: found,
            p_value: (chance * share).min(1.0),
        }
    };
    residuals.channels.iter().enumerate().map(one).collect()
}

/// What is the same for every channel of a record.
struct Tests<'a> {
    residuals: &'a Residuals<'a>,
    signals: &'a Signals,
    spectrum: Spectrum,
    pairs: Vec<Pair>,
    bins: Vec<Bins>,
    pattern: Pattern,
    /// Lines of the command's own spectrum.
    own_lines: Vec<bool>,
}

impl<'a> Tests<'a> {
    fn new(residuals: &'a Residuals<'a>, signals: &'a Signals) -> Self {
        let spectrum = Spectrum::new(residuals.command.len());
        Self {
            pairs: signals.pairs(&spectrum),
            bins: signals.bins(),
            pattern: Pattern::new(residuals.command),
            own_lines: spectrum.peaks(&spectrum.of(residuals.command)),
            residuals,
            signals,
            spectrum,
        }
    }

    fn signs(&self, residual: &[f64], rng: &mut ChaCha8Rng) -> Vec<Sign> {
        let standard = standardised(residual);
        if standard.iter().all(|&value| value == 0.0) {
            return offset(residual, self.residuals.starts)
                .into_iter()
                .collect();
        }
        let transformed = self.spectrum.of(&standard);
        let smooth = self.spectrum.smooth(&transformed);
        let mut signs = self.dependence(&standard, &transformed, &smooth, rng);
        signs.extend(size::signs(
            residual,
            self.residuals.starts,
            self.signals,
            rng,
        ));
        signs.extend(self.line(&transformed));
        signs.extend(offset(residual, self.residuals.starts));
        signs
    }

    fn dependence(
        &self,
        standard: &[f64],
        transformed: &[Complex<f64>],
        smooth: &[f64],
        rng: &mut ChaCha8Rng,
    ) -> Vec<Sign> {
        let mut found = Vec::new();
        let mut signed = Vec::new();
        self.statistics(standard, transformed, &mut found, Some(&mut signed));
        let observed_pattern = self.pattern.power(standard);
        let of_surrogate = |surrogate: Vec<Complex<f64>>| {
            let values = self.spectrum.back(&surrogate);
            let mut row = Vec::with_capacity(found.len() + 1);
            self.statistics(&values, &surrogate, &mut row, None);
            (row, self.pattern.power(&values))
        };
        let mut all = Vec::with_capacity(SURROGATES);
        while all.len() < SURROGATES {
            let count = AT_ONCE.min(SURROGATES - all.len());
            let drawn: Vec<_> = (0..count)
                .map(|_| self.spectrum.draw(smooth, rng))
                .collect();
            all.par_extend(drawn.into_par_iter().map(of_surrogate));
        }
        let (mut null, patterns): (Vec<Vec<f64>>, Vec<Vec<f64>>) = all.into_iter().unzip();
        // Each period of the pattern has its own chance level: the mean of the other surrogates.
        let total: Vec<f64> = (0..observed_pattern.len())
            .map(|i| patterns.iter().map(|power| power[i]).sum())
            .collect();
        let (peak, period) = Pattern::peak(&observed_pattern, &total);
        found.push(peak * SURROGATES as f64);
        for (row, power) in null.iter_mut().zip(&patterns) {
            let others: Vec<f64> = total
                .iter()
                .zip(power)
                .map(|(all, own)| all - own)
                .collect();
            row.push(Pattern::peak(power, &others).0 * (SURROGATES - 1) as f64);
        }

        let family = Family::new(&null);
        let p_values = family.p_values(&found);
        let correlations = self.signals.all.len();
        let mut signs = Vec::new();
        for (i, p_value) in p_values.into_iter().enumerate() {
            let (name, strength) = if i < correlations {
                (self.signals.all[i].0.clone(), signed[i])
            } else if let Some(bins) = self.bins.get(i - correlations) {
                // What noise explains by chance does not count.
                let excess = (found[i] - family.mean(i)).max(0.0);
                (bins.name.clone(), excess.sqrt())
            } else {
                let share = observed_pattern[period].sqrt();
                (self.pattern.name(period), share)
            };
            signs.push(Sign {
                name,
                strength,
                p_value,
            });
        }
        signs
    }

    /// The largest correlation with each signal and the correlation ratio for each set of bins.
    fn statistics(
        &self,
        values: &[f64],
        transformed: &[Complex<f64>],
        out: &mut Vec<f64>,
        mut signed: Option<&mut Vec<f64>>,
    ) {
        for pair in &self.pairs {
            for largest in pair.largest_correlations(&self.spectrum, transformed) {
                if out.len() < self.signals.all.len() {
                    out.push(largest.abs());
                    if let Some(signed) = signed.as_deref_mut() {
                        signed.push(largest);
                    }
                }
            }
        }
        out.extend(self.bins.iter().map(|bins| bins.ratio(values)));
    }

    /// The strongest line in a spectrum, against its neighbourhood.
    fn line(&self, transformed: &[Complex<f64>]) -> Option<Sign> {
        let (bin, p_value) = self.spectrum.strongest_line(transformed, &self.own_lines)?;
        let total: f64 = transformed.iter().map(Complex::norm_sqr).sum();
        let strength = (2.0 * transformed[bin].norm_sqr() / total).sqrt();
        let frequency = bin as f64 / (self.signals.row_seconds * transformed.len() as f64);
        Some(Sign {
            name: format!("a line at {frequency:.2} Hz"),
            strength,
            p_value,
        })
    }
}

/// The mean over the root mean square, and how likely coloured noise brings it so far from zero.
fn offset(residual: &[f64], starts: &[usize]) -> Option<Sign> {
    let count = residual.len() as f64;
    let mean = residual.iter().sum::<f64>() / count;
    let variance = residual
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / count;
    let square = variance + mean * mean;
    if square == 0.0 {
        return None;
    }
    let error = (variance * coloured(residual, starts) / count).sqrt();
    Some(Sign {
        name: "a constant".into(),
        strength: mean / square.sqrt(),
        p_value: erfc(mean.abs() / error / SQRT_2),
    })
}

#[cfg(test)]
mod tests;
