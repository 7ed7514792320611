//! Records that begin in motion, or at rest with a command: loggers are switched on at any time. The records are made here, in
//! steps of 20 us.

use crate::program::{json, printed, servobee};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fmt::Write;
use std::fs::{create_dir, write};

const GAIN: f64 = 220.0;
const TIME_CONSTANT: f64 = 0.0025;
const SATURATION: f64 = 6.0;
const NOISE: f64 = 0.02;

/// Rows of 1 ms of a spool that begins at rest at null, from row `first` on; the loop follows what `arrives` of the command.
pub(crate) fn csv(
    command: impl Fn(f64) -> f64,
    mut arrives: impl FnMut(f64) -> f64,
    first: usize,
    rows: usize,
    seed: u64,
) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || NOISE * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
    let mut text = String::from("time [s],command [V],spool [V]\n");
    let (mut integrator, mut spool) = (0.0f64, 0.0f64);
    let step = 2e-5;
    for row in 0..first + rows {
        let time = row as f64 * 1e-3;
        let u = command(time);
        if row >= first {
            writeln!(text, "{time:.3},{u:.5},{:.5}", spool + noise()).unwrap();
        }
        let arrived = arrives(u);
        for _ in 0..50 {
            let speed = (integrator - spool) / TIME_CONSTANT;
            integrator += step * GAIN * (arrived - spool).clamp(-SATURATION, SATURATION);
            spool += step * speed;
        }
    }
    text
}

/// Sines, and jumps that saturate the error.
fn lively(time: f64) -> f64 {
    let jump = if ((time / 0.37) as u64).is_multiple_of(2) {
        3.6
    } else {
        -3.6
    };
    jump + 2.0 * (34.0 * time).sin() + 1.5 * (121.0 * time).cos()
}

pub(crate) fn identified(record: String) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record).unwrap();
    let call = ["identify", "log.csv", "--evaluator", "cpu", "--out", "out"];
    let text = printed(&servobee(folder.path(), &call));
    (json(folder.path().join("out/report.json")), text)
}

pub(crate) fn warned(report: &Value, words: &str) -> bool {
    let mut all = report["warnings"].as_array().unwrap().iter();
    all.any(|warning| warning.as_str().unwrap().contains(words))
}

fn value(report: &Value, name: &str) -> f64 {
    let mut all = report["parameters"].as_array().unwrap().iter();
    let one = all.find(|one| one["name"] == name);
    one.unwrap()["value"].as_f64().unwrap()
}

#[test]
fn a_record_that_begins_in_motion_lacks_nothing_for_that() {
    for first in [500, 811, 1234] {
        let (report, printed) = identified(csv(lively, |u| u, first, 4000, 7));
        assert_eq!(report["verdict"], "none", "{first}: {printed}");
        assert!(
            (value(&report, "gain") / GAIN - 1.0).abs() < 0.02,
            "{printed}"
        );
        let warning = "log begins in motion: its first 0.14";
        assert!(warned(&report, warning), "{report}");
        assert_eq!(report["records"][0]["fitted"], 2800 - 140);
    }
}

#[test]
fn what_it_lacks_is_found_all_the_same() {
    let mut follower = 0.0f64;
    let play = |u: f64| {
        follower = follower.clamp(u - 0.1, u + 0.1);
        follower
    };
    let (report, printed) = identified(csv(lively, play, 911, 4000, 8));
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"][0]["name"], "hysteresis");
}

#[test]
fn a_step_in_the_first_row_finds_the_valve_at_rest() {
    let steps = |time: f64| [5.0, -3.0, 8.0, 1.0, -6.0][(time / 0.3) as usize % 5];
    let (report, printed) = identified(csv(steps, |u| u, 0, 4000, 9));
    assert_eq!(report["verdict"], "none", "{printed}");
    assert!(
        warned(&report, "begin at rest, not in equilibrium"),
        "{report}"
    );
    assert_eq!(report["records"][0]["fitted"], 2800);
}

#[test]
fn a_record_in_equilibrium_counts_from_its_first_row() {
    let (report, printed) = identified(csv(|time| lively(time) - lively(0.0), |u| u, 0, 4000, 10));
    assert_eq!(report["verdict"], "none", "{printed}");
    assert!(!warned(&report, " begin"), "{report}");
    assert_eq!(report["records"][0]["fitted"], 2800);
}

#[test]
fn two_records_of_one_name_each_count_their_own_rows() {
    let folder = tempfile::tempdir().unwrap();
    for (name, first, rows) in [("monday", 500, 4000), ("tuesday", 811, 600)] {
        create_dir(folder.path().join(name)).unwrap();
        let record = csv(lively, |u| u, first, rows, first as u64);
        write(folder.path().join(name).join("log.csv"), record).unwrap();
    }
    let records = ["monday/log.csv", "tuesday/log.csv"];
    let call = [
        "identify",
        records[0],
        records[1],
        "--evaluator",
        "cpu",
        "--out",
        "out",
    ];
    let printed = printed(&servobee(folder.path(), &call));
    let report = json(folder.path().join("out/report.json"));
    assert_eq!(report["verdict"], "none", "{printed}");
    let rows: u64 = report["records"]
        .as_array()
        .unwrap()
        .iter()
        .map(|record| record["fitted"].as_u64().unwrap() + record["held_out"].as_u64().unwrap())
        .sum();
    assert!(rows < 4600 - 150, "{report}");
}
