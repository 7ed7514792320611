//! A loop settles at a share of its command.

use super::host;
use super::{Act, Entry, Host, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "dc_gain",
    port: Port::Command,
    summary: "The loop settles at a share of its command that is not 1",
    finding: "the loop settles at {dc_gain} times its command",
    equation: "dc_gain u",
    shows: "an error in proportion to the command that stays however long the loop has to settle",
    confused: "flow_force, which pulls a spool back alike but from a saturated loop's speed, too; null_bias and sensor_offset, which do not grow with the command",
    source: "finite gain of a loop without integral action, scales of command and transducer that differ; Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| vec![Parameter::linear("dc_gain", "1", 0.5, 1.0, 2.0)],
    trials: |_, _| vec![vec![0.97], vec![1.1]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: compares_with_its_command,
    outputs: None,
    view: None,
    frequency: None,
};

/// In another unit the ratio of loop and command is a parameter of the base model.
fn compares_with_its_command(host: &dyn Host) -> bool {
    let output = host::loop_output(host);
    output.is_some_and(|output| host.unit(output) == host.command_unit())
}

/// The loop settles at a share of its command that is not 1.
#[derive(Debug, Clone)]
pub(in crate::model) struct DcGain<R> {
    gain: R,
}

impl<R: Real> DcGain<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { gain: next() }
    }
}

impl<R: Real> Act<R> for DcGain<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        self.gain * command
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::base::servo_valve::Piston;
    use crate::model::{Output, ServoValve, Structure};

    #[test]
    fn the_loop_is_asked_for_a_share_of_the_command() {
        let mut values = [0.97].into_iter();
        let effect: DcGain<f64> = DcGain::new(|| values.next().unwrap());
        assert_eq!(effect.command(&mut [], -2.0), -1.94);
    }

    #[test]
    fn only_a_loop_in_the_unit_of_its_command_has_a_gain_that_should_be_1() {
        let loop_of = |command_unit: &str, output, spool_unit: Option<&str>, piston| Structure {
            observed: vec![output],
            base: ServoValve {
                spool_unit: spool_unit.map(String::from),
                piston,
                ..ServoValve::default()
            }
            .into(),
            ..Structure::actuator(10.0, command_unit)
        };
        for (structure, gain, lead) in [
            (
                loop_of("V", Output::Spool, None, Piston::Integrated),
                true,
                true,
            ),
            (
                loop_of("V", Output::Spool, Some("%"), Piston::Integrated),
                false,
                true,
            ),
            (
                loop_of("mm", Output::Position, None, Piston::Servo),
                true,
                true,
            ),
            (
                loop_of("V", Output::Position, None, Piston::Servo),
                false,
                true,
            ),
            (
                loop_of("mm", Output::Position, None, Piston::Integrated),
                false,
                false,
            ),
            (
                loop_of("V", Output::Flow, None, Piston::Integrated),
                false,
                false,
            ),
        ] {
            let known = |name| (super::super::entry(name).unwrap().applies)(&structure);
            assert_eq!(
                (known("dc_gain"), known("feed_forward")),
                (gain, lead),
                "{structure:?}"
            );
        }
    }
}
