//! Named columns, whichever kind of file they come from.

use super::column::{Column, Measured, Odd};
use super::conversion::Conversion;
use super::format::{Dialect, Format};
use super::label::Label;
use super::target::Target;
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

/// A file that columns come from.
#[derive(Debug, Clone)]
pub(super) struct Origin {
    pub(super) path: String,
    pub(super) format: Format,
    /// The line of each row, as an editor counts it, or its sample in a file without lines, where not all are in the table.
    pub(super) lines: Vec<usize>,
}

impl Origin {
    /// Where row `row` stands in the file.
    pub(super) fn row_place(&self, row: usize) -> String {
        let number = self.number(row);
        match self.format {
            Format::Mat { .. } => format!("sample {number}"),
            _ => format!("row {number}"),
        }
    }

    fn number(&self, row: usize) -> usize {
        self.lines.get(row).copied().unwrap_or(row + 1)
    }

    fn of_rows(&self, rows: &[usize]) -> Self {
        Self {
            path: self.path.clone(),
            format: self.format.clone(),
            lines: rows.iter().map(|&row| self.number(row)).collect(),
        }
    }
}

/// The columns of a file, or of several that were joined. Those of a MAT file need not be of one length.
#[derive(Debug)]
pub(super) struct Table {
    /// What the file is called, or all of them together.
    pub(super) path: String,
    pub(super) origin: Origin,
    pub(super) columns: Vec<Column>,
    /// What else is in the file.
    pub(super) others: Vec<Other>,
    /// Files whose columns were joined, each with the first of them.
    pub(super) joined: Vec<(usize, Origin)>,
    /// What was done with the file.
    pub(super) notes: Vec<String>,
    /// The lines above the header, which are not read.
    pub(super) above: Vec<String>,
}

impl Table {
    /// The columns of one file.
    pub(super) fn of(
        path: &str,
        format: Format,
        lines: Vec<usize>,
        columns: Vec<Column>,
        others: Vec<Other>,
    ) -> Self {
        Self {
            path: path.into(),
            origin: Origin {
                path: path.into(),
                format,
                lines,
            },
            columns,
            others,
            joined: Vec::new(),
            notes: Vec::new(),
            above: Vec::new(),
        }
    }

    /// Where row `row` of column `column` stands.
    pub(super) fn place(&self, row: usize, column: usize) -> String {
        let shown = self.shown(column);
        let origin = self.origin(column);
        let (path, row) = (&origin.path, origin.row_place(row));
        match origin.format {
            Format::Mat { .. } => format!("{path}, variable {shown}, {row}"),
            _ => format!("{path}, {row}, column {shown}"),
        }
    }

    /// Where the header of column `column` stands.
    pub(super) fn header_place(&self, column: usize) -> String {
        let shown = self.shown(column);
        let Origin { path, format, .. } = self.origin(column);
        match format {
            Format::Csv(Dialect { header_row, .. }) | Format::Xlsx { header_row, .. } => {
                format!("{path}, row {header_row}, column {shown}")
            }
            Format::Mat { .. } => format!("{path}, variable {shown}"),
        }
    }

    /// The file that column `column` comes from.
    pub(super) fn origin(&self, column: usize) -> &Origin {
        let joined = self.joined.iter().rev();
        let mut joined = joined.filter(|(first, _)| column >= *first);
        joined.next().map_or(&self.origin, |(_, origin)| origin)
    }

    /// The rows of the longest column.
    pub(super) fn rows(&self) -> usize {
        let rows = self.columns.iter().map(|column| column.values.len());
        rows.max().unwrap_or(0)
    }

    /// These rows of it, which rise; places are still those of the file.
    pub(super) fn of_rows(&self, rows: &[usize]) -> Self {
        let joined = self.joined.iter();
        Self {
            path: self.path.clone(),
            origin: self.origin.of_rows(rows),
            columns: self
                .columns
                .iter()
                .map(|column| column.of_rows(rows))
                .collect(),
            others: self.others.clone(),
            joined: joined
                .map(|(first, origin)| (*first, origin.of_rows(rows)))
                .collect(),
            notes: self.notes.clone(),
            above: self.above.clone(),
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
        let remedy = match &self.origin(other).format {
            Format::Csv(_) | Format::Xlsx { .. } => "delete or rename one of the two",
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
        quantity.unit(self.unit_text(column, quantity), self.header_place(column))
    }

    /// The unit behind the name of a column. Moments are in s, whatever the head says of their digits.
    fn unit_text(&self, column: usize, quantity: Quantity) -> Option<&str> {
        let Column { label, moments, .. } = &self.columns[column];
        let timed = quantity == Quantity::Time && moments.is_some();
        label.unit.as_deref().filter(|_| !timed)
    }

    /// The unit that column `column` is labelled with, which is taken as `target`.
    ///
    /// # Errors
    /// As [`Table::unit`].
    pub(super) fn unit_as(&self, column: usize, target: Target) -> Result<&'static Unit> {
        let unit = self.unit_text(column, target.quantity());
        let name = &self.columns[column].label.spelt;
        target.unit(unit, self.header_place(column), name)
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
        self.check_moments(column, index, conversion)?;
        let mut values: Vec<Option<f64>> = Vec::with_capacity(column.values.len());
        let mut odd = column.odd.iter().peekable();
        for (row, &value) in column.values.iter().enumerate() {
            let odd = odd.next_if(|(at, _)| *at == row).map(|&(_, odd)| odd);
            let converted = conversion.convert(value);
            values.push(match odd {
                Some(Odd::Empty) => None,
                Some(Odd::Text) => return Err(self.not_a_number(row, index, &column.first_text)),
                Some(Odd::NotFinite) => {
                    return Err(self.not_finite(row, index, &column.first_not_finite));
                }
                None if !converted.is_finite() => {
                    return Err(self.not_finite(row, index, &format!("{value:?}")));
                }
                None => Some(converted),
            });
        }
        Ok(values)
    }

    /// Refuses moments where something else than a time in s is wanted.
    fn check_moments(&self, column: &Column, index: usize, conversion: Conversion) -> Result<()> {
        let seconds: Conversion = Quantity::Time.usual().into();
        match &column.moments {
            Some(moments) if conversion != seconds => Err(Error::input(
                self.header_place(index),
                format!(
                    "holds times of day such as {}, and is taken in {conversion}",
                    quoted(&moments.written)
                ),
                "take it as time [s], or take another column",
            )),
            _ => Ok(()),
        }
    }

    /// The error that the cell of `row` in column `index` is empty.
    pub(super) fn empty(&self, row: usize, index: usize) -> Error {
        Error::input(
            self.place(row, index),
            "the cell is empty",
            "fill in the value, delete its row, or skip such rows of a record with --skip-incomplete-rows",
        )
    }

    fn not_a_number(&self, row: usize, index: usize, text: &str) -> Error {
        let remedy = match &self.origin(index).format {
            Format::Csv(Dialect { decimal: ',', .. }) => {
                "write a number such as 0,5 or 5e-1: this file has decimal commas"
            }
            _ => "write a number such as 0.5 or 5e-1",
        };
        if let Some(moments) = &self.columns[index].moments {
            return Error::input(
                self.place(row, index),
                format!(
                    "{} is no time that follows from {}, with which the column begins",
                    quoted(text),
                    quoted(&moments.written)
                ),
                "write all of them in one way, days as 2024-03-14 and times as 10:22:31.250, or in s",
            );
        }
        let problem = format!("{} is not a number", quoted(text));
        Error::input(self.place(row, index), problem, remedy)
    }

    fn not_finite(&self, row: usize, index: usize, text: &str) -> Error {
        Error::input(
            self.place(row, index),
            format!("{} is not finite", quoted(text)),
            "repair the value, delete its row, or skip such rows of a record with --skip-incomplete-rows",
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

    /// The numbers of column `index`, converted, which are times.
    ///
    /// # Errors
    /// As [`Table::values`] and [`Table::check_rising`].
    pub(super) fn rising_values(&self, index: usize, conversion: Conversion) -> Result<Vec<f64>> {
        let values = self.values(index, conversion)?;
        let unit = conversion.unit.kept();
        check_rising(&values, unit, &self.path, |row| self.place(row, index))?;
        Ok(values)
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
            match unit {
                "s" => {
                    "keep one row where a time is repeated, and sort rows that are out of order; where a clock was set in between, \
                     rename the column and give --sample-interval"
                }
                _ => "sort the rows, and keep one where a value is repeated",
            },
        )),
    }
}
