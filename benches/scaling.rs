//! What a candidate's row costs over population and rows, and how much memory that takes:
//! `cargo bench --quiet --bench scaling > benches/scaling/results.csv`; `--large` adds ten million rows.
//!
//! Every case runs in a process of its own, so that its peak memory is its own.

#[path = "shared/evaluators.rs"]
mod evaluators;
#[path = "shared/memory.rs"]
mod memory;

use std::process::Command;
use std::time::Instant;

use servobee::evaluate::{CpuEvaluator, Precision, workload};

/// A case that would take longer than this, s, by the one before it, is left out.
const LIMIT: f64 = 30.0;
/// As many runs as fit into this, s, are timed, from one to [`MOST_RUNS`].
const BUDGET: f64 = 3.0;
const MOST_RUNS: usize = 7;
const USUAL_ROWS: usize = 1000;
const USUAL_SIZE: usize = 1024;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, evaluator, size, rows] = &arguments[..]
        && flag == "--case"
    {
        let number = |text: &str| text.parse().expect("a number");
        return case(evaluator, number(size), number(rows));
    }
    let given = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let most = match given("--test") || !given("--bench") {
        true => (1000, 1000),
        false if given("--large") => (1_000_000, 10_000_000),
        false => (1_000_000, 1_000_000),
    };
    let tenfold = |first: usize, last: usize| {
        std::iter::successors(Some(first), move |n| Some(10 * n).filter(|n| *n <= last))
    };
    println!("over,evaluator,population,rows,runs,seconds,ns_per_candidate_row,peak_mib");
    for (name, _) in evaluators::evaluators() {
        // f64 scales as f32 does.
        if name == "CPU f64" {
            continue;
        }
        sweep(
            "population",
            &name,
            tenfold(100, most.0).map(|size| (size, USUAL_ROWS)),
        );
        sweep(
            "rows",
            &name,
            tenfold(1000, most.1).map(|rows| (USUAL_SIZE, rows)),
        );
    }
}

fn sweep(over: &str, evaluator: &str, cases: impl Iterator<Item = (usize, usize)>) {
    let mut last = (0.0, 1.0);
    for (size, rows) in cases {
        let work = (size * rows) as f64;
        if last.0 * work / last.1 > LIMIT {
            eprintln!("{evaluator}, {size} candidates, {rows} rows: left out, more than {LIMIT} s");
            return;
        }
        let program = std::env::current_exe().expect("this program");
        let output = Command::new(program)
            .args(["--case", evaluator, &size.to_string(), &rows.to_string()])
            .output()
            .expect("this program runs");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let text = String::from_utf8_lossy(&output.stdout);
        let line = text.trim();
        println!("{over},{line}");
        let seconds = line.split(',').nth(4).and_then(|text| text.parse().ok());
        last = (seconds.expect("seconds"), work);
    }
}

fn case(name: &str, size: usize, rows: usize) {
    let mut evaluator = match name {
        // Alone: a GPU's driver takes memory, too.
        "CPU f32" => Box::new(CpuEvaluator::new(Precision::F32)),
        _ => evaluators::evaluators()
            .into_iter()
            .find_map(|(own, evaluator)| (own == name).then_some(evaluator))
            .expect("an evaluator of this machine"),
    };
    let problem = workload::actuator(rows);
    let population = workload::population(&problem, size);
    let mut run = || {
        let start = Instant::now();
        std::hint::black_box(evaluator.costs(&problem, &population).expect("costs"));
        start.elapsed().as_secs_f64()
    };
    // The first makes buffers and compiles the shader.
    run();
    let start = Instant::now();
    let mut seconds = Vec::new();
    while seconds.is_empty()
        || (seconds.len() < MOST_RUNS && start.elapsed().as_secs_f64() < BUDGET)
    {
        seconds.push(run());
    }
    seconds.sort_by(f64::total_cmp);
    let median = seconds[seconds.len() / 2];
    let each = median * 1e9 / (size * rows) as f64;
    println!(
        "{name},{size},{rows},{},{median:.4e},{each:.4},{}",
        seconds.len(),
        memory::peak_mib()
    );
}
