//! The GPU evaluator: one invocation a candidate and record, or a candidate and tone.

mod adapter;
mod clock;
mod context;
pub mod layout;
mod pace;
mod pipeline;
mod pool;
mod ready;
mod resident;
mod station;
mod submitter;
mod wave;

pub use adapter::{adapters, best, describe, is_software, kind, none_found};
pub use pipeline::Checks;

use super::{Cost, Evaluator, Job, Population, Problem, wgsl};
use crate::{Error, Result};
use context::Fault;
use station::{Manner, Station};
use std::time::Instant;

/// How long a submission may take, s: a desktop's driver gives up after some seconds, and its user notices less.
const BUDGET: f64 = 0.05;
/// The shortest time that a submission is cut to after devices were lost, s.
const LEAST: f64 = 0.003;
/// How many devices may be lost in one call.
const RETRIES: u32 = 4;

/// Evaluates populations on a GPU.
pub struct GpuEvaluator {
    adapter: wgpu::Adapter,
    info: wgpu::AdapterInfo,
    manner: Manner,
    station: Station,
    loss: Loss,
    timings: Timings,
}

/// Where the time of a call went, s.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Composing and compiling shaders that were not known.
    pub compile: f64,
    /// Bringing data and candidates to the device, as far as the host does it.
    pub upload: f64,
    /// Bytes of records and tones that were not on the device.
    pub uploaded: u64,
    /// The submissions that integrate.
    pub kernel: f64,
    /// Whether the device's own clock timed these; otherwise the host's did.
    pub on_device: bool,
    /// How many they were.
    pub submissions: u32,
    /// The longest of them.
    pub longest: f64,
    /// From their end until the costs were there.
    pub readback: f64,
}

/// Devices that are lost on purpose, for tests.
#[derive(Debug, Default)]
struct Loss {
    after: u32,
    submissions: u32,
    times: u32,
}

impl Loss {
    /// Whether the device is lost before the submission that comes now.
    fn strikes(&mut self) -> bool {
        if self.times == 0 {
            return false;
        }
        self.submissions += 1;
        if self.submissions <= self.after {
            return false;
        }
        self.submissions = 0;
        self.times -= 1;
        true
    }
}

impl GpuEvaluator {
    /// An evaluator on `adapter`.
    ///
    /// # Errors
    /// If the adapter gives no device.
    pub fn new(adapter: &wgpu::Adapter, checks: Checks) -> Result<Self> {
        let limits = adapter.limits();
        Ok(Self {
            adapter: adapter.clone(),
            info: adapter.get_info(),
            manner: Manner {
                checks,
                workgroup: wgsl::WORKGROUP,
                largest: limits
                    .max_buffer_size
                    .min(limits.max_storage_buffer_binding_size),
                budget: BUDGET,
            },
            station: Station::open(adapter)?,
            loss: Loss::default(),
            timings: Timings::default(),
        })
    }

    /// Where the time of the last call went.
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Puts `count` invocations into a workgroup.
    ///
    /// # Errors
    /// If the adapter allows fewer.
    pub fn set_workgroup(&mut self, count: u32) -> Result<()> {
        let limits = self.adapter.limits();
        let most = limits
            .max_compute_invocations_per_workgroup
            .min(limits.max_compute_workgroup_size_x);
        if count > most {
            return Err(Error::failed(
                format!(
                    "{count} invocations in a workgroup, and \"{}\" has at most {most}",
                    self.info.name
                ),
                "use fewer",
            ));
        }
        self.manner.workgroup = count;
        Ok(())
    }

    /// Limits every buffer to `bytes`, so that populations are cut into smaller parts and records into windows.
    pub fn limit_buffers(&mut self, bytes: u64) {
        self.manner.largest = self.manner.largest.min(bytes);
        self.station.forget_data();
    }

    /// Limits every submission to about `seconds`, as far as its work can be cut.
    pub fn limit_submissions(&mut self, seconds: f64) {
        self.manner.budget = self.manner.budget.min(seconds);
    }

    /// Loses the device after `after` submissions, and so on until it was lost `times` times: how tests show what then
    /// happens.
    #[doc(hidden)]
    pub fn lose_device(&mut self, after: u32, times: u32) {
        self.loss = Loss {
            after,
            submissions: 0,
            times,
        };
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
        self.timings = Timings::default();
        let jobs = [Job {
            problem,
            population,
        }];
        let mut costs = self.evaluate(&jobs, &[source.to_owned()])?;
        Ok(costs.pop().expect("one list for one job"))
    }

    fn evaluate(&mut self, jobs: &[Job<'_>], sources: &[String]) -> Result<Vec<Vec<Cost>>> {
        let mut costs = vec![Vec::new(); jobs.len()];
        let mut lost = 0;
        for parts in wave::waves(jobs, sources, self.manner.largest)? {
            let found = loop {
                let (loss, timings) = (&mut self.loss, &mut self.timings);
                match self.station.run(&parts, self.manner, loss, timings) {
                    Ok(found) => break found,
                    Err(Fault::Final(error)) => return Err(error),
                    Err(Fault::Lost(what)) if lost == RETRIES => {
                        return Err(Error::failed(
                            format!("\"{}\" was lost again and again: {what}", self.info.name),
                            "use --evaluator cpu",
                        ));
                    }
                    Err(Fault::Lost(_)) => {
                        lost += 1;
                        // A driver loses a device most often because work took too long.
                        self.manner.budget = self
                            .manner
                            .budget
                            .min((0.5 * self.manner.budget).max(LEAST));
                        self.station = Station::open(&self.adapter)?;
                    }
                }
            };
            for (part, found) in parts.iter().zip(found) {
                costs[part.number].extend(found);
            }
        }
        self.timings.on_device = self.station.has_clock();
        Ok(costs)
    }
}

impl Evaluator for GpuEvaluator {
    fn describe(&self) -> String {
        describe(&self.info)
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let start = Instant::now();
        let source = |job: &Job<'_>| wgsl::compose_for(job.problem, self.manner.workgroup);
        let sources: Vec<String> = jobs.iter().map(source).collect();
        self.timings = Timings {
            compile: start.elapsed().as_secs_f64(),
            ..Timings::default()
        };
        self.evaluate(jobs, &sources)
    }
}
