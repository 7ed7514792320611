//! The command arrives late.

use super::host;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_late_by_the_delay() {
        let mut values = [0.0023].into_iter();
        let effect: Delay<f64> = Delay::new(|| values.next().unwrap());
        assert_eq!(effect.delay(), Some(0.0023));
    }
}
