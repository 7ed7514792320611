//! All unsafe code there is: elsewhere the compiler refuses it. Each piece says why it is sound.

#![allow(unsafe_code, reason = "the one place for it")]

use pulp::Simd;

/// The token of an instruction set.
///
/// To be called only under `pulp`'s dispatch to `S`. Nobody outside this crate can: [`Lanes`](crate::model::real::Lanes) and
/// [`Dual`](crate::model::real::Dual), the only types that call it, cannot be named there, and what makes such numbers, the
/// CPU's evaluator and the reference's sensitivities, does so inside the dispatch.
#[inline(always)]
pub(crate) fn token<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0) };
    // SAFETY: a token has no bytes, so nothing is read. What it stands for, that the CPU has these instructions, was
    // checked when pulp's dispatch chose `S`, which is the only place that names one.
    unsafe { std::mem::zeroed() }
}

/// A shader without the driver's checks of loops and indices.
///
/// To be called only with text that this crate has composed: a caller's own goes through the driver's checks.
pub(crate) fn unchecked_shader(
    device: &wgpu::Device,
    descriptor: wgpu::ShaderModuleDescriptor<'_>,
    checks: wgpu::ShaderRuntimeChecks,
) -> wgpu::ShaderModule {
    // SAFETY: the composed shader's loops end and its indices stay inside their buffers, whatever the candidates' values:
    // they follow from counts that the evaluator writes itself.
    unsafe { device.create_shader_module_trusted(descriptor, checks) }
}

/// Sets an environment variable for what is loaded later, where it is certain that no other thread reads the environment:
/// before the program has started any. Otherwise nothing happens.
pub fn set_variable(name: &str, value: &str) {
    let threads = std::fs::read_dir("/proc/self/task").map(Iterator::count);
    if threads.is_ok_and(|count| count == 1) {
        // SAFETY: this thread is the only one, as the kernel has just said, and only it could start another.
        unsafe { std::env::set_var(name, value) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variable_is_not_set_beside_other_threads() {
        std::thread::scope(|scope| {
            // Tests run on threads of their own; this is one more that is certainly there.
            let (told, waits) = std::sync::mpsc::channel::<()>();
            scope.spawn(move || waits.recv());
            set_variable("SERVOBEE_NEVER_SET", "1");
            assert!(std::env::var_os("SERVOBEE_NEVER_SET").is_none());
            drop(told);
        });
    }

    #[test]
    fn a_token_of_no_instructions_is_that_of_scalars() {
        let token: pulp::Scalar = token();
        assert_eq!(token.add_f64s(1.0, 2.0), 3.0);
    }
}
