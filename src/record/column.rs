//! A column of a file, and one of a record.

use super::label::Label;

/// What a cell holds that holds no finite number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Odd {
    Empty,
    NotFinite,
    Text,
}

/// A column of a file, in the file's unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub(super) label: Label,
    /// NaN where a cell is odd.
    pub(super) values: Vec<f64>,
    /// The odd cells and their rows, which rise.
    pub(super) odd: Vec<(usize, Odd)>,
    /// How the first of them that is not empty is written.
    pub(super) first_odd: String,
}

impl Column {
    /// A column that will have so many values.
    pub(super) fn new(label: Label, rows: usize) -> Self {
        Self {
            label,
            values: Vec::with_capacity(rows),
            odd: Vec::new(),
            first_odd: String::new(),
        }
    }

    /// A column of these values.
    pub(super) fn of(label: Label, values: Vec<f64>) -> Self {
        let mut odd = (0..values.len())
            .filter(|&row| !values[row].is_finite())
            .peekable();
        let first = odd.peek().map(|&row| values[row].to_string());
        Self {
            label,
            odd: odd.map(|row| (row, Odd::NotFinite)).collect(),
            first_odd: first.unwrap_or_default(),
            values,
        }
    }

    /// Adds a cell that holds no finite number, and is written so.
    pub(super) fn push_odd(&mut self, odd: Odd, written: &str) {
        if self.first_odd.is_empty() {
            self.first_odd = written.into();
        }
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

impl Measured {
    /// The unit behind a number; a pure number has none.
    pub(super) fn shown_unit(&self) -> String {
        match self.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        }
    }
}
