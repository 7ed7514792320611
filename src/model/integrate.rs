//! The integrator, over [`Real`] like the physics, so that every evaluator takes the same steps.

use super::Real;
use super::effects::Stage;
use super::{Dynamics, Input};

/// Advances `state` by `step` seconds with the classical fourth-order Runge-Kutta method. `inputs` are those at the
/// start, the middle and the end of the step, with the command that acts.
#[inline(always)]
pub fn advance<R: Real, const N: usize, D: Dynamics<R>>(
    plant: &D,
    state: [R; N],
    [start, middle, end]: [&Input<R>; 3],
    step: R,
) -> [R; N] {
    // Nothing moves: what would move it is not compiled.
    if N == 0 {
        return state;
    }
    D::outlined(
        #[inline(always)]
        || {
            let slip_direction = plant.slip_direction(&state, start);
            let mut stage = Stage {
                slip_direction,
                ..Stage::first(start.command, start.time)
            };
            let mut slope = plant.derivative(&state, start, &stage);
            let mut sum = slope;
            // Written out, not a loop: what is indexed by numbers known when this is compiled stays in registers.
            let half = (step, 0.5, 2.0);
            slope = later(plant, &state, &slope, &mut sum, half, middle, &mut stage);
            slope = later(plant, &state, &slope, &mut sum, half, middle, &mut stage);
            let whole = (step, 1.0, 1.0);
            later(plant, &state, &slope, &mut sum, whole, end, &mut stage);
            let mut end_state = moved(state, step * R::constant(1.0 / 6.0), &sum);
            plant.end_step(&state, &mut end_state, [start, end], slip_direction, step);
            end_state
        },
    )
}

/// The slope at a later stage, a share of the step along the `slope` of the one before, which counts in the `sum` with a weight.
#[inline(always)]
fn later<R: Real, const N: usize, D: Dynamics<R>>(
    plant: &D,
    state: &[R; N],
    slope: &[R; N],
    sum: &mut [R; N],
    (step, share, weight): (R, f64, f64),
    input: &Input<R>,
    stage: &mut Stage<R>,
) -> [R; N] {
    stage.since = step * R::constant(share);
    let slope = plant.derivative(&moved(*state, stage.since, slope), input, stage);
    for i in 0..N {
        sum[i] = sum[i] + R::constant(weight) * slope[i];
    }
    slope
}

#[inline(always)]
fn moved<R: Real, const N: usize>(mut state: [R; N], by: R, slope: &[R; N]) -> [R; N] {
    for i in 0..N {
        state[i] = state[i] + by * slope[i];
    }
    state
}

/// Steps are at most this fraction of the fastest time constant that the bounds allow.
pub const STEP_FRACTION: f64 = 0.7;

/// How many steps an interval of `seconds` is cut into when the fastest rate is `rate` (1/s).
pub fn substeps(seconds: f64, rate: f64) -> u32 {
    (seconds * rate / STEP_FRACTION).ceil().clamp(1.0, 1e6) as u32
}
