//! Many records in one call, as a user calls for them.
//!
//! `SERVOBEE_SOAK=1` takes a thousand.

use crate::html::assert_well_formed;
use crate::program::{json, names, printed, servobee, soak};
use serde_json::Value;
use servobee::simulator::{Setup, Valve};
use std::fs::{create_dir, read_to_string, remove_file, write};
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// A record of a valve with what is planted, as text.
fn record(seed: u64, planted: &[&str]) -> String {
    let near = |size: f64, step: f64| size * (1.0 + 0.01 * ((seed as f64 * step) % 3.0 - 1.0));
    let setup = Setup {
        valve: Valve {
            gain: near(200.0, 0.7),
            time_constant: near(0.003, 1.1),
            saturation: near(3.0, 1.9),
            rated_flow: near(60.0, 2.3),
        },
        planted: planted.iter().map(|text| text.parse().unwrap()).collect(),
        seconds: 2.0,
        seed,
        ..Setup::default()
    };
    setup.record().unwrap().to_csv()
}

/// A folder `in` with so many records of healthy valves.
pub(crate) fn valves(count: u64) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    create_dir(folder.path().join("in")).unwrap();
    for seed in 1..=count {
        let path = folder.path().join(format!("in/valve{seed:04}.csv"));
        write(path, record(seed, &[])).unwrap();
    }
    folder
}

fn batch(folder: &Path, more: &[&str]) -> Output {
    let call = ["batch", "in", "--evaluator", "cpu", "--out", "out"];
    servobee(folder, &[&call[..], more].concat())
}

fn rows(folder: &Path) -> Vec<Value> {
    let batch = json(folder.join("out/batch.json"));
    assert_eq!(batch["schema"], "servobee/batch/1");
    batch["rows"].as_array().unwrap().clone()
}

/// What does not depend on when and how fast.
fn without_time(folder: &Path) -> String {
    let text = read_to_string(folder.join("out/batch.json")).unwrap();
    let timed = |line: &&str| !line.contains("\"seconds\": ") && !line.contains("\"date\": ");
    text.lines().filter(timed).collect::<Vec<_>>().join("\n")
}

#[test]
fn every_file_has_a_row_and_a_place_and_a_bad_one_stops_no_other() {
    let folder = valves(3);
    let inside = folder.path().join("in");
    write(
        inside.join("broken.csv"),
        "time [s],command [V]\n0,1\n1,x\n",
    )
    .unwrap();
    write(inside.join("notes.txt"), "nothing to see").unwrap();
    create_dir(inside.join("more <b>")).unwrap();
    write(inside.join("more <b>/a, \"b\" #1.csv"), record(9, &[])).unwrap();
    let ran = batch(folder.path(), &["--effects", "none"]);
    assert_eq!(ran.status.code(), Some(2));
    let errors = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(
        errors,
        "servobee: batch: 2 of 6 records were refused; batch.csv says which and why\n"
    );
    assert_eq!(
        names(&folder.path().join("out")),
        [
            "batch.csv",
            "batch.json",
            "batch.rows",
            "index.html",
            "records"
        ]
    );
    let rows = rows(folder.path());
    let told: Vec<[&str; 2]> = rows
        .iter()
        .map(|row| [&row["file"], &row["status"]].map(|text| text.as_str().unwrap()))
        .collect();
    assert_eq!(
        told,
        [
            ["in/broken.csv", "refused"],
            ["in/more <b>/a, \"b\" #1.csv", "ok"],
            ["in/notes.txt", "refused"],
            ["in/valve0001.csv", "ok"],
            ["in/valve0002.csv", "ok"],
            ["in/valve0003.csv", "ok"],
        ]
    );
    let problem = rows[0]["problem"].as_str().unwrap();
    assert!(
        problem.contains("in/broken.csv") && problem.contains("row"),
        "{problem}"
    );

    let page = read_to_string(folder.path().join("out/index.html")).unwrap();
    assert_well_formed(&page);
    assert!(
        page.contains("<h1>6 records: 4 ok, 2 refused.</h1>"),
        "{page}"
    );
    assert_eq!(page.matches("<svg class=\"small\"").count(), 4);
    let table = read_to_string(folder.path().join("out/batch.csv")).unwrap();
    let records = csv_rows(&table);
    assert_eq!(records.len(), 7);
    assert!(records.iter().all(|cells| cells.len() == records[0].len()));
    assert_eq!(records[2][0], "in/more <b>/a, \"b\" #1.csv");
    let flow = records[0]
        .iter()
        .position(|head| head == "rated_flow [L/min]")
        .unwrap();
    for (row, cells) in rows.iter().zip(&records[1..]) {
        let Some(own) = row["folder"].as_str() else {
            assert!(cells[flow].is_empty());
            continue;
        };
        // The link leads to the report, and the report has what the table has.
        let link = format!("href=\"{}/report.html\"", percent(own));
        assert!(page.contains(&link), "{link}");
        let report = json(folder.path().join("out").join(own).join("report.json"));
        let card = report["card"].as_array().unwrap();
        let rated = card.iter().find(|one| one["name"] == "rated_flow").unwrap();
        let value: f64 = cells[flow].parse().unwrap();
        assert_eq!(Some(value), rated["value"].as_f64());
    }
}

/// The cells of a CSV file that quotes where it must.
pub(crate) fn csv_rows(text: &str) -> Vec<Vec<String>> {
    let mut rows = vec![vec![String::new()]];
    let mut quoted = false;
    for c in text.chars() {
        let row = rows.last_mut().unwrap();
        match c {
            '"' => {
                if !quoted && row.last().unwrap().ends_with('\u{1}') {
                    row.last_mut().unwrap().pop();
                    row.last_mut().unwrap().push('"');
                } else if quoted {
                    row.last_mut().unwrap().push('\u{1}');
                }
                quoted = !quoted;
            }
            ',' if !quoted => row.push(String::new()),
            '\n' if !quoted => rows.push(vec![String::new()]),
            c => row.last_mut().unwrap().push(c),
        }
    }
    rows.pop();
    for cell in rows.iter_mut().flatten() {
        *cell = cell.replace('\u{1}', "");
    }
    rows
}

fn percent(path: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte);
    let one = |byte: u8| match plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    path.bytes().map(one).collect()
}

#[test]
fn a_batch_goes_on_where_it_was_cut_off_and_with_what_has_been_added() {
    let folder = valves(4);
    let effects = ["--effects", "none"];
    printed(&batch(folder.path(), &effects));
    let whole = without_time(folder.path());
    let error = crate::program::refused(&batch(folder.path(), &effects));
    assert!(error.contains("--force"), "{error}");

    // As a crash leaves it: two rows, and half of a third.
    let journal = folder.path().join("out/batch.rows");
    let text = read_to_string(&journal).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 5);
    let half = &lines[3][..lines[3].len() / 2];
    write(
        &journal,
        format!("{}\n{}\n{}\n{half}", lines[0], lines[1], lines[2]),
    )
    .unwrap();
    for name in ["batch.csv", "batch.json", "index.html"] {
        remove_file(folder.path().join("out").join(name)).unwrap();
    }
    let resumed = [&effects[..], &["--resume"]].concat();
    printed(&batch(folder.path(), &resumed));
    assert_eq!(without_time(folder.path()), whole);
    let after = read_to_string(&journal).unwrap();
    assert_eq!(after.lines().count(), 5);
    assert!(after.starts_with(&format!("{}\n{}\n{}\n", lines[0], lines[1], lines[2])));

    // One is added, one has changed: those two are done, and no other.
    write(folder.path().join("in/valve0005.csv"), record(5, &[])).unwrap();
    write(folder.path().join("in/valve0002.csv"), record(22, &[])).unwrap();
    printed(&batch(folder.path(), &resumed));
    assert_eq!(read_to_string(&journal).unwrap().lines().count(), 7);
    assert_eq!(rows(folder.path()).len(), 5);

    let other = crate::program::refused(&batch(folder.path(), &["--effects", "delay", "--resume"]));
    assert!(other.contains("with other options"), "{other}");
}

#[test]
fn the_exit_code_is_that_of_the_worst() {
    let folder = valves(2);
    write(
        folder.path().join("limits.toml"),
        "rated_flow = \">= 100 L/min\"\n",
    )
    .unwrap();
    let limits = ["--effects", "none", "--limits", "limits.toml", "--force"];
    let ran = batch(folder.path(), &limits);
    assert_eq!(ran.status.code(), Some(3), "{ran:?}");
    for row in rows(folder.path()) {
        assert_eq!(row["limits"]["fail"][0], "rated_flow");
    }
    write(folder.path().join("in/bad.csv"), "nothing").unwrap();
    assert_eq!(batch(folder.path(), &limits).status.code(), Some(2));
    let none = servobee(folder.path(), &["batch", "out/records/none", "--out", "x"]);
    assert_eq!(none.status.code(), Some(2));
}

#[test]
fn the_valve_that_departs_from_its_siblings_is_named_with_its_cause() {
    let folder = valves(7);
    write(
        folder.path().join("in/valve0004.csv"),
        record(4, &["hysteresis=0.4"]),
    )
    .unwrap();
    write(folder.path().join("good.csv"), record(11, &[])).unwrap();
    let effects = ["--effects", "hysteresis,friction,dead_band,null_bias,delay"];
    for more in [&["--baseline", "good.csv"][..], &["--force"]] {
        let told = printed(&batch(folder.path(), &[&effects[..], more].concat()));
        let departs: Vec<&str> = told
            .lines()
            .filter(|line| line.contains(" departs in "))
            .collect();
        assert_eq!(departs.len(), 1, "{told}");
        assert!(
            departs[0].starts_with("in/valve0004.csv departs in ")
                && departs[0].contains("hysteresis,")
                && departs[0].ends_with("; cause: hysteresis."),
            "{departs:?}"
        );
        let page = read_to_string(folder.path().join("out/index.html")).unwrap();
        assert_well_formed(&page);
        assert!(page.contains("1 depart.</h1>"), "{page}");
    }
}

#[test]
fn of_many_records_the_bad_ones_are_told_from_the_others() {
    let count = if soak() { 1000 } else { 12 };
    let folder = valves(count);
    let bad = count / 50 + 1;
    for seed in 1..=bad {
        let path = folder
            .path()
            .join(format!("in/valve{:04}.csv", seed * count / (bad + 1)));
        let text = read_to_string(&path).unwrap();
        write(&path, text.replacen("\n", "\nx", 1)).unwrap();
    }
    let ran = batch(folder.path(), &["--effects", "none", "--quiet"]);
    assert_eq!(ran.status.code(), Some(2));
    let rows = rows(folder.path());
    let status = |word: &str| rows.iter().filter(|row| row["status"] == word).count() as u64;
    assert_eq!(
        (status("ok"), status("refused"), status("failed")),
        (count - bad, bad, 0)
    );
    let table = csv_rows(&read_to_string(folder.path().join("out/batch.csv")).unwrap());
    assert_eq!(table.len() as u64, count + 1);
}

#[cfg(unix)]
#[test]
fn a_pipe_in_a_folder_is_not_waited_for_and_a_link_that_leads_nowhere_is_refused() {
    let folder = valves(1);
    let inside = folder.path().join("in");
    let pipe = std::process::Command::new("mkfifo")
        .arg(inside.join("pipe.csv"))
        .status();
    assert!(pipe.unwrap().success());
    std::os::unix::fs::symlink("nowhere.csv", inside.join("link.csv")).unwrap();
    let ran = batch(folder.path(), &["--effects", "none"]);
    assert_eq!(ran.status.code(), Some(2));
    let files: Vec<Value> = rows(folder.path())
        .iter()
        .map(|row| row["file"].clone())
        .collect();
    assert_eq!(files, ["in/link.csv", "in/valve0001.csv"]);
}
