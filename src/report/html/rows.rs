//! A channel over all records, one after another.

use crate::diagnose::{Compared, Identified};
use crate::evaluate::problem::Series;
use crate::model::Output;
use std::ops::Range;

/// Rows that a stretch shows: enough to see how the valve answers, few enough to see a lag.
const STRETCH: usize = 250;
/// Shortest stretch.
const SHORTEST: usize = 40;

/// A channel's rows that count, measured and simulated. Records follow each other on one time axis.
pub(super) struct Rows {
    /// Time on the axis, s.
    pub(super) time: Vec<f64>,
    pub(super) measured: Vec<f64>,
    /// Simulated by the base model.
    pub(super) before: Vec<f64>,
    /// Simulated by the result.
    pub(super) after: Vec<f64>,
    /// Consecutive rows, one for each record or piece of it.
    pub(super) records: Vec<RecordRows>,
}

/// Consecutive rows of one record.
pub(super) struct RecordRows {
    pub(super) record: String,
    /// Time in the record less time on the axis, s.
    pub(super) shift: f64,
    pub(super) held_out: bool,
    pub(super) rows: Range<usize>,
}

impl Rows {
    /// The rows of `output`.
    pub(super) fn new(identified: &Identified, output: Output) -> Self {
        let [before, after] = [&identified.before, &identified.after]
            .map(|fitted| fitted.beside(&identified.measurements));
        let sides = [
            (before.fit, after.fit, false),
            (before.hold_out, after.hold_out, true),
        ];
        let sides = sides.map(|(before, after, held_out)| {
            let pairs = before.into_iter().zip(after);
            let side = |(before, after)| Side {
                before,
                after,
                held_out,
            };
            pairs.map(side).collect::<Vec<Side>>()
        });
        let mut result = Self {
            time: Vec::new(),
            measured: Vec::new(),
            before: Vec::new(),
            after: Vec::new(),
            records: Vec::new(),
        };
        let [fitted, held] = &sides;
        if identified.measurements.hold_out.iter().any(runs_in) {
            // Both sides are of the same records.
            for (fitted, held) in fitted.iter().zip(held) {
                result.append(&[fitted, held], output);
            }
        } else {
            for side in fitted.iter().chain(held) {
                result.append(&[side], output);
            }
        }
        result
    }

    /// Appends the rows of a record, whose sides may take turns.
    fn append(&mut self, sides: &[&Side], output: Output) {
        let measuring = sides
            .iter()
            .filter(|side| side.before.series.measured[output]);
        let pieces = measuring.flat_map(|&side| {
            let rows = side.before.series.pieces();
            rows.into_iter().map(move |rows| (side, rows))
        });
        let mut pieces: Vec<(&Side, Vec<usize>)> = pieces.collect();
        pieces.sort_by(|(one, a), (other, b)| one.time(a[0]).total_cmp(&other.time(b[0])));
        let (Some((one, first)), Some((other, last))) = (pieces.first(), pieces.last()) else {
            return;
        };
        let (begin, end) = (one.time(first[0]), other.time(last[last.len() - 1]));
        let shift = match self.time.last() {
            Some(before) => begin - before - 0.01 * (end - begin),
            None => 0.0,
        };
        for (side, rows) in pieces {
            let from = self.time.len();
            for row in rows {
                self.time.push(side.time(row) - shift);
                let measured = side.before.series.samples[row].target[output];
                self.measured.push(measured);
                self.before.push(side.before.simulated[row][output]);
                self.after.push(side.after.simulated[row][output]);
            }
            self.records.push(RecordRows {
                record: side.before.series.name.clone(),
                shift,
                held_out: side.held_out,
                rows: from..self.time.len(),
            });
        }
    }

    /// Measured less simulated.
    pub(super) fn residual(&self, simulated: &[f64]) -> Vec<f64> {
        let pairs = self.measured.iter().zip(simulated);
        pairs
            .map(|(measured, simulated)| measured - simulated)
            .collect()
    }

    /// `values` over time as a line that records interrupt.
    pub(super) fn line(&self, values: &[f64], rows: Range<usize>) -> Vec<(f64, f64)> {
        let mut line = Vec::new();
        for row in rows {
            if row > 0
                && self
                    .records
                    .iter()
                    .any(|one| one.rows.start == row && self.gap(row))
            {
                line.push((f64::NAN, f64::NAN));
            }
            line.push((self.time[row], values[row]));
        }
        line
    }

    /// Whether more than a row's interval lies before `row`.
    fn gap(&self, row: usize) -> bool {
        let usual = self.interval();
        self.time[row] - self.time[row - 1] > 1.5 * usual
    }

    /// Mean interval between rows, s.
    pub(super) fn interval(&self) -> f64 {
        let seconds: f64 = self
            .records
            .iter()
            .map(|one| self.time[one.rows.end - 1] - self.time[one.rows.start])
            .sum();
        seconds / (self.time.len() - self.records.len()).max(1) as f64
    }

    /// The stretches of rows where the squares of `first`, and then of `second`, are largest; they do not overlap.
    pub(super) fn worst(&self, first: &[f64], second: &[f64]) -> Vec<(Range<usize>, &RecordRows)> {
        let mut found: Vec<(Range<usize>, &RecordRows)> = Vec::new();
        for residual in [first, second] {
            let taken = found.first().map(|(rows, _)| rows.clone());
            let free = |rows: &Range<usize>| {
                taken
                    .as_ref()
                    .is_none_or(|taken| rows.end <= taken.start || rows.start >= taken.end)
            };
            let squares =
                |rows: &Range<usize>| residual[rows.clone()].iter().map(|r| r * r).sum::<f64>();
            let windows = self.records.iter().flat_map(|one| {
                let length = STRETCH
                    .min((self.time.len() / 20).max(SHORTEST))
                    .min(one.rows.len());
                let step = (length / 8).max(1);
                let from = (one.rows.start..=one.rows.end - length).step_by(step);
                from.map(move |from| (from..from + length, one))
            });
            let worst = windows
                .filter(|(rows, _)| free(rows))
                .map(|window| (squares(&window.0), window))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            found.extend(worst.map(|(_, window)| window));
        }
        found
    }
}

/// One side of a record: what is fitted of it, or what is held out.
struct Side<'a> {
    before: Compared<'a>,
    after: Compared<'a>,
    held_out: bool,
}

impl Side<'_> {
    fn time(&self, row: usize) -> f64 {
        self.before.series.time[row]
    }
}

/// Whether a record that is held out has rows that were fitted.
fn runs_in(series: &Series) -> bool {
    let mut samples = series.samples.iter();
    samples.any(|sample| sample.weight == 0.0 && !sample.between)
}
