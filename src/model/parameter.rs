//! A model parameter and the space that a search moves in.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How a parameter's range is measured: a step of a tenth of the range is additive or multiplicative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Distances are differences.
    Linear,
    /// Distances are ratios. Both bounds must be positive.
    Log,
}

/// How a parameter sets the pace of a model: the length of integration steps follows from the fastest inside the bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// It is a rate, 1/s.
    Rate,
    /// It is a time constant, s.
    TimeConstant,
    /// It is a frequency, Hz.
    Frequency,
}

/// One parameter: its name, unit, bounds (inclusive) and start value, all in `unit`.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name as in the model file and the report, such as `gain`.
    pub name: String,
    /// Unit as printed, such as `1/s`; `1` for a pure number.
    pub unit: String,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Value to start from, or to keep where the parameter is fixed.
    pub start: f64,
    /// How its range is measured.
    pub scale: Scale,
    /// Fixed parameters keep `start` and are not searched.
    pub fixed: bool,
    /// How integration steps have to follow it, if they have to.
    pub pace: Option<Pace>,
}

impl Parameter {
    /// A free parameter on a linear scale.
    pub fn linear(name: &str, unit: &str, low: f64, start: f64, high: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            low,
            high,
            start,
            scale: Scale::Linear,
            fixed: false,
            pace: None,
        }
    }

    /// A free parameter on a logarithmic scale; `low` must be positive.
    pub fn log(name: &str, unit: &str, low: f64, start: f64, high: f64) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(name, unit, low, start, high)
        }
    }

    /// The same parameter, kept at its start value.
    pub fn fixed(self) -> Self {
        Self {
            fixed: true,
            ..self
        }
    }

    /// The same parameter, to be followed by integration steps.
    pub fn paced(self, pace: Pace) -> Self {
        Self {
            pace: Some(pace),
            ..self
        }
    }

    /// The fastest rate (1/s) inside the bounds, where integration steps have to follow it.
    pub fn fastest_rate(&self) -> Option<f64> {
        Some(match self.pace? {
            Pace::Rate => self.high,
            Pace::TimeConstant => 1.0 / self.low.max(0.0),
            Pace::Frequency => TAU * self.high,
        })
    }

    /// Where `value` lies in the range: 0 at `low`, 1 at `high`.
    pub fn to_unit(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    /// The value at `unit` of the range, clamped to the bounds.
    pub fn from_unit(&self, unit: f64) -> f64 {
        let value = match self.scale {
            Scale::Linear => self.low + unit * (self.high - self.low),
            Scale::Log => self.low * (unit * (self.high / self.low).ln()).exp(),
        };
        self.clamp(value)
    }

    /// The value nearest to `value` inside the bounds.
    pub fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.low, self.high)
    }
}
