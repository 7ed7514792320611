//! What a report says of the valve and the test beside what was measured: serial number, operator, oil.

use crate::record::quoted;
use crate::{Error, Result};
use serde::Serialize;
use std::str::FromStr;

/// Longest name or value, in characters, and most of them.
const LONGEST: usize = 200;
const MOST: usize = 40;

/// A line of that.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AboutLine {
    /// What, such as `serial`.
    pub name: String,
    /// Its value.
    pub value: String,
}

/// What the user says of a valve and its test, such as `serial = 4711, operator = J. Doe, oil = ISO VG 46`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About(pub Vec<AboutLine>);

impl FromStr for About {
    type Err = Error;

    /// # Errors
    /// A part that is not `NAME = VALUE`, a name that is there twice, a text that is no line.
    fn from_str(text: &str) -> Result<Self> {
        let refuse = |problem: String| {
            let remedy = "write \"serial = 4711, operator = J. Doe, oil = ISO VG 46\"; where a value has a comma, put ; between";
            Error::input("--about", problem, remedy)
        };
        if text.chars().any(char::is_control) {
            return Err(refuse("has characters that are no text".into()));
        }
        let separator = if text.contains(';') { ';' } else { ',' };
        let mut lines: Vec<AboutLine> = Vec::new();
        for part in text.split(separator).map(str::trim) {
            let known = part.split_once('=').map(|(a, b)| (a.trim(), b.trim()));
            let (name, value) = known
                .filter(|(name, value)| !name.is_empty() && !value.is_empty())
                .ok_or_else(|| refuse(format!("{} is no name with a value", quoted(part))))?;
            if lines.iter().any(|line| line.name == name) {
                return Err(refuse(format!("{} is there twice", quoted(name))));
            }
            if name.chars().count().max(value.chars().count()) > LONGEST || lines.len() == MOST {
                return Err(refuse("is longer than a page".into()));
            }
            lines.push(AboutLine {
                name: name.into(),
                value: value.into(),
            });
        }
        Ok(Self(lines))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_values_are_read_and_what_is_none_is_refused() {
        let told = |text: &str| -> Vec<[String; 2]> {
            let About(lines) = text.parse().unwrap();
            lines
                .into_iter()
                .map(|line| [line.name, line.value])
                .collect()
        };
        assert_eq!(
            told("serial = 4711, oil=ISO VG 46"),
            [["serial", "4711"], ["oil", "ISO VG 46"]]
        );
        assert_eq!(
            told("who = Doe, J.; a = b=c"),
            [["who", "Doe, J."], ["a", "b=c"]]
        );
        for bad in [
            "",
            "serial",
            "= 3",
            "serial =",
            "a = 1, a = 2",
            "a = 1,",
            "a = \u{7}",
        ] {
            let error = bad.parse::<About>().unwrap_err().to_string();
            assert!(
                error.starts_with("--about: ") && error.contains("; write "),
                "{error}"
            );
        }
    }
}
