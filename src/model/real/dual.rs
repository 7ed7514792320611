//! Dual numbers: a value and its exact derivatives with respect to `D` parameters.

use super::{Real, Valued};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value with its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const D: usize> {
    /// The value itself.
    pub value: f64,
    /// Its derivatives, one a parameter.
    pub gradient: [f64; D],
}

impl<const D: usize> Dual<D> {
    /// Parameter number `index`: its derivative with respect to itself is 1.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; D];
        gradient[index] = 1.0;
        Self { value, gradient }
    }

    /// The value `value` whose gradient is `a` times this one's gradient plus `b` times the other's.
    #[inline(always)]
    fn chain(mut self, value: f64, a: f64, other: Self, b: f64) -> Self {
        for (own, other) in self.gradient.iter_mut().zip(other.gradient) {
            *own = a * *own + b * other;
        }
        self.value = value;
        self
    }

    /// The angle of the point (`x`, `self`), in radians.
    pub fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        self.chain(
            self.value.atan2(x.value),
            x.value / square,
            x,
            -self.value / square,
        )
    }
}

impl<const D: usize> Add for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.chain(self.value + other.value, 1.0, other, 1.0)
    }
}

impl<const D: usize> Sub for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.chain(self.value - other.value, 1.0, other, -1.0)
    }
}

impl<const D: usize> Mul for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.chain(self.value * other.value, other.value, other, self.value)
    }
}

impl<const D: usize> Div for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.chain(quotient, 1.0 / other.value, other, -quotient / other.value)
    }
}

impl<const D: usize> Neg for Dual<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            gradient: self.gradient.map(|g| -g),
        }
    }
}

impl<const D: usize> Real for Dual<D> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: [0.0; D],
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        // At zero the slope is infinite; zero times that must not spoil sums that do not depend on it.
        let slope = if root > 0.0 { 0.5 / root } else { 0.0 };
        self.chain(root, slope, self, 0.0)
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

impl<const D: usize> Valued for Dual<D> {
    #[inline(always)]
    fn look_up(self, mut f: impl FnMut(f64) -> f64) -> Self {
        Self::constant(f(self.value))
    }
}
