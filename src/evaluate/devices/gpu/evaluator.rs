//! Costs of whole populations from a GPU, also where the device is lost or has too little memory in between.

use super::adapter::describe;
use super::batching::{Portion, next_batch};
use super::configuration::{Checks, Configuration};
use super::context::{Attempt, Fault, one_line};
use super::fault_injection::{FaultInjection, InjectedFault};
use super::session::Session;
use super::timings::Timings;
use super::{limits, loops};
use crate::evaluate::checking::warnings::Warnings;
use crate::evaluate::devices::wgsl;
use crate::evaluate::evaluator::{Evaluator, Job};
use crate::evaluate::order::side_by_side;
use crate::evaluate::population::{Cost, Population};
use crate::evaluate::problem::Problem;
use crate::evaluate::problem::identity::ShaderIdentity;
use crate::{Error, Result};
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a submission may take, s: a desktop's driver gives up after some seconds, and its user notices less.
const SUBMISSION: f64 = 0.05;
/// The shortest time that submissions are limited to after devices were lost, s.
const SHORTEST_SUBMISSION: f64 = 0.003;
/// How many devices may be lost in one call.
const MOST_LOST: u32 = 4;
/// How long a submission of some 50 ms may take before the device counts as hung.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Rows from which on candidates are sorted. On an H100 beside sixteen cores it pays from 60 000 on, on slower ones earlier.
const LEAST_ROWS_TO_SORT: usize = 16_384;
/// About how many bytes of results, states and data a batch has.
pub(super) const BATCH: u64 = 256 << 20;

/// Evaluates populations on a GPU.
pub struct GpuEvaluator {
    adapter: wgpu::Adapter,
    info: wgpu::AdapterInfo,
    configuration: Configuration,
    /// None after the device has failed.
    session: Option<Session>,
    /// The composed shaders, each for a number of invocations in a workgroup.
    shaders: HashMap<(ShaderIdentity, u32), Arc<str>>,
    warnings: Warnings,
    injection: FaultInjection,
    timings: Timings,
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
            configuration: Configuration {
                checks,
                workgroup: limits::workgroup(&limits),
                largest_buffer: limits::largest_buffer(&limits),
                limited_loops: loops::limited(&info),
                batch: BATCH,
                submission: SUBMISSION,
                timeout: TIMEOUT,
            },
            info,
            session: Some(Session::open(adapter)?),
            shaders: HashMap::new(),
            warnings: Warnings::default(),
            injection: FaultInjection::default(),
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
        self.configuration.workgroup = count;
        Ok(())
    }

    /// Limits every buffer to `bytes`, so that populations are cut into smaller portions and records into windows.
    pub fn limit_buffers(&mut self, bytes: u64) {
        self.configuration.largest_buffer = self.configuration.largest_buffer.min(bytes);
        if let Some(session) = &mut self.session {
            session.forget_data();
        }
    }

    /// Limits every submission to about `seconds`, as far as its work can be cut.
    pub fn limit_submissions(&mut self, seconds: f64) {
        self.configuration.submission = self.configuration.submission.min(seconds);
    }

    /// Takes a device that has not answered for `timeout` as hung.
    pub fn limit_timeout(&mut self, timeout: Duration) {
        self.configuration.timeout = self.configuration.timeout.min(timeout);
    }

    /// Has the device fail with `fault` when it could for the time that follows `after` others, and so on until it has
    /// failed `times` times: how tests show what then happens.
    #[doc(hidden)]
    pub fn inject(&mut self, fault: InjectedFault, after: u32, times: u32) {
        self.injection = FaultInjection::new(fault, after, times);
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
        let own = self.configuration.checks;
        self.configuration.checks = Checks::On;
        let costs = self.evaluate(&jobs, &[source.into()]);
        self.configuration.checks = own;
        Ok(costs?.pop().expect("one list for one job"))
    }

    /// The shader that evaluates `problem`.
    fn shader(&mut self, problem: &Problem) -> Arc<str> {
        let workgroup = self.configuration.workgroup;
        let key = (ShaderIdentity::of(problem), workgroup);
        let compose = || wgsl::compose_for(problem, workgroup).into();
        self.shaders.entry(key).or_insert_with(compose).clone()
    }

    fn evaluate(&mut self, jobs: &[Job<'_>], sources: &[Arc<str>]) -> Result<Vec<Vec<Cost>>> {
        let mut costs = vec![Vec::new(); jobs.len()];
        let mut lost = 0;
        loop {
            let done = costs.iter().map(Vec::len);
            let batch = next_batch(jobs, sources, done, self.configuration)?;
            if batch.is_empty() {
                break;
            }
            match self.run(&batch) {
                Ok(found) => {
                    for (portion, found) in batch.iter().zip(found) {
                        costs[portion.number].extend(found);
                    }
                }
                Err(fault) => self.recover(fault, &mut lost)?,
            }
        }
        self.timings.on_device = self.session.as_ref().is_some_and(Session::has_clock);
        Ok(costs)
    }

    fn run(&mut self, batch: &[Portion]) -> Attempt<Vec<Vec<Cost>>> {
        let session = match &mut self.session {
            Some(session) => session,
            none => none.insert(Session::open(&self.adapter)?),
        };
        session.run(
            batch,
            self.configuration,
            &mut self.injection,
            &mut self.timings,
        )
    }

    /// Prepares another attempt after `fault`, where `lost` devices were lost before.
    ///
    /// # Errors
    /// If there is none that could do better.
    fn recover(&mut self, fault: Fault, lost: &mut u32) -> Result<()> {
        let name = &self.info.name;
        let Configuration {
            batch, submission, ..
        } = self.configuration;
        match fault {
            // The device works.
            Fault::Final(_) => {}
            // To drop the device would be to wait for it for ever.
            Fault::Hung(_) => std::mem::forget(self.session.take()),
            Fault::Full | Fault::Lost(_) => {
                let session = self.session.take();
                // wgpu panics where it cannot wait for a device that is dropped.
                let _ = catch_unwind(AssertUnwindSafe(|| drop(session)));
            }
        }
        match fault {
            Fault::Final(error) => Err(error),
            Fault::Hung(timeout) => Err(Error::failed(
                format!("the GPU \"{name}\" has not answered for {timeout:?}"),
                "update its driver, or use --evaluator cpu",
            )),
            Fault::Full if batch / 2 < limits::LEAST_BUFFER => Err(Error::failed(
                format!("the GPU \"{name}\" has no memory left"),
                "close what else uses it, or use --evaluator cpu",
            )),
            Fault::Full => {
                self.configuration.batch = batch / 2;
                let largest = self.configuration.largest_buffer.min(batch / 2);
                self.configuration.largest_buffer = largest;
                self.warnings.add(format!(
                    "the GPU \"{name}\" has too little memory; going on with at most {} MiB at once",
                    self.configuration.batch >> 20
                ));
                Ok(())
            }
            Fault::Lost(what) if *lost == MOST_LOST => Err(Error::failed(
                format!(
                    "the GPU \"{name}\" was lost again and again: {}",
                    one_line(&what)
                ),
                "use --evaluator cpu",
            )),
            Fault::Lost(_) => {
                *lost += 1;
                // A driver loses a device most often because work took too long.
                let shorter = (0.5 * submission).max(SHORTEST_SUBMISSION);
                self.configuration.submission = submission.min(shorter);
                self.warnings.add(format!(
                    "the GPU \"{name}\" was lost; going on with it anew, in shorter submissions"
                ));
                Ok(())
            }
        }
    }
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
        side_by_side(jobs, LEAST_ROWS_TO_SORT, |jobs| {
            self.evaluate(jobs, &sources)
        })
    }

    fn take_warnings(&mut self) -> Vec<String> {
        self.warnings.take()
    }
}
