//! What the columns that no channel takes probably are: from their names, their units, and their values.

use super::follow::{Follows, follows};
use super::targets::{COMMAND, Targets};
use crate::record::column::{Column, Odd};
use crate::record::mapping::small;
use crate::record::names::{COUNTS, Meaning, is_no_signal, meanings, unit_of};
use crate::record::ranges::limit;
use crate::record::table::Table;
use crate::record::target::Target;
use crate::record::text::{listed, quoted};
use crate::record::wiring::{OF_LIVE_ZERO, has_live_zero};
use crate::record::{Channel, Mapping, Quantity, SLOW, median_interval, unit};
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

/// What is proposed for a table.
#[derive(Default)]
pub(super) struct Proposed {
    /// For columns that are nothing yet, and targets that no column is.
    pub(super) proposals: Vec<Proposal>,
    /// Why nothing is proposed for columns that look as if they were something.
    pub(super) doubts: Vec<String>,
}

/// Proposals for the columns of `table` that are not in `taken`, and for the targets that are not. All are of one test: of
/// columns that are equally long, those that make the most of a record.
pub(super) fn proposals(table: &Table, taken: &Targets, mappings: &[Mapping]) -> Proposed {
    let small: Vec<usize> = small(table, mappings).iter().map(|one| one.index).collect();
    let live: Vec<(Target, usize)> = taken
        .iter()
        .filter(|(_, (index, conversion))| {
            let values = &table.columns[*index].values;
            conversion.unit.kept() == "mA" && !conversion.changes() && has_live_zero(values)
        })
        .map(|(&target, &(index, _))| (target, index))
        .collect();
    let taken: BTreeMap<Target, usize> = taken
        .iter()
        .map(|(&target, &(index, _))| (target, index))
        .collect();
    let mut lengths: Vec<usize> = match taken.values().next() {
        Some(&first) => vec![length(&table.columns[first])],
        None => table.columns.iter().map(length).collect(),
    };
    lengths.retain(|&length| length > 1);
    lengths.sort_unstable_by(|a, b| b.cmp(a));
    lengths.dedup();
    let of_length = |length| {
        let mut finder = Finder {
            table,
            taken: taken.clone(),
            small: small.clone(),
            length,
            doubtful: Vec::new(),
            proposed: Proposed::default(),
        };
        for &(target, index) in &live {
            let reason = format!("it is the {target} by its name");
            finder.propose(index, target, Some("mA".into()), reason);
        }
        finder.find();
        finder
    };
    // Of those that make as much the longest, which come last.
    let found = lengths.into_iter().take(LENGTHS).rev().map(of_length);
    let most = found.max_by_key(Finder::makes);
    most.map_or_else(Proposed::default, Finder::finish)
}

/// Most lengths of columns that are looked at, the longest first.
const LENGTHS: usize = 20;

/// A file may end within a row: columns are of one test all the same if their lengths differ by no more than so many.
const RAGGED: usize = 2;

/// The rows of a column up to the last that is not empty.
fn length(column: &Column) -> usize {
    let rows = column.values.len();
    let odd = column.odd.iter().rev().zip((0..rows).rev());
    let empty = odd.take_while(|((row, odd), last)| *odd == Odd::Empty && row == last);
    rows - empty.count()
}

struct Finder<'a> {
    table: &'a Table,
    taken: BTreeMap<Target, usize>,
    /// Columns that are second meters of these.
    small: Vec<usize>,
    /// How long the columns are that are looked at.
    length: usize,
    /// Columns whose unit only the user knows.
    doubtful: Vec<usize>,
    proposed: Proposed,
}

impl Finder<'_> {
    fn find(&mut self) {
        self.two_meters();
        self.by_name();
        self.time_by_values();
        self.by_likeness();
    }

    /// How much of a record there is: first its parts that it cannot do without, then all.
    fn makes(&self) -> (usize, usize) {
        let has = |target: Target| usize::from(self.taken.contains_key(&target));
        let mut responses = Channel::RESPONSES.into_iter().map(Target::Channel);
        let response = responses.any(|target| self.taken.contains_key(&target));
        let needed = has(Target::Time) + has(COMMAND) + usize::from(response);
        (needed, self.taken.len())
    }

    fn finish(mut self) -> Proposed {
        self.proposed
            .proposals
            .sort_by_key(|proposal| proposal.target);
        let other = |column: &&Column| self.has_numbers(column) && !self.is_of_this_test(column);
        let others: Vec<&Column> = self.table.columns.iter().filter(other).collect();
        if !others.is_empty() {
            let names = others.iter().map(|column| column.label.text.as_str());
            self.proposed.doubts.push(format!(
                "nothing is proposed for {}, which are of another length than the {} rows of the record: another test?",
                listed(names),
                self.length
            ));
        }
        self.proposed
    }

    fn is_of_this_test(&self, column: &Column) -> bool {
        length(column).abs_diff(self.length) <= RAGGED
    }

    /// Whether a column has numbers, and more than a constant of a file.
    fn has_numbers(&self, column: &Column) -> bool {
        let (numbers, length) = (column.values.len() - column.odd.len(), length(column));
        length > 1 && 2 * numbers > length
    }

    /// The values of column `index`, without the empty cells below it.
    fn values(&self, index: usize) -> &[f64] {
        let values = &self.column(index).values;
        &values[..values.len().min(self.length)]
    }

    fn column(&self, index: usize) -> &Column {
        &self.table.columns[index]
    }

    /// The columns with numbers that are nothing yet.
    fn free(&self) -> Vec<usize> {
        let free = |&index: &usize| {
            let column = self.column(index);
            self.has_numbers(column)
                && self.is_of_this_test(column)
                && !self.doubtful.contains(&index)
                && !self.small.contains(&index)
                && self.taken.values().all(|taken| *taken != index)
        };
        (0..self.table.columns.len()).filter(free).collect()
    }

    /// Two meters of one flow, of which one ends where the other goes on.
    fn two_meters(&mut self) {
        const FLOW: Target = Target::Channel(Channel::Flow);
        let first = self.taken.get(&FLOW).copied();
        let unit = |index: usize| {
            let meanings = meanings(&self.column(index).label);
            if meanings.iter().any(|meaning| meaning.target != FLOW) {
                return None;
            }
            // A symbol with more in its name means nothing, its unit does.
            let said = meanings.into_iter().find_map(|meaning| meaning.unit);
            let unit = said.or_else(|| self.unit_for(index, Quantity::Flow))?;
            let known = Quantity::Flow.unit(Some(&unit), "").ok()?;
            let values = self.values(index).iter();
            Some((
                index,
                unit,
                values
                    .map(|value| known.convert(*value))
                    .collect::<Vec<f64>>(),
            ))
        };
        let free = self.free();
        let all = || free.iter().copied().filter_map(unit);
        let small: Vec<(usize, String, Vec<f64>)> = all().collect();
        let large = match first {
            Some(index) => unit(index).into_iter().collect(),
            None => small.clone(),
        };
        let pairs = large
            .iter()
            .flat_map(|large| small.iter().map(move |small| (large, small)));
        let found = pairs.filter_map(|(large, small)| {
            let limit = limit(&small.2, &large.2)?;
            Some((large.0, large.1.clone(), small.0, small.1.clone(), limit))
        });
        let found: Vec<_> = found.collect();
        let [(large, large_unit, small, small_unit, limit)] = &found[..] else {
            return;
        };
        let names = [*small, *large].map(|index| quoted(&self.column(index).label.text));
        if first.is_none() {
            let reason = format!("it goes on where {} ends", names[0]);
            self.propose(*large, FLOW, Some(large_unit.clone()), reason);
        }
        let reason = format!(
            "it is {} up to {limit} L/min and stays at its end beyond: the meter for small flows",
            names[1]
        );
        let unit = Quantity::Flow
            .unit(Some(small_unit), "")
            .expect("it was known");
        let written = limit / unit.convert(1.0);
        let map = format!(
            "{}=flow [{small_unit}] below {:.3}",
            self.name(*small),
            written
        );
        if let Ok(mapping) = map.parse() {
            self.small.push(*small);
            self.proposed.proposals.push(Proposal {
                column: self.column(*small).label.text.clone(),
                map: format!("{mapping}"),
                reason,
                index: *small,
                target: FLOW,
                mapping,
            });
        }
    }

    /// The surest names first; of two that are as sure, neither.
    fn by_name(&mut self) {
        let possible = |index: usize| {
            let values = self.values(index);
            let timed = self.column(index).moments.is_some();
            let fits = move |meaning: &Meaning| match meaning.target {
                Target::Time => rises(values),
                Target::Channel(_) if timed => false,
                Target::Channel(channel) => channel != Channel::Temperature || !rises(values),
            };
            let meanings = meanings(&self.column(index).label).into_iter().filter(fits);
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
            let counts = *target == Target::Time && *certainty == COUNTS && unit.is_none();
            if counts && counts_evenly(self.values(*index)) {
                self.doubt_counter(*index);
                continue;
            }
            let mut reason = match &unit {
                Some(unit) => format!("its name says {word:?}, its unit is {unit:?}"),
                None => format!("its name says {word:?}"),
            };
            if *target == Target::Time {
                reason.push_str(", and it rises from row to row");
            }
            self.propose(*index, *target, unit.clone(), reason);
        }
    }

    /// A column that counts says nothing of when rows were taken.
    fn doubt_counter(&mut self, index: usize) {
        let name = quoted(&self.column(index).label.text);
        self.proposed.doubts.push(format!(
            "{name} counts: say how far rows are apart, with --sample-interval SECONDS"
        ));
        self.doubtful.push(index);
    }

    /// The only column that rises throughout.
    fn time_by_values(&mut self) {
        if self.taken.contains_key(&Target::Time) {
            return;
        }
        let mut rising = self.free();
        // A column in another unit is another quantity.
        let may_be_time = |index: usize| match &self.column(index).label.unit {
            Some(unit) => !unit::is_known(unit) || self.unit_for(index, Quantity::Time).is_some(),
            None => true,
        };
        rising.retain(|&index| rises(self.values(index)) && may_be_time(index));
        if let [only] = rising[..] {
            let label = &self.column(only).label;
            let unit = self.unit_for(only, Quantity::Time);
            if label.unit.is_none() && unit.is_none() && counts_rows(self.values(only)) {
                return self.doubt_counter(only);
            }
            let reason = "it is the only column that rises from row to row".into();
            self.propose(only, Target::Time, unit, reason);
        }
    }

    /// Command and response are alike, and the response is behind.
    fn by_likeness(&mut self) {
        let responses = Channel::RESPONSES.map(Target::Channel);
        let command = self.taken.get(&COMMAND).copied();
        let response = responses
            .iter()
            .find_map(|target| self.taken.get(target).copied());
        let flow = |index: usize| self.unit_for(index, Quantity::Flow).is_some();
        let mut free = self.free();
        free.retain(|&index| self.column(index).moments.is_none());
        free.retain(|&index| flow(index) || self.may_be_signal(index));
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
        let pairs: Vec<_> = pairs
            .into_iter()
            .filter(|&(early, _)| !flow(early))
            .collect();
        // Where neither is known, only what is behind is the response.
        let least = isize::from(command.is_none() && response.is_none());
        let alike = |&(early, late): &(usize, usize)| {
            let follows = follows(self.values(early), self.values(late))?;
            (follows.rows >= least && follows.is_close()).then_some((early, late, follows))
        };
        let strength = |(_, _, follows): &(usize, usize, Follows)| follows.correlation.abs();
        let found = pairs.iter().filter_map(alike);
        let Some((early, late, Follows { rows, correlation })) =
            found.max_by(|one, other| strength(one).total_cmp(&strength(other)))
        else {
            return;
        };
        let of_flow = flow(late);
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
            let channel = if of_flow {
                Channel::Flow
            } else {
                Channel::Spool
            };
            let unit = self.unit_for(late, channel.quantity());
            self.propose(late, Target::Channel(channel), unit, behind);
        }
    }

    /// Whether neither its name nor its unit makes it another quantity than a signal of the spool's loop.
    fn may_be_signal(&self, index: usize) -> bool {
        let label = &self.column(index).label;
        let unit = label.unit.as_deref().filter(|unit| unit::is_known(unit));
        !is_no_signal(label)
            && unit.is_none_or(|_| self.unit_for(index, Quantity::Signal).is_some())
    }

    /// The unit beside the column's name or at its end, if it is one of this quantity.
    fn unit_for(&self, index: usize, quantity: Quantity) -> Option<String> {
        unit_of(quantity, &self.column(index).label)
    }

    fn propose(&mut self, index: usize, target: Target, unit: Option<String>, mut reason: String) {
        let moments = self.column(index).moments.as_ref();
        let unit = match unit.or_else(|| moments.map(|_| "s".into())) {
            Some(unit) => unit,
            None => {
                let label = &self.column(index).label;
                let given = match &label.unit {
                    Some(unit) if unit::is_known(unit) => {
                        format!("{unit:?} is no unit of a {target}")
                    }
                    Some(unit) => format!("the unit {unit:?} is not known"),
                    None => match label.text.contains(['(', '[']) {
                        true => format!("{} has no unit that is known", quoted(&label.text)),
                        false => "no unit is given".into(),
                    },
                };
                let Some(assumed) = self.assumed(index, target) else {
                    let name = quoted(&label.text);
                    self.proposed.doubts.push(format!(
                        "{name} may be {target}, for {reason}; but {given}: say which with --map \"{}={target} [UNIT]\"",
                        self.name(index)
                    ));
                    self.doubtful.push(index);
                    return;
                };
                reason.push_str(&format!("; {given}, so [{assumed}] is assumed"));
                if assumed == "ms" {
                    let interval = median_interval(self.values(index));
                    reason.push_str(&format!(": in s a row would come every {interval} s"));
                }
                assumed.into()
            }
        };
        let column = self.name(index);
        let mut map = format!("{column}={target} [{unit}]");
        if let Target::Channel(_) = target
            && unit == "mA"
            && has_live_zero(self.values(index))
        {
            map = format!("{column}={target} {OF_LIVE_ZERO}");
            reason.push_str("; all of it is within 4-20 mA, so its null is taken to be at 12 mA");
        }
        let Ok(mapping) = map.parse() else {
            return;
        };
        self.taken.insert(target, index);
        self.proposed.proposals.push(Proposal {
            column: self.column(index).label.text.clone(),
            map,
            reason,
            index,
            target,
            mapping,
        });
    }

    /// The unit of a column that has none for this target; `None` where a guess would be one among several.
    fn assumed(&self, index: usize, target: Target) -> Option<&'static str> {
        let label = &self.column(index).label;
        match target.quantity() {
            Quantity::Signal => Some("1"),
            // Whole numbers that are too far apart for s.
            Quantity::Time if median_interval(self.values(index)) >= SLOW => {
                let whole = self.values(index).iter().all(|time| time.fract() == 0.0);
                Some(if whole && label.unit.is_none() {
                    "ms"
                } else {
                    "s"
                })
            }
            // What stands behind the name is a unit, only not one that is known.
            quantity => match label.unit.is_some() || label.text.contains(['(', '[']) {
                true => None,
                false => Some(quantity.usual().kept()),
            },
        }
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

/// Whether the values rise, but for a few.
fn rises(values: &[f64]) -> bool {
    const SHARE: f64 = 0.9;
    let rising = values.windows(2).filter(|pair| pair[0] < pair[1]).count();
    values.len() > 1 && rising as f64 >= SHARE * (values.len() - 1) as f64
}

/// Whether a column counts the rows, one by one.
fn counts_rows(values: &[f64]) -> bool {
    counts_evenly(values) && values[1] - values[0] == 1.0
}

/// Whether a column goes on by the same whole number from each row to the next.
fn counts_evenly(values: &[f64]) -> bool {
    let mut steps = values.windows(2).map(|pair| pair[1] - pair[0]);
    let first = steps.next().unwrap_or(0.0);
    first >= 1.0 && first.fract() == 0.0 && steps.all(|step| step == first)
}
