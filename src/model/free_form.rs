//! A correction of unknown form: a curve of one signal that acts at one port, for what is in no entry of the catalogue.

use super::effects::{Port, Scale};
use super::{Output, Parameter, Real};
use serde::{Deserialize, Serialize};

/// What a correction is a curve of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Signal {
    /// The command that acts, in its unit.
    Command,
    /// The spool's position, in the unit of the command; its opening in % at the area port.
    Spool,
    /// The spool's velocity, in command units per second.
    Speed,
    /// Time since the record's first row, s.
    Time,
}

impl Signal {
    /// Its name.
    pub fn name(self) -> &'static str {
        ["command", "spool", "speed", "time"][self as usize]
    }
}

/// A correction: linear between its knots, constant beyond them. What it adds at each knot is a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FreeForm {
    /// Where it acts: it is added to the command, to the error that drives the actuator, to the opening, or to a measured
    /// output.
    pub port: Port,
    /// What it is a curve of.
    pub signal: Signal,
    /// The output that it is added to, at the measurement port.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output: Option<Output>,
    /// Values of the signal, strictly rising, at least two.
    pub knots: Vec<f64>,
}

impl FreeForm {
    /// What it adds at each knot.
    pub fn parameters(&self, scale: &Scale) -> Vec<Parameter> {
        let (unit, most) = match self.port {
            Port::Command | Port::Actuator => (scale.command_unit.as_str(), scale.command),
            Port::Area | Port::Flow => ("%", 100.0),
            Port::Measurement => (scale.unit(self.output), scale.output(self.output)),
        };
        (1..=self.knots.len())
            .map(|i| Parameter::linear(&format!("correction_{i}"), unit, -most, 0.0, most))
            .collect()
    }

    /// The unit of its signal.
    pub fn signal_unit(&self, command_unit: &str) -> String {
        match (self.port, self.signal) {
            (Port::Area, _) => "%".into(),
            (_, Signal::Command | Signal::Spool) => command_unit.into(),
            (_, Signal::Speed) => format!("{command_unit}/s"),
            (_, Signal::Time) => "s".into(),
        }
    }
}

/// A correction with values at its knots.
#[derive(Debug, Clone)]
pub(super) struct Correction<R> {
    pub(super) port: Port,
    pub(super) signal: Signal,
    pub(super) output: Option<Output>,
    first: R,
    /// Slope, start and width of every segment.
    segments: Vec<(R, f64, f64)>,
}

impl<R: Real> Correction<R> {
    #[inline(always)]
    pub(super) fn new(form: &FreeForm, mut next: impl FnMut() -> R) -> Self {
        let first = next();
        let mut previous = first;
        let mut segments = Vec::with_capacity(form.knots.len());
        for pair in form.knots.windows(2) {
            let value = next();
            let width = pair[1] - pair[0];
            segments.push(((value - previous) / R::constant(width), pair[0], width));
            previous = value;
        }
        Self {
            port: form.port,
            signal: form.signal,
            output: form.output,
            first,
            segments,
        }
    }

    /// What is added where the signal is `signal`.
    #[inline(always)]
    pub(super) fn at(&self, signal: R) -> R {
        let mut sum = self.first;
        for &(slope, start, width) in &self.segments {
            let within = (signal - R::constant(start)).clamp(R::constant(0.0), R::constant(width));
            sum = sum + slope * within;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_its_knots_and_holds_its_ends() {
        let form = FreeForm {
            port: Port::Command,
            signal: Signal::Command,
            output: None,
            knots: vec![-2.0, 1.0, 3.0],
        };
        let mut values = [0.5, -1.0, 2.0].into_iter();
        let curve: Correction<f64> = Correction::new(&form, || values.next().unwrap());
        for (signal, value) in [
            (-9.0, 0.5),
            (-2.0, 0.5),
            (-0.5, -0.25),
            (1.0, -1.0),
            (2.0, 0.5),
            (7.0, 2.0),
        ] {
            assert!((curve.at(signal) - value).abs() < 1e-15, "{signal}");
        }
    }
}
