//! Exact steps of the actuator, as long as the command is constant or goes straight.
//!
//! Between two rows the loop of [`Actuator`] is linear where `|u − x| ≤ S`, and driven at a
//! constant rate where it is not. Both have closed forms, so that a step may be as long as the rows are apart, however
//! fast the candidate is: [`Actuator::exact_step`]. Only a step in which the saturation begins or ends is made in parts, each
//! of which ends where it does: [`Actuator::turn`]. What follows the spool without acting on it is integrated along such steps by
//! Simpson's rule: [`Actuator::middle`].

use super::Real;
use super::actuator::Actuator;

/// An exact step takes the place of at most so many steps of [`integrate`](super::integrate): it lasts no longer than 4.2 of the
/// fastest time constants that the bounds allow.
pub const STEPS_OF_AN_EXACT_STEP: u32 = 6;
/// One along which a state is carried takes the place of at most so many.
pub const STEPS_OF_A_CARRYING_STEP: u32 = 2;
/// Times that the series of an exact step's matrix is squared: it is summed for an eighth of the exact step.
const SQUARINGS: i32 = 3;
/// Terms of that series.
const TERMS: usize = 8;
/// Order of a part's Taylor series.
const ORDER: usize = 7;
/// A linear step longer than this many radians may turn twice within it.
const RADIANS: f64 = 3.0;
/// A part may last for so many of the candidate's own time constants, where its Taylor series is good to 1e-5.
const PART: f64 = 1.05;
/// How far ahead a part looks, as a share of it, to tell which way it leaves the edge of saturation.
const AHEAD: f64 = 1e-3;
/// No part is shorter than this share of what is left.
const SHORTEST: f64 = 1e-4;

/// More parts than any exact step needs.
pub const MOST_PARTS: u32 = 24;

/// Number of the state that integrator and spool carry along, where there is one.
pub const CARRIED: usize = 2;

/// What all exact steps of one length have in common, for one candidate.
///
/// In the linear regime `(z, x)` moves relative to where a straight command drags it by `e^{Aτ} − 1 = m + c A`, with
/// `A = [[0, −K], [1/T, −1/T]]`; in saturation `z − x` decays by `1 − e^{−τ/T}` towards `±K S T`.
#[derive(Debug, Clone, Copy)]
pub struct Stride<R> {
    /// τ, s.
    pub length: R,
    /// The longest part, s.
    pub part: R,
    /// m.
    kept: R,
    /// c/T.
    followed: R,
    /// c K.
    fed: R,
    /// 1 − e^{−τ/T}.
    faded: R,
    /// K S τ.
    slewed: R,
    /// K S T.
    lead: R,
    /// 1/(K T).
    softness: R,
    /// Above zero where the loop may turn twice in an exact step.
    turns: R,
}

macro_rules! numbers {
    ($($field:ident),+) => {
        impl<R> Stride<R> {
            /// The names of its numbers, in the order of [`Stride::numbers`].
            pub const NAMES: [&'static str; 10] = [$(stringify!($field)),+];

            /// All its numbers.
            pub fn numbers(self) -> [R; 10] {
                [$(self.$field),+]
            }

            /// The stride with these numbers.
            pub fn from_numbers([$($field),+]: [R; 10]) -> Self {
                Self { $($field),+ }
            }
        }
    };
}
numbers!(
    length, part, kept, followed, fed, faded, slewed, lead, softness, turns
);

/// The actuator at one moment: integrator z and spool x.
#[derive(Debug, Clone, Copy)]
pub struct Place<R> {
    /// z, in the unit of the command.
    pub integrator: R,
    /// x, in the unit of the command.
    pub spool: R,
}

impl<R: Copy> Place<R> {
    /// The place of the actuator whose states these are.
    #[inline(always)]
    pub fn of(state: &[R]) -> Self {
        Self {
            integrator: state[0],
            spool: state[1],
        }
    }
}

/// The polynomial's value at `share`; pairs first, so that no addition waits for more than three others.
#[inline(always)]
fn polynomial<R: Real>(c: &[R; ORDER + 1], share: R) -> R {
    let square = share * share;
    let low = (c[0] + c[1] * share) + (c[2] + c[3] * share) * square;
    let high = (c[4] + c[5] * share) + (c[6] + c[7] * share) * square;
    low + high * (square * square)
}

/// The edge of saturation that a part may meet.
struct Edge<R> {
    saturation: R,
    /// Above zero if the part is in saturation.
    beyond: R,
    /// Has the sign of the error at the edge.
    side: R,
}

impl<R: Real> Edge<R> {
    /// How far an error is from the edge: above zero in the regime of the part.
    #[inline(always)]
    fn distance(&self, error: R) -> R {
        let inward = self.saturation - error.with_sign_of(self.side);
        self.beyond.if_positive(-inward, inward)
    }

    /// How fast that distance grows when the error grows at `speed`.
    #[inline(always)]
    fn slope(&self, speed: R) -> R {
        let inward = speed.with_sign_of(self.side);
        self.beyond.if_positive(inward, -inward)
    }
}

impl<R: Real> Actuator<R> {
    /// The stride of exact steps of `length` seconds.
    #[inline(always)]
    pub fn stride(&self, length: R) -> Stride<R> {
        let constant = R::constant;
        let (gain, lag, rate) = (self.gain(), self.time_constant(), self.rate());
        let stiffness = (gain * rate).named("stiffness");
        // By the characteristic equation A² = −(K/T) − A/T, so each power of A is a number and a multiple of A.
        let short = length * constant(0.5f64.powi(SQUARINGS));
        let (mut number, mut multiple) = (constant(1.0), constant(0.0));
        let (mut kept, mut course) = (constant(0.0), constant(0.0));
        let mut term = constant(1.0);
        let mut faded = constant(0.0);
        for n in 1..=TERMS {
            let part = short * constant(1.0 / n as f64);
            (number, multiple) = (
                -(stiffness * multiple) * part,
                (number - rate * multiple) * part,
            );
            term = -(term * rate * part);
            kept = kept + number;
            course = course + multiple;
            faded = faded - term;
        }
        for _ in 0..SQUARINGS {
            let two = constant(2.0);
            (kept, course) = (
                two * kept + (kept * kept - stiffness * course * course),
                course * (two + (two * kept - rate * course)),
            );
            faded = faded * (two - faded);
        }
        let slew = gain * self.saturation();
        let radians = stiffness * length * length;
        let fastest = radians.sqrt().max(length * rate) * constant(1.0 / PART);
        Stride {
            length,
            part: length * (fastest - constant(1.0)).if_positive(constant(0.25), constant(1.0)),
            kept,
            followed: course * rate,
            fed: course * gain,
            faded,
            slewed: slew * length,
            lead: slew * lag,
            softness: constant(1.0) / (gain * lag),
            turns: radians - constant(RADIANS * RADIANS),
        }
    }

    /// Where `from` is after an exact step in which the command began at `command` and changed by `ramp` a second; and a number
    /// that is above zero unless the exact step stayed in one regime, without which it is not exact.
    #[inline(always)]
    pub fn exact_step(
        &self,
        stride: &Stride<R>,
        from: Place<R>,
        command: R,
        ramp: Option<R>,
    ) -> (Place<R>, R) {
        let saturation = self.saturation();
        let ahead = from.integrator - from.spool;
        let error = command - from.spool;
        // Where a straight command drags the spool it is s/K behind and the integrator T s ahead of it.
        let (behind, moved) = match ramp {
            None => (-error, None),
            Some(ramp) => {
                let drag = ramp / self.gain();
                (
                    drag - error,
                    Some((drag, ramp * self.time_constant(), ramp * stride.length)),
                )
            }
        };
        let closing = match moved {
            None => ahead,
            Some((_, lead, _)) => ahead - lead,
        };
        let mut linear_spool = stride.kept * behind + stride.followed * closing;
        let mut linear_integrator = stride.kept * (behind + closing) - stride.fed * behind;
        if let Some((_, _, dragged)) = moved {
            linear_spool = linear_spool + dragged;
            linear_integrator = linear_integrator + dragged;
        }
        let slewed = stride.slewed.with_sign_of(error);
        let caught_up = (stride.lead.with_sign_of(error) - ahead) * stride.faded;

        let beyond = error.abs() - saturation;
        let to = Place {
            integrator: from.integrator + beyond.if_positive(slewed, linear_integrator),
            spool: from.spool + beyond.if_positive(slewed - caught_up, linear_spool),
        };
        let mut error_then = command - to.spool;
        let mut closing_then = to.integrator - to.spool;
        let mut room = saturation;
        if let Some((drag, lead, dragged)) = moved {
            error_then = error_then + dragged;
            closing_then = closing_then - lead;
            room = (saturation - drag.abs()).max(R::constant(0.0));
        }
        // The loop's energy only falls: with too little to reach the edge, the exact step stays within it.
        let energy = behind * behind + closing * closing * stride.softness;
        let outside = error_then.abs() - saturation;
        let turned = stride.turns.max(-(closing * closing_then));
        let left_linear = (energy - room * room).min(outside.max(turned));
        // In saturation the error has no extremum that could touch the edge, unless the command outruns the spool.
        let mut left_saturation = saturation - error_then.with_sign_of(error);
        if ramp.is_some() {
            left_saturation = left_saturation.max(-(closing * closing_then));
        }
        (to, beyond.if_positive(left_saturation, left_linear))
    }

    /// Where the actuator is half-way between two places `length` seconds apart: the spool by the cubic that has its places and
    /// speeds, which is off by h⁴/384 of its fourth derivative; the integrator between its two.
    #[inline(always)]
    pub fn middle(&self, [from, to]: [Place<R>; 2], length: R) -> Place<R> {
        let began = self.speed(from.integrator, from.spool);
        let ends = self.speed(to.integrator, to.spool);
        let half = R::constant(0.5);
        Place {
            integrator: half * (from.integrator + to.integrator),
            spool: half * (from.spool + to.spool) + R::constant(0.125) * length * (began - ends),
        }
    }

    /// Where `from` is after the first part of what is `left` (s) of an exact step, and what is left after it. The part ends
    /// where saturation begins or ends, otherwise after at most `stride.part` seconds.
    #[inline(always)]
    pub fn turn(
        &self,
        stride: &Stride<R>,
        from: Place<R>,
        command: R,
        ramp: Option<R>,
        left: R,
    ) -> (Place<R>, R) {
        let constant = R::constant;
        let (zero, one) = (constant(0.0), constant(1.0));
        let saturation = self.saturation();
        let whole = (left - stride.part * constant(1.0 + 1e-4)).if_positive(stride.part, left);
        // All of it in parts of the whole: Taylor coefficients of integrator, spool and error.
        let followed = whole * self.rate();
        let fed = whole * self.gain();
        let ramped = match ramp {
            None => zero,
            Some(ramp) => ramp * whole,
        };
        let mut spool = [zero; ORDER + 1];
        let mut integrator = [zero; ORDER + 1];
        let mut error = [zero; ORDER + 1];
        (integrator[0], spool[0]) = (from.integrator, from.spool);
        error[0] = command - from.spool;
        spool[1] = (from.integrator - from.spool) * followed;
        error[1] = ramped - spool[1];
        let probe = error[0] + constant(AHEAD) * error[1];
        let beyond = probe.abs() - saturation;
        let fed_back = beyond.if_positive(zero, fed);
        integrator[1] = beyond.if_positive((fed * saturation).with_sign_of(probe), fed * error[0]);
        for n in 1..ORDER {
            let share = constant(1.0 / (n + 1) as f64);
            spool[n + 1] = (integrator[n] - spool[n]) * (followed * share);
            integrator[n + 1] = error[n] * (fed_back * share);
            error[n + 1] = -spool[n + 1];
        }
        let end = Place {
            integrator: polynomial(&integrator, one),
            spool: polynomial(&spool, one),
        };
        let speed_then = ramped - (end.integrator - end.spool) * followed;
        // The edge is met before the error turns, if it is beyond there, or else before the end.
        let turned = -(error[1] * speed_then);
        let peak = turned.if_positive(error[1] / (error[1] - speed_then), one);
        let error_at_peak = command + ramped * peak - polynomial(&spool, peak);
        let error_then = command + ramped - end.spool;
        let missed = beyond.if_positive(
            error_at_peak.with_sign_of(probe) - saturation,
            saturation - error_at_peak.abs(),
        );
        let last = missed.if_positive(one, peak);
        let error_there = missed.if_positive(error_then, error_at_peak);
        // The distance from the edge that is met, above zero in the regime of the part.
        let edge = Edge {
            saturation,
            beyond,
            side: beyond.if_positive(probe, error_there),
        };
        let there = edge.distance(error_there);
        let rest = left - whole;
        let [integrator, spool, left] = (-there).if_any_positive(
            #[inline(always)]
            || {
                // A parabola through where the part begins, its slope there, and where the edge is passed.
                let inside = edge.distance(error[0]).max(zero);
                let fall = -edge.slope(error[1]) * last;
                let bend = there - inside + fall;
                let root = (fall * fall - constant(4.0) * bend * inside)
                    .max(zero)
                    .sqrt();
                let guess = constant(2.0) * inside / (fall + root).max(constant(1e-30));
                let guess = last * guess.clamp(zero, one);
                // One step of Newton's from there.
                let (z, x) = (polynomial(&integrator, guess), polynomial(&spool, guess));
                let now = edge.distance(command + ramped * guess - x);
                let slope = edge.slope(ramped - (z - x) * followed);
                let step = now * slope / (slope * slope + constant(1e-30));
                let share = (guess - step).clamp(zero, last);
                let share = share.max(constant(SHORTEST));
                [
                    polynomial(&integrator, share),
                    polynomial(&spool, share),
                    rest + whole * (one - share),
                ]
            },
            [end.integrator, end.spool, rest],
        );
        (Place { integrator, spool }, left)
    }
}
