//! The servo valve: an actuator that moves a spool, a valve whose openings follow the spool, and a piston that is driven by
//! its flow.

mod blocked;
mod bounds;
mod records;

pub use records::{parameters_for, remarks, scale_of, structure_for};

use super::equations::{BaseModel, Equations, Shown, WithEquations};
use crate::model::actuator::Actuator;
use crate::model::declare::Declare;
use crate::model::effects::{Moment, Motion, Port, Stage};
use crate::model::ports::Ports;
use crate::model::setting::{Initial, Setting};
use crate::model::valve::{Drop, Meter, Pressures, Valve, ValveForm};
use crate::model::{Input, Output, Outputs, Pace, Parameter, Real};
use crate::record::Channel;
use serde::{Deserialize, Serialize};

/// Loop gain K of the actuator, 1/s.
pub const GAIN: &str = "gain";
/// Lag T of the actuator, s.
pub const TIME_CONSTANT: &str = "time_constant";
/// Saturation S of the actuator's error, in the unit of the command.
pub const SATURATION: &str = "saturation";
/// Where the spool is at the first row, in the unit of the command.
const INITIAL_SPOOL: &str = "initial_spool";
/// Measured spool over spool in the unit of the command.
pub const SPOOL_GAIN: &str = "spool_gain";
/// Position of a closed loop over its command in another unit.
pub const POSITION_GAIN: &str = "position_gain";
/// Position of a closed loop at zero command in another unit, mm.
pub const POSITION_ZERO: &str = "position_zero";
/// Area of the piston, cm2.
pub const PISTON_AREA: &str = "piston_area";

/// mm/s of a piston of 1 cm2 for each L/min.
const PISTON_SPEED: f64 = 1e-3 / 60.0 / 1e-4 * 1e3;
/// Pressure drop that flow forces are related to where pressures are measured, bar: at which servo valves are rated.
const REFERENCE_DROP: f64 = 70.0;

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

/// Which way a valve opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Polarity {
    /// A positive spool connects P with A.
    #[default]
    Positive,
    /// A positive spool connects P with B: the measured flow falls where the command rises.
    Negative,
}

impl Polarity {
    fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
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

/// Which parts the servo valve has.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ServoValve {
    /// What moves the spool.
    pub drive: Drive,
    /// The unit of the measured spool where it is not the command's: the parameter `spool_gain` converts.
    pub spool_unit: Option<String>,
    /// What a measured position is.
    pub piston: Piston,
    /// Which way the valve opens.
    pub polarity: Polarity,
    /// Whether an integrated position falls where the flow is positive: the cylinder is connected the other way round.
    pub reversed: bool,
    /// The valve, where flow or an integrated position is observed.
    pub valve: Option<ValveForm>,
}

impl ServoValve {
    /// An actuator with this valve.
    pub fn with(valve: ValveForm) -> Self {
        Self {
            valve: Some(valve),
            ..Self::default()
        }
    }

    fn moves_a_spool(&self) -> bool {
        self.drive == Drive::Actuator
    }

    /// Whether the position is that of a loop whose command is in another unit.
    fn converts_position(&self, setting: &Setting) -> bool {
        let is_loop = setting.observes(Output::Position) && self.piston == Piston::Servo;
        is_loop && setting.command_unit != self.unit(setting, Output::Position)
    }

    /// Whether it integrates a position from the flow.
    pub(crate) fn integrates_position(&self, setting: &Setting) -> bool {
        setting.observes(Output::Position) && self.piston == Piston::Integrated
    }

    /// Whether an output that is observed follows from the flow of a valve.
    pub fn needs_valve(&self, setting: &Setting) -> bool {
        let mut observed = setting.observed.iter();
        observed.any(|&output| self.follows_flow(output) || output.is_of_blocked_ports())
    }
}

impl BaseModel for ServoValve {
    fn name(&self) -> &'static str {
        "servo_valve"
    }

    fn parts(&self) -> Vec<&'static str> {
        let spool = match self.moves_a_spool() {
            true => "the loop that moves the spool, with its gain, time constant and saturation",
            false => "a spool that is where the command is",
        };
        let valve = self.valve.as_ref().map(|_| "the orifices that it opens");
        [spool].into_iter().chain(valve).collect()
    }

    fn states(&self, setting: &Setting) -> Vec<&'static str> {
        let mut names = Vec::new();
        if self.moves_a_spool() {
            names.extend(["integrator", "spool"]);
        }
        if self.integrates_position(setting) {
            names.push("position");
        }
        names
    }

    fn has(&self, port: Port) -> bool {
        match port {
            Port::Command | Port::Measurement => true,
            Port::Actuator => self.moves_a_spool(),
            Port::Area | Port::Flow => self.valve.is_some(),
        }
    }

    fn unit<'a>(&'a self, setting: &Setting<'a>, output: Output) -> &'a str {
        match output {
            Output::Spool => self.spool_unit.as_deref().unwrap_or(setting.command_unit),
            Output::Flow | Output::ReturnFlow => "L/min",
            Output::PressureA | Output::PressureB | Output::LoadPressure => "bar",
            Output::Position => "mm",
        }
    }

    fn follows_flow(&self, output: Output) -> bool {
        let integrates = output == Output::Position && self.piston == Piston::Integrated;
        integrates || self.shows_flow(output)
    }

    fn driven_by(&self) -> &'static [Channel] {
        match self.valve.as_ref().map(|valve| valve.drop) {
            None | Some(Drop::Rated) => &[],
            Some(Drop::Supply) => &[Channel::SupplyPressure],
            Some(Drop::Ports) => &[
                Channel::SupplyPressure,
                Channel::PressureA,
                Channel::PressureB,
            ],
        }
    }

    fn fastest_rate(&self, parameters: &[Parameter]) -> f64 {
        // Fixed ones too: the steps of a model stay the same when its parameters are fixed.
        let (mut gain, mut lag, mut others, mut ratio) = (None, None, 0.0f64, 1.0f64);
        for parameter in parameters {
            match parameter.name.as_str() {
                GAIN => gain = Some(parameter.high),
                TIME_CONSTANT => lag = Some(parameter.low),
                _ if parameter.pace == Some(Pace::LagRatio) => ratio = ratio.min(parameter.low),
                _ => others = others.max(parameter.fastest_rate().unwrap_or(0.0)),
            }
        }
        let loop_rate = match (gain, lag) {
            // The loop's poles are those of s² + s/T + K/T: none is larger than both of these.
            (Some(gain), Some(lag)) => (1.0 / (ratio * lag)).max((gain / lag).sqrt()),
            _ => 0.0,
        };
        loop_rate.max(others)
    }

    fn has_exact_step(&self, _setting: &Setting) -> bool {
        self.moves_a_spool()
    }

    fn carries(&self, setting: &Setting) -> bool {
        self.moves_a_spool() && self.integrates_position(setting)
    }

    fn led(&self) -> &'static [usize] {
        match self.moves_a_spool() {
            true => &[INTEGRATOR, SPOOL],
            false => &[],
        }
    }

    fn edges_follow(&self) -> &'static [&'static str] {
        &[SATURATION, GAIN, TIME_CONSTANT]
    }
}

impl WithEquations for ServoValve {
    type Equations<R: Real> = ServoValveEquations<R>;

    #[inline(always)]
    fn equations<R: Real>(
        &self,
        setting: &Setting,
        parameters: &mut dyn Declare<R>,
    ) -> ServoValveEquations<R> {
        let (scale, unit) = (setting.full_scale, setting.command_unit);
        let mut take = |declare: &dyn Fn() -> Parameter| parameters.parameter(declare);
        let actuator = self.moves_a_spool().then(|| {
            Actuator::new(
                take(&|| Parameter::log(GAIN, "1/s", 1.0, 200.0, 5000.0).paced(Pace::Rate)),
                take(&|| {
                    Parameter::log(TIME_CONSTANT, "s", 5e-4, 0.01, 0.1).paced(Pace::TimeConstant)
                }),
                take(&|| {
                    Parameter::log(SATURATION, unit, 0.005 * scale, 0.5 * scale, 10.0 * scale)
                }),
            )
        });
        let free = self.moves_a_spool() && setting.initial == Initial::Free;
        let initial_spool = free.then(|| {
            let (low, high) = (-1.5 * scale, 1.5 * scale);
            take(&|| Parameter::linear(INITIAL_SPOOL, unit, low, 0.0, high))
        });
        let spool_gain = self.spool_unit.as_ref().map(|spool| {
            let unit = format!("{spool}/{unit}");
            take(&|| Parameter::log(SPOOL_GAIN, &unit, 1e-3, 1.0, 1e3))
        });
        let position_scale = self.converts_position(setting).then(|| {
            let gain = format!("mm/{unit}");
            [
                take(&|| Parameter::log(POSITION_GAIN, &gain, 1e-3, 1.0, 1e3)),
                take(&|| Parameter::linear(POSITION_ZERO, "mm", -1e4, 0.0, 1e4)),
            ]
        });
        let valve = self
            .valve
            .as_ref()
            .map(|form| Valve::new(form, &mut *parameters));
        // 1 L/min = 1e-3/60 m³/s, over 1 cm² = 1e-4 m², in mm/s.
        let direction = if self.reversed { -1.0 } else { 1.0 };
        let speed = R::constant(direction * PISTON_SPEED);
        let piston_speed = self.integrates_position(setting).then(|| {
            let area =
                parameters.parameter(&|| Parameter::log(PISTON_AREA, "cm2", 1e-2, 10.0, 1e4));
            (speed / area).named("piston_speed")
        });
        ServoValveEquations {
            actuator,
            valve,
            initial_spool,
            spool_gain,
            position_scale,
            piston_speed,
            full_opening: self.polarity.sign() * scale,
            observes: Outputs::from_fn(|output| setting.observes(output)),
            observes_blocked_ports: setting.observes_blocked_ports(),
        }
    }
}

/// The servo valve with values for its parameters.
#[derive(Debug, Clone)]
pub struct ServoValveEquations<R> {
    actuator: Option<Actuator<R>>,
    valve: Option<Valve<R>>,
    initial_spool: Option<R>,
    spool_gain: Option<R>,
    /// Gain and zero of a loop's position.
    position_scale: Option<[R; 2]>,
    /// mm/s of piston for each L/min.
    piston_speed: Option<R>,
    /// The spool, in the unit of the command, at which the valve is fully open from P to A.
    full_opening: f64,
    observes: Outputs<bool>,
    observes_blocked_ports: bool,
}

/// Spool, opening and flows at one instant: what the meter shows, what moves a load, and what is drawn from the supply; and what
/// supplies it.
struct Path<R> {
    spool: R,
    flow: R,
    load: R,
    drawn: R,
    pressures: Option<Pressures<R>>,
    moment: Moment<R>,
}

/// The actuator's states.
const INTEGRATOR: usize = 0;
const SPOOL: usize = 1;

impl<R: Real> ServoValveEquations<R> {
    /// The state that is the piston's position.
    #[inline(always)]
    fn position<'a>(&self, state: &'a mut [R]) -> &'a mut R {
        // Each a number that is known when this is compiled.
        match self.actuator {
            Some(_) => &mut state[2],
            None => &mut state[0],
        }
    }

    /// Spool position in the unit of the command.
    #[inline(always)]
    fn spool(&self, state: &[R], input: &Input<R>) -> R {
        match self.actuator {
            Some(_) => state[SPOOL],
            None => input.command,
        }
    }

    /// What passes from the spool to the flow.
    #[inline(always)]
    fn path<P: Ports<R>>(
        &self,
        ports: &P,
        state: &[R],
        input: &Input<R>,
        with_flow: bool,
    ) -> Path<R> {
        P::outlined(
            #[inline(always)]
            || {
                let zero = R::constant(0.0);
                let speed = match &self.actuator {
                    // What is fed forward of the motion knows no flow force: that follows from where the spool is put.
                    Some(actuator) => {
                        let speed = actuator.speed(state[INTEGRATOR], state[SPOOL]);
                        ports.speed(
                            state,
                            speed,
                            &motion(actuator, state[SPOOL], speed, Felt::nothing(), zero),
                        )
                    }
                    None => zero,
                };
                let spool = ports.place(state, self.spool(state, input), speed);
                let mut opening = spool;
                let (mut flows, mut drop, mut relative_drop) = (None, zero, zero);
                let mut supplied = None;
                if let Some(valve) = &self.valve {
                    opening = (spool * R::constant(100.0 / self.full_opening)).named("opening");
                    let mut pressures = valve.supplied(&Pressures::of(input));
                    (opening, pressures.supply) =
                        ports.opening_and_supply(state, opening, pressures.supply);
                    drop = pressures.supply - pressures.tank;
                    relative_drop = match valve.rated_drop() {
                        Some(rated) => drop / rated,
                        None => drop * R::constant(1.0 / REFERENCE_DROP),
                    };
                    opening = ports.corrected_opening(opening);
                    if with_flow {
                        flows = Some((valve.meter(), valve.flows_from(opening, &pressures)));
                    }
                    supplied = Some(pressures);
                }
                let moment = Moment {
                    time: input.time,
                    temperature: input.temperature,
                    opening,
                    drop,
                    relative_drop,
                };
                let (drawn, load) = match flows {
                    Some((Meter::Load, flows)) => (flows.load().named("flow"), None),
                    Some((Meter::Supply, flows)) => {
                        let drawn = flows.supply().named("flow");
                        (ports.delivered(drawn, &moment), Some(flows.load()))
                    }
                    None => (zero, None),
                };
                let flow = ports.flow(drawn, &moment);
                Path {
                    spool,
                    flow,
                    load: load.map_or(flow, |load| ports.flow(load, &moment)),
                    drawn,
                    pressures: supplied,
                    moment,
                }
            },
        )
    }

    /// What a spool feels of the flow that it lets pass.
    #[inline(always)]
    fn felt(&self, path: &Path<R>) -> Felt<R> {
        let opening = path.moment.opening * R::constant(0.01 * self.full_opening);
        Felt {
            load: match &self.valve {
                None => path.spool,
                Some(_) => opening * path.moment.relative_drop,
            },
            drop: path.moment.drop,
        }
    }

    /// The same of a spool on which what acts need not feel it.
    #[inline(always)]
    fn felt_if_asked<P: Ports<R>>(&self, ports: &P, state: &[R], input: &Input<R>) -> Felt<R> {
        if P::ANYTHING && ports.feels_load() {
            return self.felt(&self.path(ports, state, input, false));
        }
        Felt::nothing()
    }

    /// The spool where its drive, with what pulls it, is zero: by the secant method.
    #[inline(always)]
    fn spool_at_rest<P: Ports<R>>(
        &self,
        ports: &P,
        actuator: &Actuator<R>,
        state: &mut [R],
        input: &Input<R>,
    ) {
        let mut before = input.command;
        let mut pull = self.pull_at_rest(ports, actuator, state, input, before);
        let mut spool = before + pull;
        for _ in 0..2 {
            let now = self.pull_at_rest(ports, actuator, state, input, spool);
            let change = now - pull;
            let next = spool - now * ((spool - before) / change);
            (before, pull) = (spool, now);
            spool = change.abs().if_positive(next, spool);
        }
        (state[INTEGRATOR], state[SPOOL]) = (spool, spool);
        // Where something pulls behind the integrator, that leads by as much.
        let zero = R::constant(0.0);
        let felt = self.felt(&self.path(ports, state, input, true));
        let pulled = ports.speed(state, zero, &motion(actuator, spool, zero, felt, zero));
        state[INTEGRATOR] = spool - actuator.time_constant() * pulled;
    }

    /// How far the spool would go from `spool`, where it rests, for what drives and pulls it there.
    #[inline(always)]
    fn pull_at_rest<P: Ports<R>>(
        &self,
        ports: &P,
        actuator: &Actuator<R>,
        state: &mut [R],
        input: &Input<R>,
        spool: R,
    ) -> R {
        P::outlined(
            #[inline(always)]
            || {
                let zero = R::constant(0.0);
                (state[INTEGRATOR], state[SPOOL]) = (spool, spool);
                ports.settled_spool(state, spool);
                let path = self.path(ports, state, input, true);
                let stage = Stage::first(input.command, input.time);
                let (drive, _) = rates(ports, actuator, state, input, &stage);
                let motion = motion(actuator, spool, zero, self.felt(&path), zero);
                ports.drive(state, drive, &motion) / actuator.gain()
            },
        )
    }
}

/// `(ż, ẋ)` of the loop at this stage of an integration step.
#[inline(always)]
fn rates<R: Real, P: Ports<R>>(
    ports: &P,
    actuator: &Actuator<R>,
    state: &[R],
    input: &Input<R>,
    stage: &Stage<R>,
) -> (R, R) {
    let (integrator, spool) = (state[INTEGRATOR], state[SPOOL]);
    let stage = Stage {
        saturation: actuator.saturation(),
        drop: input.supply - input.tank,
        temperature: input.temperature,
        ..*stage
    };
    let reference = ports.reference(state, input.command, spool, &stage);
    actuator.derivative(integrator, spool, reference)
}

/// What a spool feels of its valve.
struct Felt<R> {
    /// Opening times pressure drop over the reference drop, in the unit of the command.
    load: R,
    /// Pressure drop from P to T, bar.
    drop: R,
}

impl<R: Real> Felt<R> {
    #[inline(always)]
    fn nothing() -> Self {
        Self {
            load: R::constant(0.0),
            drop: R::constant(0.0),
        }
    }
}

/// How a spool moves that has this `speed` and feels this, where it can stick with this slip direction.
#[inline(always)]
fn motion<R: Real>(
    actuator: &Actuator<R>,
    spool: R,
    speed: R,
    felt: Felt<R>,
    slip_direction: R,
) -> Motion<R> {
    Motion {
        gain: actuator.gain(),
        time_constant: actuator.time_constant(),
        spool,
        speed,
        slip_direction,
        load: felt.load,
        drop: felt.drop,
    }
}

impl<R: Real, P: Ports<R>> Equations<R, P> for ServoValveEquations<R> {
    #[inline(always)]
    fn initial(
        &self,
        ports: &P,
        state: &mut [R],
        input: &Input<R>,
        measured: &Outputs<R>,
        initial: Initial,
    ) {
        if let Some(actuator) = &self.actuator {
            let spool = match (initial, self.initial_spool) {
                (Initial::Free, Some(spool)) => spool,
                (Initial::Rest, _) => R::constant(0.0),
                _ => input.command,
            };
            (state[INTEGRATOR], state[SPOOL]) = (spool, spool);
            if P::ANYTHING && ports.pulls() && initial == Initial::Equilibrium {
                self.spool_at_rest(ports, actuator, state, input);
            }
        }
        if self.actuator.is_some() {
            ports.settled_spool(state, state[SPOOL]);
        }
        if self.piston_speed.is_some() {
            *self.position(state) = measured[Output::Position];
        }
        // The flow drawn from a supply that gives way under it, by iteration.
        if P::ANYTHING && ports.follows_flow() {
            P::outlined(
                #[inline(always)]
                || {
                    for _ in 0..4 {
                        let drawn = self.path(ports, state, input, true).drawn;
                        ports.settled_supply(state, drawn);
                    }
                },
            );
        }
    }

    #[inline(always)]
    fn derivative(
        &self,
        ports: &P,
        state: &[R],
        input: &Input<R>,
        stage: &Stage<R>,
        slope: &mut [R],
    ) {
        P::outlined(
            #[inline(always)]
            || {
                let follows = P::ANYTHING && ports.follows_flow();
                let with_flow = self.piston_speed.is_some() || follows;
                // Once for both: what acts on the spool, and what follows the flow.
                let path = match with_flow || (P::ANYTHING && ports.feels_load()) {
                    true => Some(self.path(ports, state, input, with_flow)),
                    false => None,
                };
                if let Some(actuator) = &self.actuator {
                    let (drive, speed) = rates(ports, actuator, state, input, stage);
                    let felt = path
                        .as_ref()
                        .map_or(Felt::nothing(), |path| self.felt(path));
                    let motion = motion(actuator, state[SPOOL], speed, felt, stage.slip_direction);
                    let drive = ports.corrected_drive(drive, actuator.gain(), state[SPOOL], speed);
                    slope[INTEGRATOR] = ports.drive(state, drive, &motion);
                    slope[SPOOL] = ports.followed(state, speed, &motion, slope);
                }
                if let Some(path) = &path {
                    if let Some(speed) = self.piston_speed {
                        *self.position(slope) = speed * path.load;
                    }
                    ports.drawn(state, path.drawn, slope);
                }
            },
        );
    }

    #[inline(always)]
    fn shown(&self, ports: &P, state: &[R], input: &Input<R>, with_flow: bool) -> Shown<R> {
        let path = self.path(ports, state, input, with_flow);
        let seen = ports.seen(state, path.spool, input.time);
        let zero = R::constant(0.0);
        let mut outputs = Outputs::all(zero);
        if self.observes[Output::Spool] {
            outputs[Output::Spool] = match self.spool_gain {
                Some(gain) => gain * seen,
                None => seen,
            };
        }
        if self.observes[Output::Flow] {
            outputs[Output::Flow] = path.flow;
        }
        if self.observes[Output::Position] {
            outputs[Output::Position] = match self.piston_speed {
                Some(_) if self.actuator.is_some() => state[2],
                Some(_) => state[0],
                None => match self.position_scale {
                    Some([gain, zero]) => gain * seen + zero,
                    None => seen,
                },
            };
        }
        if let (true, Some(valve), Some(pressures)) =
            (self.observes_blocked_ports, &self.valve, &path.pressures)
            && let Some(blocked) = valve.blocked(path.moment.opening, pressures)
        {
            if self.observes[Output::ReturnFlow] {
                outputs[Output::ReturnFlow] = blocked.return_flow;
            }
            if self.observes[Output::PressureA] {
                outputs[Output::PressureA] = blocked.a;
            }
            if self.observes[Output::PressureB] {
                outputs[Output::PressureB] = blocked.b;
            }
            if self.observes[Output::LoadPressure] {
                outputs[Output::LoadPressure] = blocked.a - blocked.b;
            }
        }
        Shown {
            outputs,
            moment: path.moment,
            spool: path.spool,
        }
    }

    #[inline(always)]
    fn slip_direction(&self, ports: &P, state: &[R], input: &Input<R>) -> R {
        let zero = R::constant(0.0);
        if !P::ANYTHING {
            return zero;
        }
        match &self.actuator {
            Some(actuator) if ports.sticks() => P::outlined(
                #[inline(always)]
                || {
                    let felt = self.felt_if_asked(ports, state, input);
                    let stage = Stage::first(input.command, input.time);
                    let (drive, speed) = rates(ports, actuator, state, input, &stage);
                    let motion = motion(actuator, state[SPOOL], speed, felt, zero);
                    ports.slip_direction(state, drive, motion)
                },
            ),
            _ => zero,
        }
    }

    #[inline(always)]
    fn end_step(
        &self,
        ports: &P,
        before: &[R],
        state: &mut [R],
        [start, end]: [&Input<R>; 2],
        slip_direction: R,
        step: R,
    ) {
        if !P::ANYTHING || !ports.ends_steps() {
            return;
        }
        let Some(actuator) = &self.actuator else {
            return;
        };
        let zero = R::constant(0.0);
        let stage = Stage {
            since: step,
            slip_direction,
            saturation: actuator.saturation(),
            ..Stage::first(start.command, start.time)
        };
        let (_, speed) = rates(
            ports,
            actuator,
            before,
            start,
            &Stage::first(start.command, start.time),
        );
        let (drive, _) = rates(ports, actuator, state, end, &stage);
        let earlier = self.felt_if_asked(ports, before, start);
        let later = self.felt_if_asked(ports, state, end);
        let began = motion(actuator, before[SPOOL], speed, earlier, slip_direction);
        let rests = motion(actuator, state[SPOOL], zero, later, zero);
        let ended = (state[INTEGRATOR], state[SPOOL]);
        (state[INTEGRATOR], state[SPOOL]) =
            ports.end_step(state, ended, drive, &began, &rests, step);
        ports.remember(state, end.command, state[SPOOL], &stage);
    }

    #[inline(always)]
    fn speed(&self, _: &P, state: &[R], input: &Input<R>) -> R {
        match &self.actuator {
            Some(actuator) => actuator.speed(state[INTEGRATOR], state[SPOOL]),
            None => self.spool(state, input),
        }
    }

    #[inline(always)]
    fn exact_step(&self, _: &P) -> Option<&Actuator<R>> {
        self.actuator.as_ref()
    }

    #[inline(always)]
    fn carried(&self, ports: &P, state: &[R], input: &Input<R>) -> R {
        match self.piston_speed {
            Some(speed) => speed * self.path(ports, state, input, true).load,
            None => R::constant(0.0),
        }
    }
}
