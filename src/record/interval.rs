//! Intervals between times.

/// The usual interval between `times`, of which there are two at least.
pub(crate) fn median_interval(times: &[f64]) -> f64 {
    median(&intervals(times))
}

pub(super) fn intervals(time: &[f64]) -> Vec<f64> {
    time.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// The upper median of `values`, of which there is one at least.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
