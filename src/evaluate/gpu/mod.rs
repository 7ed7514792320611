//! The GPU evaluator: one invocation a candidate and record, or a candidate and tone.

mod adapter;
pub mod layout;
mod pipeline;

pub use adapter::{adapters, best, describe, is_software, kind, none_found};
pub use pipeline::Checks;

use super::problem::{Data, Problem, SAMPLES_PER_PERIOD, Series, Tone, Wave};
use super::simulate::SLICE;
use super::{Cost, Evaluator, Job, Population, wgsl};
use crate::{Error, Result};
use pipeline::Pipeline;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use wgpu::util::DeviceExt;

/// Invocations in a workgroup: `@workgroup_size` in `shaders/evaluate.wgsl`.
const WORKGROUP: u32 = 64;
/// Largest number of workgroups in one dimension of a dispatch, as WebGPU guarantees it.
const MOST_WORKGROUPS: u64 = 65_535;
/// How long a submission may take before the device counts as hung.
const PATIENCE: Duration = Duration::from_secs(300);

/// Evaluates populations on a GPU.
pub struct GpuEvaluator {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    checks: Checks,
    /// Largest storage buffer and binding, bytes.
    largest: u64,
    pipelines: HashMap<String, Arc<Pipeline>>,
    prepared: Option<Prepared>,
}

/// The buffers of the problem that was evaluated last.
struct Prepared {
    problem: Problem,
    pipeline: Arc<Pipeline>,
    constants: wgpu::Buffer,
    data: Buffers,
}

enum Buffers {
    Series {
        samples: wgpu::Buffer,
        series: wgpu::Buffer,
        count: u32,
        slices: u32,
    },
    Tones {
        tones: wgpu::Buffer,
        wave: wgpu::Buffer,
        count: u32,
    },
}

impl GpuEvaluator {
    /// An evaluator on `adapter`.
    ///
    /// # Errors
    /// If the adapter gives no device.
    pub fn new(adapter: &wgpu::Adapter, checks: Checks) -> Result<Self> {
        let info = adapter.get_info();
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("servobee"),
            required_limits: limits.clone(),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                Error::failed(
                    format!("adapter \"{}\" gives no device: {error}", info.name),
                    "update its driver, or use --evaluator cpu",
                )
            })?;
        let largest = limits
            .max_buffer_size
            .min(limits.max_storage_buffer_binding_size);
        Ok(Self {
            device,
            queue,
            info,
            checks,
            largest,
            pipelines: HashMap::new(),
            prepared: None,
        })
    }

    /// Limits every buffer to `bytes`, so that populations are cut into smaller parts.
    pub fn limit_buffers(&mut self, bytes: u64) {
        self.largest = self.largest.min(bytes);
    }

    /// The costs under a shader of the caller's instead of the composed one: how tests show that a wrong shader is
    /// caught.
    ///
    /// # Errors
    /// If the shader is refused or the device fails.
    pub fn costs_with(
        &mut self,
        source: &str,
        problem: &Problem,
        population: &Population,
    ) -> Result<Vec<Cost>> {
        if population.is_empty() {
            return Ok(Vec::new());
        }
        self.prepare(source, problem)?;
        let prepared = self.prepared.as_ref().expect("prepared above");
        let (items, slices) = match &prepared.data {
            Buffers::Series { count, slices, .. } => (*count, *slices),
            Buffers::Tones { count, .. } => (*count, 1),
        };
        let states = problem.structure.states().len().max(1) as u64;
        let bytes = (u64::from(items) * u64::from(slices) * 16)
            .max(u64::from(items) * states * 4)
            .max(population.dimension() as u64 * 4);
        let most = (self.largest / bytes).min(MOST_WORKGROUPS * u64::from(WORKGROUP));
        if most == 0 {
            return Err(Error::failed(
                format!(
                    "one candidate needs {bytes} bytes and \"{}\" has {}",
                    self.info.name, self.largest
                ),
                "use --evaluator cpu",
            ));
        }
        let mut costs = Vec::with_capacity(population.len());
        let mut first = 0;
        while first < population.len() {
            let last = population.len().min(first + most as usize);
            self.part(prepared, population, first..last, items, slices, &mut costs)?;
            first = last;
        }
        Ok(costs)
    }

    /// Evaluates candidates `range` in one submission.
    fn part(
        &self,
        prepared: &Prepared,
        population: &Population,
        range: std::ops::Range<usize>,
        items: u32,
        slices: u32,
        costs: &mut Vec<Cost>,
    ) -> Result<()> {
        let count = range.len() as u32;
        let problem = &prepared.problem;
        let mut candidates = Vec::with_capacity(range.len() * population.dimension());
        for parameter in 0..population.dimension() {
            candidates.extend(
                range
                    .clone()
                    .map(|i| population.candidate(i)[parameter] as f32),
            );
        }
        // A buffer has at least one number, also where no parameter is free.
        candidates.resize(candidates.len().max(1), 0.0);
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let candidates = self.storage("candidates", bytemuck::cast_slice(&candidates));
        let trajectories = u64::from(count) * u64::from(items);
        let size = trajectories * u64::from(slices) * 16;
        let results = self.buffer(
            "results",
            size,
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        );
        let readback = self.buffer(
            "readback",
            size,
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        );
        let states = self.buffer(
            "states",
            trajectories * 4 * problem.structure.states().len().max(1) as u64,
            wgpu::BufferUsages::STORAGE,
        );
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(Error::failed(
                format!(
                    "\"{}\" has no memory for {count} candidates: {error}",
                    self.info.name
                ),
                "use a smaller population or --evaluator cpu",
            ));
        }

        let align = self
            .device
            .limits()
            .min_uniform_buffer_offset_alignment
            .max(16) as usize;
        let mut work = vec![0u8; align * slices as usize];
        for slice in 0..slices {
            let entry = layout::Work {
                population: count,
                items,
                slice,
                padding: 0,
            };
            work[slice as usize * align..][..16].copy_from_slice(bytemuck::bytes_of(&entry));
        }
        let work = self
            .device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("work"),
                contents: &work,
                usage: wgpu::BufferUsages::UNIFORM,
            });
        let whole = |binding, buffer: &wgpu::Buffer| (binding, buffer.clone());
        let mut bound = vec![
            whole(1, &candidates),
            whole(2, &prepared.constants),
            whole(6, &results),
        ];
        match &prepared.data {
            Buffers::Series {
                samples, series, ..
            } => {
                bound.extend([whole(3, samples), whole(4, series), whole(5, &states)]);
            }
            Buffers::Tones { tones, wave, .. } => bound.extend([whole(7, tones), whole(8, wave)]),
        }
        let mut entries: Vec<wgpu::BindGroupEntry> = bound
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        entries.push(wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &work,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<layout::Work>() as u64),
            }),
        });
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("population"),
            layout: &prepared.pipeline.layout,
            entries: &entries,
        });

        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&prepared.pipeline.pipeline);
            for slice in 0..slices {
                pass.set_bind_group(0, &group, &[slice * align as u32]);
                pass.dispatch_workgroups(count.div_ceil(WORKGROUP), items, 1);
            }
        }
        encoder.copy_buffer_to_buffer(&results, 0, &readback, 0, size);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only when the wait below has failed already.
            let _ = sender.send(result);
        });
        let wait = wgpu::PollType::Wait {
            submission_index: None,
            timeout: Some(PATIENCE),
        };
        let lost = |what: String| {
            Error::failed(
                format!("\"{}\" failed: {what}", self.info.name),
                "use --evaluator cpu",
            )
        };
        self.device
            .poll(wait)
            .map_err(|error| lost(error.to_string()))?;
        receiver
            .recv()
            .map_err(|error| lost(error.to_string()))?
            .map_err(|error| lost(error.to_string()))?;
        let view = readback
            .get_mapped_range(..)
            .map_err(|error| lost(error.to_string()))?;
        let results: &[[f32; 4]] = bytemuck::cast_slice(&view);
        let at = |slice: u32, item: u32, candidate: u32| {
            results[((slice * items + item) as usize) * count as usize + candidate as usize]
        };
        for candidate in 0..count {
            let failed = (0..slices).any(|s| (0..items).any(|i| at(s, i, candidate)[3] != 0.0));
            let value = match &*problem.data {
                Data::Series(_) => {
                    let mut sums = [0.0; 3];
                    for item in 0..items {
                        for slice in 0..slices {
                            for (sum, part) in sums.iter_mut().zip(at(slice, item, candidate)) {
                                *sum += f64::from(part);
                            }
                        }
                    }
                    problem.cost_of_squares(sums)
                }
                Data::Tones(tones) => {
                    let responses = (0..items)
                        .map(|i| at(0, i, candidate))
                        .map(|[re, im, ..]| [re.into(), im.into()]);
                    problem.cost_of_responses(tones, responses)
                }
            };
            costs.push(if failed {
                Cost::DIVERGED
            } else {
                Cost::finished(value)
            });
        }
        Ok(())
    }

    /// Brings the problem's data to the device, unless it is there already.
    fn prepare(&mut self, source: &str, problem: &Problem) -> Result<()> {
        let pipeline = self.pipeline(source, problem)?;
        let same = |prepared: &Prepared| {
            Arc::ptr_eq(&prepared.problem.data, &problem.data)
                && prepared.problem.structure == problem.structure
                && prepared.problem.parameters == problem.parameters
                && prepared.problem.scale == problem.scale
                && Arc::ptr_eq(&prepared.pipeline, &pipeline)
        };
        if self.prepared.as_ref().is_some_and(same) {
            return Ok(());
        }
        let mut constants: Vec<f32> = problem
            .parameters
            .iter()
            .filter(|p| p.fixed)
            .map(|p| p.start as f32)
            .collect();
        constants.resize(constants.len().max(1), 0.0);
        let data = match &*problem.data {
            Data::Series(all) => self.upload_series(all)?,
            Data::Tones(tones) => self.upload_tones(tones),
        };
        let constants = self.storage("constants", bytemuck::cast_slice(&constants));
        self.prepared = Some(Prepared {
            problem: problem.clone(),
            pipeline,
            constants,
            data,
        });
        Ok(())
    }

    fn upload_series(&self, all: &[Series]) -> Result<Buffers> {
        let mut samples = Vec::new();
        let mut series = Vec::new();
        for one in all {
            series.push(layout::Series {
                first: samples.len() as u32,
                count: one.samples.len() as u32,
            });
            samples.extend(one.samples.iter().map(|sample| layout::Sample {
                step: sample.step as f32,
                substeps: sample.substeps,
                pieces: sample.pieces,
                weight: sample.weight as f32,
                input: sample.input.map(|value| value as f32),
                time_rest: (sample.input[6] - f64::from(sample.input[6] as f32)) as f32,
                target: sample.target.map(|value| value as f32),
            }));
        }
        let bytes = size_of_val(samples.as_slice()) as u64;
        if bytes > self.largest {
            return Err(Error::failed(
                format!(
                    "the records need {bytes} bytes and \"{}\" has {} in one buffer",
                    self.info.name, self.largest
                ),
                "use --evaluator cpu",
            ));
        }
        let longest = all.iter().map(|one| one.samples.len()).max().unwrap_or(0);
        Ok(Buffers::Series {
            samples: self.storage("samples", bytemuck::cast_slice(&samples)),
            series: self.storage("series", bytemuck::cast_slice(&series)),
            count: all.len() as u32,
            slices: longest.div_ceil(SLICE) as u32,
        })
    }

    fn upload_tones(&self, tones: &[Tone]) -> Buffers {
        let wave = Wave::new(tones);
        let table: Vec<[f32; 2]> = wave
            .table
            .iter()
            .map(|pair| pair.map(|value| value as f32))
            .collect();
        let entries: Vec<layout::Tone> = tones
            .iter()
            .map(|tone| layout::Tone {
                amplitude: tone.amplitude as f32,
                step: (1.0 / (tone.frequency * f64::from(SAMPLES_PER_PERIOD * tone.substeps)))
                    as f32,
                substeps: tone.substeps,
                stride: wave.substeps / tone.substeps,
                settle: tone.settle,
                measure: tone.measure,
            })
            .collect();
        Buffers::Tones {
            tones: self.storage("tones", bytemuck::cast_slice(&entries)),
            wave: self.storage("wave", bytemuck::cast_slice(&table)),
            count: tones.len() as u32,
        }
    }

    /// The compiled shader, from the cache where it is known.
    fn pipeline(&mut self, source: &str, problem: &Problem) -> Result<Arc<Pipeline>> {
        let (entry, bindings): (_, &[u32]) = match &*problem.data {
            Data::Series(_) => ("evaluate_series", &[1, 2, 3, 4, 5, 6]),
            Data::Tones(_) => ("evaluate_tones", &[1, 2, 6, 7, 8]),
        };
        let key = format!("{entry}\n{source}");
        if let Some(known) = self.pipelines.get(&key) {
            return Ok(known.clone());
        }
        let pipeline = Pipeline::compile(&self.device, self.checks, entry, bindings, source);
        let pipeline = Arc::new(pipeline.map_err(|error| {
            Error::failed(
                format!("\"{}\" refuses the shader: {error}", self.info.name),
                "use --evaluator cpu, and report this",
            )
        })?);
        self.pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    fn storage(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE;
        self.device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
    }

    fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }
}

impl Evaluator for GpuEvaluator {
    fn describe(&self) -> String {
        describe(&self.info)
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        jobs.iter()
            .map(|job| self.costs_with(&wgsl::compose(job.problem), job.problem, job.population))
            .collect()
    }
}
