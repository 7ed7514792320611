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

/// From so many cycles on repeatability says how sure a figure is.
const SEVERAL: usize = 3;

/// What else the figures of a curve could have been.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    /// Those of draws with as much scatter again as the curve has.
    pub(super) draws: Vec<CycleFigures>,
    /// Those of each cycle.
    pub(super) cycles: Vec<CycleFigures>,
}

impl Spread {
    /// By how much the largest of many noisy values is too large: it grows with the deviation of the noise, and the draws have √2
    /// times that of the curve, which has `value`.
    pub(super) fn excess(&self, value: f64, figure: impl Fn(&CycleFigures) -> Option<f64>) -> f64 {
        let beyond = self.drawn(figure) - value;
        (beyond / (2f64.sqrt() - 1.0)).clamp(0.0, value.abs())
    }

    /// The mean of the draws.
    fn drawn(&self, figure: impl Fn(&CycleFigures) -> Option<f64>) -> f64 {
        let drawn: Vec<f64> = self.draws.iter().filter_map(figure).collect();
        drawn.iter().sum::<f64>() / drawn.len() as f64
    }

    /// Half the width of the 95 % interval of a figure that is `value`, from the scatter along the curve, and from repeatability
    /// if that says more; not a number where fewer than two draws have it. An excess that was taken away may be wrong by itself.
    pub(super) fn half_width(
        &self,
        value: f64,
        figure: impl Fn(&CycleFigures) -> Option<f64> + Copy,
    ) -> f64 {
        let of = |all: &[CycleFigures]| all.iter().filter_map(figure).collect::<Vec<f64>>();
        let excess = (self.drawn(figure) - value).max(0.0) / 2f64.sqrt();
        let scatter = f64::hypot(1.96 * deviation(&of(&self.draws)), excess);
        let repeated = of(&self.cycles);
        match repeated.len() >= SEVERAL {
            true => scatter.max(student_half(repeated.len()) * deviation(&repeated)),
            false => scatter,
        }
    }
}

/// The median of `values`, of which there is one at least; of two in the middle, their mean.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() % 2 {
        1 => values[half],
        _ => 0.5 * (values[half - 1] + values[half]),
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

/// The mean of repetitions, and half of its 95 % interval: from less than three of them `floor`, that of each.
pub(super) fn repeated(values: &[f64], floor: f64) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let half = match values.len() {
        0..3 => floor,
        several => (student_half(several) * deviation(values)).max(floor / (several as f64).sqrt()),
    };
    (mean, half)
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
