//! Small commands do nothing.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "dead_band",
    port: Port::Command,
    summary: "The command must pass a dead band before the spool answers",
    finding: "the spool answers only to what of the command is beyond ±{dead_band}",
    equation: "u - clamp(u, ±dead_band)",
    shows: "a spool that stays at null for small commands and is short by as much for large ones, the same in both directions",
    confused: "overlap, which the spool does not show; hysteresis, which depends on the direction; friction, which shows at reversals anywhere",
    source: "dead bands of amplifiers and of joysticks; ISO 10770-1, threshold and dead band",
    parameters: |scale, _| {
        let most = 0.3 * scale.command;
        vec![Parameter::linear(
            "dead_band",
            &scale.command_unit,
            0.0,
            0.0,
            most,
        )]
    },
    trials: |scale, _| {
        [0.005, 0.02, 0.06]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Command, Values::Given(&[0.8]))),
    frequency: None,
};

/// The command must pass a dead band before the spool answers.
#[derive(Debug, Clone)]
pub(in crate::model) struct DeadBand<R> {
    half_width: R,
}

impl<R: Real> DeadBand<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { half_width: next() }
    }
}

impl<R: Real> Act<R> for DeadBand<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command - command.clamp(-self.half_width, self.half_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_the_band_passes() {
        let mut values = [0.5].into_iter();
        let effect: DeadBand<f64> = DeadBand::new(|| values.next().unwrap());
        let found = [-2.0, -0.5, 0.25, 0.5, 3.0].map(|u| effect.command(&mut [], u));
        assert_eq!(found, [-1.5, 0.0, 0.0, 0.0, 2.5]);
    }
}
