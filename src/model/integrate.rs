//! The integrator, over [`Real`] like the physics, so that every evaluator takes the same steps.

use super::Real;
use super::effects::Stage;
use super::{Dynamics, Input};

/// The classical fourth-order Runge-Kutta method, with room for what a step works with: of the `N` states only those that the
/// plant has are computed, and nothing is moved that is longer than they are.
#[derive(Debug)]
pub struct RungeKutta<R, const N: usize> {
    reached: [R; N],
    slope: [R; N],
    sum: [R; N],
}

impl<R: Real, const N: usize> RungeKutta<R, N> {
    /// Before the first step.
    #[inline(always)]
    pub fn new() -> Self {
        let nothing = [R::constant(0.0); N];
        Self {
            reached: nothing,
            slope: nothing,
            sum: nothing,
        }
    }

    /// Advances `state` by `step` seconds. `inputs` are those at the start, the middle and the end of the step, with the
    /// command that acts.
    #[allow(
        clippy::needless_range_loop,
        clippy::manual_memcpy,
        reason = "iterators and copies of slices are not always inlined, and only what is inlined is compiled for wide vectors"
    )]
    #[inline(always)]
    pub fn advance<D: Dynamics<R>>(
        &mut self,
        plant: &D,
        state: &mut [R; N],
        [start, middle, end]: [&Input<R>; 3],
        step: R,
    ) {
        // Nothing moves: what would move it is not compiled.
        if N == 0 {
            return;
        }
        D::outlined(
            #[inline(always)]
            || {
                let states = plant.states::<N>();
                let slip_direction = plant.slip_direction(state, start);
                let mut stage = Stage {
                    slip_direction,
                    ..Stage::first(start.command, start.time)
                };
                plant.derivative(state, start, &stage, &mut self.slope);
                for i in 0..states {
                    self.sum[i] = self.slope[i];
                }
                // Written out, not a loop: what is indexed by numbers known when this is compiled stays in registers.
                let half = (step, 0.5, 2.0);
                self.later(plant, state, half, middle, &mut stage);
                self.later(plant, state, half, middle, &mut stage);
                let whole = (step, 1.0, 1.0);
                self.later(plant, state, whole, end, &mut stage);
                let sixth = step * R::constant(1.0 / 6.0);
                for i in 0..states {
                    self.reached[i] = state[i] + sixth * self.sum[i];
                }
                let inputs = [start, end];
                plant.end_step(state, &mut self.reached, inputs, slip_direction, step);
                for i in 0..states {
                    state[i] = self.reached[i];
                }
            },
        );
    }

    /// The slope at a later stage, a share of the step along that of the one before; it counts in the sum with a weight.
    #[allow(
        clippy::needless_range_loop,
        reason = "an iterator is not always inlined, and only what is inlined is compiled for wide vectors"
    )]
    #[inline(always)]
    fn later<D: Dynamics<R>>(
        &mut self,
        plant: &D,
        state: &[R; N],
        (step, share, weight): (R, f64, f64),
        input: &Input<R>,
        stage: &mut Stage<R>,
    ) {
        let states = plant.states::<N>();
        stage.since = step * R::constant(share);
        for i in 0..states {
            self.reached[i] = state[i] + stage.since * self.slope[i];
        }
        plant.derivative(&self.reached, input, stage, &mut self.slope);
        for i in 0..states {
            self.sum[i] = self.sum[i] + R::constant(weight) * self.slope[i];
        }
    }
}

impl<R: Real, const N: usize> Default for RungeKutta<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Steps are at most this fraction of the fastest time constant that the bounds allow.
pub const STEP_FRACTION: f64 = 0.7;

/// How many steps an interval of `seconds` is cut into when the fastest rate is `rate` (1/s).
pub fn substeps(seconds: f64, rate: f64) -> u32 {
    (seconds * rate / STEP_FRACTION).ceil().clamp(1.0, 1e6) as u32
}
