//! What a limit says: `<= 3 %`, `>= 12 Hz`, `57 .. 63 L/min`.

use crate::record::quoted;
use std::str::FromStr;

/// A range with at least one end, in a unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Range {
    pub(super) lower: Option<f64>,
    pub(super) upper: Option<f64>,
    /// Empty where none was written.
    pub(super) unit: String,
    /// As it was written.
    pub(super) text: String,
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (lower, upper, unit) = if let Some(rest) = text.strip_prefix("<=") {
            let (upper, unit) = number(rest)?;
            (None, Some(upper), unit)
        } else if let Some(rest) = text.strip_prefix(">=") {
            let (lower, unit) = number(rest)?;
            (Some(lower), None, unit)
        } else if let Some((low, high)) = text.split_once("..") {
            let ((lower, own), (upper, unit)) = (number(low)?, number(high)?);
            if !own.is_empty() && own != unit {
                return Err(format!("{} has two units", quoted(text)));
            }
            if lower >= upper {
                return Err(format!("{} ends before it begins", quoted(text)));
            }
            (Some(lower), Some(upper), unit)
        } else {
            return Err(format!(
                "{} says neither <= nor >= nor from .. to",
                quoted(text)
            ));
        };
        Ok(Self {
            lower,
            upper,
            unit: unit.into(),
            text: text.into(),
        })
    }
}

/// A number and the unit behind it.
fn number(text: &str) -> Result<(f64, &str), String> {
    let text = text.trim();
    let belongs = |c: char| c.is_ascii_digit() || ".+-eE".contains(c);
    let end = text.find(|c| !belongs(c)).unwrap_or(text.len());
    let (digits, unit) = text.split_at(end);
    match digits.parse() {
        Ok(value) if f64::is_finite(value) && !unit.starts_with(',') => Ok((value, unit.trim())),
        _ => Err(format!("{} is no number with a unit", quoted(text))),
    }
}
