//! What stands in the loop between its lag and the spool: dx/dt = v, where v is what it makes of w, T dw/dt + w = K sat(u - x, S).

use super::{Act, Motion};
use crate::model::Real;
use std::marker::PhantomData;

/// The drive of a lag that follows it and not the spool, of which a curve makes this `speed`: z = x + T v leads by what that
/// takes from v.
#[inline(always)]
pub(super) fn lag_alone<R: Real>(drive: R, motion: &Motion<R>, speed: R) -> R {
    drive - (motion.speed - speed)
}

/// What makes v of w; its states are rates, zero at rest.
pub(in crate::model) trait InLoop<R> {
    /// With values for its parameters.
    fn new(next: impl FnMut() -> R) -> Self;

    /// v.
    fn passed(&self, own: &[R], driven: R) -> R;

    /// Sets the rates of change of its states where it is driven by w, which has come through this `lag`, s.
    fn follow(&self, own: &[R], driven: R, lag: R, slope: &mut [R]);
}

/// The same as an effect, of which a share is there: none of it, or all.
#[derive(Debug, Clone)]
pub(in crate::model) struct BehindLag<R, F> {
    between: F,
    share: R,
}

impl<R: Real, F: InLoop<R>> BehindLag<R, F> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            between: F::new(&mut next),
            share: next(),
        }
    }
}

impl<R: Real, F: InLoop<R>> Act<R> for BehindLag<R, F> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed + self.share * (self.between.passed(own, speed) - speed)
    }

    /// The lag follows what drives it and not the spool.
    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        let passed = self.between.passed(own, motion.speed);
        drive + self.share * (passed - motion.speed)
    }

    #[inline(always)]
    fn follow(&self, own: &[R], speed: R, motion: &Motion<R>, slope: &mut [R]) {
        self.between.follow(own, speed, motion.time_constant, slope);
    }

    #[allow(
        clippy::needless_range_loop,
        reason = "an iterator is not always inlined, and only what is inlined is compiled for wide vectors"
    )]
    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], _spool: R) {
        for i in 0..own.len() {
            own[i] = R::constant(0.0);
        }
    }
}

/// What the loop's lag T and a further one between it and the spool come to: T v'' T / quickness + T v' + v = K sat(u - x, S). The
/// base model's lag has taken the second one in, and is all of it here as well.
#[derive(Debug, Clone)]
pub(in crate::model) struct SecondPole<R, P> {
    /// Above 4 both only lag, below they swing.
    quickness: R,
    share: R,
    said_by: PhantomData<P>,
}

/// What a parameter says of how quick the second pole is.
pub(in crate::model) trait Quickness {
    /// T over the time of the second pole.
    fn of<R: Real>(value: R) -> R;
}

impl<R: Real, P: Quickness> SecondPole<R, P> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            quickness: P::of(next()),
            share: next(),
            said_by: PhantomData,
        }
    }
}

impl<R: Real, P> Act<R> for SecondPole<R, P> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn speed(&self, own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed + self.share * (own[0] - speed)
    }

    #[inline(always)]
    fn follow(&self, own: &[R], speed: R, motion: &Motion<R>, slope: &mut [R]) {
        slope[0] = self.quickness / motion.time_constant * (speed - own[0]);
    }

    #[inline(always)]
    fn settled_spool(&self, own: &mut [R], _spool: R) {
        own[0] = R::constant(0.0);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::model::effects) const AT: Motion<f64> = Motion {
        gain: 200.0,
        time_constant: 0.004,
        spool: 1.0,
        speed: 100.0,
        slip_direction: 0.0,
        load: 0.0,
        drop: 0.0,
    };

    /// What v has come to after each of `times`, s, where w is 100 from time 0 on, in steps of 1 us.
    pub(in crate::model::effects) fn answer<F: InLoop<f64>, const N: usize>(
        between: &F,
        times: &[f64],
    ) -> Vec<f64> {
        let (mut own, mut t, step) = ([0.0; N], 0.0, 1e-6);
        let mut till = |time: f64| {
            while t < time {
                let mut slope = [0.0; N];
                between.follow(&own, 100.0, AT.time_constant, &mut slope);
                // The rates first, so that what oscillates does not grow.
                for i in (0..N).rev() {
                    own[i] += step * slope[i];
                    between.follow(&own, 100.0, AT.time_constant, &mut slope);
                }
                t += step;
            }
            between.passed(&own, 100.0)
        };
        times.iter().map(|&time| till(time)).collect()
    }

    struct Half;

    impl InLoop<f64> for Half {
        fn new(_next: impl FnMut() -> f64) -> Self {
            Self
        }

        fn passed(&self, own: &[f64], driven: f64) -> f64 {
            0.5 * driven + own[0]
        }

        fn follow(&self, _own: &[f64], driven: f64, _lag: f64, slope: &mut [f64]) {
            slope[0] = driven;
        }
    }

    #[test]
    fn the_lag_is_fed_back_its_own_output_and_no_share_is_nothing() {
        // T dw/dt = drive - v: less by what v is more than w, and so T dw/dt + w = drive.
        for (share, speed, drive) in [(1.0, 80.0, 180.0), (0.0, 100.0, 200.0)] {
            let effect = BehindLag::<f64, Half>::new(|| share);
            assert_eq!(effect.speed(&[30.0], 100.0, &AT), speed);
            assert_eq!(effect.drive(&[30.0], 200.0, &AT), drive);
        }
    }
}
