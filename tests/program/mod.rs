//! The program as a user calls it, and what it leaves behind.

use crate::schema::assert_valid;
use assert_cmd::Command;
use serde_json::Value;
use servobee::evaluate::gpu::{adapters, best, describe};
use std::fs::{copy, read_dir, read_to_string, write};
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// The record of the test bench.
pub(crate) const BENCH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bench.csv");
/// A call that identifies it.
pub(crate) const IDENTIFY: &[&str] = &[
    "identify",
    "bench.csv",
    "--evaluator",
    "cpu",
    "--out",
    "out",
];

/// The files that `identify --out` writes.
pub(crate) const RESULTS: [&str; 4] = ["model.toml", "report.html", "report.json", "residual.csv"];

/// A folder with the record of the test bench.
pub(crate) fn whole_bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(BENCH, folder.path().join("bench.csv")).unwrap();
    folder
}

/// A folder with the first third of it, for tests that ask for none of its numbers.
pub(crate) fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = read_to_string(BENCH).unwrap();
    let rows: Vec<&str> = text.lines().take(2001).collect();
    write(folder.path().join("bench.csv"), rows.join("\n")).unwrap();
    folder
}

/// A lively part of the same record with so many rows, as text.
pub(crate) fn excerpt(rows: usize) -> String {
    let text = read_to_string(BENCH).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let rows: Vec<&str> = lines.skip(600).take(rows).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

/// Whether tests have hours.
pub(crate) fn soak() -> bool {
    std::env::var("SERVOBEE_SOAK").is_ok_and(|value| value == "1")
}

/// Runs the program in `folder`, not on a terminal.
pub(crate) fn servobee(folder: &Path, arguments: &[&str]) -> Output {
    servobee_with(folder, arguments, &[])
}

/// The same with these environment variables.
pub(crate) fn servobee_with(folder: &Path, arguments: &[&str], set: &[(&str, &str)]) -> Output {
    let mut command = Command::cargo_bin("servobee").unwrap();
    command
        .current_dir(folder)
        .args(arguments)
        .envs(set.iter().copied())
        .output()
        .unwrap()
}

/// What a successful call prints: no escape code, nothing that overwrites a line.
pub(crate) fn printed(ran: &Output) -> String {
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{errors}");
    for stream in [&ran.stdout, &ran.stderr] {
        assert!(
            !stream.contains(&b'\x1b') && !stream.contains(&b'\r'),
            "{errors}"
        );
    }
    String::from_utf8(ran.stdout.clone()).unwrap()
}

/// The one line that a call refused with exit code 2 prints.
pub(crate) fn refused(ran: &Output) -> String {
    let errors = String::from_utf8(ran.stderr.clone()).unwrap();
    assert_eq!(ran.status.code(), Some(2), "{errors}");
    assert!(ran.stdout.is_empty());
    assert_eq!(errors.lines().count(), 1, "{errors}");
    errors
}

/// The names in a folder, hidden ones too, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
    let mut names: Vec<String> = read_dir(folder)
        .unwrap()
        .map(|entry| name(entry).into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A JSON file. One that programs rely on is as its schema has it.
pub(crate) fn json(path: impl AsRef<Path>) -> Value {
    let document: Value = serde_json::from_str(&read_to_string(path).unwrap()).unwrap();
    if document["schema"].is_string() {
        assert_valid(&document);
    }
    document
}

/// The fitted value of a parameter in a report.
pub(crate) fn value(report: &Value, name: &str) -> f64 {
    let parameters = report["parameters"].as_array().unwrap();
    let found = parameters.iter().find(|p| p["name"] == name);
    let parameter = found.unwrap_or_else(|| panic!("no parameter {name} in {report}"));
    parameter["value"].as_f64().unwrap()
}

/// How far `value` is from `expected`, as a share of it.
pub(crate) fn off(value: f64, expected: f64) -> f64 {
    (value / expected - 1.0).abs()
}

/// The columns of a CSV file of numbers below a header, by their names; text cells are NaN.
pub(crate) fn columns(path: impl AsRef<Path>) -> Vec<(String, Vec<f64>)> {
    let text = read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',');
    let mut columns: Vec<(String, Vec<f64>)> =
        header.map(|name| (name.into(), Vec::new())).collect();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), columns.len(), "{line}");
        for ((_, values), cell) in columns.iter_mut().zip(cells) {
            values.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

/// The root mean square.
pub(crate) fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Whether there is a GPU adapter, which is named; a failure where there is none, unless that is allowed.
pub(crate) fn has_gpu() -> bool {
    if let Some(adapter) = best(&adapters()) {
        println!("on {}", describe(&adapter.get_info()));
        return true;
    }
    assert!(
        std::env::var("SERVOBEE_SKIP_GPU").is_ok_and(|value| value == "1"),
        "no GPU adapter: install a Vulkan driver (mesa-vulkan-drivers is one in software), or set SERVOBEE_SKIP_GPU=1"
    );
    println!("SKIPPED: no GPU adapter and SERVOBEE_SKIP_GPU=1: nothing was tested on a GPU");
    false
}

/// The measured record called `name`: beside the checkout, or in the folder that `SERVOBEE_DATA` names.
pub(crate) fn measured(name: &str) -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let named = std::env::var_os("SERVOBEE_DATA").map(PathBuf::from);
    let found = [named, Some(beside)]
        .into_iter()
        .flatten()
        .map(|folder| folder.join(name))
        .find(|path| path.exists());
    if found.is_none() {
        eprintln!("NOT TESTED: {name} is absent; let SERVOBEE_DATA name the folder that holds it");
    }
    found
}
