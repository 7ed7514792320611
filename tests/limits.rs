//! Limits that a valve has to keep, as a user calls for them.

use crate::program::{bench, json, names, printed, refused, servobee};
use std::fs::{read_to_string, write};
use std::path::Path;
use std::process::Output;

/// Identifies the record of the test bench with these limits.
fn identify(folder: &Path, limits: &str) -> Output {
    write(folder.join("limits.toml"), limits).unwrap();
    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "delay",
        "--evaluator",
        "cpu",
        "--limits",
        "limits.toml",
        "--out",
        "out",
        "--force",
    ];
    servobee(folder, &call)
}

#[test]
fn a_limit_is_met_by_the_whole_interval_and_missed_by_the_whole_interval() {
    let folder = bench();
    // The record was made with a delay of 4.7 ms; its interval is 4.6815 .. 4.7026 ms.
    let ran = identify(
        folder.path(),
        "rated_flow = \"57 .. 63 L/min\"\nphase_limit_90 = \">= 15 Hz\"\ndelay = \"<= 4.69 ms\"\nhysteresis = \"<= 3 %\"\n",
    );
    assert_eq!(ran.status.code(), Some(3));
    let errors = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(
        errors,
        "servobee: 1 of 4 limits are met; fail: phase_limit_90; not determined: delay, hysteresis\n"
    );
    let told = String::from_utf8(ran.stdout).unwrap();
    assert!(told.contains("1 of 4 limits are met."), "{told}");
    assert!(
        told.contains("Not determined: delay: the limit lies inside the interval."),
        "{told}"
    );
    let report = json(folder.path().join("out/report.json"));
    let limits = report["limits"].as_array().unwrap();
    let outcomes: Vec<[&str; 2]> = limits
        .iter()
        .map(|one| [&one["name"], &one["outcome"]].map(|text| text.as_str().unwrap()))
        .collect();
    assert_eq!(
        outcomes,
        [
            ["rated_flow", "pass"],
            ["phase_limit_90", "fail"],
            ["delay", "not_determined"],
            ["hysteresis", "not_determined"]
        ]
    );
    let delay = &limits[2];
    assert_eq!(
        (&delay["of"], &delay["unit"]),
        (&"parameter".into(), &"s".into())
    );
    assert!((delay["upper"].as_f64().unwrap() - 0.00469).abs() < 1e-12);
    assert!(delay["low"].as_f64() < delay["upper"].as_f64());
    assert!(delay["upper"].as_f64() < delay["high"].as_f64());
    assert!(delay["lower"].is_null() && delay["from"] == "model");
    assert!(limits[3]["value"].is_null() && limits[3]["reason"] == "the model has none");
    let files = report["files"].as_array().unwrap();
    assert!(files.iter().any(|file| file["path"] == "limits.toml"));

    let page = read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("<h2>Limits: 1 of 4 are met</h2>"), "{page}");
    assert!(page.contains("<b>fail</b>"));
    assert!(page.find("id=\"card\"") < page.find("id=\"limits\""));
}

#[test]
fn where_every_limit_is_met_the_call_succeeds() {
    let folder = bench();
    let told = printed(&identify(
        folder.path(),
        "rated_flow = \"15 .. 16 gpm\"\ndelay = \">= 4 ms\"\npolarity = \">= 1\"\n",
    ));
    assert!(told.contains("3 of 3 limits are met."), "{told}");
}

#[test]
fn of_a_model_that_is_incomplete_no_interval_meets_a_limit() {
    let folder = bench();
    write(
        folder.path().join("limits.toml"),
        "[parameters]\ngain = \">= 10 1/s\"\n",
    )
    .unwrap();
    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "none",
        "--limits",
        "limits.toml",
    ];
    let ran = servobee(folder.path(), &call);
    assert_eq!(ran.status.code(), Some(3));
    let told = String::from_utf8(ran.stdout).unwrap();
    assert!(
        told.contains("Not determined: gain: the model is incomplete."),
        "{told}"
    );
}

#[test]
fn limits_that_are_none_are_refused_before_anything_is_computed() {
    let folder = bench();
    for (limits, part) in [
        ("hysteresis = \"<= 3\"", "give it in %"),
        ("histeresis = \"<= 3 %\"", "nothing is called histeresis"),
        (
            "hysteresis = \"about 3 %\"",
            "write hysteresis = \"<= 3 %\"",
        ),
        ("# nothing", "there is no limit in it"),
    ] {
        let error = refused(&identify(folder.path(), limits));
        assert!(error.contains("limits.toml, line 1"), "{error}");
        assert!(error.contains(part), "{part} is not in: {error}");
        assert_eq!(names(folder.path()), ["bench.csv", "limits.toml"]);
    }
}
