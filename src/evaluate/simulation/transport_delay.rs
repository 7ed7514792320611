//! When the command arrives late: which of a record's commands act between two rows, exactly for any delay.

use crate::evaluate::problem::Series;
use crate::model::{Hold, Valued};

/// The commands that act from row `row` to the next when each arrives `delay` seconds late. They change where a row's time
/// plus the delay falls: the interval is cut there into pieces, of which some have no length.
#[derive(Debug, Clone, Copy)]
pub(in crate::evaluate) struct TransportDelay<'a, R> {
    series: &'a Series,
    row: usize,
    delay: R,
    /// Number of the row whose command acts at the interval's start; −1 before the first has arrived.
    first: R,
    hold: Hold,
}

impl<'a, R: Valued> TransportDelay<'a, R> {
    #[inline(always)]
    pub(in crate::evaluate) fn new(series: &'a Series, row: usize, delay: R, hold: Hold) -> Self {
        let now = series.time[row];
        Self {
            series,
            row,
            delay,
            first: delay.look_up(|delay| series.last_arrived(now, delay) as f64),
            hold,
        }
    }

    /// The command that piece `piece` begins with and its change until the next row's command arrives.
    #[inline(always)]
    fn command(&self, piece: usize) -> (R, R) {
        let at = |first: f64, more: usize| {
            let last = self.series.samples.len() - 1;
            let row = (first + (piece + more) as f64).max(0.0) as usize;
            &self.series.samples[row.min(last)]
        };
        let change = self.first.look_up(|first| {
            let sample = at(first, 0);
            // Before the first row the command has always been what it is there.
            if first + (piece as f64) < 0.0 || sample.keeps_its_command(self.hold) {
                return 0.0;
            }
            at(first, 1).input.command - sample.input.command
        });
        let value = self.first.look_up(|first| at(first, 0).input.command);
        (value, change)
    }

    /// Where piece `piece` would begin, seconds after the row, if it did not begin at the row, and how long the row whose
    /// command it has lasts.
    #[inline(always)]
    fn beginning(&self, piece: usize) -> (R, R) {
        let time = &self.series.time;
        let now = time[self.row];
        let row = |first: f64, more: usize| (first + (piece + more) as f64).max(0.0) as usize;
        let begins = |first: f64| match time.get(row(first, 0)) {
            Some(time) => time - now,
            None => f64::from(f32::MAX),
        };
        let lasts = self.first.look_up(|first| match time.get(row(first, 1)) {
            Some(end) if first + piece as f64 >= 0.0 => end - time[row(first, 0)],
            _ => 1.0,
        });
        (self.delay + self.first.look_up(begins), lasts)
    }

    /// The held command at the row.
    #[inline(always)]
    pub(in crate::evaluate) fn held(&self) -> R {
        self.command(0).0
    }

    /// The interpolated command `after` seconds after the row, in piece `piece`.
    #[inline(always)]
    pub(in crate::evaluate) fn interpolated(&self, piece: usize, after: R) -> R {
        let (value, change) = self.command(piece);
        let (begins, lasts) = self.beginning(piece);
        // At its ends the share keeps its sensitivity to the delay, which a clamp would lose.
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let share = (after - begins) / lasts;
        let share = (-share).if_positive(zero, share);
        value + (share - one).if_positive(one, share) * change
    }

    /// How much later than the next row the command of piece `piece` arrives, s.
    #[inline(always)]
    fn late(&self, piece: usize) -> R {
        let time = &self.series.time;
        let next = time[self.row + 1];
        let since = |first: f64| match time.get((first + piece as f64).max(0.0) as usize) {
            Some(time) => time - next,
            None => f64::from(f32::MAX),
        };
        self.delay + self.first.look_up(since)
    }

    /// Where piece `piece` ends, in integration steps of the undelayed command: seconds after the row over `substeps`.
    /// `whole` is the step of the whole interval, at which every later piece ends.
    #[inline(always)]
    pub(in crate::evaluate) fn end(&self, piece: usize, substeps: u32, whole: R) -> R {
        let late = self.late(piece + 1);
        // A command that arrives with the next row has a piece of no length, which knows how that depends on the delay.
        let early = late.if_positive(R::constant(0.0), -late);
        whole - early * R::constant(1.0 / f64::from(substeps))
    }

    /// The held command of piece `piece`, unless it arrives after the next row.
    #[inline(always)]
    pub(in crate::evaluate) fn held_in(&self, piece: usize, before: R) -> R {
        self.late(piece).if_positive(before, self.command(piece).0)
    }
}

impl Series {
    /// Number of the last row whose command has arrived at time `now` when each is `delay` late, or −1.
    fn last_arrived(&self, now: f64, delay: f64) -> i64 {
        let rows = &self.time;
        // As `late` has it, so that what arrives with a row arrives there and nowhere else.
        let arrived = |row: &f64| (row - now) + delay <= 0.0;
        let first = rows[0];
        if !arrived(&first) {
            return -1;
        }
        let last = rows.len() - 1;
        let per_row = (rows[last] - first) / last as f64;
        let guess = (((now - delay - first) / per_row) as usize).min(last);
        let fits = |row: usize| arrived(&rows[row]) && !rows.get(row + 1).is_some_and(arrived);
        // Evenly spaced rows are found at once.
        for row in [guess, guess.saturating_sub(1), (guess + 1).min(last)] {
            if fits(row) {
                return row as i64;
            }
        }
        rows.partition_point(arrived) as i64 - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::problem::Sample;
    use crate::model::{Input, Outputs};

    fn series(time: &[f64]) -> Series {
        let mut series = Series {
            name: "rows".into(),
            measured: Outputs::all(true),
            time: time.to_vec(),
            samples: time
                .iter()
                .enumerate()
                .map(|(k, _)| Sample {
                    input: Input {
                        command: k as f64,
                        ..Input::default()
                    },
                    ..Sample::default()
                })
                .collect(),
        };
        series.set_steps(100.0, 1);
        series
    }

    /// What acts at every moment, taken from the pieces: (begin, end, command) for each that has a length.
    fn pieces(series: &Series, row: usize, delay: f64) -> Vec<(f64, f64, f64)> {
        let delayed = TransportDelay::new(series, row, delay, Hold::Held);
        let sample = &series.samples[row];
        let mut command = delayed.held();
        let mut begin = 0.0;
        let mut list = Vec::new();
        for piece in 0..sample.pieces as usize {
            if piece > 0 {
                command = delayed.held_in(piece, command);
            }
            let end = match piece + 1 == sample.pieces as usize {
                true => sample.step,
                false => delayed.end(piece, sample.substeps, sample.step),
            };
            // Not what rounding leaves of a piece where a command arrives with a row.
            if end - begin > 1e-12 {
                let n = f64::from(sample.substeps);
                list.push((begin * n, end * n, command));
            }
            begin = end;
        }
        list
    }

    #[test]
    fn every_command_acts_exactly_the_delay_later() {
        let uneven: Vec<f64> = (0..60)
            .map(|k| f64::from(k) * 1e-3 + 4e-4 * f64::from(k * k % 7) / 7.0)
            .map(|t| if t > 0.03 { t + 0.011 } else { t })
            .collect();
        let even: Vec<f64> = (0..60).map(|k| f64::from(k) * 1e-3).collect();
        for time in [even, uneven] {
            let series = series(&time);
            for delay in [0.0, 0.3e-3, 1e-3, 2.7e-3, 13.4e-3] {
                for row in 0..time.len() - 1 {
                    let found = pieces(&series, row, delay);
                    assert!(found[0].0.abs() < 1e-12);
                    assert!((found.last().unwrap().1 - (time[row + 1] - time[row])).abs() < 1e-12);
                    for (begin, end, command) in found {
                        let moment = time[row] + (begin + end) / 2.0 - delay;
                        let due = time.partition_point(|t| *t <= moment).max(1) - 1;
                        assert_eq!(command, due as f64, "{delay} {row} {begin} {end}");
                    }
                }
            }
        }
    }

    #[test]
    fn without_delay_there_is_one_piece_of_the_whole_step() {
        let series = series(&[0.0, 1e-3, 2e-3, 3e-3]);
        assert_eq!(series.samples[1].pieces, 2);
        let found = pieces(&series, 1, 0.0);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].2, 1.0);
    }
}
