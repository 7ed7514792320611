//! What others' CI runs: the workflow in examples/ci.yml, and the short tests.

use crate::common::gpu;
use crate::program::{excerpt, servobee};
use servobee::evaluate::gpu::Checks;
use std::fs::{create_dir, read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

fn read(path: &str) -> String {
    read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// The arguments of each call of the program in the workflow.
fn calls(workflow: &str) -> Vec<Vec<&str>> {
    let steps = workflow.lines().map(str::trim);
    let ours = steps.filter_map(|step| step.strip_prefix("- run: servobee "));
    ours.map(|call| call.split(' ').collect()).collect()
}

#[test]
fn the_workflow_passes_with_its_limits_and_fails_with_a_limit_that_is_missed() {
    if gpu(Checks::On).is_none() {
        return;
    }
    let workflow = read("examples/ci.yml");
    let calls = calls(&workflow);
    assert_eq!(calls.len(), 2, "{workflow}");
    for (limit, code) in [("<= 5 ms", 0), ("<= 4 ms", 3)] {
        let folder = TempDir::new().unwrap();
        create_dir(folder.path().join("records")).unwrap();
        write(folder.path().join("records/bench.csv"), excerpt(1500)).unwrap();
        let limits = format!("delay = \"{limit}\"\n");
        write(folder.path().join("limits.toml"), limits).unwrap();
        let codes: Vec<Option<i32>> = calls
            .iter()
            .map(|call| servobee(folder.path(), call).status.code())
            .collect();
        assert_eq!(codes, [Some(0), Some(code)]);
        assert!(folder.path().join("result/index.html").exists());
    }
}

#[test]
fn the_short_tests_are_tests() {
    let script = read("tests/run.sh");
    let main = read("tests/main.rs");
    let quick = script.lines().find_map(|line| line.strip_prefix("QUICK=("));
    let quick = quick.unwrap().strip_suffix(')').unwrap();
    assert!(quick.split(' ').count() > 5);
    for module in quick.split(' ') {
        let line = format!("mod {module};");
        assert!(main.lines().any(|other| other == line), "{module}");
    }
}
