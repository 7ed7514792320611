//! Records beside what a model gives for them, and the errors between both.

use super::statistics::line::Stretch;
use crate::evaluate::Score;
use crate::evaluate::problem::Series;
use crate::model::{Output, Outputs, Structure};
use serde::Serialize;
use std::collections::BTreeMap;

/// The outputs of every row of each record, in the order of [`Output::ALL`].
pub type Trajectories = Vec<Vec<Outputs<f64>>>;

/// Errors by channel; empty where there are no rows.
pub type Errors = BTreeMap<String, Score>;

/// What there is of the data that was fitted, and of the data that was not.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Sides<T> {
    /// Of the data that was fitted.
    pub fit: T,
    /// Of data that was held out.
    pub hold_out: T,
}

/// A record beside its simulation.
#[derive(Debug, Clone, Copy)]
pub struct Compared<'a> {
    /// The record.
    pub series: &'a Series,
    /// The simulated outputs of every row, in the order of [`Output::ALL`].
    pub simulated: &'a [Outputs<f64>],
}

impl<'a> Compared<'a> {
    /// Each of `records` beside its simulation.
    pub fn all(records: &'a [Series], simulated: &'a Trajectories) -> Vec<Self> {
        let pairs = records.iter().zip(simulated);
        pairs
            .map(|(series, simulated)| Self { series, simulated })
            .collect()
    }

    /// Those of `compared` whose record measures `output`.
    pub fn measuring(compared: &[Self], output: Output) -> Vec<Self> {
        let mut measuring = compared.to_vec();
        measuring.retain(|one| one.series.measured[output]);
        measuring
    }

    /// (command, measured, simulated) of an output in the rows that count; none where the record does not measure it.
    pub fn rows(self, output: Output) -> impl Iterator<Item = (f64, f64, f64)> + Clone + 'a {
        let measured = self.series.measured[output];
        let counted = self
            .series
            .samples
            .iter()
            .zip(self.simulated)
            .filter(move |(sample, _)| measured && sample.weight > 0.0);
        counted.map(move |(sample, simulated)| {
            (
                sample.input.command,
                sample.target[output],
                simulated[output],
            )
        })
    }
}

/// Measured less simulated `output` in the rows that count of the records that measure it, one after another.
pub(super) fn residual(compared: &[Compared], output: Output) -> Vec<f64> {
    let rows = compared.iter().flat_map(|one| one.rows(output));
    rows.map(|(_, measured, simulated)| measured - simulated)
        .collect()
}

/// The same in the rows that count of all records, so that the channels of a row stand side by side: where a record does not
/// measure `output` there is nothing between the two.
pub(super) fn residual_in_all_rows(compared: &[Compared], output: Output) -> Vec<f64> {
    let one = |one: &Compared| match one.series.measured[output] {
        true => residual(&[*one], output),
        false => vec![0.0; one.series.pieces().iter().map(Vec::len).sum()],
    };
    compared.iter().flat_map(one).collect()
}

/// What is left of `output` in each piece of the rows that count, of those of `compared` that measure it, with what is `beside` it in a
/// row of one of them.
pub(super) fn stretches(
    compared: &[Compared],
    output: Output,
    beside: impl Fn(usize, usize) -> f64,
) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    for (number, one) in compared.iter().enumerate() {
        if !one.series.measured[output] {
            continue;
        }
        let samples = &one.series.samples;
        let left = |row: &usize| samples[*row].target[output] - one.simulated[*row][output];
        stretches.extend(one.series.pieces().iter().map(|rows| Stretch {
            time: rows.iter().map(|&row| samples[row].input.time).collect(),
            left: rows.iter().map(left).collect(),
            beside: rows.iter().map(|&row| beside(number, row)).collect(),
        }));
    }
    stretches
}

/// The error of every observed channel over the rows that count.
pub fn errors(structure: &Structure, compared: &[Compared]) -> Errors {
    let one = |&output: &Output| {
        let pairs = compared.iter().flat_map(|c| {
            c.rows(output)
                .map(|(_, measured, simulated)| (measured, simulated))
        });
        let measured = pairs.clone().next().is_some();
        measured.then(|| (output.name().to_owned(), Score::new(pairs)))
    };
    structure.observed.iter().filter_map(one).collect()
}
