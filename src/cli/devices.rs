//! `servobee devices`.

use super::table::table;
use serde_json::{Map, Value, json};
use servobee::Result;
use servobee::evaluate::{Choice, CpuEvaluator, Evaluator, Precision, choose, gpu};

/// Lists what this machine can evaluate populations on, and which of it is used
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee devices
  WGPU_BACKEND=vulkan servobee devices")]
pub(super) struct Arguments {
    /// Print them as JSON
    #[arg(long)]
    json: bool,
}

/// What is said of an adapter.
const HEADS: [&str; 10] = [
    "adapter",
    "evaluator",
    "backend",
    "kind",
    "driver",
    "largest buffer",
    "largest storage binding",
    "invocations a workgroup",
    "subgroup size",
    "timestamp queries",
];

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let cpu = CpuEvaluator::new(Precision::F32).describe();
    let adapters = gpu::adapters();
    if arguments.json {
        let adapter = |adapter: (usize, &wgpu::Adapter)| -> Map<String, Value> {
            let names = HEADS.map(|head| head.replace(' ', "_"));
            names
                .into_iter()
                .zip(properties(adapter).map(Value::from))
                .collect()
        };
        let chosen = choose(Choice::Auto)?;
        let all = json!({
            "cpu": cpu,
            "threads": rayon::current_num_threads(),
            "adapters": adapters.iter().enumerate().map(adapter).collect::<Vec<_>>(),
            "auto": chosen.evaluator.describe(),
            "auto_reason": chosen.why,
        });
        tell!("{all:#}");
        return Ok(());
    }
    tell!("{cpu}, {} threads\n", rayon::current_num_threads());
    if adapters.is_empty() {
        tell!(
            "No GPU adapter. For a GPU install its maker's Vulkan driver; without one, \
             mesa-vulkan-drivers (Debian, Ubuntu, Fedora) or vulkan-swrast (Arch) computes in software.\n"
        );
    } else {
        // One column an adapter: names and drivers are too long for one line each.
        let columns: Vec<[String; 10]> = adapters.iter().enumerate().map(properties).collect();
        let row = |(i, head): (usize, &&str)| -> Vec<String> {
            let cells = columns.iter().map(|column| column[i].clone());
            std::iter::once(head.to_string()).chain(cells).collect()
        };
        let table = table(
            &row((0, &HEADS[0])),
            HEADS.iter().enumerate().skip(1).map(row),
        );
        tell!("{table}\n");
    }
    let chosen = choose(Choice::Auto)?;
    tell!(
        "--evaluator auto uses {}: {}",
        chosen.evaluator.describe(),
        chosen.why
    );
    Ok(())
}

/// What is said of an adapter, with its number.
fn properties((number, adapter): (usize, &wgpu::Adapter)) -> [String; 10] {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let timestamps = adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let (low, high) = (info.subgroup_min_size, info.subgroup_max_size);
    [
        info.name.clone(),
        Choice::Adapter(number).to_string(),
        info.backend.to_string(),
        gpu::kind(&info).into(),
        format!("{} {}", info.driver, info.driver_info),
        mebibytes(limits.max_buffer_size),
        mebibytes(limits.max_storage_buffer_binding_size),
        limits.max_compute_invocations_per_workgroup.to_string(),
        if low == high {
            low.to_string()
        } else {
            format!("{low} to {high}")
        },
        if timestamps { "yes" } else { "no" }.into(),
    ]
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes >> 20)
}
