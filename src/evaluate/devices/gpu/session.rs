//! A device with everything that is lost with it: pipelines, data and buffers.

use super::batching::Portion;
use super::configuration::{Checks, Configuration};
use super::context::{Attempt, Context, Fault, one_line};
use super::fault_injection::{FaultInjection, InjectedFault};
use super::layout::binding;
use super::loops::Loops;
use super::pipeline::Pipeline;
use super::pool::Pool;
use super::prepared::{AT_ONCE, ByteRange, Prepared, ReadBack};
use super::resident::{Records, Resident, ResidentData, Written, bytes};
use super::submitter::{Resources, Submitter};
use super::timings::Timings;
use crate::evaluate::population::Cost;
use crate::evaluate::problem::{Data, Problem};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages as Usage;

/// A device with everything that is lost with it.
pub(super) struct Session {
    context: Context,
    pipelines: HashMap<String, Arc<Pipeline>>,
    resident: ResidentData,
    resources: Resources,
    values: Pool,
    states: Pool,
    /// Results and status.
    outputs: Pool,
    readback: Pool,
    windows: Pool,
}

impl Session {
    /// # Errors
    /// If the adapter gives no device.
    pub(super) fn open(adapter: &wgpu::Adapter) -> Result<Self> {
        let context = Context::open(adapter)?;
        Ok(Self {
            pipelines: HashMap::new(),
            resident: ResidentData::default(),
            resources: Resources::new(&context),
            values: Pool::new("values", Usage::STORAGE | Usage::COPY_DST),
            states: Pool::new("states", Usage::STORAGE),
            outputs: Pool::new("outputs", Usage::STORAGE | Usage::COPY_SRC),
            readback: Pool::new("readback", Usage::MAP_READ | Usage::COPY_DST),
            windows: Pool::new("window", Usage::STORAGE | Usage::COPY_DST),
            context,
        })
    }

    /// Whether the device's own clock times its work.
    pub(super) fn has_clock(&self) -> bool {
        self.context.tick.is_some()
    }

    /// Forgets the data that are on the device.
    pub(super) fn forget_data(&mut self) {
        self.resident = ResidentData::default();
    }

    /// Evaluates a batch. Everything is submitted before the results are waited for.
    ///
    /// # Errors
    /// If the shader is refused, the data do not fit, or the device fails.
    pub(super) fn run(
        &mut self,
        batch: &[Portion],
        configuration: Configuration,
        injection: &mut FaultInjection,
        timings: &mut Timings,
    ) -> Attempt<Vec<Vec<Cost>>> {
        let mut values = Vec::new();
        let mut size = 0;
        let mut all = Vec::with_capacity(batch.len());
        for portion in batch {
            all.push(self.prepare(
                portion,
                configuration,
                &mut values,
                &mut size,
                injection,
                timings,
            )?);
        }
        let size = size as u64;
        if injection.occurs(InjectedFault::OutOfMemory) {
            self.context.run_out_of_memory();
        }
        self.context.check()?;
        let start = Instant::now();
        let values_size = size_of_val(values.as_slice()) as u64;
        let buffer = self.values.take(&self.context, values_size);
        self.context
            .queue
            .write_buffer(&buffer, 0, bytemuck::cast_slice(&values));
        timings.upload += start.elapsed().as_secs_f64();

        let mut submitter =
            Submitter::new(&self.context, &mut self.resources, injection, configuration);
        for prepared in &all {
            timings.upload +=
                prepared.submit(&self.context, &mut submitter, &buffer, &mut self.windows)?;
        }
        submitter.flush()?;
        let readback = self.readback.take(&self.context, size);
        let mut encoder = self
            .context
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for ReadBack { buffer, range } in all
            .iter()
            .flat_map(|prepared| [&prepared.results, &prepared.status])
        {
            let [begin, size] = [range.start, range.len()].map(|bytes| bytes as u64);
            encoder.copy_buffer_to_buffer(buffer, 0, &readback, begin, size);
        }
        let copied = self.context.queue.submit([encoder.finish()]);
        // Whether that failed shows when the results are read.
        readback.map_async(wgpu::MapMode::Read, .., |_| {});
        submitter.finish(timings)?;

        let start = Instant::now();
        self.context.wait(copied, configuration.timeout)?;
        let view = self.context.mapped(&readback, size)?;
        let costs = all.iter().map(|prepared| prepared.costs(&view)).collect();
        drop(view);
        readback.unmap();
        timings.readback += start.elapsed().as_secs_f64();

        self.readback.give(readback);
        self.values.give(buffer);
        for prepared in all {
            self.states.give(prepared.states);
            self.outputs.give(prepared.results.buffer);
            self.outputs.give(prepared.status.buffer);
        }
        self.resident.trim();
        Ok(costs)
    }

    /// Brings a portion to the device. Its numbers are added to `values`, the bytes that are read back to `size`.
    fn prepare<'a>(
        &mut self,
        portion: &'a Portion<'a>,
        configuration: Configuration,
        values: &mut Vec<f32>,
        size: &mut usize,
        injection: &mut FaultInjection,
        timings: &mut Timings,
    ) -> Attempt<Prepared<'a>> {
        let (problem, population) = (portion.job.problem, portion.job.population);
        let start = Instant::now();
        let pipeline = self.pipeline(portion.source, problem, configuration.checks, injection)?;
        timings.compile += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let resident = self.resident.upload(
            &self.context,
            &problem.data,
            configuration.largest_buffer,
            &mut timings.uploaded,
        )?;
        if let Resident::Series(Records { whole: None, .. }) = &*resident {
            if problem.structure.delays() {
                return Err(Fault::Final(Error::failed(
                    format!(
                        "a late command looks back at rows, so the records have to fit into one buffer of {} bytes, \
                         and do not",
                        configuration.largest_buffer
                    ),
                    "use --evaluator cpu",
                )));
            }
            // Every portion streams all of it.
            timings.uploaded += bytes(&problem.data);
        }
        let (range, count) = (&portion.range, portion.range.len());
        let candidates = self.append(values, |values| {
            let of_all = |k: usize| population.candidate(range.start + k % count)[k / count] as f32;
            let numbers = (0..population.dimension() * count).into_par_iter();
            values.par_extend(numbers.with_min_len(AT_ONCE).map(of_all));
        });
        let constants = self.append(values, |values| {
            let fixed = problem.parameters.iter().filter(|p| p.is_fixed());
            values.extend(fixed.map(|p| p.nominal() as f32));
        });
        timings.upload += start.elapsed().as_secs_f64();

        let written = Written::of(problem);
        let bytes_of = |numbers: u64| 4 * numbers * portion.range.len() as u64;
        let mut read_back = |numbers: u64| {
            let bytes = bytes_of(numbers);
            let begin = *size;
            *size += bytes as usize;
            ReadBack {
                buffer: self.outputs.take(&self.context, bytes),
                range: begin..*size,
            }
        };
        let loops = configuration.limited_loops.then(|| Loops::of(problem));
        Ok(Prepared {
            portion,
            items: written.items,
            loops: loops.transpose()?,
            pipeline,
            resident,
            candidates,
            constants,
            results: read_back(written.results),
            status: read_back(written.items.into()),
            states: self.states.take(&self.context, bytes_of(written.states)),
        })
    }

    /// Has `add` add numbers to `values` where a binding may begin; one is there at least, also where it adds none.
    fn append(&self, values: &mut Vec<f32>, add: impl FnOnce(&mut Vec<f32>)) -> ByteRange {
        let limits = self.context.device.limits();
        let align = limits.min_storage_buffer_offset_alignment as usize / 4;
        values.resize(values.len().next_multiple_of(align.max(1)), 0.0);
        let first = values.len();
        add(values);
        if values.len() == first {
            values.push(0.0);
        }
        let bytes_of = |count: usize| 4 * count as u64;
        (bytes_of(first), bytes_of(values.len() - first))
    }

    /// The compiled shader, from the cache where it is known.
    fn pipeline(
        &mut self,
        source: &str,
        problem: &Problem,
        checks: Checks,
        injection: &mut FaultInjection,
    ) -> Result<Arc<Pipeline>> {
        let (entry, bindings): (_, &[u32]) = match &*problem.data {
            Data::Series(_) => ("evaluate_series", &binding::OF_SERIES),
            Data::Tones(_) => ("evaluate_tones", &binding::OF_TONES),
        };
        let key = format!("{entry} {checks:?}\n{source}");
        if let Some(known) = self.pipelines.get(&key) {
            return Ok(known.clone());
        }
        let source = match injection.occurs(InjectedFault::ShaderRefused) {
            true => "no shader",
            false => source,
        };
        let pipeline = Pipeline::compile(&self.context.device, checks, entry, bindings, source);
        let pipeline = Arc::new(pipeline.map_err(|error| {
            Error::failed(
                format!(
                    "the driver of the GPU \"{}\" refuses the shader: {}",
                    self.context.name,
                    one_line(&error)
                ),
                "use --evaluator cpu, and report this",
            )
        })?);
        self.pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }
}
