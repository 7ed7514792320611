//! Submissions that are short enough for a desktop's driver, a few of them in flight.

use super::clock::Clock;
use super::configuration::Configuration;
use super::context::{Attempt, Context, Fault};
use super::fault_injection::{FaultInjection, InjectedFault};
use super::layout::{self, binding};
use super::limits::MOST_WORKGROUPS;
use super::pipeline::Pipeline;
use super::timings::Timings;
use crate::evaluate::simulation::simulate::{CHUNK, SLICE};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

/// Submissions in flight at most: enough for the device not to wait for the host.
const MOST_IN_FLIGHT: usize = 3;
/// Dispatches in a submission at most.
const MOST_PENDING: usize = 256;
/// A dispatch is not cut into fewer candidates than this: a GPU would not be faster with fewer.
const LEAST_CANDIDATES: u32 = 256;
/// The shortest time that is believed, s: a clock may be coarser than a short submission.
const SHORTEST: f64 = 1e-6;

/// What every submission uses in turn.
pub(super) struct Resources {
    /// The `Work` of every dispatch of a submission.
    work: wgpu::Buffer,
    /// Bytes from one `Work` to the next.
    pitch: u32,
    clocks: Vec<Clock>,
}

impl Resources {
    pub(super) fn new(context: &Context) -> Self {
        let align = context.device.limits().min_uniform_buffer_offset_alignment;
        let pitch = (size_of::<layout::Work>() as u32).next_multiple_of(align);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        Self {
            work: context.buffer("work", MOST_PENDING as u64 * u64::from(pitch), usage),
            pitch,
            clocks: Vec::new(),
        }
    }

    /// The binding of `Work`, to be offset for each dispatch.
    pub(super) fn work(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.work,
            offset: 0,
            size: wgpu::BufferSize::new(size_of::<layout::Work>() as u64),
        })
    }
}

/// Candidates `work.first` to `work.last` on rows `work.begin` to `work.end`.
pub(super) struct Dispatch {
    pub(super) pipeline: Arc<Pipeline>,
    pub(super) group: wgpu::BindGroup,
    pub(super) work: layout::Work,
    /// Integration steps of one candidate.
    pub(super) steps: u64,
}

impl Dispatch {
    fn candidates(&self) -> u32 {
        self.work.last - self.work.first
    }
}

/// What is known of a dispatch while it runs.
struct Expected {
    pipeline: Arc<Pipeline>,
    steps: f64,
    width: f64,
    seconds: f64,
}

struct InFlight {
    index: wgpu::SubmissionIndex,
    submitted: Instant,
    expected: Vec<Expected>,
    clock: Option<Clock>,
}

/// Collects dispatches until they would take longer than a submission may, and submits them.
pub(super) struct Submitter<'a> {
    context: &'a Context,
    resources: &'a mut Resources,
    injection: &'a mut FaultInjection,
    /// Seconds of submissions, how many, and the longest.
    kernel: f64,
    submissions: u32,
    longest: f64,
    configuration: Configuration,
    pending: Vec<(Dispatch, Expected)>,
    in_flight: VecDeque<InFlight>,
    /// When the last submission was seen to be done.
    done: Instant,
}

impl<'a> Submitter<'a> {
    pub(super) fn new(
        context: &'a Context,
        resources: &'a mut Resources,
        injection: &'a mut FaultInjection,
        configuration: Configuration,
    ) -> Self {
        Self {
            context,
            resources,
            injection,
            kernel: 0.0,
            submissions: 0,
            longest: 0.0,
            configuration,
            pending: Vec::new(),
            in_flight: VecDeque::new(),
            done: Instant::now(),
        }
    }

    /// The bindings of a shader, with those of `Work`.
    pub(super) fn group(
        &self,
        pipeline: &Pipeline,
        bound: Vec<(u32, wgpu::BindingResource<'_>)>,
    ) -> wgpu::BindGroup {
        let work = [(binding::WORK, self.resources.work())];
        let entries: Vec<wgpu::BindGroupEntry> = work
            .into_iter()
            .chain(bound)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.context
            .device
            .create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("population"),
                layout: &pipeline.layout,
                entries: &entries,
            })
    }

    /// What is left of the pending submission, s.
    fn room(&self) -> f64 {
        let expected: f64 = self.pending.iter().map(|(_, one)| one.seconds).sum();
        self.configuration.submission - expected
    }

    /// Where the rows end that fit into the pending submission: whole chunks from row `begin`, at least one, none of
    /// another slice, not past row `limit`. `steps` counts the steps of all records before each chunk.
    pub(super) fn rows(
        &mut self,
        pipeline: &Pipeline,
        steps: &[u64],
        [candidates, items]: [u32; 2],
        begin: u32,
        limit: u32,
    ) -> Attempt<u32> {
        let chunk = CHUNK as u32;
        let limit = limit.min((begin / SLICE as u32 + 1) * SLICE as u32);
        let first = (begin / chunk) as usize;
        let last = limit.div_ceil(chunk) as usize;
        let width = f64::from(candidates) * f64::from(items);
        let seconds = |end: usize| {
            let steps = (steps[end] - steps[first]) as f64 * f64::from(candidates);
            pipeline.pace().seconds(steps, width)
        };
        if seconds(first + 1) > self.room() {
            self.flush()?;
        }
        let room = self.room();
        let chunks: Vec<usize> = (first + 2..=last).collect();
        let end = first + 1 + chunks.partition_point(|&end| seconds(end) <= room);
        Ok((end as u32 * chunk).min(limit))
    }

    /// How many of `left` candidates fit into the pending submission, each with `steps` steps on `items` items.
    pub(super) fn candidates(
        &mut self,
        pipeline: &Pipeline,
        steps: u64,
        items: u32,
        left: u32,
    ) -> Attempt<u32> {
        let width = f64::from(left) * f64::from(items);
        let seconds = || {
            pipeline
                .pace()
                .seconds(steps as f64 * f64::from(left), width)
        };
        if seconds() > self.room() {
            self.flush()?;
        }
        let share = (self.room() / seconds()).min(1.0);
        let few = (f64::from(left) * share) as u32 / self.configuration.workgroup
            * self.configuration.workgroup;
        let most = (MOST_WORKGROUPS * self.configuration.workgroup).min(left);
        Ok(if share < 1.0 {
            few.max(LEAST_CANDIDATES).min(most)
        } else {
            most
        })
    }

    /// Adds a dispatch to the pending submission.
    pub(super) fn push(&mut self, dispatch: Dispatch) -> Attempt<()> {
        if self.pending.len() == MOST_PENDING {
            self.flush()?;
        }
        let candidates = f64::from(dispatch.candidates());
        let (steps, width) = (
            dispatch.steps as f64 * candidates,
            candidates * f64::from(dispatch.work.items),
        );
        let expected = Expected {
            pipeline: dispatch.pipeline.clone(),
            steps,
            width,
            seconds: dispatch.pipeline.pace().seconds(steps, width),
        };
        self.pending.push((dispatch, expected));
        Ok(())
    }

    /// Submits what is pending; what is written to a buffer after this comes after it.
    pub(super) fn flush(&mut self) -> Attempt<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        while self.in_flight.len() >= MOST_IN_FLIGHT {
            self.wait_for_oldest()?;
        }
        if self.injection.occurs(InjectedFault::Lost) {
            self.context.device.destroy();
        }
        let device = &self.context.device;
        let clock = self.context.tick.map(|_| {
            let known = self.resources.clocks.pop();
            known.unwrap_or_else(|| Clock::new(self.context))
        });
        let pitch = self.resources.pitch as usize;
        let mut work = vec![0u8; pitch * self.pending.len()];
        for (entry, (dispatch, _)) in work.chunks_exact_mut(pitch).zip(&self.pending) {
            let bytes = bytemuck::bytes_of(&dispatch.work);
            entry[..bytes.len()].copy_from_slice(bytes);
        }
        let queue = &self.context.queue;
        queue.write_buffer(&self.resources.work, 0, &work);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes: clock.as_ref().map(Clock::writes),
            });
            for (number, (dispatch, _)) in (0..).zip(&self.pending) {
                let groups = dispatch.candidates().div_ceil(self.configuration.workgroup);
                pass.set_pipeline(&dispatch.pipeline.pipeline);
                pass.set_bind_group(0, &dispatch.group, &[number * self.resources.pitch]);
                pass.dispatch_workgroups(groups, dispatch.work.items, 1);
            }
        }
        if let Some(clock) = &clock {
            clock.resolve(&mut encoder);
        }
        let index = queue.submit([encoder.finish()]);
        if let Some(clock) = &clock {
            clock.ask();
        }
        self.in_flight.push_back(InFlight {
            index,
            submitted: Instant::now(),
            expected: self.pending.drain(..).map(|(_, one)| one).collect(),
            clock,
        });
        Ok(())
    }

    /// Submits what is pending, waits for everything, and adds up how long it took.
    pub(super) fn finish(mut self, timings: &mut Timings) -> Attempt<()> {
        self.flush()?;
        while !self.in_flight.is_empty() {
            self.wait_for_oldest()?;
        }
        timings.kernel += self.kernel;
        timings.submissions += self.submissions;
        timings.longest = timings.longest.max(self.longest);
        Ok(())
    }

    /// Waits for the oldest submission and learns from how long it took.
    fn wait_for_oldest(&mut self) -> Attempt<()> {
        let Some(oldest) = self.in_flight.pop_front() else {
            return Ok(());
        };
        if self.injection.occurs(InjectedFault::Hang) {
            return Err(Fault::Hung(self.configuration.timeout));
        }
        self.context
            .wait(oldest.index, self.configuration.timeout)?;
        let now = Instant::now();
        let began = oldest.submitted.max(self.done);
        self.done = now;
        let seconds = match (oldest.clock, self.context.tick) {
            (Some(clock), Some(tick)) => {
                let ticks = clock.ticks(self.context)?;
                self.resources.clocks.push(clock);
                ticks as f64 * tick
            }
            _ => (now - began).as_secs_f64(),
        };
        self.kernel += seconds;
        self.submissions += 1;
        self.longest = self.longest.max(seconds);
        let expected: f64 = oldest.expected.iter().map(|one| one.seconds).sum();
        let ratio = seconds.max(SHORTEST) / expected;
        for one in oldest.expected {
            one.pipeline
                .learn(one.width, one.steps, one.seconds * ratio);
        }
        Ok(())
    }
}
