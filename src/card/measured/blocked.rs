//! Pressure gain and internal leakage off records of tests with blocked ports.

use super::reading::{Reading, deviation, median};
use crate::card::blocked::{slope, within};
use crate::record::{Channel, Record, ends, reversals};
use std::ops::Range;

/// Median magnitude of a normal variable, in standard deviations.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// What records of tests with blocked ports show.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Blocked {
    pub(super) gain: Result<Reading, String>,
    pub(super) leakage: Result<Reading, String>,
}

impl Blocked {
    /// Of those of `records` that have blocked ports, with commands of this full scale.
    pub(super) fn of(records: &[&Record], full: f64) -> Self {
        let blocked: Vec<&Record> = records
            .iter()
            .copied()
            .filter(|record| record.has_blocked_ports())
            .collect();
        Self {
            gain: gain(&blocked, full),
            leakage: leakage(&blocked),
        }
    }
}

/// The load pressure of a record over what its supply has, where both were measured.
fn load(record: &Record) -> Option<Vec<f64>> {
    let of = |channel| record.get(channel).map(|series| &series.values);
    let supply = of(Channel::SupplyPressure)?;
    let load: Vec<f64> = match (
        of(Channel::LoadPressure),
        of(Channel::PressureA),
        of(Channel::PressureB),
    ) {
        (Some(load), ..) => load.clone(),
        (None, Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| a - b).collect(),
        _ => return None,
    };
    let tank = of(Channel::ReturnPressure);
    let share =
        |(row, load): (usize, &f64)| load / (supply[row] - tank.map_or(0.0, |tank| tank[row]));
    Some(load.iter().enumerate().map(share).collect())
}

fn gain(records: &[&Record], full: f64) -> Result<Reading, String> {
    let shown = records
        .iter()
        .filter_map(|record| Some((*record, load(record)?)));
    let mut slopes = Vec::new();
    let mut errors = Vec::new();
    for (record, load) in shown {
        let command = &record.command().values;
        let points: Vec<[f64; 2]> = command
            .iter()
            .zip(&load)
            .map(|(u, p)| [u / full, *p])
            .collect();
        for branch in branches(command) {
            let branch = &points[branch];
            let pressures: Vec<f64> = branch.iter().map(|point| point[1]).collect();
            let (low, high) = ends(&pressures);
            // A branch that does not go through the whole of the straight part has another slope.
            if low < -0.4
                && high > 0.4
                && let Some(found) = slope(branch)
            {
                slopes.push(found);
                errors.push(standard_error(&within(branch), found));
            }
        }
    }
    let count = slopes.len() as f64;
    if slopes.is_empty() {
        return Err(match records.is_empty() {
            true => "no test with blocked ports is in the records".into(),
            false => "no load pressure with that of the supply beside it goes beyond 40 % of it on both sides".into(),
        });
    }
    let value = slopes.iter().sum::<f64>() / count;
    let scatter = errors.iter().map(|error| error * error).sum::<f64>().sqrt() / count;
    // Both directions of a valve with a play have the same slope: what they differ by is how well it repeats.
    let repeated = if slopes.len() > 1 {
        deviation(&slopes) / count.sqrt()
    } else {
        0.0
    };
    let test = format!(
        "load pressure over command with blocked ports, {} of it",
        match slopes.len() {
            1 => "one passage".into(),
            several => format!("{several} passages"),
        }
    );
    Ok(Reading::around(value, 1.96 * scatter.hypot(repeated), test))
}

/// The standard error of a `slope` through `points`.
fn standard_error(points: &[[f64; 2]], slope: f64) -> f64 {
    let count = points.len() as f64;
    let mean = |i: usize| points.iter().map(|point| point[i]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let off = points
        .iter()
        .map(|p| (p[1] - y - slope * (p[0] - x)).powi(2))
        .sum::<f64>();
    let spread = points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    (off / (count - 2.0).max(1.0) / spread).sqrt()
}

fn leakage(records: &[&Record]) -> Result<Reading, String> {
    let flows = records
        .iter()
        .filter_map(|record| record.get(Channel::ReturnFlow));
    // The peak may be as narrow as two rows: no mean over its neighbours is taken, but what the noise has added on average.
    let peaks = flows.map(|flow| {
        let noise = noise(&flow.values);
        (ends(&flow.values).1 - noise, noise)
    });
    let largest = peaks.reduce(|best, next| if next.0 > best.0 { next } else { best });
    let (value, error) = largest.ok_or("no return flow with blocked ports was measured")?;
    let test = "largest return flow with blocked ports".into();
    Ok(Reading::around(value, 1.96 * error, test))
}

/// The standard deviation of what changes from row to row, by the median of second differences.
fn noise(values: &[f64]) -> f64 {
    let second: Vec<f64> = values
        .windows(3)
        .map(|three| (three[0] - 2.0 * three[1] + three[2]).abs())
        .collect();
    if second.is_empty() {
        return 0.0;
    }
    median(second) / (MEDIAN_OF_NORMAL * 6f64.sqrt())
}

/// The rows of each way of the command from one turn to the next.
fn branches(command: &[f64]) -> Vec<Range<usize>> {
    let turns = reversals(command);
    turns.windows(2).map(|pair| pair[0]..pair[1]).collect()
}
