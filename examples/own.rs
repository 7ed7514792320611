//! From a record to a page with an evaluator, a loss, a search and an effect that somebody else has written:
//!
//!     cargo run --release --example own -- tests/data/bench.csv result

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::Session;
use servobee::evaluate::{
    Chosen, Cost, CpuEvaluator, Evaluator, Job, Loss, OwnLoss, Population, Precision,
};
use servobee::model::effects::{Act, CATALOGUE, Entry, Law, Port, register};
use servobee::model::{Parameter, Real};
use servobee::search::{Method, Plan, Search, Start};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn main() -> servobee::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let [record, folder] = [(); 2].map(|()| arguments.next().expect("a record and a folder"));
    let count = Arc::new(AtomicUsize::new(0));
    let session = Session {
        effects: [CATALOGUE, &[register::<BendLaw>(BEND)?]].concat(),
        loss: Some(OwnLoss::of::<Huber>()),
        plan: Plan {
            method: Arc::new(Shrinking { rounds: 40 }),
            ..Plan::of_records(1)
        },
        ..Session::default()
    };
    let records = session.read(&[record])?;
    let mut chosen = Chosen::own("the counting CPU", Counting(count.clone()))?;
    let mut progress = |_: &str| ControlFlow::Continue(());
    let diagnosed = session.identify(&records, &[], &mut chosen, &mut progress)?;
    diagnosed.write(folder, true)?;

    println!("{}", diagnosed.document.effect_names().join(", "));
    eprintln!("{} candidates", count.load(Ordering::Relaxed));
    Ok(())
}

/// An evaluator that counts what it is asked.
struct Counting(Arc<AtomicUsize>);

impl Evaluator for Counting {
    fn describe(&self) -> String {
        "a CPU that counts".into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> servobee::Result<Vec<Vec<Cost>>> {
        let asked = jobs.iter().map(|job| job.population.len()).sum();
        self.0.fetch_add(asked, Ordering::Relaxed);
        CpuEvaluator::new(Precision::F32).costs_of(jobs)
    }
}

/// Huber's loss: beyond twice the noise an error costs no more than its size.
struct Huber;

impl Loss for Huber {
    fn of<R: Real>(error: R, size: R) -> R {
        let limit = R::constant(2.0) * size;
        let large = error.abs();
        let linear = limit * (R::constant(2.0) * large - limit);
        (large - limit).if_positive(linear, error * error)
    }
}

/// A search at random in a box that shrinks around the best.
#[derive(Debug)]
struct Shrinking {
    rounds: usize,
}

struct Shrunk {
    parameters: Vec<Parameter>,
    rounds: usize,
    rng: ChaCha8Rng,
    asked: Population,
    best: (Vec<f64>, Cost),
    history: Vec<Cost>,
}

impl Method for Shrinking {
    fn begin(
        &self,
        parameters: &[Parameter],
        start: Start,
        seed: u64,
    ) -> servobee::Result<Box<dyn Search>> {
        start.check(parameters)?;
        let from = match start {
            Start::Uniform => parameters.iter().map(Parameter::nominal).collect(),
            Start::From(candidate) | Start::Near(candidate) => candidate,
        };
        Ok(Box::new(Shrunk {
            parameters: parameters.to_vec(),
            rounds: self.rounds,
            rng: ChaCha8Rng::seed_from_u64(seed),
            asked: Population::new(parameters.len()),
            best: (from, Cost::DIVERGED),
            history: Vec::new(),
        }))
    }
}

impl Search for Shrunk {
    fn ask(&mut self) -> Population {
        let width = 0.85f64.powi(self.history.len() as i32);
        self.asked = Population::new(self.parameters.len());
        for _ in 0..200 {
            let mut one = |(parameter, &best): (&Parameter, &f64)| {
                let shift = width * (self.rng.random::<f64>() - 0.5) * 2.0;
                parameter.from_unit((parameter.to_unit(best) + shift).clamp(0.0, 1.0))
            };
            let parameters = self.parameters.iter().zip(&self.best.0);
            self.asked
                .push(&parameters.map(&mut one).collect::<Vec<_>>());
        }
        self.asked.clone()
    }

    fn tell(&mut self, costs: &[Cost]) {
        for (candidate, cost) in self.asked.iter().zip(costs) {
            if *cost < self.best.1 {
                self.best = (candidate.to_vec(), *cost);
            }
        }
        self.history.push(self.best.1);
    }

    fn best(&self) -> (&[f64], Cost) {
        (&self.best.0, self.best.1)
    }

    fn history(&self) -> &[Cost] {
        &self.history
    }

    fn evaluations(&self) -> usize {
        200 * self.history.len()
    }

    fn finished(&self) -> bool {
        self.history.len() == self.rounds
    }
}

/// An amplifier that bends: u + bend · u · |u|.
struct Bend<R>(R);

impl<R: Real> Act<R> for Bend<R> {
    fn command(&self, _own: &mut [R], command: R) -> R {
        command + self.0 * command * command.abs()
    }
}

struct BendLaw;

impl Law for BendLaw {
    type Act<R: Real> = Bend<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Bend<R> {
        Bend(next())
    }
}

const BEND: Entry = Entry {
    name: "bend",
    port: Port::Command,
    summary: "The amplifier bends",
    finding: "the amplifier bends by {bend}",
    equation: "u + bend u |u|",
    shows: "an error that grows with the square of the command",
    confused: "gain_curvature, which the spool does not show",
    source: "the amplifier's data sheet",
    parameters: |scale, _| {
        let most = 0.5 / scale.command;
        vec![Parameter::linear("bend", "1", -most, 0.0, most)]
    },
    trials: |scale, _| vec![vec![0.05 / scale.command]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: |_| true,
    outputs: None,
    view: None,
    frequency: None,
};
