//! A command that is measured with noise, which the valve does not get. The records are made here, in steps of 20 us.

use crate::beginnings::warned;
use crate::program::{json, printed, servobee};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs::write;

const GAIN: f64 = 180.0;
const NOTE: &str = "the command was measured with noise of 0.0";

/// Where the noise of the command comes from.
#[derive(Clone, Copy, PartialEq)]
enum From {
    /// The logger.
    Logger,
    /// The generator: the valve gets it.
    Generator,
}

/// Steps and sweeps in turn, each for two seconds.
fn command(time: f64) -> f64 {
    match (time / 2.0) as usize % 2 {
        0 => [5.0, -3.0, 0.0, 8.0, 1.0, -6.0, 0.0, 3.0][(time / 0.25) as usize % 8],
        _ => 3.0 * (TAU * time * (1.5 + 0.0375 * time)).sin() + 1.5 * (TAU * 5.3 * time).sin(),
    }
}

/// Rows of 1 ms of a valve with a play of ± `play` V, whose command has noise of standard deviation `noise` V.
fn record(from: From, noise: f64, play: f64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
    let mut text = String::from("time [s],command [V],spool [V]\n");
    let (mut integrator, mut spool, mut passed) = (0.0f64, 0.0f64, 0.0f64);
    for row in 0..6000 {
        let time = 0.001 * f64::from(row);
        let (asked, noise) = (command(time), noise * normal());
        let shown = spool + 0.01 * normal();
        writeln!(text, "{time:.3},{:.5},{shown:.5}", asked + noise).unwrap();
        let got = match from {
            From::Logger => asked,
            From::Generator => asked + noise,
        };
        for _ in 0..50 {
            passed = passed.clamp(got - play, got + play);
            let speed = (integrator - spool) / 0.0025;
            integrator += 2e-5 * GAIN * (passed - spool).clamp(-5.0, 5.0);
            spool += 2e-5 * speed;
        }
    }
    text
}

fn identified(record: String) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record).unwrap();
    let call = ["identify", "log.csv", "--evaluator", "cpu", "--out", "out"];
    let text = printed(&servobee(folder.path(), &call));
    (json(folder.path().join("out/report.json")), text)
}

fn value(report: &Value, name: &str) -> f64 {
    let mut all = report["parameters"].as_array().unwrap().iter();
    let one = all.find(|one| one["name"] == name).unwrap();
    one["value"].as_f64().unwrap()
}

#[test]
fn a_healthy_valve_whose_command_is_logged_with_noise_lacks_nothing() {
    for noise in [0.01, 0.02, 0.04] {
        let (report, printed) = identified(record(From::Logger, noise, 0.0));
        assert_eq!(report["verdict"], "none", "{printed}");
        assert!(warned(&report, NOTE), "{printed}");
        let gain = value(&report, "gain");
        assert!((gain / GAIN - 1.0).abs() < 0.01, "{gain}");
        let sources = report["noise_sources"]["spool"].as_array().unwrap();
        let of_command = sources.iter().find(|one| one["from"] == "measured command");
        let of_command = of_command.unwrap()["value"].as_f64().unwrap();
        assert!(
            of_command > 0.1 * noise && of_command < noise,
            "{of_command}"
        );
        let floor = report["noise_floor"]["spool"].as_f64().unwrap();
        assert!(floor > 0.01 && floor < 0.01 + noise, "{floor}");
    }
}

#[test]
fn a_play_is_found_beside_a_noisy_command() {
    let (report, printed) = identified(record(From::Logger, 0.01, 0.15));
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"][0]["name"], "hysteresis", "{printed}");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1, "{printed}");
    let play = value(&report, "hysteresis");
    assert!((play / 0.15 - 1.0).abs() < 0.05, "{play}");
}

#[test]
fn noise_that_the_valve_gets_is_no_logger_s() {
    let (report, printed) = identified(record(From::Generator, 0.03, 0.0));
    assert_eq!(report["verdict"], "none", "{printed}");
    assert!(!warned(&report, NOTE), "{printed}");
}

/// A supply gives way by a third under flow, and its transducer is noisier than the flow meter: what a model makes of that in the flow
/// grows with the opening, and looked like something that is missing.
#[test]
fn a_pilot_stage_is_found_beside_a_noisy_supply() {
    let record = |noise: f64| {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
        let mut text =
            String::from("time [s],command [V],spool [V],flow [L/min],supply_pressure [bar]\n");
        let (mut integrator, mut spool, mut supply) = (0.0f64, 0.0f64, 70.0f64);
        for row in 0..6000 {
            let time = 0.001 * f64::from(row);
            let asked = command(time);
            let shown = [
                spool + 0.01 * normal(),
                3.0 * spool * (supply / 70.0).sqrt() + 0.03 * normal(),
                supply + noise * normal(),
            ];
            let [spool_shown, flow, pressure] = shown;
            writeln!(
                text,
                "{time:.3},{asked:.5},{spool_shown:.5},{flow:.5},{pressure:.4}"
            )
            .unwrap();
            for _ in 0..50 {
                let root = (supply / 70.0).sqrt();
                supply += 2e-5 / 0.08 * (70.0 - 1.2 * 3.0 * spool.abs() * root - supply);
                let speed = (integrator - spool) / 0.0025;
                integrator += 2e-5 * GAIN * root * (asked - spool).clamp(-3.0, 3.0);
                spool += 2e-5 * speed;
            }
        }
        text
    };
    let (report, printed) = identified(record(0.4));
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1, "{printed}");
    assert_eq!(report["effects"][0]["name"], "pilot_supply", "{printed}");
    let share = value(&report, "pilot_supply");
    assert!((share - 1.0).abs() < 0.05, "{share}");
    assert!(
        warned(&report, "pressures were measured with noise of 0.4"),
        "{printed}"
    );
    let sources = report["noise_sources"]["flow"].as_array().unwrap();
    assert!(
        sources
            .iter()
            .any(|one| one["from"] == "measured pressures"),
        "{sources:?}"
    );
}
