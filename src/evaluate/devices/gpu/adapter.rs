//! The adapters of this machine.

use crate::Error;

/// The adapters of this machine, in wgpu's order.
pub fn adapters() -> Vec<wgpu::Adapter> {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

/// The error that a GPU is asked for and there is no adapter.
pub fn none_found() -> Error {
    Error::failed(
        "--evaluator gpu, but this machine shows no GPU adapter",
        "install a Vulkan driver (mesa-vulkan-drivers is one in software), or use --evaluator cpu",
    )
}

/// Whether an adapter is software on the CPU, such as lavapipe.
pub fn is_software(adapter: &wgpu::Adapter) -> bool {
    adapter.get_info().device_type == wgpu::DeviceType::Cpu
}

/// The adapters in the order in which an evaluation would use them: a discrete GPU before an integrated one before a
/// virtual one before software; equals as they were.
pub fn ranked(mut adapters: Vec<wgpu::Adapter>) -> Vec<wgpu::Adapter> {
    adapters.sort_by_key(rank);
    adapters
}

/// The same, for one of several processes on this machine: they begin with one each of the adapters that are best.
pub(crate) fn ranked_for(place: usize, adapters: Vec<wgpu::Adapter>) -> Vec<wgpu::Adapter> {
    let mut adapters = ranked(adapters);
    let best = adapters
        .chunk_by(|one, other| rank(one) == rank(other))
        .next();
    if let Some(count) = best.map(<[_]>::len) {
        adapters[..count].rotate_left(place % count);
    }
    adapters
}

/// The error that `--evaluator` names an adapter that is not there.
pub(crate) fn not_there(number: usize, count: usize) -> Error {
    Error::input(
        format!("--evaluator gpu:{number}"),
        format!("this machine shows {count} GPU adapters, counted from 0"),
        "servobee devices lists them",
    )
}

/// The adapter that an evaluation would use: the first of those that are [`ranked`].
pub fn best(adapters: &[wgpu::Adapter]) -> Option<&wgpu::Adapter> {
    adapters.iter().min_by_key(|adapter| rank(adapter))
}

fn rank(adapter: &wgpu::Adapter) -> u8 {
    match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// What kind of device an adapter is, in words.
pub fn kind(info: &wgpu::AdapterInfo) -> &'static str {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software on the CPU",
        wgpu::DeviceType::Other => "other",
    }
}

/// An adapter in words: name, backend, kind, driver.
pub fn describe(info: &wgpu::AdapterInfo) -> String {
    format!(
        "{} ({}, {}, {} {})",
        info.name,
        info.backend,
        kind(info),
        info.driver,
        info.driver_info
    )
}
