//! An effect's place in the catalogue.

use super::act::Port;
use super::host::Host;
use super::view::View;
use crate::model::{Output, Outputs, Parameter};

/// How large things are: from it follow the bounds of an effect's parameters and the values that a diagnosis tries.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The command at full scale.
    pub command: f64,
    /// The command's unit.
    pub command_unit: String,
    /// Largest magnitude of each output.
    pub outputs: Outputs<f64>,
    /// Unit of each output.
    pub units: Outputs<String>,
    /// Interval between two rows, s.
    pub interval: f64,
    /// Length of the record, s.
    pub length: f64,
    /// Whether temperature is measured.
    pub temperature: bool,
    /// Whether the supply pressure is measured.
    pub pressure: bool,
    /// Rated pressure drop from P to T, or the mean of what is measured, bar.
    pub rated_drop: f64,
    /// Largest speed of the spool, command units per second.
    pub speed: f64,
    /// The frequency of each output's strongest spectral line that nothing known explains, Hz.
    pub lines: Outputs<Option<f64>>,
}

impl Scale {
    /// Largest magnitude of an output.
    pub fn output(&self, output: Option<Output>) -> f64 {
        self.outputs[output.unwrap_or(Output::Spool)]
    }

    /// Unit of an output.
    pub fn unit(&self, output: Option<Output>) -> &str {
        &self.units[output.unwrap_or(Output::Spool)]
    }
}

/// The name of a parameter of an effect on an output.
pub(super) fn on(name: &str, output: Option<Output>) -> String {
    match output {
        Some(output) => format!("{name}_{}", output.name()),
        None => name.to_owned(),
    }
}

/// Values of an effect's free parameters that a diagnosis starts from.
pub type Trial = Vec<f64>;

/// An effect as the catalogue describes it.
#[derive(Debug)]
pub struct Entry {
    /// Its name: that of the cause, and `~form` where it is not the cause's usual form.
    pub name: &'static str,
    /// Where it acts.
    pub port: Port,
    /// What it is, in one line.
    pub summary: &'static str,
    /// What a diagnosis says that it found, with `{parameter}` and `{output}` in the place of their values.
    pub finding: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// When it shows, and how its residual looks.
    pub shows: &'static str,
    /// What it is confused with, and what tells them apart.
    pub confused: &'static str,
    /// Where it is described.
    pub source: &'static str,
    /// Its parameters; for an effect on one output, of that output. Their start values make it absent.
    pub parameters: fn(&Scale, Option<Output>) -> Vec<Parameter>,
    /// Where a search for it begins, near and far from absent: values of the free parameters.
    pub trials: fn(&Scale, Option<Output>) -> Vec<Trial>,
    /// Base parameters by which a base model imitates it: a search also begins with these out of its way, limits at their upper
    /// bounds and lags at a part of what they were fitted to.
    pub imitated_by: &'static [&'static str],
    /// Names of its states.
    pub states: &'static [&'static str],
    /// Values at which it is absent, where the start values of its parameters are not: (parameter, value).
    pub neutral: &'static [(&'static str, f64)],
    /// Whether a structure gives it something to act on.
    pub applies: fn(&dyn Host) -> bool,
    /// For an effect that acts on one output at a time: on which ones it can.
    pub outputs: Option<fn(&dyn Host, Output) -> bool>,
    /// How it is looked at, where that is not as its port is: see [`View::of_port`].
    pub view: Option<View>,
    /// The parameter that is the frequency of what it adds, Hz, where it adds an oscillation.
    pub frequency: Option<&'static str>,
}

impl Entry {
    /// What it is a form of.
    pub fn cause(&self) -> &'static str {
        self.name.split('~').next().unwrap_or(self.name)
    }

    /// Which form of its cause it is.
    pub fn form(&self) -> &'static str {
        self.name.split_once('~').map_or("usual", |(_, form)| form)
    }
}
