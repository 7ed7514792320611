//! A sensor's zero drifts.

use super::entry;
use super::{Act, Entry, Moment, Port};
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
    applies: entry::always,
    outputs: Some(entry::any_output),
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
}
