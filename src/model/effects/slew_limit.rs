//! The spool's speed is limited.

use super::host;
use super::in_loop::lag_alone;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Motion, Port, Scale, Stage};
use crate::model::{Parameter, Real};

/// The parameter of each form, whose start is where there is no limit.
fn limit(name: &str, scale: &Scale) -> Parameter {
    let unit = format!("{}/s", scale.command_unit);
    let least = 1e-4 * scale.command / scale.interval;
    let most = 10.0 * scale.command / scale.interval;
    Parameter::log(name, &unit, least, most, most)
}

pub(super) const ENTRY: Entry = Entry {
    name: "slew_limit",
    port: Port::Actuator,
    summary: "The spool cannot move faster than its pilot stage lets it",
    finding: "the spool moves no faster than {slew_limit}",
    equation: "T dv/dt = K sat(u - x, S) - v, dx/dt = v, |v| <= slew_limit",
    shows: "triangles instead of sines where amplitude times 2 pi frequency reaches the limit",
    confused: "saturation of the error, which also limits the speed but through the lag, and acts on the integrator",
    source: "pilot flow saturation; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| vec![limit("slew_limit", scale)],
    trials: |scale, _| {
        // The base model's fastest motion is at the limit, if there is one.
        [1.0, 0.8, 0.5, 0.25]
            .map(|share| vec![share * scale.speed])
            .to_vec()
    },
    imitated_by: &["saturation"],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    // Little below the fastest that is asked for: a valve that is limited for long runs away.
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[140.0]),
    )),
    frequency: None,
};

/// The spool cannot move faster than its pilot stage lets it.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimit<R> {
    limit: R,
}

impl<R: Real> SlewLimit<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for SlewLimit<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed.clamp(-self.limit, self.limit)
    }

    #[inline(always)]
    fn end_step(
        &self,
        _: &mut [R],
        lead: R,
        spool: R,
        _drive: R,
        start: &Motion<R>,
        _step: R,
    ) -> (R, R) {
        // The speed is a state: the lead z = x + T v has no more of it than the spool, so that nothing winds up.
        let most = self.limit * start.time_constant;
        (lead.clamp(spool - most, spool + most), spool)
    }
}

pub(super) const BEHIND: Entry = Entry {
    name: "slew_limit~windup",
    summary: "The spool cannot move faster than its pilot stage lets it, and the loop's integrator runs on",
    finding: "the spool moves no faster than {slew_limit_windup}, and overshoots by what the loop has wound up",
    equation: "dz/dt = K sat(u - x, S), dx/dt = (z - x)/T, |dx/dt| <= slew_limit_windup",
    shows: "triangles instead of sines as with slew_limit, and an overshoot after each fast stretch",
    confused: "slew_limit, whose speed is a state and winds nothing up: without an overshoot",
    source: "pilot flow saturation under an integrating loop; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| vec![limit("slew_limit_windup", scale)],
    ..ENTRY
};

/// The spool's speed is limited behind the integrator, which winds up.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitBehind<R> {
    limit: R,
}

impl<R: Real> SlewLimitBehind<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for SlewLimitBehind<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed.clamp(-self.limit, self.limit)
    }
}

pub(super) const ROUNDED: Entry = Entry {
    name: "slew_limit~rounded",
    summary: "The spool comes gradually to the speed that its pilot stage lets it have, and the loop's integrator runs on",
    finding: "the spool comes gradually to a speed of {slew_limit_rounded}, and overshoots by what the loop has wound up",
    equation: "dz/dt = K sat(u - x, S), v = (z - x)/T sqrt(1 + w^2), dx/dt = (sqrt((v + R)^2 + (w R)^2) - sqrt((v - R)^2 + (w R)^2))/2; \
               R = slew_limit_rounded, w = slew_rounding",
    shows: "fast stretches that are the slower the more is asked for, and an overshoot after each of them",
    confused: "slew_limit~windup, whose spool follows up to its limit and no further; a larger time constant, alike at all amplitudes",
    source: "pressure-flow curves of a pilot stage, whose flow gain falls as its load takes up the pressure; Merritt, Hydraulic \
             Control Systems, 1967",
    parameters: |scale, _| {
        vec![
            limit("slew_limit_rounded", scale),
            Parameter::log("slew_rounding", "1", 0.05, 0.5, 10.0),
        ]
    },
    trials: |scale, _| {
        let shares = [1.0, 0.6, 0.3];
        shares.map(|share| vec![share * scale.speed, 0.8]).to_vec()
    },
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[140.0, 0.8]),
    )),
    ..ENTRY
};

/// The spool's speed is limited behind the integrator, gradually.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitRounded<R> {
    limit: R,
    /// How far from its asymptotes, a line through zero and the limit, the curve's hyperbolas bend: 0 is sharp, 0.8 about a tanh.
    rounding: R,
}

impl<R: Real> SlewLimitRounded<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            limit: next(),
            rounding: next(),
        }
    }
}

impl<R: Real> Act<R> for SlewLimitRounded<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        let one = R::constant(1.0);
        let asked = speed * (one + self.rounding * self.rounding).sqrt();
        let bend = self.limit * self.rounding;
        let (below, above) = (asked - self.limit, asked + self.limit);
        // Half the difference of the two, without what cancels in it.
        R::constant(2.0) * asked * self.limit / (below.hypot(bend) + above.hypot(bend))
    }
}

pub(super) const TANH: Entry = Entry {
    name: "slew_limit~tanh",
    finding: "the spool comes gradually to a speed of {slew_limit_tanh}, and overshoots by what the loop has wound up",
    equation: "dz/dt = K sat(u - x, S), dx/dt = R tanh((z - x)/(T R)), R = slew_limit_tanh",
    confused: "slew_limit~rounded, which comes to its limit later; slew_limit~windup, whose spool follows up to its limit and no further",
    source: "a hyperbolic tangent for a flow that saturates: a usual smooth limit of simulations",
    parameters: |scale, _| vec![limit("slew_limit_tanh", scale)],
    trials: |scale, _| [0.6, 0.3].map(|share| vec![share * scale.speed]).to_vec(),
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[140.0]),
    )),
    ..ROUNDED
};

/// The spool's speed is limited behind the integrator, by a hyperbolic tangent.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitTanh<R> {
    limit: R,
}

impl<R: Real> SlewLimitTanh<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for SlewLimitTanh<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        let share = (speed.abs() / self.limit).rising_tanh();
        (self.limit * share).with_sign_of(speed)
    }
}

pub(super) const PILOT: Entry = Entry {
    name: "slew_limit~pilot",
    summary: "The spool's speed is the flow of a pilot stage, which comes gradually to its limit behind its own lag",
    finding: "the spool comes gradually to a speed of {slew_limit_pilot}, and stays there while its pilot stage comes back",
    equation: "T dv/dt = K sat(u - x, S) - v, q = v sqrt(1 + w^2), dx/dt = (sqrt((q + R)^2 + (w R)^2) - sqrt((q - R)^2 + (w R)^2))/2; \
               R = slew_limit_pilot, w = pilot_rounding",
    shows: "fast stretches that are the slower the more is asked for, and that end late by the lag of the pilot stage",
    confused: "slew_limit, whose speed comes back from its limit at once; slew_limit~rounded, after which the spool overshoots",
    parameters: |scale, _| {
        vec![
            limit("slew_limit_pilot", scale),
            Parameter::log("pilot_rounding", "1", 0.05, 0.5, 10.0),
        ]
    },
    ..ROUNDED
};

/// The spool's speed is a curve of the pilot stage's state, which goes on behind it.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitOfPilot<R> {
    flow: SlewLimitRounded<R>,
}

impl<R: Real> SlewLimitOfPilot<R> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self {
            flow: SlewLimitRounded::new(next),
        }
    }
}

impl<R: Real> Act<R> for SlewLimitOfPilot<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        lag_alone(drive, motion, self.speed(own, motion.speed, motion))
    }

    #[inline(always)]
    fn speed(&self, own: &[R], speed: R, motion: &Motion<R>) -> R {
        self.flow.speed(own, speed, motion)
    }
}

pub(super) const SIDES: Entry = Entry {
    name: "slew_limit~sides",
    summary: "The spool's speed is the flow of a pilot stage, which is limited to either side, to one more than to the other",
    finding: "the spool moves no faster than {slew_limit_up} upwards and {slew_limit_down} downwards",
    equation: "T dv/dt = K sat(u - x, S) - v, dx/dt = max(-slew_limit_down, min(v, slew_limit_up))",
    shows: "steps that are slower one way than the other, whatever their size, once they are large",
    confused: "slew_limit and slew_limit~pilot, which are the same to both sides; asymmetric_gain, which the flow alone shows",
    source: "pilot flow saturation of a spool with unequal areas, or with a spring on one side; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        ["slew_limit_up", "slew_limit_down"]
            .map(|name| limit(name, scale))
            .to_vec()
    },
    trials: |scale, _| {
        let shares = [[0.5, 1.0], [1.0, 0.5], [0.25, 0.8], [0.8, 0.25]];
        shares
            .map(|sides| sides.map(|share| share * scale.speed).to_vec())
            .to_vec()
    },
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[140.0, 200.0]),
    )),
    ..ENTRY
};

/// The spool's speed is limited to either side behind the pilot stage's state.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitOfSides<R> {
    up: R,
    down: R,
}

impl<R: Real> SlewLimitOfSides<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            up: next(),
            down: next(),
        }
    }
}

impl<R: Real> Act<R> for SlewLimitOfSides<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        lag_alone(drive, motion, self.speed(own, motion.speed, motion))
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed.clamp(-self.down, self.up)
    }
}

pub(super) const UNEVEN: Entry = Entry {
    name: "slew_limit~uneven",
    summary: "The spool's speed is the flow of a pilot stage, which comes gradually to its limit, to one side to another than to the other",
    finding: "the spool comes gradually to a speed of {uneven_limit_up} upwards and of {uneven_limit_down} downwards",
    equation: "T dv/dt = K sat(u - x, S) - v, dx/dt as with slew_limit~pilot, R = uneven_limit_up where v > 0, else uneven_limit_down, \
               w = uneven_rounding",
    shows: "fast stretches that are the slower the more is asked for, and slower one way than the other",
    confused: "slew_limit~pilot, which is the same to both sides; slew_limit~sides, whose spool follows up to its limits and no further",
    source: "pressure-flow curves of a pilot stage that moves a spool with unequal areas; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![
            limit("uneven_limit_up", scale),
            limit("uneven_limit_down", scale),
            Parameter::log("uneven_rounding", "1", 0.05, 0.5, 10.0),
        ]
    },
    trials: |scale, _| {
        let shares = [[0.6, 1.2], [1.2, 0.6], [0.3, 0.6], [0.6, 0.3]];
        shares
            .map(|[up, down]| vec![up * scale.speed, down * scale.speed, 0.5])
            .to_vec()
    },
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[140.0, 200.0, 0.8]),
    )),
    ..ENTRY
};

/// The spool's speed is a curve of the pilot stage's state, another one to either side.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitUneven<R> {
    up: R,
    down: R,
    rounding: R,
}

impl<R: Real> SlewLimitUneven<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            up: next(),
            down: next(),
            rounding: next(),
        }
    }
}

impl<R: Real> Act<R> for SlewLimitUneven<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        lag_alone(drive, motion, self.speed(own, motion.speed, motion))
    }

    #[inline(always)]
    fn speed(&self, own: &[R], speed: R, motion: &Motion<R>) -> R {
        let flow = SlewLimitRounded {
            limit: speed.if_positive(self.up, self.down),
            rounding: self.rounding,
        };
        flow.speed(own, speed, motion)
    }
}

pub(super) const COMMAND: Entry = Entry {
    name: "slew_limit~command",
    summary: "The amplifier's ramp generator limits the rate of the command",
    finding: "the command takes no less than {ramp_time} to full scale",
    equation: "|dr/dt| <= ramp_span / ramp_time, sat(r - x, S) instead of sat(u - x, S)",
    shows: "steps become ramps that end as the loop's own small steps do; what is slow shows nothing",
    confused: "slew_limit, whose spool reaches its speed at once; saturation, which limits the speed but not by the command",
    source: "ramp generators of valve amplifiers; ISO 10770-1",
    parameters: |scale, _| {
        let unit = &scale.command_unit;
        let span = Parameter::linear("ramp_span", unit, 0.0, scale.command, scale.command);
        vec![
            Parameter::linear("ramp_time", "s", 0.0, 0.0, scale.length),
            span.fixed(),
        ]
    },
    trials: |scale, _| {
        // The fastest motion is at the limit, if there is one.
        [1.0, 1.5, 3.0]
            .map(|share| vec![share * scale.command / scale.speed])
            .to_vec()
    },
    imitated_by: &["saturation"],
    states: &["ramp"],
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[0.1]),
    )),
    ..ENTRY
};

/// The command is limited in its rate.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitOfCommand<R> {
    time: R,
    span: R,
}

impl<R: Real> SlewLimitOfCommand<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time: next(),
            span: next(),
        }
    }
}

/// Where a ramp is that began at `from`, after `since` seconds in which its command went straight between two values: it takes no
/// less than the first time over the `span` until it meets the command, and then no less than the second.
#[inline(always)]
fn ramped<R: Real>(
    from: R,
    [began, command]: [R; 2],
    since: R,
    span: R,
    [time, later]: [R; 2],
) -> R {
    let one = R::constant(1.0);
    let sign = |value: R| value.if_positive(one, -one);
    let ahead = began - from;
    let change = command - began;
    let side = ahead.abs().if_positive(sign(ahead), sign(change));
    // Times the ramp time: how far a ramp goes, and how fast it comes nearer to the command, which may be without a ramp.
    let reach = span * since;
    let closing = reach - side * time * change;
    let needed = time * ahead.abs();
    // Once it has met a command that goes faster, it stays behind that.
    let left = one - needed / closing;
    let behind = command + (sign(change) * reach / later - change) * left;
    let met = (later * change.abs() - reach).if_positive(behind, command);
    (needed - closing).if_positive(from + side * reach / time, met)
}

impl<R: Real> Act<R> for SlewLimitOfCommand<R> {
    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let command = [stage.command, command];
        ramped(own[0], command, stage.since, self.span, [self.time; 2])
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        own[0] = self.reference(own, command, spool, stage);
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], command: R) {
        own[0] = command;
    }
}

pub(super) const RAMPS: Entry = Entry {
    name: "slew_limit~ramps",
    summary: "The amplifier's ramp generator limits the rate of the command, one way towards zero and another way from it",
    finding: "the command takes no less than {opening_ramp} from zero to full scale, and no less than {closing_ramp} back",
    equation: "|dr/dt| <= ramps_span / opening_ramp where |r| grows, ramps_span / closing_ramp where it falls, sat(r - x, S) instead of \
               sat(u - x, S)",
    shows: "steps become ramps, steeper or less steep towards zero than away from it, alike on both sides",
    confused: "slew_limit~command, whose ramps are alike; slew_limit~sides, whose limits belong to the sides",
    parameters: |scale, _| {
        let unit = &scale.command_unit;
        let time = |name| Parameter::linear(name, "s", 0.0, 0.0, scale.length);
        let span = Parameter::linear("ramps_span", unit, 0.0, scale.command, scale.command);
        vec![time("opening_ramp"), time("closing_ramp"), span.fixed()]
    },
    trials: |scale, _| {
        [(1.0, 2.0), (2.0, 1.0), (1.0, 4.0), (4.0, 1.0)]
            .map(|times| [times.0, times.1].map(|share| share * scale.command / scale.speed))
            .map(Vec::from)
            .to_vec()
    },
    states: &["ramp_of_two"],
    view: Some(View::new(
        Excitation::Chirp,
        Over::Time,
        Values::Given(&[0.1, 0.05]),
    )),
    ..COMMAND
};

/// The command is limited in its rate, towards zero and away from it.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimitOfRamps<R> {
    opening: R,
    closing: R,
    span: R,
}

impl<R: Real> SlewLimitOfRamps<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            opening: next(),
            closing: next(),
            span: next(),
        }
    }

    /// The time over the span of a ramp at `place` that heads this way.
    #[inline(always)]
    fn time(&self, place: R, heading: R) -> R {
        (-heading)
            .with_sign_of(place)
            .if_positive(self.closing, self.opening)
    }
}

impl<R: Real> Act<R> for SlewLimitOfRamps<R> {
    /// In two parts where it passes zero on its way.
    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let half = R::constant(0.5);
        let change = command - stage.command;
        let ahead = stage.command - own[0];
        let heading = ahead.abs().if_positive(ahead, change);
        let falls = (-heading).with_sign_of(own[0]);
        let to_zero = (self.closing * own[0].abs() / self.span).min(stage.since);
        let first = falls.if_positive(to_zero, stage.since);
        let passed = stage.command + change * (first / stage.since.max(R::constant(1e-12)));
        let met_before = self.time(half * (stage.command + passed), change);
        let met_later = self.time(half * (passed + command), change);
        let at_zero = ramped(
            own[0],
            [stage.command, passed],
            first,
            self.span,
            [self.time(own[0], heading), met_before],
        );
        ramped(
            at_zero,
            [passed, command],
            stage.since - first,
            self.span,
            [self.opening, met_later],
        )
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        own[0] = self.reference(own, command, spool, stage);
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], command: R) {
        own[0] = command;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Motion<f64> = Motion {
        gain: 200.0,
        time_constant: 0.003,
        spool: 1.0,
        speed: 100.0,
        slip_direction: 0.0,
        load: 2.0,
        drop: 0.0,
    };

    #[test]
    fn a_ramp_follows_the_command_no_faster_than_its_limit() {
        let ramp = |time: f64| {
            let mut values = [time, 10.0].into_iter();
            SlewLimitOfCommand::<f64>::new(|| values.next().unwrap())
        };
        let mut own = [0.0];
        let held = |command, since| Stage {
            since,
            ..Stage::first(command, 0.0)
        };
        let mut step = |ramp: &SlewLimitOfCommand<f64>, command| {
            ramp.remember(&mut own, command, 0.0, &held(command, 1e-3));
            own[0]
        };
        let slow = ramp(0.1);
        let ends = [0.25, 0.25, 0.25, 0.25, -1.0].map(|command| step(&slow, command));
        for (end, expected) in ends.iter().zip([0.1, 0.2, 0.25, 0.25, 0.15]) {
            assert!((end - expected).abs() < 1e-12, "{ends:?}");
        }
        assert_eq!(
            [7.0, 7.0, -3.0].map(|u| step(&ramp(0.0), u)),
            [7.0, 7.0, -3.0]
        );
        assert_eq!(slow.reference(&[1.0], 5.0, 0.0, &held(5.0, 0.0)), 1.0);
        // A ramp of 0.1 meets a command that falls from 0.05 above it by 0.2, after a sixth of the step.
        let falls = Stage {
            since: 1e-3,
            ..Stage::first(1.05, 0.0)
        };
        let found = slow.reference(&[1.0], 0.85, 0.0, &falls);
        assert!(
            (found - (1.0 + 0.1 / 6.0 - 0.5 / 6.0)).abs() < 1e-12,
            "{found}"
        );
    }

    #[test]
    fn two_ramps_change_at_zero() {
        let at = |times: [f64; 2], from: f64, began: f64, command: f64| {
            let mut values = [times[0], times[1], 10.0].into_iter();
            let ramps: SlewLimitOfRamps<f64> = SlewLimitOfRamps::new(|| values.next().unwrap());
            let stage = Stage {
                since: 0.01,
                ..Stage::first(began, 0.0)
            };
            ramps.reference(&[from], command, 0.0, &stage)
        };
        // Away from zero, towards it, through it, and at the command; 100 V/s away, 400 V/s towards zero.
        for (from, command, expected) in [
            (1.0, 9.0, 2.0),
            (-1.0, -9.0, -2.0),
            (5.0, 0.0, 1.0),
            (2.0, -9.0, -0.5),
            (5.0, 4.0, 4.0),
            (0.0, -0.3, -0.3),
        ] {
            let found = at([0.1, 0.025], from, command, command);
            assert!((found - expected).abs() < 1e-9, "{from} {command}: {found}");
        }
        // Without ramps, and with two that are alike.
        assert_eq!(at([0.0, 0.0], 1.0, -8.0, 7.0), 7.0);
        let alike = at([0.1, 0.1], 1.0, 1.05, 0.85);
        let one = ramped(1.0, [1.05, 0.85], 0.01, 10.0, [0.1; 2]);
        assert!((alike - one).abs() < 1e-12, "{alike} {one}");
    }

    #[test]
    fn neither_speed_nor_lead_passes_the_limit() {
        let mut values = [100.0].into_iter();
        let effect: SlewLimit<f64> = SlewLimit::new(|| values.next().unwrap());
        assert_eq!(
            [-150.0, 50.0].map(|v| effect.speed(&[], v, &START)),
            [-100.0, 50.0]
        );
        let (lead, spool) = effect.end_step(&mut [], 2.0, 1.0, 0.0, &START, 1e-4);
        assert!((lead - 1.3).abs() < 1e-12 && spool == 1.0);
        assert_eq!(
            effect.end_step(&mut [], 1.2, 1.0, 0.0, &START, 1e-4),
            (1.2, 1.0)
        );
    }

    #[test]
    fn a_limit_may_be_a_hyperbolic_tangent() {
        let mut values = [100.0].into_iter();
        let effect: SlewLimitTanh<f64> = SlewLimitTanh::new(|| values.next().unwrap());
        for v in [-1e6, -300.0, -80.0, -1e-3, 0.0, 5.0, 60.0, 170.0, 1e9] {
            let off = effect.speed(&[], v, &START) - 100.0 * f64::tanh(v / 100.0);
            assert!(off.abs() < 1e-5, "{v}: {off:e}");
        }
    }

    #[test]
    fn a_rounded_limit_bends_from_no_loss_to_the_limit() {
        let at = |rounding: f64, speed: f64| {
            let mut values = [100.0, rounding].into_iter();
            SlewLimitRounded::new(|| values.next().unwrap()).speed(&[], speed, &START)
        };
        for rounding in [0.05, 0.75, 10.0] {
            assert!((at(rounding, 1e-3) / 1e-3 - 1.0).abs() < 1e-6);
            assert!((at(rounding, -1e9) + 100.0).abs() < 1e-3);
        }
        // Where the slope's line meets the limit: (sqrt(200^2 + 75^2) - 75) / 2.
        assert!(
            (at(0.75, 80.0) - 69.300_046_816).abs() < 1e-6,
            "{}",
            at(0.75, 80.0)
        );
        assert!((at(0.05, 50.0) - 50.0).abs() < 0.1);
        // The algebraic curve v / sqrt(1 + (v / R)^2), to which it tends.
        let root = 0.5f64.sqrt();
        assert!((at(10.0, 100.0) / 100.0 - root).abs() < 2e-3);
    }

    /// T v' = z' − x' of the lead z = x + T v: the pilot stage's lag, whatever the spool makes of its flow.
    #[test]
    fn a_pilot_stage_lags_as_if_it_had_no_limit() {
        let mut values = [100.0, 0.05].into_iter();
        let effect: SlewLimitOfPilot<f64> = SlewLimitOfPilot::new(|| values.next().unwrap());
        for speed in [-500.0, 20.0, 130.0] {
            let motion = Motion { speed, ..START };
            let spool = effect.speed(&[], speed, &motion);
            let lead = effect.drive(&[], 40.0, &motion);
            assert!((lead - spool - (40.0 - speed)).abs() < 1e-9);
            assert!((spool - speed.clamp(-100.0, 100.0)).abs() < 1.0, "{spool}");
        }
    }

    #[test]
    fn either_side_may_have_a_limit_of_its_own() {
        let mut values = [100.0, 40.0].into_iter();
        let effect: SlewLimitOfSides<f64> = SlewLimitOfSides::new(|| values.next().unwrap());
        assert_eq!(
            [-150.0, 50.0, 150.0].map(|v| effect.speed(&[], v, &START)),
            [-40.0, 50.0, 100.0]
        );
        let fast = Motion {
            speed: 150.0,
            ..START
        };
        assert_eq!(effect.drive(&[], 80.0, &fast), 30.0);
    }

    #[test]
    fn either_side_may_have_a_curve_of_its_own() {
        let mut values = [100.0, 40.0, 0.05].into_iter();
        let effect: SlewLimitUneven<f64> = SlewLimitUneven::new(|| values.next().unwrap());
        for (asked, limit) in [(20.0, 100.0), (-20.0, 40.0), (1e5, 100.0), (-1e5, 40.0)] {
            let speed = effect.speed(&[], asked, &START);
            let follows: f64 = asked.clamp(-limit, limit);
            assert!((speed / follows - 1.0).abs() < 0.01, "{asked}: {speed}");
        }
        let slow = effect.speed(&[], -1e-3, &START);
        assert!((slow / -1e-3 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn behind_the_integrator_it_limits_the_speed_alone() {
        let mut values = [100.0].into_iter();
        let effect: SlewLimitBehind<f64> = SlewLimitBehind::new(|| values.next().unwrap());
        assert_eq!(
            [-150.0, 50.0].map(|v| effect.speed(&[], v, &START)),
            [-100.0, 50.0]
        );
        assert_eq!(
            effect.end_step(&mut [], 2.0, 1.0, 0.0, &START, 1e-4),
            (2.0, 1.0)
        );
    }
}
