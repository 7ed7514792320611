//! The figures of the card as the measured curves show them, by the constructions of ISO 10770-1 and without any model: from
//! slow cycles and slow small reversals, from responses to sines and other rich commands, and from steps.

mod accuracy;
mod blocked;
mod frequency;
mod reading;
pub(super) mod sheet;
mod step;
mod sweep;
mod threshold;

use super::bench::DROP;
use super::cycle::Cycle;
use super::figures::{Definition, NO_NULL, Needs, Source};
use super::response::Point;
use crate::model::valve::Drop;
use crate::model::{Hold, Structure};
use crate::record::{Channel, Record};
pub use accuracy::Accuracy;
use accuracy::{PRESSURES, Sensors};
use blocked::Blocked;
use frequency::Empirical;
pub use reading::Reading;
use reading::short;
use step::Steps;
use sweep::Sweep;
use threshold::Thresholds;

/// Rows with less than this share of the rated drop say nothing about the flow at the rated one.
const LEAST_DROP: f64 = 0.1;

/// What records show of the figures of a card.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    full: f64,
    output: Channel,
    sweep: Result<Sweep, String>,
    /// What the flow was corrected to, or why it was not.
    conditions: &'static str,
    responses: Vec<Result<Empirical, String>>,
    steps: Result<Steps, String>,
    blocked: Blocked,
    thresholds: Result<Thresholds, String>,
    sensors: Sensors,
}

impl Measured {
    /// What `records` show of a valve of this structure, whose sensors have this accuracy.
    pub fn of(structure: &Structure, records: &[&Record], accuracy: &Accuracy) -> Self {
        let full = structure.full_scale;
        let output = match structure.valve() {
            Some(_) => Channel::Flow,
            None => Channel::Spool,
        };
        let drop = structure.valve().map(|valve| valve.drop);
        let corrected = drop.is_some_and(|drop| drop != Drop::Rated);
        let rows: Vec<[Vec<f64>; 3]> = records
            .iter()
            .filter_map(|record| rows(record, output, corrected))
            .collect();
        let columns: Vec<[&[f64]; 3]> = rows
            .iter()
            .map(|one| one.each_ref().map(Vec::as_slice))
            .collect();
        let sweep = match columns.is_empty() {
            true => Err(format!("no {output} was measured")),
            false => Sweep::of(&columns, full),
        };
        let moving: Vec<(Channel, [&[f64]; 3])> = records
            .iter()
            .filter_map(|record| {
                let found = [Channel::Spool, Channel::Flow].into_iter();
                let (channel, series) = found
                    .filter_map(|one| Some((one, record.get(one)?)))
                    .next()?;
                let columns = [record.time(), &record.command().values, &series.values];
                Some((channel, columns.map(|column: &[f64]| column)))
            })
            .collect();
        let responses = moving
            .iter()
            .map(|(channel, columns)| Empirical::of(*channel, *columns, full));
        Self {
            full,
            output,
            sweep,
            conditions: match (output, corrected) {
                (Channel::Flow, true) => ", corrected to 70 bar",
                (Channel::Flow, false) => ", no pressure measured",
                _ => "",
            },
            responses: responses.collect(),
            steps: Steps::of(&moving, full),
            blocked: Blocked::of(records, full),
            thresholds: Thresholds::of(&columns, output, full),
            sensors: Sensors {
                output: accuracy.of(output),
                command: accuracy.of(Channel::Command),
                drop: if corrected {
                    drop_share(records, accuracy)
                } else {
                    0.0
                },
            },
        }
    }

    /// The slow cycle as it was measured, if one was.
    pub fn cycle(&self) -> Option<Cycle> {
        self.sweep.as_ref().ok().map(Sweep::pooled)
    }

    /// The responses as they were measured, each with its amplitude, % of full scale; the command between two rows is as `hold`
    /// says.
    pub fn responses(&self, hold: Hold) -> Vec<(f64, Vec<Point>)> {
        let known = self.responses.iter().flatten();
        known.map(|one| (one.amplitude, one.points(hold))).collect()
    }

    /// A figure, or why these records do not show it.
    pub(super) fn read(&self, figure: &Definition, hold: Hold) -> Result<Reading, String> {
        match figure.source {
            Source::PressureGain => self.blocked.gain.clone(),
            Source::Leakage => self.blocked.leakage.clone(),
            Source::Cycle(own) => {
                if self.output != Channel::Flow && matches!(figure.needs, Needs::Valve(_)) {
                    return Err("no flow was measured".into());
                }
                let sweep = self.sweep.as_ref().map_err(Clone::clone)?;
                let (found, spread) = sweep.figures.as_ref().ok_or(NO_NULL)?;
                let value = own(found).ok_or("the cycle ends before full scale")?;
                let half = Some(spread.half_width(value, own)).filter(|half| half.is_finite());
                let half = half.ok_or("the cycles are too unlike each other")?;
                let sensors = self.sensors.half_width(&sweep.pooled(), self.full, own);
                let count = match sweep.count() {
                    1 => "a cycle".into(),
                    several => format!("{several} cycles"),
                };
                let test = format!(
                    "{} over command, {count} of {} s{}",
                    self.output,
                    short(sweep.period),
                    self.conditions
                );
                Ok(Reading::around(value, half.hypot(sensors), test))
            }
            Source::Threshold => {
                let found = self.thresholds.as_ref().map_err(Clone::clone)?;
                Ok(found.reading(self.sensors.command))
            }
            Source::AmplitudeLimit(amplitude) => {
                self.limit(amplitude, |one| one.amplitude_limit(hold))
            }
            Source::PhaseLimit(amplitude) => self.limit(amplitude, |one| one.phase_limit(hold)),
            Source::StepTime => self.steps.as_ref().map_err(Clone::clone)?.time(),
            Source::Overshoot => self.steps.as_ref().map_err(Clone::clone)?.overshoot(),
        }
    }

    /// The surest reading at this amplitude; otherwise why the response that comes closest to one has none.
    fn limit(
        &self,
        amplitude: f64,
        read: impl Fn(&Empirical) -> Result<Reading, String>,
    ) -> Result<Reading, String> {
        let known = || self.responses.iter().flatten();
        let width = |one: &Reading| one.high - one.low;
        let here = known().filter(|one| one.is_at(amplitude)).map(&read);
        let surest = here.reduce(|best, next| match (&best, &next) {
            (Ok(old), Ok(new)) if width(new) < width(old) => next,
            (Err(_), Ok(_)) => next,
            _ => best,
        });
        surest.unwrap_or_else(|| {
            Err(match (known().next(), self.responses.first()) {
                (Some(other), _) => other.elsewhere(),
                (None, Some(Err(reason))) => reason.clone(),
                _ => "no spool or flow was measured".into(),
            })
        })
    }

    /// How far the sensors may be off in a figure of the slow cycle that is read off the model's cycle: it was fitted to them.
    /// From figures of response and step their offsets and gains cancel: these are where the output has fallen to a share of its
    /// own, or gone one of its own way, and when.
    pub(super) fn sensors_in(&self, figure: &Definition, cycle: &Cycle) -> f64 {
        match figure.source {
            Source::Cycle(own) => self.sensors.half_width(cycle, self.full, own),
            _ => 0.0,
        }
    }
}

/// Time, command and output of a record, a flow at the rated drop if that can be; none where it does not have this output.
fn rows(record: &Record, output: Channel, corrected: bool) -> Option<[Vec<f64>; 3]> {
    let values = &record.get(output)?.values;
    let command = &record.command().values;
    if !corrected || output != Channel::Flow {
        return Some([record.time().to_vec(), command.clone(), values.clone()]);
    }
    let drops = drops(record)?;
    let kept: Vec<usize> = (0..values.len())
        .filter(|&row| drops[row] >= LEAST_DROP * DROP)
        .collect();
    let column = |of: &dyn Fn(usize) -> f64| kept.iter().map(|&row| of(row)).collect::<Vec<f64>>();
    Some([
        column(&|row| record.time()[row]),
        column(&|row| command[row]),
        column(&|row| values[row] * (DROP / drops[row]).sqrt()),
    ])
}

/// The pressure that drives the flow through both lands at each row, bar.
fn drops(record: &Record) -> Option<Vec<f64>> {
    let pressure = |channel, row: usize| record.get(channel).map(|series| series.values[row]);
    let flow = &record.get(Channel::Flow)?.values;
    record.get(Channel::SupplyPressure)?;
    let drop = |row: usize| {
        let supply = pressure(Channel::SupplyPressure, row).unwrap_or(0.0);
        let back = pressure(Channel::ReturnPressure, row).unwrap_or(0.0);
        let ports = [Channel::PressureA, Channel::PressureB].map(|port| pressure(port, row));
        let load = match ports {
            [Some(a), Some(b)] => (a - b) * flow[row].signum(),
            _ => 0.0,
        };
        supply - back - load
    };
    Some((0..flow.len()).map(drop).collect())
}

/// How far a flow at the rated drop may be off because the gauges are: half of what the drop is, as a share.
fn drop_share(records: &[&Record], accuracy: &Accuracy) -> f64 {
    let share = |record: &&Record| {
        let drops = drops(record)?;
        let mean = drops.iter().sum::<f64>() / drops.len() as f64;
        let gauges = PRESSURES.into_iter().filter_map(|gauge| {
            let series = record.get(gauge)?;
            Some((accuracy.of(gauge) * series.max_abs()).powi(2))
        });
        Some(0.5 * gauges.sum::<f64>().sqrt() / mean.max(LEAST_DROP * DROP))
    };
    records.iter().filter_map(share).fold(0.0, f64::max)
}
