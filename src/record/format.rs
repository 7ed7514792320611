//! How a file is written.

use super::text::quoted;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// The dialect of a CSV file, as it was found in the file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dialect {
    /// `UTF-8`, `UTF-16` or `Latin-1`.
    pub encoding: &'static str,
    /// What stands between cells; a blank is any number of blanks.
    pub delimiter: char,
    /// `.` or `,`.
    pub decimal: char,
    /// The line of the header, as an editor counts it.
    pub header_row: usize,
    /// The line below it that holds the units, if there is one.
    pub unit_row: Option<usize>,
}

/// How a file is written.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "format", rename_all = "snake_case")]
pub enum Format {
    /// Text with one sample a line.
    Csv(Dialect),
    /// A sheet of an Excel workbook.
    Xlsx {
        /// Its name.
        sheet: String,
        /// The row of the header, as Excel counts it.
        header_row: usize,
        /// The row below it that holds the units, if there is one.
        unit_row: Option<usize>,
    },
    /// A MAT file of level 5, as `save -v6` and `save -v7` write it.
    Mat {
        /// Whether its numbers begin with the high byte.
        big_endian: bool,
    },
}

impl Display for Format {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let dialect = match self {
            Self::Mat { big_endian: false } => return f.write_str("MAT file, level 5"),
            Self::Mat { big_endian: true } => return f.write_str("MAT file, level 5, big-endian"),
            Self::Xlsx {
                sheet,
                header_row,
                unit_row,
            } => {
                write!(
                    f,
                    "Excel, sheet {}, header in row {header_row}",
                    quoted(sheet)
                )?;
                return unit_row.map_or(Ok(()), |row| write!(f, ", units in row {row}"));
            }
            Self::Csv(dialect) => dialect,
        };
        let delimiter = match dialect.delimiter {
            ',' => "commas",
            ';' => "semicolons",
            '\t' => "tabs",
            '|' => "bars",
            ':' => "colons",
            _ => "blanks",
        };
        write!(f, "CSV, cells separated by {delimiter}")?;
        if dialect.decimal == ',' {
            f.write_str(", decimal commas")?;
        }
        write!(f, ", header in row {}", dialect.header_row)?;
        if let Some(row) = dialect.unit_row {
            write!(f, ", units in row {row}")?;
        }
        match dialect.encoding {
            "UTF-8" => Ok(()),
            encoding => write!(f, ", {encoding}"),
        }
    }
}
