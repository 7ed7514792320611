//! Which valve departs from its siblings, in what, and by which cause.
//!
//! A value is compared with the median of the batch, or with the baseline's where there is one. It departs if it is further
//! off than chance allows by how much siblings differ anyway (1.4826 times the median deviation from their median) and by how
//! sure both values are, with one level of 5 % for all values of all valves together (Holm 1979).

use super::{BatchRow, NamedValue, RowStatus};
use crate::compare::family::{HALF, LEVEL, family_wise, two_sided};
use crate::diagnose::Verdict;
use serde::Serialize;
use std::collections::BTreeMap;

/// Fewer siblings than this say nothing of how much they differ.
const SIBLINGS: usize = 5;
/// What makes the median deviation of normal values their standard deviation.
const NORMAL: f64 = 1.482_602_218_505_602;
/// A median deviation is known as well as a standard deviation of this share of the values.
const EFFICIENCY: f64 = 0.37;
/// Share of a value below which two of them are the same.
const ARITHMETIC: f64 = 1e-3;

/// What values are compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The baseline, by the spread of so many siblings; of fewer than five, by the intervals alone.
    Baseline(usize),
    /// The median of so many siblings.
    Siblings(usize),
    /// Nothing: there is no baseline, and no more siblings than so many.
    Nothing(usize),
}

impl Departures {
    /// Everything that departs: figures, then parameters.
    pub fn all(&self) -> impl Iterator<Item = &Departure> {
        self.figures.iter().chain(&self.parameters)
    }
}

impl Against {
    /// In words.
    pub fn describe(self) -> String {
        match self {
            Self::Baseline(count) if count >= SIBLINGS => format!(
                "compared with the baseline, by how much the {count} valves differ among themselves"
            ),
            Self::Baseline(_) => "compared with the baseline, by the intervals alone".into(),
            Self::Siblings(count) => format!("compared with the median of the {count} valves"),
            Self::Nothing(count) => format!(
                "not compared: of {count} valves none can be told to depart without a --baseline"
            ),
        }
    }
}

/// A value that departs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Departure {
    /// Name of the figure or the parameter.
    pub name: String,
    /// What people call it.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// The baseline's value, or the siblings' median.
    pub usual: f64,
    /// How far it is off, in standard deviations.
    pub deviations: f64,
    /// The chance of that, corrected for how many values were compared.
    pub p_value: f64,
}

/// What a valve departs in.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Departures {
    /// Figures of the card, the furthest first.
    pub figures: Vec<Departure>,
    /// Parameters, the furthest first.
    pub parameters: Vec<Departure>,
    /// What explains it: effects that the others have not, or it has not; otherwise the parameter that is furthest off. Null
    /// where nothing departs.
    pub cause: Option<String>,
}

/// What the rows are compared with, and what each departs in; none for the baseline and for rows without a report.
pub fn departures(rows: &[BatchRow]) -> (Against, Vec<Option<Departures>>) {
    let baseline = rows
        .iter()
        .find(|row| row.baseline && row.status == RowStatus::Ok);
    let siblings: Vec<&BatchRow> = rows
        .iter()
        .filter(|row| !row.baseline && row.status == RowStatus::Ok)
        .collect();
    let against = match (baseline, siblings.len()) {
        (Some(_), count) => Against::Baseline(count),
        (None, count @ SIBLINGS..) => Against::Siblings(count),
        (None, count) => Against::Nothing(count),
    };
    if let Against::Nothing(_) = against {
        return (against, vec![None; rows.len()]);
    }
    let figures = Family::of(&siblings, baseline, |row| &row.figures);
    let parameters = Family::of(&siblings, baseline, |row| &row.parameters);
    let mut found: Vec<Departures> = siblings
        .iter()
        .map(|row| Departures {
            figures: figures.of_row(&row.figures),
            parameters: parameters.of_row(&row.parameters),
            cause: None,
        })
        .collect();
    holm(&mut found);
    let usual = usual_effects(&siblings, baseline);
    for (row, own) in siblings.iter().zip(&mut found) {
        own.cause = cause(row, own, &usual);
    }
    let mut found = found.into_iter();
    let of_row = |row: &BatchRow| match row.baseline || row.status != RowStatus::Ok {
        true => None,
        false => found.next(),
    };
    (against, rows.iter().map(of_row).collect())
}

/// What is usual for each name and unit: the value, and the variance that a departure is measured by.
struct Family<'a> {
    usual: BTreeMap<(&'a str, &'a str), (f64, f64)>,
    freedom: f64,
}

impl<'a> Family<'a> {
    fn of(
        siblings: &[&'a BatchRow],
        baseline: Option<&'a BatchRow>,
        values: impl Fn(&'a BatchRow) -> &'a [NamedValue],
    ) -> Self {
        let mut all: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
        for value in siblings.iter().flat_map(|row| values(row)) {
            if error(value).is_some() {
                let key = (value.name.as_str(), value.unit.as_str());
                all.entry(key).or_default().push(value.value);
            }
        }
        let usual = all.into_iter().filter_map(|(key, mut own)| {
            let count = own.len();
            let centre = median(&mut own)?;
            let mut apart: Vec<f64> = own.iter().map(|value| (value - centre).abs()).collect();
            let spread = match count >= SIBLINGS {
                true => NORMAL * median(&mut apart)?,
                false => 0.0,
            };
            let Some(baseline) = baseline else {
                // The median of a few is known no better than its spread allows.
                return (count >= SIBLINGS).then_some((key, (centre, spread.powi(2))));
            };
            let same = |value: &&NamedValue| (value.name.as_str(), value.unit.as_str()) == key;
            let good = values(baseline).iter().find(same)?;
            let variance = spread.powi(2) + error(good)?.powi(2);
            Some((key, (good.value, variance)))
        });
        Self {
            usual: usual.collect(),
            freedom: match siblings.len() {
                count @ SIBLINGS.. => EFFICIENCY * (count - 1) as f64,
                _ => f64::INFINITY,
            },
        }
    }

    /// Every value of a row beside what is usual, the furthest first, with its own chance.
    fn of_row(&self, values: &[NamedValue]) -> Vec<Departure> {
        let departure = |value: &NamedValue| {
            let key = (value.name.as_str(), value.unit.as_str());
            let (usual, variance) = *self.usual.get(&key)?;
            let apart = value.value - usual;
            let size = value.value.abs().max(usual.abs());
            if apart.abs() <= ARITHMETIC * size {
                return None;
            }
            let deviation = (variance + error(value)?.powi(2)).sqrt();
            let deviations = apart / deviation.max(f64::MIN_POSITIVE);
            Some(Departure {
                name: value.name.clone(),
                label: value.label.clone(),
                unit: value.unit.clone(),
                value: value.value,
                usual,
                deviations: deviations.clamp(-1e9, 1e9),
                p_value: two_sided(deviations, self.freedom),
            })
        };
        let mut all: Vec<Departure> = values.iter().filter_map(departure).collect();
        all.sort_by(|a, b| b.deviations.abs().total_cmp(&a.deviations.abs()));
        all
    }
}

/// The standard error of a value; none where nothing says how sure it is. What the model has not is zero.
fn error(value: &NamedValue) -> Option<f64> {
    match (value.low, value.high) {
        (Some(low), Some(high)) => Some((high - low) / (2.0 * HALF)),
        _ if value.none_in_model => Some(0.0),
        _ => None,
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    Some(match values.len() % 2 {
        0 => 0.5 * (values.get(middle.checked_sub(1)?)? + values.get(middle)?),
        _ => *values.get(middle)?,
    })
}

/// Corrects the chances for how many values were compared, and keeps what is still beyond chance.
fn holm(rows: &mut [Departures]) {
    let mut all: Vec<&mut Departure> = rows
        .iter_mut()
        .flat_map(|row| row.figures.iter_mut().chain(&mut row.parameters))
        .collect();
    let chances: Vec<f64> = all.iter().map(|one| one.p_value).collect();
    for (one, corrected) in all.iter_mut().zip(family_wise(&chances)) {
        one.p_value = corrected;
    }
    for row in rows {
        row.figures.retain(|one| one.p_value < LEVEL);
        row.parameters.retain(|one| one.p_value < LEVEL);
    }
}

/// The effects that the baseline has; without one those that most siblings have.
fn usual_effects<'a>(siblings: &[&'a BatchRow], baseline: Option<&'a BatchRow>) -> Vec<&'a str> {
    if let Some(baseline) = baseline {
        return baseline.effects.iter().map(String::as_str).collect();
    }
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for effect in siblings.iter().flat_map(|row| &row.effects) {
        *counts.entry(effect).or_default() += 1;
    }
    let most = |(effect, count): (&'a str, usize)| (2 * count > siblings.len()).then_some(effect);
    counts.into_iter().filter_map(most).collect()
}

/// Why a row departs, where it does.
fn cause(row: &BatchRow, departures: &Departures, usual: &[&str]) -> Option<String> {
    if departures.figures.is_empty() && departures.parameters.is_empty() {
        return None;
    }
    if row.verdict == Some(Verdict::Unexplained) {
        return Some("something that has no name in the catalogue".into());
    }
    let more = row
        .effects
        .iter()
        .filter(|own| !usual.contains(&own.as_str()));
    let less = usual
        .iter()
        .filter(|effect| row.effects.iter().all(|own| own != *effect));
    let causes: Vec<String> = more
        .cloned()
        .chain(less.map(|effect| format!("no {effect}")))
        .collect();
    match (causes.is_empty(), departures.parameters.first()) {
        (false, _) => Some(causes.join("; ")),
        (true, Some(parameter)) => Some(parameter.name.clone()),
        (true, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Valves whose lap is 2 % and whose gain is 200 1/s, both within a tenth and known to a hundredth.
    fn valves(count: usize, seed: u64) -> Vec<BatchRow> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
        (0..count)
            .map(|i| {
                let mut value = |name: &str, unit: &str, size: f64| {
                    let own = size * (1.0 + 0.1 * normal());
                    NamedValue {
                        name: name.into(),
                        label: name.into(),
                        unit: unit.into(),
                        value: own,
                        low: Some(own - 0.01 * size),
                        high: Some(own + 0.01 * size),
                        none_in_model: false,
                    }
                };
                let nothing = Error::input("here", "nothing", "none");
                BatchRow {
                    status: RowStatus::Ok,
                    figures: vec![value("lap", "%", 2.0), value("rated_flow", "L/min", 60.0)],
                    parameters: vec![value("gain", "1/s", 200.0)],
                    ..BatchRow::without_report(&format!("{i}.csv"), None, &nothing)
                }
            })
            .collect()
    }

    fn change(value: &mut NamedValue, by: f64) {
        value.value += by;
        value.low = value.low.map(|end| end + by);
        value.high = value.high.map(|end| end + by);
    }

    #[test]
    fn a_valve_that_departs_is_named_with_the_figure_and_the_cause_and_no_other_is() {
        let mut rows = valves(30, 1);
        change(&mut rows[7].figures[0], 3.0);
        rows[7].effects = vec!["overlap".into()];
        change(&mut rows[9].parameters[0], -120.0);
        let (against, found) = departures(&rows);
        assert_eq!(against, Against::Siblings(30));
        for (i, found) in found.iter().enumerate() {
            let found = found.as_ref().unwrap();
            let names: Vec<&str> = found.figures.iter().map(|one| one.name.as_str()).collect();
            let cause = found.cause.as_deref();
            match i {
                7 => assert_eq!((names.as_slice(), cause), (&["lap"][..], Some("overlap"))),
                9 => assert_eq!((names.as_slice(), cause), (&[][..], Some("gain"))),
                _ => assert_eq!((names.as_slice(), cause), (&[][..], None), "{i}"),
            }
        }
    }

    #[test]
    fn of_healthy_valves_hardly_ever_one_is_said_to_depart() {
        let batches = 400;
        let alarms = (0..batches)
            .filter(|&seed| {
                let (_, found) = departures(&valves(20, seed));
                found
                    .iter()
                    .flatten()
                    .any(|one| *one != Departures::default())
            })
            .count();
        assert!(alarms <= 20, "{alarms} of {batches}");
    }

    #[test]
    fn few_valves_are_compared_with_a_baseline_or_not_at_all() {
        let mut rows = valves(4, 3);
        assert_eq!(departures(&rows).0, Against::Nothing(4));
        assert!(departures(&rows).1.iter().all(Option::is_none));
        let mut good = rows[0].clone();
        good.baseline = true;
        rows.truncate(1);
        change(&mut rows[0].figures[0], 0.2);
        rows.insert(0, good);
        let (against, found) = departures(&rows);
        assert_eq!(against, Against::Baseline(1));
        assert!(found[0].is_none());
        let own = found[1].as_ref().unwrap();
        assert_eq!(own.figures.len(), 1);
        assert_eq!(own.figures[0].name, "lap");
        assert!((own.figures[0].usual + 0.2 - own.figures[0].value).abs() < 1e-12);
    }
}
