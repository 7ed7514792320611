//! One run in the processes that a launcher has started. What they find under `mpirun` is tested on the program with the feature
//! `mpi` that `SERVOBEE_MPI=1 bash tests/run.sh` builds.

#![cfg(unix)]

use crate::program::{IDENTIFY, bench, json, names, printed, refused, servobee, servobee_with};
use serde_json::Value;
use std::fs::{read, read_dir, read_to_string};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn a_build_without_mpi_does_not_run_several_times_into_one_folder() {
    let folder = bench();
    for name in ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"] {
        let error = refused(&servobee_with(folder.path(), IDENTIFY, &[(name, "4")]));
        assert!(error.contains(&format!("{name}=4: ")), "{error}");
        assert!(
            error.contains("--features mpi") && error.contains("SERVOBEE_ALONE=1"),
            "{error}"
        );
    }
    assert_eq!(names(folder.path()), ["bench.csv"]);
    let effects = |set: &[(&str, &str)]| printed(&servobee_with(folder.path(), &["effects"], set));
    effects(&[("OMPI_COMM_WORLD_SIZE", "1")]);
    effects(&[("OMPI_COMM_WORLD_SIZE", "4"), ("SERVOBEE_ALONE", "1")]);
    // The tasks of a job array share nothing.
    let task = [
        "batch",
        ".",
        "--out",
        "out",
        "--effects",
        "none",
        "--evaluator",
        "cpu",
        "--task=2/4",
    ];
    printed(&servobee_with(
        folder.path(),
        &task,
        &[("SLURM_STEP_NUM_TASKS", "4")],
    ));
}

/// The program with the feature `mpi`, where there is one.
fn program() -> Option<PathBuf> {
    let path = std::env::var_os("SERVOBEE_MPI_PROGRAM").map(PathBuf::from);
    if path.is_none() {
        println!(
            "NOT TESTED: ranks under mpirun: SERVOBEE_MPI=1 builds the program with --features mpi and tests them"
        );
    }
    path
}

fn start(program: &Path, folder: &Path, ranks: usize, call: &[&str]) -> Child {
    Command::new("mpirun")
        .args(["--oversubscribe", "-n", &ranks.to_string()])
        .arg(program)
        .args(call)
        .current_dir(folder)
        .envs([
            ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
            ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            // Ranks that wait shall not take the cores of those that compute.
            ("RAYON_NUM_THREADS", "1"),
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn run(program: &Path, folder: &Path, ranks: usize, call: &[&str]) -> Output {
    let child = start(program, folder, ranks, call);
    child.wait_with_output().unwrap()
}

/// What a run has written, but for times and what it was computed on.
fn results(folder: &Path) -> Vec<String> {
    let mut found: Vec<String> = ["model.toml", "residual.csv"]
        .iter()
        .map(|name| read_to_string(folder.join("out").join(name)).unwrap())
        .collect();
    let mut report = json(folder.join("out/report.json"));
    for name in ["evaluator", "seconds", "date"] {
        assert!(
            report.as_object_mut().unwrap().remove(name).is_some(),
            "{name}"
        );
    }
    found.push(report.to_string());
    found
}

fn evaluator(folder: &Path) -> String {
    let report: Value = json(folder.join("out/report.json"));
    report["evaluator"].as_str().unwrap().to_owned()
}

#[test]
fn the_call_in_the_readme_is_one_that_is_tested() {
    let readme = read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let mut lines = readme.lines().map(str::trim);
    let call = lines.find_map(|line| line.strip_prefix("mpirun -n 4 servobee "));
    let folder = tempfile::tempdir().unwrap();
    let call: Vec<&str> = call.unwrap().split(' ').collect();
    assert_eq!(call[0], "identify");
    // Started as a launcher would, without one.
    let error = refused(&servobee_with(folder.path(), &call, &[("PMI_SIZE", "4")]));
    assert!(error.contains("started this program 4 times"), "{error}");
}

#[test]
fn ranks_find_what_one_process_finds_and_the_first_alone_writes_and_prints() {
    let Some(program) = program() else { return };
    let alone = bench();
    printed(&servobee(alone.path(), IDENTIFY));
    let device = evaluator(alone.path());
    for ranks in [1, 2, 4] {
        let folder = bench();
        let told = printed(&run(&program, folder.path(), ranks, IDENTIFY));
        assert_eq!(told.matches("Verdict: found").count(), 1, "{told}");
        assert!(
            results(folder.path()) == results(alone.path()),
            "{ranks} ranks"
        );
        let expected = match ranks {
            1 => device.clone(),
            _ => format!("{ranks} ranks, each on {device}"),
        };
        assert_eq!(evaluator(folder.path()), expected);
        assert!(told.contains(&format!("Evaluator: {expected}")), "{told}");
        assert_eq!(names(folder.path()), ["bench.csv", "out"]);
    }
}

#[test]
fn help_and_errors_are_told_once_and_end_all_ranks() {
    let Some(program) = program() else { return };
    let folder = bench();
    let help = printed(&run(&program, folder.path(), 3, &["identify", "--help"]));
    assert_eq!(help.matches("Usage:").count(), 1, "{help}");
    for (call, words) in [
        (
            &["identify", "nothing.csv"][..],
            "nothing.csv: cannot be read",
        ),
        (
            &["identify", "bench.csv", "--evaluator", "gpu:99"],
            "gpu:99",
        ),
        (&["identify", "--colour"], "--colour"),
    ] {
        let ran = run(&program, folder.path(), 3, call);
        assert_eq!(ran.status.code(), Some(2), "{ran:?}");
        let errors = String::from_utf8(ran.stderr).unwrap();
        assert_eq!(errors.matches("servobee: ").count(), 1, "{errors}");
        assert!(errors.contains(words), "{errors}");
    }
}

/// The process that `mpirun` has started as this rank.
fn process(launcher: &Child, rank: usize) -> u32 {
    let wanted = format!("OMPI_COMM_WORLD_RANK={rank}");
    let own = |process: &PathBuf| {
        let parent = read_to_string(process.join("stat")).ok()?;
        let parent: u32 = parent
            .rsplit(')')
            .next()?
            .split_whitespace()
            .nth(1)?
            .parse()
            .ok()?;
        let environment = read(process.join("environ")).ok()?;
        let mut variables = environment.split(|&byte| byte == 0);
        let is_own = parent == launcher.id() && variables.any(|one| one == wanted.as_bytes());
        is_own.then(|| process.file_name()?.to_str()?.parse().ok())?
    };
    let processes = read_dir("/proc")
        .unwrap()
        .map(|entry| entry.unwrap().path());
    processes
        .into_iter()
        .find_map(|one| own(&one))
        .expect("a process of this rank")
}

#[test]
fn a_rank_that_dies_ends_the_run_whose_checkpoint_goes_on_to_the_same_result() {
    let Some(program) = program() else { return };
    let alone = bench();
    printed(&servobee(alone.path(), IDENTIFY));
    let folder = bench();
    let checkpoint = folder.path().join("out.checkpoint");
    let child = start(&program, folder.path(), 3, IDENTIFY);
    let begun = Instant::now();
    while checkpoint.metadata().map_or(0, |file| file.len()) < 20_000 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no checkpoint");
        sleep(Duration::from_millis(2));
    }
    let killed = process(&child, 2).to_string();
    let kill = Command::new("kill").args(["-KILL", &killed]).status();
    assert!(kill.unwrap().success());
    let ran = child.wait_with_output().unwrap();
    assert!(!ran.status.success(), "{ran:?}");
    assert!(checkpoint.exists() && begun.elapsed() < Duration::from_secs(90));
    let resumed = [IDENTIFY, &["--resume"]].concat();
    printed(&run(&program, folder.path(), 2, &resumed));
    assert!(results(folder.path()) == results(alone.path()));
    assert!(!checkpoint.exists());
}
