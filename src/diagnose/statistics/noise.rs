//! The noise floor: what no model can explain.

use super::rows::{coloured, stretches};
use std::collections::HashMap;

/// Two commands are the same if they differ by less than this fraction of the command's range.
const SAME: f64 = 1e-6;
/// Consecutive rows that must be the same before a repeat is suspected.
const ALIKE: usize = 32;
/// Distances that are looked at for repeats.
const DISTANCES: usize = 4;
/// Fewest rows for a noise floor from repeats, and from rests.
const FEWEST: [usize; 2] = [200, 64];
/// The command rests where it moves by less than this fraction of its range: what is commanded exactly, and otherwise
/// what is measured with noise.
const STILL: [f64; 2] = [0.0005, 0.025];
/// A rest whose quarters differ in their means by more than this fraction of the range is a slow movement.
const MOVEMENT: f64 = 0.001;
/// Shortest rest, as a fraction of its record, and its limits in rows.
const REST: (usize, usize, usize) = (40, 24, 200);
/// One over the share of a rest in which the valve settles.
const SETTLING: usize = 4;
/// The valve still settles in a rest whose first half varies this many times as much as its second.
const UNSETTLED: f64 = 3.0;
/// Rows in a block whose variance is one vote.
const BLOCK: usize = 128;
/// Most votes. A few long blocks know the variance of coloured noise better than many short ones.
const VOTES: usize = 9;
/// Largest correlation of neighbouring rows that differences can tell from a drift.
const MAX_CORRELATION: f64 = 0.97;

/// Where a noise floor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseMethod {
    /// The differences between repeats of the command.
    RepeatedCommand,
    /// What is left where the command rests.
    QuietStretches,
    /// The differences of neighbouring residuals.
    Differences,
}

impl NoiseMethod {
    /// What a report calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::RepeatedCommand => "repeated command",
            Self::QuietStretches => "quiet stretches",
            Self::Differences => "high-pass residual",
        }
    }
}

/// A noise floor and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// How it was estimated.
    pub method: NoiseMethod,
}

/// The standard deviation of the noise in `measured`, over records that start at the rows `starts`.
///
/// - Where the command repeats itself exactly, from the differences between the repeats: what the valve does, modelled
///   or not, cancels. A disturbance that does not repeat counts as noise.
/// - Otherwise from what remains about a line where the command rests.
/// - Otherwise from first and second differences of `residual`, as if its fast part were noise that a first-order
///   filter coloured.
pub fn noise_floor(starts: &[usize], command: &[f64], measured: &[f64], residual: &[f64]) -> Noise {
    use NoiseMethod::{Differences, QuietStretches, RepeatedCommand};
    let estimates = [
        (repeats(starts, command, measured), RepeatedCommand),
        (rests(starts, command, measured, residual), QuietStretches),
        (Some(differences(starts, residual)), Differences),
    ];
    // A rest in which a coarse sensor shows one value says nothing.
    let found = estimates
        .into_iter()
        .find_map(|(variance, method)| variance.filter(|&v| v > 0.0).map(|v| (v, method)));
    let (variance, method) = found.unwrap_or((0.0, Differences));
    Noise {
        value: variance.sqrt(),
        method,
    }
}

/// Half the variance of the differences between repeats.
fn repeats(starts: &[usize], command: &[f64], measured: &[f64]) -> Option<f64> {
    let unit = SAME * range(command);
    if unit == 0.0 {
        return None;
    }
    let keys: Vec<i64> = command.iter().map(|u| (u / unit).round() as i64).collect();
    let mut record = vec![0; keys.len()];
    for (i, rows) in stretches(&keys, starts).iter().enumerate() {
        record[starts[i]..starts[i] + rows.len()].fill(i);
    }
    let candidates = distances(&keys, &record);
    let differences = candidates
        .into_iter()
        .map(|distance| differences_at(distance, &keys, &record, starts, measured))
        .max_by_key(Vec::len)?;
    (differences.len() >= FEWEST[0]).then(|| middle_square(&differences) / 2.0)
}

/// Distances in rows at which the moving command is most often the same.
fn distances(keys: &[i64], record: &[usize]) -> Vec<usize> {
    let mut last: HashMap<&[i64], usize> = HashMap::new();
    let mut votes: HashMap<usize, usize> = HashMap::new();
    for (k, window) in keys.windows(ALIKE).enumerate() {
        let moves = window.iter().any(|key| *key != window[0]);
        if moves
            && record[k] == record[k + ALIKE - 1]
            && let Some(before) = last.insert(window, k)
        {
            *votes.entry(k - before).or_default() += 1;
        }
    }
    let mut votes: Vec<(usize, usize)> = votes.into_iter().collect();
    votes.sort_by_key(|&(distance, votes)| (std::cmp::Reverse(votes), distance));
    votes
        .into_iter()
        .take(DISTANCES)
        .map(|(distance, _)| distance)
        .collect()
}

/// What differs between rows this far apart, where the command is the same for at least two repeats in a record, or
/// from the beginnings of two records on.
fn differences_at(
    distance: usize,
    keys: &[i64],
    record: &[usize],
    starts: &[usize],
    measured: &[f64],
) -> Vec<f64> {
    let pairs = keys.len() - distance;
    let place = |k: usize| (record[k], record[k + distance]);
    let mut differences = Vec::new();
    let mut first = 0;
    while first < pairs {
        let same = |k: &usize| keys[*k] == keys[*k + distance] && place(*k) == place(first);
        let run = (first..pairs).take_while(same).count();
        let (one, other) = place(first);
        let long = if one == other {
            run >= distance
        } else {
            first == starts[one] && first + distance == starts[other]
        };
        if long && run >= ALIKE {
            // What went before differs, and must have died out.
            let settled = first + run / SETTLING..first + run;
            let change: Vec<f64> = settled
                .map(|k| measured[k + distance] - measured[k])
                .collect();
            differences.extend(detrended(&change));
        }
        first += run.max(1);
    }
    differences
}

/// The variance about a line in the rests of the command: the middle one, each counted by its rows.
fn rests(starts: &[usize], command: &[f64], measured: &[f64], residual: &[f64]) -> Option<f64> {
    let reach = range(command);
    STILL.iter().find_map(|still| {
        let mut quiet: Vec<Vec<f64>> = Vec::new();
        for (start, record) in starts.iter().zip(stretches(command, starts)) {
            let (share, least, most) = REST;
            let shortest = (record.len() / share).clamp(least, most);
            for rest in resting(record, still * reach) {
                if rest.len() < shortest {
                    continue;
                }
                let quarters = record[rest.clone()].chunks_exact(rest.len() / 4).map(mean);
                if range(&quarters.collect::<Vec<f64>>()) > MOVEMENT * reach {
                    continue;
                }
                let settled = start + rest.start + rest.len() / SETTLING..start + rest.end;
                // A right simulation takes most of the settling out of the residual; a wrong one adds to it.
                let ends =
                    [measured, residual].map(|values| settled_end(&values[settled.clone()], least));
                quiet.extend(
                    ends.into_iter()
                        .flatten()
                        .min_by(|a, b| mean_square(a).total_cmp(&mean_square(b))),
                );
            }
        }
        let rows: usize = quiet.iter().map(Vec::len).sum();
        (rows >= FEWEST[1]).then(|| typical_variance(&quiet))
    })
}

/// Runs of rows in which the command moves by at most `still`.
fn resting(command: &[f64], still: f64) -> Vec<std::ops::Range<usize>> {
    let mut rests = Vec::new();
    let mut first = 0;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (k, &u) in command.iter().enumerate() {
        (low, high) = (low.min(u), high.max(u));
        if high - low > still {
            rests.push(first..k);
            (first, low, high) = (k, u, u);
        }
    }
    rests.push(first..command.len());
    rests
}

/// The end of a rest, about a line, in which the valve no longer settles; none if that leaves fewer than `least` rows.
fn settled_end(values: &[f64], least: usize) -> Option<Vec<f64>> {
    let (early, late) = values.split_at(values.len() / 2);
    let variance = |values: &[f64]| mean_square(&detrended(values));
    if values.len() < least {
        None
    } else if variance(early) > UNSETTLED * variance(late) {
        settled_end(late, least)
    } else {
        Some(detrended(values))
    }
}

/// The middle variance of several rests, each counted by its rows.
fn typical_variance(quiet: &[Vec<f64>]) -> f64 {
    let all = quiet.concat();
    let starts = quiet.iter().scan(0, |end, rest| {
        let start = *end;
        *end += rest.len();
        Some(start)
    });
    // The line takes two degrees of freedom, each worth as many rows as depend on one another.
    let taken = 2.0 * coloured(&all, &starts.collect::<Vec<_>>());
    let mut variances: Vec<(f64, usize)> = quiet
        .iter()
        .map(|rest| {
            let rows = rest.len() as f64;
            let free = (rows - taken).max(rows / 2.0);
            (mean_square(rest) * rows / free, rest.len())
        })
        .collect();
    variances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = all.len() / 2;
    let middle = variances.iter().find(|(_, rows)| {
        let here = left < *rows;
        left = left.saturating_sub(*rows);
        here
    });
    middle.map_or(0.0, |(variance, _)| *variance)
}

/// The variance of noise that a first-order filter coloured, with correlation ρ of neighbouring rows: first differences
/// have 2 (1 − ρ) times its variance, second ones 2 (1 − ρ)(3 − ρ) times; smooth signals hardly have any.
fn differences(starts: &[usize], values: &[f64]) -> f64 {
    let records = stretches(values, starts);
    let first = records
        .iter()
        .flat_map(|record| record.windows(2))
        .map(|w| w[1] - w[0]);
    let second = records.iter().flat_map(|record| record.windows(3));
    let second = second.map(|w| w[0] - 2.0 * w[1] + w[2]);
    let first = middle_square(&first.collect::<Vec<f64>>());
    let second = middle_square(&second.collect::<Vec<f64>>());
    if first == 0.0 {
        return 0.0;
    }
    let correlation = (3.0 - second / first).clamp(0.0, MAX_CORRELATION);
    first / (2.0 * (1.0 - correlation))
}

/// The mean square, by vote of a few blocks: one in which something else happened does not count.
fn middle_square(values: &[f64]) -> f64 {
    let votes = (values.len() / BLOCK).clamp(1, VOTES);
    let length = (values.len() / votes).max(1);
    let mut squares: Vec<f64> = values.chunks_exact(length).map(mean_square).collect();
    squares.sort_by(f64::total_cmp);
    squares.get(squares.len() / 2).copied().unwrap_or(0.0)
}

fn range(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
    high - low
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

/// What is left of `values` about a straight line.
fn detrended(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = mean(values);
    let along = values
        .iter()
        .enumerate()
        .map(|(i, v)| (i as f64 - middle) * (v - mean))
        .sum::<f64>();
    let slope = along / (n * (n * n - 1.0) / 12.0).max(1.0);
    let left = |(i, v): (usize, &f64)| v - mean - slope * (i as f64 - middle);
    values.iter().enumerate().map(left).collect()
}

#[cfg(test)]
mod tests {
    use super::NoiseMethod::{Differences, QuietStretches, RepeatedCommand};
    use super::*;
    use crate::diagnose::statistics::simulated::{command, filtered, white};

    /// Largest and mean relative error of the noise floor over seeds.
    fn errors(
        command: &[f64],
        corner: Option<f64>,
        method: NoiseMethod,
        structure: impl Fn(usize) -> f64,
    ) -> (f64, f64) {
        let response = filtered(command, 20.0);
        let errors: Vec<f64> = (0..40)
            .map(|seed| {
                let white = white(command.len(), seed);
                let noise = corner.map_or(white.clone(), |corner| filtered(&white, corner));
                let rows = 0..command.len();
                let measured = rows
                    .clone()
                    .map(|k| response[k] + 0.03 * noise[k] + 1e-5 * k as f64);
                let residual: Vec<f64> = rows.map(|k| 0.03 * noise[k] + structure(k)).collect();
                let found = noise_floor(&[0], command, &measured.collect::<Vec<_>>(), &residual);
                assert_eq!(found.method, method);
                found.value / 0.03 - 1.0
            })
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let square = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64;
        println!(
            "{method:?} {} rows {corner:?}: mean {:+.1} %, deviation {:.1} %",
            command.len(),
            100.0 * mean,
            100.0 * square.sqrt()
        );
        (mean, square.sqrt())
    }

    /// A model that is wrong by a fifth of the signal.
    fn wrong(command: &[f64]) -> impl Fn(usize) -> f64 {
        let response = filtered(command, 20.0);
        move |k| 0.2 * response[k]
    }

    #[test]
    fn the_middle_rest_counts_by_its_rows() {
        let rest = |size: f64, rows: usize, seed: u64| -> Vec<f64> {
            white(rows, seed).iter().map(|e| size * e).collect()
        };
        for (rows, expected) in [
            ([2000, 300, 300], 1.0),
            ([300, 2000, 300], 4.0),
            ([300, 300, 2000], 9.0),
            ([700, 600, 700], 4.0),
        ] {
            let [a, b, c] = rows;
            let quiet = [rest(3.0, c, 1), rest(1.0, a, 2), rest(2.0, b, 3)];
            let found = typical_variance(&quiet);
            assert!((found / expected - 1.0).abs() < 0.2, "{rows:?}: {found}");
        }
        assert_eq!(typical_variance(&[]), 0.0);
    }

    #[test]
    fn quiet_stretches_show_the_noise() {
        for count in [3500, 6998] {
            let command = command(count);
            let (mean, deviation) = errors(&command, None, QuietStretches, wrong(&command));
            assert!(mean.abs() < 0.05 && deviation < 0.05);
            let (mean, deviation) = errors(&command, Some(20.0), QuietStretches, wrong(&command));
            assert!(mean.abs() < 0.10 && deviation < 0.15);
        }
    }

    #[test]
    fn a_rest_of_a_quarter_second_counts() {
        let mut command: Vec<f64> = (0..6000).map(|k| 8.0 * (k as f64 * 0.0123).sin()).collect();
        for start in [900, 2700, 4500] {
            let level = command[start];
            command[start..start + 250].fill(level);
        }
        let (mean, deviation) = errors(&command, None, QuietStretches, wrong(&command));
        assert!(mean.abs() < 0.05 && deviation < 0.06);
    }

    #[test]
    fn a_slow_ramp_is_no_rest() {
        let ramp: Vec<f64> = (0..8000)
            .map(|k| (k as f64 * 1e-3).min(16.0 - k as f64 * 1e-3))
            .collect();
        errors(&ramp, None, Differences, |_| 0.0);
    }

    #[test]
    fn two_records_of_one_command_are_repeats() {
        let once = |k: usize| 6.0 * (k as f64 * 0.011).sin() + (k as f64 * 0.037).sin();
        let command: Vec<f64> = (0..4000).map(|k| once(k % 2000)).collect();
        let noise = white(4000, 1);
        let response = filtered(&command[..2000], 20.0);
        let measured: Vec<f64> = (0..4000)
            .map(|k| response[k % 2000] + 0.03 * noise[k])
            .collect();
        let residual: Vec<f64> = (0..4000)
            .map(|k| 0.2 * response[k % 2000] + 0.03 * noise[k])
            .collect();
        let found = noise_floor(&[0, 2000], &command, &measured, &residual);
        assert_eq!(found.method, RepeatedCommand);
        assert!((found.value / 0.03 - 1.0).abs() < 0.05, "{}", found.value);
    }

    #[test]
    fn repeats_show_the_noise_whatever_the_model_misses() {
        let period = |k: usize| 6.0 * ((k % 1500) as f64 / 1500.0 * std::f64::consts::TAU).sin();
        let command: Vec<f64> = (0..500).map(|_| 0.0).chain((0..4500).map(period)).collect();
        let missed = wrong(&command);
        let (mean, deviation) = errors(&command, None, RepeatedCommand, &missed);
        assert!(mean.abs() < 0.05 && deviation < 0.05);
        let (mean, deviation) = errors(&command, Some(20.0), RepeatedCommand, &missed);
        assert!(mean.abs() < 0.15 && deviation < 0.15);
    }

    #[test]
    fn without_quiet_the_differences_of_the_residual_show_it() {
        let command: Vec<f64> = (0..8000)
            .map(|k| (1e-6 * (k * k) as f64).sin() * 9.0)
            .collect();
        let slow = |k: usize| 0.1 * (k as f64 * 0.02).sin();
        let (mean, deviation) = errors(&command, None, Differences, slow);
        assert!(mean.abs() < 0.05 && deviation < 0.05);
        let (mean, deviation) = errors(&command, Some(20.0), Differences, slow);
        assert!(mean.abs() < 0.25 && deviation < 0.25);
    }
}
