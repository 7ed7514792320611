//! The base model that a record asks for: its structure, and bounds for its parameters that follow from the data.

use super::blocked;
use super::bounds::{around, bound};
use super::{
    Drive, GAIN, PISTON_AREA, PISTON_SPEED, POSITION_GAIN, POSITION_ZERO, Piston, Polarity,
    SPOOL_GAIN, ServoValve, TIME_CONSTANT,
};
use crate::model::base::BaseModel;
use crate::model::effects::Scale;
use crate::model::valve::{
    self, AreaLaw, DENSITY, DISCHARGE_COEFFICIENT, Drop, MAX_AREA, Meter, RATED_DROP, ValveForm,
};
use crate::model::{Hold, Output, Outputs, Parameter, Structure};
use crate::record::{Channel, Direction, Record, Series, Unusual, full_scale};
use crate::{Error, Result};

/// No servo valve is faster: time constants (s) are not sought below it, gains (1/s) not above its inverse.
const FASTEST: f64 = 5e-5;

/// The base structure for `records` that are to be identified together.
///
/// - Full scale: 10 for V, 100 for %, otherwise the largest |command| of all records.
/// - Observed: the responses that every record has.
/// - Position alone, with a command in mm or one that it follows: a position loop, see [`Record::is_position_loop`].
///   Otherwise position integrates flow.
/// - A flow that falls where the command rises: negative polarity. A flow that shows no sign is measured in the pressure
///   line.
/// - Records that are too slow to show what moves the spool: it follows the command at once. See [`Record::is_static`].
/// - Records of tests with blocked ports: what they measure, beside what the others do, of a valve with four edges. See
///   [`Record::has_blocked_ports`].
/// - A position that moves against the command belongs to a cylinder that is connected the other way round.
/// - A spool in another unit than the command's has a gain.
/// - Flow or an integrated position asks for a valve with linear area, whose drop follows from the pressures that every
///   record has: all ports, the supply alone, or none.
///
/// # Errors
/// No response that every record has; a spool that goes against a command in the same unit; units of command or spool that differ between records; a full scale of zero.
pub fn structure_for(records: &[Record]) -> Result<Structure> {
    let Some((first, rest)) = records.split_first() else {
        return Err(Error::input(
            "records",
            "there are none",
            "give one or more",
        ));
    };
    for record in records {
        record.check_response()?;
        record.check_spool_direction()?;
    }
    blocked::check_supply(records)?;
    let all_have = |channel: Channel| records.iter().all(|record| record.get(channel).is_some());
    let open = || records.iter().filter(|record| !record.has_blocked_ports());
    let one_test = open().next().is_none();
    let blocked_ports = blocked::observed(records);
    let shared = |output: &Output| {
        let has = |record: &Record| record.get(output.channel()).is_some();
        !output.is_of_blocked_ports()
            && if one_test {
                records.iter().all(has)
            } else {
                open().all(has)
            }
    };
    let mut observed: Vec<Output> = Output::ALL.into_iter().filter(shared).collect();
    let without_open = !one_test && observed.is_empty();
    observed.extend(&blocked_ports);
    observed.sort();
    if without_open {
        let last = open().next_back().unwrap_or(first);
        let names = Output::ALL.into_iter();
        let names = names.filter(|output| !output.is_of_blocked_ports());
        let names: Vec<&str> = names.map(Output::name).collect();
        return Err(Error::input(
            &last.path,
            format!("shares neither {} with {}", names.join(" nor "), first.path),
            "identify records together only where they measure the same",
        ));
    }
    let unit = |channel| one_unit(first, rest, channel);
    let command_unit = unit(Channel::Command)?;
    let spool_unit = match observed.contains(&Output::Spool) {
        true => Some(unit(Channel::Spool)?).filter(|&unit| unit != command_unit),
        false => None,
    };
    let full_scale = full_scale(command_unit, largest(records, Channel::Command));
    if full_scale == 0.0 {
        return Err(Error::input(
            format!("{}, column \"command [{command_unit}]\"", first.path),
            "is 0 throughout, so there is no full scale",
            "give a record whose command moves",
        ));
    }
    let closed = command_unit == "mm" || records.iter().all(Record::is_position_loop);
    let piston = match closed && observed == [Output::Position] {
        true => Piston::Servo,
        false => Piston::Integrated,
    };
    let ports = [Channel::PressureA, Channel::PressureB];
    let has_ports = |record: &Record| ports.iter().all(|&port| record.get(port).is_some());
    let drop = match all_have(Channel::SupplyPressure) {
        true if !one_test && open().all(has_ports) => Drop::Ports,
        true => Drop::Supply,
        false => Drop::Rated,
    };
    let flow = records.iter().map(|record| record.direction(Channel::Flow));
    let directions: Vec<Direction> = flow.collect();
    let flows = |direction| directions.contains(&direction);
    let ways: Vec<Direction> = match flows(Direction::With) || flows(Direction::Against) {
        true => directions.clone(),
        false => records.iter().map(blocked::direction).collect(),
    };
    let goes = |direction| ways.contains(&direction);
    let polarity = match goes(Direction::Against) && !goes(Direction::With) {
        true => Polarity::Negative,
        false => Polarity::Positive,
    };
    let along = records.iter().map(along).sum::<f64>();
    let drive = match piston == Piston::Integrated && records.iter().all(Record::is_static) {
        true => Drive::Direct,
        false => Drive::Actuator,
    };
    let mut base = ServoValve {
        drive,
        spool_unit: spool_unit.map(String::from),
        piston,
        polarity,
        reversed: piston == Piston::Integrated && polarity.sign() * along < 0.0,
        ..ServoValve::default()
    };
    let has_flow = observed.iter().any(|&output| base.follows_flow(output));
    if has_flow || !blocked_ports.is_empty() {
        base.valve = Some(ValveForm {
            area: match blocked_ports.is_empty() {
                true => AreaLaw::Proportional,
                false => AreaLaw::Edges,
            },
            drop,
            meter: match flows(Direction::Unsigned) && !flows(Direction::Against) {
                true => Meter::Supply,
                false => Meter::Load,
            },
            ..ValveForm::linear()
        });
    }
    Ok(Structure {
        // A generator draws the sweep in finer steps than the logger's rows.
        hold: match drive {
            Drive::Direct => Hold::Interpolated,
            Drive::Actuator => Hold::Held,
        },
        observed,
        base: base.into(),
        ..Structure::actuator(full_scale, command_unit)
    })
}

/// What `structure` takes the bench of `records` to be, where that is not what most are: an engineer checks it first.
pub fn remarks(structure: &Structure, records: &[Record]) -> Vec<String> {
    let Some(base) = structure.servo_valve() else {
        return Vec::new();
    };
    let quickest = records.iter().map(Record::quickest_change);
    let quickest = quickest.fold(0.0, f64::max);
    let slow = base.drive == Drive::Direct && records.iter().all(Record::is_static);
    let closed = base.piston == Piston::Servo && structure.command_unit != "mm";
    let meter = base.valve.as_ref().map(|valve| valve.meter);
    let all = [
        (slow, Unusual::TooSlow { quickest }),
        (
            base.polarity == Polarity::Negative,
            Unusual::NegativePolarity,
        ),
        (closed, Unusual::ClosedLoop),
        (meter == Some(Meter::Supply), Unusual::NoSign),
    ];
    let own = all.into_iter().filter(|(is, _)| *is);
    let own = own.map(|(_, unusual)| unusual.to_string());
    own.chain(blocked::remarks(structure, records)).collect()
}

/// The unit that a channel has in all records.
fn one_unit<'a>(first: &'a Record, rest: &[Record], channel: Channel) -> Result<&'a str> {
    let unit = |record: &'a Record| record.get(channel).map_or("", |series| &series.unit);
    let expected = unit(first);
    match rest
        .iter()
        .find(|record| record.get(channel).is_some_and(|s| s.unit != expected))
    {
        None => Ok(expected),
        Some(other) => Err(Error::input(
            format!("{}, {channel}", other.path),
            format!("is not in {expected} as in {}", first.path),
            "convert one of the two, or identify the records apart",
        )),
    }
}

/// The parameters of `structure`, with bounds and start values that follow from `records`.
///
/// - Time constant and gain: from a quarter of the sampling interval to the length of the record.
/// - Spool gain: a factor of 100 around the ratio of the ranges. Where the spool moves against the command the gain may
///   have either sign, on a linear scale.
/// - Areas: around the area that passes the largest flow at the drop there is. Where position is measured without flow,
///   only the ratio of valve to piston area can be told: the piston's is then fixed at its generic start value, and a
///   model file sets the true one.
///
/// A parameter about which the records say nothing keeps its generic bounds.
pub fn parameters_for(structure: &Structure, records: &[Record]) -> Vec<Parameter> {
    let mut parameters = structure.parameters_at(&scale_of(structure, records));
    let start = |name: &str| {
        parameters
            .iter()
            .find(|p| p.name == name)
            .map(|p| p.nominal())
    };
    let fastest = (sampling_interval(records) / 4.0).max(FASTEST);
    let slowest = records.iter().map(length).fold(10.0 * fastest, f64::max);
    let speed = records.iter().map(largest_speed).fold(0.0, f64::max);
    let measured = structure
        .observes(Output::Flow)
        .then(|| largest(records, Channel::Flow));
    // Without flow: what moves a piston of the nominal area as fast as the measured one.
    let flow = measured.unwrap_or_else(|| start(PISTON_AREA).unwrap_or(0.0) * speed / PISTON_SPEED);
    let opening = (largest(records, Channel::Command) / structure.full_scale).min(1.0);
    let velocity = (2.0 / start(DENSITY).unwrap_or(1.0)
        * 1e5
        * land_drop(structure, records, start(RATED_DROP)))
    .sqrt();
    // L/min through 1 cm² at full opening.
    let unit_flow = start(DISCHARGE_COEFFICIENT).unwrap_or(1.0) * 1e-4 * velocity * 6e4;
    let area = flow / unit_flow / opening;
    let ratio = swing(records, Channel::Spool) / swing(records, Channel::Command);
    let against = records.iter().map(covariance).sum::<f64>() < 0.0;
    let travel = swing(records, Channel::Position) / swing(records, Channel::Command);
    let mean = |channel| mean(series(records, channel).flat_map(|one| &one.values));
    let falls = records
        .iter()
        .any(|record| record.direction(Channel::Position) == Direction::Against);
    let travel = if falls { -travel } else { travel };
    let zero = mean(Channel::Position) - travel * mean(Channel::Command);

    for parameter in &mut parameters {
        match parameter.name.as_str() {
            TIME_CONSTANT => bound(parameter, fastest, slowest),
            GAIN => bound(parameter, 1.0 / slowest, 1.0 / fastest),
            SPOOL_GAIN if against => {
                let range = 10.0 * ratio;
                *parameter = Parameter::linear(SPOOL_GAIN, &parameter.unit, -range, -ratio, range);
            }
            SPOOL_GAIN => around(parameter, ratio),
            POSITION_GAIN => {
                let range = 10.0 * travel.abs();
                *parameter =
                    Parameter::linear(POSITION_GAIN, &parameter.unit, -range, travel, range);
            }
            POSITION_ZERO => {
                let range = zero.abs() + 10.0 * swing(records, Channel::Position);
                *parameter = Parameter::linear(POSITION_ZERO, "mm", -range, zero, range);
            }
            MAX_AREA => around(parameter, area),
            PISTON_AREA if measured.is_some() => around(parameter, flow * PISTON_SPEED / speed),
            PISTON_AREA => parameter.set_fixed(true),
            _ => {}
        }
    }
    let law = structure.valve().map(|valve| &valve.area);
    if law == Some(&AreaLaw::Edges) {
        blocked::bound(structure, &mut parameters, records, unit_flow);
    }
    if let Some(AreaLaw::Table(openings) | AreaLaw::Signed(openings)) = law
        && area.is_normal()
    {
        let least = if matches!(law, Some(AreaLaw::Signed(_))) {
            -1.0
        } else {
            0.0
        };
        for (number, opening) in openings.iter().enumerate() {
            let name = valve::area_name(number);
            let parameter = parameters.iter_mut().find(|p| p.name == name);
            let parameter = parameter.expect("an area at each opening");
            (parameter.low, parameter.high) = (least * 3.0 * area, 3.0 * area);
            parameter.set_nominal(area * (opening / 100.0).clamp(least, 1.0));
        }
    }
    parameters
}

/// How large things are in `records`.
pub fn scale_of(structure: &Structure, records: &[Record]) -> Scale {
    let output = |output: Output| {
        let largest = largest(records, output.channel());
        if largest > 0.0 { largest } else { 1.0 }
    };
    let mut rated = structure
        .valve()
        .into_iter()
        .flat_map(ValveForm::parameters)
        .filter(|p| p.name == RATED_DROP)
        .map(|p| p.nominal());
    let pressure = |channel| mean(series(records, channel).flat_map(|one| &one.values));
    let measured = pressure(Channel::SupplyPressure) - pressure(Channel::ReturnPressure);
    let has_pressure = structure
        .valve()
        .is_some_and(|valve| valve.drop != Drop::Rated);
    Scale {
        command: structure.full_scale,
        command_unit: structure.command_unit.clone(),
        outputs: Outputs::from_fn(output),
        units: Outputs::from_fn(|output| structure.unit(output).to_owned()),
        interval: sampling_interval(records),
        length: records.iter().map(length).fold(0.0, f64::max),
        temperature: series(records, Channel::Temperature).next().is_some(),
        pressure: has_pressure,
        rated_drop: match has_pressure && measured > 0.0 {
            true => measured,
            false => rated.next().unwrap_or(10.0),
        },
        speed: 20.0 * structure.full_scale,
        lines: Outputs::default(),
    }
}

fn mean<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

fn length(record: &Record) -> f64 {
    let time = record.time();
    time[time.len() - 1] - time[0]
}

/// The smallest of the records' median intervals between samples, s.
fn sampling_interval(records: &[Record]) -> f64 {
    let interval = |record: &Record| median(record.time().windows(2).map(|pair| pair[1] - pair[0]));
    records.iter().map(interval).fold(f64::INFINITY, f64::min)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn series(records: &[Record], channel: Channel) -> impl Iterator<Item = &Series> {
    records.iter().filter_map(move |record| record.get(channel))
}

/// The largest magnitude of a channel; 0 where no record has it.
fn largest(records: &[Record], channel: Channel) -> f64 {
    series(records, channel)
        .map(Series::max_abs)
        .fold(0.0, f64::max)
}

/// The largest difference between two values of a channel in one record; 0 where no record has it.
fn swing(records: &[Record], channel: Channel) -> f64 {
    let swing = |series: &Series| {
        let extreme =
            |pick: fn(f64, f64) -> f64| series.values.iter().copied().fold(f64::NAN, pick);
        extreme(f64::max) - extreme(f64::min)
    };
    series(records, channel).map(swing).fold(0.0, f64::max)
}

/// Covariance of command and spool times the number of samples; 0 without a spool.
fn covariance(record: &Record) -> f64 {
    let Some(spool) = record.get(Channel::Spool) else {
        return 0.0;
    };
    let pairs = || record.command().values.iter().zip(&spool.values);
    let mean = pairs().map(|(command, _)| command).sum::<f64>() / record.samples() as f64;
    pairs()
        .map(|(command, spool)| (command - mean) * spool)
        .sum()
}

/// How the piston moves along the command: the sum of the command times the change of position; 0 without a position.
fn along(record: &Record) -> f64 {
    let Some(position) = record.get(Channel::Position) else {
        return 0.0;
    };
    let changes = position.values.windows(2).map(|pair| pair[1] - pair[0]);
    let commands = &record.command().values;
    let mean = commands.iter().sum::<f64>() / commands.len() as f64;
    commands
        .iter()
        .zip(changes)
        .map(|(command, change)| (command - mean) * change)
        .sum()
}

/// The largest speed of the piston, mm/s, over hundredths of the record, so that noise does not count as motion; 0
/// without a position.
fn largest_speed(record: &Record) -> f64 {
    let Some(position) = record.get(Channel::Position) else {
        return 0.0;
    };
    let stride = (record.samples() / 100).max(1);
    (stride..record.samples())
        .map(|k| {
            let change = position.values[k] - position.values[k - stride];
            (change / (record.time()[k] - record.time()[k - stride])).abs()
        })
        .fold(0.0, f64::max)
}

/// The pressure drop over one land, bar: half of what the load leaves of the drop from P to T, in the median.
fn land_drop(structure: &Structure, records: &[Record], rated: Option<f64>) -> f64 {
    let drops = |record: &Record| {
        let at = |channel, row: usize| record.get(channel).map_or(0.0, |s| s.values[row]);
        let drop = |row| {
            let load = match record.has_blocked_ports() {
                true => 0.0,
                false => at(Channel::PressureA, row) - at(Channel::PressureB, row),
            };
            at(Channel::SupplyPressure, row) - at(Channel::ReturnPressure, row) - load.abs()
        };
        (0..record.samples()).map(drop).collect::<Vec<f64>>()
    };
    let drop = match (rated, structure.valve()) {
        (Some(rated), _) => rated,
        (None, Some(_)) => {
            let through = |record: &&Record| !record.has_blocked_ports();
            let one_test = !records.iter().any(|record| through(&record));
            let used = records.iter().filter(|record| one_test || through(record));
            median(used.flat_map(drops))
        }
        (None, None) => 0.0,
    };
    (drop / 2.0).max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// 2 s at 1 kHz: every channel swings with its amplitude, position lags a quarter of a period.
    fn record(channels: &[(Channel, &str, f64)]) -> Record {
        let time: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
        let series = |&(channel, unit, amplitude): &(Channel, &str, f64)| {
            let value = |t: &f64| match channel {
                Channel::Position => -amplitude * (TAU * t).cos(),
                Channel::SupplyPressure => amplitude,
                _ => amplitude * (TAU * t).sin(),
            };
            (channel, Series::new(unit, time.iter().map(value).collect()))
        };
        Record::new("run", time.clone(), channels.iter().map(series)).unwrap()
    }

    fn named<'a>(parameters: &'a [Parameter], name: &str) -> &'a Parameter {
        parameters.iter().find(|p| p.name == name).unwrap()
    }

    #[test]
    fn the_channels_and_units_decide_the_structure() {
        use Channel::*;
        let of = |channels: &[_]| structure_for(&[record(channels)]).unwrap();
        let volts = (Command, "V", 3.0);
        assert_eq!(
            of(&[volts, (Spool, "V", 3.0)]),
            Structure::actuator(10.0, "V")
        );
        assert_eq!(
            of(&[(Command, "mA", 3.0), (Spool, "mA", 3.0)]).full_scale,
            3.0
        );
        assert_eq!(
            of(&[volts, (Spool, "%", 30.0)])
                .servo_valve()
                .and_then(|base| base.spool_unit.as_deref()),
            Some("%")
        );
        let servo = of(&[(Command, "mm", 3.0), (Position, "mm", 3.0)]);
        let servo = servo.servo_valve().unwrap();
        assert_eq!((servo.piston, &servo.valve), (Piston::Servo, &None));
        let drop = |channels: &[_]| of(channels).valve().unwrap().drop;
        let flow = (Flow, "L/min", 60.0);
        assert_eq!(drop(&[volts, (Position, "mm", 3.0)]), Drop::Rated);
        let supply = (SupplyPressure, "bar", 70.0);
        assert_eq!(drop(&[volts, flow, supply]), Drop::Supply);
        let ports = [(PressureA, "bar", 1.0), (PressureB, "bar", 1.0)];
        assert_eq!(drop(&[volts, flow, ports[0], ports[1]]), Drop::Rated);
        assert_eq!(
            drop(&[volts, flow, supply, ports[0], ports[1]]),
            Drop::Ports
        );
    }

    #[test]
    fn records_that_do_not_belong_together_are_refused() {
        use Channel::*;
        let volts = (Command, "V", 3.0);
        let spool = record(&[volts, (Spool, "V", 3.0)]);
        for (other, part) in [
            (record(&[volts, (Flow, "L/min", 3.0)]), "shares neither"),
            (
                record(&[(Command, "mA", 3.0), (Spool, "V", 3.0)]),
                "not in V",
            ),
            (record(&[volts, (Spool, "%", 3.0)]), "not in V"),
            (record(&[volts]), "has no column"),
        ] {
            let error = structure_for(&[spool.clone(), other])
                .unwrap_err()
                .to_string();
            assert!(error.contains(part), "{error}");
        }
        let still = record(&[(Command, "mm", 0.0), (Position, "mm", 3.0)]);
        assert!(
            structure_for(&[still])
                .unwrap_err()
                .to_string()
                .contains("full scale")
        );
    }

    #[test]
    fn the_data_bound_the_parameters() {
        use Channel::*;
        let records = [record(&[
            (Command, "V", 10.0),
            (Spool, "%", 50.0),
            (Flow, "L/min", 60.0),
            (Position, "mm", 25.0),
            (SupplyPressure, "bar", 10.0),
        ])];
        let structure = structure_for(&records).unwrap();
        let parameters = parameters_for(&structure, &records);
        for p in &parameters {
            assert!(
                p.low < p.high && p.clamp(p.nominal()) == p.nominal(),
                "{p:?}"
            );
        }
        let start = |name| named(&parameters, name).nominal();
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 0.01;
        assert!(near(named(&parameters, "time_constant").low, 2.5e-4));
        assert!(near(start("spool_gain"), 5.0));
        assert!(near(
            start("max_area"),
            60.0 / (0.7 * 1e-4 * (2.0 / 850.0 * 5e5f64).sqrt() * 6e4)
        ));
        // 60 L/min = 1e6 mm³/s at 25 · 2π mm/s.
        assert!(near(start(PISTON_AREA), 1e6 / (25.0 * TAU) / 100.0));
    }

    #[test]
    fn a_table_starts_as_a_line_through_the_largest_flow() {
        use Channel::*;
        let records = [record(&[(Command, "V", 10.0), (Flow, "L/min", 60.0)])];
        let mut structure = structure_for(&records).unwrap();
        let area = named(&parameters_for(&structure, &records), "max_area").nominal();
        structure.base = ServoValve::with(ValveForm::table(&[0.0, 20.0, 50.0, 100.0])).into();
        let parameters = parameters_for(&structure, &records);
        assert_eq!(named(&parameters, "area_1").nominal(), 0.0);
        assert_eq!(named(&parameters, "area_3").nominal(), 0.5 * area);
        assert_eq!(named(&parameters, "area_4").high, 3.0 * area);
    }

    #[test]
    fn a_piston_without_flow_keeps_its_nominal_area_and_the_valve_follows() {
        use Channel::*;
        let records = [record(&[(Command, "V", 10.0), (Position, "mm", 25.0)])];
        let structure = structure_for(&records).unwrap();
        let parameters = parameters_for(&structure, &records);
        let piston = named(&parameters, "piston_area");
        assert!(piston.is_fixed());
        let flow = piston.nominal() * 25.0 * TAU / PISTON_SPEED;
        let unit_flow = 0.7 * 1e-4 * (2.0 / 850.0 * 5e5f64).sqrt() * 6e4;
        let area = named(&parameters, "max_area");
        assert!(!area.is_fixed() && (area.nominal() / (flow / unit_flow) - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_spool_that_moves_against_the_command_may_have_a_negative_gain() {
        use Channel::*;
        let records = [record(&[(Command, "V", 10.0), (Spool, "%", -50.0)])];
        let structure = structure_for(&records).unwrap();
        let parameters = parameters_for(&structure, &records);
        let gain = named(&parameters, "spool_gain");
        assert!((gain.nominal() + 5.0).abs() < 0.05 && gain.low < 0.0 && gain.high > 0.0);
    }
}
