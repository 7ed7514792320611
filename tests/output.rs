//! What the program says to people and to programs: --json, --quiet, completions, a model file that goes round.

use crate::program::{printed, servobee};
use serde_json::Value;
use std::fs::read_to_string;
use std::path::Path;

/// The record that the README names, with a planted delay.
fn bench() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("tests/data/bench.csv").display().to_string()
}

#[test]
fn json_is_the_report_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "identify",
        &bench(),
        "--effects",
        "delay",
        "--evaluator",
        "cpu",
        "--json",
        "--out",
        "result",
    ];
    let text = printed(&servobee(folder.path(), &call));
    let report: Value = serde_json::from_str(&text).expect("standard output is one document");
    assert_eq!(report["schema"], "servobee/report/2");
    assert_eq!(report["effects"][0]["name"], "delay");
    assert_eq!(
        text,
        read_to_string(folder.path().join("result/report.json")).unwrap()
    );
    let card = report["card"].as_array().unwrap();
    let figure = |name: &str| card.iter().find(|figure| figure["name"] == name).unwrap();
    // The record was made with K = 250, T = 0.004, S = 1.5 V of 10, and 4.7 ms of delay: the phase of the linear loop at
    // 5 % is -90 degrees where atan2(w, K - T w²) + 0.0047 w is a quarter turn.
    let phase = |w: f64| w.atan2(250.0 - 0.004 * w * w) + 0.0047 * w;
    let (mut low, mut high) = (10.0, 1000.0);
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        match phase(middle) < std::f64::consts::FRAC_PI_2 {
            true => low = middle,
            false => high = middle,
        }
    }
    let expected = low / std::f64::consts::TAU;
    let limit = figure("phase_limit_5");
    let value = limit["value"].as_f64().unwrap();
    assert!(
        (value / expected - 1.0).abs() < 0.005,
        "{value} for {expected}"
    );
    assert!(limit["low"].as_f64().unwrap() < value && value < limit["high"].as_f64().unwrap());
    assert!(figure("leakage")["value"].is_null());
}

#[test]
fn quiet_says_nothing_and_a_written_model_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = bench();
    let call = [
        "identify",
        &file,
        "--effects",
        "delay",
        "--evaluator",
        "cpu",
        "--quiet",
        "--out",
        "first",
    ];
    assert_eq!(printed(&servobee(folder.path(), &call)), "");

    // The effect is declared now, and nothing is missing any more.
    let call = [
        "identify",
        &file,
        "--model",
        "first/model.toml",
        "--effects",
        "none",
        "--evaluator",
        "cpu",
        "--json",
    ];
    let report: Value = serde_json::from_str(&printed(&servobee(folder.path(), &call))).unwrap();
    assert_eq!(report["verdict"], "not_diagnosed");
    assert_eq!(report["remaining"]["structured"], false);
    let delay = report["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["name"] == "delay")
        .unwrap();
    assert!(
        (delay["value"].as_f64().unwrap() - 0.0047).abs() < 5e-5,
        "{delay}"
    );
}

#[test]
fn json_is_printed_whatever_else_is_kept_quiet() {
    let folder = tempfile::tempdir().unwrap();
    for quiet in ["-q", "--quiet"] {
        let call = [
            "identify",
            &bench(),
            "--effects",
            "none",
            "--evaluator",
            "cpu",
            "--json",
            quiet,
        ];
        let text = printed(&servobee(folder.path(), &call));
        let report: Value = serde_json::from_str(&text).expect("one document");
        assert_eq!(report["seed"], 1);
        assert!(
            report["arguments"].as_array().unwrap().len() == 6,
            "{report}"
        );
    }
}

#[test]
fn lists_are_there_for_programs_too() {
    let folder = tempfile::tempdir().unwrap();
    let parsed = |call: &[&str]| -> Value {
        serde_json::from_str(&printed(&servobee(folder.path(), call))).unwrap()
    };
    let effects = parsed(&["effects", "--json"]);
    assert_eq!(
        effects.as_array().unwrap().len(),
        servobee::model::effects::CATALOGUE.len()
    );
    assert!(parsed(&["devices", "--json"])["threads"].as_u64().unwrap() > 0);
}

#[test]
fn completions_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let text = printed(&servobee(folder.path(), &["completions", shell]));
        for command in [
            "identify",
            "inspect",
            "export",
            "datasheet",
            "--max-effects",
        ] {
            assert!(
                text.contains(command.trim_start_matches('-')),
                "{shell}: {command}"
            );
        }
    }
}
