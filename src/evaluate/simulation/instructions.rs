//! Under which of the CPU's instructions numbers are computed.
//!
//! Inlined, so that each loop belongs to the module that asks for it: the compiler makes one unit of a module's generic code,
//! and a unit of all loops kept it busy on one core when everything else was done.

use pulp::{Arch, Scalar, Simd, WithSimd};

/// Runs `task` with the CPU's vector instructions; `None` where there are none: one candidate at a time is then as fast.
#[inline]
pub(in crate::evaluate) fn with_vectors<T: WithSimd>(
    instructions: Arch,
    task: T,
) -> Option<T::Output> {
    match instructions {
        #[cfg(all(target_arch = "x86_64", not(test)))]
        Arch::V4(simd) => Some(simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        )),
        // Tests of the crate's insides compile for one kind of vectors; those in tests/ run what users run.
        #[cfg(all(target_arch = "x86_64", test))]
        Arch::V4(simd) => with_vectors(Arch::V3(*simd), task),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Some(simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        )),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Some(simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        )),
        _ => None,
    }
}

/// Vectors of as many numbers as one candidate has sensitivities.
#[cfg(target_arch = "x86_64")]
pub(in crate::evaluate) type ShortVectors = pulp::x86::V3;
#[cfg(target_arch = "aarch64")]
pub(in crate::evaluate) type ShortVectors = pulp::aarch64::Neon;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(in crate::evaluate) type ShortVectors = Scalar;

/// Those vectors, if the CPU has them.
#[inline]
pub(in crate::evaluate) fn short_vectors() -> Option<ShortVectors> {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    return ShortVectors::try_new();
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    None
}

/// Vectors of twice as many.
#[cfg(all(target_arch = "x86_64", not(test)))]
pub(in crate::evaluate) type LongVectors = pulp::x86::V4;
#[cfg(not(all(target_arch = "x86_64", not(test))))]
pub(in crate::evaluate) type LongVectors = ShortVectors;

/// Those vectors, if the CPU has them.
#[inline]
pub(in crate::evaluate) fn long_vectors() -> Option<LongVectors> {
    #[cfg(all(target_arch = "x86_64", not(test)))]
    return LongVectors::try_new();
    #[cfg(not(all(target_arch = "x86_64", not(test))))]
    None
}

/// Runs `task` with the vectors of `simd`.
#[inline]
pub(in crate::evaluate) fn in_vectors<S: Simd, T: WithSimd>(simd: S, task: T) -> T::Output {
    simd.vectorize(
        #[inline(always)]
        || task.with_simd(simd),
    )
}

/// Runs `task` with such vectors, or without any.
#[inline]
pub(in crate::evaluate) fn with_short_vectors<T: WithSimd>(task: T) -> T::Output {
    match short_vectors() {
        Some(simd) => in_vectors(simd, task),
        None => task.with_simd(Scalar::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Real;
    use crate::model::real::Dual;

    /// The bits of a value and of its derivatives with respect to two parameters.
    struct Bits;

    impl WithSimd for Bits {
        type Output = Vec<u64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> Vec<u64> {
            let (a, b) = (Dual::<S>::variable(0.7, 0), Dual::<S>::variable(-1.3, 1));
            let c = Dual::constant(0.1);
            let sum = (a * b - c) / (b + a.sqrt()) + (-b).max(a) * a.caught_up().1;
            let all = [&[sum.value()], &sum.gradient()[..2]].concat();
            all.into_iter().map(f64::to_bits).collect()
        }
    }

    #[test]
    fn sensitivities_have_the_same_bits_under_all_instructions() {
        assert_eq!(with_short_vectors(Bits), Bits.with_simd(Scalar::new()));
    }
}
