//! Noise from what is left where the command rests.

use super::moments::{detrended, independent, mean, mean_square, range};
use crate::diagnose::statistics::rows::{coloured, stretches};
use std::ops::Range;

/// Fewest rows for a noise floor.
const FEWEST: usize = 64;
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
/// A rest drifts if it varies this many times as much about one line as about a line in each of its parts.
const DRIFTS: f64 = 1.3;
/// Fewest rows of such a part: what is faster is no drift.
const PART: usize = 200;
/// Two channels show one motion if what is left of them in rests has at least this correlation: most of each is in the other.
const TOGETHER: f64 = 0.8;

/// What is left in the rests of the command, each about a line, or about several where it drifts; `None` where too few rows rest.
pub(super) fn rests(
    starts: &[usize],
    command: &[f64],
    measured: &[f64],
    residual: &[f64],
) -> Option<Vec<Vec<f64>>> {
    STILL.iter().find_map(|still| {
        let mut quiet: Vec<Vec<f64>> = Vec::new();
        for settled in settled_rests(starts, command, *still) {
            // A right simulation takes most of the settling out of the residual; a wrong one adds to it.
            let ends = [measured, residual]
                .into_iter()
                .filter_map(|values| settled_end(&values[settled.clone()], REST.1));
            let left = ends.map(without_drift);
            quiet.extend(
                left.min_by(|a, b| mean_square(&a.concat()).total_cmp(&mean_square(&b.concat())))
                    .into_iter()
                    .flatten(),
            );
        }
        let rows: usize = quiet.iter().map(Vec::len).sum();
        (rows >= FEWEST).then_some(quiet)
    })
}

/// Whether two channels show one motion where the command rests and both have settled.
pub(super) fn moves_together(
    starts: &[usize],
    command: &[f64],
    one: &[f64],
    other: &[f64],
) -> bool {
    let rests = STILL.iter().find_map(|still| {
        let rests = settled_rests(starts, command, *still);
        (rests.iter().map(ExactSizeIterator::len).sum::<usize>() >= FEWEST).then_some(rests)
    });
    let settled = |rest: Range<usize>| {
        let [of_one, of_other] =
            [one, other].map(|values| settled_end(&values[rest.clone()], REST.1));
        Some(rest.end - of_one?.len().min(of_other?.len())..rest.end)
    };
    let rests: Vec<Range<usize>> = rests.into_iter().flatten().filter_map(settled).collect();
    let of = |values: &[f64]| -> Vec<f64> {
        let rests = rests.iter();
        rests
            .flat_map(|rest| detrended(&values[rest.clone()]))
            .collect()
    };
    let (one, other) = (of(one), of(other));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let alike = product(&one, &other);
    one.len() >= FEWEST
        && alike * alike > TOGETHER.powi(2) * product(&one, &one) * product(&other, &other)
}

/// The rests of the command that are long enough, each without the share in which the valve settles.
fn settled_rests(starts: &[usize], command: &[f64], still: f64) -> Vec<Range<usize>> {
    let reach = range(command);
    let mut settled = Vec::new();
    for (start, record) in starts.iter().zip(stretches(command, starts)) {
        let (share, least, most) = REST;
        let shortest = (record.len() / share).clamp(least, most);
        for rest in resting(record, still * reach) {
            if rest.len() < shortest {
                continue;
            }
            let quarters = record[rest.clone()].chunks_exact(rest.len() / 4).map(mean);
            if range(&quarters.collect::<Vec<f64>>()) <= MOVEMENT * reach {
                settled.push(start + rest.start + rest.len() / SETTLING..start + rest.end);
            }
        }
    }
    settled
}

/// The variance in such rests, the middle one, each counted by its rows; and how many independent rows show it.
pub(super) fn variance(quiet: &[Vec<f64>]) -> (f64, f64) {
    (
        typical_variance(quiet),
        independent(&quiet.concat(), &starts_of(quiet)),
    )
}

/// Runs of rows in which the command moves by at most `still`.
fn resting(command: &[f64], still: f64) -> Vec<Range<usize>> {
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

/// The end of a rest in which the valve no longer settles; none if that leaves fewer than `least` rows.
fn settled_end(values: &[f64], least: usize) -> Option<&[f64]> {
    let (early, late) = values.split_at(values.len() / 2);
    let variance = |values: &[f64]| mean_square(&detrended(values));
    if values.len() < least {
        None
    } else if variance(early) > UNSETTLED * variance(late) {
        settled_end(late, least)
    } else {
        Some(values)
    }
}

/// What is left of a rest about a line; about a line in each of its parts, as few as it takes, where it drifts.
fn without_drift(values: &[f64]) -> Vec<Vec<f64>> {
    let parted = |parts: usize| -> Vec<Vec<f64>> {
        let edge = |i: usize| i * values.len() / parts;
        (0..parts)
            .map(|i| detrended(&values[edge(i)..edge(i + 1)]))
            .collect()
    };
    let counts = std::iter::successors(Some(1), |parts| Some(2 * parts));
    let counts = counts.take_while(|parts| *parts == 1 || values.len() / parts >= PART);
    let ways: Vec<(usize, f64)> = counts
        .map(|parts| (parts, mean_square(&parted(parts).concat())))
        .collect();
    let least = ways.iter().map(|way| way.1).fold(f64::INFINITY, f64::min);
    let enough = ways.iter().find(|way| way.1 <= DRIFTS * least);
    parted(enough.map_or(1, |way| way.0))
}

/// Where each of several rests begins, one after another.
fn starts_of(quiet: &[Vec<f64>]) -> Vec<usize> {
    let starts = quiet.iter().scan(0, |end, rest| {
        let start = *end;
        *end += rest.len();
        Some(start)
    });
    starts.collect()
}

/// The middle variance of several rests, each counted by its rows.
pub(super) fn typical_variance(quiet: &[Vec<f64>]) -> f64 {
    let all = quiet.concat();
    // The line takes two degrees of freedom, each worth as many rows as depend on one another.
    let taken = 2.0 * coloured(&all, &starts_of(quiet));
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
