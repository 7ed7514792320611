//! What the columns that no channel takes probably are: from their names, their units, and their values.

use super::follow::{Follows, follows};
use super::names::{Meaning, meanings};
use crate::record::column::Column;
use crate::record::mapping::Target;
use crate::record::table::Table;
use crate::record::{Channel, Mapping, Quantity};
use serde::Serialize;
use std::collections::BTreeMap;

/// A column and the channel that it probably is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposal {
    /// The column's name in the file.
    pub column: String,
    /// What to say of it: `x_cmd_mm=command [mm]`.
    pub map: String,
    /// Why.
    pub reason: String,
    #[serde(skip)]
    pub(super) index: usize,
    #[serde(skip)]
    pub(super) target: Target,
    #[serde(skip)]
    pub(super) mapping: Mapping,
}

/// Proposals for the columns of `table` that are not in `taken`, and for the targets that are not.
pub(super) fn proposals(table: &Table, taken: &super::Targets) -> Vec<Proposal> {
    let mut finder = Finder {
        table,
        taken: taken
            .iter()
            .map(|(&target, &(index, _))| (target, index))
            .collect(),
        proposals: Vec::new(),
    };
    finder.by_name();
    finder.time_by_values();
    finder.by_likeness();
    finder.proposals.sort_by_key(|proposal| proposal.target);
    finder.proposals
}

struct Finder<'a> {
    table: &'a Table,
    taken: BTreeMap<Target, usize>,
    proposals: Vec<Proposal>,
}

impl Finder<'_> {
    fn column(&self, index: usize) -> &Column {
        &self.table.columns[index]
    }

    /// The columns with numbers that are nothing yet.
    fn free(&self) -> Vec<usize> {
        let free = |&index: &usize| {
            let column = self.column(index);
            2 * column.odd.len() < column.values.len()
                && self.taken.values().all(|taken| *taken != index)
        };
        (0..self.table.columns.len()).filter(free).collect()
    }

    /// The surest names first; of two that are as sure, neither.
    fn by_name(&mut self) {
        let possible = |index: usize| {
            let column = self.column(index);
            let fits = move |meaning: &Meaning| match meaning.target {
                Target::Time => rises(&column.values),
                Target::Channel(channel) => {
                    channel != Channel::Temperature || !rises(&column.values)
                }
            };
            let meanings = meanings(&column.label).into_iter().filter(fits);
            meanings.map(move |meaning| (index, meaning))
        };
        let mut all: Vec<(usize, Meaning)> = self.free().into_iter().flat_map(possible).collect();
        all.sort_by_key(|(index, meaning)| (std::cmp::Reverse(meaning.certainty), *index));
        for (index, meaning) in &all {
            let Meaning {
                target,
                certainty,
                unit,
                word,
            } = meaning;
            if self.taken.contains_key(target) || !self.free().contains(index) {
                continue;
            }
            let rival = all.iter().any(|(other, rival)| {
                other != index
                    && (rival.target, rival.certainty) == (*target, *certainty)
                    && self.free().contains(other)
            });
            if rival && *target != Target::Time {
                continue;
            }
            let mut unit = unit.clone();
            let mut reason = match &unit {
                Some(unit) => format!("its name says {word:?}, its unit is {unit:?}"),
                None => format!("its name says {word:?}"),
            };
            if *target == Target::Time {
                reason.push_str(", and it rises from row to row");
                if unit.is_none() && counts_rows(&self.column(*index).values) {
                    reason.push_str(
                        " by 1: in s that is one row a second; write [ms] for one a millisecond",
                    );
                    unit = Some("s".into());
                }
            }
            self.propose(*index, *target, unit, reason);
        }
    }

    /// The only column that rises throughout.
    fn time_by_values(&mut self) {
        if self.taken.contains_key(&Target::Time) {
            return;
        }
        let mut rising = self.free();
        rising.retain(|&index| rises(&self.column(index).values));
        if let [only] = rising[..] {
            let reason = "it is the only column that rises from row to row".into();
            self.propose(only, Target::Time, None, reason);
        }
    }

    /// Command and response are alike, and the response is behind.
    fn by_likeness(&mut self) {
        let responses = Channel::RESPONSES.map(Target::Channel);
        let command = self.taken.get(&COMMAND).copied();
        let response = responses
            .iter()
            .find_map(|target| self.taken.get(target).copied());
        let free = self.free();
        let pairs: Vec<(usize, usize)> = match (command, response) {
            (Some(_), Some(_)) => return,
            (Some(command), None) => free.iter().map(|&other| (command, other)).collect(),
            (None, Some(response)) => free.iter().map(|&other| (other, response)).collect(),
            (None, None) => {
                let with = |one: usize| free.iter().map(move |&other| (one, other));
                let pairs = free.iter().flat_map(|&one| with(one));
                pairs.filter(|(one, other)| one != other).collect()
            }
        };
        // Where neither is known, only what is behind is the response.
        let least = isize::from(command.is_none() && response.is_none());
        let alike = |&(early, late): &(usize, usize)| {
            let follows = follows(&self.column(early).values, &self.column(late).values)?;
            (follows.rows >= least && follows.is_close()).then_some((early, late, follows))
        };
        let strength = |(_, _, follows): &(usize, usize, Follows)| follows.correlation.abs();
        let found = pairs.iter().filter_map(alike);
        let Some((early, late, Follows { rows, correlation })) =
            found.max_by(|one, other| strength(one).total_cmp(&strength(other)))
        else {
            return;
        };
        let name = |index: usize| &self.column(index).label.text;
        let leads = format!(
            "{:?} follows it {rows} rows later (correlation {correlation:.2})",
            name(late)
        );
        let behind = format!(
            "it follows {:?} {rows} rows later (correlation {correlation:.2})",
            name(early)
        );
        if command.is_none() {
            self.propose(
                early,
                COMMAND,
                self.unit_for(early, Quantity::Signal),
                leads,
            );
        }
        if response.is_none() {
            let flow = self.unit_for(late, Quantity::Flow).is_some();
            let channel = if flow { Channel::Flow } else { Channel::Spool };
            let unit = self.unit_for(late, channel.quantity());
            self.propose(late, Target::Channel(channel), unit, behind);
        }
    }

    /// The column's unit, if it is one of this quantity.
    fn unit_for(&self, index: usize, quantity: Quantity) -> Option<String> {
        let unit = self.column(index).label.unit.clone();
        unit.filter(|unit| quantity.unit(Some(unit), "").is_ok())
    }

    fn propose(&mut self, index: usize, target: Target, unit: Option<String>, mut reason: String) {
        let unit = unit.unwrap_or_else(|| {
            let assumed = match target.quantity() {
                Quantity::Signal => "1",
                quantity => quantity.usual().kept(),
            };
            let given = match &self.column(index).label.unit {
                Some(unit) => format!("the unit {unit:?} is not known"),
                None => "no unit is given".into(),
            };
            reason.push_str(&format!("; {given}, so [{assumed}] is assumed"));
            assumed.into()
        });
        let column = self.name(index);
        let map = format!("{column}={target} [{unit}]");
        let Ok(mapping) = map.parse() else {
            return;
        };
        self.taken.insert(target, index);
        self.proposals.push(Proposal {
            column: self.column(index).label.text.clone(),
            map,
            reason,
            index,
            target,
            mapping,
        });
    }

    /// The shortest name that means this column alone.
    fn name(&self, index: usize) -> &str {
        let label = &self.column(index).label;
        let alone = |name: &&str| {
            matches!(self.table.called(name), Ok(Some(found)) if found == index) && !name.is_empty()
        };
        Some(label.spelt.as_str())
            .filter(alone)
            .unwrap_or(&label.text)
    }
}

/// The command as a target.
pub(super) const COMMAND: Target = Target::Channel(Channel::Command);

/// Whether the values rise, but for a few.
fn rises(values: &[f64]) -> bool {
    const SHARE: f64 = 0.9;
    let rising = values.windows(2).filter(|pair| pair[0] < pair[1]).count();
    values.len() > 1 && rising as f64 >= SHARE * (values.len() - 1) as f64
}

fn counts_rows(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}
