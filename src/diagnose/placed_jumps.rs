//! A command that jumps between two rows: there a sample is put that nobody measured, and that counts for nothing.

use crate::evaluate::problem::{Sample, Series};
use crate::model::{Input, Outputs};
use std::ops::Range;

/// Rows that a jump has for itself, at least.
const APART: usize = 4;
/// Rows behind a jump by which it is placed, at most.
const BEHIND: usize = 60;
/// How near to a row a jump is put at least, in intervals.
const NEAREST: f64 = 1e-3;

/// The jumps of the commands of all series, those that are fitted first.
#[derive(Debug, Clone, Default)]
pub struct PlacedJumps {
    /// How often they were placed.
    pub(super) times: usize,
    pub(super) of_series: Vec<Vec<Jump>>,
    /// Whether between two rows without one the commands go on in a curve.
    pub(super) curved: bool,
}

/// A jump of a command.
#[derive(Debug, Clone)]
pub(super) struct Jump {
    /// The sample with which it comes, behind that of the row before.
    pub(super) sample: usize,
    /// By what share of the interval between the rows it comes before the later one, and the standard error of that.
    pub(super) early: f64,
    pub(super) error: f64,
    /// The samples behind it by which it is placed.
    pub(super) behind: Range<usize>,
}

/// Puts a sample into `series` in the middle of each interval in which its command jumps and has rows for that alone.
pub(super) fn opened(series: &mut Series) -> Vec<Jump> {
    let count = series.samples.len();
    let jumps = |row: &usize| series.samples[*row].jumps;
    let rows: Vec<usize> = (1..count.saturating_sub(1)).filter(jumps).collect();
    let jump = |(number, &row): (usize, &usize)| {
        let next = rows.get(number + 1).copied().unwrap_or(count - 1);
        let before = number.checked_sub(1).map(|before| rows[before]);
        let alone = next - row >= APART && before.is_none_or(|before| row - before >= APART);
        alone.then_some((row, next))
    };
    let alone: Vec<(usize, usize)> = rows.iter().enumerate().filter_map(jump).collect();
    let mut all = Vec::with_capacity(alone.len());
    for (before, (row, next)) in alone.into_iter().enumerate() {
        let sample = row + before + 1;
        let later = series.samples[sample];
        series.time.insert(sample, series.time[sample]);
        series.samples.insert(
            sample,
            Sample {
                weight: 0.0,
                jumps: false,
                between: true,
                ..later
            },
        );
        all.push(Jump {
            sample,
            early: 0.5,
            error: f64::INFINITY,
            behind: sample + 1..sample + 1 + BEHIND.min(next - row),
        });
    }
    all
}

/// Lets `jump` come before the row behind it by a share of the interval.
pub(super) fn set(series: &mut Series, jump: &Jump, early: f64) {
    let early = early.clamp(NEAREST, 1.0 - NEAREST);
    let [before, after] = [jump.sample - 1, jump.sample + 1];
    let between = |from: f64, to: f64| to + early * (from - to);
    series.time[jump.sample] = between(series.time[before], series.time[after]);
    let [from, to] = [before, after].map(|row| series.samples[row]);
    let own = &mut series.samples[jump.sample];
    own.input = Input::between(&from.input, &to.input, 1.0 - early);
    own.input.command = to.input.command;
    own.target = Outputs::from_fn(|output| between(from.target[output], to.target[output]));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(commands: &[f64]) -> Series {
        let sample = |(row, &command): (usize, &f64)| Sample {
            input: Input {
                command,
                time: row as f64,
                ..Input::default()
            },
            target: Outputs::all(row as f64),
            weight: 1.0,
            ..Sample::default()
        };
        let mut series = Series {
            name: String::new(),
            time: (0..commands.len()).map(|row| row as f64).collect(),
            measured: Outputs::all(true),
            samples: commands.iter().enumerate().map(sample).collect(),
        };
        series.set_steps(1.0, 1);
        series
    }

    #[test]
    fn a_jump_has_a_sample_between_its_rows_that_counts_for_nothing() {
        let commands = [vec![0.0; 20], vec![5.0; 30], vec![-2.0; 3], vec![1.0; 20]].concat();
        let mut record = series(&commands);
        let jumps = opened(&mut record);
        // The other two are too near to each other.
        let samples: Vec<usize> = jumps.iter().map(|one| one.sample).collect();
        assert_eq!((samples, record.samples.len()), (vec![20], 74));
        assert_eq!(jumps[0].behind, 21..51);
        for (early, moment) in [(0.25, 19.75), (0.0, 20.0 - NEAREST), (1.0, 19.0 + NEAREST)] {
            set(&mut record, &jumps[0], early);
            record.set_steps(1.0, 1);
            let own = &record.samples[20];
            assert!((record.time[20] - moment).abs() < 1e-12);
            assert_eq!((own.input.time, own.input.command), (record.time[20], 5.0));
            assert_eq!(
                (own.weight, own.target),
                (0.0, Outputs::all(record.time[20]))
            );
            // It jumps there, and nowhere else beside it.
            let flags = |row: usize| record.samples[row].jumps;
            assert_eq!([18, 19, 20, 21].map(flags), [false, true, false, false]);
        }
    }
}
