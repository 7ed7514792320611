//! A sensor's zero is off.

use super::{Act, Entry, Moment, Port};
use super::{entry, host};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "sensor_offset",
    port: Port::Measurement,
    summary: "The sensor shows something when there is nothing",
    finding: "the {output} sensor shows {sensor_offset} where there is nothing",
    equation: "y + sensor_offset",
    shows: "a constant",
    confused: "null_bias where only the spool is measured",
    source: "sensor data sheets",
    parameters: |scale, output| {
        vec![Parameter::linear(
            &entry::on("sensor_offset", output),
            scale.unit(output),
            -0.5 * scale.output(output),
            0.0,
            0.5 * scale.output(output),
        )]
    },
    trials: |scale, output| vec![vec![0.01 * scale.output(output)]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::always,
    outputs: Some(host::any_output),
    view: None,
    frequency: None,
};

/// The sensor shows something when there is nothing.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorOffset<R> {
    offset: R,
}

impl<R: Real> SensorOffset<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { offset: next() }
    }
}

impl<R: Real> Act<R> for SensorOffset<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, _moment: &Moment<R>) -> R {
        value + self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_adds_the_offset() {
        let mut values = [-0.25].into_iter();
        let effect: SensorOffset<f64> = SensorOffset::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        assert_eq!(effect.measure(&[], 1.0, &moment), 0.75);
    }
}
