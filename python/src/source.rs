//! Records from Python: files, and tables in memory.

use crate::error::{raised, refused};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use servobee::Result;
use servobee::record::{Reading, Record};
use servobee::report::csv_cell;
use std::path::PathBuf;

/// A column of a table.
#[derive(FromPyObject)]
pub(crate) enum Column<'py> {
    Numbers(PyReadonlyArray1<'py, f64>),
    Text(Vec<String>),
}

impl Column<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.as_array().len(),
            Self::Text(values) => values.len(),
        }
    }

    /// A cell as a file has it. Numbers are read again to the last bit.
    fn cell(&self, row: usize) -> String {
        match self {
            Self::Numbers(values) => format!("{:?}", values.as_array()[row]),
            Self::Text(values) => csv_cell(&values[row]),
        }
    }
}

/// Where a record comes from.
#[derive(FromPyObject)]
pub(crate) enum Given<'py> {
    /// A table in memory: what it is called, and its columns.
    Table(String, Vec<(String, Column<'py>)>),
    /// A file.
    File(PathBuf),
}

/// The same, without anything of Python's.
pub(crate) enum Source {
    Table(String, String),
    File(PathBuf),
}

impl Source {
    /// # Errors
    /// Columns of unequal length.
    pub(crate) fn all(py: Python<'_>, given: Vec<Given<'_>>) -> PyResult<Vec<Self>> {
        given.into_iter().map(|one| Self::of(py, one)).collect()
    }

    pub(crate) fn of(py: Python<'_>, given: Given<'_>) -> PyResult<Self> {
        let (name, columns) = match given {
            Given::File(path) => return Ok(Self::File(path)),
            Given::Table(name, columns) => (name, columns),
        };
        let rows = columns.first().map_or(0, |(_, column)| column.len());
        for (label, column) in &columns {
            if column.len() != rows {
                let problem = format!(
                    "has {} values, and {:?} has {rows}",
                    column.len(),
                    columns[0].0
                );
                let place = format!("{name}, column {label:?}");
                return Err(refused(py, &place, &problem, "give one value for each row"));
            }
        }
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let heads = columns.iter().map(|(label, _)| csv_cell(label));
        let mut text = line(heads.collect());
        for row in 0..rows {
            text += &line(columns.iter().map(|(_, column)| column.cell(row)).collect());
        }
        Ok(Self::Table(name, text))
    }

    /// The record. Tables are read as files are, and refused with the same words.
    pub(crate) fn read(&self, reading: &Reading) -> Result<Record> {
        match self {
            Self::File(path) => Record::read_as(path, reading),
            Self::Table(name, text) => Record::parse_as(name, text, reading),
        }
    }
}

/// The records of all `sources`.
pub(crate) fn records(sources: &[Source], reading: &Reading) -> Result<Vec<Record>> {
    sources.iter().map(|source| source.read(reading)).collect()
}

/// How they are read.
///
/// # Errors
/// Words that say nothing.
pub(crate) fn reading(
    py: Python<'_>,
    maps: &[String],
    sample_interval: Option<&str>,
    skip_incomplete_rows: bool,
) -> PyResult<Reading> {
    let parse = || {
        Ok(Reading {
            mappings: maps.iter().map(|one| one.parse()).collect::<Result<_>>()?,
            sample_interval: sample_interval.map(str::parse).transpose()?,
            skip_incomplete_rows,
        })
    };
    parse().map_err(|error| raised(py, error))
}
