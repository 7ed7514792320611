use super::NoiseMethod::{
    Differences, QuietStretches, RepeatedCommand, Resolution as OfResolution,
};
use super::moments::mean_square;
use super::quiet::typical_variance;
use super::*;
use crate::diagnose::statistics::simulated::{command, filtered, white};
use std::f64::consts::TAU;

/// The floor of rows 1 ms apart.
fn floor(starts: &[usize], command: &[f64], measured: &[f64], residual: &[f64]) -> Noise {
    let time: Vec<f64> = (0..command.len()).map(|k| k as f64 * 1e-3).collect();
    let rows = NoiseRows {
        starts,
        time: &time,
        command,
        measured,
        residual,
        beside: &[],
    };
    noise_floor(rows, measured)
}

/// Largest and mean relative error of the noise floor over seeds.
fn errors(
    command: &[f64],
    corner: Option<f64>,
    method: NoiseMethod,
    structure: impl Fn(usize) -> f64,
) -> (f64, f64) {
    let response = filtered(command, 20.0);
    let errors: Vec<f64> = (0..40)
        .map(|seed| {
            let white = white(command.len(), seed);
            let noise = corner.map_or(white.clone(), |corner| filtered(&white, corner));
            let rows = 0..command.len();
            let measured = rows
                .clone()
                .map(|k| response[k] + 0.03 * noise[k] + 1e-5 * k as f64);
            let residual: Vec<f64> = rows.map(|k| 0.03 * noise[k] + structure(k)).collect();
            let found = floor(&[0], command, &measured.collect::<Vec<_>>(), &residual);
            assert_eq!(found.method, method);
            found.value / 0.03 - 1.0
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let square = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64;
    println!(
        "{method:?} {} rows {corner:?}: mean {:+.1} %, deviation {:.1} %",
        command.len(),
        100.0 * mean,
        100.0 * square.sqrt()
    );
    (mean, square.sqrt())
}

/// A model that is wrong by a fifth of the signal.
fn wrong(command: &[f64]) -> impl Fn(usize) -> f64 {
    let response = filtered(command, 20.0);
    move |k| 0.2 * response[k]
}

#[test]
fn the_middle_rest_counts_by_its_rows() {
    let rest = |size: f64, rows: usize, seed: u64| -> Vec<f64> {
        white(rows, seed).iter().map(|e| size * e).collect()
    };
    for (rows, expected) in [
        ([2000, 300, 300], 1.0),
        ([300, 2000, 300], 4.0),
        ([300, 300, 2000], 9.0),
        ([700, 600, 700], 4.0),
    ] {
        let [a, b, c] = rows;
        let quiet = [rest(3.0, c, 1), rest(1.0, a, 2), rest(2.0, b, 3)];
        let found = typical_variance(&quiet);
        assert!((found / expected - 1.0).abs() < 0.2, "{rows:?}: {found}");
    }
    assert_eq!(typical_variance(&[]), 0.0);
}

#[test]
fn quiet_stretches_show_the_noise() {
    for count in [3500, 6998] {
        let command = command(count);
        let (mean, deviation) = errors(&command, None, QuietStretches, wrong(&command));
        assert!(mean.abs() < 0.05 && deviation < 0.05);
        let (mean, deviation) = errors(&command, Some(20.0), QuietStretches, wrong(&command));
        assert!(mean.abs() < 0.10 && deviation < 0.15);
    }
}

#[test]
fn a_rest_of_a_quarter_second_counts() {
    let mut command: Vec<f64> = (0..6000).map(|k| 8.0 * (k as f64 * 0.0123).sin()).collect();
    for start in [900, 2700, 4500] {
        let level = command[start];
        command[start..start + 250].fill(level);
    }
    let (mean, deviation) = errors(&command, None, QuietStretches, wrong(&command));
    assert!(mean.abs() < 0.05 && deviation < 0.06);
}

#[test]
fn a_slow_ramp_is_no_rest() {
    let ramp: Vec<f64> = (0..8000)
        .map(|k| (k as f64 * 1e-3).min(16.0 - k as f64 * 1e-3))
        .collect();
    errors(&ramp, None, Differences, |_| 0.0);
}

#[test]
fn two_records_of_one_command_are_repeats() {
    let once = |k: usize| 6.0 * (k as f64 * 0.011).sin() + (k as f64 * 0.037).sin();
    let command: Vec<f64> = (0..4000).map(|k| once(k % 2000)).collect();
    let noise = white(4000, 1);
    let response = filtered(&command[..2000], 20.0);
    let measured: Vec<f64> = (0..4000)
        .map(|k| response[k % 2000] + 0.03 * noise[k])
        .collect();
    let residual: Vec<f64> = (0..4000)
        .map(|k| 0.2 * response[k % 2000] + 0.03 * noise[k])
        .collect();
    let found = floor(&[0, 2000], &command, &measured, &residual);
    assert_eq!(found.method, RepeatedCommand);
    assert!((found.value / 0.03 - 1.0).abs() < 0.05, "{}", found.value);
}

#[test]
fn what_another_input_does_between_repeats_is_no_noise_where_the_model_follows_it() {
    let once = |k: usize| 6.0 * (k as f64 * 0.011).sin() + (k as f64 * 0.037).sin();
    let command: Vec<f64> = (0..4000).map(|k| once(k % 2000)).collect();
    let (noise, response) = (white(4000, 1), filtered(&command[..2000], 20.0));
    // A supply that wanders drives another flow in each repeat.
    let drive = |k: usize| 1.0 + 0.1 * (k as f64 * 0.0031).sin();
    let rows = 0..4000;
    let measured = rows
        .clone()
        .map(|k| drive(k) * response[k % 2000] + 0.03 * noise[k]);
    let measured: Vec<f64> = measured.collect();
    let residual: Vec<f64> = rows.map(|k| 0.03 * noise[k]).collect();
    let found = floor(&[0, 2000], &command, &measured, &residual);
    assert_eq!(found.method, RepeatedCommand);
    assert!((found.value / 0.03 - 1.0).abs() < 0.05, "{}", found.value);
}

#[test]
fn repeats_show_the_noise_whatever_the_model_misses() {
    let period = |k: usize| 6.0 * ((k % 1500) as f64 / 1500.0 * std::f64::consts::TAU).sin();
    let command: Vec<f64> = (0..500).map(|_| 0.0).chain((0..4500).map(period)).collect();
    let missed = wrong(&command);
    let (mean, deviation) = errors(&command, None, RepeatedCommand, &missed);
    assert!(mean.abs() < 0.05 && deviation < 0.05);
    let (mean, deviation) = errors(&command, Some(20.0), RepeatedCommand, &missed);
    assert!(mean.abs() < 0.15 && deviation < 0.15);
}

#[test]
fn without_quiet_the_differences_of_the_residual_show_it() {
    let command: Vec<f64> = (0..8000)
        .map(|k| (1e-6 * (k * k) as f64).sin() * 9.0)
        .collect();
    let slow = |k: usize| 0.1 * (k as f64 * 0.02).sin();
    let (mean, deviation) = errors(&command, None, Differences, slow);
    assert!(mean.abs() < 0.05 && deviation < 0.05);
    let (mean, deviation) = errors(&command, Some(20.0), Differences, slow);
    assert!(mean.abs() < 0.25 && deviation < 0.25);
}

/// `values`, each rounded to a multiple of its `step`.
fn rounded(values: &[f64], step: impl Fn(f64) -> f64) -> Vec<f64> {
    let round = |value: &f64| step(*value) * (value / step(*value)).round();
    values.iter().map(round).collect()
}

fn rms_between(values: &[f64], others: &[f64]) -> f64 {
    let both = values.iter().zip(others);
    mean_square(&both.map(|(a, b)| a - b).collect::<Vec<f64>>()).sqrt()
}

fn minus(values: &[f64], others: &[f64]) -> Vec<f64> {
    values.iter().zip(others).map(|(a, b)| a - b).collect()
}

/// A sine that never rests nor comes again in the same rows.
fn sine(count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| 9.0 * (k as f64 * 0.0031).sin())
        .collect()
}

#[test]
fn the_noise_of_a_rounded_sine_is_its_step_over_the_root_of_twelve() {
    let signal = sine(20_000);
    for step in [0.01, 0.1, 0.379] {
        let measured = rounded(&signal, |_| step);
        let found = floor(&[0], &signal, &measured, &minus(&measured, &signal));
        assert_eq!(found.method, OfResolution, "{step}: {:?}", found.sources);
        let expected = step / 12f64.sqrt();
        assert!((found.resolution() / expected - 1.0).abs() < 1e-6, "{step}");
        assert!(
            (found.value / expected - 1.0).abs() < 0.05,
            "{step}: {}",
            found.value
        );
        assert!(
            found
                .beyond(minus(&measured, &signal))
                .iter()
                .all(|left| left.abs() < 1e-9)
        );
    }
}

#[test]
fn a_step_written_with_few_digits_is_found() {
    let signal = sine(20_000);
    let measured = rounded(&rounded(&signal, |_| 0.00305), |_| 0.0005);
    let resolution = Resolution::new(&[0], &signal, &measured, &[0.0; 20_000]);
    let found = resolution.deviation();
    assert!(
        (found / (0.00305 / 12f64.sqrt()) - 1.0).abs() < 0.05,
        "{found}"
    );
}

#[test]
fn noise_above_the_step_stays_what_it_is() {
    let command = command(6998);
    let response = filtered(&command, 20.0);
    let noise = white(6998, 5);
    let rough: Vec<f64> = response
        .iter()
        .zip(&noise)
        .map(|(x, e)| x + 0.03 * e)
        .collect();
    let measured = rounded(&rough, |_| 0.02);
    let found = floor(&[0], &command, &measured, &minus(&measured, &response));
    assert_eq!(found.method, QuietStretches);
    assert!((found.value / 0.03 - 1.0).abs() < 0.1, "{}", found.value);
    assert!((found.resolution() / (0.02 / 12f64.sqrt()) - 1.0).abs() < 1e-6);
}

#[test]
fn where_only_a_zone_is_coarse_its_rows_count_as_coarse() {
    let signal = sine(20_000);
    let step = |value: f64| if value.abs() < 3.0 { 0.03 } else { 0.3 };
    let measured = rounded(&signal, step);
    let found = floor(&[0], &signal, &measured, &minus(&measured, &signal));
    let truth = rms_between(&measured, &signal);
    assert_eq!(found.method, OfResolution, "{truth} {:?}", found.sources);
    assert!(
        (found.value / truth - 1.0).abs() < 0.03,
        "{} {truth}",
        found.value
    );
}

#[test]
fn what_is_not_rounded_has_no_step() {
    let noise = white(6000, 3);
    let ramp: Vec<f64> = (0..6000).map(|k| k as f64 * 1e-3).collect();
    let rough: Vec<f64> = ramp.iter().zip(&noise).map(|(x, e)| x + 1e-3 * e).collect();
    for measured in [&ramp, &rough, &noise] {
        let resolution = Resolution::new(&[0], &ramp, measured, &ramp);
        assert_eq!((resolution.held, resolution.deviation()), (1, 0.0));
    }
}

#[test]
fn of_a_held_reading_the_differences_count_each_once() {
    let command: Vec<f64> = (0..40_000)
        .map(|k| 2.0 * (k as f64 * 1e-4).sin() + (k as f64 * 1.7e-4).cos())
        .collect();
    let noise = white(40_000, 9);
    let measured: Vec<f64> = (0..40_000)
        .map(|k| command[k / 20 * 20] + 0.1 * noise[k / 20])
        .collect();
    let found = floor(&[0], &command, &measured, &minus(&measured, &command));
    let fast = found.sources.iter().find(|one| one.method == Differences);
    assert!((fast.unwrap().value / 0.1 - 1.0).abs() < 0.1, "{fast:?}");
    // Where it moves fast, what it moves while a reading is held is more than that.
    let fast: Vec<f64> = command.iter().map(|u| 200.0 * u).collect();
    let measured: Vec<f64> = (0..40_000)
        .map(|k| fast[k / 20 * 20] + 0.1 * noise[k / 20])
        .collect();
    let residual = minus(&measured, &fast);
    let found = floor(&[0], &fast, &measured, &residual);
    // The mean of the delay is a delay; what is left about it is the reading's.
    let late: Vec<f64> = (0..40_000usize)
        .map(|k| fast[k.saturating_sub(10)])
        .collect();
    let truth = rms_between(&measured, &late);
    assert_eq!(found.method, OfResolution);
    assert!(
        (found.value / truth - 1.0).abs() < 0.1,
        "{} {truth}",
        found.value
    );
}

#[test]
fn one_value_that_is_held_through_a_rest_says_nothing() {
    let mut signal = sine(8000);
    for start in [1000, 4000, 6500] {
        let level = signal[start];
        signal[start..start + 400].fill(level);
    }
    let measured = rounded(&signal, |_| 0.1);
    let found = floor(&[0], &signal, &measured, &minus(&measured, &signal));
    assert_eq!(found.method, OfResolution);
    assert!(
        (found.value / (0.1 / 12f64.sqrt()) - 1.0).abs() < 1e-6,
        "{}",
        found.value
    );
    assert!(
        found.sources.iter().all(|one| one.value > 1e-3),
        "{:?}",
        found.sources
    );
}

#[test]
fn rounded_times_cost_what_the_signal_moves_in_them() {
    let signal = sine(20_000);
    let noise = white(20_000, 4);
    let measured: Vec<f64> = signal
        .iter()
        .zip(&noise)
        .map(|(x, e)| x + 1e-5 * e)
        .collect();
    let times = [1e-3, 0.25e-3].map(|step| -> Vec<f64> {
        let exact = (0..20_000).map(|k| k as f64 / 300.0);
        exact.map(|t| step * (t / step).round()).collect()
    });
    for (time, step) in times.iter().zip([1e-3, 0.25e-3]) {
        let rows = NoiseRows {
            starts: &[0],
            time,
            command: &signal,
            measured: &measured,
            residual: &minus(&measured, &signal),
            beside: &[],
        };
        let found = noise_floor(rows, &measured);
        let slope = 9.0 * 0.0031 * 300.0 / 2f64.sqrt();
        assert_eq!(found.method, OfResolution, "{:?}", found.sources);
        assert!(
            (found.value / (slope * step / 12f64.sqrt()) - 1.0).abs() < 0.05,
            "{}",
            found.value
        );
    }
}

#[test]
fn a_drift_at_rest_is_no_noise() {
    // It creeps, turns and creeps back while the command rests: 0.5 mm in 10 s.
    let command: Vec<f64> = (0..14_000)
        .map(|k| {
            if k < 10_000 {
                1.0
            } else {
                (k as f64 * 0.01).sin()
            }
        })
        .collect();
    let noise = white(14_000, 6);
    let creep = |k: usize| 0.25 * (k as f64 * 6e-4).cos();
    let measured: Vec<f64> = (0..14_000)
        .map(|k| command[k] + creep(k) + 0.0065 * noise[k])
        .collect();
    let found = floor(&[0], &command, &measured, &minus(&measured, &command));
    assert_eq!(found.method, QuietStretches);
    assert!((found.value / 0.0065 - 1.0).abs() < 0.15, "{}", found.value);
}

#[test]
fn sources_that_differ_by_more_than_they_can_are_told() {
    let once = |k: usize| match k % 2000 {
        k if k < 600 => 0.0,
        k => 6.0 * ((k - 600) as f64 * TAU / 1400.0).sin(),
    };
    let command: Vec<f64> = (0..8000).map(once).collect();
    let noise = white(8000, 2);
    for (moving, agree) in [(0.03, true), (0.09, false)] {
        let error = |k: usize| noise[k] * if command[k] == 0.0 { 0.03 } else { moving };
        let residual: Vec<f64> = (0..8000).map(error).collect();
        let measured: Vec<f64> = command.iter().zip(&residual).map(|(u, e)| u + e).collect();
        let found = floor(&[0], &command, &measured, &residual);
        assert_eq!(found.method, RepeatedCommand);
        assert_eq!(found.sources.len(), 3, "{:?}", found.sources);
        let pair = found.disagreement(false);
        assert_eq!(pair.is_none(), agree, "{:?}", found.sources);
        if let Some(pair) = pair {
            assert!(
                pair.iter().any(|one| one.method == QuietStretches),
                "{pair:?}"
            );
        }
    }
}

#[test]
fn a_slow_movement_is_no_noise_of_the_residual() {
    let command: Vec<f64> = (0..8000)
        .map(|k| (1e-6 * (k * k) as f64).sin() * 9.0)
        .collect();
    let noise = white(8000, 8);
    let residual: Vec<f64> = (0..8000)
        .map(|k| 5.0 * (k as f64 * 0.004).sin() + 0.0065 * noise[k])
        .collect();
    let found = floor(&[0], &command, &command, &residual);
    assert_eq!(found.method, Differences);
    assert!((found.value / 0.0065 - 1.0).abs() < 0.25, "{}", found.value);
}

/// What a loop makes of a missing effect moves by as much from row to row as the noise does.
#[test]
fn a_movement_that_hides_the_noise_in_first_differences_is_no_noise() {
    let command: Vec<f64> = (0..8000)
        .map(|k| (1e-6 * (k * k) as f64).sin() * 9.0)
        .collect();
    let turning = |k: usize| (TAU * 0.02 * k as f64).sin();
    for amplitude in [0.1, 0.2, 0.5] {
        let (mean, deviation) = errors(&command, None, Differences, |k| amplitude * turning(k));
        assert!(mean.abs() < 0.1 && deviation < 0.1, "{amplitude}");
    }
    // What rings after each step of a bench is over before the next, but in every long block.
    let ringing = |k: usize| {
        let after = (k % 1000) as f64;
        0.5 * (-after / 20.0).exp() * (TAU * 0.15 * after).sin()
    };
    let (mean, deviation) = errors(&command, None, Differences, ringing);
    assert!(mean.abs() < 0.1 && deviation < 0.1);
    // A filter's noise is not taken for such a movement.
    for corner in [20.0, 30.0, 100.0] {
        let (mean, deviation) = errors(&command, Some(corner), Differences, |_| 0.0);
        assert!(mean.abs() < 0.15 && deviation < 0.25, "{corner}");
    }
}

#[test]
fn a_held_reading_that_rests_too_shortly_for_its_readings_shows_its_noise_in_the_rows() {
    let command = command(8000);
    let response = filtered(&command, 20.0);
    let noise = white(8000, 12);
    let measured: Vec<f64> = (0..8000)
        .map(|k| response[k / 20 * 20] + 0.1 * noise[k / 20])
        .collect();
    let found = floor(&[0], &command, &measured, &minus(&measured, &response));
    let resting = found
        .sources
        .iter()
        .find(|one| one.method != Differences)
        .unwrap();
    assert_ne!(resting.method, OfResolution, "{:?}", found.sources);
    let time: Vec<f64> = (0..8000).map(|k| k as f64 * 1e-3).collect();
    let moving = Resolution::new(&[0], &time, &measured, &response).moving();
    let own = (resting.value.powi(2) - moving.powi(2)).sqrt();
    assert!(
        (own / 0.1 - 1.0).abs() < 0.35,
        "{own} of {:?}",
        found.sources
    );
}

/// A loop that hunts: where its command rests it goes on swinging, and that is no noise.
#[test]
fn what_swings_at_rest_is_no_noise() {
    let command: Vec<f64> = (0..8000)
        .map(|k| ((k / 400) as f64 * 1.7).sin() * 5.0)
        .collect();
    let noise = white(8000, 5);
    let swinging = |size: f64| -> Vec<f64> {
        let value = |k: usize| {
            let angle = TAU * 19.3 * k as f64 * 1e-3;
            command[k] + size * (angle.sin() + 0.2 * (3.0 * angle).sin()) + 0.01 * noise[k]
        };
        (0..8000).map(value).collect()
    };
    let residual = |measured: &[f64]| -> Vec<f64> {
        measured.iter().zip(&command).map(|(y, u)| y - u).collect()
    };
    let measured = swinging(2.0);
    let found = floor(&[0], &command, &measured, &residual(&measured));
    let swing = found.swing.expect("a swing");
    assert!((swing.frequency - 19.3).abs() < 0.5, "{swing:?}");
    assert!((swing.deviation / 1.44 - 1.0).abs() < 0.05, "{swing:?}");
    assert!(
        found.method == Differences && found.value < 0.1,
        "{found:?}"
    );
    // As much as a hum that the catalogue names, and nothing at all.
    for size in [0.03, 0.0] {
        let measured = swinging(size);
        let found = floor(&[0], &command, &measured, &residual(&measured));
        assert_eq!((found.swing, found.method), (None, QuietStretches));
    }
}

/// A spool that slips now and then where its command rests, and its flow with it: no noise. What one of them alone shows, such as
/// noise that a filter coloured, is; and both settle after a step without being noisier for it.
#[test]
fn what_two_channels_show_at_rest_is_a_motion() {
    let command: Vec<f64> = (0..8000)
        .map(|k| ((k / 400) as f64 * 1.7).sin() * 5.0)
        .collect();
    let slips = filtered(&white(8000, 3), 2.0);
    let channel = |slips: &[f64], seed: u64| -> Vec<f64> {
        let noise = white(8000, seed);
        (0..8000)
            .map(|k| command[k] + 0.2 * slips[k] + 0.02 * noise[k])
            .collect()
    };
    let spool = channel(&slips, 5);
    let time: Vec<f64> = (0..8000).map(|k| k as f64 * 1e-3).collect();
    let floor_of = |one: &[f64], other: &[f64]| {
        let rows = NoiseRows {
            starts: &[0],
            time: &time,
            command: &command,
            measured: one,
            residual: &minus(one, &command),
            beside: &[minus(other, &command)],
        };
        noise_floor(rows, one)
    };
    let floor = |other: &[f64]| floor_of(&spool, other);
    let moving = floor(&channel(&slips, 6));
    assert_eq!(moving.method, Differences, "{moving:?}");
    let settles: Vec<f64> = (0..8000)
        .map(|k| command[k] + 3.0 * (-((k % 400) as f64) / 25.0).exp())
        .collect();
    let settled = |seed| -> Vec<f64> {
        let noise = white(8000, seed);
        (0..8000).map(|k| settles[k] + 0.02 * noise[k]).collect()
    };
    let quiet = floor_of(&settled(5), &settled(6));
    assert_eq!(quiet.method, QuietStretches, "{quiet:?}");
    let coloured = floor(&channel(&filtered(&white(8000, 4), 2.0), 6));
    assert_eq!(coloured.method, QuietStretches, "{coloured:?}");
    assert!(
        moving.value < 0.5 * coloured.value,
        "{moving:?} {coloured:?}"
    );
}
