//! What an adapter has to allow.

use super::layout::binding;
use crate::evaluate::devices::wgsl;

/// Storage buffers that an entry point of the shader has at most.
const STORAGE_BUFFERS: u32 = binding::OF_SERIES.len() as u32;
/// One more than the highest number of a binding.
const BINDINGS: u32 = binding::WAVE + 1;
/// Largest number of workgroups in one dimension of a dispatch, as WebGPU guarantees it.
pub(super) const MOST_WORKGROUPS: u32 = 65_535;
/// The smallest buffer that is of use, bytes.
pub(super) const LEAST_BUFFER: u64 = 4 << 20;

/// What `limits` lack for an evaluation, in words; nothing where they suffice.
pub(super) fn missing(limits: &wgpu::Limits) -> Vec<String> {
    let needs: [(&str, u64, u64); 10] = [
        (
            "storage buffers per shader stage",
            STORAGE_BUFFERS.into(),
            limits.max_storage_buffers_per_shader_stage.into(),
        ),
        (
            "uniform buffers per shader stage",
            1,
            limits.max_uniform_buffers_per_shader_stage.into(),
        ),
        (
            "dynamic uniform buffers per pipeline",
            1,
            limits
                .max_dynamic_uniform_buffers_per_pipeline_layout
                .into(),
        ),
        ("bind groups", 1, limits.max_bind_groups.into()),
        (
            "bindings per bind group",
            BINDINGS.into(),
            limits.max_bindings_per_bind_group.into(),
        ),
        (
            "invocations per workgroup",
            1,
            limits.max_compute_invocations_per_workgroup.into(),
        ),
        (
            "invocations along a workgroup",
            1,
            limits.max_compute_workgroup_size_x.into(),
        ),
        (
            "workgroups per dispatch",
            MOST_WORKGROUPS.into(),
            limits.max_compute_workgroups_per_dimension.into(),
        ),
        ("bytes in a buffer", LEAST_BUFFER, limits.max_buffer_size),
        (
            "bytes in a storage buffer",
            LEAST_BUFFER,
            limits.max_storage_buffer_binding_size,
        ),
    ];
    let lacking = needs.into_iter().filter(|(_, needed, has)| has < needed);
    lacking
        .map(|(what, needed, has)| format!("{has} {what} instead of {needed}"))
        .collect()
}

/// Most invocations that a workgroup may have.
pub(super) fn most_invocations(limits: &wgpu::Limits) -> u32 {
    limits
        .max_compute_invocations_per_workgroup
        .min(limits.max_compute_workgroup_size_x)
}

/// Invocations in a workgroup: the usual number, or what the adapter allows.
pub(super) fn workgroup(limits: &wgpu::Limits) -> u32 {
    wgsl::WORKGROUP.min(most_invocations(limits))
}

/// Largest storage buffer and binding, bytes.
pub(super) fn largest_buffer(limits: &wgpu::Limits) -> u64 {
    limits
        .max_buffer_size
        .min(limits.max_storage_buffer_binding_size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::Limits;

    #[test]
    fn the_defaults_of_webgpu_suffice() {
        assert_eq!(missing(&Limits::defaults()), Vec::<String>::new());
        assert_eq!(workgroup(&Limits::defaults()), wgsl::WORKGROUP);
    }

    #[test]
    fn what_lower_limits_lack_is_named() {
        let missing_there = missing(&Limits::downlevel_defaults());
        assert_eq!(
            missing_there,
            ["4 storage buffers per shader stage instead of 7"]
        );
        let none = missing(&Limits::downlevel_webgl2_defaults()).join(", ");
        for what in [
            "0 storage buffers per shader stage",
            "0 invocations per workgroup",
            "0 workgroups per dispatch",
            "0 bytes in a storage buffer",
        ] {
            assert!(none.contains(what), "{what}: {none}");
        }
    }

    #[test]
    fn each_limit_that_is_too_low_is_found() {
        type Lower = fn(&mut Limits);
        let lower: [(&str, Lower); 7] = [
            ("6 storage buffers", |l| {
                l.max_storage_buffers_per_shader_stage = 6;
            }),
            ("0 uniform buffers per", |l| {
                l.max_uniform_buffers_per_shader_stage = 0;
            }),
            ("0 dynamic uniform buffers", |l| {
                l.max_dynamic_uniform_buffers_per_pipeline_layout = 0;
            }),
            ("9 bindings", |l| l.max_bindings_per_bind_group = 9),
            ("65534 workgroups", |l| {
                l.max_compute_workgroups_per_dimension = 65_534;
            }),
            ("1048576 bytes in a buffer", |l| l.max_buffer_size = 1 << 20),
            ("1048576 bytes in a storage buffer", |l| {
                l.max_storage_buffer_binding_size = 1 << 20;
            }),
        ];
        for (what, lower) in lower {
            let mut limits = Limits::defaults();
            lower(&mut limits);
            let found = missing(&limits);
            assert!(found.len() == 1 && found[0].contains(what), "{found:?}");
        }
    }

    #[test]
    fn a_workgroup_adapts_to_smaller_limits() {
        let small = Limits {
            max_compute_invocations_per_workgroup: 32,
            ..Limits::defaults()
        };
        let narrow = Limits {
            max_compute_workgroup_size_x: 16,
            ..Limits::defaults()
        };
        assert_eq!([&small, &narrow].map(workgroup), [32, 16]);
        assert!(missing(&small).is_empty() && missing(&narrow).is_empty());
    }
}
