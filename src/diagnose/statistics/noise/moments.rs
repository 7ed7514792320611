//! Means, squares and trends of stretches of rows.

use crate::diagnose::statistics::rows::coloured;
use crate::record::ends;

/// Least rows in a block whose variance is one vote.
const BLOCK: usize = 128;

/// How many independent rows say as much of a variance as `values`.
pub(super) fn independent(values: &[f64], starts: &[usize]) -> f64 {
    (values.len() as f64 / coloured(values, starts)).max(1.0)
}

/// The mean square, by vote of so many blocks at `most`: one in which something else happened does not count.
pub(super) fn middle_square(values: &[f64], most: usize) -> f64 {
    let votes = (values.len() / BLOCK).clamp(1, most);
    let length = (values.len() / votes).max(1);
    let mut squares: Vec<f64> = values.chunks_exact(length).map(mean_square).collect();
    squares.sort_by(f64::total_cmp);
    squares.get(squares.len() / 2).copied().unwrap_or(0.0)
}

pub(super) fn range(values: &[f64]) -> f64 {
    let (low, high) = ends(values);
    high - low
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

pub(super) fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

/// What is left of `values` about a straight line.
pub(super) fn detrended(values: &[f64]) -> Vec<f64> {
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
