//! The command acts through a play.

use super::entry;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "hysteresis",
    port: Port::Command,
    summary: "The command acts through a play: rate-independent hysteresis",
    finding: "a play of ±{hysteresis} lies between command and spool",
    equation: "y = max(u - b, min(u + b, y_before)), half-width b = hysteresis",
    shows: "a loop of constant width at any speed, however slow; the residual follows the command's direction",
    confused: "friction, whose error grows when the spool moves slowly; a lag, whose loop vanishes at low speed",
    source: "play operator: Visintin, Differential Models of Hysteresis, 1994; ISO 10770-1, hysteresis",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "hysteresis",
            &scale.command_unit,
            0.0,
            0.0,
            0.2 * scale.command,
        )]
    },
    trials: |scale, _| {
        [0.003, 0.012, 0.04]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    imitated_by: &[],
    states: &["play"],
    neutral: &[],
    applies: entry::always,
    outputs: None,
    view: Some(View::new(view::SMALL, Over::Command, Values::Trial(1))),
    frequency: None,
};

/// The command acts through a play: rate-independent hysteresis.
#[derive(Debug, Clone)]
pub(in crate::model) struct Hysteresis<R> {
    width: R,
}

impl<R: Real> Hysteresis<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }
}

impl<R: Real> Act<R> for Hysteresis<R> {
    #[inline(always)]
    fn command(&self, own: &mut [R], command: R) -> R {
        let follower = (command - self.width).max((command + self.width).min(own[0]));
        own[0] = follower;
        follower
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_play_follows_at_its_half_width() {
        let mut values = [0.5].into_iter();
        let effect: Hysteresis<f64> = Hysteresis::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled(&mut own, 1.0);
        let found = [1.25, 2.0, 3.0, 2.5, 2.0, 1.0].map(|u| effect.command(&mut own, u));
        assert_eq!(found, [1.0, 1.5, 2.5, 2.5, 2.5, 1.5]);
    }
}
