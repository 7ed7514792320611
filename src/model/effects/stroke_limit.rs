//! The spool meets its end stops.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Motion, Port, Scale};
use crate::model::{Pace, Parameter, Real};

/// The parameter of each form, whose start is where there is no limit.
fn limit(name: &str, scale: &Scale) -> Parameter {
    let least = 0.02 * scale.command;
    let most = 10.0 * scale.command;
    Parameter::linear(name, &scale.command_unit, least, most, most)
}

pub(super) const ENTRY: Entry = Entry {
    name: "stroke_limit",
    port: Port::Actuator,
    summary: "The spool stops at the end of its stroke",
    finding: "the spool stops at {stroke_limit}",
    equation: "|x| <= stroke_limit, dx/dt = 0 at the stop",
    shows: "flat tops at large openings only",
    confused: "saturation, which limits the error and so the speed; a valve whose area is used up, which shows in the flow alone",
    source: "mechanical end stops",
    parameters: |scale, _| vec![limit("stroke_limit", scale)],
    trials: |scale, _| {
        [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.35, 0.2]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Command, Values::Trial(3))),
    frequency: None,
};

/// The spool stops at the ends of its stroke, which have a distance of their own to either side or one for both.
#[derive(Debug, Clone)]
pub(in crate::model) struct Stops<R, const SIDES: bool> {
    bottom: R,
    top: R,
}

/// The spool stops at the end of its stroke.
pub(in crate::model) type StrokeLimit<R> = Stops<R, false>;

/// The spool stops at either end of its stroke.
pub(in crate::model) type StrokeLimitOfSides<R> = Stops<R, true>;

impl<R: Real, const SIDES: bool> Stops<R, SIDES> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let top = next();
        let bottom = if SIDES { next() } else { top };
        Self {
            bottom: -bottom,
            top,
        }
    }
}

impl<R: Real, const SIDES: bool> Act<R> for Stops<R, SIDES> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn place(&self, _own: &[R], spool: R, _speed: R) -> R {
        spool.clamp(self.bottom, self.top)
    }

    #[inline(always)]
    fn end_step(
        &self,
        _: &mut [R],
        lead: R,
        spool: R,
        drive: R,
        start: &Motion<R>,
        step: R,
    ) -> (R, R) {
        // It stops where it meets the end, and leaves it in the rest of the step where the drive pulls it back. The way to the
        // end is what is divided: a spool that begins there has none, however a compiler rounds the little that it moves.
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let (above, below) = (spool - self.top, self.bottom - spool);
        let moved = spool - start.spool;
        let until_top = ((self.top - start.spool) / moved).clamp(zero, one);
        let until_bottom = ((self.bottom - start.spool) / moved).clamp(zero, one);
        let (since_top, since_bottom) = (step * (one - until_top), step * (one - until_bottom));
        let lag = start.time_constant;
        let top = pulled_back(self.top, drive.min(zero), since_top, lag);
        let bottom = pulled_back(self.bottom, drive.max(zero), since_bottom, lag);
        (
            above.if_positive(top.0, below.if_positive(bottom.0, lead)),
            above.if_positive(top.1, below.if_positive(bottom.1, spool)),
        )
    }
}

/// Where integrator and spool are that were pulled off an `end` by a `drive` for `seconds`.
#[inline(always)]
fn pulled_back<R: Real>(end: R, drive: R, seconds: R, time_constant: R) -> (R, R) {
    let ahead = drive * seconds;
    let spool = end + R::constant(0.5) * ahead * seconds / time_constant;
    (spool + ahead, spool)
}

pub(super) const SIDES: Entry = Entry {
    name: "stroke_limit~sides",
    summary: "The spool stops at either end of its stroke, at one sooner than at the other",
    finding: "the spool stops at {stroke_limit_top} on its positive side and {stroke_limit_bottom} on its negative one",
    equation: "-stroke_limit_bottom <= x <= stroke_limit_top, dx/dt = 0 at the stop",
    shows: "flat tops at large openings to one side, or sooner to that than to the other",
    confused: "stroke_limit, whose ends are equally far from null; null_bias, which small openings show as well",
    source: "mechanical end stops; a stroke limiter that is set on one side",
    parameters: |scale, _| {
        ["stroke_limit_top", "stroke_limit_bottom"]
            .map(|name| limit(name, scale))
            .to_vec()
    },
    trials: |scale, _| {
        let near = [0.6, 0.9, 0.75, 0.4].map(|share| share * scale.command);
        let far = 10.0 * scale.command;
        near.iter()
            .flat_map(|&near| [vec![near, far], vec![far, near]])
            .collect()
    },
    ..ENTRY
};

pub(super) const BEHIND: Entry = Entry {
    name: "stroke_limit~windup",
    summary: "The spool stops at the end of its stroke, and the loop's integrator runs on",
    finding: "the spool stops at {stroke_limit_windup}, and leaves its stop late by what the loop has wound up",
    equation: "dz/dt = K sat(u - x, S), dx/dt = (z - x)/T, |x| <= stroke_limit_windup",
    shows: "flat tops at large openings that last longer than the command asks for",
    confused: "stroke_limit, which leaves its stop as soon as the command turns",
    parameters: |scale, _| vec![limit("stroke_limit_windup", scale)],
    imitated_by: &["saturation"],
    ..ENTRY
};

/// The spool stops at the end of its stroke, and the integrator winds up.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimitBehind<R> {
    limit: R,
}

impl<R: Real> StrokeLimitBehind<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for StrokeLimitBehind<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, motion: &Motion<R>) -> R {
        // Held is what stands exactly at the end: what passes it within a step is put there when that ends.
        let zero = R::constant(0.0);
        let [above, below] = [motion.spool - self.limit, -self.limit - motion.spool];
        let at_top = above.abs().if_positive(speed, speed.min(zero));
        below.abs().if_positive(at_top, speed.max(zero))
    }

    #[inline(always)]
    fn place(&self, _own: &[R], spool: R, _speed: R) -> R {
        spool.clamp(-self.limit, self.limit)
    }

    #[inline(always)]
    fn end_step(
        &self,
        _: &mut [R],
        lead: R,
        spool: R,
        _drive: R,
        _start: &Motion<R>,
        _step: R,
    ) -> (R, R) {
        (lead, spool.clamp(-self.limit, self.limit))
    }
}

pub(super) const COMMAND: Entry = Entry {
    name: "stroke_limit~command",
    port: Port::Command,
    summary: "The amplifier clamps the command",
    finding: "the amplifier lets no more than ±{stroke_limit_command} through",
    equation: "|u| <= stroke_limit_command",
    shows: "the spool settles at less than the command asks for, with the dynamics of a smaller step",
    confused: "stroke_limit, at which the spool stops with the speed that it has",
    source: "output stages of amplifiers, which limit current or command",
    parameters: |scale, _| vec![limit("stroke_limit_command", scale)],
    ..ENTRY
};

/// The command is clamped.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimitOfCommand<R> {
    limit: R,
}

impl<R: Real> StrokeLimitOfCommand<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for StrokeLimitOfCommand<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command.clamp(-self.limit, self.limit)
    }
}

pub(super) const CLIPPED: Entry = Entry {
    name: "stroke_limit~clipped",
    summary: "The spool stops at the end of its stroke, and the loop goes on as if it did not",
    finding: "the spool stops at {stroke_limit_clipped}, while its drive and the loop, which is closed there, go on",
    equation: "clamp(x, ±stroke_limit_clipped) is what opens the ports and what its sensor sees; the loop has x",
    shows: "flat tops at large openings, and beside them no other motion than without a stop",
    confused: "stroke_limit, whose loop stops with the spool and leaves it as soon as the command turns",
    source: "loops that are closed at a drive with a compliant coupling to the spool",
    parameters: |scale, _| vec![limit("stroke_limit_clipped", scale)],
    ..ENTRY
};

/// The spool stops, and its loop does not know.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimitClipped<R> {
    limit: R,
}

impl<R: Real> StrokeLimitClipped<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for StrokeLimitClipped<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn place(&self, _own: &[R], spool: R, _speed: R) -> R {
        spool.clamp(-self.limit, self.limit)
    }
}

pub(super) const ELASTIC: Entry = Entry {
    name: "stroke_limit~elastic",
    summary: "The spool runs into an elastic stop, and the loop's integrator runs on",
    finding: "the spool runs into a stop at {stroke_limit_elastic} that gives way",
    equation: "dz/dt = K sat(u - x, S), dx/dt = (z - x)/T - stop_stiffness (x - clamp(x, ±stroke_limit_elastic))",
    shows: "tops at large openings that still rise a little with what is asked for, and last longer than it",
    confused: "stroke_limit~windup, whose stop does not give way",
    source: "end stops with a spring or a cushion; a hard stop of a simulator, which has a stiffness",
    parameters: |scale, _| {
        vec![
            limit("stroke_limit_elastic", scale),
            Parameter::log("stop_stiffness", "1/s", 20.0, 500.0, 5000.0).paced(Pace::Rate),
        ]
    },
    trials: |scale, _| {
        let at = [0.9, 0.8, 0.7, 0.6, 0.5, 0.35];
        let stiff = [200.0, 2000.0];
        at.iter()
            .flat_map(|share| stiff.map(|stiff| vec![share * scale.command, stiff]))
            .collect()
    },
    imitated_by: &["saturation"],
    ..ENTRY
};

/// The spool is pushed back from beyond its stop by a spring, and the integrator winds up.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimitElastic<R> {
    limit: R,
    stiffness: R,
}

impl<R: Real> StrokeLimitElastic<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            limit: next(),
            stiffness: next(),
        }
    }
}

impl<R: Real> Act<R> for StrokeLimitElastic<R> {
    fn feels_load(&self) -> bool {
        false
    }

    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, motion: &Motion<R>) -> R {
        let beyond = motion.spool - motion.spool.clamp(-self.limit, self.limit);
        speed - self.stiffness * beyond
    }
}

pub(super) const RAIL: Entry = Entry {
    name: "stroke_limit~rail",
    summary: "The spool runs into a stop, and the loop's integrator runs on as far as its rail",
    finding: "the spool runs into its stop at {rail_stop_top} or {rail_stop_bottom}, and the loop's integrator winds up to ±{integrator_rail}",
    equation: "dz/dt = K sat(u - x, S), |z| <= integrator_rail, dx/dt = (z - x)/T - rail_stop_stiffness (x - clamp(x, -rail_stop_bottom, rail_stop_top))",
    shows: "tops at large openings, to one side or both, that last longer than the command asks for, but never longer than the same time",
    confused: "stroke_limit~elastic, whose integrator has no end; stroke_limit~sides, whose spool leaves its stop as soon as the command turns",
    source: "output swing of an analogue integrator: Horowitz, Hill, The Art of Electronics, 2015; a stroke limiter that is set on one side",
    parameters: |scale, _| {
        vec![
            limit("rail_stop_top", scale),
            limit("rail_stop_bottom", scale),
            Parameter::log("rail_stop_stiffness", "1/s", 200.0, 2000.0, 10_000.0).paced(Pace::Rate),
            limit("integrator_rail", scale),
        ]
    },
    trials: |scale, _| {
        let (far, rail) = (10.0 * scale.command, 1.05 * scale.command);
        let near = [0.85, 0.7, 0.5].map(|share| share * scale.command);
        near.iter()
            .flat_map(|&near| [[near, far], [far, near], [near, near]])
            .map(|[top, bottom]| vec![top, bottom, 2000.0, rail])
            .collect()
    },
    imitated_by: &["saturation"],
    ..ENTRY
};

/// The spool is pushed back from beyond its stops by a spring, and the integrator winds up to its rail.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimitRail<R> {
    top: R,
    bottom: R,
    stiffness: R,
    rail: R,
}

impl<R: Real> StrokeLimitRail<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            top: next(),
            bottom: -next(),
            stiffness: next(),
            rail: next(),
        }
    }
}

impl<R: Real> Act<R> for StrokeLimitRail<R> {
    fn feels_load(&self) -> bool {
        false
    }

    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, motion: &Motion<R>) -> R {
        let beyond = motion.spool - motion.spool.clamp(self.bottom, self.top);
        speed - self.stiffness * beyond
    }

    #[inline(always)]
    fn end_step(
        &self,
        _: &mut [R],
        lead: R,
        spool: R,
        _drive: R,
        start: &Motion<R>,
        step: R,
    ) -> (R, R) {
        let one = R::constant(1.0);
        let lag = start.time_constant;
        let over = lead - lead.clamp(-self.rail, self.rail);
        // What it has been driven by beyond the rail it has followed: through its lag, and against its stop where it is there.
        let risen = lead - (start.spool + lag * start.speed);
        let share = (over.abs() / risen.abs().max(R::constant(1e-30))).min(one);
        let beyond = spool - spool.clamp(self.bottom, self.top);
        let rate = lag * beyond.abs().if_positive(self.stiffness, R::constant(0.0)) + one;
        let (_, followed) = (rate * share * step / lag).caught_up();
        (lead - over, spool - over * followed / rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(spool: f64) -> Motion<f64> {
        Motion {
            gain: 200.0,
            time_constant: 0.003,
            spool,
            speed: 0.0,
            slip_direction: 0.0,
            load: 2.0,
            drop: 0.0,
        }
    }

    #[test]
    fn the_amplifier_clamps_the_command() {
        let mut values = [1.5].into_iter();
        let effect: StrokeLimitOfCommand<f64> =
            StrokeLimitOfCommand::new(|| values.next().unwrap());
        let found = [1.0, 2.0, -2.0].map(|u| effect.command(&mut [], u));
        assert_eq!(found, [1.0, 1.5, -1.5]);
    }

    #[test]
    fn it_stops_where_it_meets_the_end() {
        let mut values = [1.5].into_iter();
        let effect: StrokeLimit<f64> = StrokeLimit::new(|| values.next().unwrap());
        let start = at(1.0);
        // Pushed on it stays; pulled back by 100 V/s for half the step it leaves.
        assert_eq!(
            effect.end_step(&mut [], 4.0, 2.0, 50.0, &start, 1e-3),
            (1.5, 1.5)
        );
        let (lead, spool) = effect.end_step(&mut [], 4.0, 2.0, -100.0, &start, 1e-3);
        let expected = 1.5 - 0.5 * 0.05 * 5e-4 / 0.003;
        assert!((spool - expected).abs() < 1e-12 && (lead - spool + 0.05).abs() < 1e-12);
        assert_eq!(
            effect.end_step(&mut [], 1.2, 1.4, 50.0, &start, 1e-3),
            (1.2, 1.4)
        );
    }

    #[test]
    fn an_elastic_stop_pushes_back_from_beyond_it() {
        let mut values = [1.5, 200.0].into_iter();
        let effect: StrokeLimitElastic<f64> = StrokeLimitElastic::new(|| values.next().unwrap());
        let speed = |spool| effect.speed(&[], 50.0, &at(spool));
        assert_eq!([1.0, 2.0, -2.0].map(speed), [50.0, -50.0, 150.0]);
    }

    #[test]
    fn an_integrator_with_a_rail_winds_up_no_further() {
        let mut values = [1.5, 3.0, 200.0, 4.5].into_iter();
        let effect: StrokeLimitRail<f64> = StrokeLimitRail::new(|| values.next().unwrap());
        let speed = |spool| effect.speed(&[], 50.0, &at(spool));
        assert_eq!(
            [1.0, 2.0, -2.0, -3.5].map(speed),
            [50.0, -50.0, 50.0, 150.0]
        );
        // Where z rises from 4 V to 5 V in a step, free and in the stop: as if it had risen to 4.5 V and no further.
        for begun in [1.0, 1.6] {
            let start = Motion {
                speed: (4.0 - begun) / 0.003,
                ..at(begun)
            };
            let after = |rail: f64| {
                let (mut spool, steps) = (begun, 100_000);
                for k in 0..steps {
                    let lead = (4.0 + (f64::from(k) + 0.5) / f64::from(steps)).min(rail);
                    let speed = effect.speed(&[], (lead - spool) / 0.003, &at(spool));
                    spool += 1e-3 / f64::from(steps) * speed;
                }
                spool
            };
            let (lead, spool) =
                effect.end_step(&mut [], 5.0, after(f64::INFINITY), 0.0, &start, 1e-3);
            assert_eq!(lead, 4.5);
            assert!(
                (spool - after(4.5)).abs() < 2e-5,
                "{begun}: {spool} {}",
                after(4.5)
            );
        }
    }

    #[test]
    fn a_loop_that_does_not_know_of_the_stop_goes_on() {
        let mut values = [1.5].into_iter();
        let effect: StrokeLimitClipped<f64> = StrokeLimitClipped::new(|| values.next().unwrap());
        assert_eq!(
            [1.0, 2.0, -2.0].map(|x| effect.place(&[], x, 90.0)),
            [1.0, 1.5, -1.5]
        );
        assert_eq!(
            effect.end_step(&mut [], 4.0, 2.0, 50.0, &at(1.4), 1e-3),
            (4.0, 2.0)
        );
    }

    #[test]
    fn behind_the_integrator_it_stops_the_spool_alone() {
        let mut values = [1.5].into_iter();
        let effect: StrokeLimitBehind<f64> = StrokeLimitBehind::new(|| values.next().unwrap());
        let speed = |speed, spool| effect.speed(&[], speed, &at(spool));
        assert_eq!(
            [speed(50.0, 1.5), speed(-50.0, 1.5), speed(50.0, 1.4)],
            [0.0, -50.0, 50.0]
        );
        assert_eq!([speed(-50.0, -1.5), speed(50.0, -1.5)], [0.0, 50.0]);
        assert_eq!(
            effect.end_step(&mut [], 4.0, 2.0, 50.0, &at(1.4), 1e-3),
            (4.0, 1.5)
        );
    }
}
