//! What a GPU does with populations, stage by stage; `benches/gpu/run.sh` runs them all and says what they mean.
//!
//! Every stage prints a section in Markdown, and fails where costs are wrong.

mod diagnosis;
mod faults;
mod kernel;
mod large;
#[path = "../shared/memory.rs"]
mod memory;
mod parity;
mod rates;

use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{Cost, CpuEvaluator, Evaluator, Population, Precision, Problem};
use servobee::{Error, Result};
use std::path::Path;
use std::process::ExitCode;

/// How a stage is run.
struct Setting {
    adapter: wgpu::Adapter,
    /// With little work, for a GPU in software.
    small: bool,
}

impl Setting {
    fn evaluator(&self) -> Result<GpuEvaluator> {
        GpuEvaluator::new(&self.adapter, Checks::Off)
    }

    /// One of two numbers: for hardware, and with little work.
    fn pick<T>(&self, full: T, small: T) -> T {
        if self.small { small } else { full }
    }
}

fn main() -> ExitCode {
    let mut arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let small = arguments.iter().any(|argument| argument == "--small");
    arguments.retain(|argument| argument != "--small");
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match stage(&words, small) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gpu {}: {error}", words.join(" "));
            ExitCode::FAILURE
        }
    }
}

fn stage(words: &[&str], small: bool) -> Result<()> {
    let adapters = gpu::adapters();
    let adapter = gpu::best(&adapters).ok_or_else(gpu::none_found)?.clone();
    let setting = Setting { adapter, small };
    match words {
        ["adapter"] => adapter_section(&setting),
        ["parity"] => parity::stage(&setting)?,
        ["rates"] => rates::stage(&setting)?,
        ["large"] => large::stage(&setting)?,
        ["diagnosis", record] => diagnosis::stage(&setting, Path::new(record))?,
        ["faults"] => faults::stage(&setting)?,
        ["kernel"] => kernel::stage(&setting)?,
        ["work", file] => kernel::write_work(&setting, Path::new(file))?,
        _ => {
            return Err(Error::failed(
                "no such stage",
                "name one of adapter, parity, rates, large, diagnosis RECORD, faults, kernel, work FILE",
            ));
        }
    }
    Ok(())
}

fn adapter_section(setting: &Setting) {
    let (info, limits) = (setting.adapter.get_info(), setting.adapter.limits());
    let features = setting.adapter.features();
    let timestamps = features.contains(wgpu::Features::TIMESTAMP_QUERY);
    println!("| | |\n|---|---|");
    let row = |name: &str, value: String| println!("| {name} | {value} |");
    row("adapter", info.name.clone());
    row("driver", format!("{} {}", info.driver, info.driver_info));
    row("backend", info.backend.to_string());
    row("kind", gpu::kind(&info).into());
    row("timestamps", if timestamps { "yes" } else { "no" }.into());
    let mib = |bytes: u64| format!("{} MiB", bytes >> 20);
    row("largest buffer", mib(limits.max_buffer_size));
    row(
        "largest storage binding",
        mib(limits.max_storage_buffer_binding_size),
    );
    let invocations = limits.max_compute_invocations_per_workgroup;
    row("invocations a workgroup", invocations.to_string());
    let groups = limits.max_compute_workgroups_per_dimension;
    row("workgroups a dimension", groups.to_string());
    let (low, high) = (info.subgroup_min_size, info.subgroup_max_size);
    row("subgroup", format!("{low} to {high}"));
    let cpu = CpuEvaluator::new(Precision::F32).describe();
    row(
        "beside it",
        format!("{cpu}, {} threads", rayon::current_num_threads()),
    );
}

/// Costs on the CPU.
fn on_cpu(precision: Precision, problem: &Problem, population: &Population) -> Result<Vec<Cost>> {
    CpuEvaluator::new(precision).costs(problem, population)
}

/// Relative differences of two lists of costs, the smallest first.
fn differences(some: &[Cost], others: &[Cost]) -> Vec<f64> {
    let pairs = some.iter().zip(others);
    let mut all: Vec<f64> = pairs.map(|(a, b)| a.difference(b)).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// What `share` of sorted numbers are at most.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[(share * (sorted.len() - 1) as f64).round() as usize]
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}
