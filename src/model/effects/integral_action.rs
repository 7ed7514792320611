//! The controller of the loop integrates.

use super::host;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Motion, Port, Stage};
use crate::model::{Pace, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "integral_action",
    port: Port::Actuator,
    summary: "The controller of the spool's loop integrates its error as well",
    finding: "the loop's controller integrates, with {integral_action} of its proportional part",
    equation: "dz/dt = K (e + integral_action int e dt), e = sat(u - x, S)",
    shows: "a spool that runs ahead after every step and comes back slowly, and that follows a slow ramp without being late",
    confused: "feed_forward, which is not late either, but does not run ahead of a step for long; a smaller damping of the loop itself, \
               whose overshoot rings",
    source: "PI controllers of position loops, as of proportional valves with a pilot stage: Astrom, Hagglund, Advanced PID Control, 2006",
    parameters: |scale, _| vec![rate("integral_action", scale.interval)],
    trials: |scale, _| {
        [0.01, 0.05, 0.2]
            .map(|share| vec![share * fastest(scale.interval)])
            .to_vec()
    },
    imitated_by: &[],
    states: &["lagging_lead"],
    neutral: &[],
    applies: host::moves_no_piston,
    outputs: None,
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The largest rate, 1/s, for rows with this `interval`, s.
fn fastest(interval: f64) -> f64 {
    (0.2 / interval).clamp(20.0, 500.0)
}

/// The integral's rate.
fn rate(name: &'static str, interval: f64) -> Parameter {
    Parameter::linear(name, "1/s", 0.0, 0.0, fastest(interval)).paced(Pace::Rate)
}

/// The controller integrates.
#[derive(Debug, Clone)]
pub(in crate::model) struct IntegralAction<R> {
    rate: R,
}

impl<R: Real> IntegralAction<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { rate: next() }
    }

    /// What the integral adds to the drive, w, where that has brought the spool's lead to z: dw/dt = r (dz/dt - w) is r times the
    /// drive without it, so that w = r (z - y) with dy/dt = w. `lagging` is y.
    #[inline(always)]
    fn integral(&self, lagging: R, motion: &Motion<R>) -> R {
        let lead = motion.spool + motion.time_constant * motion.speed;
        self.rate * (lead - lagging)
    }
}

impl<R: Real> Act<R> for IntegralAction<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        drive + self.integral(own[0], motion)
    }

    #[inline(always)]
    fn follow(&self, own: &[R], _speed: R, motion: &Motion<R>, slope: &mut [R]) {
        slope[0] = self.integral(own[0], motion);
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[0] = spool;
    }
}

/// Rates to begin with, each with each of those `others`.
fn with_each(interval: f64, others: &[f64]) -> Vec<Vec<f64>> {
    let rates = [0.01, 0.05, 0.2].map(|share| share * fastest(interval));
    rates
        .iter()
        .flat_map(|rate| others.iter().map(|other| vec![*rate, *other]))
        .collect()
}

pub(super) const BEFORE: Entry = Entry {
    name: "integral_action~windup",
    summary: "The controller of the spool's loop integrates its error as well, also while its drive is limited",
    finding: "the loop's controller integrates, with {integral_action_windup} of its proportional part, also while its drive is limited",
    equation: "dz/dt = K sat(e + integral_action_windup int e dt, S), e = u - x",
    shows: "a spool that runs further past its command the longer its drive was limited on the way",
    confused: "integral_action, whose integral waits while the drive is limited",
    parameters: |scale, _| vec![rate("integral_action_windup", scale.interval)],
    states: &["integral_of_error", "spool_at_step"],
    ..ENTRY
};

pub(super) const TRACKING: Entry = Entry {
    name: "integral_action~tracking",
    summary: "The controller of the spool's loop integrates its error as well, and what its drive cannot follow runs the integral down",
    finding: "the loop's controller integrates, with {integral_action_tracked} of its proportional part, and unwinds with {tracking_rate} \
              while its drive is limited",
    equation: "dz/dt = K sat(c, S), c = e + j, dj/dt = integral_action_tracked e + tracking_rate (sat(c, S) - c), e = u - x",
    shows: "a spool that leaves its limited drive early after a large step, and late after a small one",
    confused: "integral_action~windup, which runs past its command further after a large step; integral_action~clamping, whose integral \
               stands still while its drive is limited",
    source: "back calculation, or tracking, against windup: Astrom, Hagglund, Advanced PID Control, 2006",
    parameters: |scale, _| {
        vec![
            rate("integral_action_tracked", scale.interval),
            rate("tracking_rate", scale.interval),
        ]
    },
    trials: |scale, _| {
        with_each(
            scale.interval,
            &[0.1, 0.5].map(|share| share * fastest(scale.interval)),
        )
    },
    states: &["tracked_integral", "spool_of_tracked_integral"],
    ..BEFORE
};

pub(super) const CLAMPING: Entry = Entry {
    name: "integral_action~clamping",
    summary: "The controller of the spool's loop integrates its error as well, but not while its drive is limited",
    finding: "the loop's controller integrates, with {integral_action_clamped} of its proportional part, but not while its \
              drive is limited",
    equation: "dz/dt = K sat(c, S), c = e + j, dj/dt = integral_action_clamped e, but 0 where |c| > S, e = u - x",
    shows: "a spool that runs past its command as far after a large step as after one that just limits the drive",
    confused: "integral_action~tracking, whose integral runs down meanwhile; integral_action, which integrates the limited drive",
    source: "conditional integration, or clamping, against windup: Astrom, Hagglund, Advanced PID Control, 2006",
    parameters: |scale, _| vec![rate("integral_action_clamped", scale.interval)],
    states: &["clamped_integral", "spool_of_clamped_integral"],
    ..BEFORE
};

pub(super) const LIMITED: Entry = Entry {
    name: "integral_action~limited",
    summary: "The controller of the spool's loop integrates its error as well, as far as a limit of its integral part",
    finding: "the loop's controller integrates, with {integral_action_limited} of its proportional part and no further than {integral_limit}",
    equation: "dz/dt = K sat(e + j, S), dj/dt = integral_action_limited e, |j| <= integral_limit, e = u - x",
    shows: "a spool that creeps towards its command, or runs past it, by no more than a limit",
    confused: "integral_action~windup, whose integral has no limit; hysteresis, whose spool does not creep",
    source: "limits of the integral part, as amplifiers of proportional valves have them: Astrom, Hagglund, Advanced PID Control, 2006",
    parameters: |scale, _| {
        vec![
            rate("integral_action_limited", scale.interval),
            Parameter::log(
                "integral_limit",
                &scale.command_unit,
                1e-3 * scale.command,
                scale.command,
                scale.command,
            ),
        ]
    },
    trials: |scale, _| {
        with_each(
            scale.interval,
            &[0.01, 0.05, 0.2].map(|share| share * scale.command),
        )
    },
    states: &["limited_integral", "spool_of_limited_integral"],
    ..BEFORE
};

pub(super) const LEAKING: Entry = Entry {
    name: "integral_action~leaking",
    summary: "The controller of the spool's loop integrates its error as well, and its integral leaks away",
    finding: "the loop's controller integrates, with {integral_action_leaking} of its proportional part, and its integral leaks away \
              with {integral_leak}",
    equation: "dz/dt = K sat(e + j, S), dj/dt = integral_action_leaking e - integral_leak j, e = u - x",
    shows: "a spool that runs past its command after its drive was limited, and comes back by itself",
    confused: "integral_action~windup, whose integral stays until the error has the other sign; integral_action~tracking, whose integral \
               runs down only while its drive is limited",
    source: "integrators with a resistor across their capacitor: Horowitz, Hill, The Art of Electronics, 2015",
    parameters: |scale, _| {
        vec![
            rate("integral_action_leaking", scale.interval),
            rate("integral_leak", scale.interval),
        ]
    },
    trials: |scale, _| {
        with_each(
            scale.interval,
            &[0.01, 0.05].map(|share| share * fastest(scale.interval)),
        )
    },
    states: &["leaking_integral", "spool_of_leaking_integral"],
    ..BEFORE
};

/// What becomes of the integral part of a controller, in the unit of the command, while its drive is limited.
pub(in crate::model) trait AntiWindup<R> {
    /// With values for its parameters.
    fn new(next: impl FnMut() -> R) -> Self;

    /// The integral `part` after [`Stage::since`], in which the error went straight from one of `errors` to the other.
    fn grown(&self, part: R, rate: R, errors: [R; 2], stage: &Stage<R>) -> R;
}

/// What the integral part grows by where nothing keeps it.
#[inline(always)]
fn integrated<R: Real>(rate: R, [before, after]: [R; 2], stage: &Stage<R>) -> R {
    R::constant(0.5) * rate * stage.since * (before + after)
}

/// It goes on.
#[derive(Debug, Clone)]
pub(in crate::model) struct GoesOn;

impl<R: Real> AntiWindup<R> for GoesOn {
    #[inline(always)]
    fn new(_: impl FnMut() -> R) -> Self {
        Self
    }

    #[inline(always)]
    fn grown(&self, part: R, rate: R, errors: [R; 2], stage: &Stage<R>) -> R {
        part + integrated(rate, errors, stage)
    }
}

/// It runs down at a rate.
#[derive(Debug, Clone)]
pub(in crate::model) struct Tracking<R>(R);

impl<R: Real> AntiWindup<R> for Tracking<R> {
    #[inline(always)]
    fn new(mut next: impl FnMut() -> R) -> Self {
        Self(next())
    }

    /// Half of the growth, what of the excess runs down, the other half: of second order.
    #[inline(always)]
    fn grown(&self, part: R, rate: R, errors: [R; 2], stage: &Stage<R>) -> R {
        let half = R::constant(0.5);
        let grows = half * integrated(rate, errors, stage);
        let output = part + grows + half * (errors[0] + errors[1]);
        let excess = output - output.clamp(-stage.saturation, stage.saturation);
        let (down, _) = (self.0 * stage.since).caught_up();
        part + grows - excess * down + grows
    }
}

/// It leaks away at a rate.
#[derive(Debug, Clone)]
pub(in crate::model) struct Leaking<R>(R);

impl<R: Real> AntiWindup<R> for Leaking<R> {
    #[inline(always)]
    fn new(mut next: impl FnMut() -> R) -> Self {
        Self(next())
    }

    /// Half of the growth, what leaks away, the other half: of second order.
    #[inline(always)]
    fn grown(&self, part: R, rate: R, errors: [R; 2], stage: &Stage<R>) -> R {
        let grows = R::constant(0.5) * integrated(rate, errors, stage);
        let (away, _) = (self.0 * stage.since).caught_up();
        let before = part + grows;
        before - before * away + grows
    }
}

/// It stands still while the output is limited.
#[derive(Debug, Clone)]
pub(in crate::model) struct Clamping;

impl<R: Real> AntiWindup<R> for Clamping {
    #[inline(always)]
    fn new(_: impl FnMut() -> R) -> Self {
        Self
    }

    /// The output goes straight to the edge of saturation, with the integral or without, and from there without it or with it. Where
    /// the integral would drive out again an output that the error lets back, it stays at the edge. It never stands beyond an edge by
    /// its integral alone: that had to grow beyond it.
    #[inline(always)]
    fn grown(&self, part: R, rate: R, [before, after]: [R; 2], stage: &Stage<R>) -> R {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let least = R::constant(1e-9) * stage.saturation;
        let half = R::constant(0.5) * rate * stage.since;
        let output = part + before;
        let beyond = output.abs() - stage.saturation;
        let moved = after - before;
        let grown = integrated(rate, [before, after], stage);

        let heading = moved + grown;
        let side = beyond.if_positive(output, heading);
        let back = (-moved).with_sign_of(side);
        let room = (stage.saturation - (part + after).with_sign_of(side)).max(zero);

        let until = stage.saturation - output.with_sign_of(side);
        let until = (until / heading.abs().max(least)).min(one);
        let leaves = half * until * (before + before + moved * until);

        let outside = (beyond / back.max(least)).min(one).max(zero);
        let returns = half * (one - outside) * (before + moved * outside + after);
        let returns = returns.with_sign_of(side).min(room).with_sign_of(side);
        part + beyond.max(back).if_positive(returns, leaves)
    }
}

/// It grows as far as a limit.
#[derive(Debug, Clone)]
pub(in crate::model) struct Limited<R>(R);

impl<R: Real> AntiWindup<R> for Limited<R> {
    #[inline(always)]
    fn new(mut next: impl FnMut() -> R) -> Self {
        Self(next())
    }

    #[inline(always)]
    fn grown(&self, part: R, rate: R, errors: [R; 2], stage: &Stage<R>) -> R {
        (part + integrated(rate, errors, stage)).clamp(-self.0, self.0)
    }
}

/// The controller integrates before its output is limited.
#[derive(Debug, Clone)]
pub(in crate::model) struct BeforeLimit<R, W> {
    rate: R,
    anti_windup: W,
}

pub(in crate::model) type IntegralActionBeforeLimit<R> = BeforeLimit<R, GoesOn>;
pub(in crate::model) type IntegralActionTracked<R> = BeforeLimit<R, Tracking<R>>;
pub(in crate::model) type IntegralActionClamped<R> = BeforeLimit<R, Clamping>;
pub(in crate::model) type IntegralActionLimited<R> = BeforeLimit<R, Limited<R>>;
pub(in crate::model) type IntegralActionLeaking<R> = BeforeLimit<R, Leaking<R>>;

impl<R: Real, W: AntiWindup<R>> BeforeLimit<R, W> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            rate: next(),
            anti_windup: W::new(next),
        }
    }

    /// The integral part now: `own` are that when the step began, and the spool then.
    #[inline(always)]
    fn part(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        let errors = [stage.command - own[1], command - spool];
        self.anti_windup.grown(own[0], self.rate, errors, stage)
    }
}

impl<R: Real, W: AntiWindup<R>> Act<R> for BeforeLimit<R, W> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        command + self.part(own, command, spool, stage)
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        own[0] = self.part(own, command, spool, stage);
        own[1] = spool;
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], spool: R) {
        own[0] = R::constant(0.0);
        own[1] = spool;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_the_error_goes_on_in_every_step() {
        let mut values = [12.0].into_iter();
        let effect: IntegralActionBeforeLimit<f64> =
            IntegralActionBeforeLimit::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled_spool(&mut own, 1.0);
        let stage = |since: f64| Stage {
            since,
            ..Stage::first(3.0, 0.0)
        };
        // From 1 to 2 in a second, at a command of 3: errors of 2 and 1.
        assert_eq!(
            effect.reference(&own, 3.0, 2.0, &stage(1.0)),
            3.0 + 12.0 * 1.5
        );
        effect.remember(&mut own, 3.0, 2.0, &stage(1.0));
        assert_eq!(
            effect.reference(&own, 3.0, 2.0, &stage(0.0)),
            3.0 + 12.0 * 1.5
        );
    }

    /// What the integral part of the controller is that `anti_windup` keeps, in steps of `step`, where the error is that of a spool
    /// which comes to the command at the speed of its limited drive.
    fn parts<W: AntiWindup<f64>>(step: f64, mut values: impl Iterator<Item = f64>) -> Vec<f64> {
        let effect: BeforeLimit<f64, W> = BeforeLimit::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled_spool(&mut own, 0.0);
        let spool = |time: f64| 5.0 * time.min(1.15);
        let steps = (1.5 / step).round() as usize;
        (0..steps)
            .map(|k| {
                let stage = Stage {
                    since: step,
                    saturation: 2.0,
                    ..Stage::first(5.0, 0.0)
                };
                effect.remember(&mut own, 5.0, spool(step * (k + 1) as f64), &stage);
                own[0]
            })
            .collect()
    }

    #[test]
    fn each_way_against_windup_is_its_equation() {
        // Small steps of Euler's rule.
        let euler = |grows: &dyn Fn(f64, f64) -> f64, most: f64| {
            let (mut part, step) = (0.0f64, 1e-6);
            (0..1_500_000).for_each(|k| {
                let error = 5.0 - 5.0 * (step * f64::from(k)).min(1.15);
                part = (part + step * grows(error, part)).clamp(-most, most);
            });
            part
        };
        let excess = |output: f64| output - output.clamp(-2.0, 2.0);
        let values = [0.8, 3.0];
        let values = || values.into_iter();
        let free = f64::INFINITY;
        let last = |parts: Vec<f64>| *parts.last().unwrap();
        let step = 0.01;
        for (name, found, expected) in [
            (
                "goes on",
                last(parts::<GoesOn>(step, values())),
                euler(&|e, _| 0.8 * e, free),
            ),
            (
                "back calculation",
                last(parts::<Tracking<f64>>(step, values())),
                euler(&|e, j| 0.8 * e - 3.0 * excess(e + j), free),
            ),
            (
                "clamping",
                last(parts::<Clamping>(step, values())),
                euler(
                    &|e, j| if excess(e + j) == 0.0 { 0.8 * e } else { 0.0 },
                    free,
                ),
            ),
            (
                "limited",
                last(parts::<Limited<f64>>(step, [0.8, 1.2].into_iter())),
                euler(&|e, _| 0.8 * e, 1.2),
            ),
        ] {
            assert!(
                (found - expected).abs() < 1e-3,
                "{name}: {found} {expected}"
            );
        }
    }

    #[test]
    fn what_it_adds_is_the_integral_of_the_drive_without_it() {
        let mut values = [12.0].into_iter();
        let effect: IntegralAction<f64> = IntegralAction::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled_spool(&mut own, 1.5);
        // The integrator alone, in small steps: the spool does not lag behind it.
        let (mut lead, mut added, step) = (1.5, 0.0, 1e-6);
        let mut integral = 0.0;
        for k in 0..100_000 {
            let motion = Motion {
                gain: 200.0,
                time_constant: 0.004,
                spool: lead,
                speed: 0.0,
                slip_direction: 0.0,
                load: 0.0,
                drop: 0.0,
            };
            let drive = (40.0 * step * f64::from(k)).cos();
            let mut slope = [0.0];
            effect.follow(&own, 0.0, &motion, &mut slope);
            let with = effect.drive(&own, drive, &motion);
            added = with - drive;
            lead += step * with;
            own[0] += step * slope[0];
            integral += step * drive;
        }
        assert!((added - 12.0 * integral).abs() < 1e-3, "{added} {integral}");
        assert!(added.abs() > 0.1);
    }
}
