//! What a file does not say of itself, and whoever reads it does.

use super::channel::Channel;
use super::column::{Column, Odd};
use super::label::Label;
use super::mapping::{Mapping, known};
use super::table::Table;
use super::target::Target;
use super::text::count;
use super::unit::Quantity;
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::str::FromStr;

/// How a file is read as a record: what its columns are, when its rows were taken, and which of them may be left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    /// What the columns of the file are.
    pub mappings: Vec<Mapping>,
    /// The time between rows, of a file without a column of time.
    pub sample_interval: Option<SampleInterval>,
    /// Whether rows are left out in which a column that is taken has an empty cell, a NaN or an infinity; without it such a row
    /// is refused.
    pub skip_incomplete_rows: bool,
}

impl Reading {
    /// With these mappings, and nothing else said.
    pub fn with(mappings: &[Mapping]) -> Self {
        Self {
            mappings: mappings.to_vec(),
            ..Self::default()
        }
    }

    /// Gives a table without a column of time one, if the time between its rows is known.
    ///
    /// # Errors
    /// It has one, too.
    pub(super) fn give_time(&self, table: &mut Table) -> Result<()> {
        let Some(interval) = self.sample_interval else {
            return Ok(());
        };
        let known = known(table, &self.mappings);
        if let Some((time, _)) = known.get(&Target::Time) {
            return Err(Error::input(
                table.header_place(*time),
                "is time, and --sample-interval gives another",
                "leave out --sample-interval, or rename the column if it is no time",
            ));
        }
        let command = known.get(&Target::Channel(Channel::Command));
        let lengths = table.columns.iter().map(|column| column.values.len());
        let rows = match command {
            Some((command, _)) => table.columns[*command].values.len(),
            None => lengths.max().unwrap_or(0),
        };
        let times = (0..rows).map(|row| row as f64 * interval.0).collect();
        let label = Label::at("--sample-interval", "time [s]");
        table.columns.push(Column::of(label, times));
        Ok(())
    }

    /// `table` without the rows that are incomplete in `columns`, and what to say of it; `None` where all rows stay.
    pub(super) fn without_incomplete_rows(
        &self,
        table: &Table,
        columns: &[usize],
    ) -> Option<(Table, String)> {
        let incomplete = |column: &usize| {
            let odd = table.columns[*column].odd.iter();
            let odd = odd.filter(|(_, odd)| *odd != Odd::Text);
            odd.map(|(row, _)| *row)
        };
        let skipped: BTreeSet<usize> = match self.skip_incomplete_rows {
            true => columns.iter().flat_map(incomplete).collect(),
            false => return None,
        };
        let first = *skipped.first()?;
        let (mut longest, mut run, mut before) = (1, 0, first);
        for &row in &skipped {
            run = if row == before + 1 { run + 1 } else { 1 };
            longest = longest.max(run);
            before = row;
        }
        let said = format!(
            "skipped {}, the first at {}, up to {longest} one after another",
            count(skipped.len(), "incomplete row"),
            table.origin.row_place(first),
        );
        let kept: Vec<usize> = (0..table.rows())
            .filter(|row| !skipped.contains(row))
            .collect();
        Some((table.of_rows(&kept), said))
    }
}

/// The time between two rows, in s: above zero and finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleInterval(f64);

impl SampleInterval {
    /// In s.
    pub fn seconds(self) -> f64 {
        self.0
    }
}

impl FromStr for SampleInterval {
    type Err = Error;

    /// `1e-3` in s, `1 ms`, `500us`.
    ///
    /// # Errors
    /// No number above zero, or behind it no unit of time.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        let place = format!("--sample-interval {text:?}");
        let number =
            text.trim_end_matches(|letter: char| !letter.is_ascii_digit() && letter != '.');
        let unit = Some(text[number.len()..].trim()).filter(|unit| !unit.is_empty());
        let unit = Quantity::Time.unit(unit, &place)?;
        match number.parse().map(|number| unit.convert(number)) {
            Ok(interval) if interval > 0.0 && interval.is_finite() => Ok(Self(interval)),
            _ => Err(Error::input(
                place,
                "is no time above zero",
                "write the seconds between two rows, such as 1e-3 or 1ms",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_interval_is_in_seconds_unless_it_says_otherwise() {
        for (text, seconds) in [
            ("1e-3", 1e-3),
            ("1 ms", 1e-3),
            ("500us", 5e-4),
            (".002", 2e-3),
            ("2.", 2.0),
            ("2.5 s", 2.5),
        ] {
            let read: SampleInterval = text.parse().unwrap();
            assert_eq!(read.seconds(), seconds, "{text}");
        }
        for text in [
            "0", "-1e-3", "nan", "inf", "1e999", "", "ms", "0,001", "1000 Hz", "1e-3 V", "1 2",
        ] {
            let error = text.parse::<SampleInterval>().unwrap_err().to_string();
            assert!(error.contains("--sample-interval"), "{text}: {error}");
        }
    }
}
