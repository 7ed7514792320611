//! The spool meets its end stops.

use super::entry;
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "stroke_limit",
    port: Port::Actuator,
    summary: "The spool stops at the end of its stroke",
    equation: "|x| <= stroke_limit, dx/dt = 0 at the stop",
    shows: "flat tops at large openings only",
    confused: "saturation, which limits the error and so the speed; a valve whose area is used up, which shows in the flow alone",
    source: "mechanical end stops",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "stroke_limit",
            &scale.command_unit,
            0.02 * scale.command,
            10.0 * scale.command,
            10.0 * scale.command,
        )]
    },
    trials: |scale, _| {
        [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.35, 0.2]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    states: &[],
    neutral: &[],
    applies: entry::moves_a_spool,
    outputs: None,
};

/// The spool stops at the end of its stroke.
#[derive(Debug, Clone)]
pub(in crate::model) struct StrokeLimit<R> {
    limit: R,
}

impl<R: Real> StrokeLimit<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { limit: next() }
    }
}

impl<R: Real> Act<R> for StrokeLimit<R> {
    #[inline(always)]
    fn settle(&self, lead: R, spool: R, _drive: R, _motion: &Motion<R>) -> (R, R) {
        // At a stop nothing leads the spool out of its stroke: its velocity (z - x)/T is zero.
        let below = (spool - self.limit).if_positive(lead.min(self.limit), lead);
        let lead = (-self.limit - spool).if_positive(below.max(-self.limit), below);
        (lead, spool.clamp(-self.limit, self.limit))
    }
}
