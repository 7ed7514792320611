//! A structure: which parts the model has, its parameters, its states, its equations of motion and what is observed.

use super::actuator::Actuator;
use super::valve::{Pressures, Valve, ValveForm};
use super::{Parameter, Real};
use serde::{Deserialize, Serialize};

/// A simulated quantity that a measurement is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// Spool position, in the unit of its measurement.
    Spool,
    /// Flow, L/min.
    Flow,
    /// Piston position, mm.
    Position,
}

impl Output {
    /// All of them, in the order of [`Plant::observe`].
    pub const ALL: [Self; 3] = [Self::Spool, Self::Flow, Self::Position];

    /// The name of its channel.
    pub fn name(self) -> &'static str {
        ["spool", "flow", "position"][self as usize]
    }
}

/// What moves the spool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// The actuator of paper eq. 4-6.
    #[default]
    Actuator,
    /// The spool follows the command at once, as on the paper's flow test bench.
    Direct,
}

/// What a measured piston position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Piston {
    /// Flow over piston area, integrated.
    #[default]
    Integrated,
    /// A position loop is closed around valve and piston: the position follows the command as a spool does.
    Servo,
}

/// The command between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Keeps the earlier sample's value, as a DAC does.
    #[default]
    Held,
    /// Goes straight from one to the next.
    Interpolated,
}

/// The state at the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Initial {
    /// In equilibrium with the first command.
    #[default]
    Equilibrium,
    /// All zero.
    Rest,
    /// Fitted: the spool stands still at the parameter `initial_spool`.
    Free,
}

/// Which parts the model has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Structure {
    /// The command at full scale, in the command's unit: spool position 100 %.
    pub full_scale: f64,
    /// The command's unit.
    pub command_unit: String,
    /// The observed outputs, in the order of [`Output::ALL`].
    pub observed: Vec<Output>,
    /// What moves the spool.
    #[serde(default)]
    pub drive: Drive,
    /// The unit of the measured spool where it is not the command's: the parameter `spool_gain` converts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spool_unit: Option<String>,
    /// What a measured position is.
    #[serde(default)]
    pub piston: Piston,
    /// The command between samples.
    #[serde(default)]
    pub hold: Hold,
    /// The state at the first sample.
    #[serde(default)]
    pub initial: Initial,
    /// The valve, where flow or an integrated position is observed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valve: Option<ValveForm>,
}

impl Structure {
    /// An actuator whose spool is observed in the command's unit.
    pub fn actuator(full_scale: f64, command_unit: &str) -> Self {
        Self {
            full_scale,
            command_unit: command_unit.into(),
            observed: vec![Output::Spool],
            drive: Drive::Actuator,
            spool_unit: None,
            piston: Piston::default(),
            hold: Hold::default(),
            initial: Initial::default(),
            valve: None,
        }
    }

    /// A valve alone, its spool moved directly by a command in %, its flow observed.
    pub fn flow_bench(valve: ValveForm) -> Self {
        Self {
            drive: Drive::Direct,
            observed: vec![Output::Flow],
            valve: Some(valve),
            ..Self::actuator(100.0, "%")
        }
    }

    /// Whether `output` is observed.
    pub fn observes(&self, output: Output) -> bool {
        self.observed.contains(&output)
    }

    /// The unit of `output`.
    pub fn unit(&self, output: Output) -> &str {
        match output {
            Output::Spool => self.spool_unit.as_ref().unwrap_or(&self.command_unit),
            Output::Flow => "L/min",
            Output::Position => "mm",
        }
    }

    /// Whether an observed output follows from the flow of a valve.
    pub fn needs_valve(&self) -> bool {
        self.observes(Output::Flow) || self.integrates_position()
    }

    fn integrates_position(&self) -> bool {
        self.observes(Output::Position) && self.piston == Piston::Integrated
    }

    /// The names of the states, in their order.
    pub fn states(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        if self.drive == Drive::Actuator {
            names.extend(["integrator", "spool"]);
        }
        if self.integrates_position() {
            names.push("position");
        }
        names
    }

    /// All parameters with generic bounds and start values, in the order in which [`Plant::new`] takes them.
    pub fn parameters(&self) -> Vec<Parameter> {
        let (scale, unit) = (self.full_scale, self.command_unit.as_str());
        let mut list = Vec::new();
        if self.drive == Drive::Actuator {
            list.push(Parameter::log("gain", "1/s", 1.0, 200.0, 5000.0));
            list.push(Parameter::log("time_constant", "s", 5e-4, 0.01, 0.1));
            list.push(Parameter::log(
                "saturation",
                unit,
                0.005 * scale,
                0.5 * scale,
                2.0 * scale,
            ));
            if self.initial == Initial::Free {
                list.push(Parameter::linear(
                    "initial_spool",
                    unit,
                    -1.5 * scale,
                    0.0,
                    1.5 * scale,
                ));
            }
        }
        if let Some(spool) = &self.spool_unit {
            list.push(Parameter::log(
                "spool_gain",
                &format!("{spool}/{unit}"),
                1e-3,
                1.0,
                1e3,
            ));
        }
        if let Some(valve) = &self.valve {
            list.extend(valve.parameters());
        }
        if self.integrates_position() {
            list.push(Parameter::log("piston_area", "cm2", 1e-2, 10.0, 1e4));
        }
        list
    }

    /// The fastest rate (1/s) of any candidate inside the bounds of `parameters`, which are those of
    /// [`Structure::parameters`] with bounds of the caller's.
    pub fn fastest_rate(&self, parameters: &[Parameter]) -> f64 {
        // Fixed ones too: the steps of a model stay the same when its parameters are fixed.
        let bound = |name: &str, highest: bool| {
            let parameter = parameters.iter().find(|p| p.name == name)?;
            Some(if highest {
                parameter.high
            } else {
                parameter.low
            })
        };
        match (bound("gain", true), bound("time_constant", false)) {
            // The loop's poles are those of s² + s/T + K/T: none is larger than both of these.
            (Some(gain), Some(lag)) => (1.0 / lag).max((gain / lag).sqrt()),
            _ => 0.0,
        }
    }
}

/// What drives the model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Input<R> {
    /// The command, in its own unit.
    pub command: R,
    /// The measured port pressures, bar.
    pub pressures: Pressures<R>,
}

impl<R: Real> Input<R> {
    /// The input whose values are the same for every candidate, in the order command, supply, tank, a, b.
    #[inline(always)]
    pub fn constant(values: [f64; 5]) -> Self {
        let [command, supply, tank, a, b] = values.map(R::constant);
        Self {
            command,
            pressures: Pressures { supply, tank, a, b },
        }
    }
}

/// A structure with values for its parameters: what is computed once a candidate.
#[derive(Debug, Clone)]
pub struct Plant<R> {
    actuator: Option<Actuator<R>>,
    valve: Option<Valve<R>>,
    initial: Initial,
    initial_spool: Option<R>,
    spool_gain: Option<R>,
    /// mm/s of piston for each L/min.
    piston_speed: Option<R>,
    percent: f64,
    observes: [bool; 3],
}

impl<R: Real> Plant<R> {
    /// The plant of `structure`, with values in the order of [`Structure::parameters`].
    #[inline(always)]
    pub fn new(structure: &Structure, values: &[R]) -> Self {
        let mut rest = values;
        let mut take = |count: usize| {
            let (taken, left) = rest.split_at(count);
            rest = left;
            taken
        };
        let actuator = (structure.drive == Drive::Actuator).then(|| {
            let taken = take(3);
            Actuator::new(taken[0], taken[1], taken[2])
        });
        let free = structure.drive == Drive::Actuator && structure.initial == Initial::Free;
        let initial_spool = free.then(|| take(1)[0]);
        let spool_gain = structure.spool_unit.is_some().then(|| take(1)[0]);
        let valve = structure
            .valve
            .as_ref()
            .map(|form| Valve::new(form, take(form.parameters().len())));
        // 1 L/min = 1e-3/60 m³/s, over 1 cm² = 1e-4 m², in mm/s.
        let piston_speed = structure
            .integrates_position()
            .then(|| (R::constant(1e-3 / 60.0 / 1e-4 * 1e3) / take(1)[0]).named("piston_speed"));
        Self {
            actuator,
            valve,
            initial: structure.initial,
            initial_spool,
            spool_gain,
            piston_speed,
            percent: 100.0 / structure.full_scale,
            observes: Output::ALL.map(|output| structure.observes(output)),
        }
    }

    /// The state at the first sample, for its `input` and the first measured `position` (mm).
    #[inline(always)]
    pub fn initial<const N: usize>(&self, input: &Input<R>, position: R) -> [R; N] {
        let mut state = [R::constant(0.0); N];
        if self.actuator.is_some() {
            let spool = match (self.initial, self.initial_spool) {
                (Initial::Free, Some(spool)) => spool,
                (Initial::Rest, _) => R::constant(0.0),
                _ => input.command,
            };
            state[0] = spool;
            state[1] = spool;
        }
        if self.piston_speed.is_some() {
            state[N - 1] = position;
        }
        state
    }

    /// Spool position in the unit of the command.
    #[inline(always)]
    fn spool(&self, state: &[R], input: &Input<R>) -> R {
        if self.actuator.is_some() {
            state[1]
        } else {
            input.command
        }
    }

    #[inline(always)]
    fn flow(&self, state: &[R], input: &Input<R>) -> R {
        match &self.valve {
            Some(valve) => {
                let x = (self.spool(state, input) * R::constant(self.percent)).named("opening");
                valve.flow(x, &input.pressures).named("flow")
            }
            None => R::constant(0.0),
        }
    }

    /// The time derivative of the state.
    #[inline(always)]
    pub fn derivative<const N: usize>(&self, state: &[R; N], input: &Input<R>) -> [R; N] {
        let mut slope = [R::constant(0.0); N];
        if let Some(actuator) = &self.actuator {
            (slope[0], slope[1]) = actuator.derivative(state[0], state[1], input.command);
        }
        if let Some(speed) = self.piston_speed {
            slope[N - 1] = speed * self.flow(state, input);
        }
        slope
    }

    /// The outputs in the order of [`Output::ALL`]; those that are not observed are zero.
    #[inline(always)]
    pub fn observe(&self, state: &[R], input: &Input<R>) -> [R; 3] {
        let mut outputs = [R::constant(0.0); 3];
        let spool = self.spool(state, input);
        if self.observes[0] {
            outputs[0] = match self.spool_gain {
                Some(gain) => gain * spool,
                None => spool,
            };
        }
        if self.observes[1] {
            outputs[1] = self.flow(state, input);
        }
        if self.observes[2] {
            outputs[2] = match self.piston_speed {
                Some(_) => state[state.len() - 1],
                None => spool,
            };
        }
        outputs
    }
}
