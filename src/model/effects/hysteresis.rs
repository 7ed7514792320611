//! The command acts through a play.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port, Scale, Stage};
use crate::model::{Parameter, Real};

/// The parameter of each form: half the width of its play.
fn half_width(name: &str, scale: &Scale) -> Parameter {
    Parameter::linear(name, &scale.command_unit, 0.0, 0.0, 0.2 * scale.command)
}

pub(super) const ENTRY: Entry = Entry {
    name: "hysteresis",
    port: Port::Command,
    summary: "The command acts through a play: rate-independent hysteresis",
    finding: "a play of ±{hysteresis} lies between command and spool",
    equation: "y = max(u - b, min(u + b, y_before)), half-width b = hysteresis",
    shows: "a loop of constant width at any speed, however slow; the residual follows the command's direction",
    confused: "friction, whose error grows when the spool moves slowly; a lag, whose loop vanishes at low speed",
    source: "play operator: Visintin, Differential Models of Hysteresis, 1994; ISO 10770-1, hysteresis",
    parameters: |scale, _| vec![half_width("hysteresis", scale)],
    trials: |scale, _| {
        [0.003, 0.012, 0.04]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    imitated_by: &[],
    states: &["play"],
    neutral: &[],
    applies: host::always,
    outputs: None,
    view: Some(View::new(view::SMALL, Over::Command, Values::Trial(1))),
    frequency: None,
};

/// The command acts through a play: rate-independent hysteresis.
#[derive(Debug, Clone)]
pub(in crate::model) struct Hysteresis<R> {
    width: R,
}

impl<R: Real> Hysteresis<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }
}

/// Where what follows through a play of this half-width is, which was at `follower`, when what leads it is at `leader`.
#[inline(always)]
fn behind_play<R: Real>(width: R, follower: R, leader: R) -> R {
    (leader - width).max((leader + width).min(follower))
}

impl<R: Real> Act<R> for Hysteresis<R> {
    #[inline(always)]
    fn command(&self, own: &mut [R], command: R) -> R {
        let follower = behind_play(self.width, own[0], command);
        own[0] = follower;
        follower
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
    }
}

pub(super) const FEEDBACK: Entry = Entry {
    name: "hysteresis~feedback",
    port: Port::Actuator,
    summary: "The loop's feedback passes through a play",
    finding: "a play of ±{hysteresis_feedback} lies between the spool and its feedback",
    equation: "sat(u - y, S), y = max(x - b, min(x + b, y_before)), half-width b = hysteresis_feedback",
    shows: "a spool that runs ahead of its command by the play, in the direction of its motion, at any speed",
    confused: "hysteresis, whose spool stays behind its command; friction, which shows at reversals alone",
    source: "backlash in mechanical feedback: Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| vec![half_width("hysteresis_feedback", scale)],
    applies: host::moves_a_spool,
    states: &["play_of_feedback"],
    ..ENTRY
};

/// The feedback of the loop passes through a play.
#[derive(Debug, Clone)]
pub(in crate::model) struct HysteresisOfFeedback<R> {
    width: R,
}

impl<R: Real> HysteresisOfFeedback<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }

    #[inline(always)]
    fn feedback(&self, own: R, spool: R) -> R {
        behind_play(self.width, own, spool)
    }
}

impl<R: Real> Act<R> for HysteresisOfFeedback<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, spool: R, _stage: &Stage<R>) -> R {
        command + (spool - self.feedback(own[0], spool))
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], _command: R, spool: R, _stage: &Stage<R>) {
        own[0] = self.feedback(own[0], spool);
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[0] = spool;
    }
}

pub(super) const LINKAGE: Entry = Entry {
    name: "hysteresis~linkage",
    port: Port::Actuator,
    summary: "A play lies between what drives the spool and the spool",
    finding: "a play of ±{hysteresis_linkage} lies between the spool and what drives it, whose position the loop controls",
    equation: "spool y = max(x - b, min(x + b, y_before)), half-width b = hysteresis_linkage, x what the loop controls",
    shows: "a spool that stands still at every reversal until what drives it has crossed the play, at any speed",
    confused: "hysteresis, whose play the loop follows with its own lag; friction, which needs an error before it moves",
    source: "backlash of linkages and gears: Nordin, Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002",
    parameters: |scale, _| vec![half_width("hysteresis_linkage", scale)],
    applies: host::moves_a_spool,
    states: &["play_of_linkage"],
    ..ENTRY
};

/// What drives the spool does so through a play.
#[derive(Debug, Clone)]
pub(in crate::model) struct HysteresisOfLinkage<R> {
    width: R,
}

impl<R: Real> HysteresisOfLinkage<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }
}

impl<R: Real> Act<R> for HysteresisOfLinkage<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn place(&self, own: &[R], spool: R, _speed: R) -> R {
        behind_play(self.width, own[0], spool)
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], _command: R, spool: R, _stage: &Stage<R>) {
        own[0] = behind_play(self.width, own[0], spool);
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[0] = spool;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn behind_a_linkage_the_spool_stands_until_the_play_is_crossed() {
        let mut values = [0.5].into_iter();
        let effect: HysteresisOfLinkage<f64> = HysteresisOfLinkage::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled_spool(&mut own, 1.0);
        let found = [1.25, 2.0, 3.0, 2.5, 2.0, 1.0].map(|driven| {
            let spool = effect.place(&own, driven, 0.0);
            effect.remember(&mut own, 0.0, driven, &Stage::first(0.0, 0.0));
            spool
        });
        assert_eq!(found, [1.0, 1.5, 2.5, 2.5, 2.5, 1.5]);
    }

    #[test]
    fn in_the_feedback_the_spool_runs_ahead_by_the_half_width() {
        let mut values = [0.5].into_iter();
        let effect: HysteresisOfFeedback<f64> =
            HysteresisOfFeedback::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled_spool(&mut own, 1.0);
        let mut error = |command, spool| {
            let stage = Stage::first(command, 0.0);
            effect.remember(&mut own, command, spool, &stage);
            effect.reference(&own, command, spool, &stage) - spool
        };
        // No error is seen where the spool is ahead of its command by the half-width, on the way up and on the way down.
        assert_eq!([error(2.0, 2.5), error(1.0, 0.5)], [0.0, 0.0]);
        assert_eq!(error(2.0, 1.0), 1.0);
    }

    #[test]
    fn the_play_follows_at_its_half_width() {
        let mut values = [0.5].into_iter();
        let effect: Hysteresis<f64> = Hysteresis::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled(&mut own, 1.0);
        let found = [1.25, 2.0, 3.0, 2.5, 2.0, 1.0].map(|u| effect.command(&mut own, u));
        assert_eq!(found, [1.0, 1.5, 2.5, 2.5, 2.5, 1.5]);
    }
}
