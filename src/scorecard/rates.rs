//! From rows to rates.

use super::case::{COVERED, Row};
use super::outcome::Outcome;
use super::plan::Group;
use crate::diagnose::Place;
use statrs::distribution::{Beta, ContinuousCDF};
use std::collections::BTreeMap;

/// How many of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rate {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
}

impl Rate {
    /// How many of `items` are so.
    pub fn of<T>(items: impl IntoIterator<Item = T>, is: impl Fn(&T) -> bool) -> Self {
        let mut rate = Self::default();
        for item in items {
            rate.of += 1;
            rate.hits += usize::from(is(&item));
        }
        rate
    }

    /// The share; not a number where there are none.
    pub fn share(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// The 95 % interval of the share after Clopper and Pearson (1934): at least that sure, also for few.
    pub fn interval(self) -> (f64, f64) {
        let (hits, misses) = (self.hits as f64, (self.of - self.hits) as f64);
        let quantile = |a: f64, b: f64, level: f64| {
            Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(level))
        };
        let low = match self.hits {
            0 => 0.0,
            _ => quantile(hits, misses + 1.0, 0.025),
        };
        let high = match self.hits == self.of {
            true => 1.0,
            false => quantile(hits + 1.0, misses, 0.975),
        };
        (low, high)
    }
}

/// Seconds after which one may ask what is known.
const WITHIN: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 60.0];

/// The base model's held-out error in units of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Band {
    /// Below 1.5: little to be seen.
    Below,
    /// 1.5 to 2.5.
    Weak,
    /// 2.5 to 5.
    Clear,
    /// Above 5.
    Strong,
}

impl Band {
    /// The band in which an error lies.
    pub fn of(error: f64) -> Self {
        match error {
            e if e < 1.5 => Self::Below,
            e if e < 2.5 => Self::Weak,
            e if e <= 5.0 => Self::Clear,
            _ => Self::Strong,
        }
    }

    /// Its limits.
    pub fn name(self) -> &'static str {
        match self {
            Self::Below => "below 1.5",
            Self::Weak => "1.5 to 2.5",
            Self::Clear => "2.5 to 5",
            Self::Strong => "above 5",
        }
    }
}

/// How often each outcome was met.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tally {
    /// By outcome.
    pub counts: BTreeMap<Outcome, usize>,
    /// What one hopes for.
    pub good: Rate,
    /// A name for what is not there.
    pub misnamed: Rate,
}

impl Tally {
    fn add(&mut self, row: &Row) {
        *self.counts.entry(row.outcome).or_default() += 1;
        for (rate, hit) in [
            (&mut self.good, row.outcome.good(row.group)),
            (&mut self.misnamed, row.outcome.misnames()),
        ] {
            rate.of += 1;
            rate.hits += usize::from(hit);
        }
    }

    /// Rows with this outcome.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.counts.get(&outcome).copied().unwrap_or(0)
    }
}

/// What the rows come to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// By group; what the base model's error hardly shows (below 1.5) is apart.
    pub groups: Vec<(String, Tally)>,
    /// By group and the base model's error.
    pub bands: Vec<(String, Tally)>,
    /// By what is planted, pairs aside, without what hardly shows.
    pub effects: Vec<(String, Tally)>,
    /// What is planted, what it was called, and how often, for all that is not as one hopes.
    pub confusions: Vec<(String, String, usize)>,
    /// Held-out error of the result over the noise, single effects in their usual form without what hardly shows:
    /// median, 90 % quantile, and how many are at most 1.10.
    pub after: Option<(f64, f64, Rate)>,
    /// How often the place where the base model fails is that of what is planted, by that place, without what hardly shows.
    pub located: Vec<(Place, Rate)>,
    /// How often the 95 % intervals hold the truth, by parameter.
    pub coverage: Vec<(&'static str, Rate)>,
    /// Seconds of a diagnosis: median and most.
    pub seconds: Option<(f64, f64)>,
    /// Of all records those with a good outcome after so many seconds: rightness against time.
    pub within: Vec<(f64, Rate)>,
}

impl Summary {
    /// Of these rows, in whatever order.
    pub fn of(rows: &[Row]) -> Self {
        let mut groups: BTreeMap<(Group, bool), Tally> = BTreeMap::new();
        let mut bands: BTreeMap<(Group, Band), Tally> = BTreeMap::new();
        let mut effects: BTreeMap<(Group, &str), Tally> = BTreeMap::new();
        let mut confusions: BTreeMap<(Group, &str, String), usize> = BTreeMap::new();
        for row in rows {
            let shows = row.group == Group::Null || Band::of(row.base) != Band::Below;
            groups.entry((row.group, !shows)).or_default().add(row);
            if row.group != Group::Null {
                let band = Band::of(row.base);
                bands.entry((row.group, band)).or_default().add(row);
                if shows && row.group != Group::Pairs {
                    let key = (row.group, row.planted.as_str());
                    effects.entry(key).or_default().add(row);
                }
            }
            if !row.outcome.good(row.group) {
                let named = match row.outcome {
                    Outcome::Failed => "failed".into(),
                    _ if row.named.is_empty() => row.verdict.clone(),
                    _ => row.named.clone(),
                };
                *confusions
                    .entry((row.group, &row.planted, named))
                    .or_default() += 1;
            }
        }
        let single = |row: &&Row| row.group == Group::Single && Band::of(row.base) != Band::Below;
        let after: Vec<f64> = rows.iter().filter(single).map(|row| row.after).collect();
        let seconds: Vec<f64> = rows.iter().map(|row| row.seconds).collect();
        let coverage = COVERED.into_iter().enumerate().map(|(index, name)| {
            let known = rows.iter().filter_map(|row| row.covered[index]);
            (name, Rate::of(known, |covered| *covered))
        });
        let named = |((group, below), tally): ((Group, bool), Tally)| {
            let below = if below { ", below 1.5" } else { "" };
            (format!("{group}{below}"), tally)
        };
        Self {
            groups: groups.into_iter().map(named).collect(),
            bands: bands
                .into_iter()
                .map(|((group, band), tally)| (format!("{group}, {}", band.name()), tally))
                .collect(),
            effects: effects
                .into_iter()
                .map(|((_, name), tally)| (name.to_owned(), tally))
                .collect(),
            confusions: confusions
                .into_iter()
                .map(|((_, planted, named), count)| (planted.to_owned(), named, count))
                .collect(),
            after: quantile(&after, 0.5)
                .zip(quantile(&after, 0.9))
                .map(|(median, high)| (median, high, Rate::of(&after, |after| **after <= 1.10))),
            located: located(rows),
            coverage: coverage.collect(),
            seconds: quantile(&seconds, 0.5).zip(quantile(&seconds, 1.0)),
            within: WITHIN.map(|limit| (limit, good_within(rows, limit))).into(),
        }
    }
}

/// How often the place that is told is that of what is planted.
fn located(rows: &[Row]) -> Vec<(Place, Rate)> {
    let shows = |row: &&Row| Band::of(row.base) != Band::Below;
    let of_place = |place: Place| {
        let rows = rows.iter().filter(shows);
        let rows = rows.filter(|row| row.place == Some(place));
        (place, Rate::of(rows, |row| row.located == Some(place)))
    };
    let places = Place::ALL.into_iter().map(of_place);
    places.filter(|(_, rate)| rate.of > 0).collect()
}

/// How many of `rows` have a good outcome, and had it after `limit` seconds.
fn good_within(rows: &[Row], limit: f64) -> Rate {
    Rate::of(rows, |row| {
        row.outcome.good(row.group) && row.seconds <= limit
    })
}

/// The smallest of `values` below or at which a share of `level` of them lies; of those that are numbers.
pub fn quantile(values: &[f64], level: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    let rank = (level * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_clopper_and_pearson() {
        // R: binom.test(hits, of)$conf.int
        for (hits, of, low, high) in [
            (0, 10, 0.0, 0.308_497_1),
            (10, 10, 0.691_502_9, 1.0),
            (5, 10, 0.187_086_0, 0.812_914_0),
            (10, 200, 0.024_233_29, 0.090_026_5),
        ] {
            let (found_low, found_high) = Rate { hits, of }.interval();
            assert!(
                (found_low - low).abs() < 1e-4,
                "{hits} of {of}: {found_low}"
            );
            assert!(
                (found_high - high).abs() < 1e-4,
                "{hits} of {of}: {found_high}"
            );
        }
    }

    #[test]
    fn quantiles_are_values_that_were_met() {
        let values = [3.0, f64::NAN, 1.0, 2.0, 4.0];
        assert_eq!(quantile(&values, 0.5), Some(2.0));
        assert_eq!(quantile(&values, 0.9), Some(4.0));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
        assert_eq!(quantile(&[f64::NAN], 0.5), None);
    }
}
