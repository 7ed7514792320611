//! The command datasheet, as a user calls it: published cases, own curves, bad curves.

use crate::html::assert_page_of_two_amplitudes;
use crate::program::{columns, json, names, off, printed, refused, rms, servobee, value};
use serde_json::Value;
use servobee::record::{ResponseCurve, cases};
use std::fs::{read_to_string, write};
use std::path::Path;
use tempfile::TempDir;

/// What a case prints, and its folder of results.
fn case(name: &str) -> (String, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "datasheet",
        "--case",
        name,
        "--evaluator",
        "cpu",
        "--out",
        "out",
    ];
    let text = printed(&servobee(folder.path(), &call));
    println!("{text}");
    (text, folder)
}

fn report(folder: &TempDir) -> Value {
    json(folder.path().join("out/report.json"))
}

/// Measured minus fitted at the points of a file of results; those two columns are its last.
fn errors(path: &Path) -> Vec<f64> {
    let columns = columns(path);
    let [(_, measured), (_, fitted)] = &columns[columns.len() - 2..] else {
        panic!("two columns");
    };
    measured
        .iter()
        .zip(fitted)
        .map(|(measured, fitted)| measured - fitted)
        .collect()
}

#[test]
fn the_papers_valve_comes_out_with_its_published_areas_and_phase() {
    let (text, folder) = case("d675");
    let report = report(&folder);
    // No effect was looked for.
    assert_eq!(report["verdict"], "not_diagnosed");
    assert!(report["explained"].is_null());
    for (i, area) in cases::d675_areas()
        .area
        .into_iter()
        .enumerate()
        .filter(|(_, area)| *area > 0.0)
    {
        let name = format!("area_{}", i + 1);
        assert!(off(value(&report, &name), area) < 1e-3, "{name}");
    }
    let rated = figure(&report, "rated_flow");
    assert!(
        off(rated["value"].as_f64().unwrap(), 1094.6) < 1e-4,
        "{rated}"
    );
    assert_eq!(figure(&report, "hysteresis")["value"], 0.0);
    let worst = errors(&folder.path().join("out/phase_points.csv"))
        .into_iter()
        .fold(0.0, |w, e| f64::max(w, e.abs()));
    assert!(worst < 0.1, "{worst} deg");
    for name in ["area_1", "area_2", "area_3", "leakage_area"] {
        assert!(
            text.contains(&format!("Not identifiable: {name}")),
            "{name}"
        );
    }
    // The paper's settings take what its table says.
    assert_eq!(
        text.lines()
            .filter(|line| line.trim_end().ends_with(" 2755"))
            .count(),
        4
    );
    assert_eq!(
        names(&folder.path().join("out")),
        [
            "flow_model.toml",
            "flow_points.csv",
            "phase_model.toml",
            "phase_points.csv",
            "report.html",
            "report.json"
        ]
    );
}

#[test]
fn a_proportional_valve_is_followed_with_rising_areas() {
    let (_, folder) = case("kbfdg5v");
    let errors = errors(&folder.path().join("out/points.csv"));
    assert!(rms(errors.into_iter()) <= 0.005 * 700.0);
    let report = report(&folder);
    let leakage = value(&report, "leakage_area");
    let areas: Vec<f64> = (1..=11)
        .map(|i| value(&report, &format!("area_{i}")).max(leakage))
        .collect();
    assert!(areas.is_sorted(), "{areas:?}");
}

#[test]
fn two_amplitudes_leave_a_few_degrees_that_are_told_by_amplitude_and_shown() {
    let (text, folder) = case("two-amplitude");
    let left = rms(errors(&folder.path().join("out/points.csv")).into_iter());
    // Four seeds ended at 2.90 deg; a better fit would be news.
    assert!((2.85..2.95).contains(&left), "{left} deg");
    assert!(text.contains("Left at 40 %:") && text.contains("Left at 100 %:"));
    assert_page_of_two_amplitudes(&read_to_string(folder.path().join("out/report.html")).unwrap());
}

#[test]
fn the_published_step_is_followed_to_its_digits() {
    let (_, folder) = case("step");
    let left = rms(errors(&folder.path().join("out/points.csv")).into_iter());
    assert!(left < 3e-4, "{left} V");
}

#[test]
fn own_curves_are_fitted_like_the_published_ones() {
    let folder = tempfile::tempdir().unwrap();
    let flow = "opening [%];flow [m^3/s]\n0;0\n25;0,001\n50;0,002\n75;0,0035\n100;0,005\n";
    write(folder.path().join("flow.csv"), flow).unwrap();
    let step = "time [s],spool [%]\n0,0\n0.01,12\n0.02,35\n0.03,58\n0.04,77\n0.06,98\n0.08,102\n0.1,100.5\n";
    write(folder.path().join("step.csv"), step).unwrap();
    let call = [
        "datasheet",
        "--flow",
        "flow.csv",
        "--step",
        "step.csv",
        "--out",
        "mine",
        "--seed",
        "2",
    ];
    let text = printed(&servobee(folder.path(), &call));
    assert!(
        text.contains("Flow of flow") && text.contains("Step response of step"),
        "{text}"
    );
    let report = json(folder.path().join("mine/report.json"));
    assert!(off(value(&report, "area_3") / value(&report, "area_2"), 2.0) < 1e-3);
    assert!(
        report["error"]["after"]["fit"]["flow"]["rmse"]
            .as_f64()
            .unwrap()
            < 0.01
    );
    assert!(
        report["error"]["after"]["fit"]["spool"]["rmse"]
            .as_f64()
            .unwrap()
            < 3.0
    );
}

/// The report of a fit of these files: options and texts.
fn fitted(files: &[(&str, String)], more: &[&str]) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = files
        .iter()
        .map(|(option, _)| format!("{}.csv", option.trim_matches('-')))
        .collect();
    let mut call = vec!["datasheet", "--evaluator", "cpu", "--out", "out"];
    for ((option, text), name) in files.iter().zip(&names) {
        write(folder.path().join(name), text).unwrap();
        call.extend([*option, name]);
    }
    call.extend(more);
    let text = printed(&servobee(folder.path(), &call));
    println!("{text}");
    (json(folder.path().join("out/report.json")), text)
}

/// A figure of a report's card.
fn figure<'r>(report: &'r Value, name: &str) -> &'r Value {
    let card = report["card"].as_array().unwrap();
    card.iter().find(|figure| figure["name"] == name).unwrap()
}

/// A flow curve as text.
fn flow_curve(openings: &[f64], flow: impl Fn(f64) -> f64) -> String {
    let rows = openings.iter().map(|&at| format!("{at},{}\n", flow(at)));
    format!("opening [%],flow [L/min]\n{}", rows.collect::<String>())
}

#[test]
fn a_linear_curve_gives_its_rated_flow_whichever_part_of_it_is_there() {
    let linear = |opening: f64| 0.1 * opening;
    let one_side = [0.0, 25.0, 50.0, 75.0, 100.0];
    let both_sides = [-100.0, -75.0, -50.0, -25.0, 0.0, 25.0, 50.0, 75.0, 100.0];
    let late = [20.0, 40.0, 60.0, 80.0, 100.0];
    for openings in [&one_side[..], &both_sides[..], &late[..]] {
        for drop in ["10", "70"] {
            let curve = flow_curve(openings, linear);
            let (report, text) = fitted(&[("--flow", curve)], &["--drop", drop]);
            let rated = figure(&report, "rated_flow");
            assert!(
                off(rated["value"].as_f64().unwrap(), 10.0) < 1e-4,
                "{rated}"
            );
            assert_eq!(rated["label"], format!("rated flow at {drop} bar"));
            assert!(text.contains(&format!("rated flow at {drop} bar")));
            for name in ["hysteresis", "null_bias", "asymmetry", "overlap"] {
                let figure = figure(&report, name);
                assert!(figure["value"].as_f64().unwrap().abs() < 1e-2, "{figure}");
            }
            assert_eq!(figure(&report, "hysteresis")["value"], 0.0);
            assert_eq!(figure(&report, "hysteresis")["low"], Value::Null);
        }
    }
    // Connected the other way round, with the published kind of drop.
    let falling = flow_curve(&both_sides, |opening| -0.1 * opening);
    let (report, _) = fitted(&[("--flow", falling)], &[]);
    assert!(
        off(
            figure(&report, "rated_flow")["value"].as_f64().unwrap(),
            10.0
        ) < 1e-4
    );
    assert!(
        off(
            figure(&report, "flow_gain")["value"].as_f64().unwrap(),
            -0.1
        ) < 1e-4
    );
    // What lies beyond the curve is not known.
    let short = flow_curve(&[0.0, 20.0, 50.0, 90.0], linear);
    let (report, text) = fitted(&[("--flow", short)], &[]);
    assert_eq!(figure(&report, "rated_flow")["value"], Value::Null);
    assert!(text.contains(
        "No rated flow at 10 bar, linearity: the flow is known up to an opening of 90 % only."
    ));
    assert!(off(figure(&report, "flow_gain")["value"].as_f64().unwrap(), 0.1) < 1e-4);
}

#[test]
fn the_two_sides_of_a_flow_curve_keep_their_difference() {
    let openings: Vec<f64> = (-10..=10).map(|k| 10.0 * f64::from(k)).collect();
    let flow = |opening: f64| match opening - 3.0 {
        plus if plus > 0.0 => 0.1 * plus,
        minus => 0.08 * minus,
    };
    let (report, _) = fitted(&[("--flow", flow_curve(&openings, flow))], &[]);
    for (name, expected) in [
        ("rated_flow", 0.5 * (9.7 + 8.24)),
        ("flow_gain", 0.09),
        ("asymmetry", 20.0),
        ("null_bias", 3.0),
    ] {
        let value = figure(&report, name)["value"].as_f64().unwrap();
        assert!(off(value, expected) < 1e-3, "{name}: {value}");
    }
    assert!(figure(&report, "overlap")["value"].as_f64().unwrap().abs() < 1e-2);
    let rms = report["error"]["after"]["fit"]["flow"]["rmse"]
        .as_f64()
        .unwrap();
    assert!(rms < 1e-5, "{rms}");
}

/// Gain (dB) and phase (deg) of K/(T s² + s + K).
fn second_order(gain: f64, lag: f64, frequency: f64) -> [f64; 2] {
    let w = std::f64::consts::TAU * frequency;
    let (re, im) = (gain - lag * w * w, w);
    [
        20.0 * (gain / re.hypot(im)).log10(),
        -im.atan2(re).to_degrees(),
    ]
}

// A slow sine takes as many steps as ten fast ones, and says less of the valve.
const FREQUENCIES: [f64; 5] = [25.0, 30.0, 40.0, 60.0, 100.0];

/// A table of the response under a header, with cells in any order.
fn response(header: &str, row: impl Fn(f64, f64, f64) -> String) -> String {
    let row = |frequency: &f64| {
        let [gain, phase] = second_order(200.0, 0.003, *frequency);
        row(*frequency, gain, phase) + "\n"
    };
    format!(
        "{header}\n{}",
        FREQUENCIES.iter().map(row).collect::<String>()
    )
}

/// Tables of one response: columns in any order, in the words of different tools.
fn tables() -> [String; 3] {
    [
        response("Hz,dB,deg", |f, gain, phase| format!("{f},{gain},{phase}")),
        response(
            "Phase (°);Frequency/Hz;Amplitude [dB]",
            |f, gain, phase| format!("{phase};{f};{gain}"),
        ),
        response("magnitude [dB],phase [rad],f [rad/s]", |f, gain, phase| {
            let w = f * std::f64::consts::TAU;
            format!("{gain},{},{w}", phase.to_radians())
        }),
    ]
}

#[test]
fn a_response_is_read_from_a_table_in_any_order() {
    for table in tables() {
        let curve = ResponseCurve::parse("table.csv", &table).unwrap();
        assert_eq!(curve.points.len(), FREQUENCIES.len(), "{table}");
        for (point, frequency) in curve.points.iter().zip(FREQUENCIES) {
            let [gain, phase] = second_order(200.0, 0.003, frequency);
            assert!(off(point.frequency, frequency) < 1e-9, "{table}");
            assert!(off(point.gain.unwrap(), gain) < 1e-9, "{table}");
            assert!(off(point.phase.unwrap(), phase) < 1e-9, "{table}");
            assert_eq!((point.amplitude, point.weight), (None, 1.0), "{table}");
        }
    }
}

#[test]
fn gain_and_phase_are_fitted_together_or_alone() {
    // Some cells are empty; only gains.
    let both = response(
        "gain [dB],frequency [Hz],phase [deg]",
        |f, gain, phase| match f {
            25.0 => format!(",{f},{phase}"),
            30.0 => format!("{gain},{f},"),
            _ => format!("{gain},{f},{phase}"),
        },
    );
    let gains = response("Hz,dB", |f, gain, _| format!("{f},{gain}"));
    let settled = ["--stream", "settled"];
    let given = ["--stream", "settled", "--amplitude", "5"];
    for (table, more, quantities) in [(both, &settled[..], 2), (gains, &given[..], 1)] {
        let (report, text) = fitted(&[("--response", table.clone())], more);
        assert!(off(value(&report, "gain"), 200.0) < 2e-3, "{table}");
        assert!(
            off(value(&report, "time_constant"), 0.003) < 2e-3,
            "{table}"
        );
        let errors = report["error"]["after"]["fit"].as_object().unwrap();
        assert_eq!(errors.len(), quantities);
        assert!(errors["gain"]["rmse"].as_f64().unwrap() < 0.02);
        assert!(text.contains("1 dB counts as one of 6.6 deg"));
        assert_eq!(text.contains("has no amplitude"), more.len() == 2, "{text}");
    }
}

#[test]
fn a_gain_that_the_phase_does_not_fit_pulls_by_its_weight() {
    // The phase of one valve with the gain of another: the fit is between the two, and says what is left of each. A weight of 0
    // takes a point out, with both.
    let mixed = response("Hz,dB,deg,weight", |f, _, phase| match f {
        40.0 => format!("{f},-30,20,0"),
        _ => format!("{f},{},{phase},1", second_order(100.0, 0.003, f)[0]),
    });
    let more = ["--amplitude", "1", "--stream", "settled"];
    let (report, text) = fitted(&[("--response", mixed)], &more);
    let gain = value(&report, "gain");
    assert!((110.0..190.0).contains(&gain), "{gain}");
    for name in ["gain", "phase"] {
        let left = report["error"]["after"]["fit"][name]["rmse"]
            .as_f64()
            .unwrap();
        assert!(left > 0.5, "{name}: {left}");
    }
    assert!(
        text.contains("RMS [deg]") && text.contains("RMS [dB]"),
        "{text}"
    );
}

#[test]
fn a_step_begins_at_zero_whether_or_not_a_row_does() {
    let step = |t: f64| {
        let (gain, lag) = (200.0f64, 0.003f64);
        let (real, wave) = (0.5 / lag, (gain / lag - 0.25 / (lag * lag)).sqrt());
        let decay = (-real * t).exp();
        10.0 * (1.0 - decay * ((wave * t).cos() + real / wave * (wave * t).sin()))
    };
    let table = |times: &[f64]| {
        let rows = times
            .iter()
            .map(|&t| format!("{t},{}\n", if t > 0.0 { step(t) } else { 0.0 }));
        format!("time [s],spool [V]\n{}", rows.collect::<String>())
    };
    let later: Vec<f64> = (2..40).map(|k| 1e-3 * f64::from(k)).collect();
    let around: Vec<f64> = [-0.0015].into_iter().chain(later.iter().copied()).collect();
    for times in [later, around] {
        let (report, text) = fitted(&[("--step", table(&times))], &[]);
        assert!(off(value(&report, "gain"), 200.0) < 1e-3, "{text}");
        assert!(off(value(&report, "time_constant"), 0.003) < 1e-3);
        let left = report["error"]["after"]["fit"]["spool"]["rmse"]
            .as_f64()
            .unwrap();
        assert!(left < 1e-3, "{left}");
    }
}

#[test]
fn bad_curves_are_refused_with_their_place() {
    for (option, text, parts) in [
        (
            "--flow",
            "opening [%],flow [L/min]\n0,0\n0,1\n50,2\n100,3\n",
            ["row 3", "opening"],
        ),
        (
            "--flow",
            "opening [%],flow [L/min]\n0,0\n50,2\n100,3\n",
            ["four", "more points"],
        ),
        (
            "--flow",
            "opening [%],flow [furlong]\n0,0\n",
            ["furlong", "L/min"],
        ),
        (
            "--response",
            "frequency [Hz],amplitude [%],phase [deg]\n-1,90,-3\n",
            ["row 2", "frequency"],
        ),
        (
            "--response",
            "frequency [Hz],amplitude [%],phase [deg]\n1,90,NaN\n",
            ["row 2", "phase"],
        ),
        (
            "--flow",
            "opening [%],flow [L/min]\n-100,10\n-50,5\n0,0\n50,5\n100,10\n",
            ["row 2, column \"flow", "minus sign"],
        ),
        (
            "--flow",
            "opening [%],flow [L/min]\n0,0\n25,-2\n50,-5\n100,-10\n",
            ["row 5, column \"flow", "without its sign"],
        ),
        (
            "--flow",
            "opening [%],flow [L/min]\n-100,-10\n-50,-5\n-25,-2\n0,0\n",
            ["row 5, column \"opening", "without their signs"],
        ),
        (
            "--flow",
            "opening [%],flow [L/min]\n0,0\n25,0\n50,0\n100,0\n",
            ["column \"flow", "every flow is 0"],
        ),
        (
            "--response",
            "frequency [Hz],amplitude [%]\n1,90\n2,90\n",
            ["\"phase [deg]\" or \"gain [dB]\"", "rename"],
        ),
        (
            "--response",
            "Hz,dB,deg\n1,0,-1\n2,,\n3,-1,-5\n",
            ["row 3", "empty"],
        ),
        (
            "--step",
            "time [s],spool [V]\n-0.2,0\n-0.1,0\n0,0\n",
            ["the step comes at 0 s", "times since the step"],
        ),
        ("--step", "time [s],spool [V]\n0,0\n", ["1 row", "two"]),
        ("--step", "", ["curve.csv", "empty"]),
    ] {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path().join("curve.csv"), text).unwrap();
        let line = refused(&servobee(
            folder.path(),
            &["datasheet", option, "curve.csv", "--out", "out"],
        ));
        for part in parts {
            assert!(line.contains(part), "{part:?} is not in {line}");
        }
        assert_eq!(names(folder.path()), ["curve.csv"]);
    }
}
