//! A table of numbers read from CSV of any common dialect.
//!
//! A row is a line. A quote that is left open therefore cannot swallow the rest of the file, and the row in an error is
//! the line that an editor shows, comments and blank lines counted.

use super::unit::{Quantity, Unit};
use crate::{Error, Result};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest line that is read, in bytes: a file that is no CSV must not fill the memory.
const LONGEST_LINE: usize = 1 << 20;

/// The text of the file at `path`.
///
/// # Errors
/// A file that is missing, unreadable, not UTF-8, or has a line over 1 MiB.
pub(super) fn read_text(path: &Path) -> Result<String> {
    let shown = path.display();
    let unreadable = |error: std::io::Error| {
        Error::input(
            &shown,
            format!("cannot be read: {error}"),
            "check the path and that it is a readable file",
        )
    };
    let mut reader = BufReader::new(File::open(path).map_err(&unreadable)?);
    let mut bytes = Vec::new();
    for row in 1.. {
        let length = reader
            .by_ref()
            .take(LONGEST_LINE as u64 + 1)
            .read_until(b'\n', &mut bytes)
            .map_err(&unreadable)?;
        if length > LONGEST_LINE {
            return Err(Error::input(
                format!("{shown}, row {row}"),
                "is longer than 1 MiB",
                "give a CSV file with one sample a line",
            ));
        }
        if length == 0 {
            break;
        }
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let row = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        Error::input(
            format!("{shown}, row {row}"),
            "is not UTF-8 text",
            "save the file as CSV in UTF-8",
        )
    })
}

/// The stem of a path's file name: what a record or curve is called.
pub(super) fn stem(path: &str) -> String {
    Path::new(path)
        .file_stem()
        .map_or_else(|| path.into(), |stem| stem.to_string_lossy().into_owned())
}

/// A header cell `name [unit]`.
#[derive(Debug)]
pub(super) struct Label {
    /// As it stands in the file.
    pub(super) text: String,
    /// Lower case, with `_` for blanks and hyphens.
    pub(super) name: String,
    pub(super) unit: Option<String>,
}

impl Label {
    pub(super) fn parse(text: &str) -> Self {
        let text = text.trim();
        let (name, unit) = match text
            .strip_suffix(']')
            .and_then(|text| text.rsplit_once('['))
        {
            Some((name, unit)) => (name.trim(), Some(unit.trim())),
            None => (text, None),
        };
        Self {
            text: text.into(),
            name: name.to_lowercase().replace([' ', '-'], "_"),
            unit: unit.filter(|unit| !unit.is_empty()).map(String::from),
        }
    }
}

/// A column of numbers, in the unit that its quantity is kept in.
pub(super) struct Column {
    pub(super) index: usize,
    pub(super) values: Vec<f64>,
    pub(super) unit: &'static str,
}

struct Row<'a> {
    line: usize,
    cells: Vec<Cow<'a, str>>,
}

/// A header and at least one row with as many cells.
pub(super) struct Table<'a> {
    path: &'a str,
    header_line: usize,
    pub(super) labels: Vec<Label>,
    rows: Vec<Row<'a>>,
    decimal: char,
}

impl<'a> Table<'a> {
    /// Reads `text`; errors name it `path`.
    ///
    /// # Errors
    /// No header, no rows, a row with more or fewer cells than the header, a quote left open.
    pub(super) fn parse(path: &'a str, text: &'a str) -> Result<Self> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let line_end = if text.contains('\n') { '\n' } else { '\r' };
        let mut lines = text
            .split(line_end)
            .enumerate()
            .map(|(index, line)| (index + 1, line.trim_end_matches('\r')))
            .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));

        let (header_line, header) = lines.next().ok_or_else(|| {
            Error::input(
                path,
                "is empty",
                "give a CSV file with a header such as \"time [s],command [V],spool [%]\"",
            )
        })?;
        let delimiter = delimiter(header);
        let split = |line, text| {
            split(text, delimiter).ok_or_else(|| {
                Error::input(
                    format!("{path}, row {line}"),
                    "has a quote that is left open or has text behind it",
                    "quote whole cells, each within its row",
                )
            })
        };
        let cells = split(header_line, header)?;
        if cells.iter().all(|cell| cell.parse::<f64>().is_ok()) {
            return Err(Error::input(
                format!("{path}, row {header_line}"),
                "holds numbers where the header should be",
                "put a header such as \"time [s],command [V],spool [%]\" first, without a # before it",
            ));
        }

        let mut rows = Vec::new();
        for (line, text) in lines {
            let cells = split(line, text)?;
            rows.push(Row { line, cells });
        }
        // What spreadsheets leave below the data.
        while rows
            .pop_if(|row| row.cells.iter().all(|cell| cell.is_empty()))
            .is_some()
        {}
        if rows.is_empty() {
            return Err(Error::input(
                path,
                "has a header but no rows",
                "put the samples below the header, one a row",
            ));
        }
        if let Some(row) = rows.iter().find(|row| row.cells.len() != cells.len()) {
            return Err(Error::input(
                format!("{path}, row {}", row.line),
                format!(
                    "has {} where the header has {}",
                    count(row.cells.len(), "cell"),
                    count(cells.len(), "column")
                ),
                "give every row one cell a column; with decimal commas, separate cells by semicolons",
            ));
        }
        let decimal = match delimiter {
            ',' => '.',
            _ => rows
                .iter()
                .flat_map(|row| &row.cells)
                .find_map(|cell| decimal_mark(cell))
                .unwrap_or('.'),
        };
        Ok(Self {
            path,
            header_line,
            labels: cells.iter().map(|cell| Label::parse(cell)).collect(),
            rows,
            decimal,
        })
    }

    /// Where row `row` of column `column` stands.
    pub(super) fn place(&self, row: usize, column: usize) -> String {
        let line = self.rows[row].line;
        format!("{}, row {line}, column {}", self.path, self.shown(column))
    }

    /// Where the header of column `column` stands.
    pub(super) fn header_place(&self, column: usize) -> String {
        let line = self.header_line;
        format!("{}, row {line}, column {}", self.path, self.shown(column))
    }

    fn shown(&self, column: usize) -> String {
        quoted(&self.labels[column].text)
    }

    /// The columns in the file, for an error that misses one.
    fn present(&self) -> String {
        const MOST: usize = 20;
        let shown = (0..self.labels.len()).map(|column| self.shown(column));
        let mut present: Vec<String> = shown.take(MOST).collect();
        if self.labels.len() > MOST {
            present.push(format!("and {} more", self.labels.len() - MOST));
        }
        present.join(", ")
    }

    /// The error that column `wanted` is not there.
    pub(super) fn missing(&self, wanted: &str, remedy: &str) -> Error {
        Error::input(
            self.path,
            format!("has no column {wanted}, only {}", self.present()),
            remedy,
        )
    }

    /// The error that columns `one` and `other` are both `what`.
    pub(super) fn twice(&self, what: &str, one: usize, other: usize) -> Error {
        Error::input(
            self.header_place(other),
            format!("is {what} a second time, after {}", self.shown(one)),
            "delete or rename one of the two",
        )
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
        let mut found = (0..self.labels.len()).filter(|&column| wanted(&self.labels[column]));
        match (found.next(), found.next()) {
            (Some(one), Some(other)) => Err(self.twice(what, one, other)),
            (one, _) => Ok(one),
        }
    }

    /// The unit in the header of column `column`.
    ///
    /// # Errors
    /// Unknown, or missing where it is needed.
    pub(super) fn unit(&self, column: usize, quantity: Quantity) -> Result<&'static Unit> {
        quantity.unit(
            self.labels[column].unit.as_deref(),
            self.header_place(column),
        )
    }

    /// The numbers of column `index`, which is in `unit`; `None` for an empty cell.
    ///
    /// # Errors
    /// A cell that is no finite number.
    pub(super) fn sparse_values(&self, index: usize, unit: &Unit) -> Result<Vec<Option<f64>>> {
        let value = |(row, cell): (usize, &str)| {
            if cell.is_empty() {
                return Ok(None);
            }
            let number = self.number(cell).ok_or_else(|| {
                let remedy = match self.decimal {
                    ',' => "write a number such as 0,5 or 5e-1: this file has decimal commas",
                    _ => "write a number such as 0.5 or 5e-1",
                };
                let problem = format!("{} is not a number", quoted(cell));
                Error::input(self.place(row, index), problem, remedy)
            })?;
            let value = unit.convert(number);
            if value.is_finite() {
                Ok(Some(value))
            } else {
                Err(Error::input(
                    self.place(row, index),
                    format!("{} is not finite", quoted(cell)),
                    "repair the value or delete its row",
                ))
            }
        };
        self.rows
            .iter()
            .map(|row| row.cells[index].as_ref())
            .enumerate()
            .map(value)
            .collect()
    }

    /// The numbers of column `index`, which is in `unit`.
    ///
    /// # Errors
    /// A cell that is empty or no finite number.
    pub(super) fn values(&self, index: usize, unit: &Unit) -> Result<Vec<f64>> {
        let present = |(row, value): (usize, Option<f64>)| {
            value.ok_or_else(|| {
                Error::input(
                    self.place(row, index),
                    "the cell is empty",
                    "fill in the value or delete its row",
                )
            })
        };
        self.sparse_values(index, unit)?
            .into_iter()
            .enumerate()
            .map(present)
            .collect()
    }

    /// The column called `name`, if there is one.
    ///
    /// # Errors
    /// It is there twice, its unit is not known, or a cell is no finite number.
    pub(super) fn column(&self, name: &str, quantity: Quantity) -> Result<Option<Column>> {
        let Some(index) = self.find(name, |label| label.name == name)? else {
            return Ok(None);
        };
        let unit = self.unit(index, quantity)?;
        Ok(Some(Column {
            index,
            values: self.values(index, unit)?,
            unit: unit.kept(),
        }))
    }

    /// The column called `name`.
    ///
    /// # Errors
    /// As [`Table::column`], or it is not there.
    pub(super) fn needed_column(&self, name: &str, quantity: Quantity) -> Result<Column> {
        self.column(name, quantity)?.ok_or_else(|| {
            let wanted = format!("\"{name} [{}]\"", quantity.usual().kept());
            self.missing(&wanted, "add it or rename the column that holds it")
        })
    }

    /// Refuses the first value of `column` that is not `good`.
    ///
    /// # Errors
    /// There is one.
    pub(super) fn check(
        &self,
        column: &Column,
        good: impl Fn(f64) -> bool,
        problem: &str,
        remedy: &str,
    ) -> Result<()> {
        match column.values.iter().position(|&value| !good(value)) {
            None => Ok(()),
            Some(row) => Err(Error::input(
                self.place(row, column.index),
                format!("{} {} {problem}", column.values[row], column.unit),
                remedy,
            )),
        }
    }

    /// Refuses a column with fewer than two values, or whose values do not rise strictly.
    ///
    /// # Errors
    /// It is one.
    pub(super) fn check_rising(&self, column: &Column) -> Result<()> {
        check_rising(&column.values, column.unit, self.path, |row| {
            self.place(row, column.index)
        })
    }

    fn number(&self, cell: &str) -> Option<f64> {
        match self.decimal {
            ',' if cell.contains('.') => None,
            ',' => cell.replace(',', ".").parse().ok(),
            _ => cell.parse().ok(),
        }
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

/// The delimiter that the header has most of; on a tie a semicolon, then a tab.
fn delimiter(header: &str) -> char {
    let count = |delimiter: char| {
        let outside_quotes = header.split('"').step_by(2);
        outside_quotes
            .map(|part| part.matches(delimiter).count())
            .sum::<usize>()
    };
    [',', '\t', ';']
        .into_iter()
        .max_by_key(|&delimiter| count(delimiter))
        .unwrap_or(',')
}

/// The cells of a line without blanks and quotes around them; `None` where a quote is left open or has text behind it.
fn split(line: &str, delimiter: char) -> Option<Vec<Cow<'_, str>>> {
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let quoted = rest.trim_start_matches(' ').strip_prefix('"');
        let (cell, after) = match quoted {
            Some(quoted) => unquote(quoted)?,
            None => {
                let end = rest.find(delimiter).unwrap_or(rest.len());
                (rest[..end].trim().into(), &rest[end..])
            }
        };
        cells.push(cell);
        match after.strip_prefix(delimiter) {
            Some(next) => rest = next,
            None if after.is_empty() => return Some(cells),
            None => return None,
        }
    }
}

/// What stands before the closing quote, and what follows it.
fn unquote(quoted: &str) -> Option<(Cow<'_, str>, &str)> {
    let mut from = 0;
    let end = loop {
        let quote = from + quoted[from..].find('"')?;
        if !quoted[quote + 1..].starts_with('"') {
            break quote;
        }
        from = quote + 2;
    };
    let cell = quoted[..end].trim();
    let cell = if cell.contains('"') {
        cell.replace("\"\"", "\"").into()
    } else {
        cell.into()
    };
    Some((cell, quoted[end + 1..].trim_start_matches(' ')))
}

/// The decimal mark of a cell that is a number with one.
fn decimal_mark(cell: &str) -> Option<char> {
    let mark = cell.chars().find(|mark| matches!(mark, '.' | ','))?;
    cell.replace(',', ".")
        .parse::<f64>()
        .is_ok()
        .then_some(mark)
}

/// `text` in quotes, on one line and short.
fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    match text.char_indices().nth(LONGEST) {
        None => format!("{text:?}"),
        Some((end, _)) => format!("{:?}...", &text[..end]),
    }
}

fn count(number: usize, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {what}{plural}")
}
