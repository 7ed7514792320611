//! Many jobs and searches at once on every evaluator, and what the GPU evaluator does with time, memory and a device
//! that is lost.
//!
//! `SERVOBEE_SKIP_GPU=1` lets these tests pass on a machine without an adapter, and says so.

use crate::common;
use crate::common::{Record, case, near_start, problem, random};
use servobee::evaluate::gpu::{Checks, GpuEvaluator, InjectedFault};
use servobee::evaluate::{
    Cost, CpuEvaluator, Evaluator, Job, PARITY, Population, Precision, Problem,
};
use servobee::model::{Hold, Outputs};
use servobee::search::{Plan, Settings, fit, fit_all};
use std::ops::ControlFlow;
use std::sync::Arc;

/// [`common::gpu`] without the driver's checks.
fn gpu() -> Option<GpuEvaluator> {
    common::gpu(Checks::Off)
}

/// A job for each problem and its population.
fn jobs<'a>(
    problems: impl IntoIterator<Item = &'a Problem>,
    populations: &'a [Population],
) -> Vec<Job<'a>> {
    let job = |(problem, population)| Job {
        problem,
        population,
    };
    problems.into_iter().zip(populations).map(job).collect()
}

/// Every evaluator of this machine.
fn evaluators() -> Vec<Box<dyn Evaluator>> {
    let mut list: Vec<Box<dyn Evaluator>> = vec![
        Box::new(CpuEvaluator::new(Precision::F64)),
        Box::new(CpuEvaluator::new(Precision::F32)),
    ];
    if let Some(gpu) = gpu() {
        list.push(Box::new(gpu));
    }
    list
}

fn bits(costs: &[Cost]) -> Vec<u64> {
    costs.iter().map(|cost| cost.value.to_bits()).collect()
}

#[test]
fn a_job_costs_among_others_what_it_costs_alone() {
    // Records and tones of several structures; the same problem twice, and one job without candidates.
    let names = [
        ("actuator, held", 70),
        ("tones, paper", 3),
        ("records of many lengths", 5),
        ("actuator, held", 1),
        ("table valve", 0),
        ("actuator and table valve", 130),
        ("tones, settled", 65),
    ];
    let problems = names.map(|(name, _)| case(name).problem);
    let populations: Vec<Population> = problems
        .iter()
        .zip(names)
        .zip(1..)
        .map(|((problem, (_, count)), seed)| random(problem, count, seed))
        .collect();
    let jobs = jobs(&problems, &populations);
    for mut evaluator in evaluators() {
        let name = evaluator.describe();
        let together = evaluator.costs_of(&jobs).expect("costs");
        assert_eq!(together.len(), jobs.len());
        for (costs, job) in together.iter().zip(&jobs) {
            assert_eq!(costs.len(), job.population.len(), "{name}");
            let alone = evaluator.costs(job.problem, job.population).expect("costs");
            assert_eq!(bits(costs), bits(&alone), "{name}");
        }
    }
}

#[test]
fn many_small_jobs_at_once_cost_what_each_costs_alone() {
    let problem = case("actuator, held").problem;
    // Constants of their own on data that all share.
    let problems: Vec<Problem> = (0..40)
        .map(|i| Problem {
            scale: Outputs::all(1.0 + f64::from(i)),
            ..problem.clone()
        })
        .collect();
    let populations: Vec<Population> = (0..40).map(|i| random(&problem, 1 + i % 5, 9)).collect();
    let jobs = jobs(&problems, &populations);
    for mut evaluator in evaluators() {
        let together = evaluator.costs_of(&jobs).expect("costs");
        for (costs, job) in together.iter().zip(&jobs) {
            let alone = evaluator.costs(job.problem, job.population).expect("costs");
            assert_eq!(bits(costs), bits(&alone));
        }
    }
}

/// A plan with `generations` after the scouts.
fn plan(generations: usize, seed: u64, polish: bool) -> Plan {
    let settings = Settings {
        itr: generations,
        ..Settings::paper()
    };
    Plan {
        method: Arc::new(settings),
        polish,
        coloured: false,
        ..Plan::of_records(seed)
    }
}

#[test]
fn a_search_finds_among_others_what_it_finds_alone() {
    // Records and tones of several structures, and the same problem twice: they end after 1 to 9 generations.
    let cases = [
        ("actuator, held", 4, true),
        ("tones, paper", 1, false),
        ("records of many lengths", 9, false),
        ("actuator, held", 2, true),
        ("actuator and table valve", 4, false),
        ("tones, settled", 6, false),
    ];
    let planned =
        |(seed, (name, generations, polish))| (case(name).problem, plan(generations, seed, polish));
    let tasks: Vec<(Problem, Plan)> = (1..).zip(cases).map(planned).collect();
    let tasks: Vec<(&Problem, &Plan)> = tasks
        .iter()
        .map(|(problem, plan)| (problem, plan))
        .collect();
    for mut evaluator in evaluators() {
        let name = evaluator.describe();
        let mut generations = Vec::new();
        let together = fit_all(&tasks, &mut *evaluator, &mut |done| {
            generations.push(done);
            ControlFlow::Continue(())
        });
        let together = together.expect("fits");
        assert_eq!(generations, Vec::from_iter(0..=9), "{name}");
        assert_eq!(together.len(), tasks.len(), "{name}");
        for ((found, (problem, plan)), (_, generations, _)) in
            together.iter().zip(&tasks).zip(cases)
        {
            let history = &found.search.history;
            assert_eq!(history.len(), generations + 1, "{name}");
            assert_eq!(found.polished.is_some(), plan.polish, "{name}");
            let alone = fit(problem, &mut *evaluator, plan, &mut |_| {
                ControlFlow::Continue(())
            })
            .expect("a fit");
            assert_eq!(bits(history), bits(&alone.search.history), "{name}");
            // Written out, an f64 is told from every other.
            assert_eq!(format!("{found:?}"), format!("{alone:?}"), "{name}");
        }
    }
}

/// Counts the jobs of each call.
struct Counting(CpuEvaluator, Vec<usize>);

impl Evaluator for Counting {
    fn describe(&self) -> String {
        self.0.describe()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> servobee::Result<Vec<Vec<Cost>>> {
        self.1.push(jobs.len());
        self.0.costs_of(jobs)
    }
}

#[test]
fn searches_are_evaluated_together_until_each_has_finished() {
    let free = case("actuator, held").problem;
    let mut fixed = free.clone();
    fixed.parameters.iter_mut().for_each(|p| p.set_fixed(true));
    let plans = [3, 1, 5, 3].map(|generations| plan(generations, 1, false));
    let mut tasks: Vec<(&Problem, &Plan)> = plans.iter().map(|plan| (&free, plan)).collect();
    tasks.insert(1, (&fixed, &plans[0]));
    let mut evaluator = Counting(CpuEvaluator::new(Precision::F32), Vec::new());
    let fits = fit_all(&tasks, &mut evaluator, &mut |_| ControlFlow::Continue(())).expect("fits");
    assert_eq!(evaluator.1, [4, 4, 3, 3, 1, 1]);
    assert_eq!((fits[1].evaluations, fits[1].values()), (1, &[][..]));
    assert_eq!(fits[1].cost(), fits[1].cost_at_start);
    let none = fit_all(&[], &mut evaluator, &mut |_| ControlFlow::Continue(())).expect("no fits");
    assert!(none.is_empty());
    assert_eq!(evaluator.1.len(), 6);
}

#[test]
fn no_jobs_have_no_costs() {
    for mut evaluator in evaluators() {
        assert!(evaluator.costs_of(&[]).expect("costs").is_empty());
    }
}

/// A structure whose commands arrive late, on a record of several chunks.
fn late() -> Problem {
    let mut effects = common::effects::cases().into_iter();
    let found = effects.find(|(name, _)| name == "delay, trial 2, Held, uneven");
    let (
        _,
        Problem {
            structure,
            parameters,
            ..
        },
    ) = found.expect("a delay");
    problem(structure, parameters, vec![Record::uneven(900, 3e-3, 12.0)])
}

#[test]
fn costs_do_not_depend_on_where_submissions_are_cut() {
    let Some(mut whole) = gpu() else { return };
    let names = [
        "records of many lengths",
        "actuator and table valve",
        "tones, paper",
    ];
    let named = names.map(|name| (name, case(name).problem));
    for (name, problem) in named.into_iter().chain([("late", late())]) {
        // More than a dispatch is cut below, and not a multiple of a workgroup.
        let population = random(&problem, 601, 3);
        let reference = whole.costs(&problem, &population).expect("costs");
        let submissions = whole.timings().submissions;
        // A chunk of rows and a few candidates at a time; some chunks.
        for seconds in [1e-9, 2e-3] {
            let mut cut = gpu().expect("an adapter, as above");
            cut.limit_submissions(seconds);
            for _ in 0..2 {
                let costs = cut.costs(&problem, &population).expect("costs");
                assert_eq!(bits(&costs), bits(&reference), "{name}, {seconds} s");
            }
            if seconds < 1e-6 {
                assert!(cut.timings().submissions > submissions, "{name}");
            }
            println!("{name}: {:?} instead of {submissions}", cut.timings());
        }
    }
}

/// Mesa's llvmpipe ends loops after 65 535 rounds of all of them together.
#[test]
fn no_loop_is_ended_early() {
    let Some(mut gpu) = gpu() else { return };
    let late = late();
    // Alone and with a limit of its speed, which is integrated in steps.
    let mut effects = common::effects::cases().into_iter();
    let found = effects.find(|(name, _)| name.starts_with("slew_limit"));
    let (_, mut slow) = found.expect("a limited speed");
    slow.structure.hold = Hold::Interpolated;
    for (name, structure, parameters) in [
        ("late", late.structure, late.parameters),
        ("slow", slow.structure, slow.parameters),
    ] {
        let long = problem(structure, parameters, vec![Record::new(8000, 1e-3, 12.0)]);
        // Few, so that time alone would let one dispatch take all rows.
        let population = near_start(&long, 4, 8);
        let costs = gpu.costs(&long, &population).expect("costs");
        let single = CpuEvaluator::new(Precision::F32).costs(&long, &population);
        for (cost, single) in costs.iter().zip(&single.expect("costs")) {
            let difference = cost.difference(single);
            println!("{name}: {difference:.1e}");
            assert!(difference <= PARITY, "{name}: {cost:?} {single:?}");
        }
    }
}

#[test]
fn records_that_do_not_fit_into_a_buffer_stream_through_two() {
    let Some(mut gpu) = gpu() else { return };
    let problem = case("records of many lengths").problem;
    let population = random(&problem, 70, 4);
    let whole = gpu.costs(&problem, &population).expect("costs");
    // 640 rows of five records at a time instead of up to 9192.
    gpu.limit_buffers(200_000);
    let streamed = gpu.costs(&problem, &population).expect("costs");
    assert_eq!(bits(&whole), bits(&streamed));
}

#[test]
fn a_late_command_needs_all_rows_in_one_buffer_and_says_so() {
    let Some(mut gpu) = gpu() else { return };
    let problem = late();
    gpu.limit_buffers(11_000);
    let refusal = gpu.costs(&problem, &random(&problem, 2, 4));
    let error = refusal.expect_err("more rows than fit").to_string();
    assert!(
        error.contains("late command") && error.contains("--evaluator cpu"),
        "{error}"
    );
}

#[test]
fn data_stay_on_the_device() {
    let Some(mut gpu) = gpu() else { return };
    let problems = ["actuator, held", "table valve", "tones, paper"].map(|name| case(name).problem);
    let shared = Problem {
        scale: Outputs::all(3.0),
        ..problems[0].clone()
    };
    let populations = [&problems[0], &problems[1], &problems[2], &shared].map(|p| random(p, 9, 7));
    let all = [&problems[0], &problems[1], &problems[2], &shared];
    let jobs = jobs(all, &populations);
    gpu.costs_of(&jobs).expect("costs");
    let first = gpu.timings().uploaded;
    assert!(first > 0);
    for job in &jobs {
        gpu.costs(job.problem, job.population).expect("costs");
        assert_eq!(gpu.timings().uploaded, 0);
    }
    // What a device has had is lost with it.
    gpu.inject(InjectedFault::Lost, 0, 1);
    gpu.costs(jobs[0].problem, jobs[0].population)
        .expect("costs");
    assert!((1..first).contains(&gpu.timings().uploaded));
}

#[test]
fn a_lost_device_is_replaced_and_changes_no_cost() {
    let Some(mut gpu) = gpu() else { return };
    let problem = case("records of many lengths").problem;
    let population = random(&problem, 40, 5);
    gpu.limit_submissions(1e-9);
    let reference = gpu.costs(&problem, &population).expect("costs");
    for (after, times) in [(0, 1), (1, 1), (7, 2), (0, 4)] {
        gpu.inject(InjectedFault::Lost, after, times);
        let costs = gpu
            .costs(&problem, &population)
            .expect("costs from another device");
        assert_eq!(bits(&costs), bits(&reference), "{after} {times}");
    }
}

#[test]
fn a_device_that_is_always_lost_is_an_error() {
    let Some(mut gpu) = gpu() else { return };
    let problem = case("actuator, held").problem;
    let population = random(&problem, 40, 5);
    gpu.inject(InjectedFault::Lost, 0, u32::MAX);
    let error = gpu.costs(&problem, &population).expect_err("no device");
    assert_eq!(error.exit_code(), 1);
    assert!(error.to_string().contains("--evaluator cpu"), "{error}");
    // Not for ever: what was lost is replaced at the next call.
    gpu.inject(InjectedFault::Lost, 0, 0);
    assert!(gpu.costs(&problem, &population).is_ok());
}

#[test]
fn costs_do_not_depend_on_the_size_of_a_workgroup() {
    let Some(mut gpu) = gpu() else { return };
    for name in ["actuator, held", "tones, settled"] {
        let problem = case(name).problem;
        let population = random(&problem, 300, 6);
        let reference = gpu.costs(&problem, &population).expect("costs");
        for count in [32, 128, 256, 64] {
            gpu.set_workgroup(count)
                .expect("a size that every adapter has");
            let costs = gpu.costs(&problem, &population).expect("costs");
            assert_eq!(bits(&costs), bits(&reference), "{name}, {count}");
        }
    }
    assert!(gpu.set_workgroup(1 << 20).is_err());
}

#[test]
fn timings_say_where_the_time_went() {
    let Some(mut gpu) = gpu() else { return };
    let problem = case("actuator, held").problem;
    let population = random(&problem, 300, 6);
    gpu.costs(&problem, &population).expect("costs");
    let first = gpu.timings();
    println!("{first:?}");
    assert!(
        first.compile > 0.0 && first.upload > 0.0 && first.kernel > 0.0 && first.readback > 0.0
    );
    assert!(first.submissions >= 1 && first.longest <= first.kernel);
    gpu.costs(&problem, &population).expect("costs");
    // The shader is known.
    assert!(gpu.timings().compile < first.compile);
    gpu.costs_of(&[]).expect("no costs");
    assert_eq!(gpu.timings().submissions, 0);
}
