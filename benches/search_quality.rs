//! How close the Bees Algorithm comes to known optima: `cargo bench --bench search_quality -- [SEEDS]`.
//!
//! Prints one CSV row a run. `search_quality/compare.py` runs other tools on the same functions,
//! which its column `probe` proves: each function's value at one place.

use std::f64::consts::{E, PI};

use rayon::prelude::*;
use servobee::evaluate::Cost;
use servobee::model::Parameter;
use servobee::search::{Bees, Moves, Search, Settings, Start};

const DIMENSIONS: [usize; 3] = [2, 10, 30];
const FUNCTIONS: [Function; 6] = [
    Function {
        name: "Sphere",
        low: -5.12,
        high: 5.12,
        value: sphere,
    },
    Function {
        name: "Rosenbrock",
        low: -5.0,
        high: 10.0,
        value: rosenbrock,
    },
    Function {
        name: "Rastrigin",
        low: -5.12,
        high: 5.12,
        value: rastrigin,
    },
    Function {
        name: "Ackley",
        low: -32.768,
        high: 32.768,
        value: ackley,
    },
    Function {
        name: "Griewank",
        low: -600.0,
        high: 600.0,
        value: griewank,
    },
    Function {
        name: "Schwefel",
        low: -500.0,
        high: 500.0,
        value: schwefel,
    },
];

/// A function with its least value, 0, somewhere inside its domain.
struct Function {
    name: &'static str,
    low: f64,
    high: f64,
    value: fn(&[f64]) -> f64,
}

/// A function moved so that its optimum is not where a search may happen to look, such as the centre.
struct Problem<'a> {
    function: &'a Function,
    shift: Vec<f64>,
}

fn main() {
    // Without `--bench` this is a test run: one seed shows that it works.
    let called_by_bench = std::env::args().any(|argument| argument == "--bench");
    let seeds = std::env::args()
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(if called_by_bench { 50 } else { 1 });

    let published = Settings {
        moves: Moves::AllCoordinates,
        ..Settings::standard()
    };
    let searches = [
        ("servobee", Settings::standard()),
        ("servobee 2009", published),
    ];
    println!("tool,function,dimension,seed,evaluations,error,probe");
    for (tool, settings) in searches {
        for (index, function) in FUNCTIONS.iter().enumerate() {
            for dimension in DIMENSIONS {
                let run = |seed| run(function, index, dimension, settings, seed);
                let runs: Vec<_> = (0..seeds).into_par_iter().map(run).collect();
                for (seed, (evaluations, error, probe)) in runs.iter().enumerate() {
                    let name = function.name;
                    println!("{tool},{name},{dimension},{seed},{evaluations},{error:e},{probe:e}");
                }
            }
        }
    }
}

fn run(
    function: &Function,
    index: usize,
    dimension: usize,
    settings: Settings,
    seed: u64,
) -> (usize, f64, f64) {
    let problem = Problem::new(function, index, dimension, seed);
    let parameter = Parameter::linear("x", "1", function.low, function.low, function.high);
    let probe = problem.value(&vec![parameter.from_unit(0.37); dimension]);

    let space = vec![parameter; dimension];
    let mut bees = Bees::new(&space, settings, Start::Uniform, seed).expect("good settings");
    let budget = (5000 * dimension).min(50_000);
    while bees.evaluations() + settings.per_generation() <= budget {
        let cost = |x| Cost::finished(problem.value(x));
        let costs: Vec<_> = bees.ask().iter().map(cost).collect();
        bees.tell(&costs);
    }
    (bees.evaluations(), bees.best().1.value, probe)
}

impl<'a> Problem<'a> {
    fn new(function: &'a Function, index: usize, dimension: usize, seed: u64) -> Self {
        let width = function.high - function.low;
        // Schwefel's function is lower outside its domain: only a move to the centre keeps that out.
        let (from, to) = match function.name {
            "Schwefel" => (-0.05 * width, 0.0),
            _ => (-0.2 * width, 0.2 * width),
        };
        let mut state = (seed * 100 + dimension as u64) * 10 + index as u64;
        let shift = (0..dimension)
            .map(|_| from + (to - from) * split_mix(&mut state))
            .collect();
        Self { function, shift }
    }

    fn value(&self, x: &[f64]) -> f64 {
        let moved: Vec<_> = x.iter().zip(&self.shift).map(|(x, s)| x - s).collect();
        (self.function.value)(&moved)
    }
}

/// The generator `SplitMix64`, from 0 to 1: few enough lines to be the same in the Python script.
fn split_mix(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1_u64 << 53) as f64
}

fn mean(x: &[f64], term: impl Fn(f64) -> f64) -> f64 {
    x.iter().map(|&x| term(x)).sum::<f64>() / x.len() as f64
}

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2)
        .map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2))
        .sum()
}

fn rastrigin(x: &[f64]) -> f64 {
    x.iter()
        .map(|x| x * x + 10.0 - 10.0 * (2.0 * PI * x).cos())
        .sum()
}

fn ackley(x: &[f64]) -> f64 {
    let far = -20.0 * (-0.2 * mean(x, |x| x * x).sqrt()).exp();
    far - mean(x, |x| (2.0 * PI * x).cos()).exp() + 20.0 + E
}

fn griewank(x: &[f64]) -> f64 {
    let waves: f64 = (1..)
        .zip(x)
        .map(|(i, x)| (x / f64::from(i).sqrt()).cos())
        .product();
    sphere(x) / 4000.0 - waves + 1.0
}

fn schwefel(x: &[f64]) -> f64 {
    x.iter()
        .map(|x| 418.982_887_272_433_8 - x * x.abs().sqrt().sin())
        .sum()
}
