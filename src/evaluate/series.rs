//! From a record to a series: which channels a structure needs, and in which units.

use super::problem::{Sample, Series};
use crate::model::valve::Drop;
use crate::model::{Output, Piston, Structure};
use crate::record::{Channel, Record};
use crate::{Error, Result};

impl From<Output> for Channel {
    fn from(output: Output) -> Self {
        match output {
            Output::Spool => Self::Spool,
            Output::Flow => Self::Flow,
            Output::Position => Self::Position,
        }
    }
}

impl Series {
    /// The rows of `record` as `structure` needs them, each with weight 1; [`Series::set_steps`] comes next.
    ///
    /// # Errors
    /// A channel that the structure observes or is driven by is missing; command, spool or position are in another
    /// unit than the structure's.
    pub fn from_record(record: &Record, structure: &Structure) -> Result<Self> {
        for &output in &structure.observed {
            require(record, output.into(), "the model observes it")?;
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
        if let Some(valve) = &structure.valve {
            let needed: &[Channel] = match valve.drop {
                Drop::Rated => &[],
                Drop::Supply => &[Channel::SupplyPressure],
                Drop::Ports => &[
                    Channel::SupplyPressure,
                    Channel::PressureA,
                    Channel::PressureB,
                ],
            };
            for &channel in needed {
                require(record, channel, "the model's flow follows from it")?;
            }
        }
        let column = |channel| record.get(channel).map(|series| series.values.as_slice());
        let inputs = [
            Channel::Command,
            Channel::SupplyPressure,
            Channel::ReturnPressure,
            Channel::PressureA,
            Channel::PressureB,
            Channel::Temperature,
        ]
        .map(column);
        let time = record.time();
        let targets =
            Output::ALL.map(|output| column(output.into()).filter(|_| structure.observes(output)));
        let sample = |row: usize| {
            let [command, supply, tank, a, b, temperature] =
                inputs.map(|values| values.map_or(0.0, |values| values[row]));
            let since = time[row] - time[0];
            Sample {
                input: [command, supply, tank, a, b, temperature, since],
                target: targets.map(|values| values.map_or(0.0, |values| values[row])),
                weight: 1.0,
                ..Sample::default()
            }
        };
        Ok(Self {
            name: record.name.clone(),
            time: record.time().to_vec(),
            samples: (0..record.samples()).map(sample).collect(),
        })
    }
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
        check(output.into(), structure.unit(output))?;
    }
    if structure.observes(Output::Position) && structure.piston == Piston::Servo {
        check(Channel::Position, &structure.command_unit)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::valve::ValveForm;
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
            valve: Some(ValveForm::linear()),
            observed: vec![Output::Spool, Output::Flow],
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
        assert_eq!(series.samples[1].input, [1.0, 5.0, 0.0, 6.0, 7.0, 0.0, 0.5]);
        assert_eq!(series.samples[1].target, [2.0, 3.0, 0.0]);
        assert!(series.samples.iter().all(|sample| sample.weight == 1.0));
    }

    #[test]
    fn what_is_missing_or_in_another_unit_is_named() {
        let ports = ValveForm {
            drop: Drop::Ports,
            ..ValveForm::linear()
        };
        let flow = Structure {
            observed: vec![Output::Flow],
            valve: Some(ports),
            ..Structure::actuator(10.0, "V")
        };
        let command = (Channel::Command, "V", 1.0);
        let supply = (Channel::SupplyPressure, "bar", 70.0);
        let measured = (Channel::Flow, "L/min", 1.0);
        let spool = Structure::actuator(10.0, "V");
        let servo = Structure {
            observed: vec![Output::Position],
            piston: Piston::Servo,
            ..spool.clone()
        };
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
            (
                vec![command, (Channel::Position, "mm", 1.0)],
                &servo,
                ["position [mm]", "in V"],
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
