use super::*;
use crate::evaluate::devices::cpu::{CpuEvaluator, Precision};
use crate::evaluate::{Problem, workload};
use std::sync::mpsc::{Sender, channel};
use std::thread::sleep;
use std::time::Duration;

fn cpu() -> Result<Box<dyn Evaluator>> {
    Ok(Box::new(CpuEvaluator::new(Precision::F32)))
}

/// So many ranks, the first of them of this thread; the others compute with what `open` makes.
fn ranks(count: usize, open: fn() -> Result<Box<dyn Evaluator>>) -> Result<Ranks> {
    let own = Box::new(Own::new(cpu()?)) as Box<dyn Rank>;
    let others = (1..count).map(|_| Box::new(OnThread::open(open)) as Box<dyn Rank>);
    Ranks::new("rank", std::iter::once(own).chain(others).collect())
}

fn bits(costs: &[Vec<Cost>]) -> Vec<Vec<u64>> {
    let of_job = |costs: &Vec<Cost>| costs.iter().map(|cost| cost.value.to_bits()).collect();
    costs.iter().map(of_job).collect()
}

#[test]
fn ranks_compute_the_same_bits_as_one_device_in_the_same_order() {
    let problems: [Problem; 3] = [
        workload::actuator(300),
        workload::actuator_and_valve(100),
        workload::with_effects(&["friction"], 80),
    ];
    let populations: Vec<Population> = [1000, 1, 37]
        .into_iter()
        .zip(&problems)
        .map(|(size, problem)| workload::population(problem, size))
        .collect();
    let jobs: Vec<Job<'_>> = problems
        .iter()
        .zip(&populations)
        .map(|(problem, population)| Job {
            problem,
            population,
        })
        .collect();
    let expected = bits(&cpu().unwrap().costs_of(&jobs).unwrap());
    for count in [1, 2, 3, 4, 7] {
        let mut ranks = ranks(count, cpu).unwrap();
        for _ in 0..2 {
            assert!(
                bits(&ranks.costs_of(&jobs).unwrap()) == expected,
                "{count} ranks"
            );
        }
    }
    // Fewer candidates than ranks, and none.
    let mut ranks = ranks(4, cpu).unwrap();
    for size in [0, 1, 3] {
        let population = workload::population(&problems[0], size);
        let costs = ranks.costs(&problems[0], &population).unwrap();
        assert_eq!(costs.len(), size);
    }
}

/// A device that fails, panics or is unlike the others.
struct Odd(&'static str);

impl Evaluator for Odd {
    fn describe(&self) -> String {
        self.0.into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        match self.0 {
            _ if jobs.is_empty() => Ok(Vec::new()),
            "fails" => Err(Error::failed("it is broken", "mend it")),
            "panics" => panic!("it panics"),
            _ => {
                let of = |job: &Job<'_>| vec![Cost::finished(1.0); job.population.len()];
                Ok(jobs.iter().map(of).collect())
            }
        }
    }

    fn take_warnings(&mut self) -> Vec<String> {
        vec!["it is odd".into()]
    }

    fn refusals(&self) -> u32 {
        3
    }
}

#[test]
fn a_rank_that_fails_is_named_and_the_next_question_is_answered_for_itself() {
    let problem = workload::actuator(50);
    let population = workload::population(&problem, 8);
    for (open, words) in [
        (
            (|| Ok(Box::new(Odd("fails")) as Box<dyn Evaluator>)) as fn() -> _,
            "rank 1: it is broken; mend it",
        ),
        (
            || Ok(Box::new(Odd("panics"))),
            "rank 1: the program failed there",
        ),
    ] {
        let mut ranks = ranks(3, open).unwrap();
        for _ in 0..2 {
            let error = ranks.costs(&problem, &population).unwrap_err();
            assert!(error.to_string().starts_with(words), "{error}");
        }
        let first = population.part(0..1);
        // It goes to the last rank alone, and fails there.
        assert!(
            ranks
                .costs(&problem, &first)
                .unwrap_err()
                .to_string()
                .contains("rank 2")
        );
    }
    let unopened = ranks(2, || Err(Error::failed("there is none", "look elsewhere")));
    let error = unopened.err().unwrap().to_string();
    assert_eq!(error, "rank 1: there is none; look elsewhere");
}

#[test]
fn unlike_devices_are_told_apart_and_what_they_warn_of_is_heard() {
    let like = ranks(3, cpu).unwrap().describe();
    assert!(like.starts_with("3 ranks, each on CPU (f32"), "{like}");
    let mut unlike = ranks(3, || Ok(Box::new(Odd("odd")))).unwrap();
    let told = unlike.describe();
    assert!(told.starts_with("3 ranks: 0 on CPU (f32"), "{told}");
    assert!(
        told.ends_with("; 1, 2 on odd; their costs may differ in the last bits"),
        "{told}"
    );
    assert_eq!(
        unlike.take_warnings(),
        ["rank 1: it is odd", "rank 2: it is odd"]
    );
    assert_eq!(unlike.refusals(), 6);
}

/// A device that takes its time to close.
struct Slow(Sender<()>);

impl Evaluator for Slow {
    fn describe(&self) -> String {
        "slow".into()
    }

    fn costs_of(&mut self, _jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        Ok(Vec::new())
    }
}

impl Drop for Slow {
    fn drop(&mut self) {
        sleep(Duration::from_millis(100));
        self.0.send(()).unwrap();
    }
}

#[test]
fn what_a_thread_has_opened_is_closed_when_its_rank_is() {
    let (closed, was_closed) = channel();
    drop(OnThread::open(|| Ok(Box::new(Slow(closed)))));
    assert!(was_closed.try_recv().is_ok());
}
