//! A figure that was read off a measurement, and how sure it is.

use crate::card::construction::CycleFigures;
use crate::search::polish::student_t;
use serde::Serialize;

/// A figure read off the measured curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reading {
    /// Its value, in the unit of the figure.
    pub value: f64,
    /// Lower end of its 95 % interval: repeatability or scatter, and the sensors' accuracy where it was given.
    pub low: f64,
    /// Upper end of its 95 % interval.
    pub high: f64,
    /// By which test it was measured.
    pub test: String,
}

impl Reading {
    /// A reading with an interval of this half-width.
    pub(super) fn around(value: f64, half: f64, test: String) -> Self {
        Self {
            value,
            low: value - half,
            high: value + half,
            test,
        }
    }
}

/// The figures of every cycle, or of draws of what a single one could have been.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    pub(super) others: Vec<CycleFigures>,
    /// Half-widths of the 95 % interval in a standard deviation.
    pub(super) factor: f64,
}

impl Spread {
    /// Half the width of the 95 % interval of a figure; not a number where fewer than two have it.
    pub(super) fn half_width(&self, figure: impl Fn(&CycleFigures) -> Option<f64>) -> f64 {
        let values: Vec<f64> = self.others.iter().filter_map(figure).collect();
        self.factor * deviation(&values)
    }
}

/// The standard deviation of `values`; not a number for fewer than two.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|value| (value - mean).powi(2));
    (squares.sum::<f64>() / (count - 1.0)).sqrt()
}

/// Half the width of the 95 % interval of the mean of so many repetitions, in their standard deviation.
pub(super) fn student_half(count: usize) -> f64 {
    let freedom = count.saturating_sub(1) as f64;
    student_t(freedom) / (count as f64).sqrt()
}

/// A number to three digits, as short as that allows.
pub(super) fn short(value: f64) -> String {
    let digits = 2.0 - value.abs().max(1e-3).log10().floor();
    let text = format!("{value:.*}", digits.max(0.0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
