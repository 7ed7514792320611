//! From a record to a series: which channels a structure needs, and in which units.

use crate::evaluate::problem::{Sample, Series};
use crate::model::{Input, Output, Outputs, Structure};
use crate::record::{Channel, Record, ends};
use crate::{Error, Result};

impl Series {
    /// The rows of `record` as `structure` needs them, each with weight 1; [`Series::set_steps`] comes next.
    ///
    /// # Errors
    /// A channel that the structure observes or is driven by is missing; command, spool or position are in another
    /// unit than the structure's.
    pub fn from_record(record: &Record, structure: &Structure) -> Result<Self> {
        let responses = record.responses();
        let blocked = record.has_blocked_ports();
        let wanted = |output: &&Output| output.is_of_blocked_ports() == blocked;
        let observed: Vec<&Output> = structure.observed.iter().filter(wanted).collect();
        let is_there = |output: &&Output| responses.contains(&output.channel());
        // Pressures and leakage at blocked ports are often two tests.
        let missing = match blocked && observed.iter().any(&is_there) {
            true => None,
            false => observed.iter().find(|output| !is_there(output)),
        };
        match missing {
            Some(output) => require(record, output.channel(), "the model observes it")?,
            None if observed.is_empty() => return Err(other_test(record)),
            None => {}
        }
        Self::to_simulate(record, structure)
    }

    /// [`Series::from_record`] for a simulation alone: what the structure observes need not be measured. Targets that
    /// are missing are zero, and an integrated position that is not measured starts at zero.
    ///
    /// # Errors
    /// As [`Series::from_record`], but for the observed channels.
    pub fn to_simulate(record: &Record, structure: &Structure) -> Result<Self> {
        check_units(record, structure)?;
        let answers = |channel: &&Channel| {
            structure.observes_blocked_ports()
                && record.has_blocked_ports()
                && **channel != Channel::SupplyPressure
        };
        for &channel in structure
            .driven_by()
            .iter()
            .filter(|channel| !answers(channel))
        {
            require(record, channel, "the model's flow follows from it")?;
        }
        let column = |channel| record.get(channel).map(|series| series.values.as_slice());
        let time = record.time();
        let responses = record.responses();
        let targets = Outputs::from_fn(|output| {
            let answers = structure.observes(output) && responses.contains(&output.channel());
            column(output.channel()).filter(|_| answers)
        });
        // What answers does not drive.
        let driving =
            |channel| match structure.observes_blocked_ports() && responses.contains(&channel) {
                true => None,
                false => column(channel),
            };
        let sample = |row: usize| {
            let at = |values: Option<&[f64]>| values.map_or(0.0, |values| values[row]);
            Sample {
                input: Input::from_channels(|channel| at(driving(channel)), time[row] - time[0]),
                target: Outputs(targets.0.map(at)),
                weight: 1.0,
                ..Sample::default()
            }
        };
        let mut samples: Vec<Sample> = (0..record.samples()).map(sample).collect();
        let resting = targets[Output::Position].and_then(|values| at_rest(record, values));
        if let Some(start) = resting.filter(|_| structure.integrates_position()) {
            samples[0].target[Output::Position] = start;
        }
        Ok(Self {
            name: record.name.clone(),
            time: record.time().to_vec(),
            measured: Outputs(targets.0.map(|target| target.is_some())),
            samples,
        })
    }
}

/// The command rests while it moves by less than this share of its range.
const STILL: f64 = 0.005;
/// Fewest rows that are better than the first alone.
const FEWEST: usize = 12;

/// Where `values` are in the first row, by all rows in which the command rests first: what an integral begins with it keeps, and one
/// reading is as far off as its noise. `None` where the command does not rest.
fn at_rest(record: &Record, values: &[f64]) -> Option<f64> {
    let command = &record.command().values;
    let (low, high) = ends(command);
    let rests = |value: &&f64| (**value - command[0]).abs() < STILL * (high - low);
    let rows = command.iter().take_while(rests).count();
    if rows < FEWEST {
        return None;
    }
    // A valve that is not quite shut moves it evenly.
    let time = &record.time()[..rows];
    let mean = |of: &[f64]| of.iter().sum::<f64>() / rows as f64;
    let (middle, level) = (mean(time), mean(&values[..rows]));
    let about = || time.iter().map(|time| time - middle);
    let moved: f64 = about().zip(values).map(|(time, value)| time * value).sum();
    let slope = moved / about().map(|time| time * time).sum::<f64>();
    Some(level + slope * (time[0] - middle))
}

/// Refuses a record without `channel`; `why` says what needs it.
fn require(record: &Record, channel: Channel, why: &str) -> Result<()> {
    if record.get(channel).is_some() {
        return Ok(());
    }
    Err(Error::input(
        &record.path,
        format!("has no {channel}, and {why}"),
        format!(
            "add the column, name it with --map \"COLUMN={channel} [UNIT]\", or change the model's [structure]"
        ),
    ))
}

/// That nothing of what the model observes can be measured in the test that `record` is of.
fn other_test(record: &Record) -> Error {
    let (own, other) = match record.has_blocked_ports() {
        true => ("blocked", "open"),
        false => ("open", "blocked"),
    };
    Error::input(
        &record.path,
        format!("is of a test with {own} ports, and the model observes what {other} ports show"),
        "fit records of both tests, or change the model's [structure]",
    )
}

fn check_units(record: &Record, structure: &Structure) -> Result<()> {
    let check = |channel: Channel, expected: &str| match record.get(channel) {
        Some(series) if series.unit != expected => Err(Error::input(
            format!("{}, column \"{channel} [{}]\"", record.path, series.unit),
            format!("the model has the {channel} in {expected}"),
            format!(
                "convert the column to {expected}, or change the unit in the model's [structure]"
            ),
        )),
        _ => Ok(()),
    };
    check(Channel::Command, &structure.command_unit)?;
    for &output in &structure.observed {
        check(output.channel(), structure.unit(output))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::valve::{Drop, ValveForm};
    use crate::model::{Output, Piston, ServoValve};
    use crate::record;

    fn record(channels: &[(Channel, &str, f64)]) -> Record {
        let series = |&(channel, unit, last): &(Channel, &str, f64)| {
            (channel, record::Series::new(unit, vec![0.0, last]))
        };
        Record::new("run", vec![0.0, 0.5], channels.iter().map(series)).unwrap()
    }

    #[test]
    fn a_row_has_the_inputs_and_the_observed_targets_in_their_places() {
        let structure = Structure {
            observed: vec![Output::Spool, Output::Flow],
            base: ServoValve::with(ValveForm::linear()).into(),
            ..Structure::actuator(10.0, "V")
        };
        let record = record(&[
            (Channel::Command, "V", 1.0),
            (Channel::Spool, "V", 2.0),
            (Channel::Flow, "L/min", 3.0),
            (Channel::Position, "mm", 4.0),
            (Channel::SupplyPressure, "bar", 5.0),
            (Channel::PressureA, "bar", 6.0),
            (Channel::PressureB, "bar", 7.0),
        ]);
        let series = Series::from_record(&record, &structure).unwrap();
        assert_eq!(series.time, [0.0, 0.5]);
        let numbers = series.samples[1].input.numbers();
        assert_eq!(numbers, [1.0, 5.0, 0.0, 6.0, 7.0, 0.0, 0.5]);
        let target = &series.samples[1].target;
        assert_eq!((target[Output::Spool], target[Output::Flow]), (2.0, 3.0));
        assert_eq!(target[Output::Position], 0.0);
        assert!(series.samples.iter().all(|sample| sample.weight == 1.0));
    }

    #[test]
    fn an_integrated_position_begins_where_the_rest_before_the_first_motion_has_it() {
        let noise = |row: usize| f64::from((row * 7919 % 101) as u32) / 100.0 - 0.5;
        let begins = |resting: usize| {
            let time: Vec<f64> = (0..200).map(|row| 0.01 * row as f64).collect();
            let command = (0..200).map(|row| f64::from(u8::from(row >= resting)));
            let position = (0..200).map(|row| 50.0 + 0.02 * row as f64 + noise(row));
            let channels = [
                (
                    Channel::Command,
                    record::Series::new("V", command.collect()),
                ),
                (
                    Channel::Position,
                    record::Series::new("mm", position.collect()),
                ),
            ];
            let record = Record::new("cylinder", time, channels).unwrap();
            let structure = Structure {
                observed: vec![Output::Position],
                base: ServoValve {
                    piston: Piston::Integrated,
                    ..ServoValve::with(ValveForm::linear())
                }
                .into(),
                ..Structure::actuator(1.0, "V")
            };
            let series = Series::from_record(&record, &structure).unwrap();
            series.samples[0].target[Output::Position] - 50.0
        };
        assert!(begins(100).abs() < 0.1, "{}", begins(100));
        assert_eq!(begins(1), noise(0));
    }

    #[test]
    fn what_is_missing_or_in_another_unit_is_named() {
        let ports = ValveForm {
            drop: Drop::Ports,
            ..ValveForm::linear()
        };
        let flow = Structure {
            observed: vec![Output::Flow],
            base: ServoValve::with(ports).into(),
            ..Structure::actuator(10.0, "V")
        };
        let command = (Channel::Command, "V", 1.0);
        let supply = (Channel::SupplyPressure, "bar", 70.0);
        let measured = (Channel::Flow, "L/min", 1.0);
        let spool = Structure::actuator(10.0, "V");
        for (channels, structure, parts) in [
            (vec![command, supply], &flow, ["has no flow", "observes it"]),
            (
                vec![command, measured, supply],
                &flow,
                ["has no pressure_a", "--map"],
            ),
            (
                vec![(Channel::Command, "mA", 1.0), (Channel::Spool, "V", 1.0)],
                &spool,
                ["command [mA]", "in V"],
            ),
            (
                vec![command, (Channel::Spool, "%", 1.0)],
                &spool,
                ["spool [%]", "in V"],
            ),
        ] {
            let error = Series::from_record(&record(&channels), structure).unwrap_err();
            let text = error.to_string();
            assert!(parts.iter().all(|part| text.contains(part)), "{text}");
            assert_eq!(error.exit_code(), 2);
        }
        let alone = record(&[command]);
        assert!(Series::from_record(&alone, &spool).is_err());
        assert!(Series::to_simulate(&alone, &spool).is_ok());
    }
}
