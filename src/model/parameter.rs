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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pace {
    /// It is a rate, 1/s.
    Rate,
    /// It is a time constant, s.
    TimeConstant,
    /// It is a frequency, Hz.
    Frequency,
    /// It is a delay of which an approximant of second order is simulated, s: its poles are the root of 12 over it.
    Delay,
    /// It is a lag over that of the loop, 1.
    LagRatio,
}

/// Where a parameter has its value from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Role {
    /// A fit finds it; nothing is known before but a guess.
    Free {
        /// Value to start from.
        start: f64,
    },
    /// It is known, and not searched.
    Fixed {
        /// The known value.
        value: f64,
    },
}

/// One parameter: its name, unit, bounds (inclusive) and role, all in `unit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Name as in the model file and the report, such as `gain`.
    pub name: String,
    /// Unit as printed, such as `1/s`; `1` for a pure number.
    pub unit: String,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Whether a fit finds its value, and what is known before.
    pub role: Role,
    /// How its range is measured.
    pub scale: Scale,
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
            role: Role::Free { start },
            scale: Scale::Linear,
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

    /// Whether its value is known and not searched.
    pub fn is_fixed(&self) -> bool {
        matches!(self.role, Role::Fixed { .. })
    }

    /// The value before any fit: the start of a free parameter, the value of a fixed one.
    pub fn nominal(&self) -> f64 {
        match self.role {
            Role::Free { start } => start,
            Role::Fixed { value } => value,
        }
    }

    /// Gives it another value before any fit; whether it is fixed stays.
    pub fn set_nominal(&mut self, nominal: f64) {
        match &mut self.role {
            Role::Free { start: value } | Role::Fixed { value } => *value = nominal,
        }
    }

    /// Fixes it at its nominal value, or frees it to start from there.
    pub fn set_fixed(&mut self, fixed: bool) {
        let value = self.nominal();
        self.role = match fixed {
            true => Role::Fixed { value },
            false => Role::Free { start: value },
        };
    }

    /// The same parameter, kept at its nominal value.
    pub fn fixed(mut self) -> Self {
        self.set_fixed(true);
        self
    }

    /// The same parameter, to be followed by integration steps.
    pub fn paced(self, pace: Pace) -> Self {
        Self {
            pace: Some(pace),
            ..self
        }
    }

    /// The fastest rate (1/s) inside the bounds, where integration steps have to follow it and it says so alone.
    pub fn fastest_rate(&self) -> Option<f64> {
        Some(match self.pace? {
            Pace::Rate => self.high,
            Pace::TimeConstant => 1.0 / self.low.max(0.0),
            Pace::Frequency => TAU * self.high,
            Pace::Delay => 12.0_f64.sqrt() / self.low.max(0.0),
            Pace::LagRatio => return None,
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
