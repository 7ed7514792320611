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
    imitated_by: &[],
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
    fn place(&self, spool: R) -> R {
        spool.clamp(-self.limit, self.limit)
    }

    #[inline(always)]
    fn settle(&self, lead: R, spool: R, drive: R, start: &Motion<R>, step: R) -> (R, R) {
        // It stops where it meets the end, and leaves it in the rest of the step where the drive pulls it back.
        let zero = R::constant(0.0);
        let at = |end: R, over: R, inward: R| {
            let left = step * (over / (spool - start.spool)).clamp(zero, R::constant(1.0));
            let ahead = inward * left;
            let spool = end + R::constant(0.5) * ahead * left / start.time_constant;
            (spool + ahead, spool)
        };
        let (above, below) = (spool - self.limit, -self.limit - spool);
        let top = at(self.limit, above, drive.min(zero));
        let bottom = at(-self.limit, -below, drive.max(zero));
        let choose = |top, bottom, free| above.if_positive(top, below.if_positive(bottom, free));
        (choose(top.0, bottom.0, lead), choose(top.1, bottom.1, spool))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stops_where_it_meets_the_end() {
        let mut values = [1.5].into_iter();
        let effect: StrokeLimit<f64> = StrokeLimit::new(|| values.next().unwrap());
        let start = Motion {
            gain: 200.0,
            time_constant: 0.003,
            spool: 1.0,
            speed: 0.0,
            heading: 0.0,
            load: 2.0,
        };
        // Pushed on it stays; pulled back by 100 V/s for half the step it leaves.
        assert_eq!(effect.settle(4.0, 2.0, 50.0, &start, 1e-3), (1.5, 1.5));
        let (lead, spool) = effect.settle(4.0, 2.0, -100.0, &start, 1e-3);
        let expected = 1.5 - 0.5 * 0.05 * 5e-4 / 0.003;
        assert!((spool - expected).abs() < 1e-12 && (lead - spool + 0.05).abs() < 1e-12);
        assert_eq!(effect.settle(1.2, 1.4, 50.0, &start, 1e-3), (1.2, 1.4));
    }
}
