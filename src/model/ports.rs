//! What is attached at the ports of a base model: nothing, or effects and a correction of unknown form.

use super::effects::{Act, Action, Effect, Moment, Motion, Port, Stage};
use super::free_form::{Correction, FreeForm, Signal};
use super::{Output, Real};
use std::ops::Range;

/// What is attached inside a base model, at the ports of motion, area and flow. Every default is that of nothing.
pub trait Ports<R: Real> {
    /// Whether anything can be attached: what follows that is not compiled where nothing can.
    const ANYTHING: bool;

    /// Calls `f`, as a function of its own where something is attached: what is rare must not be copied everywhere.
    fn outlined<T>(f: impl FnOnce() -> T) -> T;

    /// Whether anything pulls a spool at rest.
    #[inline(always)]
    fn pulls(&self) -> bool {
        false
    }

    /// Whether anything that acts on the spool feels what the valve is loaded with.
    #[inline(always)]
    fn feels_load(&self) -> bool {
        false
    }

    /// Whether the spool can stick.
    #[inline(always)]
    fn sticks(&self) -> bool {
        false
    }

    /// Whether anything acts on the spool where a step ends.
    #[inline(always)]
    fn ends_steps(&self) -> bool {
        false
    }

    /// Whether the states of anything that is attached follow the flow.
    #[inline(always)]
    fn follows_flow(&self) -> bool {
        false
    }

    /// The reference that the loop compares a spool at `spool` with, at this stage of an integration step.
    #[inline(always)]
    fn reference(&self, _state: &[R], command: R, _spool: R, _stage: &Stage<R>) -> R {
        command
    }

    /// Sets the states of what acts in the loop to those after a step that ended at this stage, with this command and spool.
    #[inline(always)]
    fn remember(&self, _state: &mut [R], _command: R, _spool: R, _stage: &Stage<R>) {}

    /// Sets those states to where they are when the spool has long been at `spool`.
    #[inline(always)]
    fn settled_spool(&self, _state: &mut [R], _spool: R) {}

    /// What drives the spool, after the correction and all effects.
    #[inline(always)]
    fn drive(&self, _state: &[R], drive: R, _motion: &Motion<R>) -> R {
        drive
    }

    /// What the correction adds to the drive of a spool at `spool` that moves at `speed`.
    #[inline(always)]
    fn corrected_drive(&self, drive: R, _gain: R, _spool: R, _speed: R) -> R {
        drive
    }

    /// The spool's velocity.
    #[inline(always)]
    fn speed(&self, _state: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed
    }

    /// The same, and sets the derivatives of the states that follow it.
    #[inline(always)]
    fn followed(&self, _state: &[R], speed: R, _motion: &Motion<R>, _slope: &mut [R]) -> R {
        speed
    }

    /// The slip direction of a spool with this `drive`.
    #[inline(always)]
    fn slip_direction(&self, _state: &[R], _drive: R, motion: Motion<R>) -> R {
        motion.slip_direction
    }

    /// Integrator and spool at the end of a step that `began` so and `ended` with these and this `drive`, where the spool then
    /// `rests` so.
    #[inline(always)]
    fn end_step(
        &self,
        _state: &mut [R],
        ended: (R, R),
        _drive: R,
        _began: &Motion<R>,
        _rests: &Motion<R>,
        _step: R,
    ) -> (R, R) {
        ended
    }

    /// Where a spool is that the integration has at `spool`, moving at `speed`.
    #[inline(always)]
    fn place(&self, _state: &[R], spool: R, _speed: R) -> R {
        spool
    }

    /// Where the record has a spool that is at `spool`, at a `time` since its first row, s.
    #[inline(always)]
    fn seen(&self, _state: &[R], spool: R, _time: R) -> R {
        spool
    }

    /// Opening (%) and supply pressure (bar) after all effects, and the opening after the correction.
    #[inline(always)]
    fn opening_and_supply(&self, _state: &[R], opening: R, supply: R) -> (R, R) {
        (opening, supply)
    }

    /// What the correction makes of the opening, %.
    #[inline(always)]
    fn corrected_opening(&self, opening: R) -> R {
        opening
    }

    /// What the supply delivers, L/min.
    #[inline(always)]
    fn delivered(&self, flow: R, _moment: &Moment<R>) -> R {
        flow
    }

    /// The flow, L/min.
    #[inline(always)]
    fn flow(&self, flow: R, _moment: &Moment<R>) -> R {
        flow
    }

    /// Sets the derivatives of the states that follow the flow drawn from the supply.
    #[inline(always)]
    fn drawn(&self, _state: &[R], _flow: R, _slope: &mut [R]) {}

    /// Sets those states to where they are when that flow has long been `flow`.
    #[inline(always)]
    fn settled_supply(&self, _state: &mut [R], _flow: R) {}
}

/// Nothing is attached.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bare;

impl<R: Real> Ports<R> for Bare {
    const ANYTHING: bool = false;

    #[inline(always)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        f()
    }
}

/// An effect in its place: its action, where its states are, and what it is on.
#[derive(Debug, Clone)]
pub(super) struct Placed<R> {
    pub(super) action: Action<R>,
    pub(super) states: Range<usize>,
    pub(super) output: Option<Output>,
    /// Whether it acts within the integration steps that move the spool.
    pub(super) in_steps: bool,
}

/// The effects of a structure and its correction.
#[derive(Debug, Clone)]
pub struct Attached<R> {
    pub(super) effects: Vec<Placed<R>>,
    pub(super) correction: Option<Correction<R>>,
    ends_steps: bool,
    follows_flow: bool,
    feels_load: bool,
    pulls: bool,
    sticks: bool,
}

impl<R: Real> Attached<R> {
    /// These effects and this correction; the states of effects begin with number `state`, `next` gives the values of the
    /// parameters.
    #[inline(always)]
    pub(super) fn new(
        attached: &[Effect],
        correction: Option<&FreeForm>,
        mut state: usize,
        next: &mut impl FnMut() -> R,
    ) -> Self {
        let mut effects = Vec::with_capacity(attached.len());
        let (mut follows_flow, mut feels_load) = (false, false);
        let (mut pulls, mut sticks, mut ends_steps) = (false, false, false);
        for effect in attached {
            let has_states = !effect.entry.states.is_empty();
            follows_flow |=
                has_states && effect.entry.port == Port::Flow && effect.output.is_none();
            let first = state;
            state += effect.entry.states.len();
            let action = Action::new(effect.entry.name, &mut *next);
            feels_load |= effect.entry.port == Port::Actuator && action.feels_load();
            pulls |= action.pulls();
            sticks |= action.sticks();
            let in_steps = effect.acts_in_steps_as(&action);
            ends_steps |= in_steps;
            effects.push(Placed {
                in_steps,
                action,
                states: first..state,
                output: effect.output,
            });
        }
        Self {
            effects,
            correction: correction.map(|form| Correction::new(form, next)),
            ends_steps,
            follows_flow,
            feels_load,
            pulls,
            sticks,
        }
    }

    #[inline(always)]
    pub(super) fn correction_at(&self, port: Port) -> Option<&Correction<R>> {
        match &self.correction {
            Some(correction) if correction.port == port => Some(correction),
            _ => None,
        }
    }
}

impl<R> Placed<R> {
    /// Whether it has states and is on no output.
    #[inline(always)]
    fn is_inner(&self) -> bool {
        !self.states.is_empty() && self.output.is_none()
    }
}

impl<R: Real> Ports<R> for Attached<R> {
    const ANYTHING: bool = true;

    #[inline(always)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        R::outlined(f)
    }

    fn pulls(&self) -> bool {
        self.pulls
    }

    fn feels_load(&self) -> bool {
        self.feels_load
    }

    fn sticks(&self) -> bool {
        self.sticks
    }

    fn ends_steps(&self) -> bool {
        self.ends_steps
    }

    fn follows_flow(&self) -> bool {
        self.follows_flow
    }

    #[inline(always)]
    fn reference(&self, state: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        let mut reference = command;
        for effect in &self.effects {
            if effect.output.is_none() {
                let own = &state[effect.states.clone()];
                reference = effect.action.reference(own, reference, spool, stage);
            }
        }
        reference
    }

    #[inline(always)]
    fn remember(&self, state: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        let mut command = command;
        for effect in &self.effects {
            if effect.output.is_none() {
                let own = &mut state[effect.states.clone()];
                let reference = effect.action.reference(own, command, spool, stage);
                effect.action.remember(own, command, spool, stage);
                command = reference;
            }
        }
    }

    #[inline(always)]
    fn settled_spool(&self, state: &mut [R], spool: R) {
        for effect in &self.effects {
            if effect.is_inner() {
                let own = &mut state[effect.states.clone()];
                effect.action.settled_spool(own, spool);
            }
        }
    }

    #[inline(always)]
    fn drive(&self, state: &[R], drive: R, motion: &Motion<R>) -> R {
        let mut drive = drive;
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            drive = effect.action.drive(own, drive, motion);
        }
        drive
    }

    #[inline(always)]
    fn corrected_drive(&self, drive: R, gain: R, spool: R, speed: R) -> R {
        let Some(correction) = self.correction_at(Port::Actuator) else {
            return drive;
        };
        let signal = match correction.signal {
            Signal::Speed => speed,
            _ => spool,
        };
        drive + gain * correction.at(signal)
    }

    #[inline(always)]
    fn speed(&self, state: &[R], speed: R, motion: &Motion<R>) -> R {
        let mut speed = speed;
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            speed = effect.action.speed(own, speed, motion);
        }
        speed
    }

    #[inline(always)]
    fn followed(&self, state: &[R], speed: R, motion: &Motion<R>, slope: &mut [R]) -> R {
        let mut speed = speed;
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            if effect.is_inner() {
                let slope = &mut slope[effect.states.clone()];
                effect.action.follow(own, speed, motion, slope);
            }
            speed = effect.action.speed(own, speed, motion);
        }
        speed
    }

    #[inline(always)]
    fn slip_direction(&self, state: &[R], drive: R, motion: Motion<R>) -> R {
        let (mut drive, mut motion) = (drive, motion);
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            motion.slip_direction = effect.action.slip_direction(own, drive, &motion);
            drive = effect.action.drive(own, drive, &motion);
        }
        motion.slip_direction
    }

    #[inline(always)]
    fn end_step(
        &self,
        state: &mut [R],
        ended: (R, R),
        drive: R,
        began: &Motion<R>,
        rests: &Motion<R>,
        step: R,
    ) -> (R, R) {
        let (mut integrator, mut spool) = ended;
        let mut drive = drive;
        for effect in &self.effects {
            let own = &mut state[effect.states.clone()];
            (integrator, spool) = effect
                .action
                .end_step(own, integrator, spool, drive, began, step);
            drive = effect.action.drive(own, drive, rests);
        }
        (integrator, spool)
    }

    #[inline(always)]
    fn place(&self, state: &[R], spool: R, speed: R) -> R {
        let mut spool = spool;
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            spool = effect.action.place(own, spool, speed);
        }
        spool
    }

    #[inline(always)]
    fn seen(&self, state: &[R], spool: R, time: R) -> R {
        let mut spool = spool;
        for effect in &self.effects {
            let own = &state[effect.states.clone()];
            spool = effect.action.seen(own, spool, time);
        }
        spool
    }

    #[inline(always)]
    fn opening_and_supply(&self, state: &[R], opening: R, supply: R) -> (R, R) {
        let (mut opening, mut supply) = (opening, supply);
        for effect in &self.effects {
            opening = effect.action.opening(opening);
            supply = effect.action.supply(&state[effect.states.clone()], supply);
        }
        (opening, supply)
    }

    #[inline(always)]
    fn corrected_opening(&self, opening: R) -> R {
        match self.correction_at(Port::Area) {
            Some(correction) => opening + correction.at(opening),
            None => opening,
        }
    }

    #[inline(always)]
    fn delivered(&self, flow: R, moment: &Moment<R>) -> R {
        let mut flow = flow;
        for effect in &self.effects {
            flow = effect.action.delivered(flow, moment);
        }
        flow
    }

    #[inline(always)]
    fn flow(&self, flow: R, moment: &Moment<R>) -> R {
        let mut flow = flow;
        for effect in &self.effects {
            flow = effect.action.flow(flow, moment);
        }
        flow
    }

    #[inline(always)]
    fn drawn(&self, state: &[R], flow: R, slope: &mut [R]) {
        for effect in &self.effects {
            if effect.is_inner() {
                let own = &state[effect.states.clone()];
                let slope = &mut slope[effect.states.clone()];
                effect.action.drawn(own, flow, slope);
            }
        }
    }

    #[inline(always)]
    fn settled_supply(&self, state: &mut [R], flow: R) {
        for effect in &self.effects {
            if effect.is_inner() {
                let own = &mut state[effect.states.clone()];
                effect.action.settled_supply(own, flow);
            }
        }
    }
}
