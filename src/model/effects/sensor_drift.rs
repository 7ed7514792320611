//! A sensor's zero drifts.

use super::{Act, Entry, Moment, Port, Scale};
use super::{entry, host};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "sensor_drift",
    port: Port::Measurement,
    summary: "The sensor's zero moves with time",
    finding: "the zero of the {output} sensor drifts by {sensor_drift}",
    equation: "y + sensor_drift t",
    shows: "a ramp in time",
    confused: "sensor_offset on short records; viscosity_drift, which is gone at null",
    source: "sensor data sheets",
    parameters: |scale, output| {
        vec![Parameter::linear(
            &entry::on("sensor_drift", output),
            &format!("{}/s", scale.unit(output)),
            -scale.output(output) / scale.length,
            0.0,
            scale.output(output) / scale.length,
        )]
    },
    trials: |scale, output| vec![vec![0.02 * scale.output(output) / scale.length]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::always,
    outputs: Some(host::any_output),
    view: None,
    frequency: None,
};

/// The sensor's zero moves with time.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorDrift<R> {
    rate: R,
}

impl<R: Real> SensorDrift<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { rate: next() }
    }
}

impl<R: Real> Act<R> for SensorDrift<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        value + self.rate * moment.time
    }
}

pub(super) const SETTLING: Entry = Entry {
    name: "sensor_drift~settling",
    summary: "The sensor's zero moves as it warms up, and comes to rest",
    finding: "the zero of the {output} sensor drifts by {sensor_drift_settling}, with a time constant of {sensor_settling_time}",
    equation: "y + sensor_drift_settling (1 - e^(-t / sensor_settling_time))",
    shows: "a curve in time that levels off",
    confused: "sensor_drift, whose ramp goes on; sensor_offset, which is there from the beginning",
    source: "warm-up drift of transducers: IEC 61298-3; first-order heating of a body",
    parameters: |scale, output| {
        let most = scale.output(output);
        vec![
            Parameter::linear(
                &entry::on("sensor_drift_settling", output),
                scale.unit(output),
                -most,
                0.0,
                most,
            ),
            settling_time(&entry::on("sensor_settling_time", output), scale),
        ]
    },
    trials: |scale, output| {
        let amount = 0.02 * scale.output(output);
        [0.3, 0.8]
            .map(|share| vec![amount, share * scale.length])
            .to_vec()
    },
    ..ENTRY
};

/// The time constant with which something comes to rest that moves as a record of this `scale` goes on. What is at rest after a
/// short part of it is an offset.
pub(super) fn settling_time(name: &str, scale: &Scale) -> Parameter {
    let length = scale.length;
    Parameter::log(name, "s", 0.25 * length, 0.7 * length, 4.0 * length)
}

/// The sensor's zero moves as it warms up.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorDriftSettling<R> {
    amount: R,
    time: R,
}

impl<R: Real> SensorDriftSettling<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            amount: next(),
            time: next(),
        }
    }
}

impl<R: Real> Act<R> for SensorDriftSettling<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        let (settled, _) = (moment.time / self.time).caught_up();
        value + self.amount * settled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_adds_a_ramp() {
        let mut values = [0.25].into_iter();
        let effect: SensorDrift<f64> = SensorDrift::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        assert_eq!(effect.measure(&[], 1.0, &moment), 1.5);
    }

    #[test]
    fn it_comes_to_rest() {
        let mut values = [0.25, 2.0].into_iter();
        let effect: SensorDriftSettling<f64> = SensorDriftSettling::new(|| values.next().unwrap());
        for (time, drifted) in [
            (0.0, 0.0),
            (2.0, 0.25 * (1.0 - (-1.0f64).exp())),
            (1e3, 0.25),
        ] {
            let moment = Moment {
                time,
                temperature: 50.0,
                opening: 3.0,
                drop: 10.0,
                relative_drop: 1.0,
            };
            assert!((effect.measure(&[], 1.0, &moment) - 1.0 - drifted).abs() < 2e-5);
        }
    }
}
