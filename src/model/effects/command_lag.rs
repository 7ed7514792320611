//! The command comes through a lag.

use super::act::lagged;
use super::host;
use super::in_loop::{Quickness, SecondPole};
use super::second_order::SecondOrder;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Port, Stage};
use crate::model::{Pace, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "command_lag",
    port: Port::Command,
    summary: "The command comes through a first-order lag, of the coil or of the amplifier's filter",
    finding: "the command lags by {command_lag} before it acts",
    equation: "command_lag dr/dt + r = u, sat(r - x, S) instead of sat(u - x, S)",
    shows: "a lag of everything that moves, and edges of steps that the valve alone would follow more sharply",
    confused: "delay, after which nothing is rounded; a larger time constant, which changes the loop's damping, too; sensor_lag of the \
               spool where nothing else is measured and nothing saturates",
    source: "inductance and resistance of the coil, driven by a voltage; Merritt, Hydraulic Control Systems, 1967; filters of amplifiers",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "command_lag",
            "s",
            0.1 * scale.interval,
            0.1 * scale.interval,
            (1e3 * scale.interval).min(10.0),
        )]
    },
    trials: |scale, _| [1.0, 4.0, 15.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &["lagging_command"],
    neutral: &[("command_lag", 0.0)],
    applies: host::moves_a_spool,
    outputs: None,
    view: Some(View::new(
        Excitation::Chirp,
        Over::CommandRate,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The command comes through a first-order lag.
#[derive(Debug, Clone)]
pub(in crate::model) struct CommandLag<R> {
    time_constant: R,
}

impl<R: Real> CommandLag<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time_constant: next(),
        }
    }
}

impl<R: Real> Act<R> for CommandLag<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], command: R) {
        own[0] = command;
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let lag = self.time_constant;
        let late = lagged(own[0], stage.command, command, lag, stage.since);
        lag.if_positive(late, command)
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
        own[0] = self.reference(own, command, spool, stage);
    }
}

pub(super) const SECOND_ORDER: Entry = Entry {
    name: "command_lag~second_order",
    summary: "The command comes through a lag of second order, of the torque motor or of the amplifier's filter",
    finding: "the command comes through a lag of second order of {command_frequency}",
    equation: "r'' + 2 D w r' + w^2 r = w^2 u, w = 2 pi command_frequency, D = command_damping; sat(r - x, S) instead of sat(u - x, S)",
    shows: "a lag of everything that moves, which begins more gently than one of first order",
    confused: "delay, and command_lag of first order; line_resonance and sensor_lag, which one channel shows",
    source: "natural frequency and damping of a torque motor's armature; Merritt, Hydraulic Control Systems, 1967; filters of amplifiers",
    parameters: |scale, _| {
        let fastest = 20.0 / scale.interval;
        vec![
            Parameter::log(
                "command_frequency",
                "Hz",
                (1e-4 * fastest).min(1.0),
                fastest,
                fastest,
            ),
            Parameter::linear("command_damping", "1", 0.2, 0.7, 0.98),
            Parameter::linear("command_share", "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.01, 0.04, 0.15]
            .map(|share| vec![share / scale.interval, 0.7])
            .to_vec()
    },
    states: &["lagging_command_of_two", "lagging_command_rate"],
    neutral: &[("command_share", 0.0)],
    frequency: Some("command_frequency"),
    ..ENTRY
};

/// The command comes through a lag of second order.
#[derive(Debug, Clone)]
pub(in crate::model) struct CommandLagOfSecondOrder<R>(SecondOrder<R>);

impl<R: Real> CommandLagOfSecondOrder<R> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(SecondOrder::new(next))
    }

    #[inline(always)]
    fn passed(&self, own: &[R], command: R, stage: &Stage<R>) -> [R; 2] {
        let mut state = [own[0], own[1]];
        self.0
            .filter(&mut state, stage.command, command, stage.since);
        state
    }
}

impl<R: Real> Act<R> for CommandLagOfSecondOrder<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], command: R) {
        self.0.settled(own, command);
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        self.0.of(self.passed(own, command, stage)[0], command)
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, _spool: R, stage: &Stage<R>) {
        [own[0], own[1]] = self.passed(own, command, stage);
    }
}

pub(super) const LOOP: Entry = Entry {
    name: "command_lag~loop",
    port: Port::Actuator,
    summary: "The drive of the spool's loop comes through a second lag, of the coil or of the transducer's filter",
    finding: "the loop's own drive comes through a second lag, of {loop_lag} of all its time constant",
    equation: "q dv/dt + v = w, dx/dt = v, (T - q) dw/dt + w = K sat(u - x, S); q = loop_lag T, the shorter of two lags that can be exchanged",
    shows: "a loop that is less damped than its first lag alone would have it, and that rounds what begins to move more",
    confused: "delay~loop, which rounds nothing; a larger time constant, of which a loop rings as well; spool_resonance, whose two lags \
               swing; command_lag, behind which the loop is as damped as before",
    source: "inductance of the torque motor's coil inside the loop: Merritt, Hydraulic Control Systems, 1967; the demodulator's filter of an \
             LVDT",
    parameters: |_, _| {
        vec![
            Parameter::log("loop_lag", "1", 0.05, 0.05, 0.5).paced(Pace::LagRatio),
            Parameter::linear("loop_lag_share", "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |_, _| [0.12, 0.25, 0.4].map(|share| vec![share]).to_vec(),
    states: &["lagging_drive"],
    neutral: &[("loop_lag_share", 0.0)],
    applies: host::moves_no_piston,
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    ..ENTRY
};

/// The drive of the loop comes through a second lag.
pub(in crate::model) type CommandLagOfLoop<R> = SecondPole<R, Lagging>;

/// Of two lags, one of which has this share of both.
#[derive(Debug, Clone)]
pub(in crate::model) struct Lagging;

impl Quickness for Lagging {
    #[inline(always)]
    fn of<R: Real>(share: R) -> R {
        R::constant(1.0) / (share * (R::constant(1.0) - share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Motion;
    use crate::model::effects::in_loop::tests::AT;

    /// The reference half-way through a step of 2 ms in which the command goes from 1 V to 3 V, and at its end.
    fn course(effect: &impl Act<f64>, own: &mut [f64]) -> [f64; 2] {
        effect.settled(own, 1.0);
        let stage = |since| Stage {
            since,
            ..Stage::first(1.0, 0.0)
        };
        let half = effect.reference(own, 2.0, 0.0, &stage(1e-3));
        effect.remember(own, 3.0, 0.0, &stage(2e-3));
        [
            half,
            effect.reference(own, 3.0, 0.0, &Stage::first(3.0, 0.0)),
        ]
    }

    #[test]
    fn a_lag_follows_a_ramp_as_the_exponential_says() {
        let lag = 2e-3;
        let effect: CommandLag<f64> = CommandLag::new(|| lag);
        let exact = |t: f64| 1.0 + 1e3 * (t - lag + lag * (-t / lag).exp());
        let found = course(&effect, &mut [0.0]);
        for (found, t) in found.into_iter().zip([1e-3, 2e-3]) {
            assert!((found - exact(t)).abs() < 1e-4, "{found} {}", exact(t));
        }
    }

    #[test]
    fn one_of_second_order_does_as_its_equation_says() {
        let mut values = [80.0, 0.7, 1.0].into_iter();
        let effect: CommandLagOfSecondOrder<f64> =
            CommandLagOfSecondOrder::new(|| values.next().unwrap());
        let found = course(&effect, &mut [0.0; 2]);
        let (rate, damping, step) = (std::f64::consts::TAU * 80.0, 0.7, 1e-8);
        let (mut r, mut speed) = (1.0, 0.0);
        for k in 0..200_000 {
            let command = 1.0 + 1e3 * step * f64::from(k);
            speed += step * (rate * rate * (command - r) - 2.0 * damping * rate * speed);
            r += step * speed;
            if k == 99_999 {
                assert!((found[0] - r).abs() < 1e-4, "{} {r}", found[0]);
            }
        }
        assert!((found[1] - r).abs() < 1e-4, "{} {r}", found[1]);
    }

    #[test]
    fn the_loop_s_two_lags_answer_a_step_as_exponentials_say() {
        let mut values = [0.25, 1.0].into_iter();
        let effect: CommandLagOfLoop<f64> = CommandLagOfLoop::new(|| values.next().unwrap());
        // 1 ms and 3 ms are 4 ms in all, and the base model's w, T w' = drive - v, is what drives the second.
        let (mut own, mut w, step) = ([0.0], 0.0, 1e-7);
        for _ in 0..50_000 {
            let mut slope = [0.0];
            effect.follow(&own, w, &Motion { speed: w, ..AT }, &mut slope);
            w += step * (100.0 - effect.speed(&own, w, &AT)) / AT.time_constant;
            own[0] += step * slope[0];
        }
        let left = |lag: f64| (-5e-3 / lag).exp();
        let exact = 100.0 * (1.0 - (3.0 * left(3e-3) - left(1e-3)) / 2.0);
        assert!((own[0] - exact).abs() < 0.01, "{} {exact}", own[0]);
    }
}
