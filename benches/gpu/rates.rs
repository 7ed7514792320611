//! Candidates and rows a second.

use super::{Setting, median};
use servobee::Result;
use servobee::evaluate::gpu::{GpuEvaluator, Timings};
use servobee::evaluate::{CpuEvaluator, Evaluator, Population, Precision, Problem, workload};
use servobee::model::effects::CATALOGUE;
use std::time::Instant;

/// Coherent candidates lie within this share of every parameter's range.
const NEAR: f64 = 0.01;
/// Workgroups that are tried.
const WORKGROUPS: [u32; 6] = [32, 64, 128, 256, 512, 1024];

/// One case, measured.
struct Measured {
    /// The whole call, s.
    seconds: f64,
    /// Where the time of the last call went.
    timings: Timings,
}

impl Measured {
    /// Of some runs after a first, which compiles.
    fn of(
        evaluator: &mut GpuEvaluator,
        problem: &Problem,
        population: &Population,
        budget: f64,
    ) -> Result<Self> {
        evaluator.costs(problem, population)?;
        let begin = Instant::now();
        let mut runs = Vec::new();
        while runs.is_empty() || (runs.len() < 9 && begin.elapsed().as_secs_f64() < budget) {
            let start = Instant::now();
            evaluator.costs(problem, population)?;
            runs.push(start.elapsed().as_secs_f64());
        }
        Ok(Self {
            seconds: median(runs),
            timings: evaluator.timings(),
        })
    }
}

/// Candidates near each other, so that all do the same at a row: a late generation.
fn coherent(problem: &Problem, size: usize) -> Population {
    let spread = workload::population(problem, size);
    let free = problem.free();
    let mut near = Population::new(spread.dimension());
    for candidate in spread.iter() {
        let moved = free.iter().zip(candidate).map(|(parameter, value)| {
            let middle = parameter.to_unit(parameter.nominal());
            parameter.from_unit(middle + NEAR * (parameter.to_unit(*value) - 0.5))
        });
        near.push(&moved.collect::<Vec<_>>());
    }
    near
}

pub(crate) fn stage(setting: &Setting) -> Result<()> {
    sizes(setting)?;
    structures(setting)?;
    workgroups(setting)?;
    first_call(setting)
}

/// Populations and rows of the base model, and one of them on the CPU.
fn sizes(setting: &Setting) -> Result<()> {
    let budget = setting.pick(1.0, 0.05);
    let limit = setting.pick(6.0, 0.5);
    let populations = setting.pick(
        &[1_000, 10_000, 100_000, 1_000_000, 10_000_000][..],
        &[100, 1000],
    );
    let lengths = setting.pick(&[1_000, 10_000, 100_000][..], &[100, 1000]);
    println!("\n### Base model\n");
    println!(
        "Spread: candidates anywhere inside the bounds. Near: within {} % of the bounds' range. The kernel's time is the \
         device's own where it has a clock.\n",
        100.0 * NEAR
    );
    println!(
        "| candidates | population | rows | candidates/s | rows/s | rows/s in the kernel | upload ms | kernel ms | readback ms | submissions |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut evaluator = setting.evaluator()?;
    type Draw = fn(&Problem, usize) -> Population;
    let kinds: [(&str, Draw); 2] = [("spread", workload::population), ("near", coherent)];
    for (kind, draw) in kinds {
        for &rows in lengths {
            let problem = workload::actuator(rows);
            let mut rate: Option<f64> = None;
            for &size in populations {
                let work = size as f64 * rows as f64;
                if rate.is_some_and(|rate| work / rate > limit) {
                    println!(
                        "| {kind} | {size} | {rows} | not run: more than {limit} s | | | | | | |"
                    );
                    continue;
                }
                let population = draw(&problem, size);
                let measured = Measured::of(&mut evaluator, &problem, &population, budget)?;
                rate = Some(work / measured.seconds);
                println!(
                    "| {kind} | {size} | {rows} | {} |",
                    row(&measured, size, work)
                );
            }
        }
    }
    let (size, rows) = setting.pick((100_000, 1000), (1000, 100));
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    for precision in [Precision::F32, Precision::F64] {
        let mut cpu = CpuEvaluator::new(precision);
        cpu.costs(&problem, &population)?;
        let start = Instant::now();
        cpu.costs(&problem, &population)?;
        let seconds = start.elapsed().as_secs_f64();
        let rate = size as f64 / seconds;
        println!(
            "\n{}: {rate:.3e} candidates/s, {:.3e} rows/s on {size} candidates and {rows} rows.",
            cpu.describe(),
            rate * rows as f64
        );
    }
    Ok(())
}

fn row(measured: &Measured, size: usize, work: f64) -> String {
    let Measured { seconds, timings } = measured;
    format!(
        "{:.3e} | {:.3e} | {:.3e} | {:.2} | {:.2} | {:.2} | {}",
        size as f64 / seconds,
        work / seconds,
        work / timings.kernel,
        1e3 * timings.upload,
        1e3 * timings.kernel,
        1e3 * timings.readback,
        timings.submissions,
    )
}

/// The valve, and every effect of the catalogue on it.
fn structures(setting: &Setting) -> Result<()> {
    let (size, rows) = setting.pick((100_000, 1000), (64, 100));
    println!("\n### Structures\n\n{size} candidates anywhere inside the bounds, {rows} rows.\n");
    println!(
        "| structure | exact steps | steps a candidate | rows/s | rows/s in the kernel | compile ms |"
    );
    println!("|---|---|---|---|---|---|");
    let mut problems = vec![
        ("actuator".to_string(), workload::actuator(rows)),
        (
            "actuator and valve".into(),
            workload::actuator_and_valve(rows),
        ),
    ];
    problems.extend(CATALOGUE.iter().map(|entry| {
        let problem = workload::with_effects(&[entry.name], rows);
        (format!("with {}", entry.name), problem)
    }));
    for (name, problem) in problems {
        let population = workload::population(&problem, size);
        let mut evaluator = setting.evaluator()?;
        evaluator.costs(&problem, &population)?;
        let compile = evaluator.timings().compile;
        let measured = Measured::of(
            &mut evaluator,
            &problem,
            &population,
            setting.pick(0.5, 0.0),
        )?;
        let work = (size * rows) as f64;
        println!(
            "| {name} | {} | {} | {:.3e} | {:.3e} | {:.1} |",
            if problem.has_exact_steps() {
                "yes"
            } else {
                "no"
            },
            problem.steps(),
            work / measured.seconds,
            work / measured.timings.kernel,
            1e3 * compile,
        );
    }
    Ok(())
}

fn workgroups(setting: &Setting) -> Result<()> {
    let (size, rows) = setting.pick((1_000_000, 1000), (1024, 100));
    println!("\n### Workgroups\n\nThe base model, {size} candidates, {rows} rows.\n");
    println!("| invocations | rows/s in the kernel |\n|---|---|");
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    for count in WORKGROUPS {
        let mut evaluator = setting.evaluator()?;
        if evaluator.set_workgroup(count).is_err() {
            break;
        }
        let measured = Measured::of(
            &mut evaluator,
            &problem,
            &population,
            setting.pick(0.5, 0.0),
        )?;
        println!(
            "| {count} | {:.3e} |",
            (size * rows) as f64 / measured.timings.kernel
        );
    }
    Ok(())
}

/// A first call beside the next.
fn first_call(setting: &Setting) -> Result<()> {
    let (size, rows) = setting.pick((100_000, 1000), (1024, 100));
    println!("\n### First call\n\nThe base model, {size} candidates, {rows} rows; ms.\n");
    println!(
        "| call | whole | compile | upload | kernel | readback | clock |\n|---|---|---|---|---|---|---|"
    );
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    let mut evaluator = setting.evaluator()?;
    for call in ["first", "next"] {
        let start = Instant::now();
        evaluator.costs(&problem, &population)?;
        let whole = start.elapsed().as_secs_f64();
        let timings = evaluator.timings();
        let numbers = [
            whole,
            timings.compile,
            timings.upload,
            timings.kernel,
            timings.readback,
        ];
        let numbers = numbers.map(|seconds| format!("{:.2}", 1e3 * seconds));
        let clock = if timings.on_device { "device" } else { "host" };
        println!("| {call} | {} | {clock} |", numbers.join(" | "));
    }
    Ok(())
}
