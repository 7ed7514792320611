//! Where a GPU's time goes: compiling, uploading, integrating, reading back.

use super::super::table::table;
use serde::Serialize;
use servobee::Result;
use servobee::evaluate::gpu::GpuEvaluator;
use servobee::evaluate::{Evaluator, Population, Problem};

/// Candidates that are evaluated, where that many could be measured.
pub(super) const POPULATION: usize = 16_384;

/// The times of a call, s.
#[derive(Serialize)]
pub(super) struct Phases {
    population: usize,
    /// Whether shader and record were new.
    first: bool,
    compile: f64,
    upload: f64,
    kernel: f64,
    readback: f64,
    submissions: u32,
    longest_submission: f64,
    /// Whose clock timed the kernel: the device's or the host's.
    clock: &'static str,
}

/// The phases of the first call and of the next.
///
/// # Errors
/// If the device fails.
pub(super) fn phases(
    mut evaluator: GpuEvaluator,
    problem: &Problem,
    population: &Population,
) -> Result<Vec<Phases>> {
    let mut of_call = |first| {
        evaluator.costs(problem, population)?;
        let timings = evaluator.timings();
        Ok(Phases {
            population: population.len(),
            first,
            compile: timings.compile,
            upload: timings.upload,
            kernel: timings.kernel,
            readback: timings.readback,
            submissions: timings.submissions,
            longest_submission: timings.longest,
            clock: if timings.on_device { "device" } else { "host" },
        })
    };
    [true, false].into_iter().map(&mut of_call).collect()
}

/// Prints the phases of evaluators, each with its number.
pub(super) fn print<'a>(all: impl Iterator<Item = (usize, &'a Phases)>) {
    let milliseconds = |seconds: f64| format!("{:.2}", 1e3 * seconds);
    let row = |(number, phases): (usize, &Phases)| {
        let call = if phases.first { "first" } else { "next" };
        vec![
            format!("[{number}]"),
            phases.population.to_string(),
            call.into(),
            milliseconds(phases.compile),
            milliseconds(phases.upload),
            milliseconds(phases.kernel),
            milliseconds(phases.readback),
            phases.submissions.to_string(),
            milliseconds(phases.longest_submission),
            phases.clock.into(),
        ]
    };
    let rows: Vec<Vec<String>> = all.map(row).collect();
    if rows.is_empty() {
        return;
    }
    let heads = [
        "GPU, ms",
        "population",
        "call",
        "compile",
        "upload",
        "kernel",
        "readback",
        "submissions",
        "longest",
        "clock",
    ];
    tell!("\n{}", table(&heads, rows));
}
