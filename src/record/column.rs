//! A column of a file, and one of a record.

use super::label::Label;
use super::moment::{Moment, Moments};

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
    /// How the first of them that is a text is written.
    pub(super) first_text: String,
    /// How the first of them that is not finite is written.
    pub(super) first_not_finite: String,
    /// Where cells are times of day: the values are then in s since the first.
    pub(super) moments: Option<Moments>,
}

impl Column {
    /// A column that will have so many values.
    pub(super) fn new(label: Label, rows: usize) -> Self {
        Self {
            label,
            values: Vec::with_capacity(rows),
            odd: Vec::new(),
            first_text: String::new(),
            first_not_finite: String::new(),
            moments: None,
        }
    }

    /// A column of these values.
    pub(super) fn of(label: Label, values: Vec<f64>) -> Self {
        let mut odd = (0..values.len())
            .filter(|&row| !values[row].is_finite())
            .peekable();
        let first = odd.peek().map(|&row| values[row].to_string());
        Self {
            odd: odd.map(|row| (row, Odd::NotFinite)).collect(),
            first_not_finite: first.unwrap_or_default(),
            values,
            ..Self::new(label, 0)
        }
    }

    /// These rows of it, which rise, as far as it has them.
    pub(super) fn of_rows(&self, rows: &[usize]) -> Self {
        let mut odd = self.odd.iter().peekable();
        let mut kept = Self {
            first_text: self.first_text.clone(),
            first_not_finite: self.first_not_finite.clone(),
            moments: self.moments.clone(),
            ..Self::new(self.label.clone(), rows.len())
        };
        for (place, &row) in rows.iter().enumerate() {
            let Some(&value) = self.values.get(row) else {
                break;
            };
            while odd.next_if(|(at, _)| *at < row).is_some() {}
            if let Some((_, odd)) = odd.next_if(|(at, _)| *at == row) {
                kept.odd.push((place, *odd));
            }
            kept.values.push(value);
        }
        kept
    }

    /// Adds a moment, which is written so, unless cells before it are numbers or moments of another kind.
    pub(super) fn push_moment(&mut self, moment: Moment, written: &str) -> bool {
        let value = match &mut self.moments {
            Some(moments) => moments.next(moment),
            None if self.values.len() > self.odd.len() => None,
            None => {
                self.moments = Some(Moments::from(moment, written));
                Some(0.0)
            }
        };
        self.values.extend(value);
        value.is_some()
    }

    /// Adds a cell that holds no finite number, and is written so.
    pub(super) fn push_odd(&mut self, odd: Odd, written: &str) {
        let first = match odd {
            Odd::Text => &mut self.first_text,
            Odd::NotFinite => &mut self.first_not_finite,
            Odd::Empty => &mut String::new(),
        };
        if first.is_empty() {
            *first = written.into();
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
