//! What the command does between two rows is seen where it jumps: the valve answers one that is not held by the row that has the
//! jump. The record is made here, in steps of 20 us.

use crate::program::{json, printed, servobee};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs::write;

const GAIN: f64 = 180.0;

/// Steps and sweeps in turn, each for two seconds.
fn command(time: f64) -> f64 {
    match (time / 2.0) as usize % 2 {
        0 => [5.0, -3.0, 0.0, 8.0, 1.0, -6.0, 0.0, 3.0][(time / 0.25) as usize % 8],
        _ => 3.0 * (TAU * time * (1.5 + 0.0375 * time)).sin() + 1.5 * (TAU * 5.3 * time).sin(),
    }
}

/// Rows of 2 ms of a valve with a play of ± 0.15 V, whose command goes straight from row to row.
fn record() -> String {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut text = String::from("time [s],command [V],spool [V]\n");
    let (mut integrator, mut spool, mut play) = (0.0f64, 0.0f64, 0.0f64);
    for row in 0..4000 {
        let time = 0.002 * f64::from(row);
        let (now, next) = (command(time), command(time + 0.002));
        let noise = 0.02 * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
        writeln!(text, "{time:.3},{now:.5},{:.5}", spool + noise).unwrap();
        for step in 0..100 {
            let u = now + (next - now) * (f64::from(step) + 0.5) / 100.0;
            play = play.clamp(u - 0.15, u + 0.15);
            let speed = (integrator - spool) / 0.0025;
            integrator += 2e-5 * GAIN * (play - spool).clamp(-5.0, 5.0);
            spool += 2e-5 * speed;
        }
    }
    text
}

#[test]
fn a_jump_that_is_answered_in_its_row_tells_that_the_command_is_not_held() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record()).unwrap();
    let model = "[structure]\nhold = \"interpolated\"\n";
    write(folder.path().join("told.toml"), model).unwrap();
    let run = |more: &[&str]| {
        let call = [
            &[
                "identify",
                "log.csv",
                "--evaluator",
                "cpu",
                "--out",
                "out",
                "--force",
            ],
            more,
        ];
        let text = printed(&servobee(folder.path(), &call.concat()));
        (json(folder.path().join("out/report.json")), text)
    };
    let [(report, printed), (told, _)] = [run(&[]), run(&["--model", "told.toml"])];
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1, "{printed}");
    assert_eq!(report["effects"][0]["name"], "hysteresis");
    let hold = &report["hold"];
    assert_eq!(
        [&hold["taken"], &hold["preferred"]],
        ["interpolated"; 2],
        "{hold}"
    );
    assert_eq!(hold["stated"], false);
    let gain = report["parameters"][0]["value"].as_f64().unwrap();
    assert!((gain / GAIN - 1.0).abs() < 0.01, "{gain}");
    // It is not tried held as well: the whole diagnosis would be made twice.
    let evaluations = [&report, &told].map(|one| one["evaluations"].as_f64().unwrap());
    assert!(evaluations[0] < 1.2 * evaluations[1], "{evaluations:?}");
}
