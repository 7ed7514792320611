//! A table of numbers read from CSV of any common dialect.
//!
//! A row is a line. A quote that is left open therefore cannot swallow the rest of the file, and the row in an error is
//! the line that an editor shows, comments and blank lines counted.

mod cells;
mod layout;
mod text;

use super::column::{Column, Odd};
use super::format::{Dialect, Format};
use super::label::{Label, unit_cell, visible};
use super::moment::Moment;
use super::table::{Table, WIDEST};
use super::text::{count, quoted};
use crate::{Error, Result};
use cells::{could_be_thousands, decimal_mark, is_comment, number};
use layout::{Layout, Line, layout};
use std::borrow::Cow;

struct Row<'a> {
    line: usize,
    cells: Vec<Cow<'a, str>>,
}

impl<'a> Row<'a> {
    fn of(path: &str, (line, text): Line<'a>, delimiter: char) -> Result<Self> {
        match cells::split(text, delimiter) {
            Some(cells) if cells.len() <= WIDEST => Ok(Self { line, cells }),
            Some(cells) => Err(Error::input(
                format!("{path}, row {line}"),
                format!(
                    "has {} cells, more than a record can have columns",
                    cells.len()
                ),
                "save only the record's columns, one sample a row",
            )),
            None => Err(layout::broken_quote(path, line)),
        }
    }
}

/// Most numbers that are read, those of the rows included; a cell that holds none counts as [`ODD`] of them.
const LARGEST: usize = 1 << 24;

/// What a cell without a number takes beside its place, in numbers.
const ODD: usize = 2;

/// Reads `bytes`; errors name them `path`.
///
/// # Errors
/// Bytes that are no text; no header, no rows, a row with more or fewer cells than the header, a quote left open; two ways
/// to read it; a line over 1 MiB, more than 10 000 columns, more than 16 million numbers.
pub(super) fn parse(path: &str, bytes: &[u8]) -> Result<Table> {
    let (text, encoding) = text::decoded(path, bytes)?;
    let lines = || lines(&text);
    let mut first = layout::first_lines(path, lines())?;
    if first.is_empty() {
        return Err(Error::input(
            path,
            "is empty",
            "give a CSV file with a header such as \"time [s],command [V],spool [%]\"",
        ));
    }
    let plain = layout(path, &first);
    let mut commented_out = 0;
    if plain
        .as_ref()
        .map_or(true, |plain| plain.has_no_names(&first))
        && let Some(header) = commented_header(&text)
        && let with_it = [&[header][..], &first].concat()
        && layout(path, &with_it).is_ok_and(|layout| layout.heads(&with_it))
    {
        (first, commented_out) = (with_it, 1);
    }
    let Layout {
        delimiter,
        header,
        units,
    } = match commented_out {
        0 => plain,
        _ => layout(path, &first),
    }?;
    let row = |line| Row::of(path, line, delimiter);
    let mut names = row(first[header])?.cells;
    let units = units.map(|units| row(first[units])).transpose()?;
    let above = 1 + units.as_ref().map_or(header, |_| header + 1);
    let body = lines().skip(above - commented_out);
    let Survey { rows, decimal } = survey(path, &mut names, delimiter, body.clone())?;

    let header_row = first[header].0;
    let mut columns = Vec::with_capacity(names.len());
    for (index, name) in names.iter().enumerate() {
        let below = units.as_ref().and_then(|row| row.cells.get(index));
        let place = || format!("{path}, row {header_row}, column {}", quoted(name));
        let label = label(name, below.map(|cell| &**cell), place)?;
        columns.push(Column::new(label, rows));
    }
    let mut taken = numbers(rows, names.len());
    let mut line_of = Vec::with_capacity(rows);
    for line in body.take(rows) {
        let Row { line, cells } = row(line)?;
        line_of.push(line);
        // A row may end before its comment, as `survey` has seen.
        let missing = std::iter::repeat_n(
            &Cow::Borrowed(""),
            columns.len().saturating_sub(cells.len()),
        );
        for (column, cell) in columns.iter_mut().zip(cells.iter().chain(missing)) {
            taken += push(column, cell, decimal);
        }
        check_size(path, line, taken)?;
    }
    let dialect = Dialect {
        encoding,
        delimiter,
        decimal,
        header_row,
        unit_row: units.map(|row| row.line),
    };
    let format = Format::Csv(dialect);
    let mut table = Table::of(path, format, line_of, columns, Vec::new());
    let above = text.lines().take(header_row - 1).map(str::to_owned);
    table.above = above.collect();
    Ok(table)
}

/// Adds what `cell` holds to `column`; how many numbers it takes beside its place.
fn push(column: &mut Column, cell: &str, decimal: char) -> usize {
    let odd = match number(cell, decimal) {
        Some(value) if value.is_finite() && column.moments.is_none() => {
            column.values.push(value);
            return 0;
        }
        Some(value) if !value.is_finite() => Odd::NotFinite,
        None if cell.is_empty() => Odd::Empty,
        None => match Moment::parse(cell) {
            Some(moment) if column.push_moment(moment, cell) => return 0,
            _ => Odd::Text,
        },
        Some(_) => Odd::Text,
    };
    column.push_odd(odd, cell);
    ODD
}

/// What comments begin with; but for the first only in a file that begins with one.
const COMMENTS: [&str; 2] = ["#", "//"];

/// The lines that are not blank, no comment and no rule such as `-----`.
fn lines(text: &str) -> impl Iterator<Item = Line<'_>> + Clone {
    let is_rule = |line: &str| {
        (line.contains("---") || line.contains("===")) && !line.contains(char::is_alphanumeric)
    };
    let sign = comment_sign(text);
    let is_comment = move |line: &str| {
        let line = line.trim_start();
        line.starts_with(COMMENTS[0]) || line.starts_with(sign)
    };
    numbered(text)
        .filter(move |(_, line)| !line.trim().is_empty() && !is_comment(line) && !is_rule(line))
}

/// What the comments of a file begin with, as far as its first line says.
fn comment_sign(text: &str) -> &'static str {
    let first = numbered(text).map(|(_, line)| line.trim_start());
    let first = first.clone().find(|line| !line.is_empty()).unwrap_or("");
    let begins = |sign: &&&str| first.starts_with(**sign);
    COMMENTS.iter().find(begins).unwrap_or(&COMMENTS[0])
}

/// The last of the comments that the file begins with: numpy writes its header there.
fn commented_header(text: &str) -> Option<Line<'_>> {
    let sign = comment_sign(text);
    let begins = numbered(text).filter(|(_, line)| !line.trim().is_empty());
    let comments =
        begins.map_while(|(row, line)| Some((row, line.trim_start().strip_prefix(sign)?)));
    comments.last()
}

/// All lines, with their numbers.
fn numbered(text: &str) -> impl Iterator<Item = Line<'_>> + Clone {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let line_end = if text.contains('\n') { '\n' } else { '\r' };
    let lines = text.split(line_end).enumerate();
    lines.map(|(index, line)| (index + 1, line.trim_end_matches('\r')))
}

/// How many numbers so many rows of so many columns take.
fn numbers(rows: usize, columns: usize) -> usize {
    rows.saturating_mul(columns + 1)
}

/// Refuses a file of which `taken` numbers are read up to line `line`, if they are too many.
fn check_size(path: &str, line: usize, taken: usize) -> Result<()> {
    match taken > LARGEST {
        false => Ok(()),
        true => Err(Error::input(
            format!("{path}, row {line}"),
            format!("is beyond {} million cells", LARGEST / 1_000_000),
            "save only the record's columns, or fewer samples",
        )),
    }
}

/// What has to be known of the rows before they are read.
struct Survey {
    /// How many there are, without what spreadsheets leave below the data.
    rows: usize,
    decimal: char,
}

/// Looks through all rows, which must be as wide as the header: a delimiter behind each row or behind the header alone is
/// no cell.
fn survey<'a>(
    path: &str,
    names: &mut Vec<Cow<'_, str>>,
    delimiter: char,
    lines: impl Iterator<Item = Line<'a>>,
) -> Result<Survey> {
    let mut rows = 0;
    let mut marks = Marks::default();
    let ends_in_comments = names.last().is_some_and(|name| is_comment(name));
    let mut wrong = Ok(());
    for (index, line) in lines.enumerate() {
        let Row { line, mut cells } = Row::of(path, line, delimiter)?;
        if index == 0 && names.len() == cells.len() + 1 {
            names.pop_if(|name| name.is_empty());
        }
        if cells.len() == names.len() + 1 {
            cells.pop_if(|cell| cell.is_empty());
        }
        let without_comment = ends_in_comments && cells.len() + 1 == names.len();
        if cells.len() != names.len() && !without_comment && wrong.is_ok() {
            wrong = Err(Error::input(
                format!("{path}, row {line}"),
                format!(
                    "has {} where the header has {}",
                    count(cells.len(), "cell"),
                    count(names.len(), "column")
                ),
                "give every row one cell a column; with decimal commas, separate cells by semicolons",
            ));
        }
        if cells.iter().all(|cell| cell.is_empty()) {
            continue;
        }
        wrong?;
        wrong = Ok(());
        rows = index + 1;
        check_size(path, line, numbers(rows, names.len()))?;
        if delimiter != ',' {
            marks.look(line, &cells);
        }
    }
    match rows {
        0 => Err(Error::input(
            path,
            "has a header but no rows",
            "put the samples below the header, one a row",
        )),
        _ => Ok(Survey {
            rows,
            decimal: marks.decimal(path, names)?,
        }),
    }
}

/// What the cells so far say of the decimal mark.
#[derive(Default)]
struct Marks {
    /// That of the first cell that has one.
    first: Option<char>,
    /// Whether a comma was found that cannot stand between thousands.
    decimal_comma: bool,
    /// Row, column and content of the first cell whose comma can.
    doubtful: Option<(usize, usize, String)>,
}

impl Marks {
    fn look(&mut self, line: usize, cells: &[Cow<'_, str>]) {
        for (column, cell) in cells.iter().enumerate() {
            if self.first == Some('.') || self.decimal_comma {
                return;
            }
            let mark = decimal_mark(cell);
            self.first = self.first.or(mark);
            match mark {
                Some(',') if self.first != Some(',') => {}
                Some(',') if could_be_thousands(cell) => {
                    self.doubtful
                        .get_or_insert_with(|| (line, column, cell.to_string()));
                }
                Some(',') => self.decimal_comma = true,
                _ => {}
            }
        }
    }

    /// The decimal mark: a point where there is none.
    ///
    /// # Errors
    /// A comma that could as well stand between thousands, wherever there is one.
    fn decimal(self, path: &str, names: &[Cow<'_, str>]) -> Result<char> {
        match self.doubtful {
            _ if self.decimal_comma => Ok(','),
            None => Ok('.'),
            Some((line, column, cell)) => Err(Error::input(
                format!("{path}, row {line}, column {}", quoted(&names[column])),
                format!(
                    "{cell:?} can be {} and {}, and no other cell tells which",
                    cell.replace(',', "."),
                    cell.replace(',', "")
                ),
                "write decimals with a point, and thousands without a mark",
            )),
        }
    }
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
            format!(
                "has the unit {}, but {} in the row of units",
                quoted(one),
                quoted(other)
            ),
            "keep one of the two",
        )),
        (None, Some(unit)) => {
            label.unit = Some(visible(unit));
            Ok(label)
        }
        _ => Ok(label),
    }
}
