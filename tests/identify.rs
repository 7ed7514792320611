//! The command identify, as a user calls it.

use crate::program;
use crate::program::{
    bench, columns, has_gpu, json, measured, names, off, printed, refused, rms, servobee,
    servobee_with, soak, value, whole_bench,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use servobee::evaluate::problem::Series;
use servobee::evaluate::simulate::outputs;
use servobee::model::effects::{CATALOGUE, Effect};
use servobee::model::valve::{Meter, ValveForm};
use servobee::model::{Complete, Hold, Output, Outputs, ServoValve, Structure};
use servobee::record::{self, Channel, Record};
use sha2::{Digest, Sha256};
use std::fs::{create_dir, read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

/// Of every record the last 30 % are held out.
const BENCH_ROWS: [usize; 2] = [4200, 1800];

/// A folder with a short and lively part of the same record, as text.
fn excerpt() -> (TempDir, String) {
    let text = program::excerpt(1500);
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("bench.csv"), &text).unwrap();
    (folder, text)
}

/// The report of a run that succeeds.
fn report(folder: &Path, arguments: &[&str]) -> Value {
    let call = [&["identify"], arguments, &["--out", "out"]].concat();
    printed(&servobee(folder, &call));
    json(folder.join("out/report.json"))
}

fn without_time(text: &str) -> String {
    let lines = text
        .lines()
        .filter(|line| !line.starts_with("  \"seconds\": ") && !line.starts_with("  \"date\": "));
    lines.collect::<Vec<&str>>().join("\n")
}

#[test]
fn the_report_has_every_field_of_the_contract() {
    let folder = bench();
    let report = report(folder.path(), &["bench.csv", "--seed", "3"]);
    assert_eq!(names(&folder.path().join("out")), program::RESULTS);

    assert_eq!(report["schema"], "servobee/report/2");
    let verdict = report["verdict"].as_str().unwrap();
    assert!(
        ["found", "none", "unexplained", "not_diagnosed"].contains(&verdict),
        "{verdict}"
    );
    let strings = |list: &Value| {
        let list = list.as_array().expect("a list");
        list.iter().all(Value::is_string)
    };
    for effect in report["effects"].as_array().unwrap() {
        assert!(
            effect["name"].is_string() && effect["port"].is_string(),
            "{effect}"
        );
        assert!(strings(&effect["tied_with"]), "{effect}");
        assert!(
            effect["error_before"].is_number() && effect["error_after"].is_number(),
            "{effect}"
        );
    }
    for when in ["before", "after"] {
        for part in ["fit", "hold_out"] {
            for channel in ["spool", "flow"] {
                let score = &report["error"][when][part][channel];
                assert!(score["rmse"].as_f64().unwrap() > 0.0, "{score}");
                assert!(score["fit_percent"].as_f64().unwrap() < 100.0, "{score}");
            }
        }
    }
    for channel in ["spool", "flow"] {
        assert!(report["noise_floor"][channel].as_f64().unwrap() > 0.0);
    }
    let parameters = report["parameters"].as_array().unwrap();
    for name in ["gain", "time_constant", "saturation", "max_area"] {
        let parameter = parameters.iter().find(|p| p["name"] == name).unwrap();
        assert!(parameter["unit"].is_string(), "{parameter}");
        let number = |key: &str| parameter[key].as_f64().unwrap();
        assert!(number("low") < number("value") && number("value") < number("high"));
        assert!(number("before") > 0.0);
        assert_eq!(parameter["at_bound"], false);
    }
    assert!(report["remaining"]["structured"].is_boolean());
    assert!(strings(&report["remaining"]["correlates_with"]));
    assert!(report["evaluator"].is_string());
    assert_eq!(report["seed"], 3);
    assert!(report["evaluations"].as_u64().unwrap() > 100);
    assert!(report["seconds"].as_f64().unwrap() > 0.0);
    assert!(strings(&report["warnings"]));
}

#[test]
fn the_base_model_leaves_far_more_than_noise_and_the_report_says_so() {
    let folder = bench();
    let call = ["identify", "bench.csv", "--effects", "none", "--out", "out"];
    let text = printed(&servobee(folder.path(), &call));
    assert!(
        text.contains("What is left in the residual is more than noise"),
        "{text}"
    );
    let report = json(folder.path().join("out/report.json"));
    assert!(
        text.contains("Verdict: not diagnosed. Which effects the base model lacks was not asked."),
        "{text}"
    );
    assert_eq!(report["verdict"], "not_diagnosed");
    assert!(report["explained"].is_null(), "{report}");
    assert_eq!(report["remaining"]["structured"], true);
    assert_eq!(report["effects"].as_array().unwrap().len(), 0);
    // 0.3 % of 10 V and of 57.6 L/min.
    for (channel, noise) in [("spool", 0.03), ("flow", 0.173)] {
        let floor = report["noise_floor"][channel].as_f64().unwrap();
        assert!(off(floor, noise) < 0.2, "{channel}: {floor}");
        let error = &report["error"]["before"]["hold_out"][channel];
        assert!(error["rmse"].as_f64().unwrap() > 5.0 * noise, "{error}");
    }
    // The delay is in no way of the valve's size: the rated flow follows from 0.4 cm2 all the same.
    assert!(off(value(&report, "max_area"), 0.4) < 0.01);
}

#[test]
fn the_residual_file_holds_every_row_and_the_errors_of_the_report() {
    let folder = whole_bench();
    let report = report(folder.path(), &["bench.csv"]);
    let path = folder.path().join("out/residual.csv");
    let text = read_to_string(&path).unwrap();
    let starts = ["bench,fit,", "bench,hold_out,"];
    let rows = starts.map(|start| text.lines().filter(|line| line.starts_with(start)).count());
    assert_eq!(rows, BENCH_ROWS);
    let columns = columns(&path);
    let column = |name: &str| {
        let found = columns.iter().find(|column| column.0 == name);
        &found.unwrap_or_else(|| panic!("no column {name}")).1
    };
    assert_eq!(columns[2].0, "time [s]");
    let parts = [
        ("fit", 0..BENCH_ROWS[0]),
        ("hold_out", BENCH_ROWS[0]..BENCH_ROWS[0] + BENCH_ROWS[1]),
    ];
    for (channel, unit) in [("spool", "V"), ("flow", "L/min")] {
        let measured = column(&format!("{channel} measured [{unit}]"));
        for when in ["before", "after"] {
            let simulated = column(&format!("{channel} {when} [{unit}]"));
            for (part, rows) in parts.clone() {
                let error = rms(rows.map(|row| measured[row] - simulated[row]));
                let reported = report["error"][when][part][channel]["rmse"].as_f64();
                assert!(
                    off(error, reported.unwrap()) < 1e-9,
                    "{channel} {when} {part}"
                );
            }
        }
    }
}

#[test]
fn the_model_file_simulates_to_the_same_error_and_is_found_again() {
    let folder = bench();
    let first = report(folder.path(), &["bench.csv", "--effects", "none"]);
    let text = printed(&servobee(
        folder.path(),
        &["simulate", "out/model.toml", "bench.csv"],
    ));
    for channel in ["spool", "flow"] {
        let square = |part: &str, rows: usize| {
            let rmse = first["error"]["after"][part][channel]["rmse"].as_f64();
            rmse.unwrap().powi(2) * rows as f64
        };
        let sum = square("fit", BENCH_ROWS[0]) + square("hold_out", BENCH_ROWS[1]);
        let whole = (sum / BENCH_ROWS.iter().sum::<usize>() as f64).sqrt();
        let line = text.lines().find(|line| line.starts_with(channel));
        let printed: f64 = line
            .unwrap()
            .split_whitespace()
            .nth(2)
            .unwrap()
            .parse()
            .unwrap();
        assert!(
            off(printed, whole) < 1e-3,
            "{channel}: {printed}, not {whole}"
        );
    }

    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "none",
        "--model",
        "out/model.toml",
        "--out",
        "again",
    ];
    printed(&servobee(folder.path(), &call));
    let again = json(folder.path().join("again/report.json"));
    for name in ["gain", "time_constant", "saturation", "max_area"] {
        let (first, again) = (value(&first, name), value(&again, name));
        assert!(off(again, first) < 1e-4, "{name}: {first}, then {again}");
    }
}

#[test]
fn a_model_file_fixes_what_it_names() {
    let (folder, _) = excerpt();
    let model = "[[parameter]]\nname = \"saturation\"\nvalue = 1.5\nfixed = true\n";
    write(folder.path().join("known.toml"), model).unwrap();
    let report = report(folder.path(), &["bench.csv", "--model", "known.toml"]);
    assert_eq!(value(&report, "saturation"), 1.5);
}

#[test]
fn a_model_without_a_free_parameter_is_scored_as_it_is() {
    let folder = bench();
    report(folder.path(), &["bench.csv", "--effects", "none"]);
    let model = read_to_string(folder.path().join("out/model.toml")).unwrap();
    write(
        folder.path().join("all.toml"),
        model.replace("fixed = false", "fixed = true"),
    )
    .unwrap();
    let fitted = json(folder.path().join("out/report.json"));
    let scored = report(
        folder.path(),
        &[
            "bench.csv",
            "--effects",
            "none",
            "--model",
            "all.toml",
            "--force",
        ],
    );
    assert_eq!(scored["error"]["before"], fitted["error"]["before"]);
    // Once by the search that has nothing to search, once by the polish that has nothing to polish.
    assert_eq!(scored["evaluations"], 2);
}

/// The report of identify on `record` with these effects known, and `more` in the model file. What it writes is read back and
/// gives the same errors.
fn with_known(folder: &Path, record: &str, known: &[&str], more: &str, rest: &[&str]) -> Value {
    write(
        folder.join("known.toml"),
        format!("[structure]\neffects = {known:?}\n{more}"),
    )
    .unwrap();
    let call = [
        record,
        "--model",
        "known.toml",
        "--evaluator",
        "cpu",
        "--force",
    ];
    let report = report(folder, &[&call[..], rest].concat());
    let text = printed(&servobee(folder, &["simulate", "out/model.toml", record]));
    let residual = read_to_string(folder.join("out/residual.csv")).unwrap();
    let rows = |part: &str| residual.lines().filter(|line| line.contains(part)).count() as f64;
    let parts = [("fit", rows(",fit,")), ("hold_out", rows(",hold_out,"))];
    for (channel, error) in report["error"]["after"]["fit"].as_object().unwrap() {
        assert!(error["rmse"].is_number(), "{known:?}: {error}");
        let square = |(part, rows): &(&str, f64)| {
            let rmse = report["error"]["after"][part][channel]["rmse"].as_f64();
            rmse.unwrap().powi(2) * rows
        };
        let count = parts[0].1 + parts[1].1;
        let whole = (parts.iter().map(square).sum::<f64>() / count).sqrt();
        let line = text.lines().find(|line| line.starts_with(channel)).unwrap();
        let simulated = line.split_whitespace().nth(2).unwrap();
        let simulated: f64 = simulated.parse().unwrap();
        assert!(
            off(simulated, whole) < 2e-3,
            "{known:?}: {channel}: {simulated}, not {whole}"
        );
    }
    report
}

/// The names of the effects that were added.
fn added(report: &Value) -> Vec<&str> {
    let effects = report["effects"].as_array().unwrap().iter();
    effects.map(|one| one["name"].as_str().unwrap()).collect()
}

/// A folder with `record.csv`, so many seconds with these effects planted.
fn synthesized(effects: &str, seconds: &str) -> TempDir {
    metered("load", effects, seconds)
}

/// The same, the flow measured there.
fn metered(meter: &str, effects: &str, seconds: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "synthesize",
        "--effect",
        effects,
        "--meter",
        meter,
        "--seconds",
        seconds,
        "--out",
        "record.csv",
    ];
    printed(&servobee(folder.path(), &call));
    folder
}

#[test]
fn a_known_effect_that_is_not_there_changes_nothing() {
    let folder = bench();
    let report = with_known(folder.path(), "bench.csv", &["null_bias"], "", &[]);
    assert_eq!(report["verdict"], "found");
    assert_eq!(added(&report), ["delay"]);
    assert!(off(value(&report, "delay"), 0.0047) < 0.01, "{report}");
    assert!(value(&report, "null_bias").abs() < 0.01, "{report}");
}

#[test]
fn a_known_effect_hides_no_other() {
    let folder = metered("supply", "hysteresis=0.3,leakage=2", "8");
    let report = with_known(folder.path(), "record.csv", &["leakage"], "", &[]);
    assert_eq!(report["verdict"], "found");
    assert_eq!(added(&report), ["hysteresis"]);
    assert!(off(value(&report, "hysteresis"), 0.3) < 0.05, "{report}");
    assert!(off(value(&report, "leakage"), 2.0) < 0.05, "{report}");
}

#[test]
fn an_effect_with_nothing_to_act_on_is_refused_with_where_it_shows() {
    let folder = synthesized("delay=0.0047", "1");
    let model = "[structure]\neffects = [\"leakage\"]\n";
    write(folder.path().join("known.toml"), model).unwrap();
    for more in [["--effects", "delay,leakage"], ["--model", "known.toml"]] {
        let call = [&["identify", "record.csv"], &more[..]].concat();
        let text = refused(&servobee(folder.path(), &call));
        for part in ["leakage", "nothing to act on", "in the pressure line"] {
            assert!(text.contains(part), "{part} is not in: {text}");
        }
    }
}

#[test]
fn what_is_added_to_the_flow_throughout_is_the_meters_wherever_it_stands() {
    for (meter, offset) in [("load", 1.5), ("supply", 1.5), ("supply", -1.5)] {
        let planted = format!("sensor_offset.flow={offset}");
        let folder = metered(meter, &planted, "3");
        let call = ["identify", "record.csv", "--out", "out"];
        printed(&servobee(folder.path(), &call));
        let report = json(folder.path().join("out/report.json"));
        assert_eq!(added(&report), ["sensor_offset"], "{meter}: {report}");
        let found = value(&report, "sensor_offset_flow");
        assert!(off(found, offset) < 0.05, "{meter}: {found}");
    }
}

/// Every effect of the catalogue in every form on a spool with its flow, measured there; those that take long only with
/// `SERVOBEE_SOAK=1`.
fn every_effect(meter: Meter) -> Vec<Effect> {
    let slow = ["line_resonance", "supply_droop"];
    let bench = Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm {
            meter,
            ..ValveForm::linear()
        })
        .into(),
        ..Structure::actuator(10.0, "V")
    };
    CATALOGUE
        .iter()
        .filter(|entry| soak() || !slow.contains(&entry.name))
        .flat_map(|entry| entry.on(&bench))
        .collect()
}

/// Where the valve answers 4.7 ms late the delay is found whatever else is known; and where it is known nothing is.
fn assert_late(report: &Value, known: &[&str]) {
    let (verdict, names) = match known.contains(&"delay") {
        true => ("none", vec![]),
        false => ("found", vec!["delay"]),
    };
    assert_eq!(report["verdict"], verdict, "{known:?}");
    assert_eq!(added(report), names, "{known:?}");
    // What leads and what is late nearly cancel: how late the answer is is what both leave.
    let lead = match known.contains(&"feed_forward") {
        true => value(report, "feed_forward"),
        false => 0.0,
    };
    let late = value(report, "delay") - lead;
    assert!(off(late, 0.0047) < 0.02, "{known:?}: {late}");
}

#[test]
fn every_effect_of_the_catalogue_can_be_known() {
    let folder = synthesized("delay=0.0047", "1");
    let few = [
        "--effects",
        "delay,hysteresis,overlap",
        "--max-effects",
        "2",
    ];
    let known = |folder: &Path, effect: &Effect| {
        let known = effect.to_string();
        let known = [known.as_str()];
        let report = with_known(folder, "record.csv", &known, "", &few);
        assert_late(&report, &known);
    };
    let usual = every_effect(Meter::Load);
    usual
        .iter()
        .step_by(if soak() { 1 } else { 12 })
        .for_each(|effect| known(folder.path(), effect));
    let mut others = every_effect(Meter::Supply);
    others.retain(|effect| !usual.contains(effect));
    assert!(!others.is_empty());
    let folder = metered("supply", "delay=0.0047", "1");
    others
        .iter()
        .step_by(if soak() { 1 } else { 2 })
        .for_each(|effect| known(folder.path(), effect));
}

#[test]
fn two_known_effects_one_of_them_fixed_hide_nothing() {
    let folder = synthesized("delay=0.0047", "1");
    let few = [
        "--effects",
        "delay,hysteresis,overlap",
        "--max-effects",
        "2",
    ];
    let all = every_effect(Meter::Load);
    for (i, first) in all.iter().enumerate().step_by(if soak() { 1 } else { 20 }) {
        let second = all[(i + 7) % all.len()];
        let known = [first.to_string(), second.to_string()];
        let known = known.each_ref().map(String::as_str);
        // Where it is absent.
        let bare = Structure {
            effects: vec![*first],
            ..Structure::flow_bench(ValveForm::linear())
        };
        let skipped = Structure::flow_bench(ValveForm::linear())
            .parameters()
            .len();
        let fixed: String = bare.parameters()[skipped..]
            .iter()
            .map(|p| format!("[[parameter]]\nname = {:?}\nfixed = true\n", p.name))
            .collect();
        let fixed = if first.entry.name == "delay" {
            ""
        } else {
            &fixed
        };
        let report = with_known(folder.path(), "record.csv", &known, fixed, &few);
        assert_late(&report, &known);
    }
}

#[test]
fn what_is_planted_and_known_is_followed_with_and_without_another() {
    let few = [
        "--effects",
        "delay,hysteresis,overlap",
        "--max-effects",
        "2",
    ];
    for (known, planted, name, expected) in [
        ("overlap", "overlap=4", "overlap", 4.0),
        (
            "sensor_offset.flow",
            "sensor_offset.flow=1.5",
            "sensor_offset_flow",
            1.5,
        ),
        ("slew_limit", "slew_limit=300", "slew_limit", 300.0),
    ] {
        let late = synthesized(&format!("{planted},delay=0.003"), "2");
        let report = with_known(late.path(), "record.csv", &[known], "", &few);
        assert_eq!(
            (&report["verdict"], added(&report)),
            (&"found".into(), vec!["delay"]),
            "{known}"
        );
        assert!(
            off(value(&report, "delay"), 0.003) < 0.03,
            "{known}: {report}"
        );
        let found = value(&report, name);
        assert!(off(found, expected) < 0.05, "{known}: {found}");

        let bounds = format!(
            "[[parameter]]\nname = {name:?}\nvalue = {expected:?}\nlow = {:?}\nhigh = {:?}\n",
            0.9 * expected,
            1.1 * expected
        );
        let report = with_known(late.path(), "record.csv", &[known, "delay"], &bounds, &few);
        assert_eq!(
            (&report["verdict"], added(&report)),
            (&"none".into(), vec![]),
            "{known}"
        );
        let found = value(&report, name);
        assert!(off(found, expected) < 0.05, "{known}: {found}");
        assert!(
            off(value(&report, "delay"), 0.003) < 0.03,
            "{known}: {report}"
        );
    }
}

#[test]
fn what_was_not_asked_is_not_said_to_be_in_no_catalogue() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("bench.csv"), program::excerpt(900)).unwrap();
    for (effects, more, verdict, sentence) in [
        (
            "gain_curvature,overlap",
            "1",
            "unexplained",
            "lacks something that none of the 2 effects that were asked explains.",
        ),
        (
            "gain_curvature",
            "1",
            "unexplained",
            "lacks something that the one effect that was asked, gain_curvature, does not explain.",
        ),
        (
            "all",
            "0",
            "not_diagnosed",
            "not diagnosed. Which effects the base model lacks was not asked.",
        ),
    ] {
        let call = [
            "identify",
            "bench.csv",
            "--effects",
            effects,
            "--max-effects",
            more,
            "--out",
            "out",
            "--force",
        ];
        let text = printed(&servobee(folder.path(), &call));
        assert!(text.contains(sentence), "{effects}: {text}");
        assert!(!text.contains("catalogue"), "{effects}: {text}");
        let report = json(folder.path().join("out/report.json"));
        assert_eq!(report["verdict"], verdict, "{effects}");
        assert!(report["explained"].is_null(), "{effects}");
        let asked: Vec<&str> = match verdict {
            "unexplained" => effects.split(',').collect(),
            _ => vec![],
        };
        let told = report["asked"].as_array().unwrap();
        assert_eq!(told.len(), asked.len(), "{report}");
        assert!(asked.iter().all(|name| told.contains(&Value::from(*name))));
        let page = read_to_string(folder.path().join("out/report.html")).unwrap();
        assert!(
            page.contains(sentence.trim_start_matches("not diagnosed. ")),
            "{effects}"
        );
        assert!(!page.contains("catalogue"), "{effects}");
    }
    // What is known already cannot be asked.
    let report = with_known(
        folder.path(),
        "bench.csv",
        &["null_bias"],
        "",
        &["--effects", "null_bias"],
    );
    assert_eq!(report["verdict"], "not_diagnosed");
}

#[test]
fn what_moved_is_said_beside_before_and_after_and_is_no_warning() {
    let (folder, _) = excerpt();
    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "delay",
        "--out",
        "out",
    ];
    let ran = servobee(folder.path(), &call);
    let text = printed(&ran);
    assert!(
        text.contains("moved") && text.contains("wrong and sure"),
        "{text}"
    );
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert!(!errors.contains("sure"), "{errors}");
    let report = json(folder.path().join("out/report.json"));
    let parameters = report["parameters"].as_array().unwrap().iter();
    assert!(
        parameters.clone().any(|one| one["moved"] == true),
        "{report}"
    );
    assert!(!report["warnings"].to_string().contains("sure"), "{report}");
}

#[test]
fn a_short_record_is_fitted_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time [s],command [V],spool [V]\n0,0,0\n0.001,1,0\n0.002,1,0.1\n";
    write(folder.path().join("short.csv"), text).unwrap();
    let warnings = report(folder.path(), &["short.csv"])["warnings"].to_string();
    assert!(
        warnings.contains("only 2 rows for 3 parameters"),
        "{warnings}"
    );
}

#[test]
fn the_same_call_writes_the_same_files_on_any_number_of_threads() {
    let folder = bench();
    let run = |out: &str, set: &[(&str, &str)]| {
        let call = [
            "identify",
            "bench.csv",
            "--evaluator",
            "cpu",
            "--seed",
            "7",
            "--out",
            out,
        ];
        printed(&servobee_with(folder.path(), &call, set));
        let read = |name: &str| read_to_string(folder.path().join(out).join(name)).unwrap();
        let report = read("report.json");
        assert!(report.contains("\n  \"seconds\": "), "{report}");
        (
            without_time(&report),
            read("model.toml"),
            read("residual.csv"),
        )
    };
    let first = run("first", &[]);
    assert_eq!(first.0, run("second", &[]).0);
    let single = run("single", &[("RAYON_NUM_THREADS", "1")]);
    assert_eq!(first.0, single.0);
    assert!(first == single, "model.toml or residual.csv differ");
}

#[test]
fn the_gpu_finds_the_parameters_that_the_cpu_finds() {
    if !has_gpu() {
        return;
    }
    let folder = bench();
    let [cpu, gpu] = ["cpu", "gpu"].map(|evaluator| {
        let call = ["identify", "bench.csv", "--evaluator", evaluator, "--out"];
        printed(&servobee(
            folder.path(),
            &[&call[..], &[evaluator]].concat(),
        ));
        json(folder.path().join(evaluator).join("report.json"))
    });
    assert_ne!(cpu["evaluator"], gpu["evaluator"]);
    assert_eq!(cpu["verdict"], gpu["verdict"]);
    for parameter in cpu["parameters"].as_array().unwrap() {
        let name = parameter["name"].as_str().unwrap();
        let (cpu, gpu) = (value(&cpu, name), value(&gpu, name));
        let difference = (cpu - gpu).abs();
        assert!(difference <= 1e-4 * cpu.abs(), "{name}: {cpu} and {gpu}");
    }
}

/// A folder with `record.csv` that an actuator with these K, T and S gives exactly, and perhaps a spool gain; and even noise of
/// up to `noise`.
fn planted(values: &[f64], spool_unit: Option<&str>, noise: f64) -> TempDir {
    planted_with(values, spool_unit, noise, Hold::Held)
}

/// The same where the command is held between two rows, or not.
fn planted_with(values: &[f64], spool_unit: Option<&str>, noise: f64, hold: Hold) -> TempDir {
    let structure = Structure {
        hold,
        base: ServoValve {
            spool_unit: spool_unit.map(String::from),
            ..ServoValve::default()
        }
        .into(),
        ..Structure::actuator(10.0, "V")
    };
    let time: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
    // Jumps of all sizes both ways, past the saturation, and a wobble.
    let height = |k: i32| 7.0 * (f64::from(k / 80) * 1.3).sin() + (f64::from(k) * 0.03).sin();
    let command = record::Series::new("V", (0..2000).map(height).collect());
    let commanded = Record::new(
        "planted",
        time.clone(),
        [(Channel::Command, command.clone())],
    );
    let mut series = Series::to_simulate(&commanded.unwrap(), &structure).unwrap();
    // As fine as for any parameters that a search may try.
    series.set_steps(2e4, 1);
    let values = Complete::from_iter(values.iter().copied());
    let simulated = outputs(&structure, &values, &series);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let measured = |row: &Outputs<f64>| row[Output::Spool] + noise * rng.random_range(-1.0..=1.0);
    let spool = simulated.iter().map(measured);
    let spool = record::Series::new(structure.unit(Output::Spool), spool.collect());
    let channels = [(Channel::Command, command), (Channel::Spool, spool)];
    let folder = tempfile::tempdir().unwrap();
    let record = Record::new("planted", time, channels).unwrap();
    record.write_csv(folder.path().join("record.csv")).unwrap();
    folder
}

#[test]
fn a_planted_actuator_is_recovered() {
    let folder = planted(&[250.0, 0.004, 1.5], None, 0.0);
    let report = report(folder.path(), &["record.csv"]);
    for (name, planted) in [
        ("gain", 250.0),
        ("time_constant", 0.004),
        ("saturation", 1.5),
    ] {
        let found = value(&report, name);
        println!("{name}: {found}, off by {:.1e}", off(found, planted));
        assert!(off(found, planted) < 1e-4, "{name}: {found}");
    }
    assert_eq!(report["verdict"], "none");
    assert_eq!(report["effects"].as_array().unwrap().len(), 0);
}

#[test]
fn a_planted_gain_between_units_is_recovered() {
    let folder = planted(&[120.0, 0.006, 3.0, -8.0], Some("%"), 0.0);
    let report = report(folder.path(), &["record.csv"]);
    for (name, planted) in [
        ("gain", 120.0),
        ("time_constant", 0.006),
        ("saturation", 3.0),
        ("spool_gain", -8.0),
    ] {
        let found = value(&report, name);
        assert!(off(found, planted) < 1e-4, "{name}: {found}");
    }
}

#[test]
fn where_nothing_rests_or_repeats_the_residual_shows_the_noise() {
    let folder = planted(&[250.0, 0.004, 1.5], None, 0.1);
    let report = report(folder.path(), &["record.csv", "--effects", "none"]);
    assert_eq!(report["noise_method"]["spool"], "high-pass residual");
    let found = report["noise_floor"]["spool"].as_f64().unwrap();
    assert!(off(found, 0.1 / 3_f64.sqrt()) < 0.1, "{found}");
}

/// A folder with a record of a slow triangle, two periods of 100 s at 50 Hz, and of what a meter shows of the `flow` at a
/// command and a time.
fn slow_triangle(flow: impl Fn(f64, f64) -> f64) -> TempDir {
    let command = |t: f64| 10.0 * (4.0 * ((t / 100.0 + 0.75).fract() - 0.5).abs() - 1.0);
    let mut text = String::from("time [s],command [V],flow [L/min]\n");
    for k in 0..10_000 {
        let t = f64::from(k) * 0.02;
        let u = command(t);
        text += &format!("{t:.2},{u:.4},{:.5}\n", flow(u, t));
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("record.csv"), text).unwrap();
    folder
}

#[test]
fn the_rounding_of_a_slow_meter_is_noise_and_no_effect() {
    // A meter with steps of 0.1 gpm: 0.109 L/min over the root of twelve.
    let step = 0.1 * 3.785_411_784;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let errors: Vec<f64> = (0..10_000)
        .map(|_| 0.02 * rng.random_range(-1.0..=1.0))
        .collect();
    let shown = |u: f64, t: f64| {
        let error = errors[(t / 0.02).round() as usize];
        step * ((4.0 * u + error) / step).round()
    };
    let folder = slow_triangle(shown);
    let report = report(folder.path(), &["record.csv"]);
    let floor = report["noise_floor"]["flow"].as_f64().unwrap();
    assert_eq!(report["noise_method"]["flow"], "resolution");
    let sources = report["noise_sources"]["flow"].as_array().unwrap();
    let resolution = sources.iter().find(|one| one["from"] == "resolution");
    let resolution = resolution.expect("the meter has steps");
    let least = resolution["value"].as_f64().unwrap();
    assert!(off(least, step / 12_f64.sqrt()) < 0.01, "{least}");
    assert!(least <= floor && floor < 1.1 * least, "{floor}");
    assert!(resolution["standard_error"].is_null(), "{resolution}");
    assert_eq!(report["verdict"], "none", "{}", report["effects"]);
    assert_eq!(
        report["remaining"]["structured"], false,
        "{}",
        report["remaining"]
    );
}

#[test]
fn noise_that_grows_with_the_flow_is_told() {
    // The valve rests at null before it moves, and the meter with it.
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut text = String::from("time [s],command [V],flow [L/min]\n");
    let period = |k: i32| match k % 2000 {
        k if k < 800 => 0.0,
        k => 8.0 * (f64::from(k - 800) * std::f64::consts::TAU / 1200.0).sin(),
    };
    for k in 0..8000 {
        let u = period(k);
        let noise = 0.05 + 0.03 * u.abs();
        let flow = 4.0 * u + noise * rng.random_range(-1.0..=1.0);
        text += &format!("{:.3},{u:.6},{flow:.7}\n", f64::from(k) * 1e-3);
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("record.csv"), text).unwrap();
    let report = report(folder.path(), &["record.csv", "--effects", "none"]);
    let warnings = report["warnings"].as_array().unwrap();
    let told = |warning: &Value| {
        let text = warning.as_str().unwrap();
        text.contains("repeated command") && text.contains("quiet stretches")
    };
    assert!(warnings.iter().any(told), "{warnings:?}");
}

#[test]
fn a_measured_servo_actuator_is_followed_on_a_record_never_fitted() {
    let files = [
        "mts_actuator_mrdamper_0A.csv",
        "mts_actuator_mrdamper_1A.csv",
    ]
    .map(measured);
    let [Some(fitted), Some(held_out)] = files else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for channel in ["spool", "position"] {
        let map = format!("x_meas_mm={channel} [mm]");
        let call = [
            "identify",
            fitted.to_str().unwrap(),
            "--hold-out",
            held_out.to_str().unwrap(),
            "--map",
            "t_s=time [s]",
            "--map",
            "x_cmd_mm=command [mm]",
            "--map",
            &map,
            "--effects",
            "none",
            "--out",
            channel,
        ];
        printed(&servobee(folder.path(), &call));
        let report = json(folder.path().join(channel).join("report.json"));
        let rmse = &report["error"]["before"]["hold_out"][channel]["rmse"];
        println!("{channel}: RMS {rmse} mm held out");
        assert!(rmse.as_f64().unwrap() <= 0.078, "{channel}: {rmse} mm");
        let warnings = report["warnings"].as_array().unwrap();
        let ignored = |warning: &&Value| warning.as_str().unwrap().contains("force_N");
        assert_eq!(warnings.iter().filter(ignored).count(), 2, "{warnings:?}");
    }
}

#[test]
fn an_undeclared_delay_is_named_added_and_explains_everything() {
    let folder = bench();
    let report = report(folder.path(), &["bench.csv"]);
    assert_eq!(report["verdict"], "found");
    let effects = report["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1, "{effects:?}");
    let page = read_to_string(folder.path().join("out/report.html")).unwrap();
    let answer = "<h1>The response lags by 4.69 ms more than the model allows: delay.</h1>";
    assert!(page.contains(answer));
    let delay = &effects[0];
    assert_eq!(delay["name"], "delay");
    assert_eq!(delay["port"], "command");
    assert_eq!(delay["tied_with"].as_array().unwrap().len(), 0);
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&delay["error_before"]) > 5.0 * number(&delay["error_after"]));
    // The record was made with a delay of 4.7 ms, K = 250, T = 4 ms, S = 1.5: see tests/data/make_bench.py.
    for (name, truth) in [
        ("delay", 0.0047),
        ("gain", 250.0),
        ("time_constant", 0.004),
        ("saturation", 1.5),
    ] {
        let parameters = report["parameters"].as_array().unwrap();
        let found = parameters.iter().find(|p| p["name"] == name).unwrap();
        let (low, high) = (number(&found["low"]), number(&found["high"]));
        println!("{name}: {low} .. {high}");
        assert!(low <= truth && truth <= high, "{name}: {found}");
        assert_eq!(found["before"].is_null(), name == "delay");
        assert_eq!(found["moved"], name != "delay");
    }
    for channel in ["spool", "flow"] {
        let after = number(&report["error"]["after"]["hold_out"][channel]["rmse"]);
        let noise = number(&report["noise_floor"][channel]);
        assert!(after < 1.1 * noise, "{channel}: {after} over {noise}");
    }
    let improvement = &report["error"]["improvement"]["hold_out"];
    assert!(number(&improvement["low"]) > 80.0, "{improvement}");
    assert_eq!(report["remaining"]["structured"], false);
    let considered = report["considered"].as_array().unwrap();
    let names = considered.iter().filter(|one| one["round"] == 1).count();
    assert!(names >= 19, "{names} effects looked at");
    for one in considered {
        let chance = one["decision"]
            .as_str()
            .unwrap()
            .starts_with("not significant");
        let by_chance = one["error_after"].is_null() && number(&one["p_value"]) > 0.01;
        assert_eq!(chance, by_chance, "{one}");
    }
    assert!(report["free_form"].is_null());
}

#[test]
fn named_effects_take_the_measured_actuator_close_to_its_noise() {
    let files = [
        "mts_actuator_mrdamper_0A.csv",
        "mts_actuator_mrdamper_1A.csv",
    ]
    .map(measured);
    let [Some(fitted), Some(held_out)] = files else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // SERVOBEE_SOAK=1 takes all rows, and looks for all effects.
    let (rows, effects, most) = match soak() {
        true => ("250000", "all", 0.0265),
        false => (
            "12000",
            "null_bias,sensor_offset,sensor_drift,hysteresis,delay",
            0.033,
        ),
    };
    let call = [
        "identify",
        fitted.to_str().unwrap(),
        "--hold-out",
        held_out.to_str().unwrap(),
        "--map",
        "t_s=time [s]",
        "--map",
        "x_cmd_mm=command [mm]",
        "--map",
        "x_meas_mm=spool [mm]",
        "--max-rows",
        rows,
        "--effects",
        effects,
        "--out",
        "out",
    ];
    printed(&servobee(folder.path(), &call));
    let report = json(folder.path().join("out/report.json"));
    // Most of what is missing, at more than the noise.
    assert_eq!(report["verdict"], "partly");
    let rmse = report["error"]["after"]["hold_out"]["spool"]["rmse"].as_f64();
    println!("RMS {} mm held out, {}", rmse.unwrap(), report["effects"]);
    assert!(rmse.unwrap() <= most, "{report}");
    // Only the spool is measured: nothing tells a shifted command from a shifted sensor.
    let effects = report["effects"].as_array().unwrap();
    let shift = |name: &Value| name == "null_bias" || name == "sensor_offset";
    let shifted = effects
        .iter()
        .find(|effect| shift(&effect["name"]))
        .unwrap();
    let tied = shifted["tied_with"].as_array().unwrap();
    assert!(tied.iter().any(shift), "{shifted}");
}

#[test]
fn any_dialect_of_csv_gives_the_same_report() {
    let (folder, text) = excerpt();
    let call = ["bench.csv", "--effects", "none", "--evaluator", "cpu"];
    report(folder.path(), &call);
    let expected = read_to_string(folder.path().join("out/report.json")).unwrap();
    let decimal_commas = text.replace(',', ";").replace('.', ",");
    for (name, dialect) in [
        ("semicolons and decimal commas", decimal_commas.clone()),
        ("byte order mark", format!("\u{feff}{text}")),
        ("CRLF", text.replace('\n', "\r\n")),
        (
            "all of them",
            format!("\u{feff}{decimal_commas}").replace('\n', "\r\n"),
        ),
        ("tabs", text.replace(',', "\t")),
    ] {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path().join("bench.csv"), dialect).unwrap();
        report(folder.path(), &call);
        let found = read_to_string(folder.path().join("out/report.json")).unwrap();
        // The files are not the same.
        let rest = |text: &str| {
            let text = without_time(text);
            let lines = text.lines().filter(|line| !line.contains("\"sha256\": "));
            lines.map(String::from).collect::<Vec<String>>()
        };
        assert_eq!(rest(&found), rest(&expected), "{name}");
    }
}

#[test]
fn the_name_of_a_record_does_not_shift_the_columns_of_the_residual_file() {
    let folder = tempfile::tempdir().unwrap();
    let name = "run 3, \"cold\".csv";
    write(folder.path().join(name), program::excerpt(1500)).unwrap();
    report(folder.path(), &[name, "--effects", "none"]);
    let text = read_to_string(folder.path().join("out/residual.csv")).unwrap();
    let mut lines = text.lines();
    let heads = lines.next().unwrap().split(',').count();
    for line in lines {
        let rest = line.strip_prefix("\"run 3, \"\"cold\"\"\",").expect(line);
        assert_eq!(1 + rest.split(',').count(), heads, "{line}");
    }
}

#[test]
fn the_report_says_what_it_was_made_from_and_by_what() {
    let folder = whole_bench();
    write(folder.path().join("half.csv"), program::excerpt(1500)).unwrap();
    write(
        folder.path().join("model.toml"),
        "[structure]\nhold = \"held\"\n",
    )
    .unwrap();
    let call = [
        "bench.csv",
        "--hold-out",
        "half.csv",
        "--effects",
        "none",
        "--model",
        "model.toml",
        "--force",
    ];
    let found = report(folder.path(), &call);
    let digest = |name: &str| {
        let bytes = std::fs::read(folder.path().join(name)).unwrap();
        let digest: [u8; 32] = Sha256::digest(bytes).into();
        digest.map(|byte| format!("{byte:02x}")).concat()
    };
    let record = |name: &str, rows: [usize; 3]| {
        let [rows, fitted, held_out] = rows;
        serde_json::json!({
            "name": name,
            "path": format!("{name}.csv"),
            "sha256": digest(&format!("{name}.csv")),
            "rows": rows,
            "fitted": fitted,
            "held_out": held_out,
        })
    };
    let rows: usize = BENCH_ROWS.iter().sum();
    let records = [
        record("bench", [rows, rows, 0]),
        record("half", [1500, 0, 1500]),
    ];
    assert_eq!(found["records"], serde_json::json!(records));
    let model = serde_json::json!([{"path": "model.toml", "sha256": digest("model.toml")}]);
    assert_eq!(found["files"], model);
    let program = serde_json::json!({"name": "servobee", "version": env!("CARGO_PKG_VERSION")});
    assert_eq!(found["program"], program);
    // Where the result goes is no part of it.
    let expected = [&["identify"], &call[..7]].concat();
    assert_eq!(found["arguments"], serde_json::json!(expected));
    let date = found["date"].as_str().unwrap();
    assert!(
        date.starts_with("20") && date.ends_with('Z') && date.len() == 20,
        "{date}"
    );
    let hold = serde_json::json!({
        "taken": "held", "stated": true, "straight": null, "error": null, "preferred": null, "moved": [],
    });
    assert_eq!(found["hold"], hold);
    // The page says so, too.
    let page = read_to_string(folder.path().join("out/report.html")).unwrap();
    for part in [
        &digest("bench.csv"),
        &digest("half.csv"),
        &digest("model.toml"),
        "identify bench.csv --hold-out half.csv",
        "6000 rows, 6000 fitted, 0 held out",
        "taken as held between two rows, as the model says",
        date,
    ] {
        assert!(page.contains(part), "{part}");
    }
}

/// Whether the command was held between two rows or went straight is seen where nothing else is missing, and nobody has to say
/// it; where nobody can know, the report says what hangs on it.
#[test]
fn the_command_between_two_rows_is_what_fits() {
    let truth = [120.0, 0.006, 3.0];
    let run = |hold: Hold, more: &[&str]| {
        let folder = planted_with(&truth, None, 0.03, hold);
        write(
            folder.path().join("held.toml"),
            "[structure]\nhold = \"held\"\n",
        )
        .unwrap();
        report(folder.path(), &[&["record.csv"], more].concat())
    };
    for (hold, name) in [(Hold::Held, "held"), (Hold::Interpolated, "interpolated")] {
        let found = run(hold, &[]);
        let taken = &found["hold"];
        println!("{taken}");
        assert_eq!(found["verdict"], "none", "{name}");
        assert_eq!(taken["taken"], name);
        assert_eq!(taken["stated"], false);
        assert_eq!(taken["preferred"], name);
        let errors = ["held", "interpolated"].map(|name| taken["error"][name].as_f64().unwrap());
        assert_eq!(errors[0] < errors[1], hold == Hold::Held, "{taken}");
        assert!(
            off(value(&found, "gain"), truth[0]) < 0.01,
            "{name}: {found}"
        );
        let doubts = found["warnings"].to_string();
        assert!(!doubts.contains("between two rows"), "{doubts}");
    }
    // What the model says is not tried.
    let found = run(
        Hold::Interpolated,
        &["--model", "held.toml", "--effects", "none"],
    );
    assert_eq!(found["hold"]["taken"], "held");
    assert!(off(value(&found, "gain"), truth[0]) > 0.01, "{found}");
}

/// Runs identify with `arguments` in a folder with `files`, among which are `good.csv` and `other.csv` (without flow):
/// it is refused with all of `parts` in its one line, and writes nothing.
fn refuses(files: &[(&str, &str)], arguments: &[&str], parts: &[&str]) {
    let (folder, text) = excerpt();
    std::fs::rename(
        folder.path().join("bench.csv"),
        folder.path().join("good.csv"),
    )
    .unwrap();
    let other = text.replace("flow [L/min]", "temperature [degC]");
    write(folder.path().join("other.csv"), other).unwrap();
    for (name, text) in files {
        write(folder.path().join(name), text).unwrap();
    }
    let before = names(folder.path());
    let call = [&["identify"], arguments].concat();
    let call = if arguments.contains(&"--out") {
        call
    } else {
        [&call[..], &["--out", "out"]].concat()
    };
    let error = refused(&servobee(folder.path(), &call));
    for part in parts {
        assert!(error.contains(part), "{part:?} is not in: {error}");
    }
    // What is wrong; what to do.
    assert!(error.contains("; "), "no remedy in: {error}");
    assert_eq!(names(folder.path()), before, "{error}");
}

/// The same for a record that is wrong.
fn refuses_record(text: &str, parts: &[&str]) {
    let parts = [&["bad.csv"], parts].concat();
    refuses(&[("bad.csv", text)], &["bad.csv"], &parts);
    // A record to hold out is read as carefully.
    refuses(
        &[("bad.csv", text)],
        &["good.csv", "--hold-out", "bad.csv"],
        &parts,
    );
}

#[test]
fn a_record_without_a_needed_column_is_refused() {
    let rows = "0,0,0\n0.001,1,0\n";
    for (header, missing) in [
        ("t,command [V],spool [V]", "\"time [s]\""),
        ("time [s],u,spool [V]", "command"),
        ("time [s],command [V],x", "spool"),
    ] {
        refuses_record(
            &format!("{header}\n{rows}"),
            &["has no column", missing, "--map"],
        );
    }
}

#[test]
fn an_unknown_unit_is_refused() {
    let text = "time [s],command [furlong],spool [V]\n0,0,0\n0.001,1,0\n";
    refuses_record(text, &["row 1", "command [furlong]"]);
}

#[test]
fn time_that_does_not_rise_is_refused_with_its_row() {
    for time in ["0.001", "0.0005"] {
        let text = format!("time [s],command [V],spool [V]\n0,0,0\n0.001,1,0\n{time},1,0.1\n");
        refuses_record(&text, &["row 4", "time [s]", "does not rise"]);
    }
}

#[test]
fn a_cell_that_is_no_number_is_refused_with_its_row_and_column() {
    for (cell, problem) in [
        ("NaN", "not finite"),
        ("inf", "not finite"),
        ("broken", "not a number"),
        ("", "empty"),
    ] {
        let text = format!("time [s],command [V],spool [V]\n0,0,0\n0.001,1,{cell}\n0.002,1,0\n");
        refuses_record(&text, &["row 3", "spool [V]", problem]);
    }
}

#[test]
fn a_record_too_short_is_refused() {
    refuses_record(
        "time [s],command [V],spool [V]\n0,1,0\n",
        &["1 row", "at least two"],
    );
    refuses_record("time [s],command [V],spool [V]\n", &["no rows"]);
    refuses_record("", &["is empty"]);
}

#[test]
fn a_ragged_row_is_refused_with_its_number() {
    for row in ["0.001,1", "0.001,1,0,0"] {
        let text = format!("time [s],command [V],spool [V]\n0,0,0\n{row}\n0.002,1,0\n");
        refuses_record(&text, &["row 3", "3 columns"]);
    }
}

#[test]
fn a_constant_command_is_refused() {
    let rows: String = (0..50)
        .map(|k| format!("{},2,{k}\n", k as f64 * 1e-3))
        .collect();
    let text = format!("time [s],command [V],spool [V]\n{rows}");
    refuses(
        &[("bad.csv", &text)],
        &["bad.csv"],
        &["bad.csv", "2 throughout"],
    );
}

#[test]
fn a_file_that_is_missing_is_refused() {
    refuses(&[], &["nowhere.csv"], &["nowhere.csv", "cannot be read"]);
    let held_out = ["good.csv", "--hold-out", "nowhere.csv"];
    refuses(&[], &held_out, &["nowhere.csv", "cannot be read"]);
    let model = ["good.csv", "--model", "nowhere.toml"];
    refuses(&[], &model, &["nowhere.toml", "cannot be read"]);
}

#[test]
fn an_unknown_effect_is_refused() {
    refuses(
        &[],
        &["good.csv", "--effects", "gremlins"],
        &["--effects", "gremlins"],
    );
}

#[test]
fn a_record_to_hold_out_without_the_fitted_channels_is_refused() {
    let call = ["good.csv", "--hold-out", "other.csv"];
    refuses(&[], &call, &["other.csv", "flow"]);
}

#[test]
fn a_model_file_with_an_unknown_key_or_value_is_refused_with_its_line() {
    for (text, part) in [
        ("[structure]\ncolour = \"blue\"\n", "colour"),
        ("[[parameter]]\nname = \"gain\"\nvolume = 1.0\n", "volume"),
        ("[[parameter]]\nname = \"gian\"\nvalue = 1.0\n", "gian"),
        ("[[parameter]]\nname = \"gain\"\nvalue = 1e9\n", "outside"),
        ("[[parameter]\n", "model.toml"),
    ] {
        let call = ["good.csv", "--model", "model.toml"];
        refuses(&[("model.toml", text)], &call, &["model.toml, line", part]);
    }
}

#[test]
fn a_map_that_names_no_column_or_no_channel_is_refused() {
    for (map, parts) in [
        ("nothing=command [V]", ["\"nothing\"", "--map"]),
        ("=command [V]", ["names no column", "--map"]),
        ("command [V]", ["has no \"=\"", "--map"]),
        ("u=commando [V]", ["commando", "--map"]),
        ("u=command [furlong]", ["furlong", "--map"]),
    ] {
        refuses(&[], &["good.csv", "--map", map], &parts);
    }
}

#[test]
fn a_folder_of_results_is_refused_where_it_would_overwrite_or_has_no_place() {
    let (folder, _) = excerpt();
    create_dir(folder.path().join("out")).unwrap();
    write(folder.path().join("out/report.json"), "mine").unwrap();
    let call = ["identify", "bench.csv", "--out", "out"];
    let error = refused(&servobee(folder.path(), &call));
    assert!(
        error.contains("--out out") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(
        read_to_string(folder.path().join("out/report.json")).unwrap(),
        "mine"
    );
    assert_eq!(names(&folder.path().join("out")), ["report.json"]);

    printed(&servobee(
        folder.path(),
        &[&call[..], &["--force"]].concat(),
    ));
    assert_eq!(names(folder.path()), ["bench.csv", "out"]);
    assert!(json(folder.path().join("out/report.json")).is_object());

    refuses(
        &[],
        &["good.csv", "--out", "no/such/out"],
        &["no/such/out", "no/such", "create it"],
    );
    refuses(
        &[],
        &["good.csv", "--out", "good.csv"],
        &["good.csv", "is a file"],
    );
}
