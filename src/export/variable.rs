//! What drives an exported model, and units as FMI has them.

use crate::evaluate::physics::{INPUTS, Physics};
use crate::model::Structure;

/// The channels of a record that the fields of an input are, all but time.
pub(super) const CHANNELS: [&str; 6] = [
    "command",
    "supply_pressure",
    "return_pressure",
    "pressure_a",
    "pressure_b",
    "temperature",
];

/// A measured quantity that drives the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its name: that of its channel in a record.
    pub name: &'static str,
    /// Its unit.
    pub unit: String,
    /// Its place in [`INPUTS`].
    pub place: usize,
}

/// The inputs that the written functions of `physics` read, the command first.
pub fn inputs(structure: &Structure, physics: &Physics) -> Vec<Input> {
    let read = |place: usize| {
        let field = INPUTS[place];
        ["input", "start", "middle", "end"]
            .iter()
            .any(|argument| physics.trace.has_read(&format!("{argument}.{field}")))
    };
    let input = |place: usize| Input {
        name: CHANNELS[place],
        unit: match place {
            0 => structure.command_unit.clone(),
            5 => "degC".into(),
            _ => "bar".into(),
        },
        place,
    };
    (0..CHANNELS.len())
        .filter(|&place| place == 0 || read(place))
        .map(input)
        .collect()
}

/// A unit in terms of SI base units: `value [SI] = factor · value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BaseUnit {
    /// Exponents of [`BaseUnit::NAMES`].
    pub(super) exponents: [i32; 5],
    pub(super) factor: f64,
    pub(super) offset: f64,
}

impl BaseUnit {
    /// The base units that units of valves are made of.
    pub(super) const NAMES: [&'static str; 5] = ["kg", "m", "s", "A", "K"];

    /// The unit that is written `text`; none where it is not known.
    pub(super) fn parse(text: &str) -> Option<Self> {
        // The last division first, unless it is inside parentheses: L/min/bar is (L/min)/bar.
        let end = text.find("/(").or_else(|| text.rfind('/'));
        if let Some(end) = end {
            let below = text[end + 1..]
                .trim_start_matches('(')
                .trim_end_matches(')');
            return Some(Self::parse(&text[..end])?.over(Self::parse(below)?));
        }
        let (exponents, factor, offset) = match text {
            "1" => ([0; 5], 1.0, 0.0),
            "%" => ([0; 5], 0.01, 0.0),
            "s" => ([0, 0, 1, 0, 0], 1.0, 0.0),
            "min" => ([0, 0, 1, 0, 0], 60.0, 0.0),
            "Hz" => ([0, 0, -1, 0, 0], 1.0, 0.0),
            "V" => ([1, 2, -3, -1, 0], 1.0, 0.0),
            "mA" => ([0, 0, 0, 1, 0], 1e-3, 0.0),
            "mm" => ([0, 1, 0, 0, 0], 1e-3, 0.0),
            "cm2" => ([0, 2, 0, 0, 0], 1e-4, 0.0),
            "m3" => ([0, 3, 0, 0, 0], 1.0, 0.0),
            "L" => ([0, 3, 0, 0, 0], 1e-3, 0.0),
            "kg" => ([1, 0, 0, 0, 0], 1.0, 0.0),
            "bar" => ([1, -1, -2, 0, 0], 1e5, 0.0),
            "cSt" => ([0, 2, -1, 0, 0], 1e-6, 0.0),
            "K" => ([0, 0, 0, 0, 1], 1.0, 0.0),
            "degC" => ([0, 0, 0, 0, 1], 1.0, 273.15),
            _ => return None,
        };
        Some(Self {
            exponents,
            factor,
            offset,
        })
    }

    fn over(self, below: Self) -> Self {
        Self {
            exponents: std::array::from_fn(|i| self.exponents[i] - below.exponents[i]),
            factor: self.factor / below.factor,
            offset: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quotient_of_units_is_one_in_base_units() {
        let unit = BaseUnit::parse("bar/(L/min)").unwrap();
        assert_eq!(unit.exponents, [1, -4, -1, 0, 0]);
        assert!((unit.factor / 6e9 - 1.0).abs() < 1e-12);
        let unit = BaseUnit::parse("L/min/bar").unwrap();
        assert_eq!(unit.exponents, [-1, 4, 1, 0, 0]);
        assert_eq!(BaseUnit::parse("furlong/s"), None);
    }
}
