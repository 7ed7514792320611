//! The arithmetic that every reading of the physics shares.
//!
//! An equation written over [`Real`] is read as `f64` (the reference), `f32` (the shader's twin), vectors (many
//! candidates at once; their type is this crate's own, for only it makes sure that the CPU has them), dual numbers (exact
//! sensitivities) and [`Traced`] (text in another language). There are no branches on values: a choice is a `min`, a `max`,
//! a clamp or a selection, so that lanes and invocations stay in lockstep.

mod dual;
mod lanes;
pub(crate) mod reading;
#[doc(hidden)]
pub mod trace;

pub(crate) use dual::Dual;
pub(crate) use lanes::{Element, Lanes};
pub use trace::Traced;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that physics can be written in.
pub trait Real:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The number `value`, the same for every lane, with zero sensitivity.
    fn constant(value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The smaller of the two.
    fn min(self, other: Self) -> Self;
    /// The larger of the two.
    fn max(self, other: Self) -> Self;
    /// The largest whole number that is not larger.
    fn floor(self) -> Self;
    /// `yes` where the number is above zero, otherwise `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;
    /// Whether the number is above zero, or that of any lane; true where that is not known.
    fn any_positive(self) -> bool;
    /// `yes` where the number is above zero, otherwise `no`; `yes` is not computed where no lane takes it.
    #[inline(always)]
    fn if_any_positive<const N: usize>(
        self,
        yes: impl FnOnce() -> [Self; N],
        no: [Self; N],
    ) -> [Self; N] {
        if !self.any_positive() {
            return no;
        }
        let yes = yes();
        let mut result = no;
        for i in 0..N {
            result[i] = self.if_positive(yes[i], no[i]);
        }
        result
    }
    /// A name for people who read the traced text; the value is unchanged.
    #[inline(always)]
    fn named(self, _name: &str) -> Self {
        self
    }
    /// Calls `f`, which is compiled as a function of its own: what many places share must not be copied into each.
    #[inline(never)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        f()
    }
    /// The value nearest to `self` between `low` and `high`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// sqrt(self² + other²).
    // No closures in what is computed for many candidates: they are not always inlined, and then not compiled for vectors.
    #[inline(always)]
    fn hypot(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }
    /// Magnitude.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
    /// The number where `sign` is above zero, otherwise its opposite.
    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        sign.if_positive(self, -self)
    }
    /// sin(2π · self), to 1e-11, by reduction to a quarter turn and the sine's series.
    #[inline(always)]
    fn sine_of_turns(self) -> Self {
        let constant = Self::constant;
        let turn = self - (self + constant(0.5)).floor();
        let quarter = turn.min(constant(0.5) - turn).max(constant(-0.5) - turn);
        let angle = quarter * constant(std::f64::consts::TAU);
        let square = angle * angle;
        let mut sum = constant(1.0);
        for n in [16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
            sum = constant(1.0) - square * constant(1.0 / (n * (n + 1.0))) * sum;
        }
        angle * sum
    }
    /// The hyperbolic tangent where `self` ≥ 0, to 1e-7.
    #[inline(always)]
    fn rising_tanh(self) -> Self {
        let two = Self::constant(2.0);
        // Of a half of it, doubled twice: 1 - e^(-2 self).
        let (quarter, _) = (Self::constant(0.5) * self).caught_up();
        let half = quarter * (two - quarter);
        let whole = half * (two - half);
        whole / (two - whole)
    }
    /// What a lag has made up after a step of `self` ≥ 0 time constants: of a step of its input, a = 1 − e^(−self), and of
    /// a straight rise over the step, 1 − a/self. Both to rounding where `self` is small, which their formulas are not.
    #[inline(always)]
    fn caught_up(self) -> (Self, Self) {
        let constant = Self::constant;
        // For a quarter of the step, p: (e^p − 1 − p)/p², then (e^p − 1)/p. Beyond a million nothing is left to make up.
        let part = self.min(constant(1e6)) * constant(0.25);
        let mut second = constant(1.0);
        for n in [6.0, 5.0, 4.0, 3.0] {
            second = constant(1.0) + part * constant(1.0 / n) * second;
        }
        let second = constant(0.5) * second;
        let first = constant(1.0) + part * second;
        let inverse = constant(1.0) / (constant(1.0) + part * first);
        let mut of_step = part * first * inverse;
        let mut of_rise = part * (first - second) * inverse;
        for _ in 0..2 {
            of_rise = of_rise + (constant(1.0) - of_rise) * (constant(0.5) * of_step);
            of_step = of_step * (constant(2.0) - of_step);
        }
        (of_step, of_rise)
    }
}

/// A number that has a value now, so that it can choose a row of a table. The shader's loops choose rows themselves.
pub trait Valued: Real {
    /// What `f` makes of the value, or of every lane's value, without sensitivities.
    fn look_up(self, f: impl FnMut(f64) -> f64) -> Self;

    /// Whether a number that is not below zero is zero, in every lane and with all its sensitivities.
    #[inline(always)]
    fn is_zero(self) -> bool {
        !self.any_positive()
    }
}

macro_rules! primitive {
    ($float:ident) => {
        impl Real for $float {
            #[inline(always)]
            fn constant(value: f64) -> Self {
                value as $float
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            // A comparison, not `f32::min`: its handling of NaN costs lanes an instruction and no device shares it.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn floor(self) -> Self {
                self.floor()
            }
            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                if self > 0.0 { yes } else { no }
            }
            #[inline(always)]
            fn any_positive(self) -> bool {
                self > 0.0
            }
        }

        impl Valued for $float {
            #[inline(always)]
            fn look_up(self, mut f: impl FnMut(f64) -> f64) -> Self {
                f(self.into()) as $float
            }
        }
    };
}
primitive!(f64);
primitive!(f32);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_lag_has_made_up_keeps_its_digits_after_a_short_step() {
        for x in [
            1e-9_f64, 1e-6, 1e-3, 0.03, 0.5, 1.0, 4.0, 8.0, 30.0, 1e4, 1e9,
        ] {
            let of_step = -(-x).exp_m1();
            let series = x / 2.0 - x * x / 6.0 + x * x * x / 24.0;
            let of_rise = if x < 0.01 { series } else { 1.0 - of_step / x };
            let double = x.caught_up();
            let single = (x as f32).caught_up();
            for (found, expected) in [
                (double.0, of_step),
                (double.1, of_rise),
                (single.0.into(), of_step),
                (single.1.into(), of_rise),
            ] {
                assert!(
                    (found / expected - 1.0).abs() < 1e-5,
                    "{x}: {found} {expected}"
                );
            }
        }
        let (of_step, of_rise) = f64::INFINITY.caught_up();
        assert!(of_step == 1.0 && (of_rise - 1.0).abs() < 2e-6);
    }
}
