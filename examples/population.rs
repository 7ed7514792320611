//! How many candidates a second the CPU evaluates on a record, for other optimisers; python/examples/speed.py asks the same in
//! Python:
//!
//!     cargo run --release --example population -- tests/data/bench.csv 10000

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::Session;
use servobee::evaluate::{Choice, Population, choose};
use servobee::report::ModelFile;
use std::time::Instant;

fn main() -> servobee::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let [record, candidates] = [(); 2].map(|()| arguments.next().expect("a record and a number"));
    let with_delay = "[structure]\neffects = [\"delay\"]\n";
    let session = Session {
        model: Some(ModelFile::parse("delay.toml", with_delay)?),
        ..Session::default()
    };
    let records = session.read(&[record])?;
    let problem = session.prepare(&records, &[])?.problem().first_fit();

    let free = problem.free();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let count: usize = candidates.parse().expect("a number of candidates");
    let mut anywhere = |k: usize| {
        let parameter = &free[k % free.len()];
        parameter.low + rng.random::<f64>() * (parameter.high - parameter.low)
    };
    let values = (0..count * free.len()).map(&mut anywhere).collect();
    let population = Population::of(free.len(), values);

    let mut evaluator = choose(Choice::Cpu)?.evaluator;
    evaluator.costs(&problem, &population)?;
    let mut best = f64::INFINITY;
    for _ in 0..9 {
        let begun = Instant::now();
        evaluator.costs(&problem, &population)?;
        best = best.min(begun.elapsed().as_secs_f64());
    }
    println!("{:.0}", count as f64 / best);
    Ok(())
}
