//! The spool sticks.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "friction",
    port: Port::Actuator,
    summary: "Coulomb and Stribeck friction: the spool sticks until the error is large enough",
    finding: "friction of {friction}, and {stiction} more at standstill, hold the spool",
    equation: "T dv/dt = K sat(u - x, S) - v - K f sign(v), f = friction + stiction/(1 + (v/stribeck_speed)^2); v stays 0 while |sat(u - x, S)| <= friction + stiction",
    shows: "a spool that stands still after reversals, plateaus on slow sines, relatively worse when the motion is small",
    confused: "hysteresis on one slow triangle: only friction lets go with a jump and depends on how the spool moves",
    source: "Karnopp 1985; Armstrong-Helouvry et al. 1994; Choudhury et al. 2005 (valve stiction)",
    parameters: |scale, _| {
        vec![
            Parameter::linear(
                "friction",
                &scale.command_unit,
                0.0,
                0.0,
                0.3 * scale.command,
            ),
            Parameter::linear(
                "stiction",
                &scale.command_unit,
                0.0,
                0.0,
                0.3 * scale.command,
            ),
            Parameter::linear(
                "stribeck_speed",
                &format!("{}/s", scale.command_unit),
                1e-6 * scale.command / scale.interval,
                5e-5 * scale.command / scale.interval,
                1e-3 * scale.command / scale.interval,
            )
            .fixed(),
        ]
    },
    trials: |scale, _| {
        [0.003, 0.015, 0.05]
            .map(|share| vec![share * scale.command, 0.0])
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    // With stiction, so that it lets go with a jump.
    view: Some(View::new(
        view::SMALL,
        Over::Command,
        Values::Given(&[0.15, 0.15]),
    )),
    frequency: None,
};

/// Coulomb and Stribeck friction: the spool sticks until the error is large enough.
#[derive(Debug, Clone)]
pub(in crate::model) struct Friction<R> {
    coulomb: R,
    stiction: R,
    stribeck: R,
}

impl<R: Real> Friction<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            coulomb: next(),
            stiction: next(),
            stribeck: next(),
        }
    }
}

impl<R: Real> Friction<R> {
    /// What the drive must exceed to set the spool in motion.
    #[inline(always)]
    fn breakaway(&self, motion: &Motion<R>) -> R {
        motion.gain * (self.coulomb + self.stiction)
    }

    /// What is left of a drive that acts on a spool at rest.
    #[inline(always)]
    fn excess(&self, drive: R, motion: &Motion<R>) -> R {
        let breakaway = self.breakaway(motion);
        drive - drive.clamp(-breakaway, breakaway)
    }
}

impl<R: Real> Act<R> for Friction<R> {
    fn feels_load(&self) -> bool {
        false
    }

    fn sticks(&self) -> bool {
        true
    }

    #[inline(always)]
    fn slip_direction(&self, _: &[R], drive: R, motion: &Motion<R>) -> R {
        let moves = motion.speed.abs();
        moves.if_positive(motion.speed, self.excess(drive, motion))
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        // Its direction holds for a whole step: one that changed with the speed would let the spool creep.
        let ratio = motion.speed / self.stribeck;
        let sliding =
            motion.gain * (self.coulomb + self.stiction / (R::constant(1.0) + ratio * ratio));
        let resting = self.excess(drive, motion);
        let forward = motion.slip_direction.if_positive(drive - sliding, resting);
        (-motion.slip_direction).if_positive(drive + sliding, forward)
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
        // Where its speed changes sign within the step it comes to rest, and stays there unless the drive breaks it away
        // for what is left of the step.
        let ahead = lead - spool;
        let speed = ahead / start.time_constant;
        let share = start.speed / (start.speed - speed);
        let half = R::constant(0.5);
        let rest = start.spool + half * start.speed * share * step;
        let left = (R::constant(1.0) - share) * step;
        let ahead_then = self.excess(drive, start) * left;
        let spool_then = rest + half * ahead_then * left / start.time_constant;
        let turned = -(start.slip_direction * ahead);
        let breakaway = self.breakaway(start);
        let lead_then = turned.if_positive(spool_then + ahead_then, lead);
        let spool_then = turned.if_positive(spool_then, spool);
        (
            breakaway.if_positive(lead_then, lead),
            breakaway.if_positive(spool_then, spool),
        )
    }
}

pub(super) const BEHIND: Entry = Entry {
    name: "friction~windup",
    summary: "Coulomb friction and stiction on an overdamped spool: it sticks until the loop's integrator has wound up enough",
    finding: "friction of {friction_windup}, and {stiction_windup} more at standstill, hold the spool until the loop has wound up as much",
    equation: "dz/dt = K sat(u - x, S), T dx/dt = z - x -/+ friction_windup, dx/dt = 0 while |z - x| <= friction_windup, and from rest on while |z - x| <= friction_windup + stiction_windup",
    shows: "a spool that stands still after reversals, and then catches up with its command",
    confused: "friction in front of the integrator, which leaves an error at rest",
    source: "Karnopp 1985; Olsson et al. 1998; Armstrong-Helouvry et al. 1994",
    parameters: |scale, _| {
        let of = |name| Parameter::linear(name, &scale.command_unit, 0.0, 0.0, 0.3 * scale.command);
        vec![of("friction_windup"), of("stiction_windup")]
    },
    // With stiction: without any its cost has no slope.
    trials: |scale, _| {
        [0.003, 0.015, 0.05]
            .map(|share| vec![share * scale.command, 0.3 * share * scale.command])
            .to_vec()
    },
    states: &["slides"],
    view: Some(View::new(
        view::SMALL,
        Over::Command,
        Values::Given(&[0.15, 0.0]),
    )),
    ..ENTRY
};

/// Coulomb friction and stiction behind the integrator. Its state is the direction in which the spool slides, zero while it sticks.
#[derive(Debug, Clone)]
pub(in crate::model) struct FrictionBehind<R> {
    coulomb: R,
    stiction: R,
}

impl<R: Real> FrictionBehind<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            coulomb: next(),
            stiction: next(),
        }
    }

    /// The speeds that a sliding spool loses, and that one at rest must exceed to slide.
    #[inline(always)]
    fn speeds(&self, motion: &Motion<R>) -> (R, R) {
        let breakaway = (self.coulomb + self.stiction) / motion.time_constant;
        (self.coulomb / motion.time_constant, breakaway)
    }
}

impl<R: Real> Act<R> for FrictionBehind<R> {
    fn feels_load(&self) -> bool {
        false
    }

    fn sticks(&self) -> bool {
        true
    }

    #[inline(always)]
    fn slip_direction(&self, own: &[R], _drive: R, motion: &Motion<R>) -> R {
        let (lost, needed) = self.speeds(motion);
        let (one, zero) = (R::constant(1.0), R::constant(0.0));
        let slides = own[0];
        let sets_out =
            (motion.speed.abs() - needed).if_positive(one.with_sign_of(motion.speed), zero);
        (slides * motion.speed - slides.abs() * lost).if_positive(slides, sets_out)
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, motion: &Motion<R>) -> R {
        let (lost, needed) = self.speeds(motion);
        let zero = R::constant(0.0);
        let sets_out = speed - speed.clamp(-needed, needed);
        let direction = motion.slip_direction;
        let along = direction * speed;
        let slides = direction * (along - lost).max(zero);
        // What comes to rest within a step may set out the other way.
        let turns = (-along - needed).if_positive(sets_out, zero);
        direction.abs().if_positive(slides + turns, sets_out)
    }

    #[inline(always)]
    fn end_step(
        &self,
        own: &mut [R],
        lead: R,
        spool: R,
        _drive: R,
        start: &Motion<R>,
        step: R,
    ) -> (R, R) {
        // A spool that broke away within the step has slid since then: z - x falls towards what z, which goes straight, keeps it at.
        let (one, zero) = (R::constant(1.0), R::constant(0.0));
        let lag = start.time_constant;
        let (lost, needed) = self.speeds(start);
        let ends = (lead - start.spool) / lag;
        let direction = one.with_sign_of(ends);
        let (began, ends) = (direction * start.speed, ends.abs());
        let gained = ends - began;
        let left = step * ((ends - needed) / gained).clamp(zero, one);
        let kept = lost + gained * lag / step;
        let (gone, _) = (left / lag).caught_up();
        let behind = needed + (kept - needed) * gone;
        let broke_away = (ends - needed).if_positive(one - start.slip_direction.abs(), zero);
        own[0] = broke_away.if_positive(direction, start.slip_direction);
        let slid = self
            .stiction
            .if_positive(lead - direction * lag * behind, spool);
        (lead, broke_away.if_positive(slid, spool))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_sticks_slides_and_comes_to_rest() {
        let mut values = [0.1, 0.2, 5.0].into_iter();
        let effect: Friction<f64> = Friction::new(|| values.next().unwrap());
        let motion = |speed, slip_direction| Motion {
            gain: 200.0,
            time_constant: 0.003,
            spool: 1.0,
            speed,
            slip_direction,
            load: 2.0,
            drop: 0.0,
        };
        // At rest K (F + F_s) = 60 holds it; at the Stribeck speed K (F + F_s / 2) = 40 brakes it.
        let drive = |drive, speed: f64| effect.drive(&[], drive, &motion(speed, speed));
        assert!((drive(59.0, 0.0)).abs() < 1e-12 && (drive(-70.0, 0.0) + 10.0).abs() < 1e-9);
        assert!((drive(0.0, 5.0) + 40.0).abs() < 1e-9 && (drive(0.0, -5.0) - 40.0).abs() < 1e-9);
        // From 4 V/s to -4 V/s: at rest in the middle of the step, 4 * 0.5 / 2 of a step further.
        let (lead, spool) =
            effect.end_step(&mut [], 1.0 - 0.012, 1.0, 30.0, &motion(4.0, 1.0), 1e-3);
        assert!(
            lead == spool && (spool - 1.001).abs() < 1e-12,
            "{lead} {spool}"
        );
    }

    #[test]
    fn behind_the_integrator_it_holds_until_the_lead_exceeds_it() {
        let behind = |values: [f64; 2]| {
            let mut values = values.into_iter();
            FrictionBehind::<f64>::new(|| values.next().unwrap())
        };
        let motion = |speed, slip_direction| Motion {
            gain: 200.0,
            time_constant: 0.003,
            spool: 1.0,
            speed,
            slip_direction,
            load: 2.0,
            drop: 0.0,
        };
        // 0.3 V of lead over T are 100 V/s.
        let effect = behind([0.3, 0.0]);
        for slides in [-1.0, 0.0, 1.0] {
            let speeds = [-350.0, -99.0, 0.0, 99.0, 150.0];
            let speeds = speeds.map(|v| effect.speed(&[], v, &motion(0.0, slides)));
            for (found, expected) in speeds.into_iter().zip([-250.0, 0.0, 0.0, 0.0, 50.0]) {
                assert!((found - expected).abs() < 1e-9, "{slides}: {speeds:?}");
            }
        }
        // With as much stiction it slides at 150 V/s of lead, but does not set out.
        let effect = behind([0.3, 0.3]);
        let direction = |speed, slid: f64| effect.slip_direction(&[slid], 0.0, &motion(speed, 0.0));
        assert_eq!(
            [-1.0, 0.0, 1.0].map(|slid| direction(150.0, slid)),
            [0.0, 0.0, 1.0]
        );
        assert_eq!(
            [-1.0, 0.0, 1.0].map(|slid| direction(-250.0, slid)),
            [-1.0; 3]
        );
        assert!((effect.speed(&[], 150.0, &motion(0.0, 1.0)) - 50.0).abs() < 1e-9);
        assert_eq!(effect.speed(&[], 150.0, &motion(0.0, 0.0)), 0.0);
        // Set out in the middle of a step in which z rose from 0.45 to 0.75 V ahead: what 1e5 steps of Euler's say.
        let (step, count) = (1e-3, 100_000);
        let (mut z, mut x) = (1.6, 1.0);
        for _ in 0..count / 2 {
            x += 0.5 * step / f64::from(count / 2) * ((z - x - 0.3) / 0.003);
            z += 0.15 / f64::from(count / 2);
        }
        let mut own = [0.0];
        let (lead, spool) = effect.end_step(&mut own, 1.75, 1.0, 0.0, &motion(150.0, 0.0), step);
        assert!(
            (spool - x).abs() < 1e-6 && lead == 1.75 && own == [1.0],
            "{spool} {x}"
        );
    }
}
