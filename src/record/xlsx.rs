//! A table of numbers read from a sheet of an Excel workbook.
//!
//! Its cells are written down as text of one dialect, so that header, units and samples are found as in any other file.

use super::csv;
use super::format::Format;
use super::label::visible;
use super::table::{Other, Table, WIDEST};
use super::text::{listed, quoted};
use crate::{Error, Result};
use calamine::{Data, Reader, SheetType, Xlsx};
use std::fmt::Display;
use std::io::{Cursor, Read, copy, sink};
use zip::ZipArchive;

/// Most bytes that a workbook may unpack to, and that the text of a sheet may have.
const LARGEST: u64 = 128 << 20;

/// Rows of a sheet, of which Excel has no more.
const ROWS: usize = 1 << 20;

/// The days that Excel has, to the end of the year 9999.
const DAYS: std::ops::Range<f64> = 0.0..2_958_466.0;

const SAVE: &str = "save the sheet with the record as CSV in UTF-8";

/// Whether a file that begins with `bytes` is a packed one, as workbooks are.
pub(super) fn is_xlsx(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// The columns of the only sheet in `bytes` that holds a table, or of that of this name; errors name the file `path`.
///
/// # Errors
/// No workbook, damage, more than 128 MiB of content; no sheet with a table or of this name, or several without one.
pub(super) fn parse(path: &str, bytes: &[u8], wanted: Option<&str>) -> Result<Table> {
    let wrong = |problem: String| Error::input(path, problem, SAVE);
    check_size(bytes).map_err(wrong)?;
    let unread = |error: calamine::XlsxError| {
        let problem = quoted(&error.to_string());
        wrong(format!("is no Excel workbook that can be read: {problem}"))
    };
    let mut workbook: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(unread)?;
    let (mut tables, mut others, mut first_error) = (Vec::new(), Vec::new(), None);
    let sheets = workbook.sheets_metadata().iter();
    let sheets = sheets.filter(|sheet| sheet.typ == SheetType::WorkSheet);
    let mut sheets: Vec<String> = sheets.map(|sheet| sheet.name.clone()).collect();
    if let Some(wanted) = wanted {
        let known = sheets.iter().position(|sheet| sheet == wanted);
        let Some(known) = known else {
            let names = listed(sheets.iter().map(String::as_str));
            let problem = format!("has no sheet {}, only {names}", quoted(wanted));
            return Err(Error::input(path, problem, "name one of these behind #"));
        };
        sheets = vec![sheets.swap_remove(known)];
    }
    for sheet in sheets {
        let mut cells = workbook.worksheet_cells_reader(&sheet).map_err(unread)?;
        let mut lines = Lines::default();
        while let Some(found) = cells.next_cell().map_err(unread)? {
            let (row, column) = found.get_position();
            let cell = cell(&Data::from(found.get_value().clone()));
            lines
                .add(row as usize, column as usize, &cell)
                .map_err(|problem| wrong(format!("sheet {} {problem}", quoted(&sheet))))?;
        }
        let text = lines.text();
        match csv::parse(path, text.as_bytes()) {
            Ok(table) => tables.push((sheet, table)),
            Err(error) => {
                if !text.is_empty() {
                    first_error.get_or_insert(error);
                }
                others.push(Other {
                    name: visible(&sheet),
                    what: "a sheet without a table".into(),
                    remedy: None,
                });
            }
        }
    }
    let several = tables.len() > 1;
    if several {
        let names = tables.iter().map(|(sheet, _)| sheet.as_str());
        let problem = format!("has tables in the sheets {}", listed(names));
        let remedy = format!(
            "name one: {}, or {SAVE}",
            quoted(&format!("{path}#{}", visible(&tables[0].0)))
        );
        return Err(Error::input(path, problem, remedy));
    }
    let Some((sheet, table)) = tables.pop() else {
        return Err(first_error.unwrap_or_else(|| wrong("has no sheet with a cell".into())));
    };
    let Format::Csv(dialect) = table.origin.format else {
        unreachable!("it was read as such");
    };
    let format = Format::Xlsx {
        sheet,
        header_row: dialect.header_row,
        unit_row: dialect.unit_row,
    };
    Ok(Table::of(
        path,
        format,
        table.origin.lines,
        table.columns,
        others,
    ))
}

/// Refuses what unpacks to more than may be read, whatever it says of itself.
fn check_size(bytes: &[u8]) -> std::result::Result<(), String> {
    let unread = |error: &dyn Display| {
        let problem = quoted(&error.to_string());
        format!("is a packed file that cannot be read: {problem}")
    };
    let mut packed = ZipArchive::new(Cursor::new(bytes)).map_err(|error| unread(&error))?;
    let mut left = LARGEST + 1;
    for index in 0..packed.len() {
        let part = packed.by_index(index).map_err(|error| unread(&error))?;
        left -= copy(&mut part.take(left), &mut sink()).map_err(|error| unread(&error))?;
        if left == 0 {
            return Err(format!("unpacks to more than {} MiB", LARGEST >> 20));
        }
    }
    Ok(())
}

/// The cells of a sheet, a row a line from its first row on.
#[derive(Default)]
struct Lines {
    /// How many cells each has, and these.
    lines: Vec<(usize, String)>,
    /// The most cells that one has.
    width: usize,
    size: u64,
}

impl Lines {
    /// Adds a cell, which stands behind those before it.
    fn add(&mut self, row: usize, column: usize, cell: &str) -> std::result::Result<(), String> {
        if cell.is_empty() {
            return Ok(());
        }
        if column >= WIDEST || row >= ROWS {
            return Err(format!(
                "has a cell in row {}, column {}",
                row + 1,
                column + 1
            ));
        }
        if row + 1 > self.lines.len() {
            self.lines.resize_with(row + 1, Default::default);
        }
        let (cells, line) = &mut self.lines[row];
        let Some(skipped) = (column + 1)
            .checked_sub(*cells)
            .filter(|&skipped| skipped > 0)
        else {
            return Err(format!("has its cells in no order, in row {}", row + 1));
        };
        let delimiters = if *cells == 0 { skipped - 1 } else { skipped };
        line.extend(std::iter::repeat_n(';', delimiters));
        line.push_str(cell);
        *cells = column + 1;
        self.width = self.width.max(column + 1);
        self.size += (delimiters + cell.len()) as u64;
        match self.size + (self.width * self.lines.len()) as u64 > LARGEST {
            true => Err(format!("has more than {} MiB of cells", LARGEST >> 20)),
            false => Ok(()),
        }
    }

    /// All lines; those with a cell have as many cells as the longest.
    fn text(self) -> String {
        let mut text = String::new();
        for (cells, line) in self.lines {
            text.push_str(&line);
            if cells > 0 {
                text.extend(std::iter::repeat_n(';', self.width - cells));
            }
            text.push('\n');
        }
        text
    }
}

/// A cell as text. What is a text is in quotes, so that it is nothing else.
fn cell(data: &Data) -> String {
    match data {
        Data::Empty => String::new(),
        Data::Int(value) => value.to_string(),
        Data::Float(value) => value.to_string(),
        Data::Bool(value) => format!("\"{value}\""),
        Data::DateTime(moment) if !DAYS.contains(&moment.as_f64()) => {
            format!("\"{} days\"", moment.as_f64())
        }
        Data::DateTime(moment) => {
            let (year, month, day, hour, minute, second, milli) = moment.to_ymd_hms_milli();
            let time = format!("{hour:02}:{minute:02}:{second:02}.{milli:03}");
            // Less than a day is a time of day.
            match moment.as_f64() < 1.0 {
                true => time,
                false => format!("{year:04}-{month:02}-{day:02} {time}"),
            }
        }
        // What a formula could not give.
        Data::Error(_) => "NaN".into(),
        Data::String(text) | Data::DateTimeIso(text) | Data::DurationIso(text) => {
            let line: String = text
                .chars()
                .map(|letter| if letter.is_control() { ' ' } else { letter })
                .collect();
            format!("\"{}\"", line.replace('"', "\"\""))
        }
    }
}
