//! A hum runs on while the logger is off: records that are files of their own have it with phases of their own.

use crate::beginnings::{csv, warned};
use crate::program::{json, printed, servobee};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fs::write;
use tempfile::TempDir;

const FREQUENCY: f64 = 49.93;
const AMPLITUDE: f64 = 0.06;

/// Steps and sines of which no two records have the same.
fn command(own: f64) -> impl Fn(f64) -> f64 {
    move |time| {
        let step = [4.0, -2.0, 6.0, 0.0, 0.0, -5.0][(time / 0.31 + own) as usize % 6];
        step + (20.0 * time + own).sin() - own.sin()
    }
}

/// A record that measures the spool with a hum which has this phase, in turns, at its first row.
fn hums(own: f64, phase: f64) -> String {
    let record = csv(command(own), |u| u, 0, 5000, own as u64);
    let mut lines = record.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [time, u, spool] = cells[..] else {
            panic!("{line}")
        };
        let spool = spool + AMPLITUDE * (TAU * (FREQUENCY * time + phase)).sin();
        text += &format!("{time:.3},{u:.5},{spool:.5}\n");
    }
    text
}

fn records() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, own, phase) in [("one", 3.0, 0.1), ("two", 4.0, 0.55), ("three", 5.0, 0.83)] {
        write(
            folder.path().join(name).with_extension("csv"),
            hums(own, phase),
        )
        .unwrap();
    }
    folder
}

fn identified(call: &[&str]) -> (Value, String) {
    let folder = records();
    let own = ["--evaluator", "cpu", "--out", "out"];
    let call: Vec<&str> = ["identify"]
        .iter()
        .chain(call)
        .chain(&own)
        .copied()
        .collect();
    let text = printed(&servobee(folder.path(), &call));
    (json(folder.path().join("out/report.json")), text)
}

fn is_the_hum((report, printed): &(Value, String)) {
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1, "{printed}");
    assert_eq!(
        report["effects"][0]["name"], "periodic_disturbance",
        "{printed}"
    );
    let parameters = report["parameters"].as_array().unwrap();
    let frequency = parameters
        .iter()
        .find(|one| one["name"] == "disturbance_frequency_spool");
    let low = frequency.unwrap()["low"].as_f64().unwrap();
    let high = frequency.unwrap()["high"].as_f64().unwrap();
    assert!((low..high).contains(&FREQUENCY), "{low} .. {high}");
}

#[test]
fn the_record_that_is_held_out_hums_with_a_phase_of_its_own() {
    let found = identified(&["one.csv", "--hold-out", "two.csv"]);
    is_the_hum(&found);
    for words in [
        "two hums with 49.9",
        " Hz in its spool as one does, out of phase",
    ] {
        assert!(warned(&found.0, words), "{}", found.0["warnings"]);
    }
}

#[test]
fn each_of_the_fitted_records_hums_with_a_phase_of_its_own() {
    is_the_hum(&identified(&[
        "one.csv",
        "two.csv",
        "--hold-out",
        "three.csv",
    ]));
    is_the_hum(&identified(&["one.csv", "two.csv", "three.csv"]));
}

#[test]
fn a_hum_that_goes_on_has_not_changed_between_before_and_after() {
    let folder = records();
    let call = [
        "compare",
        "one.csv",
        "--with",
        "two.csv",
        "--evaluator",
        "cpu",
        "--out",
        "out",
    ];
    printed(&servobee(folder.path(), &call));
    let compared = json(folder.path().join("out/compare.json"));
    for side in ["before", "after"] {
        let report = json(folder.path().join(format!("out/{side}.json")));
        assert_eq!(
            report["effects"][0]["name"], "periodic_disturbance",
            "{report}"
        );
    }
    assert_eq!(
        compared["effects"][0]["fate"], "stayed",
        "{}",
        compared["effects"]
    );
}
