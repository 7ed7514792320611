//! Several devices of one machine that share every population.

use crate::program::{BENCH, excerpt, has_gpu, json, printed, refused, servobee};
use serde_json::Value;
use std::fs::{read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

fn record() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("short.csv"), excerpt(1500)).unwrap();
    folder
}

/// The report of a run on `devices`, but for times, and what it was computed on.
fn report(folder: &Path, devices: &str) -> (Value, String) {
    let call = [
        "identify",
        "short.csv",
        "--effects",
        "delay",
        "--force",
        "--out",
        "out",
    ];
    let told = printed(&servobee(
        folder,
        &[&call, &["--evaluator", devices][..]].concat(),
    ));
    let mut report = json(folder.join("out/report.json"));
    let fields = report.as_object_mut().unwrap();
    let evaluator = fields.remove("evaluator").unwrap();
    let evaluator = evaluator.as_str().unwrap().to_owned();
    assert!(told.contains(&format!("Evaluator: {evaluator}")), "{told}");
    for name in ["seconds", "date", "arguments"] {
        assert!(fields.remove(name).is_some(), "{name}");
    }
    (report, evaluator)
}

#[test]
fn like_devices_find_what_one_of_them_finds() {
    let folder = record();
    let (alone, device) = report(folder.path(), "cpu");
    let (together, devices) = report(folder.path(), "cpu+cpu+cpu");
    assert_eq!(devices, format!("3 devices, each on {device}"));
    assert_eq!(together, alone);
    if has_gpu() {
        let (alone, device) = report(folder.path(), "gpu:0");
        let (together, devices) = report(folder.path(), "gpu:0+gpu:0");
        assert_eq!(devices, format!("2 devices, each on {device}"));
        assert_eq!(together, alone);
    }
}

#[test]
fn unlike_devices_are_named_and_agree_within_what_they_differ_by() {
    if !has_gpu() {
        return;
    }
    let folder = record();
    let (alone, _) = report(folder.path(), "cpu");
    let (together, devices) = report(folder.path(), "cpu+gpu");
    assert!(
        devices.starts_with("2 devices: 0 on CPU (") && devices.contains("; 1 on "),
        "{devices}"
    );
    let readme = read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let words = "costs may differ in the last bits";
    assert!(
        devices.ends_with(words) && readme.contains(words),
        "{devices}"
    );
    let delay = |report: &Value| crate::program::value(report, "delay");
    assert!((delay(&together) / delay(&alone) - 1.0).abs() < 1e-3);
}

#[test]
fn what_names_no_device_is_refused_and_every_adapter_has_a_name() {
    for words in ["cpu+", "gpu:", "gpu:x", "cpu gpu", "all", "gpu:all+cpu"] {
        let error = refused(&servobee(
            Path::new("."),
            &["identify", BENCH, "--evaluator", words],
        ));
        assert!(error.contains("gpu:0+gpu:1, or gpu:all"), "{error}");
    }
    let error = refused(&servobee(
        Path::new("."),
        &["identify", BENCH, "--evaluator", "cpu+gpu:99"],
    ));
    assert!(
        error.contains("--evaluator gpu:99: this machine shows"),
        "{error}"
    );
    if has_gpu() {
        let listed = printed(&servobee(Path::new("."), &["devices"]));
        assert!(listed.contains("gpu:0"), "{listed}");
        let folder = record();
        let (_, every) = report(folder.path(), "gpu:all");
        let listed = printed(&servobee(Path::new("."), &["devices", "--json"]));
        let listed: Value = serde_json::from_str(&listed).unwrap();
        let adapters = listed["adapters"].as_array().unwrap();
        assert_eq!(adapters[0]["evaluator"], "gpu:0");
        assert!(
            every.contains(adapters[0]["adapter"].as_str().unwrap()),
            "{every}"
        );
    }
}
