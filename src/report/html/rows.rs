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
    /// Consecutive rows, one for each record or part of it.
    pub(super) parts: Vec<Part>,
}

/// (command, measured, simulated) of rows.
type Simulated = Vec<(f64, f64, f64)>;

/// Consecutive rows of one record.
pub(super) struct Part {
    pub(super) record: String,
    /// Time in the record less time on the axis, s.
    pub(super) shift: f64,
    pub(super) held_out: bool,
    pub(super) rows: Range<usize>,
}

impl Rows {
    /// The rows of `output`.
    pub(super) fn new(identified: &Identified, output: Output) -> Self {
        let measurements = &identified.measurements;
        let simulate = |records: &[Series]| -> Vec<[Simulated; 2]> {
            let of = |fitted: &crate::diagnose::Fitted| -> Vec<Simulated> {
                let compared = Compared::all(&fitted.problem.structure, &fitted.values, records);
                compared
                    .iter()
                    .map(|one| one.rows(output).collect())
                    .collect()
            };
            let pairs = of(&identified.before)
                .into_iter()
                .zip(of(&identified.after));
            pairs.map(|(before, after)| [before, after]).collect()
        };
        let fitted = measurements.fit.iter().zip(simulate(&measurements.fit));
        let held = measurements
            .hold_out
            .iter()
            .zip(simulate(&measurements.hold_out));
        let tagged = |held_out| move |(series, rows)| (series, rows, held_out);
        let mut all: Vec<(&Series, [Simulated; 2], bool)> = Vec::new();
        // The end of a record follows its beginning.
        if measurements.hold_out.iter().any(runs_in) {
            let pairs = fitted.map(tagged(false)).zip(held.map(tagged(true)));
            all.extend(pairs.flat_map(|(fitted, held)| [fitted, held]));
        } else {
            all.extend(fitted.map(tagged(false)).chain(held.map(tagged(true))));
        }
        let mut result = Self {
            time: Vec::new(),
            measured: Vec::new(),
            before: Vec::new(),
            after: Vec::new(),
            parts: Vec::new(),
        };
        for (series, [before, after], held_out) in all {
            result.append(series, &before, &after, held_out);
        }
        result
    }

    fn append(
        &mut self,
        series: &Series,
        before: &[(f64, f64, f64)],
        after: &[(f64, f64, f64)],
        held_out: bool,
    ) {
        let counted = series.time.iter().zip(&series.samples);
        let time: Vec<f64> = counted
            .filter(|(_, sample)| sample.weight > 0.0)
            .map(|(time, _)| *time)
            .collect();
        let Some(first) = time.first() else { return };
        let shift = match (self.parts.last(), self.time.last()) {
            (Some(part), _) if held_out && runs_in(series) => part.shift,
            (_, Some(end)) => first - end - 0.01 * (time[time.len() - 1] - first),
            _ => 0.0,
        };
        let from = self.time.len();
        self.time.extend(time.iter().map(|time| time - shift));
        self.measured.extend(before.iter().map(|row| row.1));
        self.before.extend(before.iter().map(|row| row.2));
        self.after.extend(after.iter().map(|row| row.2));
        self.parts.push(Part {
            record: series.name.clone(),
            shift,
            held_out,
            rows: from..self.time.len(),
        });
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
                    .parts
                    .iter()
                    .any(|part| part.rows.start == row && self.gap(row))
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
            .parts
            .iter()
            .map(|part| self.time[part.rows.end - 1] - self.time[part.rows.start])
            .sum();
        seconds / (self.time.len() - self.parts.len()).max(1) as f64
    }

    /// The stretches of rows where the squares of `first`, and then of `second`, are largest; they do not overlap.
    pub(super) fn worst(&self, first: &[f64], second: &[f64]) -> Vec<(Range<usize>, &Part)> {
        let mut found: Vec<(Range<usize>, &Part)> = Vec::new();
        for residual in [first, second] {
            let taken = found.first().map(|(rows, _)| rows.clone());
            let free = |rows: &Range<usize>| {
                taken
                    .as_ref()
                    .is_none_or(|taken| rows.end <= taken.start || rows.start >= taken.end)
            };
            let squares =
                |rows: &Range<usize>| residual[rows.clone()].iter().map(|r| r * r).sum::<f64>();
            let windows = self.parts.iter().flat_map(|part| {
                let length = STRETCH
                    .min((self.time.len() / 20).max(SHORTEST))
                    .min(part.rows.len());
                let step = (length / 8).max(1);
                let from = (part.rows.start..=part.rows.end - length).step_by(step);
                from.map(move |from| (from..from + length, part))
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

/// Whether a record that is held out begins with rows that were fitted.
fn runs_in(series: &Series) -> bool {
    series.samples.iter().any(|sample| sample.weight == 0.0)
}
