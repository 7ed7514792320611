//! A structure: which parts the model has, its parameters, its states, its equations of motion and what is observed.

use super::actuator::Actuator;
use super::effects::{Act, Action, Effect, Moment, Motion, Port, Scale};
use super::free_form::{Correction, FreeForm, Signal};
use super::valve::{Drop, Pressures, Valve, ValveForm};
use super::{Pace, Parameter, Real};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Most states of a structure: the time loops are compiled for so many.
pub(crate) const MOST_STATES: usize = 20;

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
    /// Whether an integrated position falls where the flow is positive: the cylinder is connected the other way round.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reversed: bool,
    /// The command between samples.
    #[serde(default)]
    pub hold: Hold,
    /// The state at the first sample.
    #[serde(default)]
    pub initial: Initial,
    /// The valve, where flow or an integrated position is observed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valve: Option<ValveForm>,
    /// What is added to the base model, in the order of the catalogue.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
    /// A correction of unknown form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_form: Option<FreeForm>,
}

/// The parameters of the actuator's loop that set its pace together.
const GAIN: &str = "gain";
const TIME_CONSTANT: &str = "time_constant";

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
            reversed: false,
            hold: Hold::default(),
            initial: Initial::default(),
            valve: None,
            effects: Vec::new(),
            free_form: None,
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

    /// The same structure with `effect`, in its place.
    pub fn with(&self, effect: Effect) -> Self {
        let mut structure = self.clone();
        if !structure.effects.contains(&effect) {
            structure.effects.push(effect);
            structure.effects.sort_by_key(Effect::rank);
        }
        structure
    }

    /// The same structure without `effect`.
    pub fn without(&self, effect: Effect) -> Self {
        let mut structure = self.clone();
        structure.effects.retain(|other| *other != effect);
        structure
    }

    pub(crate) fn integrates_position(&self) -> bool {
        self.observes(Output::Position) && self.piston == Piston::Integrated
    }

    /// Whether nothing is added to the base model.
    pub fn is_base(&self) -> bool {
        self.effects.is_empty() && self.free_form.is_none()
    }

    /// Whether an effect delays the command.
    pub fn delays(&self) -> bool {
        self.effects
            .iter()
            .any(|effect| effect.entry.name == "delay")
    }

    /// Whether the spool can be moved in exact leaps (see [`leap`](super::leap)): nothing else moves, and nothing acts on
    /// how it moves but a command that is constant or goes straight.
    pub fn leaps(&self) -> bool {
        let still = |effect: &Effect| match effect.entry.port {
            Port::Command => self.hold == Hold::Held,
            Port::Actuator => false,
            _ => effect.entry.states.is_empty(),
        };
        let correction = |form: &FreeForm| match form.port {
            Port::Command => self.hold == Hold::Held,
            port => port != Port::Actuator,
        };
        self.drive == Drive::Actuator
            && !self.integrates_position()
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

    fn base_states(&self) -> Vec<&'static str> {
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
        self.parameters_at(&self.generic_scale())
    }

    /// How large things are where no record says it.
    pub(crate) fn generic_scale(&self) -> Scale {
        let spool = self.unit(Output::Spool);
        let spool = if spool == "%" { 100.0 } else { self.full_scale };
        Scale {
            command: self.full_scale,
            command_unit: self.command_unit.clone(),
            outputs: [spool, 100.0, 100.0],
            units: Output::ALL.map(|output| self.unit(output).to_owned()),
            interval: 1e-3,
            length: 10.0,
            temperature: false,
            pressure: self
                .valve
                .as_ref()
                .is_some_and(|valve| valve.drop != Drop::Rated),
            rated_drop: 10.0,
            speed: 20.0 * self.full_scale,
            lines: [None; 3],
        }
    }

    /// The same, with bounds of the effects' parameters that suit `scale`.
    pub fn parameters_at(&self, scale: &Scale) -> Vec<Parameter> {
        let mut list = self.base_parameters();
        for effect in &self.effects {
            list.extend(effect.parameters(scale));
        }
        if let Some(form) = &self.free_form {
            list.extend(form.parameters(scale));
        }
        list
    }

    fn base_parameters(&self) -> Vec<Parameter> {
        let (scale, unit) = (self.full_scale, self.command_unit.as_str());
        let mut list = Vec::new();
        if self.drive == Drive::Actuator {
            let gain = Parameter::log(GAIN, "1/s", 1.0, 200.0, 5000.0);
            list.push(gain.paced(Pace::Rate));
            let lag = Parameter::log(TIME_CONSTANT, "s", 5e-4, 0.01, 0.1);
            list.push(lag.paced(Pace::TimeConstant));
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
        let (mut gain, mut lag, mut others) = (None, None, 0.0f64);
        for parameter in parameters {
            match parameter.name.as_str() {
                GAIN => gain = Some(parameter.high),
                TIME_CONSTANT => lag = Some(parameter.low),
                _ => others = others.max(parameter.fastest_rate().unwrap_or(0.0)),
            }
        }
        let loop_rate = match (gain, lag) {
            // The loop's poles are those of s² + s/T + K/T: none is larger than both of these.
            (Some(gain), Some(lag)) => (1.0 / lag).max((gain / lag).sqrt()),
            _ => 0.0,
        };
        loop_rate.max(others)
    }
}

/// What drives the model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Input<R> {
    /// The command, in its own unit.
    pub command: R,
    /// The measured port pressures, bar.
    pub pressures: Pressures<R>,
    /// The measured temperature, degC.
    pub temperature: R,
    /// Time since the record's first row, s.
    pub time: R,
}

impl<R: Real> Input<R> {
    /// The input whose values are the same for every candidate, in the order command, supply, tank, a, b, temperature,
    /// time.
    #[inline(always)]
    pub fn constant(values: [f64; 7]) -> Self {
        // Not `map`, which is not always inlined, and only what is inlined is compiled for wide vectors.
        let [command, supply, tank, a, b, temperature, time] = values;
        Self {
            command: R::constant(command),
            pressures: Pressures {
                supply: R::constant(supply),
                tank: R::constant(tank),
                a: R::constant(a),
                b: R::constant(b),
            },
            temperature: R::constant(temperature),
            time: R::constant(time),
        }
    }

    /// The input with these values, in the same order.
    #[inline(always)]
    pub fn new(values: [R; 7]) -> Self {
        let [command, supply, tank, a, b, temperature, time] = values;
        Self {
            command,
            pressures: Pressures { supply, tank, a, b },
            temperature,
            time,
        }
    }
}

/// An effect in a plant: its action, where its states are, and what it is on.
#[derive(Debug, Clone)]
struct Placed<R> {
    action: Action<R>,
    states: Range<usize>,
    output: Option<Output>,
}

/// A structure with values for its parameters: what is computed once a candidate.
///
/// Methods with `EFFECTS` false leave out what effects do: the base model costs nothing more than itself.
#[derive(Debug, Clone)]
pub struct Plant<R> {
    actuator: Option<Actuator<R>>,
    valve: Option<Valve<R>>,
    initial: Initial,
    initial_spool: Option<R>,
    spool_gain: Option<R>,
    /// mm/s of piston for each L/min.
    piston_speed: Option<R>,
    full_scale: f64,
    observes: [bool; 3],
    effects: Vec<Placed<R>>,
    correction: Option<Correction<R>>,
    /// Whether states change with the flow: it is not computed where nothing needs it.
    flow_moves: bool,
    /// Whether effects act on the spool where a step ends.
    settles: bool,
    /// Whether anything filters an output, and whether that is the flow.
    filters: (bool, bool),
}

/// Spool, opening and flow at one instant, and the flow before what the flow port's effects add.
struct Path<R> {
    spool: R,
    flow: R,
    drawn: R,
    moment: Moment<R>,
}

/// Pressure drop that flow forces are related to where pressures are measured, bar: at which servo valves are rated.
const REFERENCE_DROP: f64 = 70.0;

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
        let direction = if structure.reversed { -1.0 } else { 1.0 };
        let speed = R::constant(direction * (1e-3 / 60.0 / 1e-4 * 1e3));
        let piston_speed = structure
            .integrates_position()
            .then(|| (speed / take(1)[0]).named("piston_speed"));
        let mut state = structure.base_states().len();
        let mut effects = Vec::with_capacity(structure.effects.len());
        let mut flow_moves = piston_speed.is_some();
        let mut filters = (false, false);
        for effect in &structure.effects {
            let has_states = !effect.entry.states.is_empty();
            flow_moves |= has_states && effect.entry.port == Port::Flow && effect.output.is_none();
            filters.0 |= has_states && effect.output.is_some();
            filters.1 |= has_states && effect.output == Some(Output::Flow);
            let first = state;
            state += effect.entry.states.len();
            effects.push(Placed {
                action: Action::new(effect.entry.name, || take(1)[0]),
                states: first..state,
                output: effect.output,
            });
        }
        let correction = structure
            .free_form
            .as_ref()
            .map(|form| Correction::new(form, || take(1)[0]));
        Self {
            actuator,
            valve,
            initial: structure.initial,
            initial_spool,
            spool_gain,
            piston_speed,
            full_scale: structure.full_scale,
            observes: Output::ALL.map(|output| structure.observes(output)),
            flow_moves,
            settles: structure
                .effects
                .iter()
                .any(|effect| effect.entry.port == Port::Actuator),
            filters,
            effects,
            correction,
        }
    }

    /// What moves the spool.
    ///
    /// # Panics
    /// If the spool follows the command at once.
    #[inline(always)]
    pub fn actuator(&self) -> &Actuator<R> {
        self.actuator
            .as_ref()
            .expect("a structure with an actuator")
    }

    /// How long the command takes to arrive, s, where an effect delays it.
    #[inline(always)]
    pub fn delay(&self) -> Option<R> {
        self.effects.iter().find_map(|effect| effect.action.delay())
    }

    /// The state at the first sample, for its `input` and the first measured `position` (mm).
    #[inline(always)]
    pub fn initial<const N: usize, const EFFECTS: bool>(
        &self,
        input: &Input<R>,
        position: R,
    ) -> [R; N] {
        let mut state = [R::constant(0.0); N];
        let mut input = *input;
        if EFFECTS {
            input.command = self.settle_command(&mut state, input.command);
        }
        if self.actuator.is_some() {
            let spool = match (self.initial, self.initial_spool) {
                (Initial::Free, Some(spool)) => spool,
                (Initial::Rest, _) => R::constant(0.0),
                _ => input.command,
            };
            state[0] = spool;
            state[1] = spool;
            if EFFECTS && self.initial == Initial::Equilibrium {
                self.settle_spool(&mut state, &input);
            }
        }
        if self.piston_speed.is_some() {
            state[self.position::<EFFECTS>(N)] = position;
        }
        if EFFECTS {
            self.settle_supply(&mut state, &input);
            self.settle_outputs(&mut state, &input);
        }
        state
    }

    /// The command that acts when it has long been `command`, and what effects on it then remember.
    #[inline(always)]
    fn settle_command(&self, state: &mut [R], command: R) -> R {
        R::outlined(
            #[inline(always)]
            || {
                let mut command = command;
                for effect in &self.effects {
                    let own = &mut state[effect.states.clone()];
                    effect.action.settled(own, command);
                    command = effect.action.command(own, command);
                }
                command
            },
        )
    }

    /// The spool where its drive, with what pulls it, is zero: by the secant method.
    #[inline(always)]
    fn settle_spool(&self, state: &mut [R], input: &Input<R>) {
        let Some(actuator) = &self.actuator else {
            return;
        };
        if !self.effects.iter().any(|effect| effect.action.pulls()) {
            return;
        }
        let zero = R::constant(0.0);
        R::outlined(
            #[inline(always)]
            || {
                let mut excess = |spool: R| {
                    (state[0], state[1]) = (spool, spool);
                    let path = self.path::<true>(state, input, true);
                    let (mut drive, _) = actuator.derivative(spool, spool, input.command);
                    let motion = self.motion(actuator, spool, zero, &path, zero);
                    for effect in &self.effects {
                        drive = effect.action.drive(drive, &motion);
                    }
                    drive / actuator.gain()
                };
                let mut before = input.command;
                let mut pull = excess(before);
                let mut spool = before + pull;
                for _ in 0..2 {
                    let now = excess(spool);
                    let change = now - pull;
                    let next = spool - now * ((spool - before) / change);
                    (before, pull) = (spool, now);
                    spool = change.abs().if_positive(next, spool);
                }
                (state[0], state[1]) = (spool, spool);
            },
        );
    }

    /// The flow drawn from a supply that gives way under it, by iteration.
    #[inline(always)]
    fn settle_supply(&self, state: &mut [R], input: &Input<R>) {
        R::outlined(
            #[inline(always)]
            || {
                for _ in 0..4 {
                    let drawn = self.path::<true>(state, input, true).drawn;
                    for effect in &self.effects {
                        if !effect.states.is_empty() && effect.output.is_none() {
                            let own = &mut state[effect.states.clone()];
                            effect.action.settled_supply(own, drawn);
                        }
                    }
                }
            },
        );
    }

    /// What filters an output starts settled on it.
    #[inline(always)]
    fn settle_outputs(&self, state: &mut [R], input: &Input<R>) {
        R::outlined(
            #[inline(always)]
            || {
                let path = self.path::<true>(state, input, true);
                for output in Output::ALL {
                    let mut value = self.output::<true>(output, state, &path);
                    for effect in self.on(output) {
                        let own = &mut state[effect.states.clone()];
                        effect.action.settled(own, value);
                        value = effect.action.measure(own, value, &path.moment);
                    }
                }
            },
        );
    }

    /// The place of the piston's position in the state.
    #[inline(always)]
    fn position<const EFFECTS: bool>(&self, states: usize) -> usize {
        match EFFECTS {
            true if self.actuator.is_some() => 2,
            true => 0,
            false => states - 1,
        }
    }

    /// The command that acts, when `command` has arrived: `state` remembers it.
    #[inline(always)]
    pub fn command(&self, state: &mut [R], command: R) -> R {
        R::outlined(
            #[inline(always)]
            || {
                let mut command = command;
                for effect in &self.effects {
                    let own = &mut state[effect.states.clone()];
                    command = effect.action.command(own, command);
                }
                match self.correction_at(Port::Command) {
                    Some(correction) => command + correction.at(command),
                    None => command,
                }
            },
        )
    }

    #[inline(always)]
    fn correction_at(&self, port: Port) -> Option<&Correction<R>> {
        self.correction
            .as_ref()
            .filter(|correction| correction.port == port)
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

    /// What passes from the spool to the flow. `input` has the command that acts.
    #[inline(always)]
    fn path<const EFFECTS: bool>(&self, state: &[R], input: &Input<R>, with_flow: bool) -> Path<R> {
        match EFFECTS {
            true => R::outlined(
                #[inline(always)]
                || self.path_inline::<true>(state, input, with_flow),
            ),
            false => self.path_inline::<false>(state, input, with_flow),
        }
    }

    #[inline(always)]
    fn path_inline<const EFFECTS: bool>(
        &self,
        state: &[R],
        input: &Input<R>,
        with_flow: bool,
    ) -> Path<R> {
        let zero = R::constant(0.0);
        let mut spool = self.spool(state, input);
        if EFFECTS {
            for effect in &self.effects {
                spool = effect.action.place(spool);
            }
        }
        let mut opening = spool;
        let (mut flow, mut drop) = (zero, zero);
        if let Some(valve) = &self.valve {
            opening = (spool * R::constant(100.0 / self.full_scale)).named("opening");
            let mut pressures = valve.supplied(&input.pressures);
            if EFFECTS {
                for effect in &self.effects {
                    opening = effect.action.opening(opening);
                    let own = &state[effect.states.clone()];
                    pressures.supply = effect.action.supply(own, pressures.supply);
                }
                drop = pressures.supply - pressures.tank;
                if let Some(correction) = self.correction_at(Port::Area) {
                    opening = opening + correction.at(opening);
                }
            }
            if with_flow {
                flow = valve.flow_from(opening, &pressures).named("flow");
            }
        }
        let moment = Moment {
            time: input.time,
            temperature: input.temperature,
            opening,
            drop,
        };
        let drawn = flow;
        if EFFECTS {
            for effect in &self.effects {
                flow = effect.action.flow(flow, &moment);
            }
        }
        Path {
            spool,
            flow,
            drawn,
            moment,
        }
    }

    /// Opening times pressure drop over the reference drop, in the unit of the command.
    #[inline(always)]
    fn load(&self, path: &Path<R>) -> R {
        match &self.valve {
            None => path.spool,
            Some(valve) => {
                let opening = path.moment.opening * R::constant(0.01 * self.full_scale);
                match valve.rated_drop() {
                    Some(rated) => opening * (path.moment.drop / rated),
                    None => opening * (path.moment.drop * R::constant(1.0 / REFERENCE_DROP)),
                }
            }
        }
    }

    /// How the spool moves, on this path, where it can stick with this heading.
    #[inline(always)]
    fn motion(
        &self,
        actuator: &Actuator<R>,
        spool: R,
        speed: R,
        path: &Path<R>,
        heading: R,
    ) -> Motion<R> {
        Motion {
            gain: actuator.gain(),
            time_constant: actuator.time_constant(),
            spool,
            speed,
            heading,
            load: self.load(path),
        }
    }

    /// The sign in which the spool moves, or sets out to move, from `state`; zero while it sticks, and where it cannot.
    /// `input` has the command that acts.
    #[inline(always)]
    pub fn heading(&self, state: &[R], input: &Input<R>) -> R {
        let sticks = self.effects.iter().any(|effect| effect.action.sticks());
        let zero = R::constant(0.0);
        match &self.actuator {
            Some(actuator) if sticks => R::outlined(
                #[inline(always)]
                || {
                    let path = self.path::<true>(state, input, false);
                    let (mut drive, speed) = actuator.derivative(state[0], state[1], input.command);
                    let mut motion = self.motion(actuator, state[1], speed, &path, zero);
                    for effect in &self.effects {
                        motion.heading = effect.action.heading(drive, &motion);
                        drive = effect.action.drive(drive, &motion);
                    }
                    motion.heading
                },
            ),
            _ => zero,
        }
    }

    /// The time derivative of the state in an integration step that began with this `heading`. `input` has the command
    /// that acts.
    #[inline(always)]
    pub fn derivative<const N: usize, const EFFECTS: bool>(
        &self,
        state: &[R; N],
        input: &Input<R>,
        heading: R,
    ) -> [R; N] {
        let mut slope = [R::constant(0.0); N];
        if EFFECTS {
            self.effects_derivative(state, input, heading, &mut slope);
            return slope;
        }
        if let Some(actuator) = &self.actuator {
            (slope[0], slope[1]) = actuator.derivative(state[0], state[1], input.command);
        }
        if let Some(speed) = self.piston_speed {
            slope[N - 1] = speed * self.path::<false>(state, input, true).flow;
        }
        slope
    }

    #[inline(always)]
    fn effects_derivative(&self, state: &[R], input: &Input<R>, heading: R, slope: &mut [R]) {
        R::outlined(
            #[inline(always)]
            || self.effects_derivative_inline(state, input, heading, slope),
        );
    }

    #[inline(always)]
    fn effects_derivative_inline(
        &self,
        state: &[R],
        input: &Input<R>,
        heading: R,
        slope: &mut [R],
    ) {
        let path = self.path::<true>(state, input, self.flow_moves);
        if let Some(actuator) = &self.actuator {
            let (mut drive, mut speed) = actuator.derivative(state[0], state[1], input.command);
            let motion = self.motion(actuator, state[1], speed, &path, heading);
            if let Some(correction) = self.correction_at(Port::Actuator) {
                let signal = match correction.signal {
                    Signal::Speed => speed,
                    _ => state[1],
                };
                drive = drive + actuator.gain() * correction.at(signal);
            }
            for effect in &self.effects {
                drive = effect.action.drive(drive, &motion);
                speed = effect.action.speed(speed);
            }
            (slope[0], slope[1]) = (drive, speed);
        }
        if let Some(speed) = self.piston_speed {
            slope[self.position::<true>(state.len())] = speed * path.flow;
        }
        for effect in &self.effects {
            if !effect.states.is_empty() && effect.output.is_none() {
                let own = &state[effect.states.clone()];
                slope[effect.states.start] = effect.action.drawn(own, path.drawn);
            }
        }
    }

    /// What happens at the end of an integration `step` from `before` with this `heading` to `state`: the spool sticks or
    /// meets a stop, and what filters an output follows it. The `inputs` are those at the step's start and end.
    #[inline(always)]
    pub fn settle(
        &self,
        before: &[R],
        state: &mut [R],
        inputs: [&Input<R>; 2],
        heading: R,
        step: R,
    ) {
        R::outlined(
            #[inline(always)]
            || self.settle_inline(before, state, inputs, heading, step),
        );
    }

    #[inline(always)]
    fn settle_inline(
        &self,
        before: &[R],
        state: &mut [R],
        [start, end]: [&Input<R>; 2],
        heading: R,
        step: R,
    ) {
        if self.settles
            && let Some(actuator) = &self.actuator
        {
            let zero = R::constant(0.0);
            let (_, speed) = actuator.derivative(before[0], before[1], start.command);
            let (mut drive, _) = actuator.derivative(state[0], state[1], end.command);
            let earlier = self.path::<true>(before, start, false);
            let path = self.path::<true>(state, end, false);
            let began = self.motion(actuator, before[1], speed, &earlier, heading);
            let rests = self.motion(actuator, state[1], zero, &path, zero);
            for effect in &self.effects {
                (state[0], state[1]) = effect
                    .action
                    .settle(state[0], state[1], drive, &began, step);
                drive = effect.action.drive(drive, &rests);
            }
        }
        let (any, flow) = self.filters;
        if !any {
            return;
        }
        let earlier = self.path::<true>(before, start, flow);
        let later = self.path::<true>(state, end, flow);
        for output in Output::ALL {
            let mut old = self.output::<true>(output, before, &earlier);
            let mut new = self.output::<true>(output, state, &later);
            for effect in self.on(output) {
                let own = &mut state[effect.states.clone()];
                effect.action.filter(own, old, new, step);
                old = effect
                    .action
                    .measure(&before[effect.states.clone()], old, &earlier.moment);
                new = effect.action.measure(own, new, &later.moment);
            }
        }
    }

    #[inline(always)]
    fn on(&self, output: Output) -> impl Iterator<Item = &Placed<R>> {
        self.effects
            .iter()
            .filter(move |effect| effect.output == Some(output))
    }

    /// The value of an output before its sensor; zero where it is not observed.
    #[inline(always)]
    fn output<const EFFECTS: bool>(&self, output: Output, state: &[R], path: &Path<R>) -> R {
        match output {
            _ if !self.observes[output as usize] => R::constant(0.0),
            Output::Spool => match self.spool_gain {
                Some(gain) => gain * path.spool,
                None => path.spool,
            },
            Output::Flow => path.flow,
            Output::Position => match self.piston_speed {
                Some(_) => state[self.position::<EFFECTS>(state.len())],
                None => path.spool,
            },
        }
    }

    /// The outputs in the order of [`Output::ALL`]; those that are not observed are zero. `input` has the command that
    /// acts.
    #[inline(always)]
    pub fn observe<const EFFECTS: bool>(&self, state: &[R], input: &Input<R>) -> [R; 3] {
        match EFFECTS {
            true => R::outlined(
                #[inline(always)]
                || self.observe_inline::<true>(state, input),
            ),
            false => self.observe_inline::<false>(state, input),
        }
    }

    #[inline(always)]
    fn observe_inline<const EFFECTS: bool>(&self, state: &[R], input: &Input<R>) -> [R; 3] {
        let path = self.path::<EFFECTS>(state, input, self.observes[1]);
        let mut outputs = [R::constant(0.0); 3];
        for output in Output::ALL {
            let mut value = self.output::<EFFECTS>(output, state, &path);
            if EFFECTS {
                for effect in self.on(output) {
                    let own = &state[effect.states.clone()];
                    value = effect.action.measure(own, value, &path.moment);
                }
                if let Some(correction) = self.correction_at(Port::Measurement)
                    && correction.output == Some(output)
                {
                    let signal = match (correction.signal, &self.actuator) {
                        (Signal::Command, _) => input.command,
                        (Signal::Time, _) => input.time,
                        (Signal::Speed, Some(actuator)) => {
                            actuator.derivative(state[0], state[1], input.command).1
                        }
                        _ => path.spool,
                    };
                    value = value + correction.at(signal);
                }
            }
            outputs[output as usize] = value;
        }
        outputs
    }
}
