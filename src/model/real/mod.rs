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
    /// e^(−self) for `self` ≥ 0, to 1e-4 and falling to zero: what a lag keeps of its past after a step of so many time
    /// constants.
    #[inline(always)]
    fn decay(self) -> Self {
        let part = self * Self::constant(0.25);
        let mut sum = Self::constant(1.0);
        for n in [6.0, 5.0, 4.0, 3.0, 2.0, 1.0] {
            sum = Self::constant(1.0) + part * Self::constant(1.0 / n) * sum;
        }
        let root = Self::constant(1.0) / sum;
        let square = root * root;
        square * square
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
