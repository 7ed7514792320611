//! From row to row in exact steps of the spool. The twin of `shaders/exact_steps.wgsl`.

use crate::evaluate::simulation::transport_delay::TransportDelay;
use crate::model::actuator::Actuator;
use crate::model::base::Shown;
use crate::model::exact_step::{CARRIED, MOST_PARTS, Place, Stride};
use crate::model::{Dynamics, Input, Real, Valued};

/// Moves the spool of `state` by one exact step, in which the command begins at `command` and changes by `ramp` a second.
#[inline(always)]
fn exact_step<R: Valued>(
    actuator: &Actuator<R>,
    stride: &Stride<R>,
    state: &mut [R],
    command: R,
    ramp: Option<R>,
) {
    let from = Place::of(state);
    let (mut place, crossing) = actuator.exact_step(stride, from, command, ramp);
    if crossing.any_positive() {
        // Moved into the closure: what moves with every row stays in registers where no edge is met.
        place = R::outlined(
            #[inline(always)]
            move || in_parts(actuator, stride, [from, place], crossing, command, ramp),
        );
    }
    (state[0], state[1]) = (place.integrator, place.spool);
}

/// Where `from` is after an exact step that would have led to `to`, made in parts where `crossing` is above zero.
#[inline(always)]
fn in_parts<R: Valued>(
    actuator: &Actuator<R>,
    stride: &Stride<R>,
    [from, to]: [Place<R>; 2],
    crossing: R,
    command: R,
    ramp: Option<R>,
) -> Place<R> {
    let mut left = crossing.if_positive(stride.length, R::constant(0.0));
    let mut place = Place {
        integrator: crossing.if_positive(from.integrator, to.integrator),
        spool: crossing.if_positive(from.spool, to.spool),
    };
    for _ in 0..MOST_PARTS {
        let now = match ramp {
            None => command,
            Some(ramp) => command + ramp * (stride.length - left),
        };
        (place, left) = actuator.turn(stride, place, now, ramp, left);
        if !left.any_positive() {
            break;
        }
    }
    place
}

/// What follows exact steps of the spool, and how far it has come: filters of outputs, and a state that the spool carries along.
pub(super) struct Course<R> {
    shown: Option<Shown<R>>,
    speed: Option<R>,
}

impl<R: Real> Course<R> {
    /// Where a step begins at `state`; `None` where nothing follows it.
    #[inline(always)]
    pub(super) fn at<const N: usize, D: Dynamics<R>>(
        plant: &D,
        state: &[R; N],
        input: &Input<R>,
    ) -> Option<Self> {
        let shown = plant.unfiltered(state, input);
        let speed = plant.carried(state, input);
        match (&shown, &speed) {
            (None, None) => None,
            _ => Some(Self { shown, speed }),
        }
    }

    /// Follows a step of `length` seconds from `before` to `state`. The inputs are those at its middle and its end.
    #[inline(always)]
    pub(super) fn follow<const N: usize, D: Dynamics<R>>(
        &mut self,
        plant: &D,
        actuator: &Actuator<R>,
        before: Place<R>,
        state: &mut [R; N],
        [half, end]: [&Input<R>; 2],
        length: R,
    ) {
        if let Some(began) = self.speed {
            let after = Place::of(state);
            let between = actuator.middle([before, after], length);
            // Not a copy: a state is long.
            (state[0], state[1]) = (between.integrator, between.spool);
            let passes = plant.carried(state, half);
            (state[0], state[1]) = (after.integrator, after.spool);
            if let Some(passes) = passes
                && let Some(ends) = plant.carried(state, end)
            {
                let simpson = (began + R::constant(4.0) * passes) + ends;
                state[CARRIED] = state[CARRIED] + length * R::constant(1.0 / 6.0) * simpson;
                self.speed = Some(ends);
            }
        }
        if let Some(earlier) = &self.shown
            && let Some(later) = plant.unfiltered(state, end)
        {
            plant.filter(state, [earlier, &later], length);
            self.shown = Some(later);
        }
    }
}

/// Moves the spool from one row to the next, in `count` exact steps of `stride`, each of `length` seconds. `input` is what acts
/// at the row; where it is interpolated, it goes `straight` from one to the other.
#[allow(
    clippy::manual_map,
    reason = "a closure is not always inlined, and only what is inlined is compiled for wide vectors"
)]
#[inline(always)]
pub(in crate::evaluate) fn travel<R: Valued, const N: usize, D: Dynamics<R>>(
    plant: &D,
    actuator: &Actuator<R>,
    stride: &Stride<R>,
    state: &mut [R; N],
    input: &Input<R>,
    (length, count): (f64, u32),
    straight: Option<[&Input<f64>; 2]>,
) {
    D::outlined(
        #[inline(always)]
        || {
            let ramp = match straight {
                None => None,
                Some([from, to]) => {
                    let change = to.command - from.command;
                    Some(change / (length * f64::from(count)))
                }
            };
            let mut course = Course::at(plant, state, input);
            for j in 0..count {
                let now = match ramp {
                    None => input.command,
                    Some(ramp) => input.command + R::constant(ramp * length * f64::from(j)),
                };
                let ramp = match ramp {
                    None => None,
                    Some(ramp) => Some(R::constant(ramp)),
                };
                let before = Place::of(state);
                exact_step(actuator, stride, state, now, ramp);
                let Some(course) = &mut course else {
                    continue;
                };
                let along;
                let inputs = match straight {
                    None => [input; 2],
                    Some([from, to]) => {
                        let half = 0.5 / f64::from(count);
                        let middle = R::constant(f64::from(2 * j + 1) * half);
                        let end = R::constant(f64::from(j + 1) / f64::from(count));
                        along = [
                            Input::between(from, to, middle),
                            Input::between(from, to, end),
                        ];
                        [&along[0], &along[1]]
                    }
                };
                course.follow(plant, actuator, before, state, inputs, stride.length);
            }
        },
    );
}

/// The same while held commands arrive late; the command of `input` is the one that acts at the row.
#[inline(always)]
pub(in crate::evaluate) fn travel_late<R: Valued, const N: usize, D: Dynamics<R>>(
    plant: &D,
    actuator: &Actuator<R>,
    state: &mut [R; N],
    input: Input<R>,
    parts: (f64, u32),
    pieces: u32,
    delayed: TransportDelay<R>,
) {
    R::outlined(
        #[inline(always)]
        || travel_late_inline(plant, actuator, state, input, parts, pieces, delayed),
    );
}

#[inline(always)]
fn travel_late_inline<R: Valued, const N: usize, D: Dynamics<R>>(
    plant: &D,
    actuator: &Actuator<R>,
    state: &mut [R; N],
    mut input: Input<R>,
    (length, count): (f64, u32),
    pieces: u32,
    delayed: TransportDelay<R>,
) {
    let whole = R::constant(length);
    let mut begin = R::constant(0.0);
    let mut late = delayed.held();
    let mut course = Course::at(plant, state, &input);
    for piece in 0..pieces as usize {
        let end = match piece + 1 == pieces as usize {
            true => whole,
            false => delayed.end(piece, count, whole),
        };
        if piece > 0 {
            late = delayed.held_in(piece, late);
            input.command = plant.command(state, late);
        }
        let stride = actuator.stride(end - begin);
        for _ in 0..count {
            let before = Place::of(state);
            exact_step(actuator, &stride, state, input.command, None);
            if let Some(course) = &mut course {
                course.follow(plant, actuator, before, state, [&input; 2], stride.length);
            }
        }
        begin = end;
    }
}

#[cfg(test)]
mod tests {
    use super::exact_step;
    use crate::model::actuator::Actuator;
    use crate::model::exact_step::STEPS_OF_AN_EXACT_STEP;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Steps of RK4 that an exact step is compared with.
    const STEPS: u32 = 2000;

    #[test]
    fn an_exact_step_goes_where_many_small_steps_go() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut errors = Vec::new();
        for number in 0..4000 {
            let mut log = |low: f64, high: f64| low * (high / low).powf(rng.random_range(0.0..1.0));
            let (damping, lag) = (log(0.05, 3.0), log(1e-4, 1e-1));
            let gain = 0.25 / (damping * damping * lag);
            let fastest = lag.min((lag / gain).sqrt());
            let length = log(0.05, 1.0) * 0.7 * f64::from(STEPS_OF_AN_EXACT_STEP) * fastest;
            let actuator = Actuator::new(gain, lag, 1.0);
            // Around the edges of the saturation, on both sides of them.
            let mut any = |largest: f64| rng.random_range(-largest..largest);
            let (command, spool, ahead) = (any(3.0), any(1.0), any(2.0) * gain * lag);
            let ramp = (number % 2 == 0).then(|| any(1.5) * gain);
            let mut stepped_exactly = [spool + ahead, spool];
            let stride = actuator.stride(length);
            exact_step(&actuator, &stride, &mut stepped_exactly, command, ramp);

            let speed = |[z, x]: [f64; 2], time: f64| {
                let command = command + ramp.unwrap_or(0.0) * time;
                let (z, x) = actuator.derivative(z, x, command);
                [z, x]
            };
            let step = length / f64::from(STEPS);
            let along = |[z, x]: [f64; 2], [dz, dx]: [f64; 2], by: f64| [z + by * dz, x + by * dx];
            let mut stepped = [spool + ahead, spool];
            for i in 0..STEPS {
                let time = f64::from(i) * step;
                let a = speed(stepped, time);
                let b = speed(along(stepped, a, step / 2.0), time + step / 2.0);
                let c = speed(along(stepped, b, step / 2.0), time + step / 2.0);
                let d = speed(along(stepped, c, step), time + step);
                let mean = [0, 1].map(|k| (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]) / 6.0);
                stepped = along(stepped, mean, step);
            }
            let size = 1.0 + ahead.abs();
            errors.push(
                (stepped_exactly[1] - stepped[1])
                    .abs()
                    .max((stepped_exactly[0] - stepped[0]).abs())
                    / size,
            );
        }
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[(share * errors.len() as f64) as usize];
        let found = [at(0.5), at(0.9), at(0.99), at(0.9999)];
        println!("half, 90 %, 99 % and all of the errors are below {found:?}");
        // What is left is where an edge is touched, and the parts' series.
        for (found, most) in found.iter().zip([1e-11, 4e-7, 2e-5, 3e-4]) {
            assert!(*found < most, "{found:.1e} is not below {most}");
        }
    }
}
