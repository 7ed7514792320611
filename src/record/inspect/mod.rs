//! What a file holds, whether or not a [`Record`] can be read from it, and what is missing for one.

mod call;
mod column;
mod follow;
mod inspection;
mod names;
mod propose;
mod suspicions;
mod targets;
mod timing;

pub use column::Values;
pub use follow::Follows;
pub use inspection::{Inspected, Inspection};
pub use propose::Proposal;
pub use timing::{Gap, Timing};

use super::conversion::Conversion;
use super::mapping::{Mapping, Target};
use super::table::Table;
use super::{Record, file};
use crate::Result;
use call::call;
use inspection::Signals;
use propose::{Proposed, proposals};
use std::path::Path;
use suspicions::suspicions;
use targets::Targets;

impl Inspection {
    /// [`inspect`] of the content of the file called `path`.
    ///
    /// # Errors
    /// As [`inspect`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>, mappings: &[Mapping]) -> Result<Self> {
        Ok(of(&file::parse(path, content.as_ref())?, mappings))
    }

    /// Whether the file gives a record for `identify` with the mappings that were given.
    pub fn is_ready(&self) -> bool {
        self.problem.is_none()
    }
}

/// Looks into the file at `path`, of which `mappings` say what columns are.
///
/// # Errors
/// The file cannot be read as a table. What is wrong with the table's content is told in the inspection.
pub fn inspect(path: impl AsRef<Path>, mappings: &[Mapping]) -> Result<Inspection> {
    Ok(of(&file::read(path.as_ref())?, mappings))
}

fn of(table: &Table, mappings: &[Mapping]) -> Inspection {
    let taken = taken(table, mappings);
    let Proposed { proposals, doubts } = proposals(table, &taken);
    let mut all = taken.clone();
    all.extend(
        proposals
            .iter()
            .map(|p| (p.target, (p.index, p.mapping.conversion))),
    );

    let proposed = proposals.iter().map(|proposal| proposal.mapping.clone());
    let with_proposals: Vec<Mapping> = mappings.iter().cloned().chain(proposed).collect();
    let record = record(table, &with_proposals);
    let column = |index: usize| {
        let as_text = |(target, (at, conversion)): (&Target, &(usize, Conversion))| {
            (*at == index).then(|| format!("{target} {conversion}"))
        };
        let label = &table.columns[index].label;
        let taken_as = taken.iter().find_map(as_text);
        Inspected {
            name: label.text.clone(),
            unit: label.unit.clone(),
            proposed: all.iter().find_map(as_text).filter(|_| taken_as.is_none()),
            taken_as,
            values: Values::of(&table.columns[index]),
        }
    };
    let signals = Signals {
        table,
        targets: &all,
    };
    let mut inspection = Inspection {
        schema: "servobee/inspect/1",
        path: table.path.clone(),
        format: table.format.clone(),
        columns: (0..table.columns.len()).map(column).collect(),
        others: table
            .others
            .iter()
            .map(|other| (other.name.clone(), other.what.clone()))
            .collect(),
        timing: signals.timing(),
        command_period: signals.command_period(),
        follows: signals.follows(),
        warnings: record.iter().flat_map(|r| r.warnings.clone()).collect(),
        problem: self::record(table, mappings)
            .err()
            .map(|error| error.to_string()),
        call: call(&table.path, &with_proposals),
        proposals,
        problem_left: record.err().map(|error| error.to_string()),
    };
    let suspicions = suspicions(&signals, &inspection);
    inspection.warnings.extend(doubts);
    inspection.warnings.extend(suspicions);
    inspection
}

/// The record in a table, if it is one to identify from.
fn record(table: &Table, mappings: &[Mapping]) -> Result<Record> {
    let record = Record::of(table, mappings)?;
    record.check_excited()?;
    record.check_response()?;
    Ok(record)
}

/// Index and unit of the columns that are channels by a mapping, or by their name and unit.
fn taken(table: &Table, mappings: &[Mapping]) -> Targets {
    let mut taken = Targets::new();
    for mapping in mappings {
        if let Ok(Some(index)) = table.called(&mapping.column) {
            taken.insert(mapping.target, (index, mapping.conversion));
        }
    }
    for (index, column) in table.columns.iter().enumerate() {
        if let Some(target) = Target::named(&column.label.name)
            && let Ok(unit) = table.unit(index, target.quantity())
            && taken.values().all(|(other, _)| *other != index)
        {
            taken.entry(target).or_insert((index, unit.into()));
        }
    }
    taken
}
