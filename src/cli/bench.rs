//! `servobee bench`.

mod phases;
mod workgroups;

use super::ranks;
use super::table::table;
use indicatif::{ProgressBar, ProgressStyle};
use phases::Phases;
use serde::Serialize;
use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{
    Choice, Cost, CpuEvaluator, Devices, Evaluator, PARITY, Population, Precision, Problem,
    workload,
};
use servobee::{Error, Result};
use std::time::{Duration, Instant};

/// Population sizes that are timed.
const SIZES: [usize; 7] = [64, 256, 1024, 4096, 16_384, 65_536, 262_144];
/// Candidates that all evaluators must agree about before any is timed, and the samples they are compared on: few,
/// because lightly damped candidates in saturation are chaotic and in time make any rounding large.
const CHECKED: (usize, usize) = (1024, 200);
/// Runs of one size at most, so that time is left for the larger ones.
const MOST_RUNS: usize = 7;

/// Measures how fast this machine's CPU and GPUs integrate candidates
///
/// Every evaluator first has to agree with the CPU in f64 on 1024 candidates. Then populations of 64 to 262144
/// candidates of the base model are timed, as often as the time allows, and the median counts. A size that would not
/// fit into the time is left out. A GPU is measured with and without the driver's checks of loops and indices; runs
/// compute without. Under mpirun all ranks are measured as one, and the bytes that go to and from the first one.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee bench
  servobee bench --evaluator gpu --seconds 60 --json > bench.json
  servobee bench --workgroups")]
pub(super) struct Arguments {
    /// What to measure; a GPU may also be one in software
    #[arg(long, value_enum, default_value = "all")]
    evaluator: Which,
    /// Time for the whole of it, about
    #[arg(long, default_value_t = 45.0, value_name = "S", value_parser = seconds)]
    seconds: f64,
    /// Samples of the record at 1 kHz, from 100 to 1000000
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    samples: u32,
    /// Try GPU workgroups of several sizes instead
    #[arg(long, conflicts_with = "evaluator")]
    workgroups: bool,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    All,
    Cpu,
    Gpu,
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 86_400.0 => Ok(value),
        _ => Err("a number of seconds above 0, at most a day".into()),
    }
}

/// What is printed.
#[derive(Serialize)]
struct Report {
    schema: &'static str,
    samples: u32,
    steps_per_candidate: u64,
    evaluators: Vec<Measured>,
}

/// One evaluator's results.
#[derive(Serialize)]
struct Measured {
    name: String,
    on_gpu: bool,
    /// Whether the driver checks loops and indices.
    checked: bool,
    /// Largest relative difference from the costs of the CPU in f64.
    disagreement: f64,
    results: Vec<Timing>,
    /// Where a GPU's time goes.
    phases: Vec<Phases>,
}

#[derive(Serialize)]
struct Timing {
    population: usize,
    runs: usize,
    /// Median of the runs.
    seconds: f64,
    candidate_steps_per_second: f64,
    /// Bytes that went to other processes and came from them, in the first run and in each later one.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<[u64; 2]>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let problem = workload::actuator(arguments.samples as usize);
    let seconds = Duration::from_secs_f64(arguments.seconds);
    if arguments.workgroups {
        return workgroups::run(&problem, seconds, arguments.json);
    }
    let contestants = contestants(arguments.evaluator)?;
    let steps_per_candidate = problem.steps();
    let (size, samples) = CHECKED;
    let short = workload::actuator(samples);
    let few = workload::population(&short, size);
    let reference = CpuEvaluator::new(Precision::F64).costs(&short, &few)?;
    // Hidden by itself where stderr is no terminal.
    let bar = ProgressBar::new((contestants.len() * SIZES.len()) as u64).with_style(style());
    let share = seconds / contestants.len() as u32;
    let mut measured = Vec::new();
    for contestant in &contestants {
        let mut evaluator = contestant.evaluator()?;
        let name = contestant.name(&*evaluator);
        bar.set_message(name.clone());
        let costs = evaluator.costs(&short, &few)?;
        let disagreement = disagreement(&name, &costs, &reference)?;
        let results = measure(&mut *evaluator, &problem, share, &bar)?;
        let largest = results.last().map_or(0, |timing| timing.population);
        let phases = match contestant {
            Contestant::Cpu(_) | Contestant::Ranks(_) => Vec::new(),
            Contestant::Gpu(adapter, checks) => {
                let population = workload::population(&problem, largest.min(phases::POPULATION));
                phases::phases(GpuEvaluator::new(adapter, *checks)?, &problem, &population)?
            }
        };
        measured.push(Measured {
            name,
            on_gpu: matches!(contestant, Contestant::Gpu(..)),
            checked: matches!(contestant, Contestant::Gpu(_, Checks::On)),
            disagreement,
            results,
            phases,
        });
    }
    bar.finish_and_clear();
    let report = Report {
        schema: "servobee/bench/1",
        samples: arguments.samples,
        steps_per_candidate,
        evaluators: measured,
    };
    if arguments.json {
        let text = serde_json::to_string_pretty(&report).expect("a report is JSON");
        tell!("{text}");
    } else {
        print(&report);
    }
    Ok(())
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").expect("a template that parses")
}

/// What is measured.
enum Contestant {
    Cpu(Precision),
    Gpu(wgpu::Adapter, Checks),
    Ranks(Devices),
}

impl Contestant {
    fn evaluator(&self) -> Result<Box<dyn Evaluator>> {
        Ok(match self {
            Self::Cpu(precision) => Box::new(CpuEvaluator::new(*precision)),
            Self::Gpu(adapter, checks) => Box::new(GpuEvaluator::new(adapter, *checks)?),
            Self::Ranks(devices) => ranks::choose(devices)?.evaluator,
        })
    }

    fn name(&self, evaluator: &dyn Evaluator) -> String {
        let checked = match self {
            Self::Gpu(_, Checks::On) => ", checked",
            _ => "",
        };
        evaluator.describe() + checked
    }
}

/// All that `which` names.
fn contestants(which: Which) -> Result<Vec<Contestant>> {
    if ranks::bytes().is_some() {
        let choice = match which {
            Which::All => Choice::Auto,
            Which::Cpu => Choice::Cpu,
            Which::Gpu => Choice::Gpu,
        };
        return Ok(vec![Contestant::Ranks(Devices::Named(vec![choice]))]);
    }
    let mut list = Vec::new();
    if which != Which::Gpu {
        list.extend([Precision::F64, Precision::F32].map(Contestant::Cpu));
    }
    if which != Which::Cpu {
        for adapter in gpu::adapters() {
            list.extend(
                [Checks::Off, Checks::On].map(|checks| Contestant::Gpu(adapter.clone(), checks)),
            );
        }
    }
    if list.is_empty() {
        return Err(gpu::none_found());
    }
    Ok(list)
}

/// The largest relative difference between two lists of costs.
///
/// # Errors
/// It is above [`PARITY`], or a candidate diverged in one list alone.
fn disagreement(name: &str, costs: &[Cost], reference: &[Cost]) -> Result<f64> {
    let largest = costs
        .iter()
        .zip(reference)
        .map(|(cost, expected)| cost.difference(expected))
        .fold(0.0, f64::max);
    if largest <= PARITY {
        return Ok(largest);
    }
    Err(Error::failed(
        format!("{name} computes costs that differ from the CPU's in f64 by {largest:.1e} of them"),
        "update its driver, and do not use it until then",
    ))
}

/// Times all sizes within about `share`: an equal part of what is left for each size.
fn measure(
    evaluator: &mut dyn Evaluator,
    problem: &Problem,
    share: Duration,
    bar: &ProgressBar,
) -> Result<Vec<Timing>> {
    let start = Instant::now();
    let largest = workload::population(problem, SIZES[SIZES.len() - 1]);
    let mut results: Vec<Timing> = Vec::new();
    for (i, size) in SIZES.into_iter().enumerate() {
        let left = share.saturating_sub(start.elapsed());
        let expected = results.last().map_or(0.0, |last| {
            last.seconds * size as f64 / last.population as f64
        });
        if expected > left.as_secs_f64() {
            break;
        }
        let mut population = Population::new(largest.dimension());
        largest
            .iter()
            .take(size)
            .for_each(|candidate| population.push(candidate));
        let budget = left / (SIZES.len() - i) as u32;
        results.push(time(evaluator, problem, &population, budget)?);
        bar.inc(1);
    }
    Ok(results)
}

/// The median of as many runs as `budget` allows, one at least.
fn time(
    evaluator: &mut dyn Evaluator,
    problem: &Problem,
    population: &Population,
    budget: Duration,
) -> Result<Timing> {
    let start = Instant::now();
    let mut runs = Vec::new();
    let mut bytes: Vec<u64> = Vec::new();
    while runs.is_empty() || (runs.len() < MOST_RUNS && start.elapsed() < budget) {
        let (start, before) = (Instant::now(), ranks::bytes());
        evaluator.costs(problem, population)?;
        runs.push(start.elapsed().as_secs_f64());
        bytes.extend(ranks::bytes().zip(before).map(|(now, before)| now - before));
    }
    let bytes = bytes
        .first()
        .copied()
        .zip(bytes.last().copied())
        .map(<[u64; 2]>::from);
    runs.sort_by(f64::total_cmp);
    let seconds = runs[runs.len() / 2];
    let steps = problem.steps() as f64 * population.len() as f64;
    Ok(Timing {
        population: population.len(),
        runs: runs.len(),
        seconds,
        candidate_steps_per_second: steps / seconds,
        bytes,
    })
}

fn print(report: &Report) {
    tell!(
        "Million candidate-steps per second; base model, {} samples, {} steps per candidate.\n",
        report.samples,
        report.steps_per_candidate
    );
    for (i, measured) in report.evaluators.iter().enumerate() {
        let (number, name, difference) = (i + 1, &measured.name, measured.disagreement);
        tell!("[{number}] {name}, costs within {difference:.1e} of the CPU's in f64");
    }
    tell!();
    let rate = |measured: &Measured, size: usize| {
        let timing = measured.results.iter().find(|r| r.population == size)?;
        Some(timing.candidate_steps_per_second / 1e6)
    };
    let best = |on_gpu, size: usize| {
        let own = report.evaluators.iter().filter(|m| m.on_gpu == on_gpu);
        own.filter_map(|measured| rate(measured, size))
            .reduce(f64::max)
    };
    let number = |value: Option<f64>, decimals| {
        value.map_or("-".into(), |value| format!("{value:.decimals$}"))
    };
    let numbers = 1..=report.evaluators.len();
    let mut head = vec!["population".to_string()];
    head.extend(numbers.map(|i| format!("[{i}]")));
    head.push("GPU/CPU".into());
    let row = |size: usize| {
        let rates = report.evaluators.iter().map(|m| number(rate(m, size), 0));
        let ratio = best(true, size)
            .zip(best(false, size))
            .map(|(gpu, cpu)| gpu / cpu);
        let mut row = vec![size.to_string()];
        row.extend(rates);
        row.push(number(ratio, 2));
        row
    };
    tell!("{}", table(&head, SIZES.map(row)));
    tell!("\nGPU/CPU: the fastest GPU over the fastest on the CPU. -: not measured.");
    let numbered = report.evaluators.iter().zip(1..);
    phases::print(numbered.flat_map(|(m, number)| m.phases.iter().map(move |one| (number, one))));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_that_differ_are_refused() {
        let costs = |factor: f64| [1.0, 7.0].map(|value| Cost::finished(value * factor));
        assert_eq!(disagreement("x", &costs(1.0), &costs(1.0)).unwrap(), 0.0);
        assert!(disagreement("x", &costs(1.00002), &costs(1.0)).unwrap() > 1e-5);
        let error = disagreement("x", &costs(1.0002), &costs(1.0)).unwrap_err();
        assert_eq!(error.exit_code(), 1);
        let diverged = [Cost::finished(1.0), Cost::DIVERGED];
        assert!(disagreement("x", &diverged, &costs(1.0)).is_err());
        assert!(disagreement("x", &diverged, &diverged).is_ok());
    }
}
