//! A rank on a thread of this process: one of several devices of one machine.

use super::{Answer, Rank};
use crate::evaluate::{Evaluator, Job, Population, Problem};
use crate::{Error, Result};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// A device that computes on a thread of its own.
pub struct OnThread {
    orders: Sender<Vec<(Problem, Population)>>,
    answers: Receiver<Result<Answer>>,
    // It is dropped after `orders`, whose end ends the thread.
    _thread: Joined,
}

/// A thread that has ended, with all that it opened, when this is dropped: a driver that is closed while the program ends
/// crashes it.
struct Joined(Option<JoinHandle<()>>);

impl Drop for Joined {
    fn drop(&mut self) {
        // A panic in it was printed there.
        let _ = self.0.take().map(JoinHandle::join);
    }
}

impl OnThread {
    /// One with the evaluator that `open` makes, on its thread.
    pub fn open(open: impl FnOnce() -> Result<Box<dyn Evaluator>> + Send + 'static) -> Self {
        let (orders, ordered) = channel::<Vec<(Problem, Population)>>();
        let (answer, answers) = channel();
        let thread = thread::spawn(move || {
            let opened = open().and_then(|mut evaluator| {
                let first = Answer::of(evaluator.as_mut(), &[])?;
                Ok((evaluator, first))
            });
            let mut evaluator = match opened {
                Ok((evaluator, first)) => {
                    // Nobody hears it who has gone; the same below.
                    let _ = answer.send(Ok(first));
                    evaluator
                }
                Err(error) => {
                    let _ = answer.send(Err(error));
                    return;
                }
            };
            for order in ordered {
                let jobs = order.iter().map(|(problem, population)| Job {
                    problem,
                    population,
                });
                let jobs: Vec<Job<'_>> = jobs.collect();
                let _ = answer.send(Answer::of(evaluator.as_mut(), &jobs));
            }
        });
        Self {
            orders,
            answers,
            _thread: Joined(Some(thread)),
        }
    }
}

impl Rank for OnThread {
    fn begin(&mut self, jobs: &[Job<'_>]) -> Result<()> {
        let order = jobs
            .iter()
            .map(|job| (job.problem.clone(), job.population.clone()));
        self.orders.send(order.collect()).map_err(|_| gone())
    }

    fn end(&mut self) -> Result<Answer> {
        self.answers.recv().unwrap_or_else(|_| Err(gone()))
    }
}

fn gone() -> Error {
    Error::failed("its thread has ended", "name other devices")
}
