//! What a file holds, whether or not a [`Record`] can be read from it, and what is missing for one.

mod call;
mod column;
mod follow;
mod inspection;
mod propose;
mod stated;
mod suspicions;
mod targets;
mod timing;

pub use column::Values;
pub use follow::Follows;
pub use inspection::{Inspected, Inspection};
pub use propose::Proposal;
pub use timing::{Gap, Timing};

use super::conversion::Conversion;
use super::mapping::{Mapping, known, small};
use super::table::Table;
use super::target::Target;
use super::text::quoted;
use super::{Reading, Record, file};
use crate::Result;
use call::call;
pub(super) use follow::alike;
use inspection::Signals;
use propose::{Proposed, proposals};
use stated::stated;
use std::path::Path;
use suspicions::suspicions;

impl Inspection {
    /// [`inspect`] of the content of the file called `path`.
    ///
    /// # Errors
    /// As [`inspect`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>, mappings: &[Mapping]) -> Result<Self> {
        of(
            file::parse(path, content.as_ref())?,
            &Reading::with(mappings),
        )
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
    inspect_as(path, &Reading::with(mappings))
}

/// [`inspect`] of a file that is read as `reading` says.
///
/// # Errors
/// As [`inspect`]; a sample interval beside a column of time.
pub fn inspect_as(path: impl AsRef<Path>, reading: &Reading) -> Result<Inspection> {
    of(file::read_joined(path.as_ref(), reading)?.0, reading)
}

fn of(mut table: Table, reading: &Reading) -> Result<Inspection> {
    reading.give_time(&mut table)?;
    let inspection = of_table(&table, reading);
    let has_time = |one: &Proposal| one.target == Target::Time;
    let timed = known(&table, &reading.mappings).contains_key(&Target::Time);
    if timed || inspection.proposals.iter().any(has_time) {
        return Ok(inspection);
    }
    let above = table.above.clone();
    let Some((seconds, line)) = stated(&above) else {
        return Ok(inspection);
    };
    let with_interval = Reading {
        sample_interval: Some(seconds.to_string().parse()?),
        ..reading.clone()
    };
    with_interval.give_time(&mut table)?;
    let mut proposed = of_table(&table, &with_interval);
    let said = format!(
        "a line above the header, {}, says how far rows are apart: --sample-interval {seconds} is proposed",
        quoted(line)
    );
    proposed.warnings.push(said);
    // Nobody has said so yet.
    proposed.problem = inspection.problem;
    Ok(proposed)
}

fn of_table(table: &Table, reading: &Reading) -> Inspection {
    let mappings = &reading.mappings;
    let taken = known(table, mappings);
    let Proposed { proposals, doubts } = proposals(table, &taken, mappings);
    let mut all = taken.clone();
    let first = proposals.iter().filter(|p| p.mapping.below.is_none());
    all.extend(first.map(|p| (p.target, (p.index, p.mapping.conversion))));

    let proposed = proposals.iter().map(|proposal| proposal.mapping.clone());
    let with_proposals = Reading {
        mappings: mappings.iter().cloned().chain(proposed).collect(),
        ..reading.clone()
    };
    let record = record(table, &with_proposals);
    let column = |index: usize| {
        let as_text = |(target, (at, conversion)): (&Target, &(usize, Conversion))| {
            (*at == index).then(|| format!("{target} {conversion}"))
        };
        let label = &table.columns[index].label;
        let second = |mappings: &[Mapping]| {
            let mut all = small(table, mappings).into_iter();
            all.find(|one| one.index == index)
                .map(|one| format!("{} {}, below {}", one.target, one.conversion, one.below))
        };
        let taken_as = taken.iter().find_map(as_text);
        let taken_as = taken_as.or_else(|| second(mappings));
        let proposed = all.iter().find_map(as_text);
        let proposed = proposed.or_else(|| second(&with_proposals.mappings));
        Inspected {
            name: label.text.clone(),
            unit: label.unit.clone(),
            proposed: proposed.filter(|_| taken_as.is_none()),
            taken_as,
            values: Values::of(&table.columns[index]),
        }
    };
    let signals = Signals {
        table,
        targets: &all,
    };
    let bench = record.as_ref().ok().map(Record::bench);
    let mut inspection = Inspection {
        schema: "servobee/inspect/1",
        path: table.path.clone(),
        format: table.origin.format.clone(),
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
        problem: self::record(table, reading)
            .err()
            .map(|error| error.to_string()),
        call: call(&table.path, &with_proposals),
        proposals,
        problem_left: record.err().map(|error| error.to_string()),
    };
    let suspicions = suspicions(&signals, &inspection);
    let bench = bench.unwrap_or_default().into_iter();
    inspection.warnings.extend(bench.map(|one| one.to_string()));
    inspection.warnings.extend(doubts);
    inspection.warnings.extend(suspicions);
    inspection
}

/// The record in a table, if it is one to identify from.
fn record(table: &Table, reading: &Reading) -> Result<Record> {
    let record = Record::of(table, reading)?;
    record.check_excited()?;
    record.check_response()?;
    record.check_live_zeros()?;
    record.check_spool_direction()?;
    Ok(record)
}
