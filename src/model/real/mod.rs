//! The arithmetic that every reading of the physics shares.
//!
//! An equation written over [`Real`] is read as `f64` (the reference), `f32` (the shader's twin), [`Lanes`] (many
//! candidates at once), [`Dual`] (exact sensitivities) and [`Wgsl`] (the shader's physics as text). There are no
//! branches on values: a choice is a `min`, a `max` or a clamp, so that lanes and invocations stay in lockstep.

mod dual;
mod lanes;
mod wgsl;

pub use dual::Dual;
pub use lanes::{Element, Lanes};
pub use wgsl::{Function, Trace, Wgsl};

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that physics can be written in.
pub trait Real:
    Copy
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
    /// A name for people who read the traced shader; the value is unchanged.
    #[inline(always)]
    fn named(self, _name: &str) -> Self {
        self
    }
    /// The value nearest to `self` between `low` and `high`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
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
        }
    };
}
primitive!(f64);
primitive!(f32);
