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
    parameters: |scale, _| {
        vec![
            Parameter::linear("integral_action", "1/s", 0.0, 0.0, fastest(scale.interval))
                .paced(Pace::Rate),
        ]
    },
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

pub(super) const BEFORE: Entry = Entry {
    name: "integral_action~windup",
    summary: "The controller of the spool's loop integrates its error as well, also while its drive is limited",
    finding: "the loop's controller integrates, with {integral_action_windup} of its proportional part, also while its drive is limited",
    equation: "dz/dt = K sat(e + integral_action_windup int e dt, S), e = u - x",
    shows: "a spool that runs further past its command the longer its drive was limited on the way",
    confused: "integral_action, whose integral waits while the drive is limited",
    parameters: |scale, _| {
        vec![
            Parameter::linear(
                "integral_action_windup",
                "1/s",
                0.0,
                0.0,
                fastest(scale.interval),
            )
            .paced(Pace::Rate),
        ]
    },
    states: &["integral_of_error", "spool_at_step"],
    ..ENTRY
};

/// The controller integrates before its output is limited.
#[derive(Debug, Clone)]
pub(in crate::model) struct IntegralActionBeforeLimit<R> {
    rate: R,
}

impl<R: Real> IntegralActionBeforeLimit<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { rate: next() }
    }

    /// The integral of the error now, by the trapezium over the step: `own` are that when the step began, and the spool then.
    #[inline(always)]
    fn integral(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        let errors = (stage.command - own[1]) + (command - spool);
        own[0] + R::constant(0.5) * stage.since * errors
    }
}

impl<R: Real> Act<R> for IntegralActionBeforeLimit<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        command + self.rate * self.integral(own, command, spool, stage)
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        own[0] = self.integral(own, command, spool, stage);
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
