//! Compiling a composed shader.

use super::configuration::Checks;
use super::layout::binding;
use super::pace::Pace;
use crate::audited::unchecked_shader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// A compiled entry point, the layout of its bindings, and how fast it runs.
pub(super) struct Pipeline {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
    pace: Mutex<Pace>,
}

impl Pipeline {
    /// How fast it runs.
    pub(super) fn pace(&self) -> Pace {
        *self.pace.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Remembers that `steps` integration steps in `width` simulations side by side took `seconds`.
    pub(super) fn learn(&self, width: f64, steps: f64, seconds: f64) {
        // Records of one row have no steps.
        if steps > 0.0 {
            *self.pace.lock().unwrap_or_else(PoisonError::into_inner) =
                Pace::measured(width, steps, seconds);
        }
    }

    /// Compiles `entry` of `source`, which uses [`binding::WORK`] and the storage buffers `bindings`.
    ///
    /// # Errors
    /// If the shader is refused, or compiling it panics: what the driver says.
    pub(super) fn compile(
        device: &wgpu::Device,
        checks: Checks,
        entry: &str,
        bindings: &[u32],
        source: &str,
    ) -> Result<Self, String> {
        let compile = || {
            // The driver's own errors are internal ones.
            let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
            let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
            let made = Self::make(device, checks, entry, bindings, source);
            let errors = [
                pollster::block_on(invalid.pop()),
                pollster::block_on(internal.pop()),
            ];
            match errors.into_iter().flatten().next() {
                Some(error) => Err(error.to_string()),
                None => Ok(made),
            }
        };
        catch_unwind(AssertUnwindSafe(compile))
            .unwrap_or_else(|_| Err("compiling it panicked".into()))
    }

    fn make(
        device: &wgpu::Device,
        checks: Checks,
        entry: &str,
        bindings: &[u32],
        source: &str,
    ) -> Self {
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(entry),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        };
        let module = match checks {
            Checks::On => device.create_shader_module(descriptor),
            Checks::Off => {
                let checks = wgpu::ShaderRuntimeChecks::unchecked();
                unchecked_shader(device, descriptor, checks)
            }
        };
        let layout_entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match binding {
                    binding::WORK => wgpu::BufferBindingType::Uniform,
                    _ => wgpu::BufferBindingType::Storage {
                        read_only: !binding::WRITTEN.contains(&binding),
                    },
                },
                has_dynamic_offset: binding == binding::WORK,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<_> = std::iter::once(&binding::WORK)
            .chain(bindings)
            .map(|&binding| layout_entry(binding))
            .collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(entry),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(entry),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self {
            pipeline,
            layout,
            pace: Mutex::default(),
        }
    }
}
