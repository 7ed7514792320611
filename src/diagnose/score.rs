//! How far a model is from the measurements.

use crate::evaluate::problem::Series;
use crate::evaluate::{Score, reference};
use crate::model::{Output, Outputs, Structure};
use std::collections::BTreeMap;

/// A record beside its simulation.
#[derive(Debug, Clone)]
pub struct Compared<'a> {
    /// The record.
    pub series: &'a Series,
    /// The simulated outputs of every row.
    pub simulated: Vec<Outputs<f64>>,
}

impl<'a> Compared<'a> {
    /// Simulates all `records` with values of all parameters.
    pub fn all(structure: &Structure, values: &[f64], records: &'a [Series]) -> Vec<Self> {
        let simulated = reference::trajectories(structure, values, records);
        records
            .iter()
            .zip(simulated)
            .map(|(series, simulated)| Self { series, simulated })
            .collect()
    }

    /// (command, measured, simulated) of an output in the rows that count.
    pub fn rows(&self, output: Output) -> impl Iterator<Item = (f64, f64, f64)> + Clone {
        let counted = self
            .series
            .samples
            .iter()
            .zip(&self.simulated)
            .filter(|(sample, _)| sample.weight > 0.0);
        counted.map(move |(sample, simulated)| {
            (
                sample.input.command,
                sample.target[output],
                simulated[output],
            )
        })
    }
}

/// The error of every observed channel over the rows that count.
pub fn errors(structure: &Structure, compared: &[Compared]) -> BTreeMap<String, Score> {
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
