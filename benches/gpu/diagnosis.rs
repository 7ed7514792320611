//! Whole diagnoses on the GPU and on the CPU of the same machine.

use super::Setting;
use servobee::diagnose::{Cut, IdentificationProblem, Options, identify};
use servobee::evaluate::gpu::GpuEvaluator;
use servobee::evaluate::{Cost, CpuEvaluator, Evaluator, Job, Precision};
use servobee::model::effects::CATALOGUE;
use servobee::record::Record;
use servobee::scorecard::Plan as Scorecard;
use servobee::search::Plan;
use servobee::{Error, Result};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// A GPU whose work is added up.
struct Metered {
    inner: GpuEvaluator,
    calls: u32,
    candidates: usize,
    /// Seconds of all calls, of compiling, and of the kernels.
    seconds: [f64; 3],
}

impl Metered {
    fn new(inner: GpuEvaluator) -> Self {
        Self {
            inner,
            calls: 0,
            candidates: 0,
            seconds: [0.0; 3],
        }
    }
}

impl Evaluator for Metered {
    fn describe(&self) -> String {
        self.inner.describe()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let start = Instant::now();
        let costs = self.inner.costs_of(jobs)?;
        let timings = self.inner.timings();
        let spent = [
            start.elapsed().as_secs_f64(),
            timings.compile,
            timings.kernel,
        ];
        for (sum, seconds) in self.seconds.iter_mut().zip(spent) {
            *sum += seconds;
        }
        self.calls += 1;
        self.candidates += jobs.iter().map(|job| job.population.len()).sum::<usize>();
        Ok(costs)
    }
}

pub(crate) fn stage(setting: &Setting, record: &Path) -> Result<()> {
    occupancy(setting, record)?;
    scorecard(setting)
}

/// One diagnosis, and how busy the device is in it.
fn occupancy(setting: &Setting, path: &Path) -> Result<()> {
    let mut names = Vec::new();
    let mut metered = Metered::new(setting.evaluator()?);
    let mut cpu = CpuEvaluator::new(Precision::F32);
    let both: [(&str, &mut dyn Evaluator); 2] = [("GPU", &mut metered), ("CPU", &mut cpu)];
    println!(
        "### One diagnosis\n\n| on | rows | seconds | verdict | named |\n|---|---|---|---|---|"
    );
    for (name, evaluator) in both {
        let records = [Record::read(path, &[])?];
        let rows = records[0].samples();
        let problem = IdentificationProblem::of(&records, &[], Cut::default())?;
        let options = Options::on(&problem.structure, CATALOGUE, 4);
        let start = Instant::now();
        let plan = Plan::of_records(1);
        let found = identify(problem, evaluator, &plan, &options, &mut |_| {
            ControlFlow::Continue(())
        })?;
        let seconds = start.elapsed().as_secs_f64();
        let named: Vec<String> = found
            .added
            .iter()
            .map(|one| one.effect.to_string())
            .collect();
        println!(
            "| {name} | {rows} | {seconds:.2} | {:?} | {} |",
            found.verdict,
            named.join(" + ")
        );
        names.push((named, seconds));
    }
    let [whole, compile, kernel] = metered.seconds;
    let seconds = names[0].1;
    println!(
        "\nOf {seconds:.2} s with the GPU its kernels ran for {kernel:.3} s: it was busy for {:.1} % of the time. All \
         {} calls with {} candidates took {whole:.3} s, {compile:.3} s of them to compile.",
        100.0 * kernel / seconds,
        metered.calls,
        metered.candidates
    );
    agree(names[0].0 == names[1].0, "one diagnosis")
}

/// Some cases of the scorecard.
fn scorecard(setting: &Setting) -> Result<()> {
    println!("\n### Scorecard\n\n| case | GPU s | CPU s | GPU | CPU |\n|---|---|---|---|---|");
    let plan = Scorecard::default();
    let names = setting.pick(
        &[
            "null/1",
            "single/hysteresis/6x/1",
            "single/delay/6x/1",
            "single/friction/3x/1",
            "single/leakage/3x/1",
            "single/overlap/6x/1",
        ][..],
        &["single/delay/6x/1"],
    );
    let mut gpu = setting.evaluator()?;
    for name in names {
        let case = plan.case(name)?;
        let mut setup = case.setup(plan.seed)?;
        setup.seconds = setting.pick(setup.seconds, 2.0);
        let [on_gpu, on_cpu]: [_; 2] = {
            let mut cpu = CpuEvaluator::new(Precision::F32);
            [
                case.diagnose(&setup, &mut gpu)?.0,
                case.diagnose(&setup, &mut cpu)?.0,
            ]
        };
        println!(
            "| {name} | {:.2} | {:.2} | {:?} {} | {:?} {} |",
            on_gpu.seconds,
            on_cpu.seconds,
            on_gpu.outcome,
            on_gpu.named,
            on_cpu.outcome,
            on_cpu.named
        );
        agree(
            on_gpu.named == on_cpu.named && on_gpu.outcome == on_cpu.outcome,
            name,
        )?;
    }
    Ok(())
}

fn agree(same: bool, what: &str) -> Result<()> {
    match same {
        true => Ok(()),
        false => Err(Error::failed(
            format!("{what}: GPU and CPU do not name the same"),
            "report this",
        )),
    }
}
