//! From row to row in exact leaps of the spool. The twin of `shaders/leaps.wgsl`.

use super::arrival::Arrival;
use super::problem::Sample;
use crate::model::leap::{MOST_PARTS, Place, Stride};
use crate::model::{Plant, Valued};

/// Moves the spool of `state` by one leap, in which the command begins at `command` and changes by `ramp` a second.
#[inline(always)]
fn leap<R: Valued>(
    plant: &Plant<R>,
    stride: &Stride<R>,
    state: &mut [R],
    command: R,
    ramp: Option<R>,
) {
    let actuator = plant.actuator();
    let from = Place {
        integrator: state[0],
        spool: state[1],
    };
    let (mut place, crossing) = actuator.leap(stride, from, command, ramp);
    if crossing.any_positive() {
        R::outlined(
            #[inline(always)]
            || {
                let mut left = crossing.if_positive(stride.length, R::constant(0.0));
                place = Place {
                    integrator: crossing.if_positive(from.integrator, place.integrator),
                    spool: crossing.if_positive(from.spool, place.spool),
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
            },
        );
    }
    (state[0], state[1]) = (place.integrator, place.spool);
}

/// Moves the spool from one row to the next, in leaps of `stride`. Where the command is interpolated, `change` is its
/// change from row to row.
#[allow(
    clippy::manual_map,
    reason = "a closure is not always inlined, and only what is inlined is compiled for wide vectors"
)]
#[inline(always)]
pub(super) fn travel<R: Valued>(
    plant: &Plant<R>,
    stride: &Stride<R>,
    state: &mut [R],
    command: R,
    change: Option<f64>,
    sample: &Sample,
) {
    let (length, count) = sample.parts(true);
    let ramp = change.map(|change| change / (length * f64::from(count)));
    for j in 0..count {
        let now = match ramp {
            None => command,
            Some(ramp) => command + R::constant(ramp * length * f64::from(j)),
        };
        let ramp = match ramp {
            None => None,
            Some(ramp) => Some(R::constant(ramp)),
        };
        leap(plant, stride, state, now, ramp);
    }
}

/// The same while held commands arrive late; `command` is the one that acts at the row.
#[inline(always)]
pub(super) fn travel_late<R: Valued>(
    plant: &Plant<R>,
    state: &mut [R],
    mut command: R,
    sample: &Sample,
    arrival: Arrival<R>,
) {
    let (length, count) = sample.parts(true);
    let whole = R::constant(length);
    let mut begin = R::constant(0.0);
    let mut late = arrival.held();
    for piece in 0..sample.pieces as usize {
        let end = match piece + 1 == sample.pieces as usize {
            true => whole,
            false => arrival.end(piece, count, whole),
        };
        if piece > 0 {
            late = arrival.held_in(piece, late);
            command = plant.command(state, late);
        }
        let stride = plant.actuator().stride(end - begin);
        for _ in 0..count {
            leap(plant, &stride, state, command, None);
        }
        begin = end;
    }
}
