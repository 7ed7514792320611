//! Resampling of residuals in blocks, which keeps the correlation of neighbouring rows.

use super::rows::{coloured, stretches};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Replicates of an interval.
const REPLICATES: usize = 999;
/// The 97.5 % quantile of the normal distribution.
const NORMAL: f64 = 1.96;
/// Tails outside a 95 % interval.
const TAIL: f64 = 0.025;

/// An estimate and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower limit.
    pub low: f64,
    /// The estimate.
    pub value: f64,
    /// Upper limit.
    pub high: f64,
}

/// How much smaller the weighted RMS of a residual became.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Improvement {
    /// In % of the RMS before.
    pub percent: Interval,
    /// In units of the RMS.
    pub absolute: Interval,
}

/// The automatic block length for a circular bootstrap of the mean of `values` (Politis and White 2004, "Automatic
/// block-length selection for the dependent bootstrap", with the correction of Patton, Politis and White 2009):
/// (2 G² n / D)^⅓, G = Σ |k| λ(k/M) c(k), D = 4/3 (Σ λ(k/M) c(k))², flat-top window λ, M twice the lag from which on
/// the correlations are negligible. At most a third of the rows and 3 √n.
pub fn block_length(values: &[f64], starts: &[usize]) -> usize {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let records = stretches(&centred, starts);
    let covariance = |lag: usize| {
        let one = |record: &&[f64]| -> f64 {
            record
                .iter()
                .zip(record.iter().skip(lag))
                .map(|(a, b)| a * b)
                .sum()
        };
        records.iter().map(one).sum::<f64>() / count
    };
    let variance = covariance(0);
    let longest = ((3.0 * count.sqrt()).ceil().min(count / 3.0) as usize).max(1);
    if variance <= 0.0 {
        return 1;
    }
    let negligible = 2.0 * (count.log10() / count).sqrt();
    let needed = 5.max(count.log10().sqrt() as usize);
    let widest = count.sqrt().ceil() as usize + needed;
    let covariances: Vec<f64> = (0..=2 * widest).map(covariance).collect();
    let small = |lag: usize| covariances[lag].abs() < negligible * variance;
    let first = (0..widest)
        .find(|&lag| (lag + 1..=lag + needed).all(small))
        .unwrap_or(widest);
    let width = (2 * first.max(1)).min(2 * widest);
    let (mut g, mut sum) = (0.0, variance);
    for (lag, covariance) in covariances.iter().enumerate().take(width + 1).skip(1) {
        let window = (2.0 * (1.0 - lag as f64 / width as f64)).clamp(0.0, 1.0);
        g += 2.0 * window * lag as f64 * covariance;
        sum += 2.0 * window * covariance;
    }
    let d = 4.0 / 3.0 * sum * sum;
    // A sum that vanishes says nothing: take the longest.
    let block = (2.0 * g * g / d * count).cbrt();
    if block.is_finite() {
        (block.round() as usize).clamp(1, longest)
    } else {
        longest
    }
}

/// Rows drawn with replacement, `len` of them, in runs of `block` that never cross from one record into the next: each
/// record is filled with runs from itself, and after its last row comes its first (circular block bootstrap, Politis
/// and Romano 1992).
pub fn resample_indices(
    len: usize,
    starts: &[usize],
    block: usize,
    rng: &mut impl Rng,
) -> Vec<usize> {
    let mut rows = Vec::with_capacity(len);
    let ends = starts.iter().skip(1).chain(Some(&len));
    for (&start, &end) in starts.iter().zip(ends) {
        while rows.len() < end {
            let first = rng.random_range(start..end);
            let run = block.max(1).min(end - rows.len());
            rows.extend((first..first + run).map(|row| start + (row - start) % (end - start)));
        }
    }
    rows
}

/// Writes into `out` what `residual` could have been as well: runs of `block` rows drawn from the same record, each
/// with a random sign, so that it keeps the residual's size and colour and no longer depends on anything that
/// happened in those rows.
pub fn surrogate(
    residual: &[f64],
    starts: &[usize],
    block: usize,
    rng: &mut impl Rng,
    out: &mut Vec<f64>,
) {
    out.clear();
    let ends = starts
        .iter()
        .skip(1)
        .chain(Some(&residual.len()))
        .copied()
        .collect::<Vec<_>>();
    for (&start, end) in starts.iter().zip(ends) {
        let block = block.clamp(1, (end - start).max(1));
        while out.len() < end {
            let first = rng.random_range(start..=end - block);
            let run = block.min(end - out.len());
            let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
            out.extend(
                residual[first..first + run]
                    .iter()
                    .map(|value| sign * value),
            );
        }
    }
}

/// The improvement from residuals `before` to `after`, one series a channel over the same rows, whose squares count
/// `weights` times. Before and after are resampled together, so that what both contain cancels.
pub fn improvement(
    before: &[Vec<f64>],
    after: &[Vec<f64>],
    weights: &[f64],
    starts: &[usize],
    seed: u64,
) -> Improvement {
    let before = losses(before, weights);
    let after = losses(after, weights);
    let difference: Vec<f64> = before.iter().zip(&after).map(|(b, a)| b - a).collect();
    let block = block_length(&difference, starts);
    let (before, after) = (Sums::new(&before), Sums::new(&after));
    let len = difference.len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ends: Vec<usize> = starts.iter().skip(1).copied().chain([len]).collect();
    let mut percents = Vec::with_capacity(REPLICATES);
    let mut absolutes = Vec::with_capacity(REPLICATES);
    for _ in 0..REPLICATES {
        let (mut b, mut a) = (0.0, 0.0);
        for (&start, &end) in starts.iter().zip(&ends) {
            let mut filled = start;
            while filled < end {
                let first = rng.random_range(start..end);
                let run = block.min(end - filled);
                b += before.run(first, run, start, end);
                a += after.run(first, run, start, end);
                filled += run;
            }
        }
        let (percent, absolute) = gain(b, a, len);
        percents.push(percent);
        absolutes.push(absolute);
    }
    let (percent, absolute) = gain(before.all(), after.all(), len);
    Improvement {
        percent: interval(percent, percents),
        absolute: interval(absolute, absolutes),
    }
}

/// A mean square with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::diagnose) struct MeanSquare {
    pub(in crate::diagnose) mean: f64,
    pub(in crate::diagnose) error: f64,
}

impl MeanSquare {
    /// The lower end of the 95 % interval of its root.
    pub(in crate::diagnose) fn least_root(&self) -> f64 {
        (self.mean - NORMAL * self.error).max(0.0).sqrt()
    }
}

/// The mean square of `residual`, whose rows need not be independent.
pub(in crate::diagnose) fn mean_square(residual: &[f64], starts: &[usize]) -> MeanSquare {
    let squares: Vec<f64> = residual.iter().map(|value| value * value).collect();
    let count = squares.len().max(1) as f64;
    let mean = squares.iter().sum::<f64>() / count;
    let spread = squares.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / count;
    let error = (coloured(&squares, starts) * spread / count).sqrt();
    MeanSquare { mean, error }
}

/// The reduction of the root mean square, in % and as it is.
fn gain(before: f64, after: f64, len: usize) -> (f64, f64) {
    let count = len.max(1) as f64;
    let (before, after) = (
        (before.max(0.0) / count).sqrt(),
        (after.max(0.0) / count).sqrt(),
    );
    let percent = if before > 0.0 {
        100.0 * (1.0 - after / before)
    } else {
        0.0
    };
    (percent, before - after)
}

fn interval(value: f64, mut replicates: Vec<f64>) -> Interval {
    replicates.sort_by(f64::total_cmp);
    let last = replicates.len() - 1;
    let at = |share: f64| replicates[(share * last as f64).round() as usize];
    Interval {
        low: at(TAIL),
        value,
        high: at(1.0 - TAIL),
    }
}

/// The weighted sum of squares over the channels in each row.
pub(super) fn losses(channels: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let rows = channels.first().map_or(0, Vec::len);
    (0..rows)
        .map(|row| {
            let each = channels.iter().zip(weights);
            each.map(|(channel, weight)| weight * channel[row] * channel[row])
                .sum()
        })
        .collect()
}

/// Sums over any run of rows in two look-ups.
struct Sums(Vec<f64>);

impl Sums {
    fn new(values: &[f64]) -> Self {
        let mut sum = 0.0;
        let running = values.iter().map(|value| {
            sum += value;
            sum
        });
        Self([0.0].into_iter().chain(running).collect())
    }

    fn all(&self) -> f64 {
        self.0[self.0.len() - 1]
    }

    /// Over `run` rows from `first`, after row `end` − 1 on from `start`; no more than the rows between them.
    fn run(&self, first: usize, run: usize, start: usize, end: usize) -> f64 {
        let stop = first + run;
        if stop <= end {
            self.0[stop] - self.0[first]
        } else {
            self.0[end] - self.0[first] + self.0[start + stop - end] - self.0[start]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::{filtered, white};

    #[test]
    fn blocks_are_short_for_white_noise_and_long_for_coloured() {
        let median = |corner: Option<f64>| {
            let mut lengths: Vec<usize> = (0..20)
                .map(|seed| {
                    let white = white(3500, seed);
                    let noise = corner.map_or(white.clone(), |corner| filtered(&white, corner));
                    let length = block_length(&noise, &[0]);
                    let in_metres: Vec<f64> = noise.iter().map(|mm| 1e-3 * mm).collect();
                    assert_eq!(block_length(&in_metres, &[0]), length);
                    length
                })
                .collect();
            lengths.sort();
            lengths[10]
        };
        let (white, coloured) = (median(None), median(Some(20.0)));
        println!("blocks: white {white}, coloured {coloured}");
        assert!(white <= 10, "{white}");
        // ρ = 0.882: (2 (2ρ/(1 − ρ²))² 3/4 n)^⅓ = 75.
        assert!((50..=110).contains(&coloured), "{coloured}");
    }

    #[test]
    fn no_block_leaves_its_record() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let starts = [0, 300, 1000];
        let rows = resample_indices(1200, &starts, 37, &mut rng);
        assert_eq!(rows.len(), 1200);
        let record = |row: usize| starts.iter().rposition(|&start| start <= row);
        assert!((0..1200).all(|k| record(k) == record(rows[k])));
        let mut out = Vec::new();
        let residual: Vec<f64> = (0..1200).map(|k| k as f64 + 1.0).collect();
        surrogate(&residual, &starts, 37, &mut rng, &mut out);
        assert_eq!(out.len(), 1200);
        assert!((0..1200).all(|k| record(k) == record(out[k].abs() as usize - 1)));
    }

    #[test]
    fn sums_of_runs_are_those_of_the_rows() {
        let values = white(50, 3);
        let sums = Sums::new(&values);
        for (first, run) in [(10, 5), (35, 10), (38, 30), (10, 30)] {
            let rows = (first..first + run).map(|row| 10 + (row - 10) % 30);
            let direct: f64 = rows.map(|row| values[row]).sum();
            assert!((sums.run(first, run, 10, 40) - direct).abs() < 1e-12);
        }
    }

    #[test]
    fn a_surrogate_keeps_size_and_colour() {
        let residual = filtered(&white(7000, 4), 20.0);
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut out = Vec::new();
        surrogate(
            &residual,
            &[0],
            block_length(&residual, &[0]),
            &mut rng,
            &mut out,
        );
        let power = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let neighbours = |v: &[f64]| v.windows(2).map(|p| p[0] * p[1]).sum::<f64>() / power(v);
        assert!((power(&out) / power(&residual) - 1.0).abs() < 0.2);
        assert!((neighbours(&out) - neighbours(&residual)).abs() < 0.03);
        let common: f64 = residual.iter().zip(&out).map(|(a, b)| a * b).sum();
        assert!(common.abs() < 0.2 * power(&residual));
    }

    /// How often the interval holds the improvement that an endless record would show.
    #[test]
    fn the_interval_covers_the_improvement() {
        for (corner, allowed) in [(None, 178..=199), (Some(20.0), 170..=199)] {
            let covered = (0..200)
                .filter(|&seed| {
                    let white = [white(3000, seed), white(3000, seed + 500)];
                    let after = white.map(|white| match corner {
                        Some(corner) => filtered(&white, corner),
                        None => white,
                    });
                    let structure = |k: usize| 1.2 * 2f64.sqrt() * (k as f64 * 0.05).sin();
                    let before = [0, 1].map(|c| -> Vec<f64> {
                        (0..3000).map(|k| after[c][k] + structure(k)).collect()
                    });
                    let found = improvement(&before, &after, &[1.0, 1.0], &[0], seed).percent;
                    let truth = 100.0 * (1.0 - 1.0 / (1.0 + 1.44f64).sqrt());
                    assert!(found.low <= found.value && found.value <= found.high);
                    found.low <= truth && truth <= found.high
                })
                .count();
            println!("interval covers: {corner:?} {covered} of 200");
            assert!(allowed.contains(&covered), "{corner:?}: {covered} of 200");
        }
    }
}
