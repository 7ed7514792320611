//! What the command does between two rows is seen where it jumps: the valve answers one that is not held by the row that has the
//! jump. The record is made here, in steps of 20 us.

use crate::program::{json, printed, servobee};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs::write;

const GAIN: f64 = 180.0;
const TOLD: &str = "[structure]\nhold = \"interpolated\"\n";

/// Steps and sweeps in turn, each for two seconds.
fn command(time: f64) -> f64 {
    match (time / 2.0) as usize % 2 {
        0 => [5.0, -3.0, 0.0, 8.0, 1.0, -6.0, 0.0, 3.0][(time / 0.25) as usize % 8],
        _ => 3.0 * (TAU * time * (1.5 + 0.0375 * time)).sin() + 1.5 * (TAU * 5.3 * time).sin(),
    }
}

/// Normally distributed, with a standard deviation of 1.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random::<f64>() - 0.5).sum()
}

/// Rows of 2 ms of a valve with a play of ± 0.15 V, whose command goes straight from row to row.
fn record() -> String {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut text = String::from("time [s],command [V],spool [V]\n");
    let (mut integrator, mut spool, mut play) = (0.0f64, 0.0f64, 0.0f64);
    for row in 0..4000 {
        let time = 0.002 * f64::from(row);
        let (now, next) = (command(time), command(time + 0.002));
        let noise = 0.02 * normal(&mut random);
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

/// Rows of a spool whose speed is limited and that shows in a flow alone, which swings in its line at 17 Hz; the command goes
/// straight from row to row.
fn swinging_flow(rows: u32, interval: f64, noise: f64, limit: f64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut text = String::from("time [s],command [V],flow [L/min]\n");
    let (mut error, mut spool, mut flow, mut rise) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let pulsation = TAU * 17.0;
    let step = interval / 100.0;
    for row in 0..rows {
        let time = interval * f64::from(row);
        let (now, next) = (command(time), command(time + interval));
        let measured = flow + noise * normal(&mut random);
        writeln!(text, "{time:.5},{now:.5},{measured:.5}").unwrap();
        for part in 0..100 {
            let u = now + (next - now) * (f64::from(part) + 0.5) / 100.0;
            let speed = 340.0 * error.clamp(-limit, limit);
            error += step * (u - spool - error) / 0.00285;
            spool += step * speed;
            rise += step * pulsation * (1.74 * spool - flow - 0.56 * rise);
            flow += step * pulsation * rise;
        }
    }
    text
}

/// What is reported of a flow that swings behind a spool of limited speed, after that was found.
fn swing_and_limit_found(record: &str, effects: &str, more: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record).unwrap();
    write(folder.path().join("told.toml"), TOLD).unwrap();
    let call = ["identify", "log.csv", "--effects", effects];
    let out = ["--evaluator", "cpu", "--out", "out"];
    let printed = printed(&servobee(folder.path(), &[&call[..], &out, more].concat()));
    let report = json(folder.path().join("out/report.json"));
    assert_eq!(report["verdict"], "found", "{printed}");
    let effects = report["effects"].as_array().unwrap();
    let names = effects.iter().flat_map(|one| one["name"].as_str());
    let names: Vec<&str> = names.collect();
    assert_eq!(names, ["line_resonance", "slew_limit"], "{printed}");
    report
}

/// What the wrong one of held and interpolated makes of a valve may look like another effect, and then prefers the wrong one.
#[test]
fn what_is_not_followed_is_tried_with_the_other_of_held_and_interpolated() {
    let record = swinging_flow(2000, 0.003, 0.03, 1.5);
    let asked = "line_resonance,slew_limit~command,slew_limit~pilot,command_lag";
    let report = swing_and_limit_found(&record, asked, &[]);
    for hold in ["taken", "preferred"] {
        assert_eq!(report["hold"][hold], "interpolated");
    }
    let parameters = report["parameters"].as_array().unwrap();
    // In whatever form of the limit: its lag of 3 ms is a row.
    for (name, planted) in [("line_frequency_flow", 17.0), ("slew_limit", 510.0)] {
        let called = |one: &&Value| one["name"].as_str().unwrap().starts_with(name);
        let found = parameters.iter().find(called);
        let value = found.and_then(|one| one["value"].as_f64());
        let value = value.unwrap_or_else(|| panic!("no {name}: {parameters:?}"));
        assert!(
            (value / planted - 1.0).abs() < 0.03,
            "{name}: {value} {parameters:?}"
        );
    }
}

/// A delay explains nearly as much as the swing does, with fewer parameters, and beside it no second effect helps.
#[test]
fn where_the_first_cause_may_be_another_that_begins_as_well() {
    let record = swinging_flow(3200, 0.00125, 0.01, 1.2);
    let asked = "delay,line_resonance,slew_limit~pilot";
    swing_and_limit_found(&record, asked, &["--model", "told.toml"]);
}

#[test]
fn a_jump_that_is_answered_in_its_row_tells_that_the_command_is_not_held() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record()).unwrap();
    write(folder.path().join("told.toml"), TOLD).unwrap();
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

/// Rows of 2 ms of a spool that `advance` moves by a step, s, for the command at its middle, which goes on between the rows but for its
/// steps; these come with rows where the generator has this `pace` of 1.
fn generated(noise: f64, pace: f64, advance: impl FnMut(f64, f64) -> f64) -> String {
    going_on(0.002, noise, |time| command(pace * time), advance)
}

/// The same for any `command` and `interval` between rows.
pub(crate) fn going_on(
    interval: f64,
    noise: f64,
    command: impl Fn(f64) -> f64,
    mut advance: impl FnMut(f64, f64) -> f64,
) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut text = String::from("time [s],command [V],spool [V]\n");
    let mut spool = 0.0;
    for row in 0..4000 {
        let noise = noise * normal(&mut random);
        let time = interval * f64::from(row);
        writeln!(text, "{time:.4},{:.5},{:.5}", command(time), spool + noise).unwrap();
        for step in 0..100 {
            let middle = time + interval * (f64::from(step) + 0.5) / 100.0;
            spool = advance(command(middle), interval / 100.0);
        }
    }
    text
}

/// A valve whose loop saturates at this `limit` and is fed back nothing within a `clearance` of null.
pub(crate) fn valve(limit: f64, clearance: f64) -> impl FnMut(f64, f64) -> f64 {
    let (mut integrator, mut spool) = (0.0f64, 0.0f64);
    move |u, step| {
        let speed = (integrator - spool) / 0.0025;
        let fed_back = spool - spool.clamp(-clearance, clearance);
        integrator += step * GAIN * (u - fed_back).clamp(-limit, limit);
        spool += step * speed;
        spool
    }
}

/// What is found in a record where these `effects` are looked for.
pub(crate) fn asked(record: String, effects: &str) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), record).unwrap();
    let call = ["identify", "log.csv", "--effects", effects];
    let out = ["--evaluator", "cpu", "--out", "out"];
    let text = printed(&servobee(folder.path(), &[&call[..], &out].concat()));
    (json(folder.path().join("out/report.json")), text)
}

/// A generator's sweeps go on between the rows, and its steps are at rows: held, the sweeps come half a row late, and a valve that
/// lacks nothing seems to lack something.
#[test]
fn a_generator_goes_straight_between_its_jumps() {
    let text = generated(0.02, 1.0, valve(5.0, 0.0));
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), text).unwrap();
    let run = |more: &[&str]| {
        let call = ["identify", "log.csv", "--evaluator", "cpu", "--force"];
        let text = printed(&servobee(folder.path(), &[&call[..], more].concat()));
        let out = more[1];
        (json(folder.path().join(out).join("report.json")), text)
    };
    let (report, printed) = run(&["--out", "out"]);
    assert_eq!(report["verdict"], "none", "{printed}");
    for key in ["taken", "straight", "preferred"] {
        assert_eq!(report["hold"][key], "between_jumps", "{printed}");
    }
    let says =
        "The command is taken as interpolated but for its jumps between two rows: held leaves ";
    assert!(printed.contains(says), "{printed}");
    let gain = report["parameters"][0]["value"].as_f64().unwrap();
    assert!((gain / GAIN - 1.0).abs() < 0.01, "{gain}");
    // The model says so, and is taken back.
    let (again, _) = run(&["--out", "again", "--model", "out/model.toml"]);
    assert_eq!(again["hold"]["stated"], true);
    let error = |report: &Value| report["error"]["after"]["fit"]["spool"]["rmse"].as_f64();
    let [first, second] = [&report, &again].map(|one| error(one).unwrap());
    assert!((second / first - 1.0).abs() < 1e-6, "{first}, {second}");
}

/// A generator that does not wait for the logger jumps anywhere between two rows. Taken to jump with them, it moved a valve that lacks
/// nothing by up to a row too late.
#[test]
fn a_jump_between_two_rows_is_put_where_the_valve_answers_it() {
    let text = generated(0.02, 1.0137, valve(3.0, 0.0));
    let folder = tempfile::tempdir().unwrap();
    write(folder.path().join("log.csv"), text).unwrap();
    let run = |more: &[&str]| {
        let call = ["identify", "log.csv", "--evaluator", "cpu"];
        let text = printed(&servobee(folder.path(), &[&call[..], more].concat()));
        (json(folder.path().join(more[1]).join("report.json")), text)
    };
    let (report, printed) = run(&["--out", "out"]);
    assert_eq!(report["verdict"], "none", "{printed}");
    let warnings = report["warnings"].to_string();
    let said = "the command jumps between rows and not with them";
    assert!(warnings.contains(said), "{warnings}");
    for (number, (name, value)) in [
        ("gain", GAIN),
        ("time_constant", 0.0025),
        ("saturation", 3.0),
    ]
    .into_iter()
    .enumerate()
    {
        let own = &report["parameters"][number];
        let found = own["value"].as_f64().unwrap();
        assert!(
            own["name"] == name && (found / value - 1.0).abs() < 0.01,
            "{own}"
        );
    }
    // Neither the command nor a model that says what it does is another the next time.
    let (again, _) = run(&["--out", "again", "--model", "out/model.toml"]);
    let error = |report: &Value| {
        report["error"]["after"]["hold_out"]["spool"]["rmse"]
            .as_f64()
            .unwrap()
    };
    assert!((error(&again) / error(&report) - 1.0).abs() < 1e-3);
    // Who says that it is held is believed.
    write(
        folder.path().join("told.toml"),
        "[structure]\nhold = \"held\"\n",
    )
    .unwrap();
    let (told, _) = run(&["--out", "told", "--model", "told.toml", "--effects", "none"]);
    assert!(error(&told) > 1.1 * error(&report));
}

/// What the command does is what answers it that shows, whatever is missing behind that: here a flow that rings at two frequencies.
#[test]
fn a_spool_that_is_followed_tells_what_the_command_does() {
    let mut lines = generated(0.02, 1.0, valve(5.0, 0.0));
    let rings = [(17.0, 0.6), (44.0, 0.4)];
    let mut states = [[0.0f64; 2]; 2];
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut text = String::from("time [s],command [V],spool [V],flow [L/min]\n");
    for line in lines.split_off(lines.find('\n').unwrap() + 1).lines() {
        let spool: f64 = line.rsplit(',').next().unwrap().parse().unwrap();
        let pairs = states.iter_mut().zip(rings);
        let flow: f64 = pairs
            .map(|([value, rise], (hertz, share))| {
                for _ in 0..100 {
                    let pulsation = TAU * hertz;
                    let pull = pulsation * (spool - *value) - 0.3 * *rise;
                    *rise += 2e-5 * pulsation * pull;
                    *value += 2e-5 * *rise;
                }
                4.0 * share * *value
            })
            .sum();
        writeln!(text, "{line},{:.4}", flow + 0.1 * normal(&mut random)).unwrap();
    }
    let (report, printed) = asked(text, "delay,command_lag,feed_forward");
    assert_eq!(report["hold"]["taken"], "between_jumps", "{printed}");
    assert_eq!(report["located"]["place"], "behind_spool", "{printed}");
    let effects = report["effects"].as_array().unwrap();
    assert!(effects.is_empty(), "{printed}");
}

/// A converter holds what it was given, however fast that is: a curve only has to be better than that, too.
#[test]
fn a_fast_command_that_is_held_does_not_curve() {
    for (rise, noise) in [
        (19.0 / 16.0, 0.02),
        (29.0 / 16.0, 0.04),
        (44.0 / 16.0, 0.07),
    ] {
        let held = |time: f64| {
            let row = (time / 0.002 + 1e-6).floor() * 0.002;
            3.0 * (TAU * row * (1.0 + rise * row)).sin()
        };
        let mut valve = valve(5.0, 0.0);
        let text = going_on(0.002, noise, held, |u, step| valve(u + 0.3, step));
        let (report, printed) = asked(text, "null_bias,delay,command_lag");
        let effects = report["effects"].as_array().unwrap();
        assert_eq!(
            (effects.len(), &report["verdict"]),
            (1, &"found".into()),
            "{printed}"
        );
        assert_eq!(effects[0]["name"], "null_bias", "{printed}");
        assert_eq!(report["hold"]["taken"], "held", "{printed}");
    }
}

/// A generator's filter knows no rows. Straight from one to the next what is fast is less than it was, and a valve that lacks nothing seems
/// to make more of it.
#[test]
fn a_command_that_is_fast_for_its_rows_goes_on_in_a_curve() {
    let sines = [(2.3, 1.5), (11.0, 1.2), (29.0, 1.0), (47.0, 0.8)];
    let fast = |time: f64| {
        let sines = sines.iter();
        sines
            .map(|(hertz, volts)| volts * (TAU * hertz * time).sin())
            .sum()
    };
    let folder = tempfile::tempdir().unwrap();
    let record = going_on(0.002, 0.01, fast, valve(9.0, 0.0));
    write(folder.path().join("log.csv"), record).unwrap();
    let run = |more: &[&str]| {
        let call = ["identify", "log.csv", "--evaluator", "cpu"];
        let text = printed(&servobee(folder.path(), &[&call[..], more].concat()));
        (json(folder.path().join(more[1]).join("report.json")), text)
    };
    for more in [
        &["--out", "out"][..],
        &["--out", "again", "--model", "out/model.toml"],
    ] {
        let (report, printed) = run(more);
        assert_eq!(report["verdict"], "none", "{printed}");
        let warnings = report["warnings"].to_string();
        assert!(
            warnings.contains("it is taken to go on in a curve"),
            "{warnings}"
        );
        let gain = report["parameters"][0]["value"].as_f64().unwrap();
        assert!((gain / GAIN - 1.0).abs() < 0.01, "{gain}");
    }
    let rows = std::fs::read_to_string(folder.path().join("out/residual.csv")).unwrap();
    assert_eq!(rows.lines().count(), 4001);
}

/// Behind a generator's filter a row may see a jump half done, and the next one the rest.
#[test]
fn a_jump_that_a_row_sees_half_done_is_put_where_the_valve_answers_it() {
    let filtered = |time: f64| {
        let (step, since) = ((time / 0.2537) as usize, time % 0.2537);
        let value = |step: usize| [5.0, -3.0, 0.0, 8.0, 1.0, -6.0, 0.0, 3.0][step % 8];
        let before = step.checked_sub(1).map_or(0.0, value);
        value(step) + (before - value(step)) * (-since / 0.0005).exp()
    };
    let text = going_on(0.002, 0.02, filtered, valve(5.0, 0.0));
    let (report, printed) = asked(text, "all");
    assert_eq!(report["verdict"], "none", "{printed}");
    // The filter's lag is taken for the valve's.
    let gain = report["parameters"][0]["value"].as_f64().unwrap();
    assert!((gain / GAIN - 1.0).abs() < 0.02, "{gain}");
}

/// Pulses of a few rows, in held-out rows alone: each of their two jumps has its own place, and what the first does is still there at
/// the second.
#[test]
fn jumps_that_come_soon_after_each_other_are_put_where_the_valve_answers_them() {
    let pulses = |time: f64| match time {
        ..6.4 => command(1.0137 * time),
        _ if ((time - 6.4) / 0.0127) as usize % 6 < 1 => 4.0,
        _ => -4.0,
    };
    let (report, printed) = asked(going_on(0.002, 0.02, pulses, valve(3.0, 0.0)), "all");
    assert_eq!(report["verdict"], "none", "{printed}");
}

/// A lag takes up nearly all of what a converter would make of the command, and what has a name is followed nearly to the noise
/// with either: the fitted rows tell, and the values are those with the one that they prefer.
#[test]
fn what_has_a_name_is_tried_with_what_the_rows_prefer() {
    let smooth = |time: f64| 4.0 * (TAU * 0.9 * time).sin() + 2.0 * (TAU * 5.3 * time).sin();
    let text = going_on(0.0005, 0.01, smooth, valve(5.0, 0.2));
    let (report, printed) = asked(text, "dead_band,null_bias");
    let effect = &report["effects"][0];
    assert_eq!(
        [&effect["name"], &effect["form"]],
        ["dead_band", "feedback"],
        "{printed}"
    );
    assert_eq!(
        report["hold"]["taken"], report["hold"]["preferred"],
        "{printed}"
    );
    let gain = report["parameters"][0]["value"].as_f64().unwrap();
    assert!((gain / GAIN - 1.0).abs() < 0.01, "{printed}");
}

/// A slow triangle does not tell what the command does between its rows, and the loop's gain hangs on it: its interval covers both.
#[test]
fn an_interval_covers_what_the_command_may_do() {
    let triangle = |time: f64| 6.0 * (4.0 * ((0.8 * time).fract() - 0.5).abs() - 1.0);
    let text = going_on(0.001, 0.01, triangle, valve(5.0, 0.0));
    let (report, printed) = asked(text, "none");
    assert!(report["hold"]["preferred"].is_null(), "{printed}");
    let gain = &report["parameters"][0];
    let [value, low, high] = ["value", "low", "high"].map(|key| gain[key].as_f64().unwrap());
    // The one that leaves nothing but noise gives the value.
    assert!((value / GAIN - 1.0).abs() < 0.01, "{gain}");
    let other = &report["hold"]["moved"][0];
    assert_eq!(other["name"], "gain", "{printed}");
    let other = other["other"].as_f64().unwrap();
    assert!((other - GAIN).abs() > 5.0, "{printed}");
    let covered = low..=high;
    assert!(
        covered.contains(&value) && covered.contains(&other),
        "{gain}"
    );
}

/// A lead that the model lacks makes ramps of the jumps look right, which come as early: what the valve does in the row of a jump
/// tells that they are none.
#[test]
fn a_lead_does_not_hide_what_the_command_does() {
    // The spool is fed back through a lag: its closed loop has a zero.
    let (mut spool, mut fed_back) = (0.0f64, 0.0f64);
    let text = generated(0.03, 1.0, |u, step| {
        let error = u - fed_back;
        fed_back += step * (spool - fed_back) / 0.0042;
        spool += step * 60.0 * error.clamp(-5.0, 5.0);
        spool
    });
    let (report, printed) = asked(text, "feed_forward,dc_gain,delay,command_lag");
    assert_eq!(report["verdict"], "found", "{printed}");
    assert_eq!(report["effects"].as_array().unwrap().len(), 1, "{printed}");
    assert_eq!(report["effects"][0]["name"], "feed_forward");
    assert_eq!(report["hold"]["taken"], "between_jumps", "{printed}");
}
