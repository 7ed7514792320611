//! A sensor lags.

use super::act::lagged;
use super::entry;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Parameter, Real};
pub(super) const ENTRY: Entry = Entry {
    name: "sensor_lag",
    port: Port::Measurement,
    summary: "The sensor follows what it measures with a first-order lag",
    finding: "the {output} sensor lags by {sensor_lag}",
    equation: "sensor_lag dy/dt + y = x",
    shows: "a lag of one channel, the same at all amplitudes; the other channels do not show it",
    confused: "delay and a larger time constant where no other channel is measured; compressibility on the flow",
    source: "sensor and filter data sheets; a flow meter's lag can be twenty times the valve's",
    parameters: |scale, output| {
        vec![Parameter::linear(
            &entry::on("sensor_lag", output),
            "s",
            1e-7,
            1e-7,
            1e3 * scale.interval,
        )]
    },
    trials: |scale, _| [1.0, 6.0, 40.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &["sensor"],
    neutral: &[("sensor_lag", 0.0)],
    applies: entry::always,
    outputs: Some(entry::any_output),
    view: Some(View::new(
        Excitation::Chirp,
        Over::OutputRate,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The sensor follows what it measures with a first-order lag.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorLag<R> {
    time_constant: R,
}

impl<R: Real> SensorLag<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time_constant: next(),
        }
    }
}

impl<R: Real> Act<R> for SensorLag<R> {
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
        let effect: SensorLag<f64> = SensorLag::new(|| values.next().unwrap());
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
