//! The GPU evaluator: one invocation a candidate and record, or a candidate and tone.

mod adapter;
mod clock;
mod context;
pub mod layout;
mod limits;
mod loops;
mod mishap;
mod pace;
mod pipeline;
mod pool;
mod ready;
mod resident;
mod station;
mod submitter;
mod wave;

pub use adapter::{adapters, best, describe, is_software, kind, none_found, ranked};
#[doc(hidden)]
pub use mishap::Mishap;
pub use pipeline::Checks;

use super::warnings::Warnings;
use super::{Cost, Evaluator, Job, Population, Problem, wgsl};
use crate::{Error, Result};
use context::{Attempt, Fault};
use mishap::Mishaps;
use station::{Manner, Station};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};
use wave::Part;

/// How long a submission may take, s: a desktop's driver gives up after some seconds, and its user notices less.
const BUDGET: f64 = 0.05;
/// The shortest time that a submission is cut to after devices were lost, s.
const LEAST: f64 = 0.003;
/// How many devices may be lost in one call.
const RETRIES: u32 = 4;
/// How long a submission of some 50 ms may take before the device counts as hung.
const PATIENCE: Duration = Duration::from_secs(60);
/// Bytes of results, states and data that are on a device together, about.
const WAVE: u64 = 256 << 20;

/// Evaluates populations on a GPU.
pub struct GpuEvaluator {
    adapter: wgpu::Adapter,
    info: wgpu::AdapterInfo,
    manner: Manner,
    /// None after a device that has failed.
    station: Option<Station>,
    /// The composed shaders, by [`wgsl::identity`].
    shaders: HashMap<String, Arc<str>>,
    warnings: Warnings,
    mishaps: Mishaps,
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

impl GpuEvaluator {
    /// An evaluator on `adapter`.
    ///
    /// # Errors
    /// If the adapter's limits are too low, or it gives no device.
    pub fn new(adapter: &wgpu::Adapter, checks: Checks) -> Result<Self> {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        let missing = limits::missing(&limits);
        if !missing.is_empty() {
            return Err(Error::failed(
                format!("adapter \"{}\" has {}", info.name, missing.join(", ")),
                "use --evaluator cpu",
            ));
        }
        Ok(Self {
            adapter: adapter.clone(),
            manner: Manner {
                checks,
                workgroup: limits::workgroup(&limits),
                largest: limits::largest_buffer(&limits),
                limited_loops: loops::limited(&info),
                wave: WAVE,
                budget: BUDGET,
                patience: PATIENCE,
            },
            info,
            station: Some(Station::open(adapter)?),
            shaders: HashMap::new(),
            warnings: Warnings::default(),
            mishaps: Mishaps::default(),
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
        let most = limits::most_invocations(&self.adapter.limits());
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
        if let Some(station) = &mut self.station {
            station.forget_data();
        }
    }

    /// Limits every submission to about `seconds`, as far as its work can be cut.
    pub fn limit_submissions(&mut self, seconds: f64) {
        self.manner.budget = self.manner.budget.min(seconds);
    }

    /// Takes a device that has not answered for `patience` as hung.
    pub fn limit_patience(&mut self, patience: Duration) {
        self.manner.patience = self.manner.patience.min(patience);
    }

    /// Lets `mishap` come at the occasion for it that follows `after` others, and so on until it has come `times` times:
    /// how tests show what then happens.
    #[doc(hidden)]
    pub fn let_fail(&mut self, mishap: Mishap, after: u32, times: u32) {
        self.mishaps = Mishaps::plan(mishap, after, times);
    }

    /// The costs under a shader of the caller's instead of the composed one: how tests show that a wrong shader is
    /// caught. It always runs with the driver's checks: only what this crate has composed is known to stay inside its
    /// buffers.
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
        let own = self.manner.checks;
        self.manner.checks = Checks::On;
        let costs = self.evaluate(&jobs, &[source.into()]);
        self.manner.checks = own;
        Ok(costs?.pop().expect("one list for one job"))
    }

    /// The shader that evaluates `problem`.
    fn shader(&mut self, problem: &Problem) -> Arc<str> {
        let workgroup = self.manner.workgroup;
        let identity = wgsl::identity(problem, workgroup);
        let compose = || wgsl::compose_for(problem, workgroup).into();
        self.shaders.entry(identity).or_insert_with(compose).clone()
    }

    fn evaluate(&mut self, jobs: &[Job<'_>], sources: &[Arc<str>]) -> Result<Vec<Vec<Cost>>> {
        let mut costs = vec![Vec::new(); jobs.len()];
        let mut lost = 0;
        loop {
            let parts = wave::next(jobs, sources, costs.iter().map(Vec::len), self.manner)?;
            if parts.is_empty() {
                break;
            }
            match self.run(&parts) {
                Ok(found) => {
                    for (part, found) in parts.iter().zip(found) {
                        costs[part.number].extend(found);
                    }
                }
                Err(fault) => self.recover(fault, &mut lost)?,
            }
        }
        self.timings.on_device = self.station.as_ref().is_some_and(Station::has_clock);
        Ok(costs)
    }

    fn run(&mut self, parts: &[Part]) -> Attempt<Vec<Vec<Cost>>> {
        let station = match &mut self.station {
            Some(station) => station,
            none => none.insert(Station::open(&self.adapter)?),
        };
        station.run(parts, self.manner, &mut self.mishaps, &mut self.timings)
    }

    /// Prepares another attempt after `fault`, where `lost` devices were lost before.
    ///
    /// # Errors
    /// If there is none that could do better.
    fn recover(&mut self, fault: Fault, lost: &mut u32) -> Result<()> {
        let name = &self.info.name;
        let Manner { wave, budget, .. } = self.manner;
        match fault {
            // The device works.
            Fault::Final(_) => {}
            // To drop it would be to wait for it, without end.
            Fault::Hung(_) => std::mem::forget(self.station.take()),
            Fault::Full | Fault::Lost(_) => {
                let station = self.station.take();
                // wgpu panics where it cannot wait for a device that is dropped.
                let _ = catch_unwind(AssertUnwindSafe(|| drop(station)));
            }
        }
        match fault {
            Fault::Final(error) => Err(error),
            Fault::Hung(patience) => Err(Error::failed(
                format!("the GPU \"{name}\" has not answered for {patience:?}"),
                "update its driver, or use --evaluator cpu",
            )),
            Fault::Full if wave / 2 < limits::LEAST_BUFFER => Err(Error::failed(
                format!("the GPU \"{name}\" has no memory left"),
                "close what else uses it, or use --evaluator cpu",
            )),
            Fault::Full => {
                self.manner.wave = wave / 2;
                self.manner.largest = self.manner.largest.min(wave / 2);
                self.warnings.add(format!(
                    "the GPU \"{name}\" has too little memory; going on with at most {} MiB at once",
                    self.manner.wave >> 20
                ));
                Ok(())
            }
            Fault::Lost(what) if *lost == RETRIES => Err(Error::failed(
                format!(
                    "the GPU \"{name}\" was lost again and again: {}",
                    one_line(&what)
                ),
                "use --evaluator cpu",
            )),
            Fault::Lost(_) => {
                *lost += 1;
                // A driver loses a device most often because work took too long.
                self.manner.budget = budget.min((0.5 * budget).max(LEAST));
                self.warnings.add(format!(
                    "the GPU \"{name}\" was lost; going on with it anew, in shorter submissions"
                ));
                Ok(())
            }
        }
    }
}

/// A driver's message without its line breaks.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Evaluator for GpuEvaluator {
    fn describe(&self) -> String {
        describe(&self.info)
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let start = Instant::now();
        let sources: Vec<Arc<str>> = jobs.iter().map(|job| self.shader(job.problem)).collect();
        self.timings = Timings {
            compile: start.elapsed().as_secs_f64(),
            ..Timings::default()
        };
        self.evaluate(jobs, &sources)
    }

    fn take_warnings(&mut self) -> Vec<String> {
        self.warnings.take()
    }
}
