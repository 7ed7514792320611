//! A trapped volume fills before the flow passes on.

use super::act::lagged;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use super::{entry, host};
use crate::model::{Parameter, Real};

/// Ten litres of oil fill faster through a valve that gives 0.1 L/min per bar, s: V / (β ∂Q/∂p) at 1 GPa.
const SLOWEST: f64 = 0.6;

pub(super) const ENTRY: Entry = Entry {
    name: "compressibility",
    port: Port::Flow,
    summary: "A trapped volume of oil fills before the flow passes on",
    finding: "the flow lags by {compressibility} because a trapped volume of oil fills first",
    equation: "compressibility dq/dt + q = Q",
    shows: "a lag of the flow that the spool does not show",
    confused: "sensor_lag on the flow, which has the same equation: only another volume tells them apart; a lag of more than 0.6 s is the \
               meter's",
    source: "oil's bulk modulus; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, output| {
        vec![Parameter::linear(
            &entry::on("compressibility", output),
            "s",
            1e-7,
            1e-7,
            (1e3 * scale.interval).min(SLOWEST),
        )]
    },
    trials: |scale, _| [1.0, 6.0, 40.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &["filled"],
    neutral: &[("compressibility", 0.0)],
    applies: host::shows_a_flow,
    outputs: Some(host::flow_outputs),
    view: Some(View::new(
        Excitation::Chirp,
        Over::OutputRate,
        Values::Trial(1),
    )),
    frequency: None,
};

/// A trapped volume of oil fills before the flow passes on.
#[derive(Debug, Clone)]
pub(in crate::model) struct Compressibility<R> {
    time_constant: R,
}

impl<R: Real> Compressibility<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time_constant: next(),
        }
    }
}

impl<R: Real> Act<R> for Compressibility<R> {
    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
    }

    #[inline(always)]
    fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
        own[0] = lagged(own[0], before, after, self.time_constant, step);
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        // Without a lag it also follows what jumps at a row.
        self.time_constant.if_positive(own[0], value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_late_by_the_time_constant() {
        let mut values = [0.02].into_iter();
        let effect: Compressibility<f64> = Compressibility::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled(&mut own, 0.0);
        // On a ramp of 1 per second it ends 0.02 s late.
        for k in 0..40 {
            let now = f64::from(k) * 0.01;
            effect.filter(&mut own, now, now + 0.01, 0.01);
        }
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        let exact = 0.4 - 0.02 * (1.0 - (-20.0f64).exp());
        assert!((effect.measure(&own, 0.4, &moment) - exact).abs() < 1e-6);
    }
}
