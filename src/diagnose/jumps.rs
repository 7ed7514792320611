//! What records do at the jumps of their command.

use super::statistics::jumps::{Answers, range};
use crate::evaluate::problem::Series;
use crate::model::{Output, Structure};

/// Whether one of the outputs of `structure` answers the jumps of the command in `records` by the rows that have them.
pub(super) fn answer_at_once(records: &[Series], structure: &Structure) -> bool {
    let mut observed = structure.observed.iter();
    observed.any(|&output| answers(records, output, &measured(records, output)).are_sure())
}

/// The measured values of `output` in each of these `records`.
pub(super) fn measured(records: &[Series], output: Output) -> Vec<Vec<f64>> {
    let values = |series: &Series| {
        let samples = series.samples.iter();
        samples.map(|sample| sample.target[output]).collect()
    };
    records.iter().map(values).collect()
}

/// What `values`, of each of these `records` that measures `output`, do at the jumps of the command.
pub(super) fn answers(records: &[Series], output: Output, values: &[Vec<f64>]) -> Answers {
    let commands = |series: &Series| -> Vec<f64> {
        let samples = series.samples.iter();
        samples.map(|sample| sample.input.command).collect()
    };
    let all: Vec<f64> = records.iter().flat_map(commands).collect();
    let (high, low) = range(&all);
    let mut answers = Answers::default();
    let measuring = records.iter().zip(values);
    for (series, values) in measuring.filter(|(series, _)| series.measured[output]) {
        let command = commands(series);
        for rows in series.pieces() {
            let of = |all: &[f64]| -> Vec<f64> { rows.iter().map(|&row| all[row]).collect() };
            answers.add(&of(&series.time), &of(&command), &of(values), high - low);
        }
    }
    answers
}
