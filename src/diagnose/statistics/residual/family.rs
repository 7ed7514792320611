//! One decision over many statistics.

use std::f64::consts::PI;

/// Euler's constant.
const EULER: f64 = 0.577_215_664_901_532_9;

/// One sign of structure.
pub(super) struct Sign {
    pub(super) name: String,
    /// Correlation coefficient.
    pub(super) strength: f64,
    /// Chance of it in its family of tests.
    pub(super) p_value: f64,
}

/// The joint null distribution of several statistics.
pub(super) struct Family {
    /// Mean and standard deviation of each.
    moments: Vec<(f64, f64)>,
    /// Location and scale of the largest, each in units of its own deviation from its own mean.
    largest: (f64, f64),
}

impl Family {
    /// From rows of statistics, one row a surrogate.
    ///
    /// Every surrogate is measured by the moments of the others, as the observed statistics are: measured by its own,
    /// it could not stand out as far.
    pub(super) fn new(null: &[Vec<f64>]) -> Self {
        let statistics = 0..null[0].len();
        let columns: Vec<Vec<f64>> = statistics
            .map(|i| null.iter().map(|row| row[i]).collect())
            .collect();
        let all: Vec<(f64, f64)> = columns.iter().map(|column| moments(column)).collect();
        let most: Vec<f64> = (0..null.len())
            .map(|row| {
                let each = columns.iter().zip(&all).map(|(column, &all)| {
                    standing(column[row], without(all, column[row], null.len() as f64))
                });
                each.fold(f64::NEG_INFINITY, f64::max)
            })
            .collect();
        let (mean, deviation) = moments(&most);
        let scale = deviation * 6f64.sqrt() / PI;
        Self {
            moments: all,
            largest: (mean - EULER * scale, scale),
        }
    }

    /// What statistic `i` is by chance.
    pub(super) fn mean(&self, i: usize) -> f64 {
        self.moments[i].0
    }

    /// The chance that the largest of all statistics stands out as far as each of `found`.
    pub(super) fn p_values(&self, found: &[f64]) -> Vec<f64> {
        let (location, scale) = self.largest;
        found
            .iter()
            .zip(&self.moments)
            .map(|(&value, &moments)| {
                let beyond = (standing(value, moments) - location) / scale;
                // 1 − exp(−exp(−x)), also where it is small.
                -(-(-beyond).exp()).exp_m1()
            })
            .collect()
    }
}

fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, square.sqrt())
}

/// The moments of `count` values without one of them.
fn without((mean, deviation): (f64, f64), value: f64, count: f64) -> (f64, f64) {
    let off = value - mean;
    let squares = deviation * deviation * (count - 1.0) - off * off * count / (count - 1.0);
    (
        mean - off / (count - 1.0),
        (squares / (count - 2.0)).max(0.0).sqrt(),
    )
}

/// How many deviations a value is above its mean; a statistic that never varies says nothing.
fn standing(value: f64, (mean, deviation): (f64, f64)) -> f64 {
    if deviation > 0.0 {
        (value - mean) / deviation
    } else {
        0.0
    }
}
