//! A search of a user's own, written outside the crate: fits and diagnoses search by it.

use rand::seq::index::sample;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::diagnose::{Cut, IdentificationProblem, Options, identify};
use servobee::evaluate::problem::Data;
use servobee::evaluate::{Cost, CpuEvaluator, Population, Precision, Problem, parameters_for};
use servobee::model::Parameter;
use servobee::model::effects::entry;
use servobee::search::{Method, Plan, Search, Start, fit};
use servobee::simulator::Setup;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Differential Evolution, rand/1/bin (Storn & Price 1997).
#[derive(Debug)]
struct Evolution {
    members: usize,
    generations: usize,
}

struct Evolving {
    parameters: Vec<Parameter>,
    generations: usize,
    rng: ChaCha8Rng,
    /// The members with their costs, and what was asked to replace each.
    members: Vec<(Vec<f64>, Cost)>,
    trials: Population,
    history: Vec<Cost>,
}

impl Method for Evolution {
    fn begin(
        &self,
        parameters: &[Parameter],
        start: Start,
        seed: u64,
    ) -> servobee::Result<Box<dyn Search>> {
        start.check(parameters)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut member = |k| match &start {
            Start::From(given) | Start::Near(given) if k == 0 => given.clone(),
            _ => parameters
                .iter()
                .map(|p| p.from_unit(rng.random()))
                .collect(),
        };
        Ok(Box::new(Evolving {
            members: (0..self.members)
                .map(|k| (member(k), Cost::DIVERGED))
                .collect(),
            parameters: parameters.to_vec(),
            generations: self.generations,
            rng,
            trials: Population::new(parameters.len()),
            history: Vec::new(),
        }))
    }
}

impl Search for Evolving {
    fn ask(&mut self) -> Population {
        self.trials = Population::new(self.parameters.len());
        for k in 0..self.members.len() {
            let mut trial = self.members[k].0.clone();
            let three = sample(&mut self.rng, self.members.len(), 3);
            for (j, p) in self.parameters.iter().enumerate() {
                let at = |member: usize| p.to_unit(self.members[three.index(member)].0[j]);
                if !self.history.is_empty() && self.rng.random_bool(0.9) {
                    trial[j] = p.from_unit((at(0) + 0.7 * (at(1) - at(2))).clamp(0.0, 1.0));
                }
            }
            self.trials.push(&trial);
        }
        self.trials.clone()
    }

    fn tell(&mut self, costs: &[Cost]) {
        for ((member, trial), cost) in self.members.iter_mut().zip(self.trials.iter()).zip(costs) {
            if *cost < member.1 {
                *member = (trial.to_vec(), *cost);
            }
        }
        self.history.push(self.best().1);
    }

    fn best(&self) -> (&[f64], Cost) {
        let (best, cost) = self
            .members
            .iter()
            .min_by_key(|one| one.1)
            .expect("members");
        (best, *cost)
    }

    fn history(&self) -> &[Cost] {
        &self.history
    }

    fn evaluations(&self) -> usize {
        self.history.len() * self.members.len()
    }

    fn finished(&self) -> bool {
        self.history.len() > self.generations
    }
}

#[test]
fn a_plan_that_names_another_method_searches_by_it() {
    let setup = Setup {
        seconds: 4.0,
        planted: vec!["null_bias=0.3".parse().unwrap()],
        ..Setup::default()
    };
    let records = [setup.record().unwrap()];
    let question = IdentificationProblem::of(&records, &[], Cut::default()).unwrap();
    let bias = entry("null_bias").unwrap();
    let with_bias = question.structure.with(bias.on(&question.structure)[0]);
    let evolution = |members, generations| {
        Arc::new(Evolution {
            members,
            generations,
        })
    };
    let plan = Plan {
        method: evolution(30, 40),
        local: evolution(10, 5),
        ..Plan::of_records(1)
    };
    let mut evaluator = CpuEvaluator::new(Precision::F32);
    let problem = Problem::new(
        with_bias.clone(),
        parameters_for(&with_bias, &records),
        Data::Series(question.measurements.fit.clone()),
    );
    let mut on = |_| ControlFlow::Continue(());
    let found = fit(&problem, &mut evaluator, &plan, &mut on).unwrap();
    let gain = found.values()[0];
    println!("gain {gain}, planted {}", setup.valve.gain);
    assert_eq!(found.search.evaluations, 41 * 30);
    assert!((gain / setup.valve.gain - 1.0).abs() < 0.05);

    let options = Options::on(&question.structure, &[bias], 1);
    let mut on = |_: &str| ControlFlow::Continue(());
    let found = identify(question, &mut evaluator, &plan, &options, &mut on).unwrap();
    assert_eq!(found.search.search.history.len(), 41);
    assert_eq!(found.added[0].effect.to_string(), "null_bias");
}
