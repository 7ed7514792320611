use super::*;
use crate::diagnose::statistics::simulated::{command, filtered, white};

fn look(channels: &[&[f64]], command: &[f64], spool: &[f64], seed: u64) -> Vec<Remaining> {
    let time: Vec<f64> = (0..command.len()).map(|k| k as f64 * 1e-3).collect();
    let residuals = Residuals {
        channels,
        starts: &[0],
        time: &time,
        command,
        known: &[("simulated spool", spool)],
    };
    remaining(&residuals, seed)
}

/// Noise that a first-order filter with this corner colours, of variance 1; white without one.
fn noise(count: usize, corner: Option<f64>, seed: u64) -> Vec<f64> {
    match corner {
        None => white(count, seed),
        Some(corner) => filtered(&white(count, seed), corner),
    }
}

fn alarms(
    count: usize,
    channels: usize,
    corner: Option<f64>,
    seeds: std::ops::Range<u64>,
) -> usize {
    let command = command(count);
    let spool = filtered(&command, 30.0);
    seeds
        .into_par_iter()
        .filter(|&seed| {
            let noises: Vec<Vec<f64>> = (0..channels as u64)
                .map(|channel| noise(count, corner, seed + 10_000 * channel))
                .collect();
            let channels: Vec<&[f64]> = noises.iter().map(Vec::as_slice).collect();
            let found = look(&channels, &command, &spool, seed);
            for found in found.iter().filter(|found| found.structured) {
                println!("{count} {corner:?} seed {seed}: {found:?}");
            }
            found.iter().any(|found| found.structured)
        })
        .count()
}

#[test]
fn noise_seldom_looks_structured() {
    for (count, channels, corner, records, most) in [
        (3500, 2, Some(20.0), 100, 2),
        (3500, 2, Some(200.0), 50, 1),
        (3500, 2, None, 50, 1),
    ] {
        let alarms = alarms(count, channels, corner, 0..records);
        assert!(alarms <= most, "{corner:?}: {alarms} of {records}");
    }
}

#[test]
#[ignore = "takes minutes"]
fn noise_looks_structured_in_at_most_two_records_of_a_hundred() {
    for count in [3500, 7000] {
        for channels in [1, 2] {
            for corner in [None, Some(20.0), Some(60.0), Some(200.0)] {
                let alarms = alarms(count, channels, corner, 0..300);
                println!("{count} rows, {channels} channels, {corner:?}: {alarms} of 300");
                assert!(alarms <= 6, "{count} {channels} {corner:?}: {alarms}");
            }
        }
    }
}

/// Structure, what may name it, and its shape, before scaling.
fn structures(count: usize, seed: u64) -> Vec<(&'static str, &'static [&'static str], Vec<f64>)> {
    let u = command(count);
    let x = filtered(&u, 30.0);
    let each = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..count).map(f).collect() };
    let rate = each(&|k| x[k] - x[k.saturating_sub(1)]);
    let mut play = u[0];
    let play: Vec<f64> = u
        .iter()
        .map(|&u| {
            play = play.clamp(u - 0.3, u + 0.3);
            play - u
        })
        .collect();
    let converter = |step: f64| each(&|k| (u[k] / step).round() * step - u[k]);
    let extra = white(count, seed + 77);
    let dropout = |k: usize| {
        [0.13, 0.31, 0.52, 0.69, 0.88]
            .iter()
            .any(|at| (k as f64 - at * count as f64).abs() < 15.0)
    };
    vec![
        ("delay", &["command rate"], rate.clone()),
        (
            "curvature",
            &["command^3", "simulated spool"],
            each(&|k| x[k] * x[k].abs()),
        ),
        (
            "asymmetry",
            &["|command|", "a constant"],
            each(&|k| x[k].abs()),
        ),
        (
            "hysteresis",
            &["command direction", "command and its direction"],
            filtered(&play, 30.0),
        ),
        (
            "overlap",
            &["simulated spool"],
            each(&|k| x[k].clamp(-0.4, 0.4)),
        ),
        (
            "stroke limit",
            &["command^3", "simulated spool"],
            each(&|k| (x[k].abs() - 7.0).max(0.0) * x[k].signum()),
        ),
        ("drift", &["time"], each(&|k| k as f64 / count as f64 - 0.5)),
        (
            "offset jump",
            &["time"],
            each(&|k| if 2 * k > count { 0.5 } else { -0.5 }),
        ),
        (
            "gain jump",
            &["command", "simulated spool"],
            each(&|k| if 2 * k > count { x[k] } else { -x[k] }),
        ),
        ("constant", &["a constant"], vec![1.0; count]),
        (
            "converter 0.6 V",
            &["command"],
            filtered(&converter(0.6), 30.0),
        ),
        (
            "converter 0.15 V",
            &["command"],
            filtered(&converter(0.15), 30.0),
        ),
        (
            "line",
            &["a line at 36.8"],
            each(&|k| (k as f64 * 0.2312).sin()),
        ),
        (
            "slow wave",
            &["time", "a line at 0.5"],
            each(&|k| (k as f64 * 0.00331).sin()),
        ),
        (
            "dropouts",
            &["size in bursts"],
            each(&|k| if dropout(k) { extra[k / 30] } else { 0.0 }),
        ),
        (
            "dropouts, loud",
            &["size in bursts"],
            each(&|k| if dropout(k) { extra[k] } else { 0.0 }),
        ),
        (
            "louder when large",
            &["size with |command|"],
            each(&|k| x[k] * extra[k]),
        ),
        (
            "louder when fast",
            &["size with |command rate|"],
            each(&|k| rate[k] * extra[k]),
        ),
    ]
}

/// What is found of a shape with this RMS under noise of variance 1.
fn found(shape: &[f64], rms: f64, corner: Option<f64>, seed: u64) -> Remaining {
    let count = shape.len();
    let size = (shape.iter().map(|v| v * v).sum::<f64>() / count as f64).sqrt();
    let noise = noise(count, corner, seed);
    let rows = noise.iter().zip(shape);
    let residual: Vec<f64> = rows.map(|(n, s)| n + rms * s / size).collect();
    let command = command(count);
    look(&[&residual], &command, &filtered(&command, 30.0), seed).remove(0)
}

#[test]
fn structure_of_half_the_noise_is_found_and_named() {
    for corner in [None, Some(20.0)] {
        for seed in 0..3 {
            for (what, names, shape) in structures(3500, seed) {
                // A sensor that holds for as long as the noise remembers looks like the noise.
                if what == "dropouts" && corner.is_some() {
                    continue;
                }
                let result = found(&shape, 0.5, corner, seed);
                let named = |(name, _): &(String, f64)| names.iter().any(|n| name.starts_with(n));
                assert!(
                    result.correlates_with.iter().any(named),
                    "{what}, {corner:?}, seed {seed}: {result:?}"
                );
                assert!(result.structured && result.p_value < LEVEL);
            }
        }
    }
}

#[test]
fn the_step_of_a_coarse_converter_is_found() {
    let count = 4000;
    let phase = |k: usize| 0.3 + 3e-3 * k as f64 + 1e-6 * (k * k) as f64;
    let command: Vec<f64> = (0..count).map(|k| 9.0 * phase(k).sin()).collect();
    let spool = filtered(&command, 30.0);
    for step in [0.6, 0.15, 0.08] {
        let converted: Vec<f64> = command
            .iter()
            .map(|u| (u / step).round() * step - u)
            .collect();
        let missed = filtered(&converted, 30.0);
        let size = (missed.iter().map(|v| v * v).sum::<f64>() / count as f64).sqrt();
        let noise = noise(count, Some(20.0), 3);
        let rows = noise.iter().zip(&missed);
        let residual: Vec<f64> = rows.map(|(n, m)| n + 0.5 * m / size).collect();
        let result = look(&[&residual], &command, &spool, 1).remove(0);
        let name = format!("command in steps of {step:.3}");
        let names = || result.correlates_with.iter().map(|(name, _)| name);
        assert!(names().any(|found| *found == name), "{result:?}");
    }
}

#[test]
fn an_immaterial_dependence_is_not_structure() {
    let command = command(7000);
    let result = found(&command, 0.07, None, 1);
    assert!(result.p_value < LEVEL && !result.structured, "{result:?}");
}

#[test]
fn a_second_record_does_not_disturb_the_first() {
    let half = command(2000);
    let command = [&half[..], &half[..]].concat();
    let time: Vec<f64> = (0..4000).map(|k| (k % 2000) as f64 * 1e-3).collect();
    let noise = white(4000, 5);
    let drift: Vec<f64> = (0..4000)
        .map(|k| noise[k] + 2.0 * (time[k] - 1.0))
        .collect();
    let shifted: Vec<f64> = (0..4000)
        .map(|k| noise[k] + if k < 2000 { 0.5 } else { -0.5 })
        .collect();
    let residuals = Residuals {
        channels: &[&noise, &drift, &shifted],
        starts: &[0, 2000],
        time: &time,
        command: &command,
        known: &[],
    };
    let found = remaining(&residuals, 1);
    assert!(!found[0].structured, "{:?}", found[0]);
    assert_eq!(found[1].correlates_with[0].0, "time", "{:?}", found[1]);
    let names: Vec<&str> = found[2]
        .correlates_with
        .iter()
        .map(|(name, _)| &name[..])
        .collect();
    assert!(names.contains(&"record"), "{:?}", found[2]);
}

#[test]
fn a_residual_that_is_nothing_or_constant_is_no_noise_to_divide_by() {
    let command = command(1000);
    let found = look(&[&[0.0; 1000], &[0.1; 1000]], &command, &command, 1);
    assert_eq!(found[0], Remaining::nothing());
    assert_eq!(found[1].correlates_with[0].0, "a constant");
    assert!(found[1].structured);
    let few = look(&[&[0.1; 20]], &command[..20], &command[..20], 1);
    assert_eq!(few[0], Remaining::nothing());
}
