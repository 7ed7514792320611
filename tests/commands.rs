//! The commands simulate, devices and bench, as a user calls them.

use crate::program::{printed, refused, servobee};
use assert_cmd::Command;
use servobee::evaluate::gpu;
use servobee::evaluate::problem::Series;
use servobee::evaluate::simulate::outputs;
use servobee::model::valve::ValveForm;
use servobee::model::{Complete, Output, Parameter, ServoValve, Structure};
use servobee::record::{self, Channel, Record};
use servobee::report::ModelFile;
use std::fs::{read_dir, read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

fn files(folder: &Path) -> usize {
    read_dir(folder).unwrap().count()
}

/// A folder with `model.toml`, `record.csv` that the model gives exactly, and `command.csv` with its command alone.
fn planted(structure: &Structure) -> TempDir {
    let parameters = structure.parameters();
    let values = Complete::nominal(&parameters);
    let time: Vec<f64> = (0..300).map(|k| f64::from(k) * 2e-3).collect();
    let heights = (0..300).map(|k| 6.0 * (f64::from(k / 25) * 1.3).sin());
    let unit = structure.command_unit.as_str();
    let command = (
        Channel::Command,
        record::Series::new(unit, heights.collect()),
    );
    let alone = Record::new("planted", time.clone(), [command.clone()]).unwrap();

    let mut series = Series::to_simulate(&alone, structure).unwrap();
    series.set_steps(structure.fastest_rate(&parameters), 1);
    let simulated = outputs(structure, &values, &series);
    let measured = structure.observed.iter().map(|&output| {
        let values = simulated.iter().map(|row| row[output]).collect();
        (
            output.channel(),
            record::Series::new(structure.unit(output), values),
        )
    });
    let record = Record::new("planted", time, [command].into_iter().chain(measured)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let at = |name| folder.path().join(name);
    write(
        at("model.toml"),
        ModelFile::to_toml(structure, &parameters, &values),
    )
    .unwrap();
    record.write_csv(at("record.csv")).unwrap();
    alone.write_csv(at("command.csv")).unwrap();
    folder
}

fn whole() -> Structure {
    Structure {
        observed: vec![Output::Spool, Output::Flow, Output::Position],
        base: ServoValve {
            spool_unit: Some("mm".into()),
            ..ServoValve::with(ValveForm::linear())
        }
        .into(),
        ..Structure::actuator(10.0, "V")
    }
}

#[test]
fn a_model_simulates_its_own_record_without_error() {
    for structure in [Structure::actuator(10.0, "V"), whole()] {
        let folder = planted(&structure);
        let text = printed(&servobee(
            folder.path(),
            &["simulate", "model.toml", "record.csv"],
        ));
        for &output in &structure.observed {
            let line = text.lines().find(|line| line.starts_with(output.name()));
            let cells: Vec<&str> = line.expect(&text).split_whitespace().collect();
            assert_eq!(
                cells[1..4],
                [structure.unit(output), "0", "100.000"],
                "{text}"
            );
            let integration: f64 = cells[4].parse().unwrap();
            assert!(integration > 0.0 && integration < 0.05, "{text}");
        }
    }
}

#[test]
fn the_output_holds_time_command_measured_and_simulated() {
    let folder = planted(&whole());
    let path = folder.path().join("out.csv");
    let call = ["simulate", "model.toml", "record.csv", "--out", "out.csv"];
    printed(&servobee(folder.path(), &call));
    let text = read_to_string(&path).unwrap();
    let columns: Vec<String> = whole()
        .observed
        .iter()
        .map(|&output| {
            let column = format!("{} [{}]", output.name(), whole().unit(output));
            format!("{column},simulated_{column}")
        })
        .collect();
    assert_eq!(
        text.lines().next().unwrap(),
        format!("time [s],command [V],{}", columns.join(","))
    );
    assert_eq!(text.lines().count(), 301);
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        assert!(
            cells[2..].chunks(2).all(|pair| pair[0] == pair[1]),
            "{line}"
        );
    }
    let record = Record::read(&path, &[]).unwrap();
    assert_eq!(record.ignored.len(), whole().observed.len());
}

#[test]
fn a_command_alone_can_be_simulated() {
    let folder = planted(&whole());
    let call = ["simulate", "model.toml", "command.csv", "--out", "out.csv"];
    let text = printed(&servobee(folder.path(), &call));
    assert_eq!(
        text.matches("not measured").count(),
        whole().observed.len(),
        "{text}"
    );
    let record = read_to_string(folder.path().join("out.csv")).unwrap();
    assert!(record.starts_with("time [s],command [V],simulated_spool [mm],simulated_flow"));
}

#[test]
fn an_existing_output_is_kept_unless_forced() {
    let folder = planted(&Structure::actuator(10.0, "V"));
    let path = folder.path().join("out.csv");
    write(&path, "mine").unwrap();
    let call = [
        "simulate",
        "model.toml",
        "record.csv",
        "--out",
        "out.csv",
        "--force",
    ];
    let error = refused(&servobee(folder.path(), &call[..5]));
    assert!(
        error.contains("out.csv") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(read_to_string(&path).unwrap(), "mine");
    printed(&servobee(folder.path(), &call));
    assert!(read_to_string(&path).unwrap().starts_with("time [s]"));
    assert_eq!(files(folder.path()), 4);
}

#[test]
fn a_map_makes_a_column_a_channel() {
    let folder = planted(&Structure::actuator(10.0, "V"));
    let path = folder.path().join("record.csv");
    let text = read_to_string(&path)
        .unwrap()
        .replace("command [V]", "u_cmd");
    write(&path, text).unwrap();
    let call = [
        "simulate",
        "model.toml",
        "record.csv",
        "--map",
        "u_cmd=command [V]",
    ];
    assert!(printed(&servobee(folder.path(), &call)).contains("100.000"));
    assert!(refused(&servobee(folder.path(), &call[..3])).contains("--map"));
}

#[test]
fn a_wrong_model_is_refused_in_one_line_and_nothing_is_written() {
    let folder = planted(&Structure::actuator(10.0, "V"));
    let model = folder.path().join("model.toml");
    let good = read_to_string(&model).unwrap();
    let value = format!("value = {:?}", start("gain"));
    for (from, to, part) in [
        ("[structure]", "[structures]", "structures"),
        ("drive = \"actuator\"", "drift = 1", "`drift`"),
        ("name = \"gain\"", "name = \"gian\"", "gian"),
        ("unit = \"1/s\"", "unit = \"Hz\"", "Hz"),
        (&value, "value = 1e9", "outside"),
        (&value, "value = nan", "not finite"),
        (&value, "value = \"fast\"", "fast"),
        ("low = 1.0", "low = 6000.0", "less than"),
        ("low = 1.0", "low = 0.0", "positive"),
        ("scale = \"log\"", "scale = \"ln\"", "`ln`"),
        ("observed = [\"spool\"]", "observed = []", "observed"),
        (
            "command_unit = \"V\"",
            "command_unit = \"mA\"",
            "saturation is in mA",
        ),
        ("full_scale = 10.0", "", "has no [structure]"),
    ] {
        assert!(good.contains(from), "{from} is not in\n{good}");
        write(&model, good.replacen(from, to, 1)).unwrap();
        let call = ["simulate", "model.toml", "record.csv", "--out", "out.csv"];
        let error = refused(&servobee(folder.path(), &call));
        assert!(error.contains(part), "{part} is not in: {error}");
        assert_eq!(files(folder.path()), 3);
    }
}

fn start(name: &str) -> f64 {
    let parameters: Vec<Parameter> = Structure::actuator(10.0, "V").parameters();
    parameters
        .iter()
        .find(|p| p.name == name)
        .unwrap()
        .nominal()
}

#[test]
fn devices_name_the_cpu_and_what_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let text = printed(&servobee(folder.path(), &["devices"]));
    assert!(text.starts_with("CPU (f32 lanes"), "{text}");
    assert!(text.contains("--evaluator auto uses"), "{text}");
}

#[test]
fn devices_without_an_adapter_say_how_to_get_one() {
    let mut command = Command::cargo_bin("servobee").unwrap();
    // Backends that this build does not have: no adapter is found on any machine.
    let ran = command
        .env("WGPU_BACKEND", "gl")
        .arg("devices")
        .output()
        .unwrap();
    let text = printed(&ran);
    assert!(
        text.contains("No GPU adapter") && text.contains("mesa-vulkan-drivers"),
        "{text}"
    );
    assert!(text.contains("uses CPU"), "{text}");
}

#[test]
fn bench_measures_every_size_that_fits() {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "bench",
        "--evaluator",
        "cpu",
        "--seconds",
        "0.3",
        "--samples",
        "100",
    ];
    let text = printed(&servobee(folder.path(), &call));
    assert!(
        text.contains("GPU/CPU") && text.contains("262144"),
        "{text}"
    );
    let json = printed(&servobee(folder.path(), &[&call[..], &["--json"]].concat()));
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["schema"], "servobee/bench/1");
    let evaluators = report["evaluators"].as_array().unwrap();
    assert_eq!(evaluators.len(), 2);
    for evaluator in evaluators {
        let first = &evaluator["results"][0];
        assert_eq!(first["population"], 64);
        assert!(first["candidate_steps_per_second"].as_f64().unwrap() > 0.0);
    }
}

#[test]
fn bench_says_where_the_time_of_a_gpu_goes() {
    if gpu::adapters().is_empty() {
        println!("SKIPPED: no GPU adapter");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let call = ["bench", "--seconds", "0.2", "--samples", "100"];
    let json = printed(&servobee(folder.path(), &[&call[..], &["--json"]].concat()));
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let evaluators = report["evaluators"].as_array().unwrap();
    let on_gpu: Vec<_> = evaluators
        .iter()
        .filter(|one| one["on_gpu"] == true)
        .collect();
    assert_eq!(on_gpu.len(), 2 * gpu::adapters().len());
    for pair in on_gpu.chunks(2) {
        assert_eq!(
            (&pair[0]["checked"], &pair[1]["checked"]),
            (&false.into(), &true.into())
        );
    }
    for one in evaluators {
        let phases = one["phases"].as_array().unwrap();
        assert_eq!(phases.len(), if one["on_gpu"] == true { 2 } else { 0 });
        for phase in phases {
            assert!(phase["kernel"].as_f64().unwrap() > 0.0);
            assert!(phase["submissions"].as_u64().unwrap() > 0);
        }
    }
    let call = [&call[..], &["--workgroups"]].concat();
    let text = printed(&servobee(folder.path(), &call));
    assert!(
        text.contains("workgroup") && text.contains("\n128 "),
        "{text}"
    );
}
