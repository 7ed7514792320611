//! Many candidates at once: vectors as wide as the CPU has them, several in flight to hide latency.

use super::{Real, Valued};
use crate::audited::token;
use bytemuck::Pod;
use pulp::Simd;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A float that the CPU has vectors of.
pub(crate) trait Element: Valued + Pod + Into<f64> {
    /// The vector of it under the instruction set `S`.
    type Vector<S: Simd>: Pod;
    /// The same value in every lane.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;
    /// Sum.
    fn add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// Difference.
    fn sub<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// Product.
    fn mul<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// Quotient.
    fn div<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// The smaller of the two.
    fn min<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// The larger of the two.
    fn max<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;
    /// Opposite.
    fn neg<S: Simd>(simd: S, a: Self::Vector<S>) -> Self::Vector<S>;
    /// Magnitude.
    fn abs<S: Simd>(simd: S, a: Self::Vector<S>) -> Self::Vector<S>;
    /// Square root.
    fn sqrt<S: Simd>(simd: S, a: Self::Vector<S>) -> Self::Vector<S>;
    /// `yes` where `a` is above zero, otherwise `no`.
    fn select<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        yes: Self::Vector<S>,
        no: Self::Vector<S>,
    ) -> Self::Vector<S>;
    /// `a` where `sign` is above zero, otherwise its opposite.
    fn with_sign_of<S: Simd>(simd: S, a: Self::Vector<S>, sign: Self::Vector<S>)
    -> Self::Vector<S>;
    /// Whether `a` is above zero in any lane.
    fn any_positive<S: Simd>(simd: S, a: Self::Vector<S>) -> bool;
}

macro_rules! element {
    ($float:ident, $vector:ident, $splat:ident, $greater:ident, $select:ident, $xor:ident, $and:ident, $bits:ident, $($method:ident $own:ident ($($argument:ident),+)),+) => {
        impl Element for $float {
            type Vector<S: Simd> = S::$vector;
            #[inline(always)]
            fn splat<S: Simd>(simd: S, value: Self) -> S::$vector {
                simd.$splat(value)
            }
            $(#[inline(always)]
            fn $method<S: Simd>(simd: S, $($argument: S::$vector),+) -> S::$vector {
                simd.$own($($argument),+)
            })+
            #[inline(always)]
            fn select<S: Simd>(
                simd: S,
                a: S::$vector,
                yes: S::$vector,
                no: S::$vector,
            ) -> S::$vector {
                simd.$select(simd.$greater(a, simd.$splat(0.0)), yes, no)
            }
            #[inline(always)]
            fn abs<S: Simd>(simd: S, a: S::$vector) -> S::$vector {
                simd.$and(a, simd.$splat($float::from_bits($bits::MAX >> 1)))
            }
            #[inline(always)]
            fn with_sign_of<S: Simd>(simd: S, a: S::$vector, sign: S::$vector) -> S::$vector {
                // Not a choice between `a` and its opposite, which would have to be at hand.
                let (same, opposite) = (simd.$splat(0.0), simd.$splat(-0.0));
                simd.$xor(a, simd.$select(simd.$greater(sign, same), same, opposite))
            }
            #[inline(always)]
            fn any_positive<S: Simd>(simd: S, a: S::$vector) -> bool {
                let mask = simd.$greater(a, simd.$splat(0.0));
                let bytes = bytemuck::bytes_of(&mask);
                bytes != &[0u8; 64][..bytes.len()]
            }
        }
    };
}
element!(
    f32, f32s, splat_f32s, greater_than_f32s, select_f32s, xor_f32s, and_f32s, u32, add add_f32s(a, b), sub sub_f32s(a, b), mul mul_f32s(a, b), div div_f32s(a, b),
    min min_f32s(a, b), max max_f32s(a, b), neg neg_f32s(a), sqrt sqrt_f32s(a)
);
element!(
    f64, f64s, splat_f64s, greater_than_f64s, select_f64s, xor_f64s, and_f64s, u64, add add_f64s(a, b), sub sub_f64s(a, b), mul mul_f64s(a, b), div div_f64s(a, b),
    min min_f64s(a, b), max max_f64s(a, b), neg neg_f64s(a), sqrt sqrt_f64s(a)
);

/// Two vectors of `E` under the instruction set `S`, one candidate a lane: enough to hide the latency of one operation behind
/// the other's.
///
/// Every operation names both. A loop over them would cost the same when it runs, but the physics of a model is one function
/// of thousands of operations, and as many loops made a fifth of the crate's compile time.
///
/// Numbers are made without the instruction set's token at hand, so they must be used only where a token of `S`
/// exists: inside `pulp`'s dispatch, as the CPU evaluator does.
///
/// They lie where a line of the cache begins: a vector that crosses into the next is read and written twice as slowly.
#[derive(Clone, Copy)]
#[cfg_attr(target_arch = "x86_64", repr(align(64)))]
pub(crate) struct Lanes<E: Element, S: Simd>([E::Vector<S>; 2]);

impl<E: Element, S: Simd> Lanes<E, S> {
    /// How many lanes there are.
    pub(crate) const WIDTH: usize = 2 * size_of::<E::Vector<S>>() / size_of::<E>();

    /// The number whose lane `i` is `value(i)`.
    pub(crate) fn from_fn(value: impl FnMut(usize) -> E) -> Self {
        let lanes: Vec<E> = (0..Self::WIDTH).map(value).collect();
        let (first, second) = lanes.split_at(Self::WIDTH / 2);
        Self([first, second].map(|half| bytemuck::pod_read_unaligned(bytemuck::cast_slice(half))))
    }

    /// All lanes' values.
    pub(crate) fn lanes(&self) -> &[E] {
        bytemuck::cast_slice(&self.0)
    }

    #[inline(always)]
    fn map(self, f: impl Fn(S, E::Vector<S>) -> E::Vector<S>) -> Self {
        let Self([a, b]) = self;
        Self([f(token(), a), f(token(), b)])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(S, E::Vector<S>, E::Vector<S>) -> E::Vector<S>) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([f(token(), a, c), f(token(), b, d)])
    }
}

macro_rules! lanewise {
    ($($operator:ident $method:ident),*) => {$(
        impl<E: Element, S: Simd> $operator for Lanes<E, S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, <E as Element>::$method)
            }
        }
    )*};
}
lanewise!(Add add, Sub sub, Mul mul, Div div);

impl<E: Element, S: Simd> Neg for Lanes<E, S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(<E as Element>::neg)
    }
}

impl<E: Element, S: Simd> Real for Lanes<E, S> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([E::splat(token::<S>(), E::constant(value)); 2])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(<E as Element>::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(<E as Element>::abs)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, <E as Element>::min)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, <E as Element>::max)
    }
    #[inline(never)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        // Only what is called through the token is compiled for its instructions.
        token::<S>().vectorize(f)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let mut result = self;
        for lane in bytemuck::cast_slice_mut::<_, E>(&mut result.0) {
            *lane = Real::floor(*lane);
        }
        result
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        let (Self([a, b]), Self([c, d]), Self([e, f])) = (self, yes, no);
        Self([
            E::select(token::<S>(), a, c, e),
            E::select(token::<S>(), b, d, f),
        ])
    }
    #[inline(always)]
    fn with_sign_of(self, sign: Self) -> Self {
        self.zip(sign, <E as Element>::with_sign_of)
    }
    #[inline(always)]
    fn any_positive(self) -> bool {
        let Self([a, b]) = self;
        let any = <E as Element>::any_positive::<S>;
        any(token(), a) | any(token(), b)
    }
}

impl<E: Element, S: Simd> Valued for Lanes<E, S> {
    #[inline(always)]
    fn look_up(self, mut f: impl FnMut(f64) -> f64) -> Self {
        let mut result = self;
        for lane in bytemuck::cast_slice_mut::<_, E>(&mut result.0) {
            *lane = E::constant(f((*lane).into()));
        }
        result
    }
}
