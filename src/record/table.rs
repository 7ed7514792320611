//! Named columns, whichever kind of file they come from.

use super::column::{Column, Measured, Odd};
use super::conversion::Conversion;
use super::format::{Dialect, Format};
use super::label::Label;
use super::mapping::Target;
use super::text::{count, listed, quoted};
use super::unit::{Quantity, Unit};
use crate::{Error, Result};
use std::path::Path;

/// Most columns that a table may have: no record has as many.
pub(super) const WIDEST: usize = 10_000;

/// The stem of a path's file name: what a record or curve is called.
pub(super) fn stem(path: &str) -> String {
    Path::new(path)
        .file_stem()
        .map_or_else(|| path.into(), |stem| stem.to_string_lossy().into_owned())
}

/// Something in a file that is no column, and perhaps why it cannot be one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Other {
    /// Its name in the file.
    pub(super) name: String,
    /// What it is, such as `text`.
    pub(super) what: String,
    /// How its values could be had, where it may hide some.
    pub(super) remedy: Option<String>,
}

/// The columns of a file. Those of a MAT file need not be of one length.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) path: String,
    pub(super) format: Format,
    /// The line of each row, as an editor counts it; none where the file has no lines.
    pub(super) lines: Vec<usize>,
    pub(super) columns: Vec<Column>,
    /// What else is in the file.
    pub(super) others: Vec<Other>,
}

impl Table {
    /// Where row `row` of column `column` stands.
    pub(super) fn place(&self, row: usize, column: usize) -> String {
        let (path, shown) = (&self.path, self.shown(column));
        match self.lines.get(row) {
            Some(line) => format!("{path}, row {line}, column {shown}"),
            None => format!("{path}, variable {shown}, sample {}", row + 1),
        }
    }

    /// Where the header of column `column` stands.
    pub(super) fn header_place(&self, column: usize) -> String {
        let (path, shown) = (&self.path, self.shown(column));
        match &self.format {
            Format::Csv(dialect) => format!("{path}, row {}, column {shown}", dialect.header_row),
            Format::Mat { .. } => format!("{path}, variable {shown}"),
        }
    }

    fn shown(&self, column: usize) -> String {
        quoted(&self.columns[column].label.text)
    }

    /// The error that column `wanted` is not there. It may be in what the file hides.
    pub(super) fn missing(&self, wanted: &str, remedy: &str) -> Error {
        let hiding = |other: &&Other| other.remedy.is_some();
        if let Some(other) = self.others.iter().find(hiding) {
            let (name, what) = (quoted(&other.name), &other.what);
            return Error::input(
                format!("{}, variable {name}", self.path),
                format!("is {what}, and no column {wanted} is beside it"),
                other.remedy.as_deref().unwrap_or(remedy),
            );
        }
        let names = self.columns.iter().map(|column| column.label.text.as_str());
        Error::input(
            &self.path,
            format!("has no column {wanted}, only {}", listed(names)),
            remedy,
        )
    }

    /// The error that columns `one` and `other` are both `what`.
    pub(super) fn twice(&self, what: &str, one: usize, other: usize) -> Error {
        let remedy = match &self.format {
            Format::Csv(_) => "delete or rename one of the two",
            Format::Mat { .. } => {
                "let --map name the one to take, such as --map \"VARIABLE=CHANNEL [UNIT]\", or rename one of the two"
            }
        };
        Error::input(
            self.header_place(other),
            format!("is {what} a second time, after {}", self.shown(one)),
            remedy,
        )
    }

    /// The column that the user calls `wanted`; `None` if there is none. One that is called exactly so comes first.
    ///
    /// # Errors
    /// There are two.
    pub(super) fn called(&self, wanted: &str) -> Result<Option<usize>> {
        let called = |column: &Column| column.label.called(wanted);
        match self.columns.iter().map(called).max() {
            None | Some(0) => Ok(None),
            Some(best) => self.find(&format!("{wanted:?}"), |label| label.called(wanted) == best),
        }
    }

    /// The one column whose label satisfies `wanted`, which is called `what`; `None` if there is none.
    ///
    /// # Errors
    /// There are two.
    pub(super) fn find(
        &self,
        what: &str,
        wanted: impl Fn(&Label) -> bool,
    ) -> Result<Option<usize>> {
        let mut found =
            (0..self.columns.len()).filter(|&column| wanted(&self.columns[column].label));
        match (found.next(), found.next()) {
            (Some(one), Some(other)) => Err(self.twice(what, one, other)),
            (one, _) => Ok(one),
        }
    }

    /// The unit that column `column` is labelled with.
    ///
    /// # Errors
    /// Unknown, or missing where it is needed.
    pub(super) fn unit(&self, column: usize, quantity: Quantity) -> Result<&'static Unit> {
        quantity.unit(
            self.columns[column].label.unit.as_deref(),
            self.header_place(column),
        )
    }

    /// The unit that column `column` is labelled with, which is taken as `target`.
    ///
    /// # Errors
    /// As [`Table::unit`].
    pub(super) fn unit_as(&self, column: usize, target: Target) -> Result<&'static Unit> {
        let label = &self.columns[column].label;
        let place = self.header_place(column);
        target.unit(label.unit.as_deref(), place, &label.spelt)
    }

    /// The numbers of column `index`, converted; `None` for an empty cell.
    ///
    /// # Errors
    /// A cell that is no finite number.
    pub(super) fn sparse_values(
        &self,
        index: usize,
        conversion: impl Into<Conversion>,
    ) -> Result<Vec<Option<f64>>> {
        let conversion = conversion.into();
        let column = &self.columns[index];
        let mut values: Vec<Option<f64>> = Vec::with_capacity(column.values.len());
        let mut odd = column.odd.iter().peekable();
        for (row, &value) in column.values.iter().enumerate() {
            let odd = odd.next_if(|(at, _)| *at == row).map(|&(_, odd)| odd);
            let written = &column.first_odd;
            let converted = conversion.convert(value);
            values.push(match odd {
                Some(Odd::Empty) => None,
                Some(Odd::Text) => return Err(self.not_a_number(row, index, written)),
                Some(Odd::NotFinite) => return Err(self.not_finite(row, index, written)),
                None if !converted.is_finite() => {
                    return Err(self.not_finite(row, index, &format!("{value:?}")));
                }
                None => Some(converted),
            });
        }
        Ok(values)
    }

    /// The error that the cell of `row` in column `index` is empty.
    pub(super) fn empty(&self, row: usize, index: usize) -> Error {
        Error::input(
            self.place(row, index),
            "the cell is empty",
            "fill in the value or delete its row",
        )
    }

    fn not_a_number(&self, row: usize, index: usize, text: &str) -> Error {
        let remedy = match &self.format {
            Format::Csv(Dialect { decimal: ',', .. }) => {
                "write a number such as 0,5 or 5e-1: this file has decimal commas"
            }
            _ => "write a number such as 0.5 or 5e-1",
        };
        let problem = format!("{} is not a number", quoted(text));
        Error::input(self.place(row, index), problem, remedy)
    }

    fn not_finite(&self, row: usize, index: usize, text: &str) -> Error {
        Error::input(
            self.place(row, index),
            format!("{} is not finite", quoted(text)),
            "repair the value or delete its row",
        )
    }

    /// The numbers of column `index`, converted.
    ///
    /// # Errors
    /// A cell that is empty or no finite number.
    pub(super) fn values(
        &self,
        index: usize,
        conversion: impl Into<Conversion>,
    ) -> Result<Vec<f64>> {
        let present =
            |(row, value): (usize, Option<f64>)| value.ok_or_else(|| self.empty(row, index));
        self.sparse_values(index, conversion)?
            .into_iter()
            .enumerate()
            .map(present)
            .collect()
    }

    /// The column called `name`, if there is one.
    ///
    /// # Errors
    /// It is there twice, its unit is not known, or a cell is no finite number.
    pub(super) fn column(&self, name: &str, quantity: Quantity) -> Result<Option<Measured>> {
        let Some(index) = self.find(name, |label| label.name == name)? else {
            return Ok(None);
        };
        let unit = self.unit(index, quantity)?;
        Ok(Some(Measured {
            index,
            values: self.values(index, unit)?,
            unit: unit.kept(),
        }))
    }

    /// The column called `name`.
    ///
    /// # Errors
    /// As [`Table::column`], or it is not there.
    pub(super) fn needed_column(&self, name: &str, quantity: Quantity) -> Result<Measured> {
        self.column(name, quantity)?.ok_or_else(|| {
            let wanted = format!("\"{name} [{}]\"", quantity.usual().kept());
            self.missing(&wanted, "add it or rename the column that holds it")
        })
    }

    /// Refuses columns that have not as many values as the first of them.
    ///
    /// # Errors
    /// One has not.
    pub(super) fn check_lengths(&self, mut columns: impl Iterator<Item = usize>) -> Result<()> {
        let Some(first) = columns.next() else {
            return Ok(());
        };
        let length = |column: usize| self.columns[column].values.len();
        match columns.find(|&other| length(other) != length(first)) {
            None => Ok(()),
            Some(other) => Err(Error::input(
                self.header_place(other),
                format!(
                    "has {} where {} has {}",
                    count(length(other), "value"),
                    self.shown(first),
                    length(first)
                ),
                "save columns that belong to the same times",
            )),
        }
    }

    /// Refuses the first value of `column` that is not `good`.
    ///
    /// # Errors
    /// There is one.
    pub(super) fn check(
        &self,
        column: &Measured,
        good: impl Fn(f64) -> bool,
        problem: &str,
        remedy: &str,
    ) -> Result<()> {
        match column.values.iter().position(|&value| !good(value)) {
            None => Ok(()),
            Some(row) => Err(Error::input(
                self.place(row, column.index),
                format!("{}{} {problem}", column.values[row], column.shown_unit()),
                remedy,
            )),
        }
    }

    /// Refuses a column with fewer than two values, or whose values do not rise strictly.
    ///
    /// # Errors
    /// It is one.
    pub(super) fn check_rising(&self, column: &Measured) -> Result<()> {
        check_rising(&column.values, column.unit, &self.path, |row| {
            self.place(row, column.index)
        })
    }
}

/// Refuses fewer than two values, or values that do not rise strictly. `whole` names the lot, `place` one of them.
///
/// # Errors
/// They are such.
pub(super) fn check_rising(
    values: &[f64],
    unit: &str,
    whole: &str,
    place: impl Fn(usize) -> String,
) -> Result<()> {
    if values.len() < 2 {
        return Err(Error::input(
            whole,
            format!("has {}", count(values.len(), "row")),
            "give at least two",
        ));
    }
    match values.windows(2).position(|pair| pair[0] >= pair[1]) {
        None => Ok(()),
        Some(row) => Err(Error::input(
            place(row + 1),
            format!(
                "{} {unit} does not rise above {} {unit} before it",
                values[row + 1],
                values[row]
            ),
            "sort the rows, and keep one where a value is repeated",
        )),
    }
}
