//! Whether an evaluator computes right: samples of its costs against the CPU's in f64.
//!
//! An adapter that rounds its own way may be unlucky with a candidate. One that disagrees therefore only calls for a larger
//! second sample, and [`ENOUGH`] among the last [`WINDOW`] that say anything condemn the evaluator. One that is right but
//! for a candidate in a thousand is condemned in 4 of 100 000 second samples, one that is wrong in one of ten in 96 of 100.

use super::judgement::{Judgement, PARITY};
use super::problem::Data;
use super::{Cost, CpuEvaluator, Evaluator, Job, Population, Precision, Problem};
use crate::model::Structure;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

/// In how many ways the values of a candidate are rounded anew to see what rounding does.
const NUDGES: usize = 7;
/// By which share each value is moved then: two units in the last place of an f32.
const NUDGE: f64 = 2.4e-7;
/// How many calls on a problem are sampled in any case on a device.
const DUE: u32 = 2;
/// The judgements that count: the last ones.
const WINDOW: usize = 64;
/// How many of them condemn where they find a cost wrong.
const ENOUGH: usize = 3;

/// How closely an evaluator is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Care {
    /// As a device with a driver and a compiler of its own: the first two calls on each problem are sampled, later ones as
    /// far as that takes less than a twentieth of the time.
    Device,
    /// As this CPU, which runs the same code for all: the first call is sampled, later ones as far as that takes less than
    /// a hundredth of the time.
    Cpu,
}

impl Care {
    /// Candidates in a sample: what a CPU's vectors compute at once.
    fn sample(self) -> usize {
        match self {
            Self::Device => 16,
            Self::Cpu => 4,
        }
    }

    /// Share of the evaluations' time that re-scoring may take.
    fn share(self) -> f64 {
        match self {
            Self::Device => 0.05,
            Self::Cpu => 0.01,
        }
    }
}

/// A problem, as far as it makes a shader and data of its own.
struct Known {
    data: Weak<Data>,
    structure: Structure,
    fixed: Vec<bool>,
    own_loss: bool,
    calls: u32,
}

impl Known {
    fn is(&self, problem: &Problem) -> bool {
        let fixed = problem.parameters.iter().map(|p| p.fixed);
        self.data.as_ptr() == Arc::as_ptr(&problem.data)
            && self.own_loss == problem.loss.is_some()
            && self.structure == problem.structure
            && self.fixed.iter().copied().eq(fixed)
    }
}

/// A candidate's place: the job, and which of its candidates.
type Place = (usize, usize);

/// Re-scores samples of what an evaluator computes.
pub(super) struct Referee {
    care: Care,
    double: CpuEvaluator,
    single: CpuEvaluator,
    known: Vec<Known>,
    /// The last judgements that were not open.
    window: VecDeque<Judgement>,
    complaint: Option<String>,
    random: ChaCha8Rng,
    /// How long the evaluator has computed, how long it was re-scored, and how long that took last.
    evaluating: Duration,
    checking: Duration,
    last: Duration,
}

impl Referee {
    pub(super) fn new(care: Care) -> Self {
        let witness = match care {
            Care::Device => CpuEvaluator::new,
            Care::Cpu => CpuEvaluator::without_vectors,
        };
        Self {
            care,
            double: witness(Precision::F64),
            single: witness(Precision::F32),
            known: Vec::new(),
            window: VecDeque::new(),
            complaint: None,
            random: ChaCha8Rng::seed_from_u64(1),
            evaluating: Duration::ZERO,
            checking: Duration::ZERO,
            last: Duration::ZERO,
        }
    }

    /// What is wrong with the evaluator that has taken `time` for these `costs`, as far as it is known: `None` where
    /// nothing is. What was found wrong once stays so.
    pub(super) fn complaint(
        &mut self,
        jobs: &[Job<'_>],
        costs: &[Vec<Cost>],
        time: Duration,
    ) -> Option<String> {
        self.evaluating += time;
        if self.complaint.is_none() {
            let first = self.sample(jobs, costs);
            if first.is_empty() {
                return None;
            }
            let start = Instant::now();
            let suspect = self.hear(jobs, costs, &first);
            if !suspect.is_empty() && self.complaint.is_none() {
                let second = self.second_sample(jobs, &first, &suspect);
                self.hear(jobs, costs, &second);
            }
            self.last = start.elapsed();
            self.checking += self.last;
        }
        self.complaint.clone()
    }

    /// The candidates of this call that are looked at in any case: of each job that is due the best, on which a search
    /// builds, and others.
    fn sample(&mut self, jobs: &[Job<'_>], costs: &[Vec<Cost>]) -> Vec<Place> {
        let filled: Vec<usize> = (0..jobs.len()).filter(|&i| !costs[i].is_empty()).collect();
        let mut due = Vec::new();
        if self.care == Care::Device {
            self.known.retain(|known| known.data.strong_count() > 0);
            due.extend(filled.iter().filter(|&&i| self.meet(jobs[i].problem) < DUE));
        }
        let allowed = self.evaluating.mul_f64(self.care.share());
        let first = self.checking.is_zero();
        let affordable = self.checking + self.last < allowed;
        if due.is_empty() && !filled.is_empty() && (first || affordable) {
            due.push(filled[self.random.random_range(0..filled.len())]);
        }
        let mut places = Vec::new();
        for number in due {
            let costs = &costs[number];
            let best = (0..costs.len()).min_by_key(|&i| costs[i]);
            let best = best.expect("a job with candidates");
            places.push((number, best));
            let mut others: Vec<usize> = (0..costs.len()).filter(|&i| i != best).collect();
            let (some, _) = others.partial_shuffle(&mut self.random, self.care.sample() - 1);
            places.extend(some.iter().map(|&i| (number, i)));
        }
        places
    }

    /// How many calls on `problem` there were before this one.
    fn meet(&mut self, problem: &Problem) -> u32 {
        if let Some(known) = self.known.iter_mut().find(|known| known.is(problem)) {
            known.calls += 1;
            return known.calls - 1;
        }
        self.known.push(Known {
            data: Arc::downgrade(&problem.data),
            structure: problem.structure.clone(),
            fixed: problem.parameters.iter().map(|p| p.fixed).collect(),
            own_loss: problem.loss.is_some(),
            calls: 1,
        });
        0
    }

    /// As many other candidates as judgements count, those of the `suspect` jobs before others.
    fn second_sample(
        &mut self,
        jobs: &[Job<'_>],
        first: &[Place],
        suspect: &[usize],
    ) -> Vec<Place> {
        let of_job = |(number, job): (usize, &Job)| {
            let candidates = 0..job.population.len();
            candidates.map(move |i| (number, i)).collect::<Vec<_>>()
        };
        let all = jobs.iter().enumerate().flat_map(of_job);
        let mut places: Vec<Place> = all.filter(|place| !first.contains(place)).collect();
        places.shuffle(&mut self.random);
        places.sort_by_key(|(number, _)| !suspect.contains(number));
        places.truncate(WINDOW);
        places.sort();
        places
    }

    /// Judges the costs at these places, sorted by job. Returns the jobs that have wrong ones.
    fn hear(&mut self, jobs: &[Job<'_>], costs: &[Vec<Cost>], places: &[Place]) -> Vec<usize> {
        let mut suspect = Vec::new();
        for (&(number, _), judgement) in places.iter().zip(self.judge(jobs, costs, places)) {
            match judgement {
                Judgement::Open => continue,
                Judgement::Right => {}
                Judgement::Wrong(_) => suspect.push(number),
            }
            if self.window.len() == WINDOW {
                self.window.pop_front();
            }
            self.window.push_back(judgement);
            self.complain();
        }
        suspect
    }

    /// Puts the evaluator's faults into words where they are enough.
    fn complain(&mut self) {
        let wrong: Vec<f64> = self.window.iter().filter_map(Judgement::fault).collect();
        if wrong.len() < ENOUGH {
            return;
        }
        let worst = wrong.iter().copied().fold(0.0, f64::max);
        let how = match worst.is_finite() {
            true => format!("by up to {worst:.1e} of them"),
            false => "in whether they diverge".into(),
        };
        let (count, judged) = (wrong.len(), self.window.len());
        self.complaint = Some(format!(
            "{count} of {judged} computed again in f64 differ {how}"
        ));
    }

    fn judge(&mut self, jobs: &[Job<'_>], costs: &[Vec<Cost>], places: &[Place]) -> Vec<Judgement> {
        let candidate = |&(number, i): &Place| jobs[number].population.candidate(i);
        let given = |&(number, i): &Place| costs[number][i];
        let references = compute(&mut self.double, jobs, places, |place, population| {
            population.push(candidate(place));
        });
        let apart: Vec<usize> = (0..places.len())
            .filter(|&k| given(&places[k]).difference(&references[k]) > PARITY)
            .collect();
        let doubtful: Vec<Place> = apart.iter().map(|&k| places[k]).collect();
        let random = &mut self.random;
        let twins = compute(&mut self.single, jobs, &doubtful, |place, population| {
            population.push(candidate(place));
            for _ in 0..NUDGES {
                let mut nudge = |value: &f64| match random.random() {
                    true => value * (1.0 + NUDGE),
                    false => value * (1.0 - NUDGE),
                };
                let nudged: Vec<f64> = candidate(place).iter().map(&mut nudge).collect();
                population.push(&nudged);
            }
        });
        let mut judgements = vec![Judgement::Right; places.len()];
        for (k, twins) in apart.into_iter().zip(twins.chunks_exact(1 + NUDGES)) {
            judgements[k] = Judgement::new(given(&places[k]), references[k], twins);
        }
        judgements
    }
}

/// The costs of the candidates that `each` adds for every place, in order. Places of one job are next to each other, so
/// that they are computed together.
fn compute(
    evaluator: &mut CpuEvaluator,
    jobs: &[Job<'_>],
    places: &[Place],
    mut each: impl FnMut(&Place, &mut Population),
) -> Vec<Cost> {
    let groups: Vec<(&Problem, Population)> = places
        .chunk_by(|one, other| one.0 == other.0)
        .map(|places| {
            let job = jobs[places[0].0];
            let mut population = Population::new(job.population.dimension());
            places.iter().for_each(|place| each(place, &mut population));
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
    fn sampled(referee: &mut Referee, problem: &Problem, time: Duration) -> [bool; 5] {
        [(); 5].map(|()| {
            let population = workload::population(problem, 60);
            let job = Job {
                problem,
                population: &population,
            };
            let costs = CpuEvaluator::new(Precision::F32).costs_of(&[job]);
            let before = referee.checking;
            let complaint = referee.complaint(&[job], &costs.expect("costs"), time);
            assert_eq!(complaint, None);
            referee.checking > before
        })
    }

    #[test]
    fn a_device_is_sampled_twice_on_each_problem_and_then_as_time_allows() {
        let mut referee = Referee::new(Care::Device);
        let twice = [true, true, false, false, false];
        let problems = [workload::actuator(50), workload::actuator_and_valve(50)];
        for problem in &problems {
            assert_eq!(sampled(&mut referee, problem, Duration::ZERO), twice);
        }
        // The same data with another structure, and the same structure on other data.
        let fixed = {
            let mut problem = problems[0].clone();
            problem.parameters[0].fixed = true;
            problem
        };
        for problem in [&fixed, &workload::actuator(50)] {
            assert_eq!(sampled(&mut referee, problem, Duration::ZERO), twice);
        }
        let hour = Duration::from_secs(3600);
        assert_eq!(sampled(&mut referee, &problems[0], hour), [true; 5]);
    }

    #[test]
    fn the_cpu_is_sampled_once_and_then_as_time_allows() {
        let mut referee = Referee::new(Care::Cpu);
        let problems = [workload::actuator(50), workload::actuator_and_valve(50)];
        let once = [true, false, false, false, false];
        assert_eq!(sampled(&mut referee, &problems[0], Duration::ZERO), once);
        assert_eq!(
            sampled(&mut referee, &problems[1], Duration::ZERO),
            [false; 5]
        );
        let hour = Duration::from_secs(3600);
        assert_eq!(sampled(&mut referee, &problems[1], hour), [true; 5]);
    }

    #[test]
    fn re_scoring_takes_no_more_than_its_share() {
        let problem = workload::actuator(200);
        for care in [Care::Device, Care::Cpu] {
            let mut referee = Referee::new(care);
            let mut expected = Duration::ZERO;
            for _ in 0..200 {
                sampled(&mut referee, &problem, Duration::from_micros(500));
                if expected.is_zero() {
                    // What is sampled in any case.
                    expected = referee.checking;
                }
            }
            let share = referee.evaluating.mul_f64(care.share());
            let most = expected.max(share) + referee.last;
            assert!(
                referee.checking <= most,
                "{care:?}: {:?} {most:?}",
                referee.checking
            );
        }
    }
}
