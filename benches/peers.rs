//! The base actuator on 1000 rows, 16 384 candidates: our evaluators beside a hand-written loop that uses nothing of
//! servobee, for `peers/compare.py`, which adds other tools: `cargo bench --bench peers -- DIR [--break PEER]`.
//!
//! Writes to DIR what the other tools need (`record.csv`, `candidates.csv`) and what they are compared with
//! (`costs.csv`, `trajectories.csv`, `results.csv`). `--break` makes every gain of one peer 0.5 % too large, which must
//! be noticed.

#![allow(
    unsafe_code,
    reason = "loops on vectors as one would write them by hand"
)]

#[path = "shared/evaluators.rs"]
mod evaluators;

use std::fs;
use std::ops::{Add, Mul, Sub};
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use servobee::evaluate::problem::{Data, Sample, Series};
use servobee::evaluate::simulate::{outputs, series};
use servobee::evaluate::{Population, Problem, workload};
use servobee::model::{Alone, Complete, Output, View};

const ROWS: usize = 1000;
const CANDIDATES: usize = 16_384;
const RUNS: usize = 3;
/// Candidates whose trajectories are written.
const TRAJECTORIES: usize = 64;
/// Rows that are summed before the sum is added to the total, as the evaluators do.
const CHUNK: usize = 128;

/// The spool at every row for values of K, T and S.
type Trajectory<'a> = Box<dyn Fn(&[f64]) -> Vec<f64> + 'a>;

/// One way to compute the costs.
struct Peer<'a> {
    name: String,
    steps_per_row: f64,
    costs: Box<dyn FnMut() -> Vec<f64> + 'a>,
    trajectory: Option<Trajectory<'a>>,
    seconds: Vec<f64>,
}

fn main() {
    let mut arguments = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench" && a != "--test");
    let mut directory = None;
    let mut broken = None;
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--break" => broken = Some(arguments.next().expect("the name of a peer")),
            _ => directory = Some(PathBuf::from(argument)),
        }
    }
    // Without a folder this is a test run: a few candidates show that it works.
    let (size, runs) = if directory.is_some() {
        (CANDIDATES, RUNS)
    } else {
        (256, 1)
    };

    let problem = workload::actuator(ROWS);
    let population = workload::population(&problem, size);
    let off = scaled(&population, 1.005);
    let choose = |name: &str| match broken.as_deref() == Some(name) {
        true => &off,
        false => &population,
    };
    let mut peers = ours(&problem, &choose);
    let rows = record(&problem);
    // How many steps a row an accuracy needs is found by who compares.
    macro_rules! alone {
        ($method:ty: $($steps:literal),*) => {$(peers.push(alone::<$method, 64, $steps>(rows, &choose));)*};
    }
    alone!(Rk4: 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40);
    alone!(Midpoint: 12, 16, 20, 24, 32, 40, 56, 80);
    let costs: Vec<Vec<f64>> = peers.iter_mut().map(|peer| (peer.costs)()).collect();
    // In turn, so that what else the machine does meets all of them.
    for _ in 0..runs {
        for peer in &mut peers {
            let start = Instant::now();
            std::hint::black_box((peer.costs)());
            peer.seconds.push(start.elapsed().as_secs_f64());
        }
    }
    println!("peer, million candidate-rows per second");
    for peer in &mut peers {
        peer.seconds.sort_by(f64::total_cmp);
        let median = peer.seconds[peer.seconds.len() / 2];
        println!("{}, {:.0}", peer.name, (size * ROWS) as f64 / median / 1e6);
    }
    if let Some(directory) = directory {
        write(&directory, &problem, &population, &choose, &peers, &costs).expect("files in DIR");
    }
}

fn scaled(population: &Population, factor: f64) -> Population {
    let mut scaled = Population::new(population.dimension());
    for candidate in population.iter() {
        scaled.push(&[candidate[0] * factor, candidate[1], candidate[2]]);
    }
    scaled
}

fn record(problem: &Problem) -> &Series {
    match &*problem.data {
        Data::Series(all) => &all[0],
        Data::Tones(_) => unreachable!("the workload is a record"),
    }
}

fn ours<'a>(problem: &'a Problem, choose: &impl Fn(&str) -> &'a Population) -> Vec<Peer<'a>> {
    let steps_per_row = problem.steps() as f64 / (ROWS - 1) as f64;
    let peer = |(name, mut evaluator): (String, Box<dyn servobee::evaluate::Evaluator>)| {
        let name = format!("servobee {name}");
        let population = choose(&name);
        let trajectory: Option<Trajectory> = match name.as_str() {
            "servobee CPU f64" => Some(Box::new(|values| {
                let values = Complete::from_iter(values.iter().copied());
                let rows = outputs(&problem.structure, &values, record(problem));
                rows.iter().map(|row| row[Output::Spool]).collect()
            })),
            "servobee CPU f32" => Some(Box::new(|values| {
                let values = Complete::from_iter(values.iter().map(|&value| value as f32));
                let plant = Alone::plant(&problem.structure, &values);
                let mut spool = Vec::with_capacity(ROWS);
                series::<f32, 2, _>(
                    &problem.structure,
                    record(problem),
                    |_, _, row| {
                        spool.push(row[Output::Spool].into());
                        true
                    },
                    &plant,
                );
                spool
            })),
            _ => None,
        };
        let costs = Box::new(move || {
            let costs = evaluator.costs(problem, population).expect("costs");
            costs.iter().map(|cost| cost.value).collect()
        });
        Peer {
            name,
            steps_per_row,
            costs,
            trajectory,
            seconds: Vec::new(),
        }
    };
    evaluators::evaluators().into_iter().map(peer).collect()
}

fn alone<'a, M: Method, const W: usize, const STEPS: usize>(
    record: &'a Series,
    choose: &impl Fn(&str) -> &'a Population,
) -> Peer<'a> {
    let name = format!("stand-alone {} x{W} {STEPS} steps", M::NAME);
    let population = choose(&name);
    let costs = Box::new(move || {
        let batches = (0..population.len()).into_par_iter().step_by(W);
        let costs = batches.map(|first| {
            let last = population.len() - 1;
            let value = |j| {
                Batch(std::array::from_fn(|i| {
                    population.candidate(last.min(first + i))[j] as f32
                }))
            };
            batch_cost::<M, W, STEPS>(&record.samples, [value(0), value(1), value(2)])
        });
        let mut costs: Vec<f64> = costs.flat_map_iter(|batch| batch.map(f64::from)).collect();
        costs.truncate(population.len());
        costs
    });
    let trajectory = Box::new(|values: &[f64]| {
        let value = |j: usize| Batch::<W>::splat(values[j] as f32);
        let mut spool = Vec::with_capacity(ROWS);
        let values = [value(0), value(1), value(2)];
        simulate::<M, _, STEPS>(&record.samples, values, |_, x: Batch<W>| {
            spool.push(x.0[0].into());
        });
        spool
    });
    Peer {
        name,
        steps_per_row: STEPS as f64,
        costs,
        trajectory: Some(trajectory),
        seconds: Vec::new(),
    }
}

/// What the loop is written over.
trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn splat(value: f32) -> Self;
    fn inverse(self) -> Self;
    fn limited(self, limit: Self) -> Self;
}

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Batch<const W: usize>([f32; W]);

impl<const W: usize> Batch<W> {
    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        for i in 0..W {
            self.0[i] = f(self.0[i], other.0[i]);
        }
        self
    }
}

macro_rules! elementwise {
    ($($operator:ident $method:ident),*) => {$(
        impl<const W: usize> $operator for Batch<W> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a.$method(b))
            }
        }
    )*};
}
elementwise!(Add add, Sub sub, Mul mul);

impl<const W: usize> Number for Batch<W> {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; W])
    }
    #[inline(always)]
    fn inverse(self) -> Self {
        self.zip(self, |a, _| 1.0 / a)
    }
    #[inline(always)]
    fn limited(self, limit: Self) -> Self {
        let low = |a: f32, b: f32| if a > -b { a } else { -b };
        let high = |a: f32, b: f32| if a < b { a } else { b };
        self.zip(limit, |a, b| high(low(a, b), b))
    }
}

/// How a step is taken.
trait Method {
    const NAME: &'static str;
    fn step<R: Number>(valve: [R; 3], state: [R; 2], command: R, step: f32) -> [R; 2];
}

/// The classical Runge-Kutta method, of fourth order where nothing saturates.
struct Rk4;

impl Method for Rk4 {
    const NAME: &'static str = "RK4";
    #[inline(always)]
    fn step<R: Number>(valve: [R; 3], [z, x]: [R; 2], command: R, step: f32) -> [R; 2] {
        let [half, whole, sixth] = [R::splat(0.5 * step), R::splat(step), R::splat(step / 6.0)];
        let two = R::splat(2.0);
        let (za, xa) = slope(valve, z, x, command);
        let (zb, xb) = slope(valve, z + half * za, x + half * xa, command);
        let (zc, xc) = slope(valve, z + half * zb, x + half * xb, command);
        let (zd, xd) = slope(valve, z + whole * zc, x + whole * xc, command);
        [
            z + sixth * (za + two * zb + two * zc + zd),
            x + sixth * (xa + two * xb + two * xc + xd),
        ]
    }
}

/// The midpoint method, of second order everywhere, at half the cost of a step.
struct Midpoint;

impl Method for Midpoint {
    const NAME: &'static str = "midpoint";
    #[inline(always)]
    fn step<R: Number>(valve: [R; 3], [z, x]: [R; 2], command: R, step: f32) -> [R; 2] {
        let (half, whole) = (R::splat(0.5 * step), R::splat(step));
        let (za, xa) = slope(valve, z, x, command);
        let (zb, xb) = slope(valve, z + half * za, x + half * xa, command);
        [z + whole * zb, x + whole * xb]
    }
}

/// Integrates from the equilibrium with the first command, and hands every row and the spool there to `row`.
#[inline(always)]
fn simulate<M: Method, R: Number, const STEPS: usize>(
    samples: &[Sample],
    values: [R; 3],
    mut row: impl FnMut(usize, R),
) {
    let [gain, time_constant, saturation] = values;
    let valve = [gain, time_constant.inverse(), saturation];
    let step = 1e-3 / STEPS as f32;
    let first = R::splat(samples[0].input.command as f32);
    let mut state = [first; 2];
    for (k, sample) in samples.iter().enumerate() {
        row(k, state[1]);
        let command = R::splat(sample.input.command as f32);
        for _ in 0..STEPS {
            state = M::step(valve, state, command, step);
        }
    }
}

// Not a closure: only what is inlined is compiled for the wide vectors.
#[inline(always)]
fn slope<R: Number>([gain, rate, saturation]: [R; 3], z: R, x: R, command: R) -> (R, R) {
    (gain * (command - x).limited(saturation), (z - x) * rate)
}

#[inline(always)]
fn cost<M: Method, R: Number, const STEPS: usize>(samples: &[Sample], values: [R; 3]) -> R {
    let (mut total, mut chunk) = (R::splat(0.0), R::splat(0.0));
    simulate::<M, R, STEPS>(
        samples,
        values,
        #[inline(always)]
        |k, x| {
            let error = R::splat(samples[k].target[Output::Spool] as f32) - x;
            chunk = chunk + error * error;
            if (k + 1) % CHUNK == 0 {
                total = total + chunk;
                chunk = R::splat(0.0);
            }
        },
    );
    total + chunk
}

/// [`cost`] compiled for the widest vectors that the CPU has.
fn batch_cost<M: Method, const W: usize, const STEPS: usize>(
    samples: &[Sample],
    values: [Batch<W>; 3],
) -> [f32; W] {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f")]
        fn avx512<M: Method, const W: usize, const STEPS: usize>(
            samples: &[Sample],
            values: [Batch<W>; 3],
        ) -> [f32; W] {
            cost::<M, _, STEPS>(samples, values).0
        }
        #[target_feature(enable = "avx2,fma")]
        fn avx2<M: Method, const W: usize, const STEPS: usize>(
            samples: &[Sample],
            values: [Batch<W>; 3],
        ) -> [f32; W] {
            cost::<M, _, STEPS>(samples, values).0
        }
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the CPU has it.
            return unsafe { avx512::<M, W, STEPS>(samples, values) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the CPU has both.
            return unsafe { avx2::<M, W, STEPS>(samples, values) };
        }
    }
    cost::<M, _, STEPS>(samples, values).0
}

fn write<'a>(
    directory: &Path,
    problem: &Problem,
    population: &Population,
    choose: &impl Fn(&str) -> &'a Population,
    peers: &[Peer],
    costs: &[Vec<f64>],
) -> std::io::Result<()> {
    fs::create_dir_all(directory)?;
    let save = |name: &str, head: String, lines: Vec<String>| {
        fs::write(directory.join(name), head + "\n" + &lines.join("\n") + "\n")
    };
    let join = |values: &mut dyn Iterator<Item = f64>| {
        let texts: Vec<String> = values.map(|value| format!("{value:e}")).collect();
        texts.join(",")
    };
    let names = || peers.iter().map(|peer| peer.name.as_str());
    let sample = |s: &Sample| format!("{:e},{:e}", s.input.command, s.target[Output::Spool]);
    let lines = record(problem).samples.iter().map(sample).collect();
    save("record.csv", "command,target".into(), lines)?;
    let lines = population.iter().map(|c| join(&mut c.iter().copied()));
    save(
        "candidates.csv",
        "gain,time_constant,saturation".into(),
        lines.collect(),
    )?;
    let lines = (0..population.len()).map(|i| join(&mut costs.iter().map(|costs| costs[i])));
    save(
        "costs.csv",
        names().collect::<Vec<_>>().join(","),
        lines.collect(),
    )?;
    let mut lines = Vec::new();
    for (peer, name) in peers.iter().zip(names()) {
        if let Some(trajectory) = &peer.trajectory {
            for candidate in choose(&peer.name).iter().take(TRAJECTORIES) {
                lines.push(format!(
                    "{name},{}",
                    join(&mut trajectory(candidate).into_iter())
                ));
            }
        }
    }
    save("trajectories.csv", "peer,spool at every row".into(), lines)?;
    let lines = peers.iter().zip(names()).map(|(peer, name)| {
        let seconds = join(&mut peer.seconds.iter().copied());
        format!(
            "{name},{},{},{seconds}",
            peer.steps_per_row,
            population.len()
        )
    });
    save(
        "results.csv",
        "peer,steps_per_row,candidates,seconds of each run".into(),
        lines.collect(),
    )
}
