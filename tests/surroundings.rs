//! Surroundings that fail: readers that go away, full disks, no network; and that nothing is written but what was asked for.
//!
//! `SERVOBEE_SOAK=1` starts 64 runs side by side instead of 8.

#![cfg(target_os = "linux")]

use crate::program::{IDENTIFY, RESULTS, bench, json, names, soak};
use std::fs::{File, create_dir, read_to_string};
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SERVOBEE: &str = env!("CARGO_BIN_EXE_servobee");

fn errors(ran: &Output) -> String {
    let errors = String::from_utf8(ran.stderr.clone()).unwrap();
    assert!(!errors.contains("panicked"), "{errors}");
    errors
}

#[test]
fn a_reader_that_goes_away_stops_nothing() {
    let folder = bench();
    let mut child = Command::new(SERVOBEE)
        .current_dir(folder.path())
        .args(IDENTIFY)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let ran = child.wait_with_output().unwrap();
    assert!(ran.status.success(), "{}", errors(&ran));
    assert_eq!(
        json(folder.path().join("out/report.json"))["schema"],
        "servobee/report/2"
    );
    for call in [
        &["effects"][..],
        &["devices"],
        &["completions", "bash"],
        &["effects", "--json"],
    ] {
        let mut child = Command::new(SERVOBEE)
            .args(call)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let ran = child.wait_with_output().unwrap();
        assert!(ran.status.success(), "{call:?}: {}", errors(&ran));
    }
}

#[test]
fn output_that_cannot_be_written_is_a_failure() {
    let folder = bench();
    let calls = [
        &["effects"][..],
        &["devices", "--json"],
        &["completions", "zsh"],
        &["inspect", "bench.csv"],
        &[
            "identify",
            "bench.csv",
            "--evaluator",
            "cpu",
            "--effects",
            "none",
            "--json",
        ],
    ];
    for call in calls {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let ran = Command::new(SERVOBEE)
            .current_dir(folder.path())
            .args(call)
            .stdout(full)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let errors = errors(&ran);
        assert_eq!(ran.status.code(), Some(1), "{call:?}: {errors}");
        assert!(
            errors.contains("standard output cannot be written"),
            "{errors}"
        );
    }
}

/// Runs `script` in `folder` with namespaces of its own, as `unshare` gives them; `None` where the system gives none.
fn apart(folder: &Path, flags: &str, script: &str) -> Option<Output> {
    let allowed = Command::new("unshare").args([flags, "true"]).output();
    if !allowed.is_ok_and(|ran| ran.status.success()) {
        eprintln!("NOT TESTED: unshare {flags} is not allowed here: full disks, or no network");
        return None;
    }
    let ran = Command::new("unshare")
        .current_dir(folder)
        .args([flags, "sh", "-c", script])
        .env("SERVOBEE", SERVOBEE)
        .output();
    Some(ran.unwrap())
}

#[test]
fn a_full_disk_leaves_no_half_file() {
    let folder = bench();
    create_dir(folder.path().join("disk")).unwrap();
    let model = Command::new(SERVOBEE)
        .current_dir(folder.path())
        .args([
            "identify",
            "bench.csv",
            "--max-effects",
            "0",
            "--out",
            "result",
            "--quiet",
        ])
        .status();
    assert!(model.unwrap().success());
    let calls = [
        "identify bench.csv --max-effects 0 --out disk/out --quiet",
        "identify bench.csv --max-effects 0 --out disk/out --quiet --checkpoint kept",
        "datasheet --case step --evaluator cpu --out disk/out --quiet",
        "simulate result/model.toml bench.csv --out disk/simulated.csv",
        "synthesize --out disk/record.csv",
        "export result/model.toml --out disk/valve.fmu",
        "export result/model.toml --out disk/valve.c",
    ];
    for call in calls {
        let script = format!(
            "mount -t tmpfs -o size=16k none disk || exit 99
             head -c 8000 /dev/zero > disk/ballast
             $SERVOBEE {call} > printed; code=$?
             ls -A disk > listed
             exit $code"
        );
        let Some(ran) = apart(folder.path(), "-rm", &script) else {
            return;
        };
        let errors = errors(&ran);
        assert_eq!(ran.status.code(), Some(1), "{call}: {errors}");
        assert!(errors.contains("No space left"), "{call}: {errors}");
        let listed = read_to_string(folder.path().join("listed")).unwrap();
        let half: Vec<&str> = listed
            .lines()
            .filter(|name| !["ballast", "out.checkpoint"].contains(name))
            .collect();
        assert!(half.is_empty(), "{call}: {half:?}");
    }
    // What was computed before the disk was full is not lost.
    assert!(names(folder.path()).contains(&"kept".to_owned()));
    let ran = Command::new(SERVOBEE)
        .current_dir(folder.path())
        .args([
            "identify",
            "bench.csv",
            "--max-effects",
            "0",
            "--out",
            "disk/out",
        ])
        .args(["--checkpoint", "kept", "--resume"])
        .output()
        .unwrap();
    assert!(ran.status.success(), "{}", errors(&ran));
    let [one, other] = ["result/model.toml", "disk/out/model.toml"];
    let read = |name: &str| read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read(one), read(other));
}

#[test]
fn nothing_is_written_but_what_was_asked_for_and_no_network_is_needed() {
    let folder = bench();
    for name in ["home", "temporary", "work"] {
        create_dir(folder.path().join(name)).unwrap();
    }
    let script = "cd work
        export HOME=$PWD/../home TMPDIR=$PWD/../temporary
        for run in 'identify ../bench.csv --evaluator cpu --out out' 'datasheet --case step --evaluator cpu' 'inspect ../bench.csv'; do
            $SERVOBEE $run --quiet 2>&1 || $SERVOBEE $run || exit 1
        done";
    let Some(ran) = apart(folder.path(), "-rn", script) else {
        return;
    };
    assert!(ran.status.success(), "{}", errors(&ran));
    let listed = |name: &str| names(&folder.path().join(name));
    assert_eq!(listed("work"), ["out"]);
    assert_eq!(listed("work/out"), RESULTS);
    assert!(listed("home").is_empty() && listed("temporary").is_empty());
    assert_eq!(
        names(folder.path()),
        ["bench.csv", "home", "temporary", "work"]
    );
}

#[test]
fn many_runs_side_by_side_all_finish() {
    let count = match soak() {
        true => 64,
        false => 3,
    };
    let folder = bench();
    let start = |number: usize| {
        Command::new(SERVOBEE)
            .current_dir(folder.path())
            .args([
                "identify",
                "bench.csv",
                "--quiet",
                "--out",
                &format!("out{number}"),
            ])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let children: Vec<_> = (0..count).map(start).collect();
    for child in children {
        let ran = child.wait_with_output().unwrap();
        assert!(ran.status.success(), "{}", errors(&ran));
    }
    let model = |number: usize| {
        read_to_string(folder.path().join(format!("out{number}/model.toml"))).unwrap()
    };
    for number in 1..count {
        assert_eq!(model(number), model(0));
    }
    println!("{count} runs side by side");
}
