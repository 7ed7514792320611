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

/// 1 - sin(angle)/angle, of an angle from zero on and its sine.
#[inline(always)]
fn below_sinc<R: Real>(angle: R, sine: R) -> R {
    let constant = R::constant;
    let square = angle * angle;
    let mut series = constant(1.0);
    for n in [12.0, 10.0, 8.0, 6.0, 4.0] {
        series = constant(1.0) - square * constant(1.0 / (n * (n + 1.0))) * series;
    }
    let small = square * constant(1.0 / 6.0) * series;
    (constant(0.5) - angle).if_positive(small, constant(1.0) - sine / angle)
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
        let constant = R::constant;
        let (one, two) = (constant(1.0), constant(2.0));
        // Late commands cut intervals into pieces, some of which have no length.
        let step = step.max(constant(1e-12));
        let rate = self.frequency * constant(std::f64::consts::TAU);
        let share = (one - self.damping * self.damping).sqrt();
        let radians = rate * step;
        let turns = self.frequency * share * step;
        let half = (turns * constant(0.5)).sine_of_turns();
        let sine = two * half * (turns * constant(0.5) + constant(0.25)).sine_of_turns();
        // 1 - cos, 1 - sin(angle)/angle and, of the decay, 1 - e^-x: no small difference of large numbers below.
        let below_cosine = two * half * half;
        let below_sine = below_sinc(turns * constant(std::f64::consts::TAU), sine);
        let (faded, of_rise) = (self.damping * radians).caught_up();
        let left = one - faded;
        // What an impulse gives, times the rate squared and over the step; what a step gives, and a straight rise.
        let impulse = faded + below_sine * left;
        let of_step = self.damping * radians * (impulse - of_rise) + left * below_cosine;
        let rise = impulse - two * self.damping * of_step / radians;
        let pulse = one - impulse;
        let (lacks, speed) = (before - own[0], own[1]);
        own[0] = own[0] + lacks * of_step + speed * step * pulse + (after - before) * rise;
        own[1] = speed * left * (one - below_cosine - self.damping / share * sine)
            + lacks * rate * radians * pulse
            + (after - before) * of_step / step;
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        self.of(own[0], value)
    }
}
