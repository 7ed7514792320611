//! Candidates and their costs.

use std::cmp::Ordering;
use std::ops::Range;

/// Candidates of one length, stored one after another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Population {
    dimension: usize,
    count: usize,
    values: Vec<f64>,
}

impl Population {
    /// An empty population of candidates with `dimension` values each.
    pub fn new(dimension: usize) -> Self {
        Self {
            dimension,
            count: 0,
            values: Vec::new(),
        }
    }

    /// A population of one candidate.
    pub fn single(candidate: &[f64]) -> Self {
        Self {
            dimension: candidate.len(),
            count: 1,
            values: candidate.to_vec(),
        }
    }

    /// The population whose `values` are those of one candidate of `dimension` values after another.
    ///
    /// # Panics
    /// If they are no whole number of candidates.
    pub fn of(dimension: usize, values: Vec<f64>) -> Self {
        let count = values.len() / dimension.max(1);
        assert_eq!(count * dimension, values.len(), "a candidate is cut off");
        Self {
            dimension,
            count,
            values,
        }
    }

    /// Adds a candidate.
    ///
    /// # Panics
    /// If its length is not the population's dimension.
    pub fn push(&mut self, candidate: &[f64]) {
        assert_eq!(
            candidate.len(),
            self.dimension,
            "candidate of another dimension"
        );
        self.count += 1;
        self.values.extend_from_slice(candidate);
    }

    /// The candidates in this range of numbers.
    ///
    /// # Panics
    /// If it reaches beyond them.
    pub fn part(&self, candidates: Range<usize>) -> Self {
        let values = candidates.start * self.dimension..candidates.end * self.dimension;
        Self {
            dimension: self.dimension,
            count: candidates.len(),
            values: self.values[values].to_vec(),
        }
    }

    /// The values of all candidates, one candidate after another.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// How many values a candidate has.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// How many candidates there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no candidate.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Candidate `index`.
    pub fn candidate(&self, index: usize) -> &[f64] {
        &self.values[index * self.dimension..(index + 1) * self.dimension]
    }

    /// The candidates in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        (0..self.count).map(|index| self.candidate(index))
    }
}

/// How the simulation of a candidate ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// It ran to the end.
    Finished,
    /// A state left the finite range; its cost means nothing.
    Diverged,
}

/// A candidate's cost. Costs have a total order: the smallest first, diverged ones last.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Weighted sum of squares; infinite where the candidate diverged.
    pub value: f64,
    /// How the simulation ended.
    pub status: Status,
}

impl Cost {
    /// The cost of a finished simulation; a value that is not finite counts as diverged.
    pub fn finished(value: f64) -> Self {
        if value.is_finite() {
            Self {
                value,
                status: Status::Finished,
            }
        } else {
            Self::DIVERGED
        }
    }

    /// How far this cost is from a `reference`, as a share of it; infinite where only one of the two diverged.
    pub fn difference(&self, reference: &Self) -> f64 {
        match (self.status, reference.status) {
            // Zero may equal zero.
            _ if self == reference => 0.0,
            (Status::Finished, Status::Finished) => (self.value / reference.value - 1.0).abs(),
            _ => f64::INFINITY,
        }
    }

    /// The cost of a candidate that diverged.
    pub const DIVERGED: Self = Self {
        value: f64::INFINITY,
        status: Status::Diverged,
    };
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> Ordering {
        self.status
            .cmp(&other.status)
            .then(self.value.total_cmp(&other.value))
    }
}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cost {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cost {}
