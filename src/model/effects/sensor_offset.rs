//! A sensor's zero is off.

use super::entry;
use super::{Act, Entry, Moment, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "sensor_offset",
    port: Port::Measurement,
    summary: "The sensor shows something when there is nothing",
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
    states: &[],
    neutral: &[],
    applies: entry::always,
    outputs: Some(entry::any_output),
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
