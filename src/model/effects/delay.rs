//! The command arrives late.

use super::host;
use super::in_loop::{BehindLag, InLoop};
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Pace, Parameter, Real};

/// What delays longer is a loop over a network or a sensor, s, and no valve.
const LONGEST: f64 = 0.25;

pub(super) const ENTRY: Entry = Entry {
    name: "delay",
    port: Port::Command,
    summary: "The command acts a fixed time after it is given",
    finding: "the response lags by {delay} more than the model allows",
    equation: "u(t - delay)",
    shows: "a phase error that grows linearly with frequency while the gain stays; the residual follows the command's rate",
    confused: "sensor_lag, which shows in one channel only; a larger time constant, which also lowers the gain at high frequency",
    source: "dead time of amplifier, bus and pilot stage; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "delay",
            "s",
            0.0,
            0.0,
            (50.0 * scale.interval).clamp(0.1, LONGEST),
        )]
    },
    trials: |scale, _| [1.0, 4.0, 15.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::always,
    outputs: None,
    view: Some(View::new(
        Excitation::Chirp,
        Over::CommandRate,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The command acts a fixed time after it is given.
#[derive(Debug, Clone)]
pub(in crate::model) struct Delay<R> {
    delay: R,
}

impl<R: Real> Delay<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { delay: next() }
    }
}

impl<R: Real> Act<R> for Delay<R> {
    #[inline(always)]
    fn delay(&self) -> Option<R> {
        Some(self.delay)
    }
}

pub(super) const LOOP: Entry = Entry {
    name: "delay~loop",
    port: Port::Actuator,
    summary: "The drive of the spool's loop acts a fixed time after the error that it answers",
    finding: "the loop's own drive is late by {loop_delay}",
    equation: "dx/dt = w(t - loop_delay), T dw/dt + w = K sat(u - x, S); the delay as 1 - a s + a^2 s^2 / 3 over 1 + a s + a^2 s^2 / 3, \
               a = loop_delay / 2",
    shows: "a loop that is less damped than its lag alone would have it, and that is late by as much at all amplitudes",
    confused: "delay of the command, behind which the loop is as damped as before; command_lag~loop, which makes it less damped, too, and \
               rounds; spool_resonance, which rings at a frequency of its own",
    source: "sampling and computing time of a digital controller, on average half a period and what it computes: Astrom, Wittenmark, \
             Computer-Controlled Systems, 1997; the approximant of second order, off by a hundredth of a radian at 1.5 / loop_delay, after Pade",
    parameters: |scale, _| {
        let least = least_in_loop(scale.interval);
        vec![
            Parameter::log(
                "loop_delay",
                "s",
                least,
                least,
                (100.0 * least).min(LONGEST),
            )
            .paced(Pace::Delay),
            Parameter::linear("loop_delay_share", "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    // The base model's lag has taken the delay in: with much of it besides, the loop is not stable.
    trials: |scale, _| {
        [3.0, 6.0, 16.0]
            .map(|n| vec![n * least_in_loop(scale.interval)])
            .to_vec()
    },
    imitated_by: &["time_constant"],
    states: &["speed_on_its_way", "speed_on_its_way_rate"],
    neutral: &[("loop_delay_share", 0.0)],
    applies: host::moves_no_piston,
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    ..ENTRY
};

/// The least delay of a loop that is looked for in rows with this `interval`, s: the fastest pole of its approximant is 3.5 / delay.
fn least_in_loop(interval: f64) -> f64 {
    (0.5 * interval).max(5e-4)
}

/// The drive of the loop acts a fixed time late.
pub(in crate::model) type DelayOfLoop<R> = BehindLag<R, Late<R>>;

/// The approximant of a delay: with its denominator D(s), 1/D of what drives it and the rate of that are its states, and what
/// passes is that which drives it less `delay` times the rate.
#[derive(Debug, Clone)]
pub(in crate::model) struct Late<R> {
    delay: R,
}

impl<R: Real> InLoop<R> for Late<R> {
    #[inline(always)]
    fn new(mut next: impl FnMut() -> R) -> Self {
        Self { delay: next() }
    }

    #[inline(always)]
    fn passed(&self, own: &[R], driven: R) -> R {
        driven - self.delay * own[1]
    }

    #[inline(always)]
    fn follow(&self, own: &[R], driven: R, _lag: R, slope: &mut [R]) {
        slope[0] = own[1];
        let lacks = (driven - own[0]) / self.delay - R::constant(0.5) * own[1];
        slope[1] = R::constant(12.0) * lacks / self.delay;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_late_by_the_delay() {
        let mut values = [0.0023].into_iter();
        let effect: Delay<f64> = Delay::new(|| values.next().unwrap());
        assert_eq!(effect.delay(), Some(0.0023));
    }

    #[test]
    fn a_sine_in_the_loop_is_late_by_the_delay_and_as_large() {
        let late = Late::new(|| 0.003);
        let (mut own, step, rate) = ([0.0; 2], 1e-6, 300.0);
        let mut most = 0.0f64;
        for k in 0..100_000 {
            let t = step * f64::from(k);
            let driven = (rate * t).sin();
            if t > 0.05 {
                let exact = (rate * (t - 0.003)).sin();
                most = most.max((late.passed(&own, driven) - exact).abs());
            }
            let mut slope = [0.0; 2];
            late.follow(&own, driven, 0.004, &mut slope);
            own[1] += step * slope[1];
            own[0] += step * own[1];
        }
        assert!(most < 3e-3, "{most}");
    }
}
