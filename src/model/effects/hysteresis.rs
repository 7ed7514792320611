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

/// The feedback of the loop passes through a play, behind which the record has the spool or not.
#[derive(Debug, Clone)]
pub(in crate::model) struct FeedbackPlay<R, const RECORDED: bool> {
    width: R,
}

/// A play between a spool that is recorded and its feedback.
pub(in crate::model) type HysteresisOfFeedback<R> = FeedbackPlay<R, false>;

/// A play between the spool and what shows it, to the loop and to the record.
pub(in crate::model) type HysteresisOfTransducer<R> = FeedbackPlay<R, true>;

impl<R: Real, const RECORDED: bool> FeedbackPlay<R, RECORDED> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }

    #[inline(always)]
    fn feedback(&self, own: R, spool: R) -> R {
        behind_play(self.width, own, spool)
    }
}

impl<R: Real, const RECORDED: bool> Act<R> for FeedbackPlay<R, RECORDED> {
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
    fn seen(&self, own: &[R], spool: R, _time: R) -> R {
        match RECORDED {
            true => self.feedback(own[0], spool),
            false => spool,
        }
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[0] = spool;
    }
}

pub(super) const TRANSDUCER: Entry = Entry {
    name: "hysteresis~transducer",
    summary: "The core of the loop's transducer has a play on the spool, and the record has what it shows",
    finding: "the transducer of the loop, which is recorded, follows the spool through a play of ±{hysteresis_transducer}",
    equation: "sat(u - y, S), y = max(x - b, min(x + b, y_before)), half-width b = hysteresis_transducer; recorded is y, the ports have x",
    shows: "a spool that seems to stand still at every reversal, before which the flow runs ahead by the play",
    confused: "hysteresis~feedback, whose record has the spool itself; hysteresis~linkage, whose flow stands still, too",
    parameters: |scale, _| vec![half_width("hysteresis_transducer", scale)],
    applies: host::shows_more_than_the_spool,
    states: &["play_of_transducer"],
    ..FEEDBACK
};

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

pub(super) const GRADUAL: Entry = Entry {
    name: "hysteresis~gradual",
    summary: "The command acts through a loop whose branches close in gradually after every reversal",
    finding: "the command acts through a hysteresis of ±{hysteresis_gradual}, which closes in over {hysteresis_travel} after a reversal",
    equation: "y = u - b h, dh/du = (1 - h sign(du)) / w; b = hysteresis_gradual, w = hysteresis_travel",
    shows: "a loop of constant width at any speed, with round corners where the command turns",
    confused: "hysteresis, whose corners are sharp; hysteresis~spread, whose small loops close",
    source: "Coleman, Hodgdon, A constitutive relation for rate-independent hysteresis in ferromagnetically soft materials, 1986, with \
             constant f'; Dahl 1968: the iron of a torque motor, the same as the law of Bouc and Wen with gamma = 0",
    parameters: |scale, _| {
        let (unit, full) = (&scale.command_unit, scale.command);
        vec![
            half_width("hysteresis_gradual", scale),
            Parameter::log("hysteresis_travel", unit, 1e-3 * full, 0.05 * full, full),
        ]
    },
    trials: |scale, _| {
        [[0.003, 0.03], [0.012, 0.03], [0.012, 0.2], [0.04, 0.2]]
            .map(|shares| shares.map(|share| share * scale.command).to_vec())
            .to_vec()
    },
    states: &["command_before", "magnetisation"],
    ..ENTRY
};

/// The command acts through a loop that closes in gradually.
#[derive(Debug, Clone)]
pub(in crate::model) struct HysteresisGradual<R> {
    width: R,
    travel: R,
}

impl<R: Real> HysteresisGradual<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            width: next(),
            travel: next(),
        }
    }
}

impl<R: Real> Act<R> for HysteresisGradual<R> {
    /// Exact for a command that has gone straight here.
    #[inline(always)]
    fn command(&self, own: &mut [R], command: R) -> R {
        let moved = command - own[0];
        let end = R::constant(1.0).with_sign_of(moved);
        let (closed, _) = (moved.abs() / self.travel).caught_up();
        own[0] = command;
        own[1] = own[1] + (end - own[1]) * closed;
        command - self.width * own[1]
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
        own[1] = R::constant(0.0);
    }
}

pub(super) const SPREAD: Entry = Entry {
    name: "hysteresis~spread",
    summary: "The command acts through many plays, the narrowest of which is next to none",
    finding: "the command acts through a hysteresis of ±{hysteresis_spread}, the sum of plays as wide as ±{widest_play}",
    equation: "y = u + (b / 2 W) sum (p_k - u), p_k behind plays of W/8, 3W/8, 5W/8, 7W/8; b = hysteresis_spread, W = widest_play",
    shows: "a loop of constant width at any speed, with round corners where the command turns; small loops close and are narrow",
    confused: "hysteresis, whose corners are sharp; hysteresis~gradual, whose small loops do not close",
    source: "Prandtl-Ishlinskii operator with a constant density: Krejci, Hysteresis, Convexity and Dissipation in Hyperbolic Equations, \
             1996; Preisach's of the same: Mayergoyz, Mathematical Models of Hysteresis, 1991: the iron of a torque motor",
    parameters: |scale, _| {
        let (unit, full) = (&scale.command_unit, scale.command);
        vec![
            half_width("hysteresis_spread", scale),
            Parameter::log("widest_play", unit, 0.01 * full, 0.1 * full, full),
        ]
    },
    trials: |scale, _| {
        [[0.003, 0.05], [0.012, 0.05], [0.012, 0.3], [0.04, 0.3]]
            .map(|shares| shares.map(|share| share * scale.command).to_vec())
            .to_vec()
    },
    states: &["narrow_play", "second_play", "third_play", "wide_play"],
    ..ENTRY
};

/// The half-widths of the plays in shares of the widest: the middles of four equal parts of it.
const WIDTHS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];

/// The command acts through many plays.
#[derive(Debug, Clone)]
pub(in crate::model) struct HysteresisSpread<R> {
    /// Of what each play is behind, and the widest of all.
    share: R,
    widest: R,
}

impl<R: Real> HysteresisSpread<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let (width, widest) = (next(), next());
        // Where all are crossed they are behind by the sum of their half-widths.
        let sum = R::constant(WIDTHS.iter().sum()) * widest;
        Self {
            share: width / sum,
            widest,
        }
    }

    /// Where the play of number `k` is that was at `follower`, when what leads it is at `leader`.
    #[inline(always)]
    fn follower(&self, k: usize, follower: R, leader: R) -> R {
        behind_play(R::constant(WIDTHS[k]) * self.widest, follower, leader)
    }

    /// What is to be added to `leader`, where each play is where `follower` of its number says.
    #[inline(always)]
    fn behind(&self, leader: R, follower: impl Fn(usize) -> R) -> R {
        let mut behind = R::constant(0.0);
        for k in 0..WIDTHS.len() {
            behind = behind + (follower(k) - leader);
        }
        self.share * behind
    }
}

impl<R: Real> Act<R> for HysteresisSpread<R> {
    #[allow(
        clippy::needless_range_loop,
        reason = "an iterator is not always inlined, and only what is inlined is compiled for wide vectors"
    )]
    #[inline(always)]
    fn command(&self, own: &mut [R], command: R) -> R {
        for k in 0..WIDTHS.len() {
            own[k] = self.follower(k, own[k], command);
        }
        command
            + self.behind(
                command,
                #[inline(always)]
                |k| own[k],
            )
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[..WIDTHS.len()].fill(value);
    }
}

pub(super) const LOOP: Entry = Entry {
    name: "hysteresis~loop",
    port: Port::Actuator,
    summary: "The loop's own drive acts through many plays: the iron of a torque motor behind the spool's controller",
    finding: "the loop's own drive acts through a hysteresis of ±{loop_hysteresis}; {loop_hysteresis_share} of it passes through plays",
    equation: "sat(h(u - x), S), h(e) = e + (s / 4) sum (p_k - e), p_k of e behind plays of W/8, 3W/8, 5W/8, 7W/8, W = 2 b / s; \
               b = loop_hysteresis, s = loop_hysteresis_share",
    shows: "a spool that comes to rest beyond its command after a step, by more the larger the error was, and as far beside it in slow \
            motion after that",
    confused: "friction, which holds the spool short of its command; hysteresis, behind which the spool stays in slow motion, too",
    source: "magnetic hysteresis of a torque motor inside an electrical loop: Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![
            half_width("loop_hysteresis", scale),
            // Of more than all, the drive would go the other way after each reversal.
            Parameter::linear("loop_hysteresis_share", "1", 0.1, 0.5, 0.95),
        ]
    },
    trials: |scale, _| {
        [[0.003, 0.4], [0.01, 0.4], [0.01, 0.8], [0.03, 0.8]]
            .map(|[width, share]| vec![width * scale.command, share])
            .to_vec()
    },
    applies: host::moves_a_spool,
    states: &[
        "narrow_loop_play",
        "second_loop_play",
        "third_loop_play",
        "wide_loop_play",
        "spool_before",
    ],
    ..ENTRY
};

/// The drive of the loop acts through many plays.
#[derive(Debug, Clone)]
pub(in crate::model) struct HysteresisOfLoop<R>(HysteresisSpread<R>);

impl<R: Real> HysteresisOfLoop<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let (width, share) = (next(), next());
        Self(HysteresisSpread {
            share: share / R::constant(WIDTHS.len() as f64),
            widest: R::constant(2.0) * width / share,
        })
    }

    /// Where the play of number `k` is when the error is that of this command and `spool`; it was largest when the command came.
    #[inline(always)]
    fn follower(&self, k: usize, own: &[R], error: R, stage: &Stage<R>) -> R {
        let first = self
            .0
            .follower(k, own[k], stage.command - own[WIDTHS.len()]);
        self.0.follower(k, first, error)
    }
}

impl<R: Real> Act<R> for HysteresisOfLoop<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        let error = command - spool;
        command
            + self.0.behind(
                error,
                #[inline(always)]
                |k| self.follower(k, own, error, stage),
            )
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        for k in 0..WIDTHS.len() {
            own[k] = self.follower(k, own, command - spool, stage);
        }
        own[WIDTHS.len()] = spool;
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[..WIDTHS.len()].fill(R::constant(0.0));
        own[WIDTHS.len()] = spool;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gradual_loop_does_as_its_equation_says() {
        let (width, travel) = (0.5, 0.8);
        let mut values = [width, travel].into_iter();
        let effect: HysteresisGradual<f64> = HysteresisGradual::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 1.0);
        let (mut before, mut h) = (1.0, 0.0f64);
        for command in [1.0, 3.0, 2.9, 1.5, -4.0, -3.7, -3.9, 0.0] {
            let step: f64 = (command - before) / 100_000.0;
            for _ in 0..100_000 {
                h += step * (1.0 - h * step.signum()) / travel;
            }
            before = command;
            let found = effect.command(&mut own, command);
            assert!(
                (found - (command - width * h)).abs() < 1e-4,
                "{command}: {found} {h}"
            );
        }
    }

    #[test]
    fn a_transducer_with_a_play_shows_the_loop_and_the_record_the_same() {
        fn after<const RECORDED: bool>() -> [f64; 2] {
            let effect: FeedbackPlay<f64, RECORDED> = FeedbackPlay::new(|| 0.25);
            let (mut own, stage) = ([0.0], Stage::first(5.0, 0.0));
            effect.settled_spool(&mut own, 0.0);
            effect.remember(&mut own, 5.0, 3.0, &stage);
            let reference = effect.reference(&own, 5.0, 2.875, &stage);
            [effect.seen(&own, 2.875, 0.0), 5.0 - reference + 2.875]
        }
        // The core hangs 0.25 V behind, and stays where it is when the spool turns: that is what the loop compares.
        assert_eq!(
            [after::<true>(), after::<false>()],
            [[2.75, 2.75], [2.875, 2.75]]
        );
    }

    #[test]
    fn many_plays_are_behind_by_their_width_and_their_small_loops_close() {
        let mut values = [0.5, 2.0].into_iter();
        let effect: HysteresisSpread<f64> = HysteresisSpread::new(|| values.next().unwrap());
        let mut own = [0.0; 4];
        effect.settled(&mut own, 0.0);
        let mut go = |to: f64| to - effect.command(&mut own, to);
        assert!((go(5.0) - 0.5).abs() < 1e-12);
        let (left, turned) = (go(4.0), go(4.7));
        // One round of a small loop ends where it began.
        assert_eq!((go(4.0), go(4.7)), (left, turned));
        assert!(left < 0.5 && (go(-5.0) + 0.5).abs() < 1e-12);
        // Of a continuous density b (1 - 2 d / W + d^2 / 2 W^2) is left after d: nothing after (2 - sqrt 2) W.
        let mut own = [5.0 - 0.25, 5.0 - 0.75, 5.0 - 1.25, 5.0 - 1.75];
        let halfway = 5.0 - 2.0 * (2.0 - 2f64.sqrt());
        let left = halfway - effect.command(&mut own, halfway);
        assert!(left.abs() < 0.02, "{left}");
    }

    #[test]
    fn iron_in_the_loop_holds_the_spool_beyond_a_step_and_keeps_it_there() {
        let mut values = [0.5, 0.5].into_iter();
        let effect: HysteresisOfLoop<f64> = HysteresisOfLoop::new(|| values.next().unwrap());
        let mut own = [9.0; 5];
        effect.settled_spool(&mut own, 0.0);
        // What drives the spool, which is pulled to where nothing does.
        let drive = |own: &[f64; 5], command, spool| {
            effect.reference(own, command, spool, &Stage::first(command, 0.0)) - spool
        };
        let mut rest = |command: f64, mut spool: f64| {
            for _ in 0..2000 {
                let to = spool + 0.05 * drive(&own, command, spool);
                effect.remember(&mut own, command, spool, &Stage::first(command, 0.0));
                spool = to;
            }
            spool
        };
        // From an error of 5 all plays are crossed on the way down; slow motion needs none that crosses any.
        let far = rest(5.0, 0.0);
        assert!((far - 5.5).abs() < 1e-6, "{far}");
        let slow = (1..=400).fold(far, |spool, k| rest(5.0 - 0.01 * f64::from(k), spool));
        assert!((slow - 1.5).abs() < 0.02, "{slow}");
        // After a step of 0.5 on, the narrowest play is crossed and the others stay: e + c (0.5 - 3 e - 0.25) = 0, c = 1/8.
        let near = rest(0.5, slow);
        assert!((near - 0.6).abs() < 0.02, "{near}");
    }

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
