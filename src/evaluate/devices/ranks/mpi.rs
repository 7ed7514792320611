//! Ranks in the processes that a launcher of MPI, `mpirun` or `srun`, has started for one run.
//!
//! Rank 0 goes the way of any run; the others serve it until it ends. Point to point, so that each is told no more than its slice,
//! and a rank without one is left in peace.

use super::wire::{Order, Received, Sent, from_bytes, to_bytes};
use super::{Answer, Own, Rank, Ranks};
use crate::evaluate::devices::choose::{Chosen, Devices};
use crate::evaluate::{Evaluator, Job};
use crate::{Error, Result};
use mpi::environment::Universe;
use mpi::point_to_point::{Destination, Source};
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::{Threading, initialize_with_threading};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{sleep, yield_now};
use std::time::{Duration, Instant};

/// Longest message, in bytes: MPI counts with 31 bits.
const LONGEST: usize = 1 << 30;

/// How long a rank that waits asks again at once; after that it lets others have the core.
const EAGER: Duration = Duration::from_millis(1);
/// Longest pause between two questions.
const PAUSE: Duration = Duration::from_micros(200);

/// What an answer says beside its costs, or the problem and the remedy of an error.
type Said = std::result::Result<Answer, (String, String)>;

static BYTES: AtomicU64 = AtomicU64::new(0);

/// All the processes of one run.
pub struct World {
    // Dropped last, which ends MPI.
    universe: Universe,
    /// Which of the processes on the same machine this is.
    place: usize,
}

impl World {
    /// Joins the others; each process does so once, before anything else.
    ///
    /// # Errors
    /// MPI was begun before.
    pub fn join() -> Result<Self> {
        let (universe, _) = initialize_with_threading(Threading::Funneled)
            .ok_or_else(|| Error::failed("MPI was begun before", "begin it once"))?;
        let place = universe.world().split_shared(0).rank() as usize;
        Ok(Self { universe, place })
    }

    /// Which process this is, from 0 on.
    pub fn rank(&self) -> usize {
        self.universe.world().rank() as usize
    }

    /// How many there are.
    pub fn size(&self) -> usize {
        self.universe.world().size() as usize
    }

    /// On rank 0: the evaluator of all ranks, each of which chooses its own among `devices`.
    ///
    /// # Errors
    /// One of them has none of these.
    pub fn open(&self, devices: &Devices) -> Result<Chosen> {
        let others: Vec<Remote> = (1..self.size())
            .map(|rank| Remote::of(rank as i32))
            .collect();
        for rank in &others {
            rank.tell(&Order::Open(devices.to_string()));
        }
        let own = devices.choose(self.place);
        let (why, own): (_, Box<dyn Rank>) = match own {
            Ok(chosen) => (chosen.why, Box::new(Own::new(chosen.evaluator))),
            Err(error) => {
                // What they answer is not for the next question.
                for mut rank in others {
                    let _ = rank.end();
                }
                return Err(error);
            }
        };
        let others = others
            .into_iter()
            .map(|rank| Box::new(rank) as Box<dyn Rank>);
        let all = Ranks::new("rank", std::iter::once(own).chain(others).collect())?;
        Ok(Chosen {
            evaluator: Box::new(all),
            why,
        })
    }

    /// On every other rank: evaluates what rank 0 tells it to, until that ends.
    ///
    /// # Errors
    /// Rank 0 is another program.
    pub fn serve(&self) -> Result<()> {
        let root = Link(0);
        let mut received = Received::default();
        let mut evaluator: Option<Box<dyn Evaluator>> = None;
        loop {
            let answer = match from_bytes(&root.hear())? {
                Order::End => return Ok(()),
                Order::Open(words) => self.chosen(&words).and_then(|chosen| {
                    let own = evaluator.insert(chosen.evaluator);
                    Answer::of(own.as_mut(), &[])
                }),
                Order::Evaluate(forgotten, told) => {
                    let values = root.hear();
                    let values: Vec<f64> = bytemuck::pod_collect_to_vec(&values);
                    received.jobs(&forgotten, told, &values).and_then(|jobs| {
                        let own = evaluator.as_mut().expect("opened before");
                        let jobs = jobs.iter().map(|(problem, population)| Job {
                            problem,
                            population,
                        });
                        Answer::of(own.as_mut(), &jobs.collect::<Vec<_>>())
                    })
                }
            };
            let costs = answer
                .as_ref()
                .map_or(Vec::new(), |answer| answer.costs.clone());
            let said: Said = answer.map_err(|error| match error {
                Error::Failed { problem, remedy } => (problem, remedy),
                other => (other.to_string(), "see there".into()),
            });
            root.say(&to_bytes(&said));
            root.say(bytemuck::cast_slice(&costs));
        }
    }

    fn chosen(&self, words: &str) -> Result<Chosen> {
        let devices: Devices = words
            .parse()
            .map_err(|words: String| Error::failed(words, "run the same program on all ranks"))?;
        devices.choose(self.place)
    }

    /// Bytes that this process has sent to others and received from them.
    pub fn bytes(&self) -> u64 {
        BYTES.load(Ordering::Relaxed)
    }

    /// On rank 0: tells the others that the run has ended.
    pub fn end(self) {
        for rank in 1..self.size() {
            Link(rank as i32).say(&to_bytes(&Order::End));
        }
    }
}

/// A rank in another process.
struct Remote {
    link: Link,
    sent: Sent,
}

impl Remote {
    fn of(rank: i32) -> Self {
        Self {
            link: Link(rank),
            sent: Sent::default(),
        }
    }

    fn tell(&self, order: &Order) {
        self.link.say(&to_bytes(order));
    }
}

impl Rank for Remote {
    fn begin(&mut self, jobs: &[Job<'_>]) -> Result<()> {
        let order = self.sent.order(jobs)?;
        self.tell(&order);
        let mut values = Vec::new();
        for job in jobs {
            values.extend_from_slice(job.population.values());
        }
        self.link.say(bytemuck::cast_slice(&values));
        Ok(())
    }

    fn end(&mut self) -> Result<Answer> {
        let said: Said = from_bytes(&self.link.hear())?;
        let costs = bytemuck::pod_collect_to_vec(&self.link.hear());
        let answer = said.map_err(|(problem, remedy)| Error::failed(problem, remedy))?;
        Ok(Answer { costs, ..answer })
    }
}

/// The way to one other process: bytes of any number, led by how many they are.
struct Link(i32);

impl Link {
    fn say(&self, bytes: &[u8]) {
        let world = SimpleCommunicator::world();
        let other = world.process_at_rank(self.0);
        count(bytes);
        other.send(&(bytes.len() as u64));
        for part in bytes.chunks(LONGEST) {
            other.send(part);
        }
    }

    /// Waits without taking a core from those that compute.
    fn hear(&self) -> Vec<u8> {
        let world = SimpleCommunicator::world();
        let other = world.process_at_rank(self.0);
        let begun = Instant::now();
        let length = loop {
            match other.immediate_matched_probe() {
                Some((message, _)) => break message.matched_receive::<u64>().0,
                None if begun.elapsed() < EAGER => yield_now(),
                None => sleep(PAUSE.min(begun.elapsed() / 16)),
            }
        };
        let mut bytes = vec![0; length as usize];
        for part in bytes.chunks_mut(LONGEST) {
            other.receive_into(part);
        }
        count(&bytes);
        bytes
    }
}

/// Counts a message, with the number that leads it.
fn count(bytes: &[u8]) {
    BYTES.fetch_add(8 + bytes.len() as u64, Ordering::Relaxed);
}
