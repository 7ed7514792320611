//! Axes: their range, and values that are easy to read.

use crate::report::Edition;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Quantity and unit.
    pub(super) label: String,
    low: f64,
    high: f64,
    spacing: Spacing,
    /// What values are multiplied by where they are told.
    factor: f64,
    /// No value nearer than this to the low end gets a label, as a share of the axis.
    clear: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Spacing {
    Linear,
    /// Distances are ratios.
    Log,
    /// One name at each whole number from 0 upwards, from the top to the bottom.
    Names(Vec<String>),
}

/// What is left free beside the data, as a share of its range.
const MARGIN: f64 = 0.04;
/// Half the height of a label, as a share of an upright axis.
const CORNER: f64 = 0.03;

impl Axis {
    /// Over all finite `values`.
    pub(super) fn over(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = extent(values, |_| true);
        let margin = MARGIN * (high - low);
        Self::from_to(label, low - margin, high + margin)
    }

    /// From `low` to `high`.
    pub(super) fn from_to(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            label: label.into(),
            low,
            high,
            spacing: Spacing::Linear,
            factor: 1.0,
            clear: 0.0,
        }
    }

    /// Logarithmic, over all positive `values`.
    pub(super) fn log(label: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = extent(values.into_iter().map(f64::log10), |v| v.is_finite());
        // A range below a decade has hardly a tick.
        let widen = ((1.0 - (high - low)) / 2.0).max(MARGIN * (high - low));
        Self {
            label: label.into(),
            low: low - widen,
            high: high + widen,
            spacing: Spacing::Log,
            factor: 1.0,
            clear: 0.0,
        }
    }

    /// One row for each of `names`, the first on top.
    pub(super) fn names(label: impl Into<String>, names: Vec<String>) -> Self {
        Self {
            label: label.into(),
            low: -0.6,
            high: names.len() as f64 - 0.4,
            spacing: Spacing::Names(names),
            factor: 1.0,
            clear: 0.0,
        }
    }

    /// Where `value` lies: 0 at the left or the bottom, 1 at the right or on top.
    pub(super) fn share(&self, value: f64) -> f64 {
        let at = match self.spacing {
            Spacing::Linear => value,
            Spacing::Log => value.log10(),
            Spacing::Names(_) => self.high + self.low - value,
        };
        (at - self.low) / (self.high - self.low)
    }

    /// Whether `value` lies on the axis.
    pub(super) fn holds(&self, value: f64) -> bool {
        (-1e-9..=1.0 + 1e-9).contains(&self.share(value))
    }

    /// Its lowest and its highest value.
    pub(super) fn ends(&self) -> (f64, f64) {
        match self.spacing {
            Spacing::Log => (10f64.powf(self.low), 10f64.powf(self.high)),
            _ => (self.low, self.high),
        }
    }

    /// The nearest value on the axis.
    pub(super) fn clamped(&self, value: f64) -> f64 {
        let (low, high) = self.ends();
        value.clamp(low, high)
    }

    /// The same axis with its words and the values beside it as this `edition` has them.
    pub(super) fn told(&self, edition: &Edition) -> Self {
        let mut told = self.clone();
        let bracketed = self.label.rsplit_once('[');
        if let Some((name, unit)) =
            bracketed.and_then(|(name, rest)| Some((name, rest.strip_suffix(']')?)))
        {
            let (unit, factor) = edition.units.of(unit);
            told.label = format!("{name}[{unit}]");
            told.factor = factor;
        }
        told.label = edition.language.text(&told.label);
        if let Spacing::Names(names) = &mut told.spacing {
            let words = names.iter().map(|name| edition.language.text(name));
            *names = words.collect();
        }
        told
    }

    /// The same axis upright: its lowest label leaves room for the first one of the axis below.
    pub(super) fn upright(&self) -> Self {
        Self {
            clear: CORNER,
            ..self.clone()
        }
    }

    /// Values that get a label, about `count` of them.
    fn ticks(&self, count: usize) -> Vec<f64> {
        let factor = self.factor;
        let (low, high) = match self.spacing {
            Spacing::Log => (self.low + factor.log10(), self.high + factor.log10()),
            _ => (factor * self.low, factor * self.high),
        };
        let told = Self {
            low,
            high,
            factor: 1.0,
            ..self.clone()
        };
        let ticks = told.round_values(count).into_iter();
        let ticks = ticks.map(|value| value / factor);
        ticks
            .filter(|value| self.share(*value) >= self.clear)
            .collect()
    }

    /// Values that are short to write, about `count` of them.
    fn round_values(&self, count: usize) -> Vec<f64> {
        let range = self.high - self.low;
        let least = range / count.max(2) as f64;
        match &self.spacing {
            Spacing::Names(names) => (0..names.len()).map(|i| i as f64).collect(),
            Spacing::Linear => {
                let ticks = self.multiples(step(least));
                // One or two say too little of the scale.
                match ticks.len() {
                    0..3 => self.multiples(step(least / 1.6)),
                    _ => ticks,
                }
            }
            Spacing::Log if range > 2.0 => {
                let decades = self.multiples(least.ceil());
                decades.into_iter().map(|at| 10f64.powf(at)).collect()
            }
            Spacing::Log => {
                let decades = self.low.floor() as i32..=self.high.ceil() as i32;
                let all = decades.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
                all.filter(|value| self.holds(*value)).collect()
            }
        }
    }

    /// The multiples of `step` on the paper.
    fn multiples(&self, step: f64) -> Vec<f64> {
        let (first, last) = (
            (self.low / step).ceil() as i64,
            (self.high / step).floor() as i64,
        );
        (first..=last).map(|i| i as f64 * step).collect()
    }

    /// The label of a value.
    fn tick(&self, value: f64) -> String {
        let largest = self.factor * self.high.abs().max(self.low.abs());
        let told = self.factor * value;
        match &self.spacing {
            Spacing::Names(names) => names.get(value as usize).cloned().unwrap_or_default(),
            Spacing::Linear => plain(told, largest),
            Spacing::Log => plain(told, told),
        }
    }

    /// Pixels that the labels of a vertical axis and its name take, with letters `text` pixels high.
    pub(super) fn room(&self, text: u32) -> u32 {
        let ticks = self.ticks(6);
        let longest = ticks.iter().map(|at| self.tick(*at).chars().count());
        let letters = longest.max().unwrap_or(0) as u32;
        let name = if self.label.is_empty() { 12 } else { 34 };
        letters * text * 54 / 100 + name
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.share(*value) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match hint.weight().allow_light_points() {
            true => Vec::new(),
            false => self.ticks(hint.max_num_points()),
        }
    }

    fn range(&self) -> Range<f64> {
        let (low, high) = self.ends();
        low..high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.tick(*value)
    }
}

/// Smallest and largest of the finite `values` that `counts`; around one value, and 0 to 1 without any.
fn extent(values: impl IntoIterator<Item = f64>, counts: impl Fn(f64) -> bool) -> (f64, f64) {
    let finite = values.into_iter().filter(|v| v.is_finite() && counts(*v));
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        (0.0, 1.0)
    } else if high - low <= 1e-9 * high.abs() {
        let around = if high == 0.0 { 1.0 } else { 0.1 * high.abs() };
        (low - around, high + around)
    } else {
        (low, high)
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that is not below `least`.
fn step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let enough = factors
        .into_iter()
        .find(|f| f * decade >= least * (1.0 - 1e-9));
    enough.unwrap_or(10.0) * decade
}

/// `value` without digits that rounding made, on an axis that reaches to `largest`.
fn plain(value: f64, largest: f64) -> String {
    if value.abs() < 1e-9 * largest {
        return "0".into();
    }
    let text = if !(1e-3..1e5).contains(&largest) {
        let text = format!("{value:.3e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = match digits.contains('.') {
            true => digits.trim_end_matches('0').trim_end_matches('.'),
            false => digits,
        };
        format!("{digits}e{power}")
    } else {
        let text = format!("{value:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, count: usize) -> Vec<String> {
        axis.ticks(count).iter().map(|at| axis.tick(*at)).collect()
    }

    #[test]
    fn the_lowest_label_of_an_upright_axis_leaves_the_corner_free() {
        let axis = Axis::from_to("flow [L/min]", -0.151, 0.3);
        assert_eq!(axis.upright().ticks(4), axis.ticks(4));
        let near = Axis::from_to("flow [L/min]", -0.21, 0.61);
        assert_eq!(near.ticks(5).len(), 5);
        assert_eq!(near.upright().ticks(5).len(), 4);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::over("x", [-0.31, 0.28]);
        assert_eq!(labels(&axis, 3), ["\u{2212}0.2", "0", "0.2"]);
        let axis = Axis::over("x", [0.0, 4.2e-6]);
        assert_eq!(labels(&axis, 4), ["0", "2e\u{2212}6", "4e\u{2212}6"]);
        let axis = Axis::log("x", [0.9, 1100.0]);
        assert_eq!(labels(&axis, 8), ["1", "10", "100", "1000"]);
        let axis = Axis::log("x", [3.0, 4.0]);
        assert_eq!(labels(&axis, 8), ["2", "5", "10"]);
        let axis = Axis::names("x", vec!["one".into(), "two".into()]);
        assert_eq!(labels(&axis, 8), ["one", "two"]);
    }

    #[test]
    fn an_axis_is_told_in_other_units_by_round_values_of_those() {
        let us = Edition {
            units: "us".parse().unwrap(),
            ..Edition::default()
        };
        let metric = Axis::over("flow [L/min]", [-60.0, 60.0]);
        let axis = metric.told(&us);
        assert_eq!(axis.label, "flow [gpm]");
        assert_eq!(labels(&axis, 3), ["\u{2212}10", "0", "10"]);
        let place = 0.5 * (1.0 + 10.0 * 3.785_411_784 / 64.8);
        assert!((axis.share(axis.ticks(3)[2]) - place).abs() < 1e-9);
        let axis = Axis::log("noise [bar/√Hz]", [0.01, 10.0]).told(&us);
        assert_eq!(axis.label, "noise [psi/√Hz]");
        assert_eq!(labels(&axis, 8), ["1", "10", "100"]);
        assert_eq!(
            Axis::over("time [s]", [0.0, 1.0]).told(&us).label,
            "time [s]"
        );
        assert_eq!(metric.told(&Edition::default()), metric);
    }

    #[test]
    fn no_values_and_equal_values_make_an_axis_too() {
        for values in [vec![], vec![f64::NAN], vec![5.0, 5.0], vec![0.0]] {
            for axis in [Axis::over("x", values.clone()), Axis::log("x", values)] {
                assert!(
                    axis.ends().0.is_finite() && axis.ends().1 > axis.ends().0,
                    "{axis:?}"
                );
                assert!(axis.ticks(5).len() > 1, "{axis:?}");
            }
        }
    }
}
