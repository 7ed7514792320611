//! The spool sticks.

use super::entry;
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "friction",
    port: Port::Actuator,
    summary: "Coulomb and Stribeck friction: the spool sticks until the error is large enough",
    equation: "T dv/dt = K sat(u - x, S) - v - K f sign(v), f = friction + stiction/(1 + (v/stribeck_speed)^2); v stays 0 while |sat(u - x, S)| <= friction + stiction",
    shows: "a spool that stands still after reversals, plateaus on slow sines, relatively worse when the motion is small",
    confused: "hysteresis on one slow triangle: only friction lets go with a jump and depends on how the spool moves",
    source: "Karnopp 1985; Armstrong-Helouvry et al. 1994; Choudhury et al. 2005 (valve stiction)",
    parameters: |scale, _| {
        vec![
            Parameter::linear(
                "friction",
                &scale.command_unit,
                0.0,
                0.0,
                0.3 * scale.command,
            ),
            Parameter::linear(
                "stiction",
                &scale.command_unit,
                0.0,
                0.0,
                0.3 * scale.command,
            ),
            Parameter::linear(
                "stribeck_speed",
                &format!("{}/s", scale.command_unit),
                1e-3 * scale.command,
                0.05 * scale.command,
                scale.command,
            )
            .fixed(),
        ]
    },
    trials: |scale, _| {
        [0.003, 0.015, 0.05]
            .map(|share| vec![share * scale.command, 0.0])
            .to_vec()
    },
    states: &[],
    neutral: &[],
    applies: entry::moves_a_spool,
    outputs: None,
};

/// Coulomb and Stribeck friction: the spool sticks until the error is large enough.
#[derive(Debug, Clone)]
pub(in crate::model) struct Friction<R> {
    coulomb: R,
    stiction: R,
    stribeck: R,
}

impl<R: Real> Friction<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            coulomb: next(),
            stiction: next(),
            stribeck: next(),
        }
    }
}

impl<R: Real> Act<R> for Friction<R> {
    #[inline(always)]
    fn drive(&self, drive: R, motion: &Motion<R>) -> R {
        let breakaway = motion.gain * (self.coulomb + self.stiction);
        let ratio = motion.speed / self.stribeck;
        let sliding =
            motion.gain * (self.coulomb + self.stiction / (R::constant(1.0) + ratio * ratio));
        let resting = drive.clamp(-breakaway, breakaway);
        let forward = motion.speed.if_positive(sliding, resting);
        drive - (-motion.speed).if_positive(-sliding, forward)
    }

    #[inline(always)]
    fn settle(&self, lead: R, spool: R, drive: R, motion: &Motion<R>) -> (R, R) {
        // A spool that turns back within the step while the drive cannot break it away has come to rest.
        let breakaway = motion.gain * (self.coulomb + self.stiction);
        let turned = motion.speed * (spool - lead);
        let held = breakaway - drive.abs();
        (turned.if_positive(held.if_positive(spool, lead), lead), spool)
    }
}
