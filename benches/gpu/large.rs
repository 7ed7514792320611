//! A million candidates on a million rows: more than one buffer or one submission takes.

use super::memory::peak_mib;
use super::{Setting, differences, on_cpu, quantile};
use servobee::evaluate::{Evaluator, PARITY, Population, Precision, workload};
use servobee::{Error, Result};
use std::time::Instant;

/// Candidates whose costs are compared with the CPU's, from all over the population.
const COMPARED: usize = 256;

pub(crate) fn stage(setting: &Setting) -> Result<()> {
    let (size, rows) = setting.pick((1_000_000, 1_000_000), (4096, 1000));
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    let mut gpu = setting.evaluator()?;
    let start = Instant::now();
    let costs = gpu.costs(&problem, &population)?;
    let seconds = start.elapsed().as_secs_f64();
    let timings = gpu.timings();
    println!(
        "| candidates | rows | seconds | rows/s | in the kernel | submissions | peak memory of the process, MiB |"
    );
    println!("|---|---|---|---|---|---|---|");
    let work = size as f64 * rows as f64;
    println!(
        "| {size} | {rows} | {seconds:.2} | {:.3e} | {:.3e} | {} | {} |",
        work / seconds,
        work / timings.kernel,
        timings.submissions,
        peak_mib()
    );
    let every = size / COMPARED;
    let mut some = Population::new(population.dimension());
    for candidate in population.iter().step_by(every) {
        some.push(candidate);
    }
    let found: Vec<_> = costs.iter().step_by(every).copied().collect();
    println!(
        "\n| {} of them, GPU beside | half within | 90 % within |\n|---|---|---|",
        some.len()
    );
    let mut half = 0.0_f64;
    for precision in [Precision::F32, Precision::F64] {
        let off = differences(&found, &on_cpu(precision, &problem, &some)?);
        half = half.max(quantile(&off, 0.5));
        println!(
            "| CPU {precision:?} | {:.1e} | {:.1e} |",
            quantile(&off, 0.5),
            quantile(&off, 0.9)
        );
    }
    match half <= PARITY {
        true => Ok(()),
        false => Err(Error::failed(
            format!("half of the costs are off by {half:.1e} or more"),
            "do not trust long records on this device",
        )),
    }
}
