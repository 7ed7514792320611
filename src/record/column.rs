//! A column of a file, and one of a record.

use super::label::Label;

/// What a cell holds that holds no finite number.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Odd {
    Empty,
    /// As it is written.
    NotFinite(String),
    /// As it is written.
    Text(String),
}

/// A column of a file, in the file's unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub(super) label: Label,
    /// NaN where a cell is odd.
    pub(super) values: Vec<f64>,
    /// The odd cells and their rows, which rise.
    pub(super) odd: Vec<(usize, Odd)>,
}

impl Column {
    /// A column without values yet.
    pub(super) fn new(label: Label) -> Self {
        Self {
            label,
            values: Vec::new(),
            odd: Vec::new(),
        }
    }

    /// A column of these values.
    pub(super) fn of(label: Label, values: Vec<f64>) -> Self {
        let not_finite = values.iter().enumerate().filter(|(_, v)| !v.is_finite());
        Self {
            label,
            odd: not_finite
                .map(|(row, value)| (row, Odd::NotFinite(value.to_string())))
                .collect(),
            values,
        }
    }

    /// Adds a cell that holds no finite number.
    pub(super) fn push_odd(&mut self, odd: Odd) {
        self.odd.push((self.values.len(), odd));
        self.values.push(f64::NAN);
    }
}

/// A column of numbers, in the unit that its quantity is kept in.
pub(super) struct Measured {
    pub(super) index: usize,
    pub(super) values: Vec<f64>,
    pub(super) unit: &'static str,
}
