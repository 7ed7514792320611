//! A device with everything that is lost with it: pipelines, data and buffers.

use super::context::{Attempt, Context, Fault};
use super::loops::Loops;
use super::mishap::{Mishap, Mishaps};
use super::pipeline::Pipeline;
use super::pool::Pool;
use super::ready::{Place, Ready};
use super::resident::{Records, Resident, Residents, bytes, items_and_slots};
use super::submitter::{Equipment, Submitter};
use super::wave::Part;
use super::{Checks, Timings, one_line};
use crate::evaluate::problem::Data;
use crate::evaluate::{Cost, Problem};
use crate::{Error, Result};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use wgpu::BufferUsages as Usage;

/// How work is done.
#[derive(Debug, Clone, Copy)]
pub(super) struct Manner {
    pub(super) checks: Checks,
    /// Invocations in a workgroup.
    pub(super) workgroup: u32,
    /// Largest storage buffer and binding, bytes.
    pub(super) largest: u64,
    /// Whether the driver limits loops.
    pub(super) limited_loops: bool,
    /// Results, states and data of a wave, about, bytes.
    pub(super) wave: u64,
    /// How long a submission may take, s.
    pub(super) budget: f64,
    /// How long it may take before the device counts as hung.
    pub(super) patience: Duration,
}

/// A device in use.
pub(super) struct Station {
    context: Context,
    pipelines: HashMap<String, Arc<Pipeline>>,
    residents: Residents,
    equipment: Equipment,
    values: Pool,
    states: Pool,
    results: Pool,
    readback: Pool,
    windows: Pool,
}

impl Station {
    /// # Errors
    /// If the adapter gives no device.
    pub(super) fn open(adapter: &wgpu::Adapter) -> Result<Self> {
        let context = Context::open(adapter)?;
        Ok(Self {
            pipelines: HashMap::new(),
            residents: Residents::default(),
            equipment: Equipment::new(&context),
            values: Pool::new("values", Usage::STORAGE | Usage::COPY_DST),
            states: Pool::new("states", Usage::STORAGE),
            results: Pool::new("results", Usage::STORAGE | Usage::COPY_SRC),
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
        self.residents = Residents::default();
    }

    /// Evaluates parts that fit on the device together. All is submitted before its results are waited for.
    ///
    /// # Errors
    /// If the shader is refused, the data do not fit, or the device fails.
    pub(super) fn run(
        &mut self,
        parts: &[Part],
        manner: Manner,
        mishaps: &mut Mishaps,
        timings: &mut Timings,
    ) -> Attempt<Vec<Vec<Cost>>> {
        let mut values = Vec::new();
        let mut begin = 0;
        let mut all = Vec::with_capacity(parts.len());
        for part in parts {
            let ready = self.prepare(part, manner, &mut values, begin, mishaps, timings)?;
            begin += ready.bytes;
            all.push(ready);
        }
        if mishaps.strikes(Mishap::OutOfMemory) {
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

        let mut submitter = Submitter::new(&self.context, &mut self.equipment, mishaps, manner);
        for ready in &all {
            timings.upload +=
                ready.submit(&self.context, &mut submitter, &buffer, &mut self.windows)?;
        }
        submitter.flush()?;
        let readback = self.readback.take(&self.context, begin);
        let mut encoder = self
            .context
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for ready in &all {
            encoder.copy_buffer_to_buffer(&ready.results, 0, &readback, ready.begin, ready.bytes);
        }
        let copied = self.context.queue.submit([encoder.finish()]);
        // Whether that failed shows when the results are read.
        readback.map_async(wgpu::MapMode::Read, .., |_| {});
        submitter.finish(timings)?;

        let start = Instant::now();
        self.context.wait(copied, manner.patience)?;
        let view = self.context.mapped(&readback, begin)?;
        let results: &[[f32; 4]] = bytemuck::cast_slice(&view);
        let of_part = |ready: &Ready| {
            let [from, to] =
                [ready.begin, ready.begin + ready.bytes].map(|byte| byte as usize / 16);
            ready.costs(&results[from..to])
        };
        let costs = all.iter().map(of_part).collect();
        drop(view);
        readback.unmap();
        timings.readback += start.elapsed().as_secs_f64();

        self.readback.give(readback);
        self.values.give(buffer);
        for ready in all {
            self.states.give(ready.states);
            self.results.give(ready.results);
        }
        self.residents.trim();
        Ok(costs)
    }

    /// Brings a part to the device. Its numbers are added to `values`, its results are read from byte `begin`.
    fn prepare<'a>(
        &mut self,
        part: &'a Part<'a>,
        manner: Manner,
        values: &mut Vec<f32>,
        begin: u64,
        mishaps: &mut Mishaps,
        timings: &mut Timings,
    ) -> Attempt<Ready<'a>> {
        let (problem, population) = (part.job.problem, part.job.population);
        let start = Instant::now();
        let pipeline = self.pipeline(part.source, problem, manner.checks, mishaps)?;
        timings.compile += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let resident = self.residents.bring(
            &self.context,
            &problem.data,
            manner.largest,
            &mut timings.uploaded,
        )?;
        if let Resident::Series(Records { whole: None, .. }) = &*resident {
            if problem.structure.delays() {
                return Err(Fault::Final(Error::failed(
                    format!(
                        "a late command looks back at rows, so the records have to fit into one buffer of {} bytes, \
                         and do not",
                        manner.largest
                    ),
                    "use --evaluator cpu",
                )));
            }
            // Every part streams all of it.
            timings.uploaded += bytes(&problem.data);
        }
        let parameters = 0..population.dimension();
        let of_all = |j: usize| part.range.clone().map(move |i| population.candidate(i)[j]);
        let candidates = self.place(values, parameters.flat_map(of_all));
        let fixed = problem.parameters.iter().filter(|p| p.fixed);
        let constants = self.place(values, fixed.map(|p| p.start));
        timings.upload += start.elapsed().as_secs_f64();

        let [items, slots] = items_and_slots(&problem.data);
        let count = part.range.len() as u64;
        let results = u64::from(slots) * count * 16;
        let states = match &*problem.data {
            Data::Series(_) => problem.structure.states().len().max(1),
            Data::Tones(_) => 1,
        };
        let states = u64::from(items) * count * 4 * states as u64;
        let loops = manner.limited_loops.then(|| Loops::of(problem));
        Ok(Ready {
            part,
            items,
            loops: loops.transpose()?,
            pipeline,
            resident,
            candidates,
            constants,
            states: self.states.take(&self.context, states),
            results: self.results.take(&self.context, results),
            begin,
            bytes: results,
        })
    }

    /// Adds numbers to `values` where a binding may begin; one at least, also where there are none.
    fn place(&self, values: &mut Vec<f32>, numbers: impl Iterator<Item = f64>) -> Place {
        let align = self
            .context
            .device
            .limits()
            .min_storage_buffer_offset_alignment as usize
            / 4;
        values.resize(values.len().next_multiple_of(align.max(1)), 0.0);
        let first = values.len();
        values.extend(numbers.map(|value| value as f32));
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
        mishaps: &mut Mishaps,
    ) -> Result<Arc<Pipeline>> {
        let (entry, bindings): (_, &[u32]) = match &*problem.data {
            Data::Series(_) => ("evaluate_series", &[1, 2, 3, 4, 5, 6]),
            Data::Tones(_) => ("evaluate_tones", &[1, 2, 6, 7, 8]),
        };
        let key = format!("{entry} {checks:?}\n{source}");
        if let Some(known) = self.pipelines.get(&key) {
            return Ok(known.clone());
        }
        let source = match mishaps.strikes(Mishap::ShaderRefused) {
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
