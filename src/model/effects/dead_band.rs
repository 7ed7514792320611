//! Small commands do nothing.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port, Stage};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "dead_band",
    port: Port::Command,
    summary: "The command must pass a dead band before the spool answers",
    finding: "the spool answers only to what of the command is beyond ±{dead_band}",
    equation: "u - clamp(u, ±dead_band)",
    shows: "a spool that stays at null for small commands and is short by as much for large ones, the same in both directions",
    confused: "overlap, which the spool does not show; hysteresis, which depends on the direction; friction, which shows at reversals anywhere",
    source: "dead bands of amplifiers and of joysticks; ISO 10770-1, threshold and dead band",
    parameters: |scale, _| {
        let most = 0.3 * scale.command;
        vec![Parameter::linear(
            "dead_band",
            &scale.command_unit,
            0.0,
            0.0,
            most,
        )]
    },
    trials: |scale, _| {
        [0.005, 0.02, 0.06]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Command, Values::Given(&[0.8]))),
    frequency: None,
};

/// The command must pass a dead band before the spool answers.
#[derive(Debug, Clone)]
pub(in crate::model) struct DeadBand<R> {
    half_width: R,
}

impl<R: Real> DeadBand<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { half_width: next() }
    }
}

impl<R: Real> Act<R> for DeadBand<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command - command.clamp(-self.half_width, self.half_width)
    }
}

pub(super) const COMPENSATED: Entry = Entry {
    name: "dead_band~compensated",
    summary: "The amplifier jumps over a dead band that the valve does not have, or not as wide",
    finding: "the amplifier adds {compensation} to every command beyond {compensation_start}, and less in proportion below it",
    equation: "u + compensation clamp(u/compensation_start, ±1)",
    shows: "a spool that jumps through null with small commands and is ahead by as much with large ones, the same in both directions",
    confused: "null_bias, which shifts both directions the same way; dc_gain, whose error grows with the command",
    source: "dead-band compensation of amplifiers for proportional valves with overlap",
    parameters: |scale, _| {
        let [least, start, most] = [0.0005, 0.005, 0.3].map(|share| share * scale.command);
        vec![
            Parameter::linear(
                "compensation",
                &scale.command_unit,
                0.0,
                0.0,
                0.3 * scale.command,
            ),
            Parameter::log(
                "compensation_start",
                &scale.command_unit,
                least,
                start,
                most,
            ),
        ]
    },
    trials: |scale, _| {
        [[0.01, 0.005], [0.03, 0.005], [0.05, 0.08]]
            .map(|shares| shares.map(|share| share * scale.command).to_vec())
            .to_vec()
    },
    ..ENTRY
};

/// The amplifier jumps over a dead band.
#[derive(Debug, Clone)]
pub(in crate::model) struct DeadBandCompensated<R> {
    jump: R,
    start: R,
}

impl<R: Real> DeadBandCompensated<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            jump: next(),
            start: next(),
        }
    }
}

impl<R: Real> Act<R> for DeadBandCompensated<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        let one = R::constant(1.0);
        command + self.jump * (command / self.start).clamp(-one, one)
    }
}

pub(super) const FEEDBACK: Entry = Entry {
    name: "dead_band~feedback",
    port: Port::Actuator,
    summary: "Within a clearance about null the spool is not fed back, as with a worn ball of the feedback spring in its slot",
    finding: "the spool is not fed back within ±{slot_clearance} of null, and by as much less beyond that",
    equation: "sat(u - y, S), y = x - clamp(x, ±slot_clearance)",
    shows: "a spool that drives through null whatever small command there is, and rests beyond its command by as much, the same in both directions",
    confused: "dead_band~compensated, where the command jumps and not what is fed back; hysteresis~feedback, whose play depends on the direction; null_bias, which shifts both directions the same way",
    source: "wear of the feedback spring's ball in the slot of the spool; clearances in a loop: Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        let unit = &scale.command_unit;
        let most = 0.3 * scale.command;
        vec![Parameter::linear("slot_clearance", unit, 0.0, 0.0, most)]
    },
    ..ENTRY
};

/// Within a clearance the spool is not fed back.
#[derive(Debug, Clone)]
pub(in crate::model) struct DeadBandOfFeedback<R> {
    half_width: R,
}

impl<R: Real> DeadBandOfFeedback<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { half_width: next() }
    }
}

impl<R: Real> Act<R> for DeadBandOfFeedback<R> {
    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, spool: R, _stage: &Stage<R>) -> R {
        command + spool.clamp(-self.half_width, self.half_width)
    }
}

pub(super) const LOOP: Entry = Entry {
    name: "dead_band~loop",
    port: Port::Actuator,
    summary: "The error of the spool's loop must pass a dead band before it drives anything, as in the amplifier or with an overlapped pilot",
    finding: "the loop answers only to what of its error is beyond ±{loop_dead_band}",
    equation: "sat(e - clamp(e, ±loop_dead_band), S), e = u - x",
    shows: "a spool that stops short of its command by as much from whichever side it comes, and slowly at the end",
    confused: "dead_band, with which the spool stays at null alone; hysteresis, whose loop has that width as well, but which comes to rest as \
               quickly as the loop without; friction, which sticks and lets go with a jump",
    source: "dead band of an amplifier behind its comparison; overlap of a pilot stage: Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        let unit = &scale.command_unit;
        let most = 0.3 * scale.command;
        vec![Parameter::linear("loop_dead_band", unit, 0.0, 0.0, most)]
    },
    ..ENTRY
};

/// The error must pass a dead band.
#[derive(Debug, Clone)]
pub(in crate::model) struct DeadBandOfLoop<R> {
    half_width: R,
}

impl<R: Real> DeadBandOfLoop<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { half_width: next() }
    }
}

impl<R: Real> Act<R> for DeadBandOfLoop<R> {
    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, spool: R, _stage: &Stage<R>) -> R {
        command - (command - spool).clamp(-self.half_width, self.half_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_start_gets_the_whole_jump() {
        let mut values = [0.5, 0.25].into_iter();
        let effect: DeadBandCompensated<f64> = DeadBandCompensated::new(|| values.next().unwrap());
        let found = [-2.0, -0.25, 0.0, 0.125, 3.0].map(|u| effect.command(&mut [], u));
        assert_eq!(found, [-2.5, -0.75, 0.0, 0.375, 3.5]);
    }

    #[test]
    fn the_loop_rests_beyond_its_command_by_the_clearance() {
        let effect: DeadBandOfFeedback<f64> = DeadBandOfFeedback::new(|| 0.5);
        let error = |command, spool| {
            effect.reference(&[], command, spool, &Stage::first(command, 0.0)) - spool
        };
        assert_eq!([error(2.0, 2.5), error(-0.25, -0.75)], [0.0, 0.0]);
        // Within the clearance it goes on, wherever it is.
        assert_eq!(
            [0.25, 0.0, -0.5].map(|spool| error(0.125, spool)),
            [0.125; 3]
        );
    }

    #[test]
    fn a_small_error_drives_nothing() {
        let effect: DeadBandOfLoop<f64> = DeadBandOfLoop::new(|| 0.5);
        let error = |command, spool| {
            effect.reference(&[], command, spool, &Stage::first(command, 0.0)) - spool
        };
        let found = [3.5, 2.5, 2.25, 1.5, 0.0].map(|spool| error(2.0, spool));
        assert_eq!(found, [-1.0, 0.0, 0.0, 0.0, 1.5]);
    }

    #[test]
    fn what_is_beyond_the_band_passes() {
        let mut values = [0.5].into_iter();
        let effect: DeadBand<f64> = DeadBand::new(|| values.next().unwrap());
        let found = [-2.0, -0.5, 0.25, 0.5, 3.0].map(|u| effect.command(&mut [], u));
        assert_eq!(found, [-1.5, 0.0, 0.0, 0.0, 2.5]);
    }
}
