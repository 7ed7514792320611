//! Many records: a row for each, the file in which rows are kept while a batch runs, which valve departs from its siblings,
//! and the table of all.

mod journal;
mod row;
mod siblings;
mod table;

pub use journal::Journal;
pub use row::{BatchRow, LimitNames, NamedValue, RowStatus};
pub use siblings::{Against, Departure, Departures, departures};
pub use table::batch_csv;

use super::provenance::{Program, now};
use serde::Serialize;

/// The version of [`Batch`] and its rows.
pub const BATCH_SCHEMA: &str = "servobee/batch/1";

/// `batch.json`: a whole batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// [`BATCH_SCHEMA`].
    pub schema: &'static str,
    /// A row for every file, the baseline's first where there is one.
    pub rows: Vec<BatchRow>,
    /// What each of them departs in from the others, in the order of the rows; null where a row was not compared.
    pub departures: Vec<Option<Departures>>,
    /// What they were compared with, or why not.
    pub compared: String,
    /// What wrote this.
    pub program: Program,
    /// The arguments that it was given.
    pub arguments: Vec<String>,
    /// When it was written, UTC.
    pub date: String,
}

impl Batch {
    /// The batch of these `rows`.
    pub fn of(rows: Vec<BatchRow>, arguments: Vec<String>) -> Self {
        let (compared, departures) = departures(&rows);
        Self {
            schema: BATCH_SCHEMA,
            rows,
            departures,
            compared: compared.describe(),
            program: Program::default(),
            arguments,
            date: now(),
        }
    }

    /// How many rows, that of the baseline aside, are so.
    pub fn count(&self, is: impl Fn(&BatchRow) -> bool) -> usize {
        let rows = self.rows.iter().filter(|row| !row.baseline);
        rows.filter(|row| is(row)).count()
    }

    /// The batch as JSON text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("a batch is plain data");
        text.push('\n');
        text
    }
}
