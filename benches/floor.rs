//! How close the evaluators come to what this machine can do at all: `cargo bench --bench floor`.
//!
//! Counts the operations that a candidate needs on a row, measures how many of them the CPU can do in a second, and
//! prints the least time that follows beside the time that is taken, in Markdown.

#[path = "shared/evaluators.rs"]
mod evaluators;

use std::cell::Cell;
use std::hint::black_box;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use servobee::evaluate::problem::{Data, Sample};
use servobee::evaluate::simulate::{self, squares};
use servobee::evaluate::{Problem, workload};
use servobee::model::effects::CATALOGUE;
use servobee::model::{Alone, Plant, Real, Valued, View};

const ROWS: usize = 1000;
/// Runs of which the best counts, here and below: floors and times are those of a machine that nobody else uses.
const RUNS: usize = 40;
/// Bursts of well below a millisecond, in which a core is rarely taken away.
const BURSTS: usize = 500;

/// The kinds of operations that are counted apart, and how many instructions one of them takes.
const KINDS: [(&str, f64); 7] = [
    ("add", 1.0),
    ("mul", 1.0),
    ("min, max", 1.0),
    ("select", 2.0),
    ("div", 1.0),
    ("sqrt", 1.0),
    ("other", 1.0),
];
const ADD: usize = 0;
const MUL: usize = 1;
const EXTREME: usize = 2;
const SELECT: usize = 3;
const DIV: usize = 4;
const SQRT: usize = 5;
const OTHER: usize = 6;

type Counts = [f64; KINDS.len()];

fn main() {
    let given = |flag: &str| std::env::args().any(|argument| argument == flag);
    let short = given("--test") || !given("--bench");
    let ceilings = Ceilings::measure(short);
    ceilings.print();
    let cases = cases();
    print_counts(&cases);
    print_times(&cases, &ceilings, short);
}

thread_local! {
    static COUNTS: Cell<Counts> = const { Cell::new([0.0; KINDS.len()]) };
}

/// A number that counts what is done with it. What is the same for every candidate, such as half the length of a step,
/// costs a vector of candidates nothing; nor does a sign, which goes into the operation that uses it.
#[derive(Clone, Copy)]
struct Counted {
    value: f64,
    shared: bool,
}

impl Counted {
    fn new(value: f64, of: &[Self], kind: usize) -> Self {
        let shared = of.iter().all(|operand| operand.shared);
        if !shared {
            let mut counts = COUNTS.get();
            counts[kind] += 1.0;
            COUNTS.set(counts);
        }
        Self { value, shared }
    }
}

macro_rules! counted {
    ($($operator:ident $method:ident $kind:ident),*) => {$(
        impl $operator for Counted {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self::new(self.value.$method(other.value), &[self, other], $kind)
            }
        }
    )*};
}
counted!(Add add ADD, Sub sub ADD, Mul mul MUL, Div div DIV);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            ..self
        }
    }
}

impl Real for Counted {
    fn constant(value: f64) -> Self {
        Self {
            value,
            shared: true,
        }
    }
    fn any_positive(self) -> bool {
        self.value.any_positive()
    }
    fn sqrt(self) -> Self {
        Self::new(self.value.sqrt(), &[self], SQRT)
    }
    fn min(self, other: Self) -> Self {
        Self::new(Real::min(self.value, other.value), &[self, other], EXTREME)
    }
    fn max(self, other: Self) -> Self {
        Self::new(Real::max(self.value, other.value), &[self, other], EXTREME)
    }
    fn floor(self) -> Self {
        Self::new(self.value.floor(), &[self], OTHER)
    }
    fn if_positive(self, yes: Self, no: Self) -> Self {
        let value = self.value.if_positive(yes.value, no.value);
        Self::new(value, &[self, yes, no], SELECT)
    }
}

impl Valued for Counted {
    fn look_up(self, f: impl FnMut(f64) -> f64) -> Self {
        Self::new(self.value.look_up(f), &[self], OTHER)
    }
}

/// A structure with what one candidate costs on one row.
struct Case {
    name: String,
    problem: Problem,
    counts: Counts,
    /// Candidates that are timed.
    size: usize,
}

impl Case {
    fn new(name: &str, problem: Problem, size: usize) -> Self {
        let counts = counts(&problem);
        Self {
            name: name.into(),
            problem,
            counts,
            size,
        }
    }

    fn instructions(&self) -> f64 {
        self.counts
            .iter()
            .zip(KINDS)
            .map(|(count, (_, each))| count * each)
            .sum()
    }
}

fn cases() -> Vec<Case> {
    let names: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
    let single = |name: &&str| {
        Case::new(
            &format!("with {name}"),
            workload::with_effects(&[*name], ROWS),
            1024,
        )
    };
    let heaviest = names
        .iter()
        .map(single)
        .max_by(|a, b| a.instructions().total_cmp(&b.instructions()));
    // Each cause in its usual form.
    let is_usual = |name: &&str| !name.contains('~');
    let usual: Vec<&str> = names.iter().copied().filter(is_usual).collect();
    vec![
        Case::new("actuator", workload::actuator(ROWS), 2048),
        Case::new(
            "actuator and valve",
            workload::actuator_and_valve(ROWS),
            2048,
        ),
        heaviest.expect("there are effects"),
        Case::new("with all effects", workload::with_effects(&usual, ROWS), 64),
    ]
}

/// Operations of one candidate on one row, as the equations are written.
fn counts(problem: &Problem) -> Counts {
    let Data::Series(all) = &*problem.data else {
        unreachable!("the workload is a record")
    };
    let free: Vec<Counted> = problem
        .start()
        .into_iter()
        .map(|value| Counted {
            value,
            shared: false,
        })
        .collect();
    let structure = &problem.structure;
    let values = problem.complete(&free, Counted::constant);
    let (alone, whole) = (
        Alone::plant(structure, &values),
        Plant::new(structure, &values),
    );
    COUNTS.set(Counts::default());
    let (rows, each) = (&all[0], simulate::Counted::Squared);
    match (structure.states().len(), structure.effects.is_empty()) {
        (2, true) => squares::<_, 2, _>(structure, rows, each, |_| (), |_| false, &alone),
        (0..=5, _) => squares::<_, 5, _>(structure, rows, each, |_| (), |_| false, &whole),
        _ => squares::<_, 20, _>(structure, rows, each, |_| (), |_| false, &whole),
    }
    COUNTS.get().map(|count| count / ROWS as f64)
}

/// What all cores do in a second: vector instructions times lanes, and bytes.
struct Ceilings {
    f32: Rates,
    f64: Rates,
    bytes: f64,
}

/// Per second: separate multiplications and additions, fused ones (two operations each), divisions, roots.
struct Rates {
    lanes: usize,
    plain: f64,
    fused: f64,
    div: f64,
    sqrt: f64,
}

macro_rules! chains {
    (
        $chain:ident, $measure:ident, $float:ident, $vector:ident,
        $splat:ident, $add:ident, $mul:ident, $fused:ident, $div:ident, $sqrt:ident
    ) => {
        /// So many rounds of one kind of operation on vectors that stay in registers, enough to hide its latency.
        struct $chain {
            kind: usize,
            rounds: u64,
        }

        impl WithSimd for $chain {
            /// Lanes times operations.
            type Output = f64;

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> f64 {
                const CHAINS: usize = 12;
                let a = simd.$splat(black_box(0.999));
                let b = simd.$splat(black_box(1e-3));
                let mut x = [simd.$splat(black_box(1.0)); CHAINS];
                macro_rules! run {
                    ($operation:expr) => {
                        for _ in 0..self.rounds {
                            for x in &mut x {
                                *x = $operation(*x);
                            }
                        }
                    };
                }
                match self.kind {
                    0 => run!(|x| simd.$add(simd.$mul(x, a), b)),
                    1 => run!(|x| simd.$fused(x, a, b)),
                    2 => run!(|x| simd.$div(a, x)),
                    _ => run!(|x| simd.$sqrt(x)),
                }
                black_box(x);
                let lanes = size_of::<S::$vector>() / size_of::<$float>();
                let operations = if self.kind < 2 { 2 } else { 1 };
                (lanes * CHAINS * operations) as f64 * self.rounds as f64
            }
        }

        fn $measure(short: bool) -> Rates {
            let rate = |kind: usize| {
                let rounds = if kind < 2 { 50_000 } else { 5_000 };
                let run = || Arch::new().dispatch($chain { kind, rounds });
                let bursts = if short { 1 } else { BURSTS };
                let burst = |_: rayon::BroadcastContext| best(bursts, run);
                rayon::broadcast(burst).iter().sum()
            };
            struct Width;
            impl WithSimd for Width {
                type Output = usize;
                fn with_simd<S: Simd>(self, _: S) -> usize {
                    size_of::<S::$vector>() / size_of::<$float>()
                }
            }
            Rates {
                lanes: Arch::new().dispatch(Width),
                plain: rate(0),
                fused: rate(1),
                div: rate(2),
                sqrt: rate(3),
            }
        }
    };
}
chains!(
    Chain32,
    rates32,
    f32,
    f32s,
    splat_f32s,
    add_f32s,
    mul_f32s,
    mul_add_f32s,
    div_f32s,
    sqrt_f32s
);
chains!(
    Chain64,
    rates64,
    f64,
    f64s,
    splat_f64s,
    add_f64s,
    mul_f64s,
    mul_add_f64s,
    div_f64s,
    sqrt_f64s
);

/// The best of so many runs: what `run` returns, in a second.
fn best(runs: usize, mut run: impl FnMut() -> f64) -> f64 {
    let rate = |_| {
        let start = Instant::now();
        run() / start.elapsed().as_secs_f64()
    };
    (0..runs).map(rate).fold(0.0, f64::max)
}

/// Bytes per second of a = b + s c on 256 MiB in all.
fn triad(short: bool) -> f64 {
    let length = (if short { 1 << 20 } else { 256 << 20 }) / 3 / size_of::<f32>();
    let mut a = vec![0.0f32; length];
    let (b, c) = (vec![1.0f32; length], vec![2.0f32; length]);
    let part = length.div_ceil(rayon::current_num_threads());
    best(if short { 1 } else { RUNS }, || {
        let factor = black_box(3.0);
        a.par_chunks_mut(part)
            .zip(b.par_chunks(part))
            .zip(c.par_chunks(part))
            .for_each(|((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + factor * c;
                }
            });
        black_box(&a);
        (3 * length * size_of::<f32>()) as f64
    })
}

impl Ceilings {
    fn measure(short: bool) -> Self {
        Self {
            f32: rates32(short),
            f64: rates64(short),
            bytes: triad(short),
        }
    }

    fn print(&self) {
        println!(
            "Ceilings of {} cores, 10^9 a second:\n",
            rayon::current_num_threads()
        );
        println!(
            "| | lanes | mul and add | fused mul-add | div | sqrt |\n|---|---|---|---|---|---|"
        );
        for (name, rates) in [("f32", &self.f32), ("f64", &self.f64)] {
            let [plain, fused, div, sqrt] =
                [rates.plain, rates.fused, rates.div, rates.sqrt].map(|rate| rate / 1e9);
            let lanes = rates.lanes;
            println!("| {name} | {lanes} | {plain:.0} | {fused:.0} | {div:.1} | {sqrt:.1} |");
        }
        println!(
            "\nMemory: {:.1} GB/s (triad on 256 MiB).\n",
            self.bytes / 1e9
        );
    }
}

impl Rates {
    /// The least time in which a candidate's row can be done: instructions over their rate, or what divides and takes
    /// roots over theirs, whichever is longer.
    fn floor(&self, case: &Case) -> f64 {
        let slow = case.counts[DIV] / self.div + case.counts[SQRT] / self.sqrt;
        (case.instructions() / self.plain).max(slow)
    }

    /// The same if every multiplication went into an addition, where there are that many.
    fn fused_floor(&self, case: &Case) -> f64 {
        let saved = case.counts[ADD].min(case.counts[MUL]);
        let slow = case.counts[DIV] / self.div + case.counts[SQRT] / self.sqrt;
        ((case.instructions() - saved) / (self.fused / 2.0)).max(slow)
    }
}

fn print_counts(cases: &[Case]) {
    println!("Operations of a candidate on a row:\n");
    let names: Vec<_> = KINDS.iter().map(|(name, _)| *name).collect();
    println!(
        "| structure | states | steps a row | {} |",
        names.join(" | ")
    );
    println!("|{}", "---|".repeat(KINDS.len() + 3));
    for case in cases {
        let counts: Vec<_> = case
            .counts
            .iter()
            .map(|count| format!("{count:.0}"))
            .collect();
        let states = case.problem.structure.states().len();
        let steps = case.problem.steps() as f64 / (ROWS - 1) as f64;
        println!(
            "| {} | {states} | {steps:.1} | {} |",
            case.name,
            counts.join(" | ")
        );
    }
    println!();
}

fn print_times(cases: &[Case], ceilings: &Ceilings, short: bool) {
    println!("Nanoseconds for a candidate's row:\n");
    println!(
        "| structure | evaluator | floor | with fused mul-add | measured | measured / floor | % of the memory's rate |"
    );
    println!("|---|---|---|---|---|---|---|");
    for case in cases {
        let population = workload::population(&case.problem, if short { 16 } else { case.size });
        for (name, mut evaluator) in evaluators::evaluators() {
            let mut run = || {
                black_box(evaluator.costs(&case.problem, &population).expect("costs"));
                (population.len() * ROWS) as f64
            };
            run();
            let taken = 1.0 / best(if short { 1 } else { RUNS }, run);
            let rates = match name.as_str() {
                "CPU f64" => Some(&ceilings.f64),
                "CPU f32" | "llvmpipe" => Some(&ceilings.f32),
                // No ceiling of a GPU is measured here.
                _ => None,
            };
            let number = |value: Option<f64>, digits: usize| {
                value.map_or("-".into(), |v| format!("{v:.digits$}"))
            };
            let floor = rates.map(|rates| rates.floor(case));
            let fused = rates.map(|rates| rates.fused_floor(case));
            // All lanes of a vector share the row. What a GPU reads goes through caches that nothing here knows.
            let read = rates.filter(|_| name.starts_with("CPU")).map(|rates| {
                let bytes = size_of::<Sample>() as f64 / rates.lanes as f64;
                100.0 * bytes / taken / ceilings.bytes
            });
            println!(
                "| {} | {name} | {} | {} | {:.2} | {} | {} |",
                case.name,
                number(floor.map(|f| f * 1e9), 2),
                number(fused.map(|f| f * 1e9), 2),
                taken * 1e9,
                number(floor.map(|f| taken / f), 2),
                number(read, 0),
            );
        }
    }
}
