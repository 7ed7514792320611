//! Runs that are cut off: what they leave behind, and that they go on to the same bytes.
//!
//! `SERVOBEE_SOAK=1` kills a run a hundred times instead of four.

#![cfg(unix)]

use crate::program;
use crate::program::{IDENTIFY, bench, json, names, refused, servobee, soak};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::diagnose::{Cut, IdentificationProblem, Identified, Options, identify};
use servobee::evaluate::{Checkpoint, CpuEvaluator, Interrupt, Memory, Precision, Remembering};
use servobee::model::effects::CATALOGUE;
use servobee::record::Record;
use servobee::search::Plan;
use std::collections::BTreeMap;
use std::fs::{read, read_dir, write};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const DATASHEET: &[&str] = &[
    "datasheet",
    "--case",
    "step",
    "--evaluator",
    "cpu",
    "--out",
    "out",
];

/// Starts the program in `folder`, with signals as a terminal would have them.
fn start(folder: &Path, call: &[&str], more: &[&str]) -> Child {
    Command::new("env")
        .current_dir(folder)
        .args([
            "--default-signal=INT,TERM,HUP",
            env!("CARGO_BIN_EXE_servobee"),
        ])
        .args(call)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn signal(child: &Child, name: &str) {
    let kill = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
}

/// Waits until the checkpoint of a run has so many bytes.
fn wait_for(checkpoint: &Path, bytes: u64) {
    let begun = Instant::now();
    while checkpoint.metadata().map_or(0, |file| file.len()) < bytes {
        assert!(begun.elapsed() < Duration::from_secs(60), "no checkpoint");
        sleep(Duration::from_millis(2));
    }
}

/// What a run has written, but for the times it took.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in read_dir(folder.join("out")).unwrap() {
        let entry = entry.unwrap();
        let text = String::from_utf8(read(entry.path()).unwrap()).unwrap();
        let name = entry.file_name().into_string().unwrap();
        let times = ["\"seconds\": ", "\"date\": ", "<dt>Time</dt>"];
        let timed = |line: &&str| !times.iter().any(|time| line.contains(time));
        let kept: Vec<&str> = text.lines().filter(timed).collect();
        files.insert(name, kept.join("\n").into_bytes());
    }
    files
}

fn whole(call: &[&str]) -> (BTreeMap<String, Vec<u8>>, Duration) {
    let folder = bench();
    let begun = Instant::now();
    let ran = servobee(folder.path(), call);
    assert!(ran.status.success(), "{ran:?}");
    let took = begun.elapsed();
    // The checkpoint is gone with the run.
    assert_eq!(names(folder.path()), ["bench.csv", "out"]);
    let found = results(folder.path());
    assert!(found.len() >= 4 && found.values().all(|file| !file.is_empty()));
    (found, took)
}

fn assert_same(
    found: &BTreeMap<String, Vec<u8>>,
    expected: &BTreeMap<String, Vec<u8>>,
    what: &str,
) {
    assert!(found.keys().eq(expected.keys()), "{what}");
    for (name, bytes) in found {
        assert!(bytes == &expected[name], "{what}: {name} differs");
    }
}

/// What an identification writes that is not cut off: the same for all tests.
fn whole_identification() -> &'static (BTreeMap<String, Vec<u8>>, Duration) {
    static WHOLE: OnceLock<(BTreeMap<String, Vec<u8>>, Duration)> = OnceLock::new();
    WHOLE.get_or_init(|| whole(IDENTIFY))
}

/// Kills runs of `call` at random moments until that was done `kills` times, going on with each until it ends by itself.
fn kill_at_random(
    call: &[&str],
    (expected, took): &(BTreeMap<String, Vec<u8>>, Duration),
    kills: usize,
    seed: u64,
) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut killed, mut runs, mut gone_on) = (0, 0, 0);
    // Of few, all may have been killed before there was anything to keep.
    while killed < kills || (gone_on == 0 && killed < 10 * kills) {
        let folder = bench();
        runs += 1;
        // Runs that are cut off three times at most, so that the later parts of a run are reached as well.
        for attempt in 0.. {
            let mut child = start(folder.path(), call, &["--resume", "--quiet"]);
            if attempt < 3 {
                sleep(took.mul_f64(rng.random_range(0.0..1.1)));
                child.kill().unwrap();
            }
            let ran = child.wait_with_output().unwrap();
            if ran.status.success() {
                break;
            }
            assert_eq!(ran.status.code(), None, "{ran:?}");
            killed += 1;
            let kept = folder.path().join("out.checkpoint").exists();
            gone_on += usize::from(kept);
            if !kept && folder.path().join("out").exists() {
                // It had ended; only the process was still there.
                break;
            }
        }
        assert_same(&results(folder.path()), expected, &format!("run {runs}"));
        let left = names(folder.path());
        let left: Vec<&String> = left
            .iter()
            .filter(|name| !name.starts_with(".servobee-"))
            .collect();
        assert_eq!(left, ["bench.csv", "out"]);
    }
    println!("{killed} kills in {runs} runs of {call:?}, {gone_on} of them left a checkpoint");
    assert!(gone_on > 0);
}

fn kills() -> usize {
    match soak() {
        true => 100,
        false => 4,
    }
}

#[test]
fn an_identification_that_is_killed_goes_on_to_the_same_bytes() {
    kill_at_random(IDENTIFY, whole_identification(), kills(), 1);
}

#[test]
fn a_datasheet_fit_that_is_killed_goes_on_to_the_same_bytes() {
    kill_at_random(DATASHEET, &whole(DATASHEET), kills() / 2, 2);
}

#[test]
fn a_scorecard_that_is_killed_goes_on_where_it_was() {
    let call = [
        "scorecard",
        "--groups",
        "null",
        "--count",
        "0.01",
        "--threads",
        "1",
        "--out",
        "cases.csv",
    ];
    let rows = |folder: &Path| -> Vec<String> {
        let text = String::from_utf8(read(folder.join("cases.csv")).unwrap()).unwrap();
        let mut lines = text.lines();
        let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
        let timed = heads
            .iter()
            .position(|head| *head == "seconds")
            .expect("a column of times");
        let without_time = |line: &str| {
            let mut cells: Vec<&str> = line.split(',').collect();
            cells.remove(timed);
            cells.join(",")
        };
        lines.map(without_time).collect()
    };
    let whole = bench();
    let begun = Instant::now();
    let ran = servobee(whole.path(), &call);
    assert!(ran.status.success(), "{ran:?}");
    let printed = String::from_utf8(ran.stdout).unwrap();
    assert!(
        printed.starts_with("2 records to diagnose: 2 null\n"),
        "{printed}"
    );
    let took = begun.elapsed();
    let expected = rows(whole.path());
    assert_eq!(expected.len(), 2, "{expected:?}");

    let folder = bench();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for attempt in 0.. {
        let mut child = start(folder.path(), &call, &["--resume"]);
        if attempt < kills() / 2 {
            sleep(took.mul_f64(rng.random_range(0.0..0.5)));
            child.kill().unwrap();
        }
        if child.wait_with_output().unwrap().status.success() {
            break;
        }
    }
    assert_eq!(rows(folder.path()), expected);
}

/// Two effects take half a minute a record.
#[test]
fn an_interrupted_scorecard_leaves_what_is_under_way() {
    let folder = bench();
    let call = "scorecard --groups pairs --count 0.1 --seed 77 --threads 1 --out out.csv";
    let call: Vec<&str> = call.split(' ').collect();
    let child = start(folder.path(), &call, &[]);
    sleep(Duration::from_secs(3));
    signal(&child, "-INT");
    let asked = Instant::now();
    let ran = child.wait_with_output().unwrap();
    assert!(asked.elapsed() < Duration::from_secs(8), "{asked:?}");
    let errors = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(1), "{errors}");
    assert!(errors.contains("go on"), "{errors}");
    let kept = std::fs::read_to_string(folder.path().join("out.csv")).unwrap_or_default();
    assert!(!kept.contains("interrupted"), "{kept}");
}

/// A run that a signal has reached after its checkpoint had so many bytes.
fn interrupted(folder: &Path, call: &[&str], name: &str, bytes: u64) -> Output {
    let child = start(folder, call, &[]);
    wait_for(&folder.join("out.checkpoint"), bytes);
    signal(&child, name);
    child.wait_with_output().unwrap()
}

#[test]
fn an_interrupt_ends_with_what_is_known_and_the_run_can_be_gone_on_with() {
    let datasheet = whole(DATASHEET);
    for (call, name, (expected, _)) in [
        (IDENTIFY, "-INT", whole_identification()),
        (DATASHEET, "-TERM", &datasheet),
    ] {
        let folder = bench();
        let ran = interrupted(folder.path(), call, name, 5000);
        let errors = String::from_utf8(ran.stderr).unwrap();
        assert_eq!(ran.status.code(), Some(1), "{errors}");
        assert!(
            errors.contains("interrupted") && errors.contains("--resume"),
            "{errors}"
        );
        // What was known is told, and marked as such.
        let printed = String::from_utf8(ran.stdout).unwrap();
        assert!(
            printed.contains("Cut short in \"") && printed.contains("Missing: "),
            "{printed}"
        );
        assert!(!printed.contains("Verdict: "), "{printed}");
        assert!(
            printed.contains("time_constant") && printed.contains("Written to"),
            "{printed}"
        );
        let report = json(folder.path().join("out/report.json"));
        let warnings = report["warnings"].to_string();
        assert!(warnings.contains("interrupted in"), "{warnings}");
        // An interval that was not computed is none.
        for parameter in report["parameters"].as_array().unwrap() {
            let [low, value, high] = ["low", "value", "high"].map(|key| parameter[key].as_f64());
            let known = low.is_some() && high.is_some();
            assert!(
                value.is_some() && (!known || low <= value && value <= high),
                "{parameter}"
            );
        }
        let cut = &report["cut_short"];
        assert!(
            cut["stage"].is_string() && !cut["missing"].as_array().unwrap().is_empty(),
            "{cut}"
        );
        assert_eq!(names(folder.path()), ["bench.csv", "out", "out.checkpoint"]);

        // A new run does not overwrite what can be gone on with; the old one goes on.
        let refusal = refused(&servobee(folder.path(), &[call, &["--quiet"]].concat()));
        assert!(refusal.contains("out"), "{refusal}");
        let ran = servobee(folder.path(), &[call, &["--resume"]].concat());
        assert!(ran.status.success(), "{ran:?}");
        let printed = String::from_utf8(ran.stdout).unwrap();
        assert!(printed.contains("Going on with "), "{printed}");
        assert_same(&results(folder.path()), expected, name);
        assert_eq!(names(folder.path()), ["bench.csv", "out"]);
    }
}

/// A folder with a record whose identification takes long.
fn long() -> TempDir {
    let folder = bench();
    let make = [
        "synthesize",
        "--seconds",
        "60",
        "--effect",
        "delay=0.003,hysteresis=0.3",
        "--out",
        "bench.csv",
        "--force",
    ];
    assert!(servobee(folder.path(), &make).status.success());
    folder
}

/// `timeout` sends its signal to the program, and at once again to its whole group.
#[test]
fn a_timeout_is_one_signal_and_loses_nothing() {
    let folder = long();
    for attempt in 0..if soak() { 10 } else { 2 } {
        let out = format!("out{attempt}");
        let ran = Command::new("env")
            .current_dir(folder.path())
            .args(["--default-signal=INT,TERM,HUP", "timeout", "1"])
            .args([env!("CARGO_BIN_EXE_servobee"), "identify", "bench.csv"])
            .args(["--evaluator", "cpu", "--out", &out])
            .output()
            .unwrap();
        // That it was timeout which has ended it.
        assert_eq!(ran.status.code(), Some(124), "{ran:?}");
        let report = json(folder.path().join(&out).join("report.json"));
        assert!(report["cut_short"]["stage"].is_string(), "{report}");
    }
}

/// The diagnosis of the bench's record, which is asked to stop when it asks for the `limit`-th time, and how long it has gone on
/// after that.
fn stopped_at(limit: usize, memory: Memory) -> (Identified, usize, Duration) {
    let asks = Arc::new(AtomicUsize::new(0));
    let stopped = Arc::new(OnceLock::new());
    let interrupt = {
        let (asks, stopped) = (asks.clone(), stopped.clone());
        Interrupt::new(move || {
            let asked = asks.fetch_add(1, Ordering::Relaxed) >= limit;
            asked.then(|| stopped.get_or_init(Instant::now)).is_some()
        })
    };
    let record = Record::read(program::BENCH, &[]).unwrap();
    let problem = IdentificationProblem::of(&[record], &[], Cut::default()).unwrap();
    let plan = Plan {
        memory: memory.stopped_by(interrupt),
        ..Plan::of_records(1)
    };
    let some = ["delay", "friction", "hysteresis", "sensor_lag"];
    let entries = CATALOGUE.iter().copied();
    let entries: Vec<_> = entries.filter(|entry| some.contains(&entry.name)).collect();
    let options = Options::on(&problem.structure, &entries, 4);
    let mut evaluator = CpuEvaluator::new(Precision::F32);
    let mut remembering = Remembering::new(&mut evaluator, plan.memory.clone());
    let go_on = &mut |_: &str| ControlFlow::Continue(());
    let identified = identify(problem, &mut remembering, &plan, &options, go_on).unwrap();
    let after = stopped.get().map_or(Duration::ZERO, Instant::elapsed);
    (identified, asks.load(Ordering::Relaxed), after)
}

#[test]
fn wherever_a_diagnosis_is_stopped_it_ends_at_once_and_goes_on_to_the_same_result() {
    let begun = Instant::now();
    let (expected, asks, _) = stopped_at(usize::MAX, Memory::default());
    println!("{asks} asks in {:?}", begun.elapsed());
    assert!(expected.broken_off.is_none() && expected.added.len() == 1);
    let shares = if soak() { 12 } else { 6 };
    for share in 0..shares {
        let limit = asks * share / shares;
        let (found, _, after) = stopped_at(limit, Memory::default());
        let stage = found.broken_off.expect("it was stopped");
        assert!(!stage.is_empty());
        println!("stopped at ask {limit}, in {stage:?}, ended {after:?} later");
        assert!(after < Duration::from_secs(3), "{stage}: {after:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kept");
    let memory = || Memory::from(Checkpoint::resume(&path, 1).unwrap());
    let limits = (0..).map(|run| (asks as f64 / 20.0 * 1.3_f64.powi(run)) as usize);
    let runs = limits.map(|limit| stopped_at(limit, memory()).0);
    let stopped = |found: &Identified| found.broken_off.is_some();
    let mut count = 0;
    let found = runs.inspect(|_| count += 1).find(|found| !stopped(found));
    let found = found.expect("a run that ends");
    println!("{count} runs");
    assert!(count > 3);
    assert_eq!(found.after.values, expected.after.values);
    assert_eq!(found.considered, expected.considered);
    assert_eq!(found.added, expected.added);
}

#[test]
fn a_second_interrupt_quits_at_once() {
    let folder = long();
    let mut child = start(folder.path(), IDENTIFY, &[]);
    wait_for(&folder.path().join("out.checkpoint"), 1000);
    signal(&child, "-INT");
    // The first one is heard, and what follows it is not over before the second.
    sleep(Duration::from_millis(20));
    signal(&child, "-STOP");
    sleep(Duration::from_millis(1100));
    signal(&child, "-INT");
    signal(&child, "-CONT");
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130), "{status}");
    assert!(folder.path().join("out.checkpoint").exists());
}

#[test]
fn a_checkpoint_is_taken_only_for_its_own_run() {
    let folder = bench();
    let path = folder.path();
    let ran = interrupted(path, IDENTIFY, "-KILL", 3000);
    assert_eq!(ran.status.code(), None);
    let kept = read(path.join("out.checkpoint")).unwrap();
    let call = |more: &[&str]| servobee(path, &[IDENTIFY, &["--quiet"], more].concat());

    let refusal = refused(&call(&[]));
    assert!(
        refusal.contains("out.checkpoint: is the checkpoint of a run that was cut off"),
        "{refusal}"
    );
    let refusal = refused(&call(&["--resume", "--seed", "2"]));
    assert!(
        refusal.contains("is a checkpoint of another run"),
        "{refusal}"
    );
    assert!(path.join("out.checkpoint").exists() && !path.join("out").exists());

    // Another record under the same name.
    let text = String::from_utf8(read(path.join("bench.csv")).unwrap()).unwrap();
    let shorter: Vec<&str> = text.lines().take(1500).collect();
    write(path.join("bench.csv"), shorter.join("\n")).unwrap();
    let refusal = refused(&call(&["--resume"]));
    assert!(
        refusal.contains("is a checkpoint of another run"),
        "{refusal}"
    );
    write(path.join("bench.csv"), text).unwrap();
    assert_eq!(read(path.join("out.checkpoint")).unwrap(), kept);

    // Something else that is called so.
    for foreign in [
        &b"hello\n"[..],
        b"",
        b"servobee/checkpoint/2 0.1.0 zz\n",
        &[0; 4096],
    ] {
        write(path.join("other"), foreign).unwrap();
        let refusal = refused(&call(&["--resume", "--checkpoint", "other"]));
        assert!(refusal.contains("other: is no checkpoint"), "{refusal}");
    }
    let refusal = refused(&servobee(
        path,
        &["identify", "bench.csv", "--resume", "--quiet"],
    ));
    assert!(
        refusal.contains("--resume: there is no checkpoint"),
        "{refusal}"
    );

    // Begun again, with force.
    let ran = call(&["--force"]);
    assert!(ran.status.success(), "{ran:?}");
    assert_eq!(names(path), ["bench.csv", "other", "out"]);
}

#[test]
fn two_runs_do_not_share_a_checkpoint() {
    let folder = bench();
    let mut first = start(folder.path(), IDENTIFY, &[]);
    wait_for(&folder.path().join("out.checkpoint"), 500);
    signal(&first, "-STOP");
    let refusal = refused(&servobee(
        folder.path(),
        &[IDENTIFY, &["--resume", "--quiet"]].concat(),
    ));
    assert!(refusal.contains("is in use by a run"), "{refusal}");
    first.kill().unwrap();
    first.wait().unwrap();
}

#[test]
fn a_damaged_checkpoint_counts_up_to_the_damage() {
    let folder = bench();
    let path = folder.path();
    let (expected, _) = whole_identification();
    interrupted(path, IDENTIFY, "-KILL", 4000);
    let kept = read(path.join("out.checkpoint")).unwrap();
    let mut flipped = kept.clone();
    flipped[kept.len() / 2] ^= 1;
    for damaged in [&kept[..kept.len() - 3], &flipped] {
        write(path.join("out.checkpoint"), damaged).unwrap();
        let ran = servobee(path, &[IDENTIFY, &["--resume", "--force"]].concat());
        assert!(ran.status.success(), "{ran:?}");
        assert_same(&results(path), expected, "damaged");
    }
}
