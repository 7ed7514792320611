//! How far a model is from the measurements.

use crate::evaluate::problem::Series;
use crate::evaluate::reference;
use crate::model::{Output, Structure};
use serde::Serialize;
use std::collections::BTreeMap;

/// How far the model is from one channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChannelError {
    /// Root mean square of measured − simulated, in the channel's unit.
    pub rmse: f64,
    /// 100 · (1 − ‖e‖ / ‖y − ȳ‖).
    pub fit_percent: f64,
}

impl ChannelError {
    /// The error over pairs of (measured, simulated); `None` without pairs.
    pub fn of(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Self> {
        let count = pairs.clone().count();
        if count == 0 {
            return None;
        }
        let mean = pairs.clone().map(|(measured, _)| measured).sum::<f64>() / count as f64;
        let error: f64 = pairs
            .clone()
            .map(|(measured, simulated)| (measured - simulated).powi(2))
            .sum();
        let spread: f64 = pairs.map(|(measured, _)| (measured - mean).powi(2)).sum();
        let ratio = if error == 0.0 {
            0.0
        } else {
            (error / spread).sqrt()
        };
        Some(Self {
            rmse: (error / count as f64).sqrt(),
            fit_percent: 100.0 * (1.0 - ratio),
        })
    }
}

/// A record beside its simulation.
#[derive(Debug, Clone)]
pub struct Compared<'a> {
    /// The record.
    pub series: &'a Series,
    /// The simulated outputs of every row, in the order of [`Output::ALL`].
    pub simulated: Vec<[f64; 3]>,
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
        let index = output as usize;
        let counted = self
            .series
            .samples
            .iter()
            .zip(&self.simulated)
            .filter(|(sample, _)| sample.weight > 0.0);
        counted.map(move |(sample, simulated)| {
            (sample.input[0], sample.target[index], simulated[index])
        })
    }
}

/// The error of every observed channel over the rows that count.
pub fn errors(structure: &Structure, compared: &[Compared]) -> BTreeMap<String, ChannelError> {
    let one = |&output: &Output| {
        let pairs = compared.iter().flat_map(|c| {
            c.rows(output)
                .map(|(_, measured, simulated)| (measured, simulated))
        });
        Some((output.name().to_owned(), ChannelError::of(pairs)?))
    };
    structure.observed.iter().filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_the_textbook_ones() {
        let error = ChannelError::of([(1.0, 1.0), (3.0, 2.0), (5.0, 5.0)].into_iter()).unwrap();
        assert!((error.rmse - (1.0f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((error.fit_percent - 100.0 * (1.0 - (1.0f64 / 8.0).sqrt())).abs() < 1e-12);
        let perfect = ChannelError::of([(1.0, 1.0), (1.0, 1.0)].into_iter()).unwrap();
        assert_eq!((perfect.rmse, perfect.fit_percent), (0.0, 100.0));
        assert_eq!(ChannelError::of(std::iter::empty()), None);
    }
}
