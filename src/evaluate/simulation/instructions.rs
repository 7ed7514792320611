//! Under which of the CPU's instructions numbers are computed.

use pulp::{Arch, Scalar, WithSimd};

/// Runs `task` with the CPU's vector instructions; `None` where there are none: one candidate at a time is then as fast.
pub(in crate::evaluate) fn with_vectors<T: WithSimd>(
    instructions: Arch,
    task: T,
) -> Option<T::Output> {
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Some(simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        )),
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

/// Runs `task` with vectors of as many numbers as one candidate has sensitivities, or without any.
pub(in crate::evaluate) fn with_short_vectors<T: WithSimd>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        );
    }
    #[cfg(target_arch = "aarch64")]
    if let Some(simd) = pulp::aarch64::Neon::try_new() {
        return simd.vectorize(
            #[inline(always)]
            || task.with_simd(simd),
        );
    }
    task.with_simd(Scalar::new())
}
