//! Whether an evaluator computes right: samples of its costs are compared with those of the CPU in f64.
//!
//! A right evaluator may differ on a few candidates, because its device rounds in its own way. A difference therefore only
//! leads to a second, larger sample, and the evaluator counts as wrong when [`TOO_MANY`] of the last [`WINDOW`] conclusive
//! comparisons differ. An evaluator that is right but for one candidate in a thousand is rejected in 4 of 100 000 second
//! samples, one that is wrong in one candidate of ten in 96 of 100.

use crate::evaluate::checking::judgement::{Judgement, PARITY};
use crate::evaluate::devices::cpu::{CpuEvaluator, Precision};
use crate::evaluate::evaluator::{Evaluator, Job};
use crate::evaluate::population::{Cost, Population};
use crate::evaluate::problem::Problem;
use crate::evaluate::problem::identity::Identity;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

/// How often a candidate is computed again with its values rounded at random, to see what rounding does to its cost.
const ROUNDINGS: usize = 7;
/// By which share each value is moved then: two units in the last place of an f32.
const ROUNDING: f64 = 2.4e-7;
/// The calls on each problem of a device that are sampled whatever time it takes: the first ones.
const ALWAYS_SAMPLED: u32 = 2;
/// How many conclusive comparisons are kept.
const WINDOW: usize = 64;
/// How many of them must differ for the evaluator to be wrong.
const TOO_MANY: usize = 3;

/// How thoroughly an evaluator's costs are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thoroughness {
    /// For a device with a driver and a compiler of its own: the first two calls on each problem are sampled, later ones as
    /// far as that takes less than a twentieth of the time.
    Device,
    /// For this CPU, which runs the same code for all problems: the first call is sampled, later ones as far as that takes
    /// less than a hundredth of the time.
    Cpu,
}

impl Thoroughness {
    /// Candidates in a sample: what a CPU's vectors compute at once.
    fn sample(self) -> usize {
        match self {
            Self::Device => 16,
            Self::Cpu => 4,
        }
    }

    /// Share of the evaluations' time that checking may take.
    fn share(self) -> f64 {
        match self {
            Self::Device => 0.05,
            Self::Cpu => 0.01,
        }
    }
}

/// The job, and which of its candidates.
type Candidate = (usize, usize);

/// Checks samples of the costs that one evaluator computes.
pub(in crate::evaluate) struct CrossCheck {
    thoroughness: Thoroughness,
    double: CpuEvaluator,
    single: CpuEvaluator,
    /// Calls on each problem.
    calls: HashMap<Identity, u32>,
    /// The last conclusive comparisons.
    window: VecDeque<Judgement>,
    /// What is wrong with the evaluator, once that is known.
    fault: Option<String>,
    random: ChaCha8Rng,
    /// How long the evaluator has computed, how long checks have taken, and how long the last one.
    evaluating: Duration,
    checking: Duration,
    last: Duration,
}

impl CrossCheck {
    pub(in crate::evaluate) fn new(thoroughness: Thoroughness) -> Self {
        let reference = match thoroughness {
            Thoroughness::Device => CpuEvaluator::new,
            Thoroughness::Cpu => CpuEvaluator::without_vectors,
        };
        Self {
            thoroughness,
            double: reference(Precision::F64),
            single: reference(Precision::F32),
            calls: HashMap::new(),
            window: VecDeque::new(),
            fault: None,
            random: ChaCha8Rng::seed_from_u64(1),
            evaluating: Duration::ZERO,
            checking: Duration::ZERO,
            last: Duration::ZERO,
        }
    }

    /// Checks the `costs` that the evaluator has computed in `time`. Returns what is wrong with the evaluator, if anything;
    /// once found, it stays wrong.
    pub(in crate::evaluate) fn check(
        &mut self,
        jobs: &[Job<'_>],
        costs: &[Vec<Cost>],
        time: Duration,
    ) -> Option<String> {
        self.evaluating += time;
        if self.fault.is_none() {
            let first = self.sample(jobs, costs);
            if first.is_empty() {
                return None;
            }
            let start = Instant::now();
            let suspect = self.compare(jobs, costs, &first);
            if !suspect.is_empty() && self.fault.is_none() {
                let second = self.second_sample(jobs, &first, &suspect);
                self.compare(jobs, costs, &second);
            }
            self.last = start.elapsed();
            self.checking += self.last;
        }
        self.fault.clone()
    }

    /// The first sample of this call: of each job that is due the best candidate, on which a search builds, and some others.
    fn sample(&mut self, jobs: &[Job<'_>], costs: &[Vec<Cost>]) -> Vec<Candidate> {
        let filled: Vec<usize> = (0..jobs.len()).filter(|&i| !costs[i].is_empty()).collect();
        let mut due = Vec::new();
        if self.thoroughness == Thoroughness::Device {
            self.calls.retain(|problem, _| problem.data.is_alive());
            for &number in &filled {
                let calls = self.calls.entry(Identity::of(jobs[number].problem));
                let calls = calls.or_default();
                if *calls < ALWAYS_SAMPLED {
                    due.push(number);
                    *calls += 1;
                }
            }
        }
        let allowed = self.evaluating.mul_f64(self.thoroughness.share());
        let first = self.checking.is_zero();
        let affordable = self.checking + self.last < allowed;
        if due.is_empty() && !filled.is_empty() && (first || affordable) {
            due.push(filled[self.random.random_range(0..filled.len())]);
        }
        let mut chosen = Vec::new();
        for number in due {
            let costs = &costs[number];
            let best = (0..costs.len()).min_by_key(|&i| costs[i]);
            let best = best.expect("a job with candidates");
            chosen.push((number, best));
            let mut others: Vec<usize> = (0..costs.len()).filter(|&i| i != best).collect();
            let (some, _) =
                others.partial_shuffle(&mut self.random, self.thoroughness.sample() - 1);
            chosen.extend(some.iter().map(|&i| (number, i)));
        }
        chosen
    }

    /// A second sample of [`WINDOW`] other candidates, those of the `suspect` jobs before others.
    fn second_sample(
        &mut self,
        jobs: &[Job<'_>],
        first: &[Candidate],
        suspect: &[usize],
    ) -> Vec<Candidate> {
        let of_job = |(number, job): (usize, &Job)| {
            let candidates = 0..job.population.len();
            candidates.map(move |i| (number, i)).collect::<Vec<_>>()
        };
        let all = jobs.iter().enumerate().flat_map(of_job);
        let mut chosen: Vec<Candidate> = all.filter(|one| !first.contains(one)).collect();
        chosen.shuffle(&mut self.random);
        chosen.sort_by_key(|(number, _)| !suspect.contains(number));
        chosen.truncate(WINDOW);
        chosen.sort();
        chosen
    }

    /// Compares the costs of these candidates, sorted by job. Returns the jobs that have wrong ones.
    fn compare(
        &mut self,
        jobs: &[Job<'_>],
        costs: &[Vec<Cost>],
        chosen: &[Candidate],
    ) -> Vec<usize> {
        let mut suspect = Vec::new();
        for (&(number, _), judgement) in chosen.iter().zip(self.judge(jobs, costs, chosen)) {
            match judgement {
                Judgement::Inconclusive => continue,
                Judgement::Right => {}
                Judgement::Wrong(_) => suspect.push(number),
            }
            if self.window.len() == WINDOW {
                self.window.pop_front();
            }
            self.window.push_back(judgement);
            self.decide();
        }
        suspect
    }

    /// Decides whether the evaluator is wrong.
    fn decide(&mut self) {
        let wrong: Vec<f64> = self.window.iter().filter_map(Judgement::fault).collect();
        if wrong.len() < TOO_MANY {
            return;
        }
        let worst = wrong.iter().copied().fold(0.0, f64::max);
        let how = match worst.is_finite() {
            true => format!("by up to {worst:.1e} of them"),
            false => "in whether they diverge".into(),
        };
        let (count, judged) = (wrong.len(), self.window.len());
        self.fault = Some(format!(
            "{count} of {judged} computed again in f64 differ {how}"
        ));
    }

    /// What the costs at these chosen say, one by one.
    fn judge(
        &mut self,
        jobs: &[Job<'_>],
        costs: &[Vec<Cost>],
        chosen: &[Candidate],
    ) -> Vec<Judgement> {
        let candidate = |&(number, i): &Candidate| jobs[number].population.candidate(i);
        let given = |&(number, i): &Candidate| costs[number][i];
        let references = compute(&mut self.double, jobs, chosen, |one, population| {
            population.push(candidate(one));
        });
        let apart: Vec<usize> = (0..chosen.len())
            .filter(|&k| given(&chosen[k]).difference(&references[k]) > PARITY)
            .collect();
        let doubtful: Vec<Candidate> = apart.iter().map(|&k| chosen[k]).collect();
        let random = &mut self.random;
        let rounded = compute(&mut self.single, jobs, &doubtful, |one, population| {
            population.push(candidate(one));
            for _ in 0..ROUNDINGS {
                let mut round = |value: &f64| match random.random() {
                    true => value * (1.0 + ROUNDING),
                    false => value * (1.0 - ROUNDING),
                };
                let rounded: Vec<f64> = candidate(one).iter().map(&mut round).collect();
                population.push(&rounded);
            }
        });
        let mut judgements = vec![Judgement::Right; chosen.len()];
        for (k, rounded) in apart.into_iter().zip(rounded.chunks_exact(1 + ROUNDINGS)) {
            judgements[k] = Judgement::new(given(&chosen[k]), references[k], rounded);
        }
        judgements
    }
}

/// The costs of the candidates that `each` adds for each of the chosen ones, in order. Those of one job are next to each other,
/// so that they are computed together.
fn compute(
    evaluator: &mut CpuEvaluator,
    jobs: &[Job<'_>],
    chosen: &[Candidate],
    mut each: impl FnMut(&Candidate, &mut Population),
) -> Vec<Cost> {
    let groups: Vec<(&Problem, Population)> = chosen
        .chunk_by(|one, other| one.0 == other.0)
        .map(|chosen| {
            let job = jobs[chosen[0].0];
            let mut population = Population::new(job.population.dimension());
            chosen.iter().for_each(|one| each(one, &mut population));
            (job.problem, population)
        })
        .collect();
    let jobs: Vec<Job> = groups
        .iter()
        .map(|&(problem, ref population)| Job {
            problem,
            population,
        })
        .collect();
    let costs = evaluator.costs_of(&jobs);
    costs
        .expect("the CPU computes")
        .into_iter()
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    /// Which of some calls in a row on `problem` are sampled, each of which took `time`.
    fn sampled(check: &mut CrossCheck, problem: &Problem, time: Duration) -> [bool; 5] {
        [(); 5].map(|()| {
            let population = workload::population(problem, 60);
            let job = Job {
                problem,
                population: &population,
            };
            let costs = CpuEvaluator::new(Precision::F32).costs_of(&[job]);
            let before = check.checking;
            let fault = check.check(&[job], &costs.expect("costs"), time);
            assert_eq!(fault, None);
            check.checking > before
        })
    }

    #[test]
    fn a_device_is_sampled_twice_on_each_problem_and_then_as_time_allows() {
        let mut check = CrossCheck::new(Thoroughness::Device);
        let twice = [true, true, false, false, false];
        let problems = [workload::actuator(50), workload::actuator_and_valve(50)];
        for problem in &problems {
            assert_eq!(sampled(&mut check, problem, Duration::ZERO), twice);
        }
        // The same data with another structure, and the same structure on other data.
        let fixed = {
            let mut problem = problems[0].clone();
            problem.parameters[0].set_fixed(true);
            problem
        };
        for problem in [&fixed, &workload::actuator(50)] {
            assert_eq!(sampled(&mut check, problem, Duration::ZERO), twice);
        }
        let hour = Duration::from_secs(3600);
        assert_eq!(sampled(&mut check, &problems[0], hour), [true; 5]);
    }

    #[test]
    fn the_cpu_is_sampled_once_and_then_as_time_allows() {
        let mut check = CrossCheck::new(Thoroughness::Cpu);
        let problems = [workload::actuator(50), workload::actuator_and_valve(50)];
        let once = [true, false, false, false, false];
        assert_eq!(sampled(&mut check, &problems[0], Duration::ZERO), once);
        assert_eq!(
            sampled(&mut check, &problems[1], Duration::ZERO),
            [false; 5]
        );
        let hour = Duration::from_secs(3600);
        assert_eq!(sampled(&mut check, &problems[1], hour), [true; 5]);
    }

    #[test]
    fn checking_takes_no_more_than_its_share() {
        let problem = workload::actuator(200);
        for thoroughness in [Thoroughness::Device, Thoroughness::Cpu] {
            let mut check = CrossCheck::new(thoroughness);
            let mut expected = Duration::ZERO;
            for _ in 0..200 {
                sampled(&mut check, &problem, Duration::from_micros(500));
                if expected.is_zero() {
                    // What is sampled in any case.
                    expected = check.checking;
                }
            }
            let share = check.evaluating.mul_f64(thoroughness.share());
            let most = expected.max(share) + check.last;
            assert!(
                check.checking <= most,
                "{thoroughness:?}: {:?} {most:?}",
                check.checking
            );
        }
    }
}
