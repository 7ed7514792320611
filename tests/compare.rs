//! A valve before and after a repair, as a user calls for it: records of the simulator with wear planted between two.
//!
//! `SERVOBEE_SOAK=1` takes twenty valves for each wear instead of one.

use crate::html::assert_well_formed;
use crate::program::{json, names, printed, refused, servobee, soak};
use serde_json::Value;
use servobee::simulator::{Meter, Planted, Setup, Valve};
use std::fs::{read_to_string, write};
use std::path::Path;

/// A record of the default valve with what is planted, as text.
fn record(seed: u64, planted: &[&str], change: impl Fn(&mut Valve)) -> String {
    metered(Meter::Load, seed, planted, change)
}

/// The same, the flow measured there.
fn metered(meter: Meter, seed: u64, planted: &[&str], change: impl Fn(&mut Valve)) -> String {
    let mut setup = Setup {
        meter,
        planted: planted.iter().map(|text| text.parse().unwrap()).collect(),
        seconds: 5.0,
        seed,
        ..Setup::default()
    };
    change(&mut setup.valve);
    setup.record().unwrap().to_csv()
}

/// What `compare` says of `before.csv` and `after.csv` in `folder`.
fn compared(folder: &Path) -> Value {
    let call = [
        "compare",
        "before.csv",
        "--with",
        "after.csv",
        "--evaluator",
        "cpu",
        "--out",
        "out",
        "--force",
    ];
    printed(&servobee(folder, &call));
    json(folder.join("out/compare.json"))
}

/// The names of the parameters that are said to have changed.
fn changed(document: &Value) -> Vec<&str> {
    let changes = document["changes"].as_array().unwrap();
    changes
        .iter()
        .filter(|one| one["of"] == "parameter" && one["outcome"] == "changed")
        .map(|one| one["name"].as_str().unwrap())
        .collect()
}

/// Wear: what is planted before and after, and the parameter that changes.
const WEAR: [(&str, &[&str], &[&str], &str); 5] = [
    ("wider overlap", &["overlap=2"], &["overlap=5"], "overlap"),
    ("a worn edge", &[], &["leakage=2:width=3"], "leakage"),
    (
        "more friction",
        &["friction=0.1"],
        &["friction=0.4"],
        "friction",
    ),
    (
        "a slower lag",
        &[],
        &["sensor_lag.flow=0.006"],
        "sensor_lag_flow",
    ),
    (
        "a drifted null",
        &["null_bias=0.05"],
        &["null_bias=0.3"],
        "null_bias",
    ),
];

/// The effect of a parameter that is called after it and its channel.
fn tie_of(parameter: &str) -> String {
    parameter.replace("_flow", ".flow")
}

/// The comparison of two records with what is planted in each, the second with noise of its own.
fn of_records(folder: &Path, seed: u64, [before, after]: [&[&str]; 2]) -> Value {
    let parsed = |texts: &[&str]| texts.iter().map(|text| text.parse().unwrap()).collect();
    let all: Vec<Planted> = parsed(&[before, after].concat());
    let meter = Meter::that_shows(&all);
    for (name, seed, planted) in [("before.csv", seed, before), ("after.csv", seed + 1, after)] {
        write(folder.join(name), metered(meter, seed, planted, |_| {})).unwrap();
    }
    compared(folder)
}

#[test]
fn wear_is_named_and_of_what_stayed_nothing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    // One at the edges and one behind them.
    let (wears, valves) = match soak() {
        true => (&WEAR[..], 20),
        false => (&WEAR[..2], 1),
    };
    let (mut named, mut alone, mut told) = (0, 0, String::new());
    for (i, (wear, before, after, expected)) in wears.iter().enumerate() {
        for valve in 0..valves {
            let seed = 100 * i as u64 + 2 * valve + 1;
            let document = of_records(folder.path(), seed, [before, after]);
            let changed = changed(&document);
            // By its own name, or by one that no such record can tell from it.
            let ties: Vec<&str> = document["effects"]
                .as_array()
                .unwrap()
                .iter()
                .filter(|one| {
                    one["tied_with"]
                        .as_array()
                        .unwrap()
                        .iter()
                        .any(|tie| *tie == tie_of(expected))
                })
                .map(|one| one["name"].as_str().unwrap().split('.').next().unwrap())
                .collect();
            let of_wear = |name: &&str| {
                name.starts_with(expected) || ties.iter().any(|tie| name.starts_with(tie))
            };
            named += usize::from(changed.iter().any(of_wear));
            let others: Vec<_> = changed.iter().filter(|name| !of_wear(name)).collect();
            alone += usize::from(others.is_empty());
            told += &format!("{wear} {seed}: {}\n", document["answer"]);
        }
    }
    let all = wears.len() * valves as usize;
    println!("named {named}, alone {alone} of {all}\n{told}");
    assert!(20 * named >= 19 * all, "{told}");
    assert!(20 * alone >= 19 * all, "{told}");
}

#[test]
fn what_has_not_changed_is_not_said_to_have() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = if soak() { 60 } else { 1 };
    let (mut quiet, mut told) = (0, String::new());
    for pair in 0..pairs {
        let planted = [
            &[][..],
            &["overlap=3"],
            &["hysteresis=0.2", "null_bias=0.1"],
        ][pair % 3];
        let seed = 1000 + 2 * pair as u64;
        let document = of_records(folder.path(), seed, [planted; 2]);
        quiet += usize::from(document["answer"] == "Nothing changed that these records show.");
        told += &format!("{seed}: {}\n", document["answer"]);
    }
    println!("quiet {quiet} of {pairs}\n{told}");
    assert!(20 * quiet >= 19 * pairs, "{told}");
}

#[test]
fn a_comparison_says_what_came_in_json_and_on_its_page_and_judges_the_valve_after() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("before.csv"), record(1, &[], |_| {})).unwrap();
    let slower = |valve: &mut Valve| valve.gain = 150.0;
    write(
        folder.path().join("after.csv"),
        record(2, &["hysteresis=0.4"], slower),
    )
    .unwrap();
    write(
        folder.path().join("limits.toml"),
        "hysteresis = \"<= 3 %\"\n",
    )
    .unwrap();
    let call = [
        "compare",
        "before.csv",
        "--with",
        "after.csv",
        "--evaluator",
        "cpu",
        "--out",
        "out",
        "--limits",
        "limits.toml",
    ];
    let ran = servobee(folder.path(), &call);
    assert_eq!(
        ran.status.code(),
        Some(3),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    assert_eq!(
        names(&folder.path().join("out")),
        [
            "after.html",
            "after.json",
            "after.toml",
            "before.html",
            "before.json",
            "before.toml",
            "compare.html",
            "compare.json"
        ]
    );
    let document = json(folder.path().join("out/compare.json"));
    let came: Vec<&Value> = document["effects"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|one| one["fate"] == "came")
        .collect();
    assert_eq!(came.len(), 1, "{document}");
    assert_eq!(came[0]["name"], "hysteresis");
    assert_eq!(changed(&document), ["gain", "hysteresis"]);
    let gain = &document["changes"][0];
    assert_eq!(gain["name"], "gain");
    let (low, high) = (
        gain["low"].as_f64().unwrap(),
        gain["high"].as_f64().unwrap(),
    );
    assert!(low < -50.0 && -50.0 < high && high - low < 10.0, "{gain}");
    // The play is wider by 4 % of full scale, twice its half-width.
    let changes = document["changes"].as_array().unwrap();
    let width = changes
        .iter()
        .find(|one| one["of"] == "figure" && one["name"] == "hysteresis")
        .unwrap();
    assert_eq!(width["outcome"], "changed", "{width}");
    // Neither supply pressure nor temperature was measured.
    assert_eq!(document["confounded"].as_array().unwrap().len(), 2);
    assert_eq!(document["limits"][0]["outcome"], "fail");

    let page = read_to_string(folder.path().join("out/compare.html")).unwrap();
    assert_well_formed(&page);
    assert!(
        page.contains("hysteresis came (0 to ") || page.contains("ysteresis came ("),
        "{page}"
    );
    assert!(page.contains("id=\"unchanged\""));
    assert!(page.contains("the temperature was not measured"));
}

#[test]
fn records_that_are_not_alike_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = record(1, &[], |_| {});
    let path = |name: &str| folder.path().join(name);
    write(path("before.csv"), &text).unwrap();
    let lines = text.lines().map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[..3].join(",") + "\n"
    });
    write(path("no_flow.csv"), lines.collect::<String>()).unwrap();
    write(
        path("milliamperes.csv"),
        text.replacen("command [V]", "command [mA]", 1),
    )
    .unwrap();
    for (other, part) in [
        ("no_flow.csv", "has no flow"),
        ("milliamperes.csv", "is not in V"),
        ("missing.csv", "cannot be read"),
    ] {
        for call in [
            ["compare", "before.csv", "--with", other, "--out", "out"],
            ["compare", other, "--with", "before.csv", "--out", "out"],
        ] {
            let error = refused(&servobee(folder.path(), &call));
            assert!(
                error.contains(other) || error.contains("before.csv"),
                "{error}"
            );
            assert!(
                error.contains(part) || error.contains("is not in mA"),
                "{error}"
            );
            assert!(!path("out").exists());
        }
    }
}
