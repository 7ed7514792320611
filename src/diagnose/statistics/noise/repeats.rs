//! Noise from the differences between repeats of the command.

use super::moments::{detrended, independent, middle_square, range};
use crate::diagnose::statistics::rows::stretches;
use std::collections::HashMap;

/// Two commands are the same if they differ by less than this fraction of the command's range.
const SAME: f64 = 1e-6;
/// Consecutive rows that must be the same before a repeat is suspected.
const ALIKE: usize = 32;
/// Distances that are looked at for repeats.
const DISTANCES: usize = 4;
/// Fewest rows for a noise floor.
const FEWEST: usize = 200;
/// Most votes on the mean square of differences: a few long blocks know the variance of coloured noise better than many short ones.
const VOTES: usize = 9;
/// One over the share of a repeat in which the valve settles.
const SETTLING: usize = 4;

/// Half the variance of the differences between repeats, and how many independent rows show it.
pub(super) fn variance(starts: &[usize], command: &[f64], residual: &[f64]) -> Option<(f64, f64)> {
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
        .map(|distance| differences_at(distance, &keys, &record, starts, residual))
        .max_by_key(Vec::len)?;
    (differences.len() >= FEWEST).then(|| {
        let variance = middle_square(&differences, VOTES) / 2.0;
        (variance, independent(&differences, &[0]))
    })
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
    residual: &[f64],
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
                .map(|k| residual[k + distance] - residual[k])
                .collect();
            differences.extend(detrended(&change));
        }
        first += run.max(1);
    }
    differences
}
