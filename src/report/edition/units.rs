//! The units in which people are told numbers. Which there are, and by what they differ, the records' units say.

use crate::record::{Quantity, conversion_between, quoted};
use crate::{Error, Result};
use std::str::FromStr;

/// Units of flow, pressure and length that values are kept in or told in where nothing else is asked for.
const WRITTEN: [&str; 6] = ["L/min", "mL/min", "bar", "mm", "µm", "cm2"];

/// A litre a minute where a stroke stands between two units.
const LITRE: &str = "L\u{2215}min";

/// What may stand between two numbers of one unit.
const BETWEEN: [&str; 8] = ["..", "…", "±", "→", "to", "and", "or", "–"];

/// Significant digits that a number in a sentence has at least: 10 bar are 145 psi.
const DIGITS: i32 = 4;

/// Units of flow, pressure and length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    flow: &'static str,
    pressure: &'static str,
    length: &'static str,
}

impl Default for Units {
    /// Those that values are kept in.
    fn default() -> Self {
        Self {
            flow: "L/min",
            pressure: "bar",
            length: "mm",
        }
    }
}

impl FromStr for Units {
    type Err = Error;

    /// `metric`, `us`, or units separated by commas: `gpm, psi, in`.
    ///
    /// # Errors
    /// Something that is no unit of flow, pressure or length; two of one kind.
    fn from_str(text: &str) -> Result<Self> {
        let us = Self {
            flow: "gpm",
            pressure: "psi",
            length: "in",
        };
        match text.trim() {
            "metric" => return Ok(Self::default()),
            "us" => return Ok(us),
            _ => {}
        }
        let refuse = |problem: String| {
            let remedy =
                "write us, metric, or units of flow, pressure and length: \"gpm, psi, in\"";
            Error::input("--units", problem, remedy)
        };
        let kinds = [Quantity::Flow, Quantity::Pressure, Quantity::Length];
        let mut found: [Option<&'static str>; 3] = [None; 3];
        for part in text.split(',').map(str::trim) {
            let unit = |kind: &Quantity| kind.unit(Some(part), "--units").ok();
            let known = kinds.iter().map(unit).zip(&mut found);
            let (unit, own) = known
                .filter_map(|(unit, own)| Some((unit?, own)))
                .next()
                .ok_or_else(|| refuse(format!("{} is no such unit", quoted(part))))?;
            if let Some(earlier) = own.replace(unit.spelling()) {
                let units = [quoted(earlier), quoted(part)].join(" and ");
                return Err(refuse(format!("{units} are units of the same")));
            }
        }
        let [flow, pressure, length] = found;
        let kept = Self::default();
        Ok(Self {
            flow: flow.unwrap_or(kept.flow),
            pressure: pressure.unwrap_or(kept.pressure),
            length: length.unwrap_or(kept.length),
        })
    }
}

impl Units {
    /// What is told instead of `unit`, and by what values are multiplied: `gpm/V` and 0.264 for `L/min/V`. What is neither
    /// flow nor pressure, length or area stays.
    pub fn of(&self, unit: &str) -> (String, f64) {
        let text = unit.replace("(L/min)", LITRE).replace("L/min", LITRE);
        let mut factor = 1.0;
        let mut quotient = Vec::new();
        for (i, part) in text.split('/').enumerate() {
            let mut product = Vec::new();
            for name in part.split(' ') {
                let power = if name.ends_with('²') { 2 } else { 1 };
                let plain = name.trim_end_matches('²').replace(LITRE, "L/min");
                let (told, own) = self.simple(&plain).unwrap_or((plain, 1.0));
                factor *= own.powi(if i == 0 { power } else { -power });
                let wrapped = told.contains('/') && unit.contains('(');
                let told = if wrapped { format!("({told})") } else { told };
                product.push(if power == 2 { told + "²" } else { told });
            }
            quotient.push(product.join(" "));
        }
        (quotient.join("/"), factor)
    }

    /// The same for a unit that is not made of others, if it is another then.
    fn simple(&self, unit: &str) -> Option<(String, f64)> {
        if !WRITTEN.contains(&unit) {
            return None;
        }
        let kept = Self::default();
        let squared = |length: &str| format!("{length}2");
        let asked = [
            (self.flow != kept.flow, self.flow.to_owned()),
            (self.pressure != kept.pressure, self.pressure.to_owned()),
            (self.length != kept.length, self.length.to_owned()),
            (self.length != kept.length, squared(self.length)),
        ];
        let mut others = asked
            .into_iter()
            .filter(|(other, name)| *other && name != unit);
        others.find_map(|(_, name)| {
            let convert = conversion_between(unit, &name)?;
            Some((name, convert(1.0)))
        })
    }

    /// `value` in `unit` as it is told: the value, and the unit of it.
    pub fn tell(&self, value: f64, unit: &str) -> (f64, String) {
        let (unit, factor) = self.of(unit);
        (factor * value, unit)
    }

    /// `text` with every number that one of those units follows in the unit that is told: `at 10 bar` becomes `at 145 psi`.
    pub fn text(&self, text: &str) -> String {
        if *self == Self::default() {
            return text.into();
        }
        let mut words: Vec<String> = text.split(' ').map(String::from).collect();
        for i in 1..words.len() {
            let unit = words[i].trim_end_matches(['.', ',', ';', ':', ')', '!', '?']);
            let unit = unit.to_owned();
            let (name, factor) = self.of(&unit);
            if name == unit {
                continue;
            }
            let mut before = i;
            let mut any = false;
            while let Some(number) = before
                .checked_sub(1)
                .and_then(|at| scaled(&words[at], factor))
            {
                words[before - 1] = number;
                any = true;
                let joined = before > 1 && BETWEEN.contains(&words[before - 2].as_str());
                before = if joined { before - 2 } else { 0 };
            }
            if any {
                words[i] = format!("{name}{}", &words[i][unit.len()..]);
            }
        }
        words.join(" ")
    }
}

/// A `word` that is a number, times `factor`, with what stands around it.
fn scaled(word: &str, factor: f64) -> Option<String> {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '-' | '\u{2212}' | '.');
    let from = word.find(is_number)?;
    let (before, rest) = word.split_at(from);
    let number = rest.trim_end_matches([',', ';', ')']);
    let plain = number.replace('\u{2212}', "-");
    let value: f64 = plain.parse().ok().filter(|value: &f64| value.is_finite())?;
    if before.chars().any(char::is_alphanumeric) {
        return None;
    }
    let mantissa = plain.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.trim_start_matches(['-', '0', '.']);
    let digits = digits.chars().filter(char::is_ascii_digit).count() as i32;
    let mut told = super::super::rounded(factor * value, digits.max(DIGITS));
    if number.contains('\u{2212}') {
        told = told.replacen('-', "\u{2212}", 1);
    }
    Some(format!("{before}{told}{}", &rest[number.len()..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(text: &str) -> Units {
        text.parse().unwrap()
    }

    #[test]
    fn units_are_those_of_a_country_or_named_one_by_one() {
        assert_eq!(units("metric"), Units::default());
        assert_eq!(units("us"), units("gpm, psi, in"));
        assert_eq!(units("in,psi ,gpm"), units("us"));
        assert_eq!(units("L/min, bar, mm"), units("metric"));
        assert_eq!(units("MPa").of("bar"), ("MPa".into(), 0.1));
        assert_eq!(units("psi").of("L/min").0, "L/min");
        for bad in ["", "imperial", "gpm psi", "gpm, L/s", "V", "s", "gpm,"] {
            let error = bad.parse::<Units>().unwrap_err().to_string();
            assert!(error.starts_with("--units: "), "{error}");
            assert!(error.contains("; write us, metric, or"), "{error}");
        }
    }

    #[test]
    fn units_that_are_made_of_others_are_converted_part_by_part() {
        let us = units("us");
        for (unit, name, factor) in [
            ("L/min", "gpm", 0.264_172_052),
            ("L/min/V", "gpm/V", 0.264_172_052),
            ("bar", "psi", 14.503_773_8),
            ("bar/(L/min)", "psi/gpm", 14.503_773_8 * 3.785_411_784),
            ("L/min/bar", "gpm/psi", 0.264_172_052 / 14.503_773_8),
            ("mm", "in", 1.0 / 25.4),
            ("µm", "in", 1.0 / 25_400.0),
            ("mm/s", "in/s", 1.0 / 25.4),
            ("1/mm", "1/in", 25.4),
            ("cm2", "in2", 1.0 / 6.4516),
            ("L/min/√Hz", "gpm/√Hz", 0.264_172_052),
            ("(L/min)²", "gpm²", 0.264_172_052 * 0.264_172_052),
            ("V bar", "V psi", 14.503_773_8),
        ] {
            let (told, own) = us.of(unit);
            assert_eq!(told, name);
            assert!((own / factor - 1.0).abs() < 1e-8, "{unit}: {own}");
            assert_eq!(units("metric").of(unit), (unit.to_owned(), 1.0));
        }
        for same in ["V", "%", "1/s", "Hz", "kg/m3", "cSt", "degC", "1", ""] {
            assert_eq!(us.of(same), (same.to_owned(), 1.0));
        }
        assert_eq!(units("L/s").of("bar/(L/min)").0, "bar/(L/s)");
    }

    #[test]
    fn numbers_in_a_sentence_are_converted_with_their_units() {
        let us = units("us");
        for (text, told) in [
            ("rated flow at 10 bar", "rated flow at 145 psi"),
            ("at 70 bar, 5 V", "at 1015 psi, 5 V"),
            ("(57.611 .. 57.645 L/min)", "(15.219 .. 15.228 gpm)"),
            ("flow 1.5952 → 0.1743 L/min.", "flow 0.42141 → 0.04605 gpm."),
            ("by −0.25 mm; ≥ 2 bar", "by −0.009843 in; ≥ 29.01 psi"),
            ("a play of 61.8 µm", "a play of 0.002433 in"),
            (
                "5 bars, the bar, 3 m, 7 % of it",
                "5 bars, the bar, 3 m, 7 % of it",
            ),
            ("Δp10 bar", "Δp10 bar"),
        ] {
            assert_eq!(us.text(text), told);
            assert_eq!(units("metric").text(text), text);
        }
    }
}
