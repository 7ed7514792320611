//! Spikes: readings that stand out by themselves, of a converter, a relay or a bad contact. No valve does that, and a few of them
//! weigh as much in a sum of squares as all the rest.

use super::channel::Channel;
use super::text::count;
use std::ops::Range;

/// A spike lasts so many rows at most.
const LONGEST: usize = 2;
/// The rows to either side that it is compared with.
const BESIDE: usize = 6;
/// It is so many times the largest step from row to row among those, at least,
const BEYOND: f64 = 4.0;
/// and this share of the channel's range, and more than so many of its smallest steps.
const LEAST: f64 = 0.02;
const COARSE: f64 = 3.0;
/// What the command does so many rows before, a valve may answer,
const ANSWERED: usize = 8;
/// by so many times as large a share of the range at most.
const GAIN: f64 = 2.0;
/// More than this share of the rows are no spikes.
const FEW: f64 = 0.01;

/// Puts what is between their neighbours in the place of the spikes of these `values`, which answer this `command`; what to say of it.
pub(super) fn without_spikes(
    channel: Channel,
    unit: &str,
    values: &mut [f64],
    command: &[f64],
) -> Option<String> {
    let spikes = spikes(values, command);
    let first = spikes.first()?;
    let rows: usize = spikes.iter().map(ExactSizeIterator::len).sum();
    let said = format!(
        "{} of the {channel} {} out by {}, the first at sample {} with {} {}",
        count(rows, "reading"),
        if rows == 1 { "stands" } else { "stand" },
        if rows == 1 { "itself" } else { "themselves" },
        first.start,
        values[first.start],
        unit
    );
    if rows as f64 > FEW * values.len() as f64 {
        return Some(format!("{said}: too many to be taken for spikes"));
    }
    for spike in spikes {
        let (before, after) = (values[spike.start - 1], values[spike.end]);
        for row in spike.clone() {
            values[row] = between(before, after, &spike, row);
        }
    }
    Some(format!(
        "{said}: taken for spikes, and replaced by what is between their neighbours"
    ))
}

/// The rows of each spike among `values`.
fn spikes(values: &[f64], command: &[f64]) -> Vec<Range<usize>> {
    let rows = values.len();
    if rows < 10 * BESIDE {
        return Vec::new();
    }
    let steps: Vec<f64> = values
        .windows(2)
        .map(|two| (two[1] - two[0]).abs())
        .collect();
    let bends = command
        .windows(3)
        .map(|three| (three[0] - 2.0 * three[1] + three[2]).abs());
    let bends: Vec<f64> = bends.collect();
    let [range, commanded] = [values, command].map(|all| {
        let all = || all.iter().copied();
        all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min)
    });
    let moves = steps.iter().filter(|step| **step > 0.0);
    let smallest = moves.fold(f64::INFINITY, |least, step| least.min(*step));
    let least = (LEAST * range).max(COARSE * smallest);
    let largest = |of: &[f64]| of.iter().fold(0.0, |most: f64, one| most.max(*one));
    let is_spike = |spike: &Range<usize>| {
        let (before, after) = (values[spike.start - 1], values[spike.end]);
        let off = |row: usize| values[row] - between(before, after, spike, row);
        let first = off(spike.start);
        let height = spike.clone().map(|row| off(row) * first.signum());
        let height = height.fold(f64::INFINITY, f64::min);
        let beside = [
            &steps[spike.start.saturating_sub(1 + BESIDE)..spike.start - 1],
            &steps[spike.end..(spike.end + BESIDE).min(steps.len())],
            &[(after - before).abs()],
        ];
        let answers = || {
            let bent = &bends[spike.start.saturating_sub(ANSWERED)..spike.end.min(bends.len())];
            GAIN * largest(bent) / commanded * range
        };
        height > least && height > BEYOND * largest(&beside.concat()) && height > answers()
    };
    let mut found = Vec::new();
    let mut row = BESIDE;
    while row + LONGEST + BESIDE < rows {
        let here = (1..=LONGEST).map(|length| row..row + length);
        // Most rows are nowhere near one.
        let stands_out = steps[row - 1] > least;
        match here.into_iter().find(|spike| stands_out && is_spike(spike)) {
            Some(spike) => {
                row = spike.end + 1;
                found.push(spike);
            }
            None => row += 1,
        }
    }
    found
}

/// What is between the values `before` and `after` a spike in one of its rows.
fn between(before: f64, after: f64, spike: &Range<usize>, row: usize) -> f64 {
    let share = (row + 1 - spike.start) as f64 / (spike.len() + 1) as f64;
    before + share * (after - before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A command that rests, sweeps and jumps, and what follows it with noise, within two rows.
    fn bench() -> [Vec<f64>; 2] {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let command = |row: usize| match row {
            0..500 => 0.0,
            500..2000 => 8.0 * (1e-4 * ((row - 500) as f64).powi(2)).sin(),
            _ => 6.0 * f64::from(((row / 7) * 2_654_435_761 % 5) as i32 - 2),
        };
        let command: Vec<f64> = (0..3000).map(command).collect();
        let mut follows = 0.0;
        let response = command.iter().map(|command| {
            follows += 0.7 * (command - follows);
            4.0 * follows + 0.1 * random.random_range(-1.0..1.0)
        });
        let response = response.collect();
        [command, response]
    }

    #[test]
    fn spikes_are_replaced_and_what_the_valve_does_is_not() {
        let [command, clean] = bench();
        let replaced =
            |values: &mut [f64]| without_spikes(Channel::Flow, "L/min", values, &command);
        let mut values = clean.clone();
        assert_eq!(replaced(&mut values), None);
        assert_eq!(values, clean);

        let mut spiky = clean.clone();
        for (row, height) in [
            (100, 5.0),
            (300, -9.0),
            (301, -8.0),
            (700, 20.0),
            (1200, -30.0),
        ] {
            spiky[row] += height;
        }
        let said = replaced(&mut spiky).unwrap();
        assert!(
            said.contains("5 readings of the flow stand out by themselves")
                && said.contains("sample 100 with"),
            "{said}"
        );
        let off = spiky
            .iter()
            .zip(&clean)
            .map(|(one, other)| (one - other).abs());
        assert!(off.fold(0.0, f64::max) < 1.5);
    }

    #[test]
    fn what_is_not_rare_is_no_spike() {
        let [command, mut values] = bench();
        values
            .iter_mut()
            .step_by(50)
            .for_each(|value| *value += 40.0);
        let before = values.clone();
        let said = without_spikes(Channel::Flow, "L/min", &mut values, &command).unwrap();
        assert!(said.contains("too many"), "{said}");
        assert_eq!(values, before);
        // Steps of a coarse reading, and a record of a few rows.
        let coarse: Vec<f64> = (0..3000).map(|row| f64::from(row % 97 == 0)).collect();
        let ramp: Vec<f64> = (0..3000).map(|row| f64::from(row / 30)).collect();
        let stairs: Vec<f64> = ramp.iter().zip(&coarse).map(|(a, b)| a + b).collect();
        assert_eq!(spikes(&stairs, &ramp), []);
        assert_eq!(spikes(&[0.0, 0.0, 9.0, 0.0, 0.0], &[0.0; 5]), []);
    }
}
