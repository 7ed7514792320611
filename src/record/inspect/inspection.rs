//! What is said of a file.

use super::column::Values;
use super::follow::{self, Follows};
use super::propose::Proposal;
use super::targets::{COMMAND, Targets};
use super::timing::Timing;
use crate::record::Channel;
use crate::record::format::Format;
use crate::record::table::Table;
use crate::record::target::Target;
use serde::Serialize;
use std::collections::BTreeMap;

/// What was understood of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// `servobee/inspect/1`.
    pub schema: &'static str,
    /// The file, as it was given.
    pub path: String,
    /// How it is written.
    #[serde(flatten)]
    pub format: Format,
    /// Every column, in the order of the file.
    pub columns: Vec<Inspected>,
    /// What else is in the file, each with what it is.
    pub others: Vec<(String, String)>,
    /// How the samples lie in time, if there is a column of time.
    pub timing: Option<Timing>,
    /// The time after which the command repeats itself, in s.
    pub command_period: Option<f64>,
    /// How each response follows the command.
    pub follows: BTreeMap<&'static str, Follows>,
    /// What looks wrong, each with where.
    pub warnings: Vec<String>,
    /// Why no record for `identify` can be read with the mappings that were given, and what can be done.
    pub problem: Option<String>,
    /// What the columns that are no channel yet probably are.
    pub proposals: Vec<Proposal>,
    /// Why no record can be read with the proposals either, and what can be done; `None` where nothing is wrong.
    pub problem_left: Option<String>,
    /// The call of `servobee identify` for this file.
    pub call: String,
}

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspected {
    /// Its name in the file.
    pub name: String,
    /// Its unit in the file, if it has one.
    pub unit: Option<String>,
    /// What it is taken as, such as `command [mm]`, by its name or a mapping.
    pub taken_as: Option<String>,
    /// What it is proposed to be.
    pub proposed: Option<String>,
    /// Its values.
    #[serde(flatten)]
    pub values: Values,
}

/// The columns of a file that are known or guessed.
pub(super) struct Signals<'a> {
    pub(super) table: &'a Table,
    pub(super) targets: &'a Targets,
}

impl Signals<'_> {
    /// In the unit that is kept, and NaN where a cell is odd.
    pub(super) fn values(&self, target: Target) -> Option<Vec<f64>> {
        let (index, conversion) = self.targets.get(&target)?;
        let values = self.table.columns[*index].values.iter();
        Some(values.map(|&value| conversion.convert(value)).collect())
    }

    pub(super) fn timing(&self) -> Option<Timing> {
        Timing::of(&self.values(Target::Time)?)
    }

    pub(super) fn command_period(&self) -> Option<f64> {
        let rows = follow::period(&self.values(COMMAND)?)?;
        Some(rows as f64 * self.timing()?.interval)
    }

    pub(super) fn follows(&self) -> BTreeMap<&'static str, Follows> {
        let command = self.values(COMMAND);
        let follows = |channel: Channel| {
            let response = self.values(Target::Channel(channel))?;
            let follows = follow::follows(command.as_ref()?, &response)?;
            Some((channel.name(), follows))
        };
        Channel::RESPONSES.into_iter().filter_map(follows).collect()
    }
}
