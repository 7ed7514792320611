//! A sensor lags.

use super::act::lagged;
use super::second_order::SecondOrder;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use super::{entry, host};
use crate::model::{Parameter, Real};

/// The slowest sensor of second order, Hz.
const SLOWEST: f64 = 1.0;

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
    applies: host::always,
    outputs: Some(host::any_output),
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

pub(super) const SECOND_ORDER: Entry = Entry {
    name: "sensor_lag~second_order",
    summary: "The sensor follows what it measures with a lag of second order",
    finding: "the {output} sensor follows up to {sensor_frequency}, with a lag of second order",
    equation: "y'' + 2 D w y' + w^2 y = w^2 x, w = 2 pi sensor_frequency, D = sensor_damping",
    shows: "a lag of one channel that begins more gently than one of first order, the same at all amplitudes",
    confused: "sensor_lag and delay; line_resonance, which is the same equation with a damping that rings",
    source: "data sheets of flow meters and transducers: a natural frequency and a damping of 0.6 to 0.8",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("sensor_frequency", output),
                "Hz",
                SLOWEST.min(0.05 / scale.interval),
                20.0 / scale.interval,
                20.0 / scale.interval,
            ),
            Parameter::linear(&entry::on("sensor_damping", output), "1", 0.5, 0.7, 0.98),
            Parameter::linear(&entry::on("sensor_share", output), "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.005, 0.02, 0.07, 0.2]
            .map(|share| vec![share / scale.interval, 0.7])
            .to_vec()
    },
    states: &["slow_sensor", "slow_sensor_rate"],
    neutral: &[("sensor_share", 0.0)],
    frequency: Some("sensor_frequency"),
    ..ENTRY
};

/// The sensor follows what it measures with a lag of second order.
pub(in crate::model) type SensorLagOfSecondOrder<R> = SecondOrder<R>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_second_order_a_ramp_is_late_by_twice_the_damping_over_the_rate() {
        let mut values = [20.0, 0.7, 1.0].into_iter();
        let effect: SensorLagOfSecondOrder<f64> =
            SensorLagOfSecondOrder::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 0.0);
        for k in 0..500 {
            let now = f64::from(k) * 1e-3;
            effect.filter(&mut own, now, now + 1e-3, 1e-3);
        }
        let late = 2.0 * 0.7 / (20.0 * std::f64::consts::TAU);
        assert!((own[0] - (0.5 - late)).abs() < 1e-6 && (own[1] - 1.0).abs() < 1e-6);
    }

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
