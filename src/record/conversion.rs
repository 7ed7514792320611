//! How a column's values become values of a channel: scaled, shifted, and in the unit that is kept.

use super::unit::Unit;
use crate::{Error, Result};
use std::fmt::{self, Display, Formatter};

/// `[%] *12.5 -150`: a value of the column times 12.5, less 150, is in %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Conversion {
    pub(super) unit: &'static Unit,
    scale: f64,
    offset: f64,
}

impl From<&'static Unit> for Conversion {
    /// Of a column that is in `unit` already.
    fn from(unit: &'static Unit) -> Self {
        Self {
            unit,
            scale: 1.0,
            offset: 0.0,
        }
    }
}

impl Conversion {
    /// Into `unit`, as `text` says, which stands behind the unit and may be empty: `*12.5 -150`, `*-1`, `+ 3`.
    ///
    /// # Errors
    /// Something else; a scale of zero; a number that is not finite. `place` says where.
    pub(super) fn parse(unit: &'static Unit, text: &str, place: &str) -> Result<Self> {
        let wrong = |problem: String| {
            Error::input(
                place,
                problem,
                "write a scale and an offset behind the unit, as in \"i=command [%] *12.5 -150\": what the column holds \
                 times 12.5, less 150, is in %",
            )
        };
        let finite = |number: &str| match number.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ if number.contains(',') => Err(Error::input(
                place,
                format!("{number:?} has a comma"),
                format!("write decimals with a point: {}", number.replace(',', ".")),
            )),
            _ => Err(wrong(format!("{number:?} is no finite number"))),
        };
        let mut rest = text.trim();
        let mut scale = 1.0;
        if let Some(behind) = rest.strip_prefix('*') {
            let (number, after) = leading_number(behind.trim_start());
            scale = finite(number)?;
            rest = after.trim_start();
        }
        let mut offset = 0.0;
        if let Some(sign) = rest.chars().next().filter(|sign| matches!(sign, '+' | '-')) {
            let (number, after) = leading_number(rest[1..].trim_start());
            let size = finite(number)?;
            offset = if sign == '-' { -size } else { size };
            rest = after.trim_start();
        }
        match rest {
            "" if scale == 0.0 => Err(wrong("has a scale of 0, which leaves nothing".into())),
            "" => Ok(Self {
                unit,
                scale,
                offset,
            }),
            _ => Err(wrong(format!("{rest:?} is neither scale nor offset"))),
        }
    }

    /// A value of the column in the unit that is kept.
    pub(super) fn convert(&self, value: f64) -> f64 {
        self.unit.convert(value * self.scale + self.offset)
    }

    /// Whether values are scaled or shifted before they are in the unit.
    pub(super) fn changes(&self) -> bool {
        (self.scale, self.offset) != (1.0, 0.0)
    }
}

impl Display for Conversion {
    /// As [`Conversion::parse`] reads it, behind the unit.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "[{}]", self.unit.spelling())?;
        if self.scale != 1.0 {
            write!(f, " *{}", self.scale)?;
        }
        if self.offset != 0.0 {
            write!(f, " {:+}", self.offset)?;
        }
        Ok(())
    }
}

/// `12.5` and ` -150` of `12.5 -150`. A comma is taken for a part of the number, so that it can be refused as such.
fn leading_number(text: &str) -> (&str, &str) {
    let mut before = ' ';
    let belongs = |letter: char| {
        let sign = matches!(letter, '+' | '-') && matches!(before, ' ' | 'e' | 'E');
        before = letter;
        sign || letter.is_ascii_alphanumeric() || matches!(letter, '.' | ',')
    };
    let behind = text.trim_start_matches(belongs);
    text.split_at(text.len() - behind.len())
}

/// What stands before a scale or an offset, and these: `flow [L/min]` and `*0.06` of `flow [L/min] *0.06`.
///
/// Behind a unit in brackets everything is; without one, what begins with `*`, or with a sign behind a blank.
pub(super) fn split(text: &str) -> (&str, &str) {
    let at = match text.find(']').or_else(|| text.find(')')) {
        Some(bracket) => bracket + 1,
        None => {
            let scale = text.find('*');
            let offset = [" +", " -"].iter().filter_map(|sign| text.find(sign)).min();
            let first = scale.into_iter().chain(offset).min();
            first.unwrap_or(text.len())
        }
    };
    text.split_at(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Quantity;

    fn conversion(text: &str) -> Result<Conversion> {
        let unit = Quantity::Signal.unit(Some("%"), "")?;
        Conversion::parse(unit, text, "--map")
    }

    #[test]
    fn a_scale_and_an_offset_are_read_however_they_are_spelt() {
        for (text, of_four, shown) in [
            ("", 4.0, "[%]"),
            ("*12.5 -150", -100.0, "[%] *12.5 -150"),
            (" * 12.5 - 150 ", -100.0, "[%] *12.5 -150"),
            ("*12.5-150", -100.0, "[%] *12.5 -150"),
            ("*-1", -4.0, "[%] *-1"),
            ("* +2 + 3", 11.0, "[%] *2 +3"),
            ("-150", -146.0, "[%] -150"),
            ("+ 3", 7.0, "[%] +3"),
            ("*1e-3+1E+1", 10.004, "[%] *0.001 +10"),
            ("*1 +0", 4.0, "[%]"),
            ("*.5", 2.0, "[%] *0.5"),
        ] {
            let read = conversion(text).unwrap();
            assert_eq!(read.convert(4.0), of_four, "{text:?}");
            assert_eq!(read.to_string(), shown, "{text:?}");
            let again = shown.strip_prefix("[%]").unwrap();
            assert_eq!(conversion(again).unwrap(), read, "{text:?}");
        }
    }

    #[test]
    fn what_is_no_scale_or_offset_is_refused_with_what_to_write() {
        for (text, said) in [
            ("*0", "has a scale of 0"),
            ("*-0.0", "has a scale of 0"),
            ("*1,5", "write decimals with a point: 1.5"),
            ("*2 -1,5", "write decimals with a point: 1.5"),
            ("*nan", "\"nan\" is no finite number"),
            ("*inf", "\"inf\" is no finite number"),
            ("*1e999", "\"1e999\" is no finite number"),
            ("+NaN", "is no finite number"),
            ("*", "\"\" is no finite number"),
            ("* 2 *3", "\"*3\" is neither scale nor offset"),
            ("-4 *6.25", "\"*6.25\" is neither scale nor offset"),
            ("/ 8", "\"/ 8\" is neither scale nor offset"),
            ("12.5", "\"12.5\" is neither scale nor offset"),
            ("*1.2.3", "\"1.2.3\" is no finite number"),
            ("−150", "is neither scale nor offset"),
        ] {
            let error = conversion(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text:?}: {error}");
        }
    }
}
