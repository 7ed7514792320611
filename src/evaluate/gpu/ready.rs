//! A part of a population on the device: its buffers, its dispatches, and its costs from its results.

use super::context::{Attempt, Context};
use super::layout;
use super::loops::Loops;
use super::pipeline::Pipeline;
use super::pool::Pool;
use super::resident::{Records, Resident, Rows, rows_of};
use super::submitter::{Dispatch, Submitter};
use super::wave::Part;
use crate::evaluate::Cost;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::simulate::CHUNK;
use crate::model::Outputs;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// Numbers in the buffer of values: the first byte and how many.
pub(super) type Place = (u64, u64);

/// A part whose buffers are ready.
pub(super) struct Ready<'a> {
    pub(super) part: &'a Part<'a>,
    /// Records or tones.
    pub(super) items: u32,
    /// Where dispatches have to end, with a driver that limits loops.
    pub(super) loops: Option<Loops>,
    pub(super) pipeline: Arc<Pipeline>,
    pub(super) resident: Arc<Resident>,
    pub(super) candidates: Place,
    pub(super) constants: Place,
    pub(super) states: wgpu::Buffer,
    pub(super) results: wgpu::Buffer,
    /// Where its results are in the readback.
    pub(super) begin: u64,
    /// Bytes of its results.
    pub(super) bytes: u64,
}

impl Ready<'_> {
    fn count(&self) -> u32 {
        self.part.range.len() as u32
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
        match (&*self.resident, &*self.part.job.problem.data) {
            (Resident::Series(records), Data::Series(all)) => match &records.whole {
                Some(rows) => {
                    self.integrate(submitter, values, records, rows, 0..records.longest)?;
                    Ok(0.0)
                }
                None => self.stream(context, submitter, values, windows, records, all),
            },
            (Resident::Tones { tones, wave }, Data::Tones(_)) => {
                let group = self.group(submitter, values, &[(7, tones), (8, wave)]);
                self.sweep(submitter, &group, 0..0, self.part.job.problem.steps())?;
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
        let data = [(3, &rows.samples), (4, &rows.series), (5, &self.states)];
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
        let part = |(offset, size): Place| {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: values,
                offset,
                size: wgpu::BufferSize::new(size),
            })
        };
        let mut bound = vec![
            (1, part(self.candidates)),
            (2, part(self.constants)),
            (6, self.results.as_entire_binding()),
        ];
        let data = data.iter();
        bound.extend(data.map(|&(binding, buffer)| (binding, buffer.as_entire_binding())));
        submitter.group(&self.pipeline, bound)
    }

    /// The costs, from the results of all candidates.
    pub(super) fn costs(&self, results: &[[f32; 4]]) -> Vec<Cost> {
        let problem = self.part.job.problem;
        let count = self.part.range.len();
        let cost = |candidate: usize| {
            let sums = || results[candidate..].iter().step_by(count);
            if sums().any(|sum| sum[3] != 0.0) {
                return Cost::DIVERGED;
            }
            Cost::finished(match &*problem.data {
                Data::Series(_) => {
                    let mut squares = Outputs::all(0.0);
                    for slice in sums() {
                        for (square, &sum) in squares.0.iter_mut().zip(slice) {
                            *square += f64::from(sum);
                        }
                    }
                    problem.cost_of_squares(squares)
                }
                Data::Tones(tones) => {
                    let responses = sums().map(|&[re, im, ..]| [re.into(), im.into()]);
                    problem.cost_of_responses(tones, responses)
                }
            })
        };
        (0..count).map(cost).collect()
    }
}
