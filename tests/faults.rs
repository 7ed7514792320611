//! Evaluators that fail or compute wrong costs: what takes over, what is said of it, and that the result is the same.
//!
//! `SERVOBEE_SKIP_GPU=1` lets these tests pass on a machine without an adapter, and says so.

use crate::common;
use crate::common::{case, cases, near_start, on_bounds, random};
use crate::program::{BENCH, excerpt, printed, servobee_with, soak};
use servobee::diagnose::{Cut, IdentificationProblem, Identified, Options, identify};
use servobee::evaluate::checkpoint::results_in;
use servobee::evaluate::gpu::InjectedFault::{Hang, Lost, OutOfMemory, ShaderRefused};
use servobee::evaluate::gpu::{Checks, GpuEvaluator};
use servobee::evaluate::{
    Checkpoint, Cost, CpuEvaluator, Evaluator, Guarded, Job, Memory, PARITY, Population, Precision,
    Problem, Remembering, Standby, Thoroughness,
};
use servobee::model::effects::CATALOGUE;
use servobee::record::Record;
use servobee::search::{Fit, Plan, Settings, fit};
use servobee::{Error, Result};
use std::fs::read;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What takes over in these tests.
fn cpu() -> Standby {
    Standby::new("the CPU", Thoroughness::Cpu, || {
        Ok(CpuEvaluator::new(Precision::F32))
    })
}

fn device<E: Evaluator + 'static>(evaluator: E) -> Standby {
    Standby::new("the device under test", Thoroughness::Device, || {
        Ok(evaluator)
    })
}

fn bits(costs: &[Cost]) -> Vec<u64> {
    costs.iter().map(|cost| cost.value.to_bits()).collect()
}

/// The same problem on data of its own, so that nothing is known of it.
fn anew(problem: &Problem) -> Problem {
    Problem {
        data: Arc::new((*problem.data).clone()),
        ..problem.clone()
    }
}

fn plan() -> Plan {
    let settings = Settings {
        itr: 8,
        ..Settings::standard()
    };
    Plan {
        method: Arc::new(settings),
        coloured: false,
        ..Plan::of_records(3)
    }
}

fn fitted(problem: &Problem, evaluator: &mut dyn Evaluator) -> Result<Fit> {
    fit(problem, evaluator, &plan(), &mut |_| {
        ControlFlow::Continue(())
    })
}

/// What a device does to costs that are right.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Spoil {
    Scaled,
    OneInTen,
    Stale,
    Zeros,
    Shifted,
    Diverged,
    /// One candidate of a thousand.
    Rare,
}

/// A device that computes wrong costs after `right` calls.
struct Spoiled {
    right: u32,
    spoil: Spoil,
    inner: CpuEvaluator,
    last: Vec<Vec<Cost>>,
}

impl Spoiled {
    fn new(spoil: Spoil, right: u32) -> Self {
        Self {
            right,
            spoil,
            inner: CpuEvaluator::new(Precision::F32),
            last: Vec::new(),
        }
    }
}

impl Evaluator for Spoiled {
    fn describe(&self) -> String {
        "a device under test".into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let mut costs = self.inner.costs_of(jobs)?;
        let last = std::mem::replace(&mut self.last, costs.clone());
        if self.right > 0 {
            self.right -= 1;
            return Ok(costs);
        }
        let scale = |cost: &mut Cost, factor: f64| *cost = Cost::finished(cost.value * factor);
        for (number, costs) in costs.iter_mut().enumerate() {
            match self.spoil {
                Spoil::Scaled => costs.iter_mut().for_each(|cost| scale(cost, 1.0 + 2e-4)),
                Spoil::OneInTen => {
                    let some = costs.iter_mut().skip(3).step_by(10);
                    some.for_each(|cost| scale(cost, 0.9));
                }
                Spoil::Stale => costs.clone_from(&last[number]),
                Spoil::Zeros => costs.fill(Cost::finished(0.0)),
                Spoil::Shifted => costs.rotate_right(1),
                Spoil::Diverged => costs.fill(Cost::DIVERGED),
                Spoil::Rare => {
                    let drawn = |cost: &Cost| {
                        cost.value.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 54 == 0
                    };
                    let some = costs.iter_mut().filter(|cost| drawn(cost));
                    some.for_each(|cost| scale(cost, 0.5));
                }
            }
        }
        Ok(costs)
    }
}

const SPOILS: [Spoil; 6] = [
    Spoil::Scaled,
    Spoil::OneInTen,
    Spoil::Stale,
    Spoil::Zeros,
    Spoil::Shifted,
    Spoil::Diverged,
];

#[test]
fn a_device_that_computes_wrong_costs_is_refused_by_name() {
    for spoil in SPOILS {
        for name in ["actuator, held", "table valve", "tones, paper"] {
            let problem = case(name).problem;
            // There has to be something before it that is stale.
            let right = u32::from(spoil == Spoil::Stale);
            let mut guarded = Guarded::new(device(Spoiled::new(spoil, right)), [cpu()]).unwrap();
            for call in 0.. {
                let population = random(&problem, 60, call);
                let costs = guarded.costs(&problem, &population).expect("costs");
                let warnings = guarded.take_warnings();
                let Some(warning) = warnings.first() else {
                    assert!(call < 1, "{spoil:?} is not found out: {name}");
                    continue;
                };
                println!("{spoil:?}, {name}, call {call}: {warning}");
                assert!(warning.starts_with("the device under test computes wrong costs: "));
                assert!(warning.ends_with(&("; going on with ".to_owned() + &cpu_name())));
                assert_eq!(warnings.len(), 1);
                let mut own = CpuEvaluator::new(Precision::F32);
                let expected = own.costs(&problem, &population).expect("costs");
                assert_eq!(bits(&costs), bits(&expected));
                break;
            }
            assert_eq!(guarded.refusals(), 1);
            let now = cpu_name() + " in place of the device under test";
            assert_eq!(guarded.describe(), now);
        }
    }
}

fn cpu_name() -> String {
    CpuEvaluator::new(Precision::F32).describe()
}

#[test]
fn a_device_that_turns_wrong_later_is_refused() {
    let problem = case("actuator, held").problem;
    // Checks are rationed by the time they take: threads of its own keep those short while other tests use the common ones.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let calls_until_refused = |spoil| {
        let mut guarded = Guarded::new(device(Spoiled::new(spoil, 20)), [cpu()]).unwrap();
        let start = Instant::now();
        let mut calls = 0;
        while guarded.refusals() == 0 {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "{spoil:?} is not found out"
            );
            let population = random(&problem, 60, calls);
            guarded.costs(&problem, &population).expect("costs");
            calls += 1;
        }
        calls
    };
    pool.expect("a thread").install(|| {
        for spoil in SPOILS {
            let calls = calls_until_refused(spoil);
            println!("{spoil:?}: wrong from call 21, refused in call {calls}");
            assert!(calls > 20, "{spoil:?}");
        }
    });
}

#[test]
fn a_wrong_device_with_nothing_to_take_over_is_an_error_and_stays_one() {
    let problem = case("actuator, held").problem;
    let population = random(&problem, 60, 1);
    let mut guarded = Guarded::new(device(Spoiled::new(Spoil::Zeros, 0)), []).unwrap();
    for _ in 0..3 {
        let error = guarded
            .costs(&problem, &population)
            .expect_err("wrong costs");
        assert_eq!(error.exit_code(), 1);
        let text = error.to_string();
        assert!(
            text.contains("the device under test computes wrong costs"),
            "{text}"
        );
    }
    assert!(fitted(&problem, &mut guarded).is_err());
}

#[test]
fn a_cpu_whose_vectors_are_wrong_is_refused() {
    let problem = case("actuator, held").problem;
    let wrong = |spoil| {
        Standby::new("the CPU in f32", Thoroughness::Cpu, move || {
            Ok(Spoiled::new(spoil, 0))
        })
    };
    for spoil in [Spoil::Scaled, Spoil::Zeros, Spoil::Shifted] {
        let double = Standby::new("the CPU in f64", Thoroughness::Cpu, || {
            Ok(CpuEvaluator::new(Precision::F64))
        });
        let mut guarded = Guarded::new(wrong(spoil), [double]).unwrap();
        let population = random(&problem, 60, 1);
        let costs = guarded.costs(&problem, &population).expect("costs");
        let mut own = CpuEvaluator::new(Precision::F64);
        assert_eq!(
            bits(&costs),
            bits(&own.costs(&problem, &population).expect("costs"))
        );
        assert!(guarded.take_warnings()[0].starts_with("the CPU in f32 computes wrong costs"));
    }
}

#[test]
fn a_whole_fit_is_the_same_where_a_wrong_device_was_refused() {
    let problem = case("actuator, held").problem;
    let reference = fitted(&problem, &mut CpuEvaluator::new(Precision::F32)).expect("a fit");
    for spoil in [Spoil::Scaled, Spoil::Zeros, Spoil::Shifted] {
        let mut guarded = Guarded::new(device(Spoiled::new(spoil, 0)), [cpu()]).unwrap();
        let found = fitted(&problem, &mut guarded).expect("a fit");
        assert_eq!(guarded.refusals(), 1);
        // Written out, an f64 is told from every other.
        assert_eq!(format!("{found:?}"), format!("{reference:?}"));
    }
}

/// A device that is lost after so many calls.
struct Dying {
    calls: u32,
    inner: CpuEvaluator,
}

impl Dying {
    fn after(calls: u32) -> Self {
        Self {
            calls,
            inner: CpuEvaluator::new(Precision::F32),
        }
    }
}

impl Evaluator for Dying {
    fn describe(&self) -> String {
        "a device under test".into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let Some(left) = self.calls.checked_sub(1) else {
            return Err(Error::failed("the device was lost", "use --evaluator cpu"));
        };
        self.calls = left;
        self.inner.costs_of(jobs)
    }
}

#[test]
fn a_whole_diagnosis_is_the_same_where_its_device_is_lost() {
    let mut alone = CpuEvaluator::new(Precision::F32);
    let reference = diagnosed(&mut alone, Memory::default()).expect("a model");
    let added: Vec<_> = reference.added.iter().map(|one| one.effect).collect();
    println!("{added:?}");
    assert!(!reference.added.is_empty());
    let reference = format!("{reference:?}");
    for calls in [0, 5, 50] {
        let mut guarded = Guarded::new(device(Dying::after(calls)), [cpu()]).unwrap();
        let found = diagnosed(&mut guarded, Memory::default()).expect("a model all the same");
        let warnings = guarded.take_warnings();
        assert_eq!(
            warnings,
            ["the device was lost; going on with ".to_owned() + &cpu_name()]
        );
        assert!(
            format!("{found:?}") == reference,
            "lost after {calls} calls"
        );
    }
}

#[test]
fn what_was_computed_before_a_device_was_lost_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.checkpoint");
    let mut cpu = CpuEvaluator::new(Precision::F32);
    let reference = format!(
        "{:?}",
        diagnosed(&mut cpu, Memory::default()).expect("a model")
    );
    let (mut known, mut runs) = (0, 0);
    loop {
        let memory = Memory::from(Checkpoint::resume(&path, 7).unwrap());
        // Nothing takes over: the run ends here, and the next goes on.
        let mut guarded = Guarded::new(device(Dying::after(9)), []).unwrap();
        let mut remembering = Remembering::new(&mut guarded, memory.clone());
        let found = diagnosed(&mut remembering, memory.clone());
        assert_eq!(memory.kept().as_deref(), Some(path.as_path()));
        drop(memory);
        runs += 1;
        match found {
            Ok(found) => break assert!(format!("{found:?}") == reference),
            Err(error) => assert_eq!(error.exit_code(), 1),
        }
        let before = known;
        known = results_in(&path, &read(&path).unwrap()).unwrap();
        assert!(known >= before + 9, "{known} results after {before}");
    }
    println!("{runs} runs of 9 calls, {known} results");
    assert!(runs > 3);
}

/// What `servobee identify` does with a short and lively part of the bench's record.
fn diagnosed(evaluator: &mut dyn Evaluator, memory: Memory) -> Result<Identified> {
    let records = [Record::parse("bench.csv", excerpt(1000).as_bytes(), &[])?];
    let problem = IdentificationProblem::of(&records, &[], Cut::default())?;
    let options = Options::on(&problem.structure, CATALOGUE, 1);
    let plan = Plan {
        memory,
        ..Plan::of_records(1)
    };
    identify(problem, evaluator, &plan, &options, &mut |_| {
        ControlFlow::Continue(())
    })
}

#[test]
fn what_cannot_be_made_is_passed_over_with_a_warning() {
    let broken = || {
        Standby::new(
            "the first",
            Thoroughness::Device,
            || -> Result<CpuEvaluator> { Err(Error::failed("no such device", "buy one")) },
        )
    };
    let mut guarded = Guarded::new(broken(), [cpu()]).unwrap();
    let warnings = guarded.take_warnings();
    assert_eq!(
        warnings,
        ["no such device; going on with ".to_owned() + &cpu_name()]
    );
    assert!(guarded.take_warnings().is_empty());
    assert!(guarded.describe().ends_with("in place of the first"));
    let error = Guarded::new(broken(), [broken()])
        .err()
        .expect("nothing works");
    assert_eq!(error.exit_code(), 1);
}

/// A device that is right and rounds its own way: what it computes is off by some roundings of each value.
struct Rounded(CpuEvaluator);

impl Evaluator for Rounded {
    fn describe(&self) -> String {
        "a device that rounds its own way".into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let mut all = Vec::new();
        for job in jobs {
            let mut population = Population::new(job.population.dimension());
            for (number, candidate) in job.population.iter().enumerate() {
                let sign = |j: usize| [1.0, -1.0][(number + j) % 3 % 2];
                let values = candidate.iter().enumerate();
                let moved: Vec<f64> = values.map(|(j, v)| v * (1.0 + 6e-7 * sign(j))).collect();
                population.push(&moved);
            }
            all.push(self.0.costs(job.problem, &population)?);
        }
        Ok(all)
    }
}

/// Populations of as many candidates as are sampled, all over the bounds, on them and near the start.
fn populations(problem: &Problem) -> Vec<Population> {
    let seeds = if soak() { 4 } else { 2 };
    let mut all: Vec<Population> = (0..seeds).map(|seed| random(problem, 16, seed)).collect();
    all.push(on_bounds(problem));
    all.push(near_start(problem, 16, 5));
    all
}

/// Every structure and record of the tests, and a long one on which hardly damped candidates are chaotic.
fn problems() -> Vec<(String, Problem)> {
    let named = |case: common::Case| (case.name.into(), case.problem);
    let mut all: Vec<(String, Problem)> = cases().into_iter().map(named).collect();
    let wide = case("actuator, default bounds").problem;
    let long = common::Record::new(6000, 2e-3, 12.0);
    let long = common::problem(wide.structure, wide.parameters, vec![long]);
    all.push(("chaotic".into(), long));
    all
}

fn assert_right(guarded: &mut Guarded, problems: Vec<(String, Problem)>) {
    let mut judged = 0;
    for (name, problem) in problems {
        for population in populations(&problem) {
            let problem = anew(&problem);
            guarded.costs(&problem, &population).expect("costs");
            judged += population.len();
            assert_eq!(guarded.take_warnings(), Vec::<String>::new(), "{name}");
        }
    }
    println!("{judged} candidates sampled, no refusal");
}

#[test]
fn a_right_device_is_never_refused() {
    let right = CpuEvaluator::new(Precision::F32);
    let all = || [problems(), common::effects::cases()].concat();
    assert_right(&mut Guarded::new(device(right.clone()), []).unwrap(), all());
    assert_right(
        &mut Guarded::new(device(Rounded(right)), []).unwrap(),
        all(),
    );
}

#[test]
fn a_right_gpu_is_never_refused() {
    let Some(gpu) = common::gpu(Checks::Off) else {
        return;
    };
    // Of the effects, each of which takes a shader of its own, one in eight, others where tests have hours.
    let effects = common::effects::cases().into_iter();
    let effects = effects.step_by(if soak() { 1 } else { 8 });
    let all = problems().into_iter().chain(effects).collect();
    assert_right(&mut Guarded::new(device(gpu), []).unwrap(), all);
}

#[test]
fn a_wrong_candidate_now_and_then_condemns_no_device() {
    let problem = case("actuator, held").problem;
    let mut guarded = Guarded::new(device(Spoiled::new(Spoil::Rare, 0)), []).unwrap();
    let mut own = CpuEvaluator::new(Precision::F32);
    let mut wrong = 0;
    for seed in 0..400 {
        let problem = anew(&problem);
        let population = random(&problem, 16, seed);
        let costs = guarded.costs(&problem, &population).expect("costs");
        let right = own.costs(&problem, &population).expect("costs");
        wrong += (costs.iter().zip(&right)).filter(|(a, b)| a != b).count();
    }
    println!("{wrong} of 6400 were wrong");
    assert!((2..20).contains(&wrong));
}

/// A fit on the GPU with a fault, the warnings, and what computed in the end.
fn with_fault(prepare: impl FnOnce(&mut GpuEvaluator)) -> Option<(Fit, Vec<String>, String)> {
    let mut gpu = common::gpu(Checks::Off)?;
    let problem = case("actuator, held").problem;
    prepare(&mut gpu);
    let mut guarded = Guarded::new(device(gpu), [cpu()]).unwrap();
    let found = fitted(&problem, &mut guarded).expect("a fit all the same");
    assert_eq!(guarded.refusals(), 0);
    Some((found, guarded.take_warnings(), guarded.describe()))
}

#[test]
fn every_failure_of_a_device_ends_in_the_same_result() {
    let Some(mut gpu) = common::gpu(Checks::Off) else {
        return;
    };
    let name = gpu.describe();
    let reference = fitted(&case("actuator, held").problem, &mut gpu).expect("a fit");
    let always = u32::MAX;
    let faults = [
        // What goes on with the device itself.
        (Lost, 0, 1, "was lost; going on with it anew", true),
        (Lost, 5, 3, "was lost; going on with it anew", true),
        (OutOfMemory, 0, 1, "at most 128 MiB at once", true),
        (OutOfMemory, 4, 2, "at most 128 MiB at once", true),
        // What the CPU takes over.
        (Lost, 0, always, "was lost again and again", false),
        (OutOfMemory, 0, always, "has no memory left", false),
        (Hang, 2, 1, "has not answered for 60s", false),
        (ShaderRefused, 0, 1, "refuses the shader", false),
    ];
    for (fault, after, times, said, stays) in faults {
        let (found, warnings, now) =
            with_fault(|gpu| gpu.inject(fault, after, times)).expect("an adapter, as above");
        println!("{fault:?} after {after}, {times} times: {warnings:#?}");
        assert!(
            warnings.iter().any(|warning| warning.contains(said)),
            "{fault:?}"
        );
        assert!(warnings.iter().all(|warning| warning.lines().count() == 1));
        let taken_over = "; going on with ".to_owned() + &cpu_name();
        let last = warnings.last().expect("a warning");
        assert_eq!(last.ends_with(&taken_over), !stays, "{last}");
        assert_eq!(now == name, stays, "{now}");
        let [own, other] = [&found, &reference].map(|fit| fit.cost().expect("a cost"));
        assert!(
            (own / other - 1.0).abs() <= PARITY,
            "{fault:?}: {own} {other}"
        );
        let pairs = found.values().iter().zip(reference.values());
        for (own, other) in pairs {
            assert!(
                (own / other - 1.0).abs() <= PARITY,
                "{fault:?}: {own} {other}"
            );
        }
    }
}

#[test]
fn every_failure_of_a_device_that_nothing_replaces_is_an_error() {
    for fault in [Lost, OutOfMemory, Hang, ShaderRefused] {
        let Some(mut gpu) = common::gpu(Checks::Off) else {
            return;
        };
        gpu.inject(fault, 0, u32::MAX);
        let mut guarded = Guarded::new(device(gpu), []).unwrap();
        let error = fitted(&case("actuator, held").problem, &mut guarded).expect_err("no device");
        println!("{fault:?}: {error}");
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().contains("--evaluator cpu"), "{error}");
    }
}

#[test]
fn a_device_that_does_not_answer_in_time_is_given_up_at_once() {
    let Some(mut gpu) = common::gpu(Checks::Off) else {
        return;
    };
    // lavapipe computes while work is submitted, so that it has answered whenever it is asked: a limit of a nanosecond met it
    // in the middle only where something else held up its last step. On hardware benches/gpu waits for real.
    gpu.inject(Hang, 0, 1);
    gpu.limit_timeout(Duration::from_nanos(1));
    let mut guarded = Guarded::new(device(gpu), [cpu()]).unwrap();
    let problem = case("records of many lengths").problem;
    let population = random(&problem, 300, 1);
    let costs = guarded.costs(&problem, &population).expect("costs");
    let warnings = guarded.take_warnings();
    println!("{warnings:?}");
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("has not answered for 1ns; going on with CPU"));
    assert!(
        guarded
            .describe()
            .ends_with("in place of the device under test")
    );
    let mut alone = CpuEvaluator::new(Precision::F32);
    assert_eq!(
        bits(&costs),
        bits(&alone.costs(&problem, &population).expect("costs"))
    );
}

#[test]
fn a_device_with_little_memory_computes_the_same_in_smaller_parts() {
    let Some(mut gpu) = common::gpu(Checks::Off) else {
        return;
    };
    let problem = case("records of many lengths").problem;
    let population = random(&problem, 300, 4);
    let whole = gpu.costs(&problem, &population).expect("costs");
    // Each attempt runs out of memory until a batch has 4 MiB.
    gpu.inject(OutOfMemory, 0, 6);
    let parts = gpu.costs(&problem, &population).expect("costs");
    assert_eq!(bits(&parts), bits(&whole));
    let warnings = gpu.take_warnings();
    assert_eq!(warnings.len(), 6);
    assert!(
        warnings[5].contains("at most 4 MiB at once"),
        "{warnings:?}"
    );
}

/// A driver that is named and cannot be loaded, and none at all.
fn drivers(folder: &std::path::Path) -> [String; 2] {
    let file = folder.join("driver.json");
    let text = r#"{"file_format_version": "1.0.0", "ICD": {"library_path": "./none.so", "api_version": "1.3.0"}}"#;
    std::fs::write(&file, text).unwrap();
    [file, folder.join("none.json")].map(|path| path.to_str().unwrap().to_owned())
}

#[test]
fn without_a_driver_auto_computes_on_the_cpu_and_gpu_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for driver in drivers(folder.path()) {
        // Every name that Vulkan's loader knows for it; on other systems the backend is missing altogether.
        let set = [
            ("VK_DRIVER_FILES", driver.as_str()),
            ("VK_ICD_FILENAMES", driver.as_str()),
            ("WGPU_BACKEND", "vulkan"),
        ];
        let call = ["identify", BENCH, "--effects", "none", "--evaluator"];
        let auto = servobee_with(folder.path(), &[&call[..], &["auto"]].concat(), &set);
        let text = printed(&auto);
        assert!(text.contains("Evaluator: CPU (f32 lanes"), "{text}");
        assert!(text.contains("(no GPU adapter found)"), "{text}");
        let gpu = servobee_with(folder.path(), &[&call[..], &["gpu"]].concat(), &set);
        let errors = String::from_utf8_lossy(&gpu.stderr);
        assert_eq!(gpu.status.code(), Some(1), "{errors}");
        assert!(gpu.stdout.is_empty());
        assert!(errors.contains("shows no GPU adapter"), "{errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
}
