//! Rows of several records, one record after another.

use crate::search::polish::autocorrelation_inflation;

/// Long-run variance of the residual over its variance, about its mean: how many of its rows carry the information of
/// one independent row.
pub fn coloured(residual: &[f64], starts: &[usize]) -> f64 {
    let mean = residual.iter().sum::<f64>() / residual.len().max(1) as f64;
    let centred: Vec<f64> = residual.iter().map(|value| value - mean).collect();
    autocorrelation_inflation(&stretches(&centred, starts))
}

/// The runs of consecutive rows in `values`.
pub(in crate::diagnose) fn stretches<'a, T>(values: &'a [T], starts: &[usize]) -> Vec<&'a [T]> {
    let count = values.len();
    let ends = starts.iter().skip(1).chain(Some(&count));
    starts
        .iter()
        .zip(ends)
        .map(|(&start, &end)| &values[start..end])
        .collect()
}

/// Change over time, from the row before to the row after, within each record.
pub(in crate::diagnose) fn rate(values: &[f64], time: &[f64], starts: &[usize]) -> Vec<f64> {
    let records = stretches(values, starts)
        .into_iter()
        .zip(stretches(time, starts));
    let one = |(values, time): (&[f64], &[f64])| -> Vec<f64> {
        let last = values.len() - 1;
        (0..values.len())
            .map(|k| {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
                let seconds = time[after] - time[before];
                if seconds > 0.0 {
                    (values[after] - values[before]) / seconds
                } else {
                    0.0
                }
            })
            .collect()
    };
    records.flat_map(one).collect()
}

/// With mean 0 and sum of squares 1; all zero for a constant.
pub(super) fn standardised(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let norm = values
        .iter()
        .map(|v| (v - mean).powi(2))
        .sum::<f64>()
        .sqrt();
    // What rounding leaves of a constant is nothing.
    let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let scale = if norm > 1e-12 * largest {
        1.0 / norm
    } else {
        0.0
    };
    values.iter().map(|v| (v - mean) * scale).collect()
}
