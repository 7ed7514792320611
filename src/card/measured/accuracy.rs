//! What the sensors' accuracy does to the figures.

use crate::card::construction::CycleFigures;
use crate::card::cycle::Cycle;
use crate::record::Channel;
use crate::{Error, Result};
use std::str::FromStr;

/// What an accuracy can be given for, and the channels that it is of.
const SENSORS: [(&str, &[Channel]); 8] = [
    ("command", &[Channel::Command]),
    ("spool", &[Channel::Spool]),
    ("flow", &[Channel::Flow]),
    ("pressure", &PRESSURES),
    ("supply_pressure", &[Channel::SupplyPressure]),
    ("return_pressure", &[Channel::ReturnPressure]),
    ("pressure_a", &[Channel::PressureA]),
    ("pressure_b", &[Channel::PressureB]),
];
/// The pressures that drive a flow.
pub(super) const PRESSURES: [Channel; 4] = [
    Channel::SupplyPressure,
    Channel::ReturnPressure,
    Channel::PressureA,
    Channel::PressureB,
];

/// The accuracy of sensors, such as `flow=0.5 %, pressure=0.2 %`: how far each may be off with a chance of 95 %, in % of the
/// largest value of its curve; of the command in % of full scale.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Accuracy(Vec<(Channel, f64)>);

impl Accuracy {
    /// Whether none was given.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Of a channel, as a share; zero where none was given.
    pub(super) fn of(&self, channel: Channel) -> f64 {
        let last = self.0.iter().rev().find(|(own, _)| *own == channel);
        last.map_or(0.0, |(_, share)| *share)
    }
}

impl FromStr for Accuracy {
    type Err = Error;

    /// # Errors
    /// A part that is not `NAME=NUMBER %`, a name that has no part in the figures, a number that is not between 0 and 100.
    fn from_str(text: &str) -> Result<Self> {
        let refuse = |problem: String| {
            let names = SENSORS.map(|(name, _)| name).join(", ");
            let remedy = format!("write \"flow=0.5 %, pressure=0.2 %\"; there are {names}");
            Error::input(format!("accuracy {text:?}"), problem, remedy)
        };
        let mut all = Vec::new();
        for part in text.split([',', ';']).map(str::trim) {
            let (name, value) = part
                .split_once('=')
                .ok_or_else(|| refuse(format!("{part:?} has no \"=\"")))?;
            let (_, channels) = SENSORS
                .into_iter()
                .find(|(own, _)| *own == name.trim())
                .ok_or_else(|| refuse(format!("{:?} has no part in the figures", name.trim())))?;
            let number = value.trim().strip_suffix('%').map(str::trim_end);
            let percent = number
                .and_then(|number| number.parse().ok())
                .filter(|percent: &f64| *percent > 0.0 && *percent < 100.0)
                .ok_or_else(|| {
                    refuse(format!(
                        "{:?} is no number of % above 0, below 100",
                        value.trim()
                    ))
                })?;
            all.extend(channels.iter().map(|&channel| (channel, 0.01 * percent)));
        }
        Ok(Self(all))
    }
}

/// How far the sensors of a slow cycle may be off.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sensors {
    /// Of the output, as a share of its largest value.
    pub(super) output: f64,
    /// Of the command, as a share of full scale.
    pub(super) command: f64,
    /// Of the flow, since it was corrected or fitted by a pressure drop, as a share of itself.
    pub(super) drop: f64,
}

impl Sensors {
    /// How far a figure of `cycle` may be off: for each sensor what the worst of an offset, a wrong gain and a bend at zero does
    /// that is as large as its accuracy allows, and the sensors together as independent.
    pub(super) fn half_width(
        &self,
        cycle: &Cycle,
        full: f64,
        figure: impl Fn(&CycleFigures) -> Option<f64>,
    ) -> f64 {
        let value = |cycle: &Cycle| cycle.figures(full).and_then(|own| figure(&own));
        let Some(own) = value(cycle) else { return 0.0 };
        let points = cycle.falling.iter().chain(&cycle.rising);
        let largest = points.fold(0.0, |most: f64, point| most.max(point[1].abs()));
        let errs = |column: usize, error: &dyn Fn(f64) -> f64| {
            let mut other = cycle.clone();
            for point in other.falling.iter_mut().chain(&mut other.rising) {
                point[column] += error(point[column]);
            }
            value(&other).map_or(0.0, |other| (other - own).abs())
        };
        let worst = |column: usize, share: f64, range: f64| {
            let offset = errs(column, &|_| share * range);
            let gain = errs(column, &|value| share * value);
            let bend = errs(column, &|value| share * value.abs());
            offset.max(gain).max(bend)
        };
        let parts = [
            worst(1, self.output, largest),
            worst(0, self.command, full),
            errs(1, &|flow| self.drop * flow),
        ];
        parts.iter().map(|part| part.powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracies_are_read_and_what_is_none_is_refused() {
        let accuracy: Accuracy = "flow=0.5 %, pressure = 0.2%".parse().unwrap();
        assert!((accuracy.of(Channel::Flow) - 0.005).abs() < 1e-15);
        assert!((accuracy.of(Channel::PressureB) - 0.002).abs() < 1e-15);
        assert_eq!(accuracy.of(Channel::Spool), 0.0);
        for bad in [
            "",
            "flow",
            "flow=",
            "flow=0.5",
            "flow=-1 %",
            "flow=nan %",
            "temperature=1 %",
            "flow=100 %",
        ] {
            let error = bad.parse::<Accuracy>().unwrap_err().to_string();
            assert!(
                error.contains("flow=0.5 %, pressure=0.2 %"),
                "{bad}: {error}"
            );
        }
    }

    #[test]
    fn an_offset_of_the_meter_moves_the_null_and_a_wrong_gain_the_rated_flow() {
        let rising: Vec<[f64; 2]> = (-100..=100)
            .map(|k| [f64::from(k), 0.5 * f64::from(k)])
            .collect();
        let cycle = Cycle {
            falling: rising.iter().rev().copied().collect(),
            rising,
        };
        let meter = Sensors {
            output: 0.01,
            ..Sensors::default()
        };
        let half = |sensors: Sensors, figure: fn(&CycleFigures) -> Option<f64>| {
            sensors.half_width(&cycle, 100.0, figure)
        };
        assert!((half(meter, |one| Some(one.null)) - 1.0).abs() < 1e-6);
        assert!((half(meter, |one| one.rated) - 0.5).abs() < 1e-6);
        assert!((half(meter, |one| Some(one.asymmetry)) - 2.0).abs() < 0.05);
        assert!(half(meter, |one| Some(one.lap)) < 1e-6);
        let gauge = Sensors {
            drop: 0.02,
            ..Sensors::default()
        };
        assert!((half(gauge, |one| one.rated) - 1.0).abs() < 1e-9);
        let both = Sensors {
            drop: 0.02,
            ..meter
        };
        assert!((half(both, |one| one.rated) - f64::hypot(0.5, 1.0)).abs() < 1e-6);
    }
}
