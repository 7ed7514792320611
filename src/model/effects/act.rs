//! Where an effect attaches, and what it can do there. Every method's default changes nothing.

use crate::model::{Input, Real};
use serde::{Deserialize, Serialize};
use std::fmt;

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

/// How the spool moves, in the unit of the command.
#[derive(Debug, Clone, Copy)]
pub struct Motion<R> {
    /// Loop gain K, 1/s.
    pub gain: R,
    /// Lag T, s.
    pub time_constant: R,
    /// Where the spool is.
    pub spool: R,
    /// Spool velocity (z − x)/T.
    pub speed: R,
    /// The sign in which it moves, or sets out to move, when the integration step begins; zero while it sticks.
    pub slip_direction: R,
    /// The opening of the valve times the pressure drop over the reference one, where [`Act::feels_load`] asks for it.
    pub load: R,
    /// The pressure drop from P to T, bar, where that is asked for.
    pub drop: R,
}

/// Where in an integration step something is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Stage<R> {
    /// Time since the step began, s.
    pub since: R,
    /// Time from the record's first row to the start of the step, s; where the command is held, to the row that the step is in.
    pub time: R,
    /// The command when it began. From there the command goes straight.
    pub command: R,
    /// The sign in which what can stick moved, or set out to move, when it began; zero while it sticks.
    pub slip_direction: R,
    /// Where the drive of the spool saturates, in the unit of the command.
    pub saturation: R,
    /// The pressure drop from P to T that is measured, bar, where a reference is asked for; zero where none is.
    pub drop: R,
    /// The temperature that is measured, degC, where a reference is asked for; zero where none is.
    pub temperature: R,
}

impl<R: Real> Stage<R> {
    /// The beginning of a step with this `command` and `time`, of what cannot stick and has no drive.
    #[inline(always)]
    pub fn first(command: R, time: R) -> Self {
        Self {
            since: R::constant(0.0),
            time,
            command,
            slip_direction: R::constant(0.0),
            saturation: R::constant(0.0),
            drop: R::constant(0.0),
            temperature: R::constant(0.0),
        }
    }
}

/// When something is observed, and in what surroundings.
#[derive(Debug, Clone, Copy)]
pub struct Moment<R> {
    /// Time since the record's first row, s.
    pub time: R,
    /// Measured temperature, degC.
    pub temperature: R,
    /// Opening of the valve, % of full scale.
    pub opening: R,
    /// Pressure drop from P to T, bar.
    pub drop: R,
    /// The same over the reference drop: the rated one, or 70 bar where pressures are measured.
    pub relative_drop: R,
}

impl<R: Real> Moment<R> {
    /// The moment of `input` where no valve opens.
    pub fn of(input: &Input<R>) -> Self {
        Self {
            time: input.time,
            temperature: input.temperature,
            opening: R::constant(0.0),
            drop: R::constant(0.0),
            relative_drop: R::constant(0.0),
        }
    }
}

/// An effect with values for its parameters. `own` are the states that belong to it.
pub trait Act<R: Real> {
    /// How long the command takes to arrive, s: of the catalogue's `delay` alone.
    fn delay(&self) -> Option<R> {
        None
    }

    /// The command after the effect. Called with each command in turn, so that `own` can remember the last.
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command
    }

    /// Whether an effect on the command acts within integration steps, by [`Act::reference`]. One on the actuator always does.
    fn acts_on_the_reference(&self) -> bool {
        false
    }

    /// The reference that the loop compares a spool at `spool` with, in an integration step that began with these states.
    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, _spool: R, _stage: &Stage<R>) -> R {
        command
    }

    /// The effect's states after an integration step that ended with this command and spool.
    #[inline(always)]
    fn remember(&self, _own: &mut [R], _command: R, _spool: R, _stage: &Stage<R>) {}

    /// The effect's states when the spool has long been at `spool`.
    #[inline(always)]
    fn settled_spool(&self, _own: &mut [R], _spool: R) {}

    /// Whether a spool at rest feels the effect in its drive or its reference.
    fn pulls(&self) -> bool {
        false
    }

    /// Whether [`Motion::load`] and [`Motion::drop`] count; they are zero where nothing needs them.
    fn feels_load(&self) -> bool {
        true
    }

    /// What drives the spool, ż in command units per second.
    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, _motion: &Motion<R>) -> R {
        drive
    }

    /// The spool's velocity, in command units per second.
    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed
    }

    /// Sets the rates of change of the effect's states that follow the velocity that [`Act::speed`] is given.
    #[inline(always)]
    fn follow(&self, _own: &[R], _speed: R, _motion: &Motion<R>, _slope: &mut [R]) {}

    /// Whether the spool can stick, so that [`Act::slip_direction`] counts.
    fn sticks(&self) -> bool {
        false
    }

    /// The slip direction of a spool that has this `drive` when an integration step begins.
    #[inline(always)]
    fn slip_direction(&self, _own: &[R], _drive: R, motion: &Motion<R>) -> R {
        motion.slip_direction
    }

    /// Where the integrator (z, which leads the spool) and the spool are after an integration step of `step` seconds that
    /// ended with these and this `drive`; `start` is the motion at its start. `own` can remember how it ended.
    #[inline(always)]
    fn end_step(
        &self,
        _own: &mut [R],
        lead: R,
        spool: R,
        _drive: R,
        _start: &Motion<R>,
        _step: R,
    ) -> (R, R) {
        (lead, spool)
    }

    /// Where a spool is that an integration step has at `spool`, moving at `speed`.
    #[inline(always)]
    fn place(&self, _own: &[R], spool: R, _speed: R) -> R {
        spool
    }

    /// Where the transducer of the loop, which is recorded, shows a spool at `spool`, at a `time` since the record's first row, s.
    #[inline(always)]
    fn seen(&self, _own: &[R], spool: R, _time: R) -> R {
        spool
    }

    /// The opening, % of full scale.
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening
    }

    /// The supply pressure, bar.
    #[inline(always)]
    fn supply(&self, _own: &[R], supply: R) -> R {
        supply
    }

    /// Sets the rates of change of the effect's states that follow the magnitude of the `flow` drawn from the supply.
    #[inline(always)]
    fn drawn(&self, _own: &[R], _flow: R, _slope: &mut [R]) {}

    /// The effect's states when that flow has long been `flow`.
    #[inline(always)]
    fn settled_supply(&self, _own: &mut [R], _flow: R) {}

    /// What the supply delivers, L/min: asked where the flow is measured in the pressure line, before [`Act::flow`].
    #[inline(always)]
    fn delivered(&self, flow: R, _moment: &Moment<R>) -> R {
        flow
    }

    /// The flow, L/min.
    #[inline(always)]
    fn flow(&self, flow: R, _moment: &Moment<R>) -> R {
        flow
    }

    /// The effect's states when what it filters, or the command that it gets, has long been `value`.
    #[inline(always)]
    fn settled(&self, _own: &mut [R], _value: R) {}

    /// Advances the effect's states by a step in which what it filters went straight from `before` to `after`.
    #[inline(always)]
    fn filter(&self, _own: &mut [R], _before: R, _after: R, _step: R) {}

    /// The measured value.
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, _moment: &Moment<R>) -> R {
        value
    }
}

/// The value of a first-order lag of `time_constant` after a `step` in which its input went straight from `before` to
/// `after`: exact for such an input, and the input itself where the time constant is zero.
#[inline(always)]
pub(super) fn lagged<R: Real>(value: R, before: R, after: R, time_constant: R, step: R) -> R {
    // Late commands cut intervals into pieces, some of which have no length.
    let step = step.max(R::constant(1e-12));
    let (of_step, of_rise) = (step / time_constant).caught_up();
    value + (before - value) * of_step + (after - before) * of_rise
}
