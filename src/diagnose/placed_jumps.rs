//! A command that jumps between two rows: there a sample is put that nobody measured, and that counts for nothing.

use crate::evaluate::problem::Series;
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
    /// The first sample that was put between rows for it, right behind the row before.
    pub(super) sample: usize,
    /// How many intervals between rows it takes: behind the generator's filter a row may see it half done.
    pub(super) intervals: usize,
    /// By what share of the time between the rows before and behind it comes before the later one, and the standard error of that.
    pub(super) early: f64,
    pub(super) error: f64,
    /// The samples behind it by which it is placed.
    pub(super) behind: Range<usize>,
}

impl Jump {
    /// Puts its samples between what there is for each row.
    pub(super) fn insert_into<T: Copy>(&self, rows: &mut Vec<T>) {
        for interval in 0..self.intervals {
            let sample = self.sample + 2 * interval;
            rows.insert(sample, rows[sample]);
        }
    }

    /// The sample of the row behind it.
    fn after(&self) -> usize {
        self.sample + 2 * self.intervals - 1
    }
}

/// Puts a sample into `series` in the middle of each interval in which its command jumps and has rows for that alone.
pub(super) fn opened(series: &mut Series) -> Vec<Jump> {
    let count = series.samples.len();
    let [within_one, within_two] = [1, 2].map(|intervals| series.jumps_within(intervals));
    // What jumps, and the rows before it and behind.
    let mut rows: Vec<(usize, usize)> = Vec::new();
    for row in 1..count.saturating_sub(1) {
        if rows.last().is_some_and(|(_, behind)| row < *behind) {
            continue;
        }
        match (within_one[row], within_two[row]) {
            (_, true) => rows.push((row, row + 2)),
            (true, false) => rows.push((row, row + 1)),
            (false, false) => {}
        }
    }
    let jump = |(number, &(row, behind)): (usize, &(usize, usize))| {
        let next = rows.get(number + 1).map_or(count - 1, |next| next.0);
        let before = number.checked_sub(1).map(|before| rows[before].1 - 1);
        let alone = next + 1 - behind >= APART && before.is_none_or(|before| row - before >= APART);
        alone.then_some((row, behind, next))
    };
    let alone: Vec<(usize, usize, usize)> = rows.iter().enumerate().filter_map(jump).collect();
    let mut all: Vec<Jump> = Vec::with_capacity(alone.len());
    for (row, behind, next) in alone {
        let inserted: usize = all.iter().map(|jump| jump.intervals).sum();
        let mut jump = Jump {
            sample: row + inserted + 1,
            intervals: behind - row,
            early: 0.5,
            error: f64::INFINITY,
            behind: 0..0,
        };
        jump.behind = jump.after()..jump.after() + BEHIND.min(next + 1 - behind);
        jump.insert_into(&mut series.time);
        jump.insert_into(&mut series.samples);
        for interval in 0..jump.intervals {
            let own = &mut series.samples[jump.sample + 2 * interval];
            (own.weight, own.jumps, own.between) = (0.0, false, true);
        }
        all.push(jump);
    }
    all
}

/// Lets `jump` come before the row behind it by a share of the time from the one before it on. A row between them sees it done or not
/// begun.
pub(super) fn set(series: &mut Series, jump: &Jump, early: f64) {
    let [before, after] = [jump.sample - 1, jump.after()];
    let [from, to] = [before, after].map(|row| series.samples[row].input.command);
    let [begin, end] = [before, after].map(|row| series.time[row]);
    let moment = end + early * (begin - end);
    for own in (before + 1..after).step_by(2) {
        let [first, last] = [series.time[own - 1], series.time[own + 1]];
        let share = ((moment - first) / (last - first)).clamp(NEAREST, 1.0 - NEAREST);
        let is_over = moment < last || own + 1 == after;
        let between = |from: f64, to: f64| from + share * (to - from);
        series.time[own] = between(first, last);
        let beside = [own - 1, own + 1].map(|row| series.samples[row]);
        let sample = &mut series.samples[own];
        sample.input = Input::between(&beside[0].input, &beside[1].input, share);
        sample.input.command = if is_over { to } else { from };
        sample.target =
            Outputs::from_fn(|output| between(beside[0].target[output], beside[1].target[output]));
        if own + 1 < after {
            series.samples[own + 1].input.command = if is_over { to } else { from };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::problem::Sample;

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

    #[test]
    fn a_row_that_sees_a_jump_half_done_sees_it_done_or_not_begun() {
        let commands = [vec![0.0; 20], vec![3.0], vec![5.0; 19]].concat();
        let mut record = series(&commands);
        let jumps = opened(&mut record);
        assert_eq!((jumps.len(), jumps[0].behind.clone()), (1, 23..42));
        assert_eq!(record.samples.len(), 42);
        // Rows are at 19, 20 and 21 s.
        for (early, moment, seen) in [(0.75, 19.5, 5.0), (0.25, 20.5, 0.0), (0.5, 20.0, 0.0)] {
            set(&mut record, &jumps[0], early);
            record.set_steps(1.0, 1);
            assert!(record.time.is_sorted_by(|a, b| a < b), "{:?}", record.time);
            let jump = record.samples.iter().position(|sample| sample.jumps);
            let comes = record.time[jump.unwrap() + 1];
            assert!((comes - moment).abs() < 2.0 * NEAREST, "{early}: {comes}");
            assert_eq!(
                (record.time[21], record.samples[21].input.command),
                (20.0, seen)
            );
            let weights: f64 = record.samples.iter().map(|sample| sample.weight).sum();
            assert_eq!(weights, 40.0);
        }
    }
}
