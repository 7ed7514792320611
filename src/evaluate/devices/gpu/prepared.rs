//! A portion of a batch on the device: its buffers, its dispatches, and its costs from its results.

use super::batching::Portion;
use super::context::{Attempt, Context};
use super::layout::{self, binding};
use super::loops::Loops;
use super::pipeline::Pipeline;
use super::pool::Pool;
use super::resident::{Records, Resident, Rows, rows_of};
use super::submitter::{Dispatch, Submitter};
use crate::evaluate::population::{Cost, Status};
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::simulation::simulate::{CHUNK, SLICE};
use crate::model::Outputs;
use rayon::prelude::*;
use std::iter;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// Candidates whose numbers one core of the host converts at once: fewer are done before another has begun.
pub(super) const AT_ONCE: usize = 4096;

/// Bytes in the buffer of values: the first and how many.
pub(super) type ByteRange = (u64, u64);

/// A portion of a batch whose buffers are on the device.
pub(super) struct Prepared<'a> {
    pub(super) portion: &'a Portion<'a>,
    /// Records or tones.
    pub(super) items: u32,
    /// Where dispatches have to end, with a driver that limits loops.
    pub(super) loops: Option<Loops>,
    pub(super) pipeline: Arc<Pipeline>,
    pub(super) resident: Arc<Resident>,
    pub(super) candidates: ByteRange,
    pub(super) constants: ByteRange,
    pub(super) states: wgpu::Buffer,
    pub(super) results: ReadBack,
    pub(super) status: ReadBack,
}

/// A buffer that is read back.
pub(super) struct ReadBack {
    pub(super) buffer: wgpu::Buffer,
    /// Which bytes of the readback are its.
    pub(super) range: Range<usize>,
}

impl Prepared<'_> {
    fn count(&self) -> u32 {
        self.portion.range.len() as u32
    }

    /// Hands all its work to `submitter`. Returns the seconds in which the host has written rows.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) fn submit(
        &self,
        context: &Context,
        submitter: &mut Submitter,
        values: &wgpu::Buffer,
        windows: &mut Pool,
    ) -> Attempt<f64> {
        match (&*self.resident, &*self.portion.job.problem.data) {
            (Resident::Series(records), Data::Series(all)) => match &records.whole {
                Some(rows) => {
                    self.integrate(submitter, values, records, rows, 0..records.longest)?;
                    Ok(0.0)
                }
                None => self.stream(context, submitter, values, windows, records, all),
            },
            (Resident::Tones { tones, wave }, Data::Tones(_)) => {
                let data = [(binding::TONES, tones), (binding::WAVE, wave)];
                let group = self.group(submitter, values, &data);
                self.sweep(submitter, &group, 0..0, self.portion.job.problem.steps())?;
                Ok(0.0)
            }
            _ => unreachable!("data on the device are of the problem's kind"),
        }
    }

    /// Integrates over records window by window, with two buffers of rows in turn.
    fn stream(
        &self,
        context: &Context,
        submitter: &mut Submitter,
        values: &wgpu::Buffer,
        windows: &mut Pool,
        records: &Records,
        all: &[Series],
    ) -> Attempt<f64> {
        let size = (records.window as usize + 1) * all.len() * size_of::<layout::Sample>();
        let mut buffers = [0; 2].map(|_| windows.take(context, size as u64));
        let mut seconds = 0.0;
        for begin in (0..records.longest).step_by(records.window as usize) {
            let range = begin..records.longest.min(begin + records.window);
            // What is pending still reads the rows that are overwritten now.
            submitter.flush()?;
            let start = Instant::now();
            let (samples, series) = rows_of(all, range.start as usize..range.end as usize);
            let rows = Rows {
                samples: buffers[0].clone(),
                series: context.storage("series", bytemuck::cast_slice(&series)),
            };
            context
                .queue
                .write_buffer(&rows.samples, 0, bytemuck::cast_slice(&samples));
            seconds += start.elapsed().as_secs_f64();
            self.integrate(submitter, values, records, &rows, range)?;
            buffers.swap(0, 1);
        }
        // The buffers go to whoever comes next.
        submitter.flush()?;
        buffers.into_iter().for_each(|buffer| windows.give(buffer));
        Ok(seconds)
    }

    fn integrate(
        &self,
        submitter: &mut Submitter,
        values: &wgpu::Buffer,
        records: &Records,
        rows: &Rows,
        range: Range<u32>,
    ) -> Attempt<()> {
        let data = [
            (binding::SAMPLES, &rows.samples),
            (binding::SERIES, &rows.series),
            (binding::STATES, &self.states),
        ];
        let group = self.group(submitter, values, &data);
        let steps = &records.steps;
        let sizes = [self.count(), self.items];
        let mut begin = range.start;
        while begin < range.end {
            let limit = self
                .loops
                .as_ref()
                .map_or(range.end, |loops| loops.end(begin));
            let limit = limit.min(range.end);
            let end = submitter.rows(&self.pipeline, steps, sizes, begin, limit)?;
            let [first, last] = [begin, end].map(|row| (row as usize).div_ceil(CHUNK));
            self.sweep(submitter, &group, begin..end, steps[last] - steps[first])?;
            begin = end;
        }
        Ok(())
    }

    /// Dispatches all candidates on `rows`, `steps` integration steps each.
    fn sweep(
        &self,
        submitter: &mut Submitter,
        group: &wgpu::BindGroup,
        rows: Range<u32>,
        steps: u64,
    ) -> Attempt<()> {
        let mut first = 0;
        while first < self.count() {
            let left = self.count() - first;
            let last = first + submitter.candidates(&self.pipeline, steps, self.items, left)?;
            submitter.push(Dispatch {
                pipeline: self.pipeline.clone(),
                group: group.clone(),
                work: layout::Work {
                    population: self.count(),
                    items: self.items,
                    first,
                    last,
                    begin: rows.start,
                    end: rows.end,
                },
                steps,
            })?;
            first = last;
        }
        Ok(())
    }

    fn group(
        &self,
        submitter: &Submitter,
        values: &wgpu::Buffer,
        data: &[(u32, &wgpu::Buffer)],
    ) -> wgpu::BindGroup {
        let values_of = |(offset, size): ByteRange| {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: values,
                offset,
                size: wgpu::BufferSize::new(size),
            })
        };
        let mut bound = vec![
            (binding::CANDIDATES, values_of(self.candidates)),
            (binding::CONSTANTS, values_of(self.constants)),
            (binding::RESULTS, self.results.buffer.as_entire_binding()),
            (binding::STATUS, self.status.buffer.as_entire_binding()),
        ];
        let data = data.iter();
        bound.extend(data.map(|&(binding, buffer)| (binding, buffer.as_entire_binding())));
        submitter.group(&self.pipeline, bound)
    }

    /// The costs, from what was read back.
    pub(super) fn costs(&self, bytes: &[u8]) -> Vec<Cost> {
        let problem = self.portion.job.problem;
        let count = self.portion.range.len();
        let results: &[f32] = bytemuck::cast_slice(&bytes[self.results.range.clone()]);
        let status: &[u32] = bytemuck::cast_slice(&bytes[self.status.range.clone()]);
        let cost = |candidate: usize| {
            let mut status = status[candidate..].iter().step_by(count);
            if status.any(|&status| status != Status::Finished as u32) {
                return Cost::DIVERGED;
            }
            let results = results[candidate..].iter().step_by(count);
            let mut results = results.map(|&result| f64::from(result));
            Cost::finished(match &*problem.data {
                Data::Series(all) => {
                    let mut squares = Outputs::all(0.0);
                    for one in all {
                        let slices = one.samples.len().div_ceil(SLICE);
                        let outputs = &problem.structure.observed;
                        let outputs = iter::repeat_n(outputs, slices).flatten();
                        for (&output, sum) in outputs.zip(results.by_ref()) {
                            if one.measured[output] {
                                squares[output] += sum;
                            }
                        }
                    }
                    problem.cost_of_squares(squares)
                }
                Data::Tones(tones) => {
                    let responses = iter::from_fn(|| Some([results.next()?, results.next()?]));
                    problem.cost_of_responses(tones, responses)
                }
            })
        };
        (0..count)
            .into_par_iter()
            .with_min_len(AT_ONCE)
            .map(cost)
            .collect()
    }
}
