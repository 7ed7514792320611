//! The figures of the card: what each is, what it needs, and how it is read off the tests.

use super::bench::Bench;
use super::blocked::BlockedPorts;
use super::construction::CycleFigures;
use super::cycle::Cycle;
use super::quantity::{AMPLITUDES, Quantity};
use super::response::Response;
use super::step::Step;
use super::threshold::threshold;
use crate::evaluate::Problem;
use crate::model::effects::Host;
use crate::model::valve::{LEAKAGE_AREA, OPENING_OFFSET};
use crate::model::{Output, Structure};

/// Everything that is done with a valve on the bench.
pub(super) struct Tests {
    pub(super) cycle: Cycle,
    pub(super) responses: Vec<Response>,
    pub(super) step: Option<Step>,
    figures: Option<CycleFigures>,
    pressure_gain: Option<f64>,
    leakage: Option<f64>,
    threshold: Option<f64>,
}

impl Tests {
    pub(super) fn of(bench: &Bench) -> Self {
        Self::with(bench, |amplitude| Response::of(bench, amplitude))
    }

    /// The same of a valve that differs little from this one's: of its responses only the limits.
    pub(super) fn near(&self, bench: &Bench) -> Self {
        Self::with(bench, |amplitude| self.response(amplitude)?.near(bench))
    }

    fn with(bench: &Bench, response: impl Fn(f64) -> Option<Response>) -> Self {
        let full_scale = bench.structure.full_scale;
        let cycle = Cycle::of(bench);
        let figures = cycle.figures(full_scale);
        let null = figures
            .as_ref()
            .map(|figures| 0.01 * figures.null * full_scale);
        let blocked = BlockedPorts::of(bench, null.unwrap_or(0.0));
        let valve = bench.structure.valve().zip(null);
        let leakage = match &blocked {
            Some(blocked) => Some(blocked.leakage),
            None => valve.map(|(_, null)| leakage(bench, null)),
        };
        let responses = AMPLITUDES.iter().filter_map(|&share| response(share));
        Self {
            responses: responses.collect(),
            step: Step::of(bench),
            cycle,
            threshold: figures.and_then(|own| threshold(bench, own.hysteresis)),
            figures,
            pressure_gain: blocked.and_then(|blocked| blocked.gain),
            leakage,
        }
    }

    /// The value of every figure of [`FIGURES`].
    pub(super) fn values(&self) -> Vec<Option<f64>> {
        let value = |figure: &Definition| {
            let value = self
                .value(figure.source)
                .filter(|value| value.is_finite())?;
            // What is left by arithmetic is not a figure.
            let nothing = figure.unit == "%" && value.abs() < 1e-4;
            Some(if nothing { 0.0 } else { value })
        };
        FIGURES.iter().map(value).collect()
    }

    fn response(&self, amplitude: f64) -> Option<&Response> {
        let mut all = self.responses.iter();
        all.find(|response| response.amplitude == amplitude)
    }

    fn value(&self, source: Source) -> Option<f64> {
        match source {
            Source::Cycle(figure) => figure(self.figures.as_ref()?),
            Source::PressureGain => self.pressure_gain,
            Source::Leakage => self.leakage,
            Source::Threshold => self.threshold,
            Source::AmplitudeLimit(amplitude) => self.response(amplitude)?.amplitude_limit,
            Source::PhaseLimit(amplitude) => self.response(amplitude)?.phase_limit,
            Source::StepTime => Some(1e3 * self.step.as_ref()?.time?),
            Source::Overshoot => Some(self.step.as_ref()?.overshoot),
        }
    }
}

/// Share of full scale to both sides of the null in which the least flow is sought, and in how many thirds of thirds.
const NULL: (f64, usize) = (0.03, 24);

/// The least flow out of the supply, L/min, near the command `null`.
fn leakage(bench: &Bench, null: f64) -> f64 {
    let bench = bench.with_flow_of_supply();
    let flow = |command: f64| bench.settled(&[command], 1.0)[0][1];
    let reach = NULL.0 * bench.structure.full_scale;
    let (mut low, mut high) = (null - reach, null + reach);
    for _ in 0..NULL.1 {
        let third = (high - low) / 3.0;
        match flow(low + third) < flow(high - third) {
            true => high -= third,
            false => low += third,
        }
    }
    flow(0.5 * (low + high))
}

/// What a figure cannot do without.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Needs {
    /// A valve whose flow, or the position that integrates it, was measured, with areas up to this opening, %.
    Valve(f64),
    /// The same, and something that was fitted to what leaks.
    Leak,
    /// Pressures that were measured with blocked ports.
    Pressure,
    /// A spool that is moved by an actuator.
    Actuator,
    /// A command and its answer.
    Answer,
}

/// The test that a figure is read off, of the model as of a measurement.
#[derive(Clone, Copy)]
pub(super) enum Source {
    /// The slow cycle.
    Cycle(fn(&CycleFigures) -> Option<f64>),
    /// The load pressure with blocked ports.
    PressureGain,
    /// The flow from P to T at null.
    Leakage,
    /// A slow reversal of the command.
    Threshold,
    /// The frequency response at this amplitude, %: where the gain has fallen by 3 dB.
    AmplitudeLimit(f64),
    /// The same: where the phase has fallen to −90°.
    PhaseLimit(f64),
    /// The step: how long it takes.
    StepTime,
    /// The same: how far it goes beyond its end.
    Overshoot,
}

/// Why a cycle has no figures.
pub(super) const NO_NULL: &str = "the output does not follow the command on both sides of the null";

/// A figure before it has a value.
pub(super) struct Definition {
    pub(super) quantity: Quantity,
    pub(super) label: &'static str,
    /// `command` stands for the command's unit.
    pub(super) unit: &'static str,
    pub(super) needs: Needs,
    note: &'static str,
    pub(super) source: Source,
}

impl Definition {
    /// Its unit on a valve of this structure.
    pub(super) fn unit_on(&self, structure: &Structure) -> String {
        self.unit.replace("command", &structure.command_unit)
    }

    /// Whether it is zero for whatever values the parameters have where the model lacks what causes it. A spool that moves
    /// overshoots or does not: that follows from the values.
    pub(super) fn has_a_cause_of_its_own(&self) -> bool {
        self.needs != Needs::Actuator
    }

    /// Why the tests do not show it.
    pub(super) fn miss(&self) -> &'static str {
        match self.needs {
            Needs::Actuator => "not reached",
            Needs::Pressure => {
                "the load pressure does not go through 60 % of the supply's on both sides"
            }
            _ => NO_NULL,
        }
    }
}

const fn figure(
    quantity: Quantity,
    label: &'static str,
    unit: &'static str,
    needs: Needs,
    note: &'static str,
    source: Source,
) -> Definition {
    Definition {
        quantity,
        label,
        unit,
        needs,
        note,
        source,
    }
}

/// Openings, %, up to which the areas have to be known for a figure: nearly full, since a curve is read off by hand, and the
/// end of the part that is taken as straight.
const FULL: f64 = 99.0;
const STRAIGHT_PART: f64 = 80.0;

/// All figures, in the order in which a datasheet has them.
pub(super) const FIGURES: &[Definition] = &[
    figure(
        Quantity::RatedFlow,
        "rated flow",
        "L/min",
        Needs::Valve(FULL),
        "at full command, mean of both sides",
        Source::Cycle(|cycle| cycle.rated),
    ),
    figure(
        Quantity::FlowGain,
        "flow gain",
        "L/min/command",
        Needs::Valve(STRAIGHT_PART),
        "slope from 20 to 80 % of full command",
        Source::Cycle(|cycle| Some(cycle.gain)),
    ),
    figure(
        Quantity::Asymmetry,
        "asymmetry",
        "%",
        Needs::Valve(STRAIGHT_PART),
        "flow gain of the positive side less that of the negative one",
        Source::Cycle(|cycle| Some(cycle.asymmetry)),
    ),
    figure(
        Quantity::Overlap,
        "overlap",
        "%",
        Needs::Valve(STRAIGHT_PART),
        "half the lap; below zero: underlap",
        Source::Cycle(|cycle| Some(0.5 * cycle.lap)),
    ),
    figure(
        Quantity::Lap,
        "lap",
        "%",
        Needs::Valve(STRAIGHT_PART),
        "from where the straight part of one side meets zero to where the other's does; below zero: underlap",
        Source::Cycle(|cycle| Some(cycle.lap)),
    ),
    figure(
        Quantity::Linearity,
        "linearity",
        "%",
        Needs::Valve(FULL),
        "largest deviation of the mid curve from its best straight line, of the rated flow",
        Source::Cycle(|cycle| cycle.linearity),
    ),
    figure(
        Quantity::Polarity,
        "polarity",
        "1",
        Needs::Valve(STRAIGHT_PART),
        "sign of the flow at a positive command",
        Source::Cycle(|cycle| Some(cycle.gain.signum())),
    ),
    figure(
        Quantity::Hysteresis,
        "hysteresis",
        "%",
        Needs::Answer,
        "slow cycle over full command",
        Source::Cycle(|cycle| Some(cycle.hysteresis)),
    ),
    figure(
        Quantity::Threshold,
        "threshold",
        "%",
        Needs::Answer,
        "how far the command turns back before the output follows",
        Source::Threshold,
    ),
    figure(
        Quantity::NullBias,
        "null bias",
        "%",
        Needs::Answer,
        "command of no output",
        Source::Cycle(|cycle| Some(cycle.null).filter(|null| null.abs() <= 100.0)),
    ),
    figure(
        Quantity::PressureGain,
        "pressure gain",
        "%/%",
        Needs::Pressure,
        "of supply per % of full command, A and B blocked, from -40 to 40 % of supply",
        Source::PressureGain,
    ),
    figure(
        Quantity::Leakage,
        "internal leakage",
        "L/min",
        Needs::Leak,
        "from P to T near null, A and B blocked",
        Source::Leakage,
    ),
    figure(
        Quantity::AmplitudeLimit(AMPLITUDES[0]),
        "-3 dB at 5 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::AmplitudeLimit(AMPLITUDES[0]),
    ),
    figure(
        Quantity::PhaseLimit(AMPLITUDES[0]),
        "-90° at 5 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::PhaseLimit(AMPLITUDES[0]),
    ),
    figure(
        Quantity::AmplitudeLimit(AMPLITUDES[1]),
        "-3 dB at 25 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::AmplitudeLimit(AMPLITUDES[1]),
    ),
    figure(
        Quantity::PhaseLimit(AMPLITUDES[1]),
        "-90° at 25 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::PhaseLimit(AMPLITUDES[1]),
    ),
    figure(
        Quantity::AmplitudeLimit(AMPLITUDES[2]),
        "-3 dB at 90 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::AmplitudeLimit(AMPLITUDES[2]),
    ),
    figure(
        Quantity::PhaseLimit(AMPLITUDES[2]),
        "-90° at 90 %",
        "Hz",
        Needs::Actuator,
        "",
        Source::PhaseLimit(AMPLITUDES[2]),
    ),
    figure(
        Quantity::StepTime,
        "step 0-100 %",
        "ms",
        Needs::Actuator,
        "until 90 % of the way",
        Source::StepTime,
    ),
    figure(
        Quantity::Overshoot,
        "overshoot",
        "%",
        Needs::Actuator,
        "of that step",
        Source::Overshoot,
    ),
];

/// What shows the load pressure of a valve with blocked ports.
const PRESSURES: [Output; 3] = [Output::LoadPressure, Output::PressureA, Output::PressureB];

/// What the record gave, and what the bench has.
pub(super) struct Conditions {
    drop: Option<f64>,
    moves: bool,
    is_servo_valve: bool,
    leaks: bool,
    shows_pressure: bool,
    /// Pressure from P to T while the ports were blocked, bar.
    blocked_drop: Option<f64>,
    /// The opening up to which the areas are known, %.
    reach: f64,
}

impl Conditions {
    pub(super) fn of(problem: &Problem, bench: &Bench) -> Self {
        let fitted = |name: &str| {
            problem
                .parameters
                .iter()
                .any(|p| p.name == name && !p.is_fixed())
        };
        Self {
            drop: bench.drop().filter(|_| problem.structure.shows_a_flow()),
            moves: bench.actuator().is_some(),
            is_servo_valve: bench.is_servo_valve(),
            reach: bench.reach(),
            leaks: [LEAKAGE_AREA, "leakage", OPENING_OFFSET]
                .into_iter()
                .any(fitted)
                || problem.structure.observes(Output::ReturnFlow),
            shows_pressure: PRESSURES
                .into_iter()
                .any(|output| problem.structure.observes(output)),
            blocked_drop: bench.with_blocked_ports().and_then(|bench| bench.drop()),
        }
    }

    /// Why there can be no value of `figure`, if so.
    pub(super) fn lack(&self, figure: &Definition) -> Option<String> {
        Some(match figure.needs {
            Needs::Valve(_) | Needs::Leak | Needs::Pressure | Needs::Actuator
                if !self.is_servo_valve =>
            {
                "the model is of no servo valve".into()
            }
            Needs::Valve(_) if self.drop.is_none() => "no flow was measured".into(),
            Needs::Leak if self.drop.or(self.blocked_drop).is_none() => {
                "no flow was measured".into()
            }
            Needs::Pressure if !self.shows_pressure => {
                "no pressure was measured with blocked ports".into()
            }
            Needs::Valve(opening) if self.reach < opening => {
                format!(
                    "the flow is known up to an opening of {} % only",
                    self.reach
                )
            }
            Needs::Leak if !self.leaks => "nothing that leaks was fitted".into(),
            Needs::Actuator if !self.moves => "the model moves the spool directly".into(),
            _ => return None,
        })
    }

    /// What `figure` is called: a rated flow says nothing without its pressure drop.
    pub(super) fn label(&self, figure: &Definition) -> String {
        match self.drop.filter(|_| figure.quantity == Quantity::RatedFlow) {
            Some(drop) => format!("{} at {} bar", figure.label, rounded(drop)),
            None => figure.label.into(),
        }
    }

    /// The conditions of `figure`.
    pub(super) fn note(&self, figure: &Definition) -> String {
        let drop = match figure.needs {
            Needs::Leak | Needs::Pressure => self.blocked_drop.or(self.drop),
            _ => self.drop,
        };
        match (figure.needs, drop) {
            (Needs::Valve(_) | Needs::Leak | Needs::Pressure, Some(drop)) => {
                format!("{}; {} bar from P to T", figure.note, rounded(drop))
            }
            _ => figure.note.into(),
        }
    }
}

/// A pressure, bar, to two decimals.
fn rounded(drop: f64) -> f64 {
    (100.0 * drop).round() / 100.0
}
