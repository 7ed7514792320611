//! An effect's place in the catalogue, and an effect chosen from it.

use super::view::{Excitation, View, looked_at};
use super::{Act, Action, entry, known};
use crate::model::valve::{Drop, Meter};
use crate::model::{Output, Outputs, Parameter, Structure};
use crate::record::joined;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// Where an effect attaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Port {
    /// The command on its way to the actuator.
    Command,
    /// The motion of the spool.
    Actuator,
    /// The opening that follows from the spool's position.
    Area,
    /// The flow and the pressure that drives it.
    Flow,
    /// What a sensor makes of the quantity that it measures.
    Measurement,
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Command => "command",
            Self::Actuator => "actuator",
            Self::Area => "area",
            Self::Flow => "flow",
            Self::Measurement => "measurement",
        })
    }
}

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
    /// Rated pressure drop from P to T, bar.
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
    /// Base parameters by which a base model imitates it: a search also begins with these at their upper bounds.
    pub imitated_by: &'static [&'static str],
    /// Names of its states.
    pub states: &'static [&'static str],
    /// Values at which it is absent, where the start values of its parameters are not: (parameter, value).
    pub neutral: &'static [(&'static str, f64)],
    /// Whether a structure gives it something to act on.
    pub applies: fn(&Structure) -> bool,
    /// For an effect that acts on one output at a time: on which ones it can.
    pub outputs: Option<fn(&Structure, Output) -> bool>,
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

    /// As an effect of `structure`: one, or one for each output that it can be on.
    pub fn on(&'static self, structure: &Structure) -> Vec<Effect> {
        let on = |output| Effect {
            entry: self,
            output,
        };
        match self.outputs {
            _ if !(self.applies)(structure) => Vec::new(),
            None => vec![on(None)],
            Some(can) => structure
                .observed
                .iter()
                .filter(|&&output| can(structure, output))
                .map(|&output| on(Some(output)))
                .collect(),
        }
    }
}

pub(super) fn always(_: &Structure) -> bool {
    true
}

pub(super) fn moves_a_spool(structure: &Structure) -> bool {
    structure.has(Port::Actuator)
}

/// Whether what moves is the spool itself, not the piston of a loop that is closed around the valve.
pub(super) fn moves_no_piston(structure: &Structure) -> bool {
    moves_a_spool(structure) && loop_output(structure) != Some(Output::Position)
}

/// The output that shows where a closed loop is: the spool, or a position that no flow drives.
pub(super) fn loop_output(structure: &Structure) -> Option<Output> {
    let outputs = [Output::Spool, Output::Position].into_iter();
    let shows = |&output: &Output| structure.observes(output) && !structure.follows_flow(output);
    outputs
        .filter(shows)
        .find(|_| structure.has(Port::Actuator))
}

pub(super) fn has_a_valve(structure: &Structure) -> bool {
    structure.has(Port::Area)
}

/// A valve whose area over the opening shows: near null that of four edges is their own.
pub(super) fn shows_its_area(structure: &Structure) -> bool {
    has_a_valve(structure) && (!structure.has_edges() || shows_a_flow(structure))
}

/// A valve whose lands close together, where no edge has a position of its own.
pub(super) fn has_lands(structure: &Structure) -> bool {
    has_a_valve(structure) && !structure.has_edges()
}

/// A valve whose flow is measured in the pressure line; what leaks near null is that of its edges where it has such.
pub(super) fn shows_what_is_delivered(structure: &Structure) -> bool {
    let meter = structure.valve().map(|valve| valve.meter);
    has_lands(structure) && structure.observes(Output::Flow) && meter == Some(Meter::Supply)
}

/// A valve whose flow is measured, or moves what is.
pub(super) fn shows_a_flow(structure: &Structure) -> bool {
    has_a_valve(structure) && structure.shows_a_flow()
}

pub(super) fn any_output(_: &Structure, _: Output) -> bool {
    true
}

/// The flow, and a position that is its integral.
pub(super) fn flow_outputs(structure: &Structure, output: Output) -> bool {
    structure.follows_flow(output)
}

pub(super) fn has_a_rated_drop(structure: &Structure) -> bool {
    structure
        .valve()
        .is_some_and(|valve| valve.drop == Drop::Rated)
}

/// An effect of a structure: an entry of the catalogue, on an output where it is on one.
///
/// As text it is `name` or `name.output`, as in `sensor_lag.flow`.
#[derive(Clone, Copy)]
pub struct Effect {
    /// What it is.
    pub entry: &'static Entry,
    /// Which output it is on.
    pub output: Option<Output>,
}

impl Effect {
    /// Its place among the effects of a structure: the order of the catalogue, then of the outputs.
    pub fn rank(&self) -> (usize, Option<Output>) {
        let place = known().position(|entry| entry.name == self.entry.name);
        (place.expect("an entry of the catalogue"), self.output)
    }

    /// Its parameters.
    pub fn parameters(&self, scale: &Scale) -> Vec<Parameter> {
        (self.entry.parameters)(scale, self.output)
    }

    /// Its cause, with the output where it is on one, whatever its form.
    pub fn cause(&self) -> String {
        match self.output {
            Some(output) => format!("{}.{}", self.entry.cause(), output.name()),
            None => self.entry.cause().to_owned(),
        }
    }

    /// Whether `other` is the same cause on the same output, in this form or another.
    pub(crate) fn is_form_of(&self, other: &Self) -> bool {
        self.entry.cause() == other.entry.cause() && self.output == other.output
    }

    /// Whether it filters an output by an equation of second order, of which its first two parameters are the natural frequency
    /// (Hz) and the damping.
    pub(crate) fn is_of_second_order(&self) -> bool {
        self.entry.frequency.is_some() && self.entry.states.len() == 2 && self.output.is_some()
    }

    /// Whether it delays the command, whatever the values of its parameters.
    pub(in crate::model) fn delays(&self) -> bool {
        Action::<f64>::new(self.entry.name, || 1.0)
            .delay()
            .is_some()
    }

    /// Whether it puts a spool that moves ahead of where the loop has it.
    pub(crate) fn leads(&self) -> bool {
        let action = Action::<f64>::new(self.entry.name, || 1.0);
        action.place(0.0, 1.0) > 0.0
    }

    /// The view that shows it best.
    pub fn view(&self) -> View {
        let usual = View::of_port(self.entry.port);
        self.entry.view.unwrap_or(usual)
    }

    /// Whether quick motion alone shows it, though it acts in the valve or its lines: a static sweep says nothing of it.
    pub fn needs_quick_motion(&self) -> bool {
        let quick = matches!(
            self.view().excitation,
            Excitation::Chirp | Excitation::Step { .. }
        );
        quick && self.entry.port != Port::Measurement
    }

    /// The name of the parameter that is the frequency of what it adds, where it adds an oscillation.
    pub fn frequency(&self) -> Option<String> {
        self.entry.frequency.map(|name| on(name, self.output))
    }

    /// The output in which it is looked at.
    pub fn looked_at(&self) -> Output {
        looked_at(self.entry.port, self.output)
    }

    /// Values of its free parameters where a search for it begins.
    pub fn trials(&self, scale: &Scale) -> Vec<Trial> {
        (self.entry.trials)(scale, self.output)
    }
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.entry.name == other.entry.name && self.output == other.output
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.output {
            Some(output) => write!(f, "{}.{}", self.entry.name, output.name()),
            None => f.write_str(self.entry.name),
        }
    }
}

impl fmt::Debug for Effect {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl FromStr for Effect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, output) = match text.split_once('.') {
            Some((name, output)) => (name, Some(output)),
            None => (text, None),
        };
        let known = || {
            let names: Vec<&str> = known().map(|entry| entry.name).collect();
            format!(
                "there is no effect {name:?}: use one of {}",
                names.join(", ")
            )
        };
        let entry = entry(name).ok_or_else(known)?;
        let find = |output: &str| Output::ALL.into_iter().find(|o| o.name() == output);
        let output = match (entry.outputs.is_some(), output) {
            (true, Some(output)) => Some(find(output).ok_or_else(|| {
                let known = joined(Output::ALL.map(|o| o.name().into()).into(), "or");
                format!("{name} is on {known}, not on {output:?}")
            })?),
            (true, None) => {
                let forms = Output::ALL.map(|output| format!("{name}.{}", output.name()));
                let forms = joined(forms.into(), "or");
                return Err(format!("say what {name} is on: {forms}"));
            }
            (false, None) => None,
            (false, Some(_)) => {
                return Err(format!(
                    "{name} acts on no single output: leave the point out"
                ));
            }
        };
        Ok(Self { entry, output })
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Effect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}
