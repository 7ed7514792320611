//! A lag of second order: a line that rings, a sensor that does not.

use super::{Act, Moment};
use crate::model::Real;

/// A lag of second order, q'' + 2 D w q' + w² q = w² u with D < 1, whose states are q and q'.
#[derive(Debug, Clone)]
pub(in crate::model) struct SecondOrder<R> {
    /// Hz.
    frequency: R,
    damping: R,
    /// How much of what it filters passes through it.
    share: R,
}

impl<R: Real> SecondOrder<R> {
    /// One with the natural frequency, Hz, the damping D and the share that `next` gives.
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            frequency: next(),
            damping: next(),
            share: next(),
        }
    }

    /// What passes of `value`, whose lag is at `late`.
    #[inline(always)]
    pub(super) fn of(&self, late: R, value: R) -> R {
        value + self.share * (late - value)
    }
}

impl<R: Real> Act<R> for SecondOrder<R> {
    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
        own[1] = R::constant(0.0);
    }

    /// Exact for an input that goes straight.
    #[inline(always)]
    fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
        // Late commands cut intervals into pieces, some of which have no length.
        let step = step.max(R::constant(1e-12));
        let rate = self.frequency * R::constant(std::f64::consts::TAU);
        let share = (R::constant(1.0) - self.damping * self.damping).sqrt();
        let slope = (after - before) / step;
        // How far q stays behind a straight input once it has settled, and what is off that now.
        let behind = self.damping * R::constant(2.0) / rate * slope;
        let off = own[0] - before + behind;
        let speed = own[1] - slope;
        let turns = self.frequency * share * step;
        let sine = turns.sine_of_turns();
        let cosine = (turns + R::constant(0.25)).sine_of_turns();
        let left = (self.damping * rate * step).decay();
        let bend = self.damping / share;
        let swing = off * bend + speed / (rate * share);
        own[0] = after - behind + left * (off * cosine + swing * sine);
        own[1] = slope + left * (speed * cosine - (speed * bend + off * rate / share) * sine);
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        self.of(own[0], value)
    }
}
