//! Commands that curve between two rows: a generator's filter knows no rows. Straight from one to the next, what is fast is less than it
//! was, and the valve seems to make more of it. Half-way between two rows a sample is put, on a curve, that counts for nothing.

use super::between_rows::{polished, simulated};
use super::evidence::set_start;
use super::fitted::Fitted;
use super::hold::{other_hold, other_way, residuals, squares};
use super::input_noise::root_mean_square;
use super::measurements::starts;
use super::preference::{plainly_differ, surely_differ};
use super::problem::IdentificationProblem;
use super::simulation::Compared;
use super::statistics::compare::Comparison;
use super::verdict::NEAR;
use crate::evaluate::Problem;
use crate::evaluate::problem::{Sample, Series};
use crate::model::{Input, Outputs};
use crate::search::Plan;

/// A curve counts if it moves a channel by this share of its noise, root mean square.
const COUNTS: f64 = 0.1;
/// Rows are next to each other if the time between two is no more than so many times that between others beside them.
const GAP: f64 = 1.5;

/// `problem` whose commands curve between their rows, where `fitted` then follows its rows better than with commands that go straight on,
/// and nearly to the noise; otherwise `None`.
pub(super) fn with_curves(
    problem: &IdentificationProblem,
    fitted: &Fitted,
    plan: &Plan,
) -> Option<IdentificationProblem> {
    let measurements = &problem.measurements;
    let known = &measurements.placed_jumps;
    if known.curved || known.times > 0 {
        return None;
    }
    let mut taken = fitted.problem.clone();
    set_start(&mut taken, fitted.fit.values());
    let mut model = match taken.structure.hold.is_straight() {
        true => taken.clone(),
        false if problem.hold_known => return None,
        false => other_way(fitted, other_hold(fitted, plan), plan)?,
    };
    let noise = fitted.noise(measurements, false);
    for model in [&mut taken, &mut model] {
        model.scale = Outputs::default();
        for &output in &model.structure.observed {
            model.scale[output] = noise[output.name()].value.powi(-2);
        }
    }
    let rate = model.structure.fastest_rate(&model.parameters);
    let curved = |records: &[Series]| -> Vec<Series> {
        let all = records.iter();
        all.map(|series| with_samples_between(series, rate))
            .collect()
    };
    let rows = curved(&measurements.fit);
    if !counts(&model, &measurements.fit, &rows) {
        return None;
    }
    let residuals = |model: &Problem, records: &[Series]| {
        let model = polished(model.clone(), records.to_vec(), plan)?;
        let simulated = simulated(&model, records);
        Some(residuals(&model, &Compared::all(records, &simulated)))
    };
    let others = residuals(&model, &rows)?;
    // What was taken may be that it is held.
    let held = (taken.structure.hold != model.structure.hold).then_some(&taken);
    let rivals = [Some(&model), held].into_iter().flatten();
    let rivals = rivals.filter_map(|model| residuals(model, &measurements.fit));
    let own = rivals.min_by(|a, b| squares(a).total_cmp(&squares(b)))?;
    let mut channels = others.iter();
    let followed = channels.all(|channel| root_mean_square(channel) < NEAR);
    let comparison = Comparison::new(&others, &own, &vec![1.0; own.len()], &starts(&rows));
    let costs = [&own, &others].map(|channels| squares(channels));
    let told = surely_differ(comparison.z, costs) || plainly_differ(costs);
    (followed && told && costs[1] < costs[0]).then(|| {
        let mut set = problem.clone();
        set.structure.hold = model.structure.hold;
        let all = &mut set.measurements;
        (all.fit, all.hold_out) = (rows, curved(&measurements.hold_out));
        all.shown_hold = Some(model.structure.hold);
        all.placed_jumps.curved = true;
        let remark = "the command is fast for its rows: between them it is taken to go on in a curve, and not straight";
        all.beginnings.push(remark.into());
        set
    })
}

/// Whether what the `curved` commands make of `model` is to be seen beside the noise.
fn counts(model: &Problem, straight: &[Series], curved: &[Series]) -> bool {
    let [straight, curved] = [straight, curved].map(|records| {
        let simulated = simulated(model, records);
        residuals(model, &Compared::all(records, &simulated))
    });
    straight.iter().zip(&curved).any(|(straight, curved)| {
        let pairs = straight.iter().zip(curved);
        let moved: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        root_mean_square(&moved) > COUNTS
    })
}

/// `series` with a sample half-way between each two rows through which, and those beside them, its command goes on.
fn with_samples_between(series: &Series, rate: f64) -> Series {
    let (time, samples) = (&series.time, &series.samples);
    let mut whole = Series {
        time: Vec::with_capacity(2 * time.len()),
        samples: Vec::with_capacity(2 * time.len()),
        ..series.clone()
    };
    for row in 0..samples.len() {
        whole.time.push(time[row]);
        whole.samples.push(samples[row]);
        let Some(command) = half_way(series, row) else {
            continue;
        };
        let [from, to] = [samples[row], samples[row + 1]];
        whole.time.push(0.5 * (time[row] + time[row + 1]));
        let mut input = Input::between(&from.input, &to.input, 0.5);
        input.command = command;
        whole.samples.push(Sample {
            input,
            target: Outputs::from_fn(|output| 0.5 * (from.target[output] + to.target[output])),
            weight: 0.0,
            jumps: false,
            between: true,
            ..from
        });
    }
    whole.set_steps(rate, 1);
    whole
}

/// The command half-way from this `row` to the next by way of which it does what it does on the cubic through both and those beside them;
/// `None` at the ends, at a gap and where it jumps.
fn half_way(series: &Series, row: usize) -> Option<f64> {
    let first = row.checked_sub(1)?;
    let time: &[f64; 4] = series.time.get(first..first + 4)?.try_into().ok()?;
    let samples = &series.samples[first..first + 4];
    let beside = (time[1] - time[0]).min(time[3] - time[2]);
    if time[2] - time[1] > GAP * beside || samples[..3].iter().any(|sample| sample.jumps) {
        return None;
    }
    let at = 0.5 * (time[1] + time[2]);
    // Lagrange's form.
    let weight = |one: usize| {
        let others = (0..4).filter(|other| *other != one);
        others
            .map(|other| (at - time[other]) / (time[one] - time[other]))
            .product::<f64>()
    };
    let command = |one: usize| samples[one].input.command;
    let on_the_curve: f64 = (0..4).map(|one| weight(one) * command(one)).sum();
    // Straight from row to row by way of it there is as much under it as under the curve (Simpson).
    Some(on_the_curve + (on_the_curve - 0.5 * (command(1) + command(2))) / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_curves_between_its_rows_but_not_at_jumps_gaps_and_ends() {
        let far = |time: f64| if time > 25.5 { 900.0 } else { 0.0 };
        let cubic = |time: f64| far(time) + 1.0 + time * (2.0 - time * (0.3 - 0.04 * time));
        // What it comes to from the beginning on.
        let sum = |time: f64| time * (far(time) + 1.0 + time * (1.0 - time * (0.1 - 0.01 * time)));
        let mut time: Vec<f64> = (0..30).map(f64::from).collect();
        time[4] += 0.2;
        time[12..].iter_mut().for_each(|time| *time += 5.0);
        let sample = |&time: &f64| Sample {
            input: Input {
                command: cubic(time),
                time,
                ..Input::default()
            },
            weight: 1.0,
            ..Sample::default()
        };
        let mut series = Series {
            name: String::new(),
            measured: Outputs::all(true),
            samples: time.iter().map(sample).collect(),
            time,
        };
        series.set_steps(1.0, 1);
        let curved = with_samples_between(&series, 1.0);
        let between = curved.samples.iter().filter(|sample| sample.between);
        let between: Vec<&Sample> = between.collect();
        for three in curved.samples.windows(3).filter(|three| three[1].between) {
            assert_eq!(three[1].weight, 0.0);
            let [from, half, to] = [0, 1, 2].map(|one: usize| three[one].input);
            let straight = 0.25 * (from.command + 2.0 * half.command + to.command);
            let mean = (sum(to.time) - sum(from.time)) / (to.time - from.time);
            assert!((straight - mean).abs() < 1e-9);
        }
        // Neither within the gap from 11 to 17 s nor where it jumps, from 25 to 26 s, nor where what is beside belongs to that; nor at
        // the ends.
        let has = |moment: f64| between.iter().any(|one| one.input.time == moment);
        assert_eq!([1.5, 7.5, 9.5, 21.5, 30.5].map(has), [true; 5]);
        assert_eq!([0.5, 14.0, 24.5, 25.5, 26.5, 33.5].map(has), [false; 6]);
        let counting = curved.samples.iter().filter(|sample| sample.weight > 0.0);
        assert_eq!(counting.count(), 30);
    }
}
