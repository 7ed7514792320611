//! What ranks in many processes tell each other, as bytes. Numbers keep every bit.
//!
//! Data is the largest part of a problem and the same in many of them: it is sent once, and named by a number from then on.

use crate::evaluate::problem::identity::DataIdentity;
use crate::evaluate::problem::{Data, Problem};
use crate::evaluate::{Job, Population};
use crate::model::{Outputs, Parameter};
use crate::{Error, Result};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::Arc;

/// What a rank is told. The values of all candidates follow [`Order::Evaluate`] as they lie in memory.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Order {
    /// Open the devices that these words name, as `--evaluator` does.
    Open(String),
    /// Forget the data of these numbers, and evaluate these jobs.
    Evaluate(Vec<u64>, Vec<Told>),
    /// The run has ended.
    End,
}

/// A job, but for the values of its candidates.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Told {
    /// As JSON, in which a model file's structure is made to be written.
    structure: String,
    parameters: Vec<Parameter>,
    scale: Outputs<f64>,
    /// The number of its data, and the data where it is new.
    data: (u64, Option<Data>),
    candidates: usize,
    dimension: usize,
}

pub(super) fn to_bytes(what: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(what).expect("plain data")
}

pub(super) fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    postcard::from_bytes(bytes).map_err(|error| unreadable(&error.to_string()))
}

fn unreadable(problem: &str) -> Error {
    Error::failed(
        format!("what it was told cannot be read: {problem}"),
        "run the same program on all ranks",
    )
}

/// What one rank was sent: the numbers of data.
#[derive(Debug, Default)]
pub(super) struct Sent {
    numbers: HashMap<DataIdentity, u64>,
    next: u64,
}

impl Sent {
    /// `jobs` for the rank that was sent this.
    ///
    /// # Errors
    /// A loss of one's own: it is a function of this process.
    pub(super) fn order(&mut self, jobs: &[Job<'_>]) -> Result<Order> {
        let mut forgotten = Vec::new();
        self.numbers.retain(|data, number| {
            let alive = data.is_alive();
            if !alive {
                forgotten.push(*number);
            }
            alive
        });
        let told = jobs.iter().map(|job| {
            let Problem {
                structure,
                parameters,
                data,
                scale,
                loss,
            } = job.problem;
            if loss.is_some() {
                return Err(Error::failed(
                    "a loss of one's own cannot be sent to another process",
                    "run it in one process",
                ));
            }
            let identity = DataIdentity::of(data);
            let known = self.numbers.get(&identity).copied();
            let number = known.unwrap_or_else(|| {
                self.next += 1;
                self.numbers.insert(identity, self.next);
                self.next
            });
            let own = known.is_none().then(|| Data::clone(data));
            Ok(Told {
                structure: serde_json::to_string(structure).expect("plain data"),
                parameters: parameters.clone(),
                scale: *scale,
                data: (number, own),
                candidates: job.population.len(),
                dimension: job.population.dimension(),
            })
        });
        let told = told.collect::<Result<_>>()?;
        Ok(Order::Evaluate(forgotten, told))
    }
}

/// What a rank has been sent.
#[derive(Debug, Default)]
pub(super) struct Received {
    data: HashMap<u64, Arc<Data>>,
}

impl Received {
    /// The problems that it was `told` of, with their candidates, whose `values` follow each other; data that was `forgotten` is
    /// dropped.
    ///
    /// # Errors
    /// Another program has told it.
    pub(super) fn jobs(
        &mut self,
        forgotten: &[u64],
        told: Vec<Told>,
        values: &[f64],
    ) -> Result<Vec<(Problem, Population)>> {
        self.data.retain(|number, _| !forgotten.contains(number));
        let mut rest = values;
        let mut jobs = Vec::new();
        for one in told {
            let (number, own) = one.data;
            if let Some(own) = own {
                self.data.insert(number, Arc::new(own));
            }
            let data = self.data.get(&number);
            let data = data.ok_or_else(|| unreadable("data is missing"))?.clone();
            let structure = serde_json::from_str(&one.structure);
            let problem = Problem {
                structure: structure.map_err(|error| unreadable(&error.to_string()))?,
                parameters: one.parameters,
                data,
                scale: one.scale,
                loss: None,
            };
            let own = rest.split_off(..one.candidates * one.dimension);
            let own = own.ok_or_else(|| unreadable("candidates are missing"))?;
            jobs.push((problem, Population::of(one.dimension, own.to_vec())));
        }
        Ok(jobs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    #[test]
    fn a_problem_arrives_as_it_was_and_its_data_once() {
        let problems = [
            workload::actuator_and_valve(50),
            workload::with_effects(&["friction", "delay", "hysteresis"], 80),
        ];
        let (mut sent, mut received) = (Sent::default(), Received::default());
        let mut first = Vec::new();
        for round in 0..2 {
            let populations: Vec<Population> = problems
                .iter()
                .map(|one| workload::population(one, 7))
                .collect();
            let jobs: Vec<Job<'_>> = problems
                .iter()
                .zip(&populations)
                .map(|(problem, population)| Job {
                    problem,
                    population,
                })
                .collect();
            let bytes = to_bytes(&sent.order(&jobs).unwrap());
            let Order::Evaluate(forgotten, told) = from_bytes(&bytes).unwrap() else {
                panic!("another order");
            };
            let values: Vec<f64> = populations
                .iter()
                .flat_map(|one| one.values().to_vec())
                .collect();
            let arrived = received.jobs(&forgotten, told, &values).unwrap();
            for ((problem, population), job) in arrived.iter().zip(&jobs) {
                assert_eq!(problem.structure, job.problem.structure);
                assert_eq!(problem.parameters, job.problem.parameters);
                assert_eq!(problem.scale, job.problem.scale);
                assert_eq!(problem.data, job.problem.data);
                assert_eq!(population, job.population);
            }
            match round {
                0 => first = bytes,
                _ => assert!(
                    bytes.len() < first.len() / 2,
                    "{} {}",
                    bytes.len(),
                    first.len()
                ),
            }
        }
    }

    /// What benches/ranks.md calculates with.
    #[test]
    fn data_has_the_bytes_a_row_that_the_page_says() {
        let bytes = |rows: usize| {
            let problem = workload::actuator(rows);
            let population = workload::population(&problem, 1);
            let jobs = [Job {
                problem: &problem,
                population: &population,
            }];
            to_bytes(&Sent::default().order(&jobs).unwrap()).len()
        };
        let a_row = (bytes(1100) - bytes(1000)) / 100;
        let page = include_str!("../../../../benches/ranks.md");
        assert!(page.contains(&format!("{a_row} R bytes")), "{a_row}");
    }

    #[test]
    fn what_another_program_says_is_refused() {
        let mut received = Received::default();
        let problem = workload::actuator(50);
        let population = workload::population(&problem, 3);
        let jobs = [Job {
            problem: &problem,
            population: &population,
        }];
        let Order::Evaluate(_, told) = Sent::default().order(&jobs).unwrap() else {
            panic!("another order");
        };
        assert!(received.jobs(&[], told, &[1.0]).is_err());
        assert!(received.data.len() == 1);
        received.jobs(&[1], Vec::new(), &[]).unwrap();
        assert!(received.data.is_empty());
        assert!(from_bytes::<Order>(&[200, 1, 2]).is_err());
    }
}
