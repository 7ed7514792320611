//! A structure: its base model, what is observed of it, what is attached to it, and how a record drives it.

use super::base::each_base;
use super::base::servo_valve::Drive;
use super::base::{Base, BaseEquations, BaseModel, ServoValve};
use super::declare::Listing;
use super::effects::{Effect, Host, Port, Scale};
use super::exact_step::{STEPS_OF_A_CARRYING_STEP, STEPS_OF_AN_EXACT_STEP};
use super::free_form::FreeForm;
use super::setting::{Hold, Initial, Setting};
use super::valve::{Drop, ValveForm};
use super::{Output, Outputs, Parameter};
use crate::record::Channel;
use serde::{Deserialize, Serialize};

/// Most states of a structure: the time loops are compiled for so many.
pub(crate) const MOST_STATES: usize = 77;

/// Which parts the model has. In a model file the fields of a servo valve stand beside the others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "written::Structure", into = "written::Structure")]
pub struct Structure {
    /// The command at full scale, in the command's unit: spool position 100 %.
    pub full_scale: f64,
    /// The command's unit.
    pub command_unit: String,
    /// The observed outputs, in the order of [`Output::ALL`].
    pub observed: Vec<Output>,
    /// The command between samples.
    pub hold: Hold,
    /// The state at the first sample.
    pub initial: Initial,
    /// What is simulated where nothing is attached.
    pub base: Base,
    /// What is added to the base model, in the order of the catalogue.
    pub effects: Vec<Effect>,
    /// A correction of unknown form.
    pub free_form: Option<FreeForm>,
}

impl Structure {
    /// An actuator whose spool is observed in the command's unit.
    pub fn actuator(full_scale: f64, command_unit: &str) -> Self {
        Self {
            full_scale,
            command_unit: command_unit.into(),
            observed: vec![Output::Spool],
            hold: Hold::default(),
            initial: Initial::default(),
            base: ServoValve::default().into(),
            effects: Vec::new(),
            free_form: None,
        }
    }

    /// A valve alone, its spool moved directly by a command in %, its flow observed.
    pub fn flow_bench(valve: ValveForm) -> Self {
        Self {
            observed: vec![Output::Flow],
            base: ServoValve {
                drive: Drive::Direct,
                ..ServoValve::with(valve)
            }
            .into(),
            ..Self::actuator(100.0, "%")
        }
    }

    /// What its base model is told of its surroundings.
    pub fn setting(&self) -> Setting<'_> {
        Setting {
            full_scale: self.full_scale,
            command_unit: &self.command_unit,
            observed: &self.observed,
            initial: self.initial,
        }
    }

    /// The servo valve, where that is the base model.
    pub fn servo_valve(&self) -> Option<&ServoValve> {
        match &self.base {
            Base::ServoValve(base) => Some(base),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn servo_valve_mut(&mut self) -> Option<&mut ServoValve> {
        match &mut self.base {
            Base::ServoValve(base) => Some(base),
            _ => None,
        }
    }

    /// The valve whose flow follows the spool, where there is one.
    pub fn valve(&self) -> Option<&ValveForm> {
        self.servo_valve().and_then(|base| base.valve.as_ref())
    }

    /// The unit of the measured spool where it is not the command's.
    pub fn spool_unit(&self) -> Option<&String> {
        self.servo_valve().and_then(|base| base.spool_unit.as_ref())
    }

    /// Whether an observed output follows from the flow of a valve.
    pub fn needs_valve(&self) -> bool {
        self.servo_valve()
            .is_some_and(|base| base.needs_valve(&self.setting()))
    }

    /// Takes the valve away.
    pub(crate) fn remove_valve(&mut self) {
        if let Some(base) = self.servo_valve_mut() {
            base.valve = None;
        }
    }

    /// Whether a position is observed that is integrated from the flow.
    pub fn integrates_position(&self) -> bool {
        self.servo_valve()
            .is_some_and(|base| base.integrates_position(&self.setting()))
    }

    /// Whether it has this port: those of command and measurement are every model's.
    pub fn has(&self, port: Port) -> bool {
        match port {
            Port::Command | Port::Measurement => true,
            inner => each_base!(Base, &self.base, base => base.has(inner)),
        }
    }

    /// Whether an effect delays the command.
    pub fn delays(&self) -> bool {
        self.effects.iter().any(Effect::delays)
    }

    /// Whether `output` is observed.
    pub fn observes(&self, output: Output) -> bool {
        self.observed.contains(&output)
    }

    /// Whether an output is observed while the ports A and B are blocked.
    pub fn observes_blocked_ports(&self) -> bool {
        self.setting().observes_blocked_ports()
    }

    /// What the base model consists of, in words.
    pub(crate) fn base_parts(&self) -> Vec<&'static str> {
        each_base!(Base, &self.base, base => base.parts())
    }

    /// The unit of `output`.
    pub fn unit(&self, output: Output) -> &str {
        each_base!(Base, &self.base, base => base.unit(&self.setting(), output))
    }

    /// Whether `output` is read off the flow at every instant.
    pub(super) fn shows_flow(&self, output: Output) -> bool {
        each_base!(Base, &self.base, base => base.shows_flow(output))
    }

    /// Whether one that is observed is.
    pub(super) fn observes_flow(&self) -> bool {
        let mut observed = self.observed.iter();
        observed.any(|&output| self.shows_flow(output))
    }

    /// Whether `output` follows from the flow of a valve.
    pub(crate) fn follows_flow(&self, output: Output) -> bool {
        each_base!(Base, &self.base, base => base.follows_flow(output))
    }

    /// Channels beside the command that have to be measured, as they drive the model.
    pub(crate) fn driven_by(&self) -> &'static [Channel] {
        each_base!(Base, &self.base, base => base.driven_by())
    }

    /// The same structure with `effect`, in its place.
    pub fn with(&self, effect: Effect) -> Self {
        let mut structure = self.clone();
        if !structure.effects.contains(&effect) {
            structure.effects.push(effect);
            structure.effects.sort_by_key(Effect::rank);
        }
        structure
    }

    /// Whether it has `effect`, or another form of its cause on the same output.
    pub fn has_cause_of(&self, effect: &Effect) -> bool {
        self.effects.iter().any(|own| own.is_form_of(effect))
    }

    /// The same structure without `effect`.
    pub fn without(&self, effect: Effect) -> Self {
        let mut structure = self.clone();
        structure.effects.retain(|other| *other != effect);
        structure
    }

    /// Whether it is a servo valve to which nothing is attached.
    pub(crate) fn is_servo_valve_alone(&self) -> bool {
        let nothing = self.effects.is_empty() && self.free_form.is_none();
        nothing && self.servo_valve().is_some()
    }

    /// The outputs that something filters.
    pub(super) fn filtered(&self) -> impl Iterator<Item = Output> + Clone {
        let effects = self.effects.iter();
        let filters = effects.filter(|effect| !effect.entry.states.is_empty());
        filters.filter_map(|effect| effect.output)
    }

    fn filters(&self) -> bool {
        self.filtered().next().is_some()
    }

    /// Whether exact steps of the spool carry a state along.
    pub(super) fn carries(&self) -> bool {
        each_base!(Base, &self.base, base => base.carries(&self.setting()))
    }

    /// Whether exact steps of the spool are followed by what filters an output, or by a state that they carry along.
    pub fn has_followers(&self) -> bool {
        self.carries() || self.filters()
    }

    /// How many steps of [`integrate`](super::integrate) an exact step of the spool takes the place of, at most: what follows it
    /// needs it shorter.
    pub fn steps_of_an_exact_step(&self) -> u32 {
        if self.filters() {
            1
        } else if self.carries() {
            STEPS_OF_A_CARRYING_STEP
        } else {
            STEPS_OF_AN_EXACT_STEP
        }
    }

    /// Whether the spool can be moved in exact steps (see [`exact_step`](super::exact_step)): nothing acts on how it moves but a
    /// command that is constant or goes straight, and nothing else moves but what [follows](Self::has_followers).
    pub fn has_exact_steps(&self) -> bool {
        let still = |effect: &Effect| match effect.entry.port {
            _ if effect.acts_in_steps() => false,
            Port::Command => self.hold == Hold::Held,
            _ => effect.output.is_some() || effect.entry.states.is_empty(),
        };
        let correction = |form: &FreeForm| match form.port {
            Port::Command => self.hold == Hold::Held,
            port => port != Port::Actuator,
        };
        each_base!(Base, &self.base, base => base.has_exact_step(&self.setting()))
            && self.effects.iter().all(still)
            && self.free_form.as_ref().is_none_or(correction)
    }

    /// The names of the states, in their order.
    pub fn states(&self) -> Vec<String> {
        let mut names: Vec<String> = self.base_states().into_iter().map(String::from).collect();
        for effect in &self.effects {
            let own = effect.entry.states.iter();
            names.extend(own.map(|state| match effect.output {
                Some(output) => format!("{state}_{}", output.name()),
                None => (*state).to_owned(),
            }));
        }
        names
    }

    /// The names of the base model's states: the first ones.
    pub(super) fn base_states(&self) -> Vec<&'static str> {
        each_base!(Base, &self.base, base => base.states(&self.setting()))
    }

    /// All parameters with generic bounds and start values, in the order in which a plant takes them.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.parameters_at(&self.generic_scale())
    }

    /// How large things are where no record says it.
    pub(crate) fn generic_scale(&self) -> Scale {
        let spool = self.unit(Output::Spool);
        let mut outputs = Outputs::all(100.0);
        if spool != "%" {
            outputs[Output::Spool] = self.full_scale;
        }
        Scale {
            command: self.full_scale,
            command_unit: self.command_unit.clone(),
            outputs,
            units: Outputs::from_fn(|output| self.unit(output).to_owned()),
            interval: 1e-3,
            length: 10.0,
            temperature: false,
            pressure: self.valve().is_some_and(|valve| valve.drop != Drop::Rated),
            rated_drop: 10.0,
            speed: 20.0 * self.full_scale,
            lines: Outputs::default(),
        }
    }

    /// The same, with bounds of the effects' parameters that suit `scale`.
    pub fn parameters_at(&self, scale: &Scale) -> Vec<Parameter> {
        let mut listing = Listing::default();
        BaseEquations::new(&self.base, &self.setting(), &mut listing);
        let mut list = listing.0;
        for effect in &self.effects {
            list.extend(effect.parameters(scale));
        }
        if let Some(form) = &self.free_form {
            list.extend(form.parameters(scale));
        }
        list
    }

    /// Numbers of the states that are shifted together where the spool is led along a measured one.
    pub(crate) fn led(&self) -> &'static [usize] {
        each_base!(Base, &self.base, base => base.led())
    }

    /// Names of the parameters that decide when an exact step meets an edge, the most telling first.
    pub(crate) fn edges_follow(&self) -> &'static [&'static str] {
        each_base!(Base, &self.base, base => base.edges_follow())
    }

    /// The fastest rate (1/s) of any candidate inside the bounds of `parameters`, which are those of
    /// [`Structure::parameters`] with bounds of the caller's.
    pub fn fastest_rate(&self, parameters: &[Parameter]) -> f64 {
        each_base!(Base, &self.base, base => base.fastest_rate(parameters))
    }
}

impl Host for Structure {
    fn has(&self, port: Port) -> bool {
        self.has(port)
    }

    fn observed(&self) -> &[Output] {
        &self.observed
    }

    fn follows_flow(&self, output: Output) -> bool {
        self.follows_flow(output)
    }

    fn command_unit(&self) -> &str {
        &self.command_unit
    }

    fn unit(&self, output: Output) -> &str {
        self.unit(output)
    }

    fn valve(&self) -> Option<&ValveForm> {
        self.valve()
    }
}

/// How a structure stands in a model file.
mod written {
    use super::{Base, Effect, FreeForm, Hold, Initial, Output, ServoValve, ValveForm};
    use crate::model::base::servo_valve::{Drive, Piston, Polarity};
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields, rename = "Structure")]
    pub(super) struct Structure {
        full_scale: f64,
        command_unit: String,
        observed: Vec<Output>,
        /// The name of a base model other than the servo valve, whose parts are the fields below.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        base: Option<String>,
        #[serde(default)]
        drive: Drive,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        spool_unit: Option<String>,
        #[serde(default)]
        piston: Piston,
        #[serde(default, skip_serializing_if = "is_default")]
        polarity: Polarity,
        #[serde(default, skip_serializing_if = "is_default")]
        reversed: bool,
        #[serde(default)]
        hold: Hold,
        #[serde(default)]
        initial: Initial,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        valve: Option<ValveForm>,
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        effects: Vec<Effect>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        free_form: Option<FreeForm>,
    }

    fn is_default<T: Default + PartialEq>(value: &T) -> bool {
        *value == T::default()
    }

    impl From<super::Structure> for Structure {
        fn from(structure: super::Structure) -> Self {
            let (base, servo_valve) = match structure.base {
                Base::ServoValve(base) => (None, base),
                other => (Some(other.name().into()), ServoValve::default()),
            };
            Self {
                full_scale: structure.full_scale,
                command_unit: structure.command_unit,
                observed: structure.observed,
                base,
                drive: servo_valve.drive,
                spool_unit: servo_valve.spool_unit,
                piston: servo_valve.piston,
                polarity: servo_valve.polarity,
                reversed: servo_valve.reversed,
                hold: structure.hold,
                initial: structure.initial,
                valve: servo_valve.valve,
                effects: structure.effects,
                free_form: structure.free_form,
            }
        }
    }

    impl TryFrom<Structure> for super::Structure {
        type Error = String;

        fn try_from(written: Structure) -> Result<Self, String> {
            let named = match written.base {
                None => ServoValve::default().into(),
                Some(name) => Base::named(&name).ok_or_else(|| {
                    format!("there is no base model {name:?}: register it, or leave base out for a servo valve")
                })?,
            };
            let servo_valve = ServoValve {
                drive: written.drive,
                spool_unit: written.spool_unit,
                piston: written.piston,
                polarity: written.polarity,
                reversed: written.reversed,
                valve: written.valve,
            };
            let base = match named {
                Base::ServoValve(_) => servo_valve.into(),
                other if servo_valve == ServoValve::default() => other,
                other => {
                    return Err(format!(
                        "drive, spool_unit, piston, polarity, reversed and valve are of a servo valve, and the base model is {}: \
                         leave them out",
                        other.name()
                    ));
                }
            };
            Ok(Self {
                full_scale: written.full_scale,
                command_unit: written.command_unit,
                observed: written.observed,
                hold: written.hold,
                initial: written.initial,
                base,
                effects: written.effects,
                free_form: written.free_form,
            })
        }
    }
}
