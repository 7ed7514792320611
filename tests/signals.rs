//! Benches as they are: slow sweeps, meters and wires, and loops. The records are made here by plain formulas: a play, a
//! square-edged valve of constant gain, a first-order meter, rounding.

use crate::program::{json, printed, refused, servobee, soak, value};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs::write;
use tempfile::TempDir;

const GPM: f64 = 3.785_411_784;

/// A slow sweep of flow over a current of ±10 mA.
#[derive(Clone, Copy)]
struct Sweep {
    /// s.
    period: f64,
    periods: f64,
    /// Half the width of the play, mA.
    play: f64,
    /// Time constant of the meter, s.
    lag: f64,
    /// What the meter shows without flow, L/min.
    offset: f64,
    /// What the meter makes of a flow.
    shown: fn(f64) -> f64,
}

const SWEEP: Sweep = Sweep {
    period: 50.0,
    periods: 2.0,
    play: 0.2,
    lag: 1.0,
    offset: 0.3,
    shown: |flow| flow,
};
/// L/min for each mA.
const FLOW_GAIN: f64 = 6.0;
const NOISE: f64 = 0.05;

impl Sweep {
    fn command(&self, time: f64) -> f64 {
        let phase = (time / self.period).fract();
        40.0 * match phase {
            _ if phase < 0.25 => phase,
            _ if phase < 0.75 => 0.5 - phase,
            _ => phase - 1.0,
        }
    }

    /// The record: the motion in steps of a millisecond, 2000 rows a period or 50 a second, whichever are fewer.
    fn csv(&self) -> String {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = || NOISE * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
        let mut text = String::from("time [s],command [mA],flow [L/min]\n");
        let (mut spool, mut meter) = (0.0f64, 0.0f64);
        let step = 1e-3;
        let every = (self.period / 2.0).max(20.0) as usize;
        for k in 0..(self.period * self.periods / step) as usize {
            let time = k as f64 * step;
            let command = self.command(time);
            spool = spool.clamp(command - self.play, command + self.play);
            if k % every == 0 {
                let flow = (self.shown)(meter + self.offset + noise());
                writeln!(text, "{time:.3},{command:.4},{flow:.4}").unwrap();
            }
            meter += (FLOW_GAIN * spool - meter) * (1.0 - (-step / self.lag).exp());
        }
        text
    }

    /// What inspect prints.
    fn inspected(&self) -> String {
        let folder = TempDir::new().unwrap();
        write(folder.path().join("sweep.csv"), self.csv()).unwrap();
        printed(&servobee(folder.path(), &["inspect", "sweep.csv"]))
    }

    /// The report and what is printed.
    fn identified(&self, more: &[&str]) -> (Value, String) {
        let folder = TempDir::new().unwrap();
        write(folder.path().join("sweep.csv"), self.csv()).unwrap();
        let call = [
            &[
                "identify",
                "sweep.csv",
                "--full-scale",
                "10",
                "--evaluator",
                "cpu",
                "--out",
                "out",
            ],
            more,
        ];
        let text = printed(&servobee(folder.path(), &call.concat()));
        (json(folder.path().join("out/report.json")), text)
    }
}

/// The effects that were found, in the order of their names. A valve without lap shows an offset of the meter and a bias of
/// its null alike: the one is taken for the other where the report says so.
fn effects(report: &Value) -> Vec<&str> {
    let list = report["effects"].as_array().unwrap();
    let is_tied = |one: &str, effect: &Value| {
        let tied = effect["tied_with"].as_array().unwrap();
        tied.iter().any(|tied| tied == one)
    };
    let mut names: Vec<&str> = list
        .iter()
        .map(|one| match one["name"].as_str().unwrap() {
            "null_bias" if is_tied("sensor_offset", one) => "sensor_offset",
            name => name,
        })
        .collect();
    names.sort_unstable();
    names
}

/// Whether the 95 % interval of a parameter holds `planted`, or misses it by less than `share` of it: the rows are not
/// independent, as every interval here assumes that the model is complete.
fn holds(report: &Value, name: &str, planted: f64, share: f64) {
    let parameters = report["parameters"].as_array().unwrap();
    let found = parameters.iter().find(|one| one["name"] == name);
    let found = found.unwrap_or_else(|| panic!("no {name} in {parameters:?}"));
    let [low, high] = ["low", "high"].map(|key| found[key].as_f64().unwrap());
    let slack = share * planted.abs();
    assert!(
        low - slack <= planted && planted <= high + slack,
        "{name} {low} .. {high}, planted {planted}"
    );
}

/// The same of the meter's offset, L/min, or of the bias of null that shows the same where the flow gain is `gain`.
fn holds_offset(report: &Value, offset: f64, gain: f64) {
    let parameters = report["parameters"].as_array().unwrap();
    match parameters.iter().any(|one| one["name"] == "null_bias") {
        true => holds(report, "null_bias", offset / gain, 0.02),
        false => holds(report, "sensor_offset_flow", offset, 0.02),
    }
}

#[test]
fn a_slow_sweep_says_nothing_of_the_actuator_and_all_of_the_valve() {
    let (report, text) = SWEEP.identified(&[]);
    for name in ["gain", "time_constant", "saturation"] {
        let parameters = report["parameters"].as_array().unwrap();
        assert!(parameters.iter().all(|one| one["name"] != name), "{name}");
    }
    assert!(
        text.contains("Gain, time constant and saturation are left out"),
        "{text}"
    );
    let bench = report["bench"].as_array().unwrap();
    assert_eq!(bench.len(), 1, "{bench:?}");
    let dynamic = |figure: &&Value| figure["name"].as_str().unwrap().contains("dB");
    for figure in report["card"].as_array().unwrap().iter().filter(dynamic) {
        assert!(figure["value"].is_null(), "{figure}");
    }
    assert_eq!(
        effects(&report),
        ["hysteresis", "sensor_lag", "sensor_offset"],
        "{text}"
    );
    holds(&report, "hysteresis", SWEEP.play, 0.02);
    holds(&report, "sensor_lag_flow", SWEEP.lag, 0.02);
    holds_offset(&report, SWEEP.offset, FLOW_GAIN);
}

#[test]
fn a_valve_of_negative_polarity_and_a_meter_without_a_sign_are_taken_as_they_are() {
    let (report, text) = Sweep {
        shown: |flow| -flow,
        ..SWEEP
    }
    .identified(&["--effects", "hysteresis,sensor_lag,sensor_offset"]);
    assert!(text.contains("negative polarity"), "{text}");
    holds(&report, "sensor_lag_flow", SWEEP.lag, 0.02);
    holds_offset(&report, -SWEEP.offset, -FLOW_GAIN);
    let magnitude = Sweep {
        shown: f64::abs,
        offset: 0.0,
        ..SWEEP
    };
    let (report, text) = magnitude.identified(&["--effects", "none"]);
    assert!(text.contains("shows no sign"), "{text}");
    let area = value(&report, "max_area");
    let (straight, _) = SWEEP.identified(&["--effects", "none"]);
    let expected = value(&straight, "max_area");
    assert!((area / expected - 1.0).abs() < 0.05, "{area} {expected}");
}

/// A record of 4 s at 1 kHz: time, and two columns with these heads and values.
fn record(heads: [&str; 2], values: [&dyn Fn(f64) -> f64; 2]) -> TempDir {
    let folder = TempDir::new().unwrap();
    let mut text = format!("time [s],{},{}\n", heads[0], heads[1]);
    for k in 0..4000 {
        let time = f64::from(k) * 1e-3;
        writeln!(text, "{time},{:.5},{:.5}", values[0](time), values[1](time)).unwrap();
    }
    write(folder.path().join("run.csv"), text).unwrap();
    folder
}

fn chirp(time: f64) -> f64 {
    (TAU * (0.5 + 2.0 * time) * time).sin()
}

#[test]
fn inspect_says_what_identify_will_take_the_bench_to_be() {
    let straight = SWEEP.inspected();
    assert!(straight.contains("too slow to show"), "{straight}");
    assert!(!straight.contains("polarity"), "{straight}");
    let negative = Sweep {
        shown: |flow| -flow,
        ..SWEEP
    };
    let negative = negative.inspected();
    assert!(negative.contains("negative polarity"), "{negative}");
    let unsigned = Sweep {
        shown: f64::abs,
        ..SWEEP
    };
    let unsigned = unsigned.inspected();
    assert!(unsigned.contains("shows no sign"), "{unsigned}");
}

#[test]
fn signals_whose_zero_or_sign_is_in_doubt_are_refused_with_the_map_that_says_it() {
    let late = |time: f64| chirp(time - 0.004);
    let live = |time: f64| 12.0 + 6.0 * chirp(time);
    let spool = |time: f64| 75.0 * late(time);
    let folder = record(["command [mA]", "spool [%]"], [&live, &spool]);
    let refusal = refused(&servobee(folder.path(), &["identify", "run.csv"]));
    assert!(
        refusal.contains("--map \"COLUMN=command [%] *12.5 -150\""),
        "{refusal}"
    );
    let inspected = printed(&servobee(folder.path(), &["inspect", "run.csv"]));
    assert!(inspected.contains("Not ready"), "{inspected}");
    let map = [
        "identify",
        "run.csv",
        "--effects",
        "none",
        "--out",
        "out",
        "--map",
    ];
    let said = [&map[..], &["command [mA]=command [%] *12.5 -150"]].concat();
    printed(&servobee(folder.path(), &said));
    assert_eq!(
        json(folder.path().join("out/report.json"))["schema"],
        "servobee/report/2"
    );

    let folder = record(
        ["command [V]", "spool [V]"],
        [&|t| 4.0 * chirp(t), &|t| -4.0 * late(t)],
    );
    let refusal = refused(&servobee(folder.path(), &["identify", "run.csv"]));
    assert!(refusal.contains("one of the two is inverted"), "{refusal}");
    let inspected = printed(&servobee(folder.path(), &["inspect", "run.csv"]));
    assert!(inspected.contains("Not ready"), "{inspected}");
    let said = [&map[..], &["spool [V]=spool [V] *-1"]].concat();
    printed(&servobee(folder.path(), &said));
    let report = json(folder.path().join("out/report.json"));
    let fit = &report["error"]["after"]["hold_out"]["spool"]["fit_percent"];
    assert!(fit.as_f64().unwrap() > 90.0, "{fit}");
}

#[test]
fn a_position_that_follows_its_command_is_a_closed_loop_in_any_unit() {
    // Second order, 3 Hz, from rest.
    let (mut position, mut speed) = (0.0f64, 0.0f64);
    let mut rows = Vec::new();
    for k in 0..40_000 {
        let time = f64::from(k) * 1e-4;
        if k % 10 == 0 {
            rows.push(position);
        }
        let omega = TAU * 3.0;
        let pull = omega * omega * (4.0 * chirp(0.2 * time) - position) - 1.4 * omega * speed;
        speed += 1e-4 * pull;
        position += 1e-4 * speed;
    }
    let at = |time: f64| 120.0 + 25.0 * rows[(time * 1e3).round() as usize];
    let folder = record(
        ["command [V]", "position [mm]"],
        [&|t| 4.0 * chirp(0.2 * t), &at],
    );
    let call = ["identify", "run.csv", "--effects", "none", "--out", "out"];
    let text = printed(&servobee(folder.path(), &call));
    assert!(text.contains("that of a closed loop"), "{text}");
    let inspected = printed(&servobee(folder.path(), &["inspect", "run.csv"]));
    assert!(inspected.contains("that of a closed loop"), "{inspected}");
    let report = json(folder.path().join("out/report.json"));
    holds(&report, "position_gain", 25.0, 0.01);
    holds(&report, "position_zero", 120.0, 0.01);
    let fit = &report["error"]["after"]["hold_out"]["position"]["fit_percent"];
    assert!(fit.as_f64().unwrap() > 98.0, "{fit}");
    let simulate = ["simulate", "out/model.toml", "run.csv"];
    printed(&servobee(folder.path(), &simulate));
}

/// A position loop by its transfer function: gain (T s + 1) / (s²/ω² + 2ζ s/ω + 1), 6 Hz, ζ 0.7, its command late.
struct Loop {
    gain: f64,
    /// s.
    zero: f64,
    /// s.
    late: f64,
    /// Whether the command stays between two rows, as that of a converter does, or is a generator's.
    held: bool,
}

const LOOP: Loop = Loop {
    gain: 1.0,
    zero: 0.0,
    late: 0.0,
    held: true,
};

impl Loop {
    /// Twice a chirp of ±20 mm up to 12 Hz with a rest, and what the position shows, in steps of 0.05 ms, with noise.
    fn identified(&self, heads: [&str; 2]) -> (Value, String) {
        let command = |time: f64| match time {
            _ if time < 1.0 => 0.0,
            _ => {
                // In whole periods: nothing jumps.
                let time = (time - 1.0) % 4.0;
                20.0 * (TAU * (0.25 + 1.5 * time) * time).sin()
            }
        };
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut noise = || 0.03 * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
        let mut text = format!("time [s],{},{}\n", heads[0], heads[1]);
        let (mut x, mut v) = (0.0f64, 0.0f64);
        let (step, omega) = (5e-5, TAU * 6.0);
        for k in 0..180_000 {
            let time = f64::from(k) * step;
            if k % 20 == 0 {
                let position = self.gain * (x + self.zero * v) + noise();
                writeln!(text, "{time:.4},{:.4},{position:.4}", command(time)).unwrap();
            }
            let asked = time + step / 2.0 - self.late;
            let asked = command(match self.held {
                true => 1e-3 * (1e3 * asked).floor(),
                false => asked,
            });
            let pull = |x: f64, v: f64| omega * omega * (asked - x) - 1.4 * omega * v;
            let (middle, speed) = (x + step / 2.0 * v, v + step / 2.0 * pull(x, v));
            (x, v) = (x + step * speed, v + step * pull(middle, speed));
        }
        let folder = TempDir::new().unwrap();
        write(folder.path().join("run.csv"), text).unwrap();
        let call = ["identify", "run.csv", "--evaluator", "cpu", "--out", "out"];
        let text = printed(&servobee(folder.path(), &call));
        (json(folder.path().join("out/report.json")), text)
    }
}

#[test]
fn what_a_position_loop_lacks_is_found_by_name() {
    let heads = ["command [mm]", "position [mm]"];
    // What a generator's command is ahead of a held one by is no feed-forward.
    let (report, text) = Loop {
        held: false,
        ..LOOP
    }
    .identified(heads);
    assert_eq!(effects(&report), [""; 0], "{text}");
    let lacks = [
        (
            Loop {
                gain: 0.97,
                held: false,
                ..LOOP
            },
            "dc_gain",
            0.97,
        ),
        (
            Loop {
                zero: 0.008,
                ..LOOP
            },
            "feed_forward",
            0.008,
        ),
        (
            Loop {
                late: 0.005,
                ..LOOP
            },
            "delay",
            0.005,
        ),
    ];
    for (planted, name, value) in &lacks[..if soak() { 3 } else { 1 }] {
        let (report, text) = planted.identified(heads);
        assert_eq!(effects(&report), [*name], "{text}");
        assert_eq!(
            report["effects"][0]["tied_with"],
            Value::Array(vec![]),
            "{text}"
        );
        holds(&report, name, *value, 0.02);
    }
}

#[test]
fn a_spool_in_the_unit_of_its_command_is_a_loop_too() {
    let heads = ["command [mm]", "spool [mm]"];
    let (report, text) = Loop {
        zero: 0.008,
        ..LOOP
    }
    .identified(heads);
    assert_eq!(effects(&report), ["feed_forward"], "{text}");
    // A flow force holds a spool back alike.
    let (report, text) = Loop { gain: 0.97, ..LOOP }.identified(heads);
    let [named] = effects(&report)[..] else {
        panic!("{text}")
    };
    let other = match named {
        "dc_gain" => "flow_force",
        "flow_force" => "dc_gain",
        _ => panic!("{text}"),
    };
    let tied = report["effects"][0]["tied_with"].as_array().unwrap();
    assert!(tied.iter().any(|tied| tied == other), "{text}");
}

#[test]
fn a_meter_that_rounds_above_a_gallon_a_minute_hides_nothing() {
    let coarse = Sweep {
        shown: |flow| match flow.abs() > GPM {
            true => (flow / (0.1 * GPM)).round() * 0.1 * GPM,
            false => flow,
        },
        ..SWEEP
    };
    let periods = [20.0, 200.0, 50.0, 100.0];
    for &period in &periods[..if soak() { 4 } else { 1 }] {
        let (report, text) = Sweep { period, ..coarse }.identified(&[]);
        let names = ["hysteresis", "sensor_lag", "sensor_offset"];
        assert_eq!(effects(&report), names, "{period} s: {text}");
        holds(&report, "hysteresis", SWEEP.play, 0.05);
        holds(&report, "sensor_lag_flow", SWEEP.lag, 0.05);
    }
    if !soak() {
        return;
    }
    // So slow that the steps of the meter hide its lag: whichever is named, the report says that it may be the other.
    let slowest = Sweep {
        period: 500.0,
        ..coarse
    };
    let (report, text) = slowest.identified(&[]);
    let named = effects(&report);
    if !(named.contains(&"hysteresis") && named.contains(&"sensor_lag")) {
        let list = report["effects"].as_array().unwrap();
        let of = |name: &str| list.iter().find(|one| one["name"] == name);
        let (one, other) = match of("hysteresis") {
            Some(one) => (one, "sensor_lag"),
            None => (of("sensor_lag").expect(&text), "hysteresis"),
        };
        let tied = one["tied_with"].as_array().unwrap();
        assert!(tied.iter().any(|tied| tied == other), "{text}");
    }
}

#[test]
fn without_a_full_scale_no_figure_is_a_share_of_it() {
    let folder = TempDir::new().unwrap();
    write(folder.path().join("sweep.csv"), SWEEP.csv()).unwrap();
    let figures = |more: &[&str]| -> Vec<(String, bool)> {
        let call = [
            "identify",
            "sweep.csv",
            "--effects",
            "none",
            "--out",
            "out",
            "--force",
        ];
        let text = printed(&servobee(folder.path(), &[&call[..], more].concat()));
        assert_eq!(
            text.contains("the largest |command|, 10 mA"),
            more.is_empty(),
            "{text}"
        );
        let report = json(folder.path().join("out/report.json"));
        let card = report["card"].as_array().unwrap().iter();
        card.map(|figure| {
            (
                figure["name"].as_str().unwrap().into(),
                figure["value"].is_number(),
            )
        })
        .collect()
    };
    let known = figures(&["--full-scale", "10"]);
    let unknown = figures(&[]);
    let has = |all: &[(String, bool)], name: &str| all.iter().any(|one| one.0 == name && one.1);
    for share in ["hysteresis", "null_bias", "rated_flow", "lap"] {
        assert!(has(&known, share) && !has(&unknown, share), "{share}");
    }
    assert!(has(&unknown, "flow_gain") && has(&unknown, "polarity"));
}

#[test]
fn a_command_far_beyond_its_full_scale_is_in_another_unit() {
    let folder = TempDir::new().unwrap();
    let run = |unit: &str, more: &[&str]| {
        let mut text = format!("time [s],command [{unit}],flow [L/min]\n");
        for k in 0..2000 {
            let command = if k / 100 % 2 == 0 { 0.0 } else { 98.0 };
            writeln!(
                text,
                "{:.3},{command},{:.2}",
                f64::from(k) * 1e-3,
                0.4 * command
            )
            .unwrap();
        }
        write(folder.path().join("run.csv"), text).unwrap();
        let call = [&["identify", "run.csv", "--out", "out"], more].concat();
        let output = servobee(folder.path(), &call);
        assert!(!output.status.success() && !folder.path().join("out").exists());
        String::from_utf8(output.stderr).unwrap()
    };
    for scale in ["10V", "10 V", "100%"] {
        let error = run("V", &["--full-scale", scale]);
        let number = scale.trim_end_matches(['V', '%', ' ']);
        let remedy =
            format!("give the number alone, in the unit of the record's command: {number}");
        assert!(error.contains(&remedy), "{error}");
    }
    for (unit, more) in [("%", &["--full-scale", "10"][..]), ("V", &[])] {
        let error = run(unit, more);
        let place = format!("run.csv, column \"command [{unit}]\", sample 100");
        let problem = format!("is 98 {unit}, 9.8 times the full scale of 10 {unit}");
        for part in [place.as_str(), &problem, "--full-scale"] {
            assert!(error.contains(part), "{part} is not in {error}");
        }
    }
}

#[test]
fn the_gaps_between_held_out_pieces_are_no_resolution_of_time() {
    // Begins at one end, opens more to one side: no floor hides that.
    let folder = TempDir::new().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut noise = || 0.1 * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
    let mut text = String::from("time [s],command [mA],flow [L/min]\n");
    for k in 0..4000 {
        let time = f64::from(k) * 0.02;
        let phase = (time / 40.0).fract();
        let command = 10.0 * (1.0 - 4.0 * (phase - 0.5).abs());
        let flow = command * if command > 0.0 { 6.0 } else { 5.2 };
        writeln!(text, "{time:.2},{command:.4},{:.4}", flow + noise()).unwrap();
    }
    write(folder.path().join("run.csv"), text).unwrap();
    let call = ["identify", "run.csv", "--full-scale", "10", "--out", "out"];
    let text = printed(&servobee(folder.path(), &call));
    let report = json(folder.path().join("out/report.json"));
    let floor = report["noise_floor"]["flow"].as_f64().unwrap();
    assert!((0.08..0.13).contains(&floor), "{floor}: {text}");
    assert_eq!(effects(&report), ["asymmetric_gain"], "{text}");
}
