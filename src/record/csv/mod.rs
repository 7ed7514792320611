//! A table of numbers read from CSV of any common dialect.
//!
//! A row is a line. A quote that is left open therefore cannot swallow the rest of the file, and the row in an error is
//! the line that an editor shows, comments and blank lines counted.

mod cells;
mod layout;
mod text;

pub(super) use text::lines_of;

use super::column::{Column, Odd};
use super::format::{Dialect, Format};
use super::label::{Label, unit_cell};
use super::table::{Table, count, quoted};
use crate::{Error, Result};
use cells::{could_be_thousands, decimal_mark, number};
use layout::{Layout, Line, layout};
use std::borrow::Cow;

struct Row<'a> {
    line: usize,
    cells: Vec<Cow<'a, str>>,
}

impl<'a> Row<'a> {
    fn of(path: &str, (line, text): Line<'a>, delimiter: char) -> Result<Self> {
        let cells = cells::split(text, delimiter).ok_or_else(|| {
            Error::input(
                format!("{path}, row {line}"),
                "has a quote that is left open or has text behind it",
                "quote whole cells, each within its row",
            )
        })?;
        Ok(Self { line, cells })
    }
}

/// Reads `bytes`, the content of the file called `path`.
///
/// # Errors
/// As [`parse`], or the bytes are no text.
pub(super) fn decode(path: &str, bytes: Vec<u8>) -> Result<Table> {
    let (text, encoding) = text::decoded(path, bytes)?;
    table(path, &text, encoding)
}

/// Reads `text`; errors name it `path`.
///
/// # Errors
/// No header, no rows, a row with more or fewer cells than the header, a quote left open; two ways to read it.
pub(super) fn parse(path: &str, text: &str) -> Result<Table> {
    table(path, text, "UTF-8")
}

fn table(path: &str, text: &str, encoding: &'static str) -> Result<Table> {
    let lines = lines(text);
    if lines.is_empty() {
        return Err(Error::input(
            path,
            "is empty",
            "give a CSV file with a header such as \"time [s],command [V],spool [%]\"",
        ));
    }
    let Layout {
        delimiter,
        header,
        units,
    } = layout(path, &lines)?;
    let row = |index: usize| Row::of(path, lines[index], delimiter);
    let mut names = row(header)?.cells;
    let units = units.map(row).transpose()?;
    let first = 1 + units.as_ref().map_or(header, |_| header + 1);
    let rows: Result<Vec<Row>> = (first..lines.len()).map(row).collect();
    let rows = same_width(path, &mut names, rows?)?;

    let decimal = decimal(path, delimiter, &names, &rows)?;
    let mut columns = Vec::with_capacity(names.len());
    for (index, name) in names.iter().enumerate() {
        let below = units.as_ref().and_then(|row| row.cells.get(index));
        let place = || {
            let row = lines[header].0;
            format!("{path}, row {row}, column {}", quoted(name))
        };
        columns.push(Column::new(label(name, below.map(|cell| &**cell), place)?));
    }
    for row in &rows {
        for (column, cell) in columns.iter_mut().zip(&row.cells) {
            match number(cell, decimal) {
                Some(value) if value.is_finite() => column.values.push(value),
                Some(_) => column.push_odd(Odd::NotFinite(cell.to_string())),
                None if cell.is_empty() => column.push_odd(Odd::Empty),
                None => column.push_odd(Odd::Text(cell.to_string())),
            }
        }
    }
    Ok(Table {
        path: path.into(),
        format: Format::Csv(Dialect {
            encoding,
            delimiter,
            decimal,
            header_row: lines[header].0,
            unit_row: units.map(|row| row.line),
        }),
        lines: rows.iter().map(|row| row.line).collect(),
        columns,
        others: Vec::new(),
    })
}

/// The lines that are not blank, no comment and no rule such as `-----`.
fn lines(text: &str) -> Vec<Line<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let line_end = if text.contains('\n') { '\n' } else { '\r' };
    let is_rule = |line: &str| {
        (line.contains("---") || line.contains("===")) && !line.contains(char::is_alphanumeric)
    };
    text.split(line_end)
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim_end_matches('\r')))
        .filter(|(_, line)| {
            !line.trim().is_empty() && !line.trim_start().starts_with('#') && !is_rule(line)
        })
        .collect()
}

/// The rows, without what spreadsheets leave below the data and a delimiter behind each row or behind the header alone.
fn same_width<'a>(
    path: &str,
    names: &mut Vec<Cow<'_, str>>,
    mut rows: Vec<Row<'a>>,
) -> Result<Vec<Row<'a>>> {
    while rows
        .pop_if(|row| row.cells.iter().all(|cell| cell.is_empty()))
        .is_some()
    {}
    let Some(first) = rows.first() else {
        return Err(Error::input(
            path,
            "has a header but no rows",
            "put the samples below the header, one a row",
        ));
    };
    if names.len() == first.cells.len() + 1 {
        names.pop_if(|name| name.is_empty());
    }
    for row in &mut rows {
        if row.cells.len() == names.len() + 1 {
            row.cells.pop_if(|cell| cell.is_empty());
        }
        if row.cells.len() != names.len() {
            return Err(Error::input(
                format!("{path}, row {}", row.line),
                format!(
                    "has {} where the header has {}",
                    count(row.cells.len(), "cell"),
                    count(names.len(), "column")
                ),
                "give every row one cell a column; with decimal commas, separate cells by semicolons",
            ));
        }
    }
    Ok(rows)
}

/// The decimal mark of the first cell that has one.
///
/// # Errors
/// A comma that could as well stand between thousands, wherever there is one.
fn decimal(path: &str, delimiter: char, names: &[Cow<'_, str>], rows: &[Row<'_>]) -> Result<char> {
    if delimiter == ',' {
        return Ok('.');
    }
    let cells = || {
        rows.iter()
            .flat_map(|row| row.cells.iter().enumerate().map(move |cell| (row, cell)))
    };
    let marked = |cell: &str| decimal_mark(cell) == Some(',');
    match cells().find_map(|(_, (_, cell))| decimal_mark(cell)) {
        Some(',') => {}
        mark => return Ok(mark.unwrap_or('.')),
    }
    if cells().any(|(_, (_, cell))| marked(cell) && !could_be_thousands(cell)) {
        return Ok(',');
    }
    let (row, (column, cell)) = cells()
        .find(|(_, (_, cell))| marked(cell))
        .expect("the first mark is such a cell");
    let name = quoted(&names[column]);
    Err(Error::input(
        format!("{path}, row {}, column {name}", row.line),
        format!(
            "{:?} can be {} and {}, and no other cell tells which",
            *cell,
            cell.replace(',', "."),
            cell.replace(',', "")
        ),
        "write decimals with a point, and thousands without a mark",
    ))
}

/// The label of a column with a name and perhaps a cell below it in the row of units.
///
/// # Errors
/// The two give different units.
fn label(name: &str, below: Option<&str>, place: impl Fn() -> String) -> Result<Label> {
    let mut label = Label::parse(name);
    let below = below.map(unit_cell).filter(|unit| !unit.is_empty());
    match (&label.unit, below) {
        (Some(one), Some(other)) if one != other => Err(Error::input(
            place(),
            format!("has the unit {one:?}, but {other:?} in the row of units"),
            "keep one of the two",
        )),
        (None, Some(unit)) => {
            label.unit = Some(unit.into());
            Ok(label)
        }
        _ => Ok(label),
    }
}
