//! How a bench is wired, as far as a record shows it: which way a response goes, a meter without a sign, a current with a
//! live zero; and whether the command moves too slowly to show what moves the spool.

use super::inspect::alike;
use super::interval::median_interval;
use super::{Channel, Record, Series};
use crate::{Error, Result};
use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;

/// A command that changes by less than [`SWEEP`] of its range in so many s shows nothing of a servo valve's actuator: a lag
/// of 10 ms moves the response by less than a sensor's error.
const MOMENT: f64 = 0.05;
const SWEEP: f64 = 8e-3;
/// A command sweeps, though it jumps in this share of its rows at most, where it slowly moves over nearly its whole range and
/// rows are so many s apart at least.
const JUMPS: f64 = 0.01;
const WHOLE: f64 = 0.9;
const COARSE: f64 = 0.01;
/// Rows that are so many s apart show nothing of it, either.
const FAR_APART: f64 = 0.2;

/// A response may lag while the command is like itself, by more than this: beyond, a sine is as like its opposite, and the
/// sign says nothing.
const ITSELF: f64 = 0.3;
/// The position of a closed loop lags less, and is so much like the command.
const CLOSELY: f64 = 0.8;
const FOLLOWS: f64 = 0.9;
/// A record has about so many speeds.
const SPEEDS: usize = 1000;

/// A command has turned when it has gone back by this share of its range.
const TURN: f64 = 0.05;

/// Correlations beyond this tell a direction.
const CLEAR: f64 = 0.7;
/// A meter without a sign shows nothing below zero but what noise and an offset make: less than this share of its largest value.
const BELOW_ZERO: f64 = 0.2;
/// A command goes both ways if it has this share of its largest magnitude on either side.
const BOTH_WAYS: f64 = 0.2;

/// A valve is overdriven by less than this, as a multiple of its full scale.
const FARTHEST: f64 = 3.0;

/// What a current loop with a live zero of 4 mA carries, mA, with what its ends may err; below [`BROKEN`] a wire is broken.
const LIVE: RangeInclusive<f64> = 3.6..=21.0;
const BROKEN: f64 = 3.6;
/// A signal that is nearly always inside those is one; one that swings by less, mA, may be anything.
const NEARLY_ALL: f64 = 0.9;
const SWING: f64 = 2.0;

/// How a response goes with the command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// It rises where the command rises.
    With,
    /// It falls where the command rises.
    Against,
    /// It is never below zero and grows with the command's magnitude: the meter shows no sign.
    Unsigned,
    /// It is not alike enough to tell.
    Unclear,
}

/// What a bench is taken to be where that is not what most are; as text with what it means and what says otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unusual {
    /// The flow falls where the command rises.
    NegativePolarity,
    /// The flow shows no sign.
    NoSign,
    /// The position follows the command.
    ClosedLoop,
    /// The ports A and B were blocked.
    BlockedPorts {
        /// What says so.
        measures: Channel,
    },
    /// The command moves too slowly to show what moves the spool.
    TooSlow {
        /// The largest change of the command in 50 ms, as a share of its range: see [`Record::quickest_change`].
        quickest: f64,
    },
}

impl Display for Unusual {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::NegativePolarity => f.write_str(
                "the flow falls where the command rises: the valve is taken to have negative polarity. If the meter or the command \
                 is inverted instead, --map \"COLUMN=flow [L/min] *-1\" says so",
            ),
            Self::NoSign => f.write_str(
                "the flow shows no sign: it is taken to be that of the pressure line",
            ),
            Self::ClosedLoop => f.write_str(
                "the position follows the command: it is taken to be that of a closed loop (a model file with piston = \"integrated\" \
                 takes it for that of a cylinder which the valve drives)",
            ),
            Self::BlockedPorts { measures } => write!(
                f,
                "{measures} is measured: the ports A and B are taken to be blocked, as they are for pressure gain and internal leakage"
            ),
            Self::TooSlow { quickest } => write!(
                f,
                "too slow to show what moves the spool: but for jumps the command changes by at most {:.2} % of its range in 50 ms. \
                 Gain, time constant and saturation are left out and so are effects that only quick motion shows; the spool is where \
                 the command is (a model file with drive = \"actuator\" keeps them)",
                100.0 * quickest
            ),
        }
    }
}

impl Record {
    /// How `channel` goes with the command.
    pub fn direction(&self, channel: Channel) -> Direction {
        let Some(response) = self.get(channel) else {
            return Direction::Unclear;
        };
        let command = &self.command().values;
        let along = alike(command, &response.values, ITSELF).unwrap_or(0.0);
        let magnitude: Vec<f64> = command.iter().map(|value| value.abs()).collect();
        let unsigned = goes_both_ways(command) && has_no_sign(response);
        if unsigned
            && alike(&magnitude, &response.values, ITSELF).unwrap_or(0.0) > along.abs().max(CLEAR)
        {
            return Direction::Unsigned;
        }
        match along {
            _ if along > CLEAR => Direction::With,
            _ if along < -CLEAR => Direction::Against,
            _ => Direction::Unclear,
        }
    }

    /// Whether the position follows the command, as that of a closed loop does, and its speed does not, as that of a
    /// cylinder does which a valve drives.
    pub fn is_position_loop(&self) -> bool {
        let Some(position) = self.get(Channel::Position) else {
            return false;
        };
        let (command, time) = (&self.command().values, self.time());
        let stride = (time.len() / SPEEDS).max(1);
        let speed = |row: usize| {
            let (before, after) = (
                row.saturating_sub(stride),
                (row + stride).min(time.len() - 1),
            );
            (position.values[after] - position.values[before]) / (time[after] - time[before])
        };
        let speed: Vec<f64> = (0..time.len()).map(speed).collect();
        let like = |response: &[f64]| alike(command, response, CLOSELY).map_or(0.0, f64::abs);
        let follows = like(&position.values);
        follows > FOLLOWS && follows > like(&speed)
    }

    /// The largest change of the command in 50 ms, as a share of its range. Left out are a few jumps from one slow sweep to
    /// the next, where the rows are too far apart to show how a valve answers them.
    pub fn quickest_change(&self) -> f64 {
        let (time, command) = (self.time(), &self.command().values);
        let (low, high) = ends(command);
        let mut early = 0;
        // What is left without jumps, and their rows.
        let (mut most, mut slowly, mut jumps) = (0.0f64, 0.0, 0);
        let mut quickest = 0.0f64;
        for row in 1..time.len() {
            while early + 1 < row && time[row] - time[early + 1] >= MOMENT {
                early += 1;
            }
            let moved = (command[row] - command[early]).abs() / (high - low);
            let change = moved * (MOMENT / (time[row] - time[early])).min(1.0);
            quickest = quickest.max(change);
            if change < SWEEP {
                most = most.max(change);
                slowly += (command[row] - command[row - 1]).abs() / (high - low);
            } else {
                jumps += 1;
            }
        }
        let few = jumps as f64 <= JUMPS * time.len() as f64;
        match few && slowly > WHOLE && median_interval(time) >= COARSE {
            true => most,
            false => quickest,
        }
    }

    /// Whether the record is too slow to show what moves the spool: a static sweep, or rows that are far apart.
    pub fn is_static(&self) -> bool {
        self.quickest_change() < SWEEP || median_interval(self.time()) > FAR_APART
    }

    /// What identify takes the bench to be, where that is not what most are.
    pub(super) fn bench(&self) -> Vec<Unusual> {
        let flow = match self.direction(Channel::Flow) {
            Direction::Against => Some(Unusual::NegativePolarity),
            Direction::Unsigned => Some(Unusual::NoSign),
            Direction::With | Direction::Unclear => None,
        };
        let alone = [Channel::Spool, Channel::Flow]
            .iter()
            .all(|&channel| self.get(channel).is_none());
        let closed = (alone && self.is_position_loop()).then_some(Unusual::ClosedLoop);
        let quickest = self.quickest_change();
        let slow = self.is_static().then_some(Unusual::TooSlow { quickest });
        let blocked = self.blocked_ports();
        let all = flow.into_iter().chain(closed).chain(blocked).chain(slow);
        all.collect()
    }

    /// Refuses signals in mA that look like a loop of 4-20 mA, whose null is not at zero.
    ///
    /// # Errors
    /// There is one.
    pub fn check_live_zeros(&self) -> Result<()> {
        self.channels()
            .filter(|(_, series)| series.unit == "mA")
            .try_for_each(|(channel, series)| self.check_live_zero(channel, series))
    }

    /// Refuses a command that goes far beyond its full scale: one of the two is in another unit.
    ///
    /// # Errors
    /// It does.
    pub fn check_reach(&self, full_scale: f64) -> Result<()> {
        let command = self.command();
        let beyond = |value: &f64| value.abs() > FARTHEST * full_scale;
        let Some(sample) = command.values.iter().position(beyond) else {
            return Ok(());
        };
        let unit = &command.unit;
        Err(Error::input(
            format!(
                "{}, column \"command [{unit}]\", sample {sample}",
                self.path
            ),
            format!(
                "is {0} {unit}, {1:.1} times the full scale of {full_scale} {unit}",
                command.values[sample],
                command.values[sample].abs() / full_scale
            ),
            format!(
                "give the command that opens the valve fully, in {unit}: --full-scale, or full_scale in the file of --model"
            ),
        ))
    }

    /// Refuses a spool that goes against a command in the same unit: the base model has them alike at rest.
    ///
    /// # Errors
    /// It does.
    pub fn check_spool_direction(&self) -> Result<()> {
        let same_unit = |spool: &&Series| spool.unit == self.command().unit;
        if self.get(Channel::Spool).filter(same_unit).is_some()
            && self.direction(Channel::Spool) == Direction::Against
        {
            let unit = &self.command().unit;
            return Err(Error::input(
                format!("{}, column \"spool [{unit}]\"", self.path),
                "falls where the command rises: one of the two is inverted",
                format!(
                    "say which: --map \"COLUMN=spool [{unit}] *-1\" or --map \"COLUMN=command [{unit}] *-1\", each with \
                     the name of its column"
                ),
            ));
        }
        Ok(())
    }

    fn check_live_zero(&self, channel: Channel, series: &Series) -> Result<()> {
        let values = &series.values;
        if !has_live_zero(values) {
            return Ok(());
        }
        let (low, high) = ends(values);
        let column = format!("{}, column \"{channel} [mA]\"", self.path);
        if let Some(row) = values.iter().position(|&value| value < BROKEN) {
            return Err(Error::input(
                format!("{column}, sample {row}"),
                format!(
                    "is {} mA in a signal of 4-20 mA: below {BROKEN} mA a wire is broken",
                    values[row]
                ),
                "cut the record where the signal is whole",
            ));
        }
        Err(Error::input(
            column,
            format!(
                "lies between {low} and {high} mA: is it a signal of 4-20 mA with its null at 12 mA?"
            ),
            format!(
                "say so with --map \"COLUMN={channel} {OF_LIVE_ZERO}\" and the name of the column; or, if it is the current \
                 through the valve itself, give --full-scale in mA"
            ),
        ))
    }
}

/// How a mapping takes 4 to 20 mA, with the null at 12 mA.
pub(super) const OF_LIVE_ZERO: &str = "[%] *12.5 -150";

/// Whether a signal in mA looks like a loop of 4-20 mA.
pub(super) fn has_live_zero(values: &[f64]) -> bool {
    let (low, high) = ends(values);
    let live = values.iter().filter(|value| LIVE.contains(value)).count();
    live as f64 >= NEARLY_ALL * values.len() as f64 && low >= 0.0 && high - low >= SWING
}

/// The smallest and the largest of `values`.
pub(crate) fn ends(values: &[f64]) -> (f64, f64) {
    let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
    let wider = |(low, high): (f64, f64), &value: &f64| (low.min(value), high.max(value));
    values.iter().fold((low, high), wider)
}

/// The first row, those in which the command turns, and the number of rows.
pub(crate) fn reversals(command: &[f64]) -> Vec<usize> {
    let (low, high) = ends(command);
    let turn = TURN * (high - low);
    let mut found = vec![0];
    // The row of the extreme so far, and whether the command has risen to it.
    let (mut extreme, mut rising) = (0, None);
    for (row, &value) in command.iter().enumerate() {
        let moved = value - command[extreme];
        let onwards = rising.is_some_and(|rising| (moved > 0.0) == rising) && moved != 0.0;
        if onwards {
            extreme = row;
        } else if moved.abs() > turn {
            if rising.is_some() {
                found.push(extreme);
            }
            (extreme, rising) = (row, Some(moved > 0.0));
        }
    }
    found.push(command.len());
    found
}

fn goes_both_ways(command: &[f64]) -> bool {
    let (low, high) = ends(command);
    (-low).min(high) > BOTH_WAYS * (-low).max(high)
}

fn has_no_sign(response: &Series) -> bool {
    let (low, high) = ends(&response.values);
    low > -BELOW_ZERO * high
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn record(
        unit: &str,
        rate: f64,
        command: impl Fn(f64) -> f64,
        response: impl Fn(f64) -> f64,
    ) -> Record {
        let time: Vec<f64> = (0..4000).map(|k| f64::from(k) / rate).collect();
        let of = |unit: &str, value: &dyn Fn(f64) -> f64| {
            Series::new(unit, time.iter().map(|&t| value(t)).collect())
        };
        let channels = [
            (Channel::Command, of(unit, &command)),
            (Channel::Spool, of(unit, &response)),
            (Channel::Flow, of("L/min", &response)),
        ];
        Record::new("bench", time.clone(), channels).unwrap()
    }

    /// From null up, down and back, once in `period`.
    fn triangle(time: f64, period: f64) -> f64 {
        let phase = (time / period).fract();
        4.0 * match phase {
            _ if phase < 0.25 => phase,
            _ if phase < 0.75 => 0.5 - phase,
            _ => phase - 1.0,
        }
    }

    proptest! {
        #[test]
        fn a_lag_does_not_hide_the_direction(hertz in 0.5..20.0f64, lag in 0.0..0.15f64, sign in prop::bool::ANY) {
            let sign = if sign { 1.0 } else { -1.0 };
            let wave = |t: f64| 3.0 * (TAU * hertz * t).sin();
            let found = record("V", 1000.0, wave, |t| sign * wave(t - lag / hertz) + 0.3).direction(Channel::Flow);
            prop_assert_eq!(found, if sign > 0.0 { Direction::With } else { Direction::Against });
        }
    }

    #[test]
    fn a_closed_loop_is_told_from_a_cylinder() {
        let wave = |t: f64| 3.0 * (TAU * 0.7 * t).sin() + (TAU * 2.0 * t).sin();
        let along = |t: f64| {
            -3.0 / (TAU * 0.7) * (TAU * 0.7 * t).cos() - 1.0 / (TAU * 2.0) * (TAU * 2.0 * t).cos()
        };
        let positioned = |position: &dyn Fn(f64) -> f64| {
            let time: Vec<f64> = (0..4000).map(|k| f64::from(k) / 1000.0).collect();
            let of = |unit, value: &dyn Fn(f64) -> f64| {
                Series::new(unit, time.iter().map(|&t| value(t)).collect())
            };
            let channels = [
                (Channel::Command, of("V", &wave)),
                (Channel::Position, of("mm", position)),
            ];
            Record::new("cylinder", time.clone(), channels)
                .unwrap()
                .is_position_loop()
        };
        assert!(positioned(&|t| 25.0 * wave(t - 0.02) + 100.0));
        assert!(positioned(&|t| -25.0 * wave(t - 0.02)));
        assert!(!positioned(&|t| 25.0 * along(t)));
        assert!(!positioned(&|t| -25.0 * along(t) + 3.0));
    }

    #[test]
    fn a_meter_without_a_sign_is_recognised() {
        let up = |t: f64| 8.0 * triangle(t, 4.0);
        assert_eq!(
            record("V", 1000.0, up, |t| 5.0 * up(t).abs()).direction(Channel::Flow),
            Direction::Unsigned
        );
        assert_eq!(
            record("V", 1000.0, up, |t| 5.0 * up(t)).direction(Channel::Flow),
            Direction::With
        );
        // One that is off, or noisy.
        for off in [-5.0, 5.0] {
            let record = record("V", 1000.0, up, |t| 5.0 * up(t).abs() + off);
            assert_eq!(
                record.direction(Channel::Flow),
                Direction::Unsigned,
                "{off}"
            );
        }
        let noisy = |t: f64| 5.0 * up(t).abs() + 0.7 * (TAU * 31.0 * t).sin();
        assert_eq!(
            record("V", 1000.0, up, noisy).direction(Channel::Flow),
            Direction::Unsigned
        );
        // A valve that is opened one way only has no negative flow.
        let one_way = |t: f64| up(t).abs();
        assert_eq!(
            record("V", 1000.0, one_way, |t| 5.0 * one_way(t)).direction(Channel::Flow),
            Direction::With
        );
        assert_eq!(
            record("V", 1000.0, up, |t| (TAU * 31.0 * t).sin()).direction(Channel::Flow),
            Direction::Unclear
        );
    }

    #[test]
    fn sweeps_of_twenty_seconds_are_static_and_chirps_are_not() {
        for period in [20.0, 100.0, 500.0] {
            for rate in [10.0, 100.0] {
                let sweep = record(
                    "mA",
                    rate,
                    |t| 10.0 * triangle(t, period),
                    |t| triangle(t, period),
                );
                assert!(
                    sweep.is_static(),
                    "{period} s at {rate} Hz: {}",
                    sweep.quickest_change()
                );
            }
        }
        let quick = record("V", 1000.0, |t| triangle(t, 4.0), |t| triangle(t, 4.0));
        assert!(!quick.is_static());
        assert!((quick.quickest_change() - 0.025).abs() < 1e-3);
        // From where it waits to where it begins, and back from end to end.
        let begins = |t: f64| {
            if t < 1.0 {
                0.0
            } else {
                triangle(t - 1.0 + 37.5, 50.0)
            }
        };
        assert!(record("mA", 50.0, begins, begins).is_static());
        let saw = |t: f64| (t / 40.0).fract();
        assert!(record("mA", 50.0, saw, saw).is_static());
        let late = |t: f64| f64::from(t > 20.0);
        assert!(!record("V", 100.0, late, late).is_static());
        let step = record("V", 1000.0, |t| f64::from(t > 2.0), |t| f64::from(t > 2.0));
        assert!(!step.is_static());
        assert!(record("V", 2.0, |t| f64::from(t > 900.0), |t| f64::from(t > 900.0)).is_static());
    }

    #[test]
    fn a_live_zero_and_a_broken_wire_are_refused_and_a_coil_current_is_not() {
        let error = |record: &Record| record.check_live_zeros().unwrap_err().to_string();
        let live = |t: f64| 12.0 + 8.0 * (TAU * t).sin();
        let text = error(&record("mA", 1000.0, live, live));
        assert!(text.contains("command [%] *12.5 -150"), "{text}");
        let text = error(&record(
            "mA",
            1000.0,
            |t| if t == 1.25 { 0.1 } else { live(t) },
            live,
        ));
        assert!(
            text.contains("sample 1250") && text.contains("broken"),
            "{text}"
        );
        let coil = |t: f64| 10.0 * (TAU * t).sin();
        assert!(record("mA", 1000.0, coil, coil).check_live_zeros().is_ok());
    }

    #[test]
    fn an_inverted_spool_is_refused() {
        let wave = |t: f64| (TAU * t * (1.0 + t)).sin();
        let text = record("V", 1000.0, wave, |t| -wave(t - 0.005))
            .check_spool_direction()
            .unwrap_err()
            .to_string();
        assert!(text.contains("spool [V] *-1"), "{text}");
        assert!(
            record("V", 1000.0, wave, |t| wave(t - 0.005))
                .check_spool_direction()
                .is_ok()
        );
    }
}
