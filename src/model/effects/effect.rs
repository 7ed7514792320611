//! An effect that is chosen from the catalogue.

use super::entry::on;
use super::view::{Excitation, View, looked_at};
use super::{Act, Action, Entry, Host, Moment, Port, Scale, Trial, entry, known};
use crate::model::real::Real;
use crate::model::{Input, Output, Parameter};
use crate::record::joined;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

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

impl Entry {
    /// As an effect of a structure: one, or one for each output that it can be on.
    pub fn on(&'static self, structure: &dyn Host) -> Vec<Effect> {
        let on = |output| Effect {
            entry: self,
            output,
        };
        match self.outputs {
            _ if !(self.applies)(structure) => Vec::new(),
            None => vec![on(None)],
            Some(can) => structure
                .observed()
                .iter()
                .filter(|&&output| can(structure, output))
                .map(|&output| on(Some(output)))
                .collect(),
        }
    }
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

    /// Whether it acts within the integration steps that move the spool.
    pub(in crate::model) fn acts_in_steps(&self) -> bool {
        self.acts_in_steps_as(&Action::<f64>::new(self.entry.name, || 1.0))
    }

    /// The same, of its own `action`.
    pub(in crate::model) fn acts_in_steps_as<R: Real>(&self, action: &Action<R>) -> bool {
        self.entry.port == Port::Actuator || action.acts_on_the_reference()
    }

    /// Whether it puts a spool that moves ahead of where the loop has it.
    pub(crate) fn leads(&self) -> bool {
        let action = Action::<f64>::new(self.entry.name, || 1.0);
        let own = vec![0.0; self.entry.states.len()];
        action.place(&own, 0.0, 1.0) > 0.0
    }

    /// Whether the transducer of the loop, which is recorded, shows a spool elsewhere for it.
    pub(crate) fn is_shown_by_its_loop(&self) -> bool {
        let own = vec![0.0; self.entry.states.len()];
        self.simplest().0.seen(&own, 2.0, 1.0) != 2.0
    }

    /// Whether a flow goes with the measured temperature for it.
    pub(crate) fn follows_heat(&self) -> bool {
        let action = self.simplest().0;
        let at = |temperature| {
            let moment = Moment::of(&Input::default());
            action.flow(
                1.0,
                &Moment {
                    temperature,
                    ..moment
                },
            )
        };
        at(20.0) != at(60.0)
    }

    /// Whether it is that something shows, or is commanded, where there is nothing, and no more than that.
    pub(crate) fn is_a_zero(&self) -> bool {
        let (action, parameters) = self.simplest();
        if !self.entry.states.is_empty() || parameters != 1 {
            return false;
        }
        let nothing = Moment::of(&Input::default());
        action.command(&mut [], 0.0) + action.measure(&[], 0.0, &nothing) != 0.0
    }

    /// Whether it is that the command counts as another share of itself, and no more than that.
    pub(crate) fn is_a_gain(&self) -> bool {
        let (action, parameters) = self.all_at(2.0);
        let alone = self.entry.states.is_empty() && parameters == 1;
        alone
            && [1.0, -3.0]
                .iter()
                .all(|&u| action.command(&mut [], u) == 2.0 * u)
    }

    /// Whether it is a lag of first order of one channel, and no more than that.
    pub(crate) fn is_a_lag(&self) -> bool {
        let filters = self.output.is_some() && self.entry.states.len() == 1;
        filters && self.simplest().1 == 1
    }

    /// It with 1 for each of its parameters, and how many these are.
    fn simplest(&self) -> (Action<f64>, usize) {
        self.all_at(1.0)
    }

    /// It with this `value` of each of its parameters, and how many these are.
    fn all_at(&self, value: f64) -> (Action<f64>, usize) {
        let mut parameters = 0;
        let action = Action::new(self.entry.name, || {
            parameters += 1;
            value
        });
        (action, parameters)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::CATALOGUE;

    #[test]
    fn zeros_and_lags_of_channels_are_what_they_are() {
        let named = |is: fn(&Effect) -> bool| -> Vec<&str> {
            let all = CATALOGUE.iter().map(|entry| Effect {
                entry,
                output: entry.outputs.map(|_| Output::Flow),
            });
            all.filter(is).map(|effect| effect.entry.name).collect()
        };
        assert_eq!(named(Effect::is_a_zero), ["null_bias", "sensor_offset"]);
        assert_eq!(named(Effect::is_a_lag), ["compressibility", "sensor_lag"]);
        assert_eq!(named(Effect::is_a_gain), ["dc_gain"]);
        assert_eq!(named(Effect::follows_heat), ["viscosity_drift"]);
        let shown = ["hysteresis~transducer", "null_bias~transducer"];
        assert_eq!(named(Effect::is_shown_by_its_loop), shown);
    }
}
