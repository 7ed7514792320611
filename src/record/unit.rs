//! Units, and the one unit that each quantity is kept in.

use super::text::quoted;
use crate::{Error, Result};
use std::fmt::Display;

/// What a column measures. It decides which units are known and which one the values are kept in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Kept in s.
    Time,
    /// A command or a spool position: kept in V, mA, %, mm or 1, whichever is nearest to what was given.
    Signal,
    /// Kept in L/min.
    Flow,
    /// Kept in bar.
    Pressure,
    /// Kept in mm.
    Length,
    /// Kept in degC.
    Temperature,
    /// Kept in Hz.
    Frequency,
    /// Kept in deg.
    Phase,
    /// Kept in dB.
    Gain,
    /// A share of full scale: kept in %.
    Share,
    /// Kept in cm2.
    Area,
    /// A pure number, such as a weight.
    Number,
}

/// A unit: how it is spelt, and how its values become values of the unit that is kept.
#[derive(Debug, PartialEq)]
pub struct Unit {
    spellings: &'static [&'static str],
    kept: &'static str,
    offset: f64,
    // A quotient, because 1 / 1000 is the double nearest to 0.001 and 1 * 0.001 need not be.
    numerator: f64,
    denominator: f64,
}

impl Unit {
    const fn new(
        spellings: &'static [&'static str],
        kept: &'static str,
        numerator: f64,
        denominator: f64,
    ) -> Self {
        Self {
            spellings,
            kept,
            offset: 0.0,
            numerator,
            denominator,
        }
    }

    const fn offset(self, offset: f64) -> Self {
        Self { offset, ..self }
    }

    /// The unit that values are kept in, such as `bar` for `psi`.
    pub fn kept(&self) -> &'static str {
        self.kept
    }

    /// How the unit is usually written.
    pub fn spelling(&self) -> &'static str {
        self.spellings[0]
    }

    /// `value` of this unit in the unit that is kept.
    pub fn convert(&self, value: f64) -> f64 {
        (value + self.offset) * self.numerator / self.denominator
    }

    /// Case is ignored, but for a first m: mV is no MV, and MPa no mPa.
    fn is_spelt(&self, text: &str) -> bool {
        self.spellings.iter().any(|spelling| {
            spelling.eq_ignore_ascii_case(text)
                && spelling.starts_with('m') == text.starts_with('m')
        })
    }
}

const TIME: &[Unit] = &[
    Unit::new(&["s", "sec", "second", "seconds"], "s", 1.0, 1.0),
    Unit::new(&["ms", "msec", "milliseconds"], "s", 1.0, 1e3),
    Unit::new(
        &["us", "\u{b5}s", "\u{3bc}s", "usec", "microseconds"],
        "s",
        1.0,
        1e6,
    ),
    Unit::new(&["ns", "nanoseconds"], "s", 1.0, 1e9),
    Unit::new(&["min", "minutes"], "s", 60.0, 1.0),
];
const SIGNAL: &[Unit] = &[
    Unit::new(&["V", "volt", "volts"], "V", 1.0, 1.0),
    Unit::new(&["mV"], "V", 1.0, 1e3),
    Unit::new(&["mA"], "mA", 1.0, 1.0),
    Unit::new(&["uA", "\u{b5}A", "\u{3bc}A"], "mA", 1.0, 1e3),
    Unit::new(&["A"], "mA", 1e3, 1.0),
    Unit::new(&["%", "percent", "pct"], "%", 1.0, 1.0),
    Unit::new(&["1", "-"], "1", 1.0, 1.0),
];
const FLOW: &[Unit] = &[
    Unit::new(
        &["L/min", "lpm", "dm3/min", "dm^3/min", "dm\u{b3}/min"],
        "L/min",
        1.0,
        1.0,
    ),
    Unit::new(
        &["L/s", "dm3/s", "dm^3/s", "dm\u{b3}/s"],
        "L/min",
        60.0,
        1.0,
    ),
    Unit::new(&["L/h", "L/hr"], "L/min", 1.0, 60.0),
    Unit::new(
        &[
            "mL/min",
            "cm^3/min",
            "cm3/min",
            "cm\u{b3}/min",
            "cc/min",
            "ccm/min",
        ],
        "L/min",
        1.0,
        1e3,
    ),
    Unit::new(&["mL/s"], "L/min", 60.0, 1e3),
    Unit::new(&["m^3/s", "m3/s", "m³/s"], "L/min", 60_000.0, 1.0),
    Unit::new(&["m^3/min", "m3/min", "m³/min"], "L/min", 1e3, 1.0),
    Unit::new(&["m^3/h", "m3/h", "m³/h"], "L/min", 1e3, 60.0),
    Unit::new(
        &["cm^3/s", "cm3/s", "cm³/s", "cc/s", "ccm/s"],
        "L/min",
        60.0,
        1e3,
    ),
    Unit::new(
        &["gpm", "gal/min", "US gpm", "USgpm"],
        "L/min",
        3.785_411_784,
        1.0,
    ),
    // An inch is 25.4 mm, so that its cube is 16.387064 cm3.
    Unit::new(
        &["in^3/s", "in3/s", "in³/s", "cis"],
        "L/min",
        0.983_223_84,
        1.0,
    ),
    Unit::new(
        &["in^3/min", "in3/min", "in³/min", "cim"],
        "L/min",
        0.016_387_064,
        1.0,
    ),
];
const PRESSURE: &[Unit] = &[
    Unit::new(&["bar", "barg"], "bar", 1.0, 1.0),
    Unit::new(&["mbar"], "bar", 1.0, 1e3),
    Unit::new(&["Pa"], "bar", 1.0, 1e5),
    Unit::new(&["hPa"], "bar", 1.0, 1e3),
    Unit::new(&["kPa"], "bar", 1.0, 100.0),
    Unit::new(&["MPa"], "bar", 10.0, 1.0),
    Unit::new(
        &["psi", "psig", "lbf/in2"],
        "bar",
        0.068_947_572_931_683_6,
        1.0,
    ),
    Unit::new(
        &["kgf/cm2", "kgf/cm^2", "kgf/cm²", "kg/cm2"],
        "bar",
        0.980_665,
        1.0,
    ),
];
const LENGTH: &[Unit] = &[
    Unit::new(&["mm"], "mm", 1.0, 1.0),
    Unit::new(&["m"], "mm", 1e3, 1.0),
    Unit::new(&["cm"], "mm", 10.0, 1.0),
    Unit::new(&["um", "\u{b5}m", "\u{3bc}m"], "mm", 1.0, 1e3),
    Unit::new(&["in", "inch", "inches"], "mm", 25.4, 1.0),
];
const TEMPERATURE: &[Unit] = &[
    Unit::new(&["degC", "deg C", "°C", "C"], "degC", 1.0, 1.0),
    Unit::new(&["degF", "deg F", "°F", "F"], "degC", 5.0, 9.0).offset(-32.0),
    Unit::new(&["K"], "degC", 1.0, 1.0).offset(-273.15),
];
const FREQUENCY: &[Unit] = &[
    Unit::new(&["Hz"], "Hz", 1.0, 1.0),
    Unit::new(&["kHz"], "Hz", 1e3, 1.0),
    Unit::new(&["rad/s"], "Hz", 1.0, std::f64::consts::TAU),
];
const PHASE: &[Unit] = &[
    Unit::new(&["deg", "°"], "deg", 1.0, 1.0),
    Unit::new(&["rad"], "deg", 180.0, std::f64::consts::PI),
];
const GAIN: &[Unit] = &[Unit::new(&["dB"], "dB", 1.0, 1.0)];
const SHARE: &[Unit] = &[
    Unit::new(&["%"], "%", 1.0, 1.0),
    Unit::new(&["1", "-"], "%", 100.0, 1.0),
];
const AREA: &[Unit] = &[
    Unit::new(&["cm2", "cm^2", "cm²"], "cm2", 1.0, 1.0),
    Unit::new(&["mm2", "mm^2", "mm²"], "cm2", 1.0, 100.0),
    Unit::new(&["m2", "m^2", "m²"], "cm2", 1e4, 1.0),
    Unit::new(&["in2", "in^2", "in²"], "cm2", 6.451_6, 1.0),
];
const NUMBER: &[Unit] = &[Unit::new(&["1", "-"], "1", 1.0, 1.0)];

/// Whether any quantity has a unit spelt `text`.
pub(super) fn is_known(text: &str) -> bool {
    let mut all = Quantity::ALL.into_iter().flat_map(Quantity::units);
    all.any(|unit| unit.is_spelt(text))
}

/// What makes values in the unit spelt `from` values in the unit spelt `to`, where both are units of one quantity.
pub(crate) fn conversion_between(from: &str, to: &str) -> Option<impl Fn(f64) -> f64 + use<>> {
    let both = |quantity: Quantity| {
        let unit = |text: &str| quantity.units().find(|unit| unit.is_spelt(text));
        let (from, to) = (unit(from)?, unit(to)?);
        (from.kept == to.kept).then_some((from, to))
    };
    let found = Quantity::ALL.into_iter().find_map(both);
    // What is spelt alike is the same, even where no column has such a unit: L/min/V.
    (found.is_some() || from == to).then_some(move |value| match found {
        Some((from, to)) if from != to => {
            from.convert(value) * to.denominator / to.numerator - to.offset
        }
        _ => value,
    })
}

impl Quantity {
    const ALL: [Self; 12] = [
        Self::Time,
        Self::Signal,
        Self::Flow,
        Self::Pressure,
        Self::Length,
        Self::Temperature,
        Self::Frequency,
        Self::Phase,
        Self::Gain,
        Self::Share,
        Self::Area,
        Self::Number,
    ];

    fn units(self) -> impl Iterator<Item = &'static Unit> {
        let (own, more): (&'static [Unit], &'static [Unit]) = match self {
            Self::Time => (TIME, &[]),
            Self::Signal => (SIGNAL, LENGTH),
            Self::Flow => (FLOW, &[]),
            Self::Pressure => (PRESSURE, &[]),
            Self::Length => (LENGTH, &[]),
            Self::Temperature => (TEMPERATURE, &[]),
            Self::Frequency => (FREQUENCY, &[]),
            Self::Phase => (PHASE, &[]),
            Self::Gain => (GAIN, &[]),
            Self::Share => (SHARE, &[]),
            Self::Area => (AREA, &[]),
            Self::Number => (NUMBER, &[]),
        };
        own.iter().chain(more)
    }

    /// Whether it has a unit spelt `text`.
    pub(super) fn is_in(self, text: &str) -> bool {
        self.units().any(|unit| unit.is_spelt(text))
    }

    /// The unit to name in an example: the one that is kept, V for a signal.
    pub(super) fn usual(self) -> &'static Unit {
        match self {
            Self::Time => &TIME[0],
            Self::Signal => &SIGNAL[0],
            Self::Flow => &FLOW[0],
            Self::Pressure => &PRESSURE[0],
            Self::Length => &LENGTH[0],
            Self::Temperature => &TEMPERATURE[0],
            Self::Frequency => &FREQUENCY[0],
            Self::Phase => &PHASE[0],
            Self::Gain => &GAIN[0],
            Self::Share => &SHARE[0],
            Self::Area => &AREA[0],
            Self::Number => &NUMBER[0],
        }
    }

    /// The unit spelt `text`. Where there is none, time is in s, pressure in bar, and a number is a number.
    ///
    /// # Errors
    /// An unknown unit, or none where one is needed; `place` says where.
    pub fn unit(self, text: Option<&str>, place: impl Display) -> Result<&'static Unit> {
        let problem = match text {
            None if matches!(self, Self::Time | Self::Pressure | Self::Number) => {
                return Ok(self.usual());
            }
            None => "has no unit".to_string(),
            Some(text) => match self.units().find(|unit| unit.is_spelt(text)) {
                Some(unit) => return Ok(unit),
                None => format!("unit {} is not known here", quoted(text)),
            },
        };
        let known: Vec<&str> = self.units().map(|unit| unit.spellings[0]).collect();
        Err(Error::input(
            place,
            problem,
            format!("write one of [{}] behind the name", known.join("] [")),
        ))
    }
}
