//! The spool's speed is limited.

use super::entry;
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "slew_limit",
    port: Port::Actuator,
    summary: "The spool cannot move faster than its pilot stage lets it",
    equation: "T dv/dt = K sat(u - x, S) - v, dx/dt = v, |v| <= slew_limit",
    shows: "triangles instead of sines where amplitude times 2 pi frequency reaches the limit",
    confused: "saturation of the error, which also limits the speed but through the lag, and acts on the integrator",
    source: "pilot flow saturation; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![Parameter::log(
            "slew_limit",
            &format!("{}/s", scale.command_unit),
            0.1 * scale.command,
            1e4 * scale.command,
            1e4 * scale.command,
        )]
    },
    trials: |scale, _| {
        [3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 200.0]
            .map(|rate| vec![rate * scale.command])
            .to_vec()
    },
    states: &[],
    neutral: &[],
    applies: entry::moves_a_spool,
    outputs: None,
};

/// The spool cannot move faster than its pilot stage lets it.
#[derive(Debug, Clone)]
pub(in crate::model) struct SlewLimit<R> {
    limit: R,
}

impl<R: Real> SlewLimit<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for SlewLimit<R> {
    #[inline(always)]
    fn speed(&self, speed: R) -> R {
        speed.clamp(-self.limit, self.limit)
    }

    #[inline(always)]
    fn settle(&self, lead: R, spool: R, _drive: R, start: &Motion<R>, _step: R) -> (R, R) {
        // The speed is a state: the lead z = x + T v has no more of it than the spool, so that nothing winds up.
        let most = self.limit * start.time_constant;
        (lead.clamp(spool - most, spool + most), spool)
    }
}
