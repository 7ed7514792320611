//! Dual numbers: a value and its exact derivatives with respect to some parameters.

use super::{Real, Valued};
use crate::audited::token;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Vectors of derivatives.
const VECTORS: usize = 2;

/// A value with its gradient, computed with the instruction set `S`.
///
/// As [`Lanes`](super::Lanes), such numbers must be used only where a token of `S` exists.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(target_arch = "x86_64", repr(align(32)))]
pub(crate) struct Dual<S: Simd> {
    /// The value itself.
    pub(crate) value: f64,
    slopes: [S::f64s; VECTORS],
}

impl<S: Simd> Dual<S> {
    /// How many parameters it has derivatives with respect to.
    pub(crate) const COUNT: usize = VECTORS * size_of::<S::f64s>() / size_of::<f64>();

    /// Parameter number `index`: its derivative with respect to itself is 1.
    #[inline(always)]
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut variable = Self::constant(value);
        bytemuck::cast_slice_mut(&mut variable.slopes)[index] = 1.0;
        variable
    }

    /// Its derivatives, one a parameter.
    #[inline(always)]
    pub(crate) fn gradient(&self) -> &[f64] {
        bytemuck::cast_slice(&self.slopes)
    }

    /// The value `value` whose gradient is `a` times this one's gradient plus `b` times the other's.
    // A loop over numbers, here and below: only what is inlined is compiled for the instructions, and closures are not always.
    #[inline(always)]
    fn chain(mut self, value: f64, a: f64, other: Self, b: f64) -> Self {
        let simd = token::<S>();
        let (a, b) = (simd.splat_f64s(a), simd.splat_f64s(b));
        for i in 0..VECTORS {
            let own = simd.mul_f64s(a, self.slopes[i]);
            self.slopes[i] = simd.add_f64s(own, simd.mul_f64s(b, other.slopes[i]));
        }
        self.value = value;
        self
    }

    /// The value `value` whose gradient is `a` times this one's.
    #[inline(always)]
    fn scaled(mut self, value: f64, a: f64) -> Self {
        let a = token::<S>().splat_f64s(a);
        for i in 0..VECTORS {
            self.slopes[i] = token::<S>().mul_f64s(a, self.slopes[i]);
        }
        self.value = value;
        self
    }

    /// The angle of the point (`x`, `self`), in radians.
    #[inline(always)]
    pub(crate) fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        self.chain(
            self.value.atan2(x.value),
            x.value / square,
            x,
            -self.value / square,
        )
    }
}

impl<S: Simd> Add for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        for i in 0..VECTORS {
            self.slopes[i] = token::<S>().add_f64s(self.slopes[i], other.slopes[i]);
        }
        self
    }
}

impl<S: Simd> Sub for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self.value -= other.value;
        for i in 0..VECTORS {
            self.slopes[i] = token::<S>().sub_f64s(self.slopes[i], other.slopes[i]);
        }
        self
    }
}

impl<S: Simd> Mul for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.chain(self.value * other.value, other.value, other, self.value)
    }
}

impl<S: Simd> Div for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.chain(quotient, 1.0 / other.value, other, -quotient / other.value)
    }
}

impl<S: Simd> Neg for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        self.value = -self.value;
        for i in 0..VECTORS {
            self.slopes[i] = token::<S>().neg_f64s(self.slopes[i]);
        }
        self
    }
}

impl<S: Simd> Real for Dual<S> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self {
            value,
            slopes: [token::<S>().splat_f64s(0.0); VECTORS],
        }
    }
    #[inline(never)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        // Only what is called through the token is compiled for its instructions.
        token::<S>().vectorize(f)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        // At zero the slope is infinite; zero times that must not spoil sums that do not depend on it.
        let slope = if root > 0.0 { 0.5 / root } else { 0.0 };
        self.scaled(root, slope)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.value < other.value {
            self
        } else {
            other
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value > other.value {
            self
        } else {
            other
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self::constant(self.value.floor())
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        if self.value > 0.0 { yes } else { no }
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.value > 0.0
    }
}

impl<S: Simd> Valued for Dual<S> {
    #[inline(always)]
    fn look_up(self, mut f: impl FnMut(f64) -> f64) -> Self {
        Self::constant(f(self.value))
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.value == 0.0 && self.gradient().iter().all(|slope| *slope == 0.0)
    }
}
