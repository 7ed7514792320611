//! The command is shifted.

use super::host;
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "null_bias",
    port: Port::Command,
    summary: "The valve's null does not lie at zero command",
    finding: "the valve answers as if {null_bias} were added to the command",
    equation: "u + null_bias",
    shows: "a constant spool error, even harmonics, and a dead zone that is not centred",
    confused: "sensor_offset where only the spool is measured: with flow measured a null bias moves it, too",
    source: "ISO 10770-1, null bias",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "null_bias",
            &scale.command_unit,
            -0.3 * scale.command,
            0.0,
            0.3 * scale.command,
        )]
    },
    trials: |scale, _| vec![vec![0.01 * scale.command]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::always,
    outputs: None,
    view: None,
    frequency: None,
};

/// The valve's null does not lie at zero command.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBias<R> {
    bias: R,
}

impl<R: Real> NullBias<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { bias: next() }
    }
}

impl<R: Real> Act<R> for NullBias<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command + self.bias
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_shifted() {
        let mut values = [0.3].into_iter();
        let effect: NullBias<f64> = NullBias::new(|| values.next().unwrap());
        assert_eq!(effect.command(&mut [], 2.0), 2.3);
    }
}
