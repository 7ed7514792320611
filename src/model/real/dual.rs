//! Dual numbers: a value and its exact derivatives with respect to some parameters.

use super::{Real, Valued};
use crate::audited::token;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value with its gradient, computed with the instruction set `S`.
///
/// As [`Lanes`](super::Lanes), such numbers must be used only where a token of `S` exists, and they lie in whole lines of the
/// cache. The value stands in every lane of a vector of its own: it then multiplies gradients as it is, and a number that was just
/// written is read as vectors without waiting for what was written in pieces. Gradients are two vectors, and every operation names
/// both, as those of [`Lanes`](super::Lanes) do.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(target_arch = "x86_64", repr(align(64)))]
pub(crate) struct Dual<S: Simd> {
    value: S::f64s,
    slopes: [S::f64s; 2],
}

impl<S: Simd> Dual<S> {
    /// How many parameters it has derivatives with respect to.
    pub(crate) const COUNT: usize = 2 * size_of::<S::f64s>() / size_of::<f64>();

    /// Parameter number `index`: its derivative with respect to itself is 1.
    #[inline(always)]
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut variable = Self::constant(value);
        bytemuck::cast_slice_mut(&mut variable.slopes)[index] = 1.0;
        variable
    }

    /// The value itself.
    #[inline(always)]
    pub(crate) fn value(&self) -> f64 {
        bytemuck::cast_slice(std::slice::from_ref(&self.value))[0]
    }

    /// Its derivatives, one a parameter.
    #[inline(always)]
    pub(crate) fn gradient(&self) -> &[f64] {
        bytemuck::cast_slice(&self.slopes)
    }

    /// The value `value` whose gradient is `a` times this one's gradient plus `b` times the other's.
    #[inline(always)]
    fn chain(mut self, value: S::f64s, a: S::f64s, other: Self, b: S::f64s) -> Self {
        let simd = token::<S>();
        let ([own, also], [others, others_too]) = (self.slopes, other.slopes);
        self.slopes = [
            simd.mul_add_f64s(a, own, simd.mul_f64s(b, others)),
            simd.mul_add_f64s(a, also, simd.mul_f64s(b, others_too)),
        ];
        self.value = value;
        self
    }

    /// What `f` makes of both numbers' values and of their derivatives.
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(S, S::f64s, S::f64s) -> S::f64s) -> Self {
        let ([own, also], [others, others_too]) = (self.slopes, other.slopes);
        Self {
            value: f(token(), self.value, other.value),
            slopes: [f(token(), own, others), f(token(), also, others_too)],
        }
    }

    /// This number where the mask is set, otherwise the other.
    #[inline(always)]
    fn selected(mut self, mask: S::m64s, other: Self) -> Self {
        let simd = token::<S>();
        let ([own, also], [others, others_too]) = (self.slopes, other.slopes);
        self.value = simd.select_f64s(mask, self.value, other.value);
        self.slopes = [
            simd.select_f64s(mask, own, others),
            simd.select_f64s(mask, also, others_too),
        ];
        self
    }

    /// The angle of the point (`x`, `self`), in radians.
    #[inline(always)]
    pub(crate) fn atan2(self, x: Self) -> Self {
        let (own, other) = (self.value(), x.value());
        let square = own * own + other * other;
        let [angle, a, b] = [own.atan2(other), other / square, -own / square]
            .map(|number| token::<S>().splat_f64s(number));
        self.chain(angle, a, x, b)
    }
}

impl<S: Simd> Add for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, S::add_f64s)
    }
}

impl<S: Simd> Sub for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, S::sub_f64s)
    }
}

impl<S: Simd> Mul for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let product = token::<S>().mul_f64s(self.value, other.value);
        self.chain(product, other.value, other, self.value)
    }
}

impl<S: Simd> Div for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let simd = token::<S>();
        let quotient = simd.div_f64s(self.value, other.value);
        let a = simd.div_f64s(simd.splat_f64s(1.0), other.value);
        let b = simd.div_f64s(simd.neg_f64s(quotient), other.value);
        self.chain(quotient, a, other, b)
    }
}

impl<S: Simd> Neg for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let (simd, [own, also]) = (token::<S>(), self.slopes);
        Self {
            value: simd.neg_f64s(self.value),
            slopes: [simd.neg_f64s(own), simd.neg_f64s(also)],
        }
    }
}

impl<S: Simd> Real for Dual<S> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        let simd = token::<S>();
        Self {
            value: simd.splat_f64s(value),
            slopes: [simd.splat_f64s(0.0); 2],
        }
    }
    #[inline(never)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        // Only what is called through the token is compiled for its instructions.
        token::<S>().vectorize(f)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let simd = token::<S>();
        let zero = simd.splat_f64s(0.0);
        let root = simd.sqrt_f64s(self.value);
        // At zero the slope is infinite; zero times that must not spoil sums that do not depend on it.
        let slope = simd.div_f64s(simd.splat_f64s(0.5), root);
        let slope = simd.select_f64s(simd.greater_than_f64s(root, zero), slope, zero);
        let [own, also] = self.slopes;
        Self {
            value: root,
            slopes: [simd.mul_f64s(slope, own), simd.mul_f64s(slope, also)],
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let less = token::<S>().less_than_f64s(self.value, other.value);
        self.selected(less, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let more = token::<S>().greater_than_f64s(self.value, other.value);
        self.selected(more, other)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self::constant(self.value().floor())
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        let simd = token::<S>();
        let positive = simd.greater_than_f64s(self.value, simd.splat_f64s(0.0));
        yes.selected(positive, no)
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        self.value() > 0.0
    }
}

impl<S: Simd> Valued for Dual<S> {
    #[inline(always)]
    fn look_up(self, mut f: impl FnMut(f64) -> f64) -> Self {
        Self::constant(f(self.value()))
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.value() == 0.0 && self.gradient().iter().all(|slope| *slope == 0.0)
    }
}
