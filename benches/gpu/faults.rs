//! Devices that fail in the middle: the costs are those of a device that does not.

use super::{Setting, on_cpu};
use servobee::evaluate::gpu::{GpuEvaluator, InjectedFault};
use servobee::evaluate::{
    Cost, CpuEvaluator, Evaluator, Guarded, Precision, Standby, Thoroughness, workload,
};
use servobee::{Error, Result};
use std::time::Duration;

/// Plans what goes wrong.
type Spoil = fn(&mut GpuEvaluator);

pub(crate) fn stage(setting: &Setting) -> Result<()> {
    let (size, rows) = setting.pick((200_000, 1000), (2048, 200));
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    let expected = setting.evaluator()?.costs(&problem, &population)?;
    println!(
        "{size} candidates, {rows} rows; submissions of at most 3 ms, so that there is a middle.\n"
    );
    println!("| what | costs | what is said |\n|---|---|---|");
    let spoils: [(&str, Spoil); 4] = [
        ("the device is lost before the third submission", |gpu| {
            gpu.inject(InjectedFault::Lost, 2, 1)
        }),
        ("the device is lost three times", |gpu| {
            gpu.inject(InjectedFault::Lost, 1, 3)
        }),
        ("there is no memory for a batch, twice", |gpu| {
            gpu.inject(InjectedFault::OutOfMemory, 0, 2)
        }),
        ("buffers of 1 MiB at most", |gpu| gpu.limit_buffers(1 << 20)),
    ];
    for (what, spoil) in spoils {
        let mut gpu = setting.evaluator()?;
        gpu.limit_submissions(0.003);
        spoil(&mut gpu);
        let costs = gpu.costs(&problem, &population)?;
        same(what, &costs, &expected)?;
        println!(
            "| {what} | bit for bit the same | {} |",
            gpu.take_warnings().join("; ")
        );
    }
    let what = "the device does not answer";
    let mut gpu = setting.evaluator()?;
    // In software work is done while it is submitted: the device has always answered.
    if setting.small {
        gpu.inject(InjectedFault::Hang, 0, 1);
    }
    gpu.limit_timeout(Duration::from_nanos(1));
    let cpu = Standby::new("the CPU", Thoroughness::Cpu, || {
        Ok(CpuEvaluator::new(Precision::F32))
    });
    let mut guarded = Guarded::new(
        Standby::new("the GPU", Thoroughness::Device, move || Ok(gpu)),
        [cpu],
    )?;
    let costs = guarded.costs(&problem, &population)?;
    same(
        what,
        &costs,
        &on_cpu(Precision::F32, &problem, &population)?,
    )?;
    println!(
        "| {what} | the CPU's, bit for bit | {} |",
        guarded.take_warnings().join("; ")
    );
    Ok(())
}

fn same(what: &str, costs: &[Cost], expected: &[Cost]) -> Result<()> {
    let bits = |all: &[Cost]| {
        all.iter()
            .map(|cost| cost.value.to_bits())
            .collect::<Vec<_>>()
    };
    match bits(costs) == bits(expected) {
        true => Ok(()),
        false => Err(Error::failed(
            format!("{what}: costs are lost or changed"),
            "report this",
        )),
    }
}
