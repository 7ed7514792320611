//! What the rows of a channel resolve: the step to which values are rounded, and the time for which they stand.

use super::moments::{detrended, mean_square};
use crate::diagnose::statistics::rows::{rate, stretches};

/// Fewest distinct values that are looked at in two halves, and of which a half shows a step of its own.
const ZONE: (usize, usize) = (8, 4);
/// Times that a value of a zone occurs, at least: the values of a ramp are as evenly spaced, but do not come again.
const AGAIN: usize = 3;
/// This share of the differences between neighbouring values are multiples of the step.
const NEARLY_ALL: f64 = 0.9;
/// By how much of a step a multiple may be missed: a step of 3.05 is often written as 3 or 4.
const MISSED: f64 = 0.2;
/// Values nearer to one another than this fraction of the largest are the same: what single precision stores.
const SAME: f64 = 6e-8;
/// The places among the differences, sorted by size, where the step is looked for.
const PLACES: [f64; 6] = [0.0, 0.05, 0.1, 0.25, 0.5, 0.75];
/// Fewest changes of a value that show for how many rows it is held.
const CHANGES: usize = 16;
/// The share of the readings that may be held for fewer rows than the others: two clocks, a first or last row.
const SHORTER: f64 = 0.05;

/// What the rows of a channel resolve.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resolution {
    /// The step to which each row's value is rounded, in the channel's unit; 0 where none is seen.
    pub(super) steps: Vec<f64>,
    /// For how many rows a reading is held, at least; 1 where each row has its own.
    pub(super) held: usize,
    /// How far each row's value moves while its time is not known, in the channel's unit.
    moved: Vec<f64>,
}

impl Resolution {
    /// Of `measured` at `time`, over records that start at the rows `starts`. How fast it moves is told by `simulated`, which
    /// has no noise.
    pub(super) fn new(starts: &[usize], time: &[f64], measured: &[f64], simulated: &[f64]) -> Self {
        let steps = steps(measured);
        let held = held(starts, measured, &steps);
        let seconds = coarse_time(starts, time).max(match held {
            1 => 0.0,
            rows => rows as f64 * row_seconds(starts, time),
        });
        let rates = rate(simulated, time, starts);
        let moved = rates.iter().map(|rate| rate.abs() * seconds).collect();
        Self { steps, held, moved }
    }

    /// The standard deviation that rounding of values and times alone causes: a step has 1/√12 of itself.
    pub(super) fn deviation(&self) -> f64 {
        (mean_square(&self.steps) / 12.0)
            .sqrt()
            .hypot(self.moving())
    }

    /// The part of it that comes of what the values move while their time is not known.
    pub(super) fn moving(&self) -> f64 {
        (mean_square(&self.moved) / 12.0).sqrt()
    }

    /// By how much each row's value can be off for that reason alone.
    pub(super) fn allowance(&self) -> Vec<f64> {
        let both = self.steps.iter().zip(&self.moved);
        both.map(|(step, moved)| (step + moved) / 2.0).collect()
    }

    /// The first row of each reading.
    pub(super) fn readings(&self, starts: &[usize], measured: &[f64]) -> Vec<usize> {
        let mut rows = Vec::new();
        for (&start, record) in starts.iter().zip(stretches(measured, starts)) {
            for (first, length) in runs(record) {
                // A reading like the one before is a reading.
                rows.extend(
                    (first..first + length)
                        .step_by(self.held)
                        .map(|k| start + k),
                );
            }
        }
        rows
    }
}

/// The step to which each of `values` is rounded: 0 where none is seen.
fn steps(values: &[f64]) -> Vec<f64> {
    let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let distinct = distinct(values, SAME * largest);
    let place = |value: &f64| distinct.partition_point(|one| one <= value) - 1;
    let mut times = vec![0; distinct.len()];
    values.iter().for_each(|value| times[place(value)] += 1);
    let mut zones = vec![0.0; distinct.len()];
    set_zones(&distinct, &times, None, &mut zones);
    // At the edge of a zone the finer step fits, too: a value that stands alone among coarse ones is a coarse one.
    let coarsest = zones.iter().fold(0.0, |most: f64, step| most.max(*step));
    for (zone, near) in zones.iter_mut().skip(1).zip(distinct.windows(3)) {
        let alone = (near[1] - near[0]).min(near[2] - near[1]);
        if alone <= (1.0 + MISSED) * coarsest {
            *zone = zone.max(alone);
        }
    }
    values.iter().map(|value| zones[place(value)]).collect()
}

/// Finds the step of all `values`, then that of either half of their range: a meter has finer steps where little flows. A half
/// that has too few values to show its own has that of the whole.
fn set_zones(values: &[f64], times: &[usize], whole: Option<f64>, zones: &mut [f64]) {
    let (divisible, fewest) = ZONE;
    let again = times.iter().sum::<usize>() >= AGAIN * values.len();
    let own = match again && (whole.is_none() || values.len() >= fewest) {
        true => step(values),
        false => None,
    };
    let step = own.or(whole).unwrap_or(0.0);
    zones.fill(step);
    if values.len() >= divisible {
        let middle = (values[0] + values[values.len() - 1]) / 2.0;
        let middle = values.partition_point(|value| *value < middle);
        let (low, high) = zones.split_at_mut(middle);
        set_zones(&values[..middle], &times[..middle], Some(step), low);
        set_zones(&values[middle..], &times[middle..], Some(step), high);
    }
}

/// The largest step of which nearly all differences between neighbouring `values`, which rise, are multiples.
fn step(values: &[f64]) -> Option<f64> {
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let found = PLACES.iter().filter_map(|place| {
        let mut step = sorted[(place * last as f64).round() as usize];
        // The mean of many multiples knows the step better than one that was written with few digits.
        for _ in 0..3 {
            let near = gaps.iter().map(|gap| (gap, (gap / step).round()));
            let (sum, count) = near
                .filter(|(gap, times)| (1.0..=3.0).contains(times) && fits(**gap, step))
                .fold((0.0, 0.0), |(sum, count), (gap, times)| {
                    (sum + gap, count + times)
                });
            if count > 0.0 {
                step = sum / count;
            }
        }
        let multiples = gaps.iter().filter(|gap| fits(**gap, step)).count();
        (multiples as f64 >= NEARLY_ALL * gaps.len() as f64).then_some(step)
    });
    found.max_by(f64::total_cmp)
}

fn fits(gap: f64, step: f64) -> bool {
    let times = (gap / step).round();
    times >= 1.0 && (gap - times * step).abs() <= MISSED * step
}

/// `values`, sorted; those within `same` of one another once.
fn distinct(values: &[f64], same: f64) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup_by(|next, kept| *next - *kept <= same);
    sorted
}

/// First row and length of each run of equal values.
fn runs(values: &[f64]) -> Vec<(usize, usize)> {
    let mut first = 0;
    let runs = values.chunk_by(|a, b| a == b).map(|run| {
        let here = (first, run.len());
        first += run.len();
        here
    });
    runs.collect()
}

/// For how many rows a reading is held, at least: 1 where the values are not held, or stand still for their rounding.
fn held(starts: &[usize], measured: &[f64], steps: &[f64]) -> usize {
    let mut lengths = Vec::new();
    let mut by_one_step = 0;
    for (&start, record) in starts.iter().zip(stretches(measured, starts)) {
        for pair in runs(record).windows(2) {
            let row = start + pair[1].0;
            let change = (measured[row] - measured[row - 1]).abs();
            by_one_step += usize::from(change <= (1.0 + MISSED) * steps[row].max(steps[row - 1]));
            lengths.push(pair[1].1);
        }
    }
    let changes = lengths.len();
    if changes < CHANGES || by_one_step as f64 >= NEARLY_ALL * changes as f64 {
        return 1;
    }
    lengths.sort_unstable();
    lengths[(SHORTER * changes as f64) as usize]
}

/// The step to which the time stamps of regular rows are rounded, s; 0 where it does not show.
fn coarse_time(starts: &[usize], time: &[f64]) -> f64 {
    let coarse = |record: &&[f64]| {
        let intervals: Vec<f64> = record.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // What subtraction leaves of the last digits of a time is no interval of its own.
        let longest = intervals.iter().fold(0.0, |most: f64, one| most.max(*one));
        let digits = 1e-6 * longest + 4.0 * f64::EPSILON * record.last()?.abs();
        let step = step(&distinct(&intervals, digits))?;
        // Where rounding does not explain it, the rows are not regular, and their times are as they are.
        let rounded = detrended(record).iter().all(|off| off.abs() <= step);
        rounded.then_some(step)
    };
    let records = stretches(time, starts);
    records.iter().filter_map(coarse).fold(0.0, f64::max)
}

/// The mean time from row to row, s.
fn row_seconds(starts: &[usize], time: &[f64]) -> f64 {
    let records = stretches(time, starts);
    let spans = records
        .iter()
        .filter_map(|record| Some((record.last()? - record.first()?, record.len() - 1)));
    let (seconds, rows) = spans.fold((0.0, 0), |(s, n), (span, rows)| (s + span, n + rows));
    seconds / rows.max(1) as f64
}
