//! Renaming the columns of somebody else's file.

use super::channel::Channel;
use super::conversion::{self, Conversion};
use super::label::{Label, visible};
use super::names::pressure_at_the_valve;
use super::ranges::Small;
use super::table::Table;
use super::target::Target;
use super::text::quoted;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// `x_cmd_mm=command [mm]`: the column `x_cmd_mm` of a file is the channel `command` in mm.
///
/// A scale and an offset may follow: with `i=command [%] *12.5 -150` what the column `i` holds, times 12.5, less 150, is the
/// command in %.
///
/// `below` and a number may come last: `q_small=flow [L/min] below 5` is a second meter of the channel, which counts where the
/// first one shows less than 5 L/min.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    pub(super) column: String,
    pub(super) target: Target,
    pub(super) conversion: Conversion,
    /// In the unit of the conversion.
    pub(super) below: Option<f64>,
}

impl Mapping {
    /// The second meter that it says column `index` is, if it does.
    fn small(&self, index: usize) -> Option<Small> {
        let unit = self.conversion.unit;
        self.below.map(|below| Small {
            target: self.target,
            index,
            conversion: self.conversion,
            below: unit.convert(below),
        })
    }
}

impl Display for Mapping {
    /// As it is read.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}={} {}", self.column, self.target, self.conversion)?;
        self.below
            .map_or(Ok(()), |below| write!(f, " below {below}"))
    }
}

impl FromStr for Mapping {
    type Err = Error;

    /// # Errors
    /// No `=`, nothing before it, no known channel and unit behind it, or behind these no scale and offset that are finite.
    fn from_str(text: &str) -> Result<Self> {
        let place = format!("--map {text:?}");
        let wrong = |problem: String| {
            Error::input(
                &place,
                problem,
                "write it as \"COLUMN=CHANNEL [UNIT]\", such as \"x_cmd=command [mm]\"",
            )
        };
        let (column, label) = text
            .rsplit_once('=')
            .ok_or_else(|| wrong("has no \"=\"".into()))?;
        let column = column.trim();
        if column.is_empty() {
            return Err(wrong("names no column before \"=\"".into()));
        }
        let (label, below) = match label.rsplit_once(" below ") {
            Some((label, number)) => {
                let limit = number.trim().parse().ok();
                let limit = limit.filter(|limit: &f64| *limit > 0.0 && limit.is_finite());
                let limit = limit.ok_or_else(|| {
                    wrong(format!(
                        "{:?} behind \"below\" is no number above 0",
                        number.trim()
                    ))
                })?;
                (label, Some(limit))
            }
            None => (label, None),
        };
        let (label, rest) = conversion::split(label);
        let label = Label::parse(label);
        let target = Target::named(&label.name).ok_or_else(|| {
            wrong(format!(
                "{:?} is neither time nor one of {}",
                label.name,
                Channel::ALL.map(Channel::name).join(", ")
            ))
        })?;
        let ranged = |channel: Channel| channel != Channel::Command;
        if below.is_some() && !matches!(target, Target::Channel(channel) if ranged(channel)) {
            return Err(wrong(format!("{target} has no second meter")));
        }
        let column = visible(column);
        let unit = target.unit(label.unit.as_deref(), &place, &column)?;
        Ok(Self {
            conversion: Conversion::parse(unit, rest, &place)?,
            column,
            target,
            below,
        })
    }
}

/// Index of the column that each target is taken from, and how.
pub(super) type Taken = BTreeMap<Target, (usize, Conversion)>;

/// Which columns of a table a record takes, and which it leaves.
pub(super) struct Sources {
    /// The column behind each target.
    pub(super) taken: Taken,
    /// Second meters of some of these.
    pub(super) small: Vec<Small>,
    /// The names of columns that are no channel.
    pub(super) ignored: Vec<String>,
    pub(super) warnings: Vec<String>,
    /// Columns that mappings name and the table does not have.
    pub(super) absent: Vec<String>,
}

impl Sources {
    /// What `mappings` name, and for other targets the columns that have their name.
    ///
    /// # Errors
    /// Two columns for a target; an unknown unit; no column for a mapping, and none that has its target's name.
    pub(super) fn of(table: &Table, mappings: &[Mapping]) -> Result<Self> {
        let mut taken = Taken::new();
        let mut take =
            |target: Target, index, conversion| match taken.insert(target, (index, conversion)) {
                Some((other, _)) if other != index => {
                    Err(table.twice(&target.to_string(), other, index))
                }
                _ => Ok(()),
            };
        let mut mapped = Vec::new();
        let mut small: Vec<Small> = Vec::new();
        let mut absent = Vec::new();
        for mapping in mappings {
            match table.called(&mapping.column)? {
                Some(index) if mapping.below.is_some() => small.extend(mapping.small(index)),
                Some(index) => {
                    take(mapping.target, index, mapping.conversion)?;
                    mapped.push((index, mapping.target));
                }
                None => absent.push(mapping),
            }
        }
        let mut left = Vec::new();
        for (index, column) in table.columns.iter().enumerate() {
            let label = &column.label;
            let second = small.iter().any(|one| one.index == index);
            if second || mapped.iter().any(|&(taken, _)| taken == index) {
                continue;
            }
            let target = Target::named(&label.name);
            match target.filter(|target| mapped.iter().all(|(_, other)| other != target)) {
                Some(target) => take(target, index, table.unit_as(index, target)?.into())?,
                None if label.text.is_empty() => {}
                None => left.push(index),
            }
        }
        let mut warnings = Vec::new();
        let mut found = pressures(table, &left);
        found.retain(|(_, channel)| !taken.contains_key(&Target::Channel(*channel)));
        for (index, channel) in found {
            let target = Target::Channel(channel);
            taken.insert(target, (index, table.unit_as(index, target)?.into()));
            left.retain(|other| *other != index);
            let column = quoted(&table.columns[index].label.text);
            let remedy = "rename the column if it is another";
            warnings.push(format!("{column} is taken as {target}: {remedy}"));
        }
        if let Some(one) = small.iter().find(|one| !taken.contains_key(&one.target)) {
            return Err(Error::input(
                table.header_place(one.index),
                format!(
                    "is the meter for small values of {}, and no column is that for large ones",
                    one.target
                ),
                format!("add --map \"COLUMN={} [UNIT]\"", one.target),
            ));
        }
        for Mapping { column, target, .. } in &absent {
            let Some(&(index, _)) = taken.get(target) else {
                let remedy = "let --map name one of these";
                return Err(table.missing(&format!("{column:?}"), remedy));
            };
            let instead = &table.columns[index].label.text;
            warnings.push(format!(
                "has no column {column:?}, as --map says; {target} is taken from {instead:?}"
            ));
        }
        let text = |index: usize| table.columns[index].label.text.clone();
        Ok(Self {
            taken,
            small,
            ignored: left.into_iter().map(text).collect(),
            warnings,
            absent: absent
                .iter()
                .map(|mapping| mapping.column.clone())
                .collect(),
        })
    }
}

/// Those of the columns `left` that only one of them is by its name: the pressures that drive the flow.
fn pressures(table: &Table, left: &[usize]) -> Vec<(usize, Channel)> {
    let named = left.iter().filter_map(|&index| {
        let label = &table.columns[index].label;
        Some((index, pressure_at_the_valve(label)?))
    });
    let named: Vec<(usize, Channel)> = named.collect();
    let alone = |channel| named.iter().filter(|(_, other)| *other == channel).count() == 1;
    let found = named.iter().copied();
    found.filter(|(_, channel)| alone(*channel)).collect()
}

/// The columns that mappings say are second meters.
pub(super) fn small(table: &Table, mappings: &[Mapping]) -> Vec<Small> {
    let found = mappings.iter().filter_map(|mapping| {
        let index = table.called(&mapping.column).ok()??;
        mapping.small(index)
    });
    found.collect()
}

/// The columns that are targets by a mapping, or by their name and unit; what is doubtful about others is left for
/// [`Sources::of`] to refuse.
pub(super) fn known(table: &Table, mappings: &[Mapping]) -> Taken {
    let mut taken = Taken::new();
    let first = |mapping: &&Mapping| mapping.below.is_none();
    for mapping in mappings.iter().filter(first) {
        if let Ok(Some(index)) = table.called(&mapping.column) {
            taken.insert(mapping.target, (index, mapping.conversion));
        }
    }
    for (index, column) in table.columns.iter().enumerate() {
        if let Some(target) = Target::named(&column.label.name)
            && let Ok(unit) = table.unit(index, target.quantity())
            && taken.values().all(|(other, _)| *other != index)
            && small(table, mappings).iter().all(|one| one.index != index)
        {
            taken.entry(target).or_insert((index, unit.into()));
        }
    }
    taken
}
