//! A batch as many calls that share nothing but its folder: the overview is that of one call.

use crate::batch::{csv_rows, valves};
use crate::program::{json, names, printed, refused, servobee};
use std::fs::{File, create_dir, read_to_string, write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const BATCH: &[&str] = &[
    "batch",
    "in",
    "--effects",
    "none",
    "--evaluator",
    "cpu",
    "--baseline",
    "good.csv",
    "--out",
];

/// A folder with so many records in `in`, one that is refused and two whose reports would have the same name, and `good.csv`.
fn records(count: u64) -> TempDir {
    let folder = valves(count);
    let at = |name: &str| folder.path().join(name);
    let text = read_to_string(at("in/valve0001.csv")).unwrap();
    create_dir(at("in/a")).unwrap();
    for name in ["in/a/b.csv", "in/a_b.csv", "good.csv"] {
        write(at(name), &text).unwrap();
    }
    write(at("in/bad.csv"), "nothing").unwrap();
    folder
}

fn call(folder: &Path, out: &str, more: &[&str]) -> Output {
    servobee(folder, &[BATCH, &[out], more].concat())
}

fn start(folder: &Path, out: &str, task: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_servobee"))
        .current_dir(folder)
        .args(BATCH)
        .args([out, "--task", task])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The overview and the reports, but for when and how fast they were made.
fn overview(out: &Path) -> Vec<String> {
    let text = read_to_string(out.join("batch.json")).unwrap();
    let timed = |line: &&str| !line.contains("\"seconds\": ") && !line.contains("\"date\": ");
    let batch: Vec<&str> = text.lines().filter(timed).collect();
    let mut table = csv_rows(&read_to_string(out.join("batch.csv")).unwrap());
    let seconds = table[0].iter().position(|head| head == "seconds").unwrap();
    for row in &mut table {
        row.remove(seconds);
    }
    let date = json(out.join("batch.json"))["date"].clone();
    let page = read_to_string(out.join("index.html")).unwrap();
    let page = page.replace(date.as_str().unwrap(), "");
    let mut files = vec![batch.join("\n"), format!("{table:?}"), page];
    for record in names(&out.join("records")) {
        let report = out.join("records").join(&record).join("report.json");
        let report = read_to_string(report).unwrap();
        let report: Vec<&str> = report.lines().filter(timed).collect();
        files.push(format!("{record}: {}", report.join("\n")));
    }
    files
}

/// Gathers what tasks have left in `out`, and compares it with what one call writes.
fn assert_like_one_call(folder: &Path, out: &str) {
    assert!(!names(&folder.join(out)).contains(&"index.html".into()));
    assert_eq!(call(folder, out, &["--resume"]).status.code(), Some(2));
    assert_eq!(call(folder, "whole", &[]).status.code(), Some(2));
    let (found, expected) = (folder.join(out), folder.join("whole"));
    assert_eq!(names(&found), names(&expected));
    assert!(overview(&found) == overview(&expected));
}

#[test]
fn tasks_that_run_at_once_come_to_the_same_bytes_as_one_call() {
    let folder = records(4);
    let tasks = ["3/3", "1/3", "2/3"].map(|task| start(folder.path(), "out", task));
    for task in tasks {
        let told = printed(&task.wait_with_output().unwrap());
        assert!(told.contains("is done"), "{told}");
    }
    assert_like_one_call(folder.path(), "out");
}

#[test]
fn the_calls_in_the_readme_are_a_job_array() {
    let readme = read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let section = readme.split("## More than one machine").nth(1).unwrap();
    let calls = section
        .lines()
        .filter_map(|line| line.strip_prefix("    servobee "));
    let [task, gather] = calls.take(2).collect::<Vec<_>>()[..] else {
        panic!("{section}");
    };
    let count: usize = task.rsplit('/').next().unwrap().parse().unwrap();
    assert!(section.contains(&format!("`--array=1-{count}`")));
    let help = printed(&servobee(Path::new("."), &["batch", "--help"]));
    assert!(help.contains("--task $SLURM_ARRAY_TASK_ID/40"), "{help}");

    let folder = records(1);
    std::fs::rename(folder.path().join("in"), folder.path().join("records")).unwrap();
    let run = |call: &str| {
        let call: Vec<&str> = call
            .split(' ')
            .chain(["--effects", "none", "--quiet"])
            .collect();
        servobee(folder.path(), &call)
    };
    // Later tasks have no file.
    for number in 1..=5 {
        printed(&run(
            &task.replace("$SLURM_ARRAY_TASK_ID", &number.to_string())
        ));
    }
    assert_eq!(run(gather).status.code(), Some(2));
    let batch = json(folder.path().join("result/batch.json"));
    let status = |row: &serde_json::Value| row["status"].as_str().unwrap().to_owned();
    let found: Vec<String> = batch["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(status)
        .collect();
    assert_eq!(found, ["ok", "ok", "refused", "ok"]);
}

#[test]
fn a_task_that_was_killed_is_called_again_and_one_that_never_ran_is_made_up_for() {
    let folder = records(8);
    let rows = folder.path().join("out/tasks/1-of-2.rows");
    let mut child = start(folder.path(), "out", "1/2");
    let begun = Instant::now();
    let done = || read_to_string(&rows).map_or(0, |text| text.lines().count());
    while done() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60), "no rows");
        sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = read_to_string(&rows).unwrap();
    let before = &before[..=before.rfind('\n').unwrap()];
    printed(&call(folder.path(), "out", &["--task", "1/2", "--quiet"]));
    // What was done is not done again: the baseline and half of eleven files.
    let after = read_to_string(&rows).unwrap();
    assert!(
        after.starts_with(before) && after.lines().count() == 8,
        "{after}"
    );
    // As a kill leaves a report that was being written.
    let draft = folder.path().join("out/records/.servobee-draft");
    create_dir(&draft).unwrap();
    write(draft.join("report.json"), "{").unwrap();
    assert_like_one_call(folder.path(), "out");
}

#[test]
fn a_task_goes_on_from_a_first_line_that_was_cut_off_and_a_batch_with_what_was_added() {
    let folder = records(1);
    printed(&call(folder.path(), "out", &["--task", "1/1", "--quiet"]));
    let rows = folder.path().join("out/tasks/1-of-1.rows");
    let text = read_to_string(&rows).unwrap();
    write(&rows, &text[..20]).unwrap();
    printed(&call(folder.path(), "out", &["--task", "1/1", "--quiet"]));
    assert_eq!(
        read_to_string(&rows).unwrap().lines().count(),
        text.lines().count()
    );
    call(folder.path(), "out", &["--resume"]);

    // Two more tasks after that: only what is new is done.
    let bench = read_to_string(folder.path().join("good.csv")).unwrap();
    write(folder.path().join("in/valve0002.csv"), bench).unwrap();
    for task in ["1/2", "2/2"] {
        printed(&call(folder.path(), "out", &["--task", task, "--quiet"]));
    }
    let rows = ["1-of-2", "2-of-2"].map(|name| {
        let rows = folder.path().join(format!("out/tasks/{name}.rows"));
        read_to_string(rows).unwrap().lines().count() - 1
    });
    assert_eq!(rows.iter().sum::<usize>(), 1);
    call(folder.path(), "out", &["--resume"]);
    let batch = json(folder.path().join("out/batch.json"));
    assert_eq!(batch["rows"].as_array().unwrap().len(), 6);
}

#[test]
fn what_is_wrong_is_refused_and_nothing_is_touched() {
    let folder = records(1);
    for (task, words) in [
        ("0/3", "I from 1 to N"),
        ("4/3", "I from 1 to N"),
        ("x", "such as 3/40"),
    ] {
        let error = refused(&call(folder.path(), "out", &["--task", task]));
        assert!(error.contains(words), "{error}");
    }
    let error = refused(&call(folder.path(), "out", &["--task", "1/2", "--force"]));
    assert!(error.contains("--force"), "{error}");
    assert!(!folder.path().join("out").exists());
    create_dir(folder.path().join("mine")).unwrap();
    write(folder.path().join("mine/notes.txt"), "mine").unwrap();
    let error = refused(&call(folder.path(), "mine", &["--task", "1/2"]));
    assert!(error.contains("--out mine: exists"), "{error}");
    assert_eq!(names(&folder.path().join("mine")), ["notes.txt"]);

    printed(&call(folder.path(), "out", &["--task", "1/2", "--quiet"]));
    let other = ["--task", "2/2", "--seed", "5"];
    let error = refused(&call(folder.path(), "out", &other));
    assert!(error.contains("with other options"), "{error}");
    // One that has not ended keeps its rows to itself.
    let rows = File::open(folder.path().join("out/tasks/1-of-2.rows")).unwrap();
    rows.lock().unwrap();
    for more in [&["--task", "1/2"][..], &["--resume"]] {
        let error = refused(&call(folder.path(), "out", more));
        assert!(error.contains("1-of-2.rows: is in use"), "{error}");
    }
}
