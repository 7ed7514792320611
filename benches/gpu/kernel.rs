//! The composed shader beside a kernel written by hand, on the same work.

use super::{Setting, differences, median, on_cpu, quantile};
use bytemuck::{Pod, Zeroable};
use servobee::evaluate::problem::Data;
use servobee::evaluate::{Cost, Evaluator, PARITY, Population, Precision, Problem, workload};
use servobee::model::Output;
use servobee::model::exact_step::MOST_PARTS;
use servobee::{Error, Result};
use std::time::{Duration, Instant};
use std::{fs, path::Path};

const SHADER: &str = include_str!("row.wgsl");
/// Candidates whose costs are compared with those in f64.
const COMPARED: usize = 2048;
/// Share of them that must agree.
const SHARE: f64 = 0.99;

fn work(setting: &Setting) -> (Problem, Population) {
    let (size, rows) = setting.pick((1_000_000, 1000), (1024, 200));
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    (problem, population)
}

/// The work as the kernels read it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Work {
    population: u32,
    rows: u32,
    length: f32,
    parts: u32,
}

/// Command and measured spool of every row, and the length of a row.
fn rows(problem: &Problem) -> (Vec<[f32; 2]>, f32) {
    let Data::Series(all) = &*problem.data else {
        unreachable!("the workload is a record")
    };
    let samples = &all[0].samples;
    let (length, count) = problem.parts(&samples[0]);
    assert!(
        count == 1 && problem.is_even(),
        "a row is one exact step, all are alike"
    );
    let rows = samples
        .iter()
        .map(|s| [s.input.command as f32, s.target[Output::Spool] as f32]);
    (rows.collect(), length as f32)
}

/// All gains, all time constants, all saturations.
fn columns(population: &Population) -> Vec<f32> {
    let column = |j: usize| population.iter().map(move |candidate| candidate[j] as f32);
    (0..population.dimension()).flat_map(column).collect()
}

fn first(population: &Population, count: usize) -> Population {
    let mut some = Population::new(population.dimension());
    population
        .iter()
        .take(count)
        .for_each(|candidate| some.push(candidate));
    some
}

/// Writes the work for `row.cu` and `jax_rows.py`.
pub(crate) fn write_work(setting: &Setting, file: &Path) -> Result<()> {
    let (problem, population) = work(setting);
    let (rows, length) = rows(&problem);
    let compared = first(&population, COMPARED);
    let expected = on_cpu(Precision::F64, &problem, &compared)?;
    let expected: Vec<f64> = expected.iter().map(|cost| cost.value).collect();
    let header = [
        population.len() as u32,
        rows.len() as u32,
        MOST_PARTS,
        expected.len() as u32,
    ];
    let mut bytes = bytemuck::cast_slice::<u32, u8>(&header).to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(bytemuck::cast_slice::<_, u8>(&rows));
    bytes.extend(bytemuck::cast_slice::<_, u8>(&columns(&population)));
    bytes.extend(bytemuck::cast_slice::<_, u8>(&expected));
    fs::write(file, bytes)
        .map_err(|error| Error::failed(format!("{}: {error}", file.display()), "name another file"))
}

pub(crate) fn stage(setting: &Setting) -> Result<()> {
    let (problem, population) = work(setting);
    let done = (population.len() * problem.rows()) as f64;
    let compared = first(&population, COMPARED);
    let expected = on_cpu(Precision::F64, &problem, &compared)?;
    let mut own = setting.evaluator()?;
    let mut by_hand = Kernel::new(setting, &problem, &population);
    own.costs(&problem, &population)?;
    let costs = by_hand.costs();
    let off = quantile(&differences(&costs[..compared.len()], &expected), SHARE);
    if off > PARITY {
        return Err(Error::failed(
            format!("the kernel written by hand is off by {off:.1e}"),
            "mend benches/gpu/row.wgsl",
        ));
    }
    // In turn, so that what else the machine does meets both.
    let mut seconds = [Vec::new(), Vec::new()];
    for _ in 0..setting.pick(15, 3) {
        own.costs(&problem, &population)?;
        seconds[0].push(own.timings().kernel);
        seconds[1].push(by_hand.run());
    }
    let rates = seconds.map(|all| done / median(all));
    println!(
        "{} candidates, {} rows, in the kernel.\n",
        population.len(),
        problem.rows()
    );
    println!("| kernel | rows/s | |\n|---|---|---|");
    println!(
        "| composed from the model | {:.3e} | {:.2} of the one written by hand |",
        rates[0],
        rates[0] / rates[1]
    );
    println!(
        "| written by hand in WGSL | {:.3e} | 99 % of its costs within {off:.1e} of f64 |",
        rates[1]
    );
    Ok(())
}

/// The kernel written by hand, with its work on the device.
struct Kernel {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    costs: wgpu::Buffer,
    readback: wgpu::Buffer,
    queries: Option<(wgpu::QuerySet, wgpu::Buffer, wgpu::Buffer)>,
    population: usize,
    /// What a cost is multiplied by.
    scale: f64,
}

impl Kernel {
    fn new(setting: &Setting, problem: &Problem, population: &Population) -> Self {
        let adapter = &setting.adapter;
        let descriptor = wgpu::DeviceDescriptor {
            required_limits: adapter.limits(),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("row"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("row"),
            layout: None,
            module: &module,
            entry_point: Some("integrate"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        use wgpu::BufferUsages as Usage;
        let buffer = |size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: size as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let filled = |bytes: &[u8], usage| {
            let buffer = buffer(bytes.len(), usage | Usage::COPY_DST);
            queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let (rows, length) = rows(problem);
        let work = Work {
            population: population.len() as u32,
            rows: rows.len() as u32,
            length,
            parts: MOST_PARTS,
        };
        let size = 4 * population.len();
        let costs = buffer(size, Usage::STORAGE | Usage::COPY_SRC);
        let bound = [
            filled(bytemuck::bytes_of(&work), Usage::UNIFORM),
            filled(bytemuck::cast_slice(&columns(population)), Usage::STORAGE),
            filled(bytemuck::cast_slice(&rows), Usage::STORAGE),
            costs.clone(),
        ];
        let entries: Vec<_> = bound
            .iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("row"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let timed = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let queries = timed.then(|| {
            let set = device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            });
            let resolved = buffer(16, Usage::QUERY_RESOLVE | Usage::COPY_SRC);
            (set, resolved, buffer(16, Usage::MAP_READ | Usage::COPY_DST))
        });
        Self {
            readback: buffer(size, Usage::MAP_READ | Usage::COPY_DST),
            pipeline,
            group,
            costs,
            queries,
            population: population.len(),
            scale: problem.scale[Output::Spool],
            device,
            queue,
        }
    }

    /// Runs it once; how long it took, s, by the device's clock where it has one.
    fn run(&mut self) -> f64 {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let writes = self
            .queries
            .as_ref()
            .map(|(set, ..)| wgpu::ComputePassTimestampWrites {
                query_set: set,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: None,
            timestamp_writes: writes,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups((self.population as u32).div_ceil(64), 1, 1);
        drop(pass);
        if let Some((set, resolved, readback)) = &self.queries {
            encoder.resolve_query_set(set, 0..2, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, readback, 0, 16);
        }
        let start = Instant::now();
        self.queue.submit([encoder.finish()]);
        self.wait();
        let by_host = start.elapsed().as_secs_f64();
        let Some((_, _, readback)) = &self.queries else {
            return by_host;
        };
        let ticks = self.read::<u64>(readback);
        (ticks[1] - ticks[0]) as f64 * 1e-9 * f64::from(self.queue.get_timestamp_period())
    }

    fn costs(&mut self) -> Vec<Cost> {
        self.run();
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.costs, 0, &self.readback, 0, self.costs.size());
        self.queue.submit([encoder.finish()]);
        let sums = self.read::<f32>(&self.readback);
        sums.iter()
            .map(|sum| Cost::finished(f64::from(*sum) * self.scale))
            .collect()
    }

    fn wait(&self) {
        let wait = wgpu::PollType::Wait {
            submission_index: None,
            timeout: Some(Duration::from_secs(60)),
        };
        self.device.poll(wait).expect("a device that answers");
    }

    fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Vec<T> {
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait();
        let view = buffer
            .get_mapped_range(..)
            .expect("a buffer that is mapped");
        let all = bytemuck::cast_slice(&view).to_vec();
        drop(view);
        buffer.unmap();
        all
    }
}
