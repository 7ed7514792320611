//! What a report was made from, by what and when: enough to make it again.

use super::about::About;
use super::parameter::ParameterReport;
use crate::diagnose::Between;
use crate::input::{bytes, sha256};
use crate::model::Hold;
use crate::report::number;
use serde::Serialize;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The program that wrote a report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Program {
    /// `servobee`.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
}

impl Default for Program {
    /// This one.
    fn default() -> Self {
        Self {
            name: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
        }
    }
}

/// How the program was called.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Call {
    /// The arguments as they were given, but for those that the result does not depend on: where it goes and how it is told.
    pub arguments: Vec<String>,
    /// Files beside the records: a model, the curves of a datasheet.
    pub files: Vec<InputFile>,
    /// What the user says of the valve and the test.
    pub about: About,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputFile {
    /// As it was given.
    pub path: String,
    /// SHA-256 of its content in hexadecimal digits; null where that can be read only once, as from a pipe.
    pub sha256: Option<String>,
}

impl InputFile {
    /// The file at `path`, which was read just now.
    pub fn at(path: &Path) -> Self {
        let content = match path.is_file() {
            true => bytes(path, u64::MAX - 1, "").ok(),
            false => None,
        };
        Self {
            path: path.display().to_string(),
            sha256: content.map(|content| sha256(&content)),
        }
    }
}

/// What was taken for the command between two rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HoldReport {
    /// The one with which the result was fitted.
    pub taken: Hold,
    /// Whether the model says so; otherwise both were tried.
    pub stated: bool,
    /// How it went where it was not held, straight through its jumps or between them; null where that was not tried.
    pub straight: Option<Hold>,
    /// The error of the result both ways; null where the other was not tried.
    pub error: Option<HoldErrors>,
    /// Which of them the fitted rows prefer; null where they do not tell.
    pub preferred: Option<Hold>,
    /// Parameters that leave their 95 % interval with the other.
    pub moved: Vec<MovedParameter>,
}

/// RMS over the fitted rows of all channels, each in units of its noise floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HoldErrors {
    /// With a command that is held.
    pub held: f64,
    /// With one that goes straight from row to row.
    pub interpolated: f64,
}

/// A parameter that depends on what the command does between two rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MovedParameter {
    /// Its name.
    pub name: String,
    /// Its value in the result.
    pub value: f64,
    /// Its value with the other.
    pub other: f64,
}

impl From<&Between> for HoldReport {
    fn from(between: &Between) -> Self {
        let other = between.other.as_ref();
        let moved = other.iter().flat_map(|other| &other.moved);
        Self {
            taken: between.taken,
            stated: between.known,
            straight: match between.taken.is_straight() {
                true => Some(between.taken),
                false => other.map(|other| other.hold),
            },
            error: other.map(|other| {
                let [own, other] = other.errors;
                let [held, interpolated] = match between.taken.is_straight() {
                    false => [own, other],
                    true => [other, own],
                };
                HoldErrors { held, interpolated }
            }),
            preferred: other.and_then(|other| other.preferred),
            moved: moved
                .map(|(name, [value, other])| MovedParameter {
                    name: name.clone(),
                    value: *value,
                    other: *other,
                })
                .collect(),
        }
    }
}

impl HoldReport {
    /// What was taken, and why, in a sentence.
    pub fn sentence(&self) -> String {
        let name = |hold| match hold {
            Hold::Held => "held",
            Hold::Interpolated => "interpolated",
            Hold::BetweenJumps => "interpolated but for its jumps",
        };
        let why = match (self.stated, &self.error) {
            (true, _) => ", as the model says".into(),
            (false, None) => String::new(),
            (false, Some(HoldErrors { held, interpolated })) => format!(
                ": held leaves {} times the noise, {} {}, {}",
                number(*held),
                name(self.straight.unwrap_or(Hold::Interpolated)),
                number(*interpolated),
                match self.preferred {
                    Some(hold) => format!("and the fitted rows prefer {}", name(hold)),
                    None => "and the fitted rows do not tell which it was".into(),
                }
            ),
        };
        format!(
            "The command is taken as {} between two rows{why}.",
            name(self.taken)
        )
    }

    /// Whether the other may be right as well, or rather.
    fn is_doubtful(&self) -> bool {
        match self.preferred {
            Some(hold) => hold != self.taken,
            None => !self.moved.is_empty(),
        }
    }

    /// Where that is so, the intervals of `parameters` reach as far around their values with the other.
    pub(super) fn widen(&self, parameters: &mut [ParameterReport]) {
        if !self.is_doubtful() {
            return;
        }
        for moved in &self.moved {
            let own = parameters.iter_mut().filter(|one| one.name == moved.name);
            for parameter in own {
                let shift = moved.other - parameter.value;
                parameter.low += shift.min(0.0);
                parameter.high += shift.max(0.0);
            }
        }
    }

    /// What undermines the result, if so.
    pub(super) fn warning(&self) -> Option<String> {
        let moves = |one: &MovedParameter| {
            format!(
                "{} from {} to {}",
                one.name,
                number(one.value),
                number(one.other)
            )
        };
        let moved: Vec<String> = self.moved.iter().map(moves).collect();
        let moved = match moved.is_empty() {
            true => String::new(),
            false => format!(
                " The other moves {}: the intervals reach as far.",
                moved.join(", ")
            ),
        };
        self.is_doubtful().then(|| {
            format!(
                "{}{moved} If you know, say hold = \"held\" or hold = \"{}\" under [structure] in the file of --model",
                self.sentence(),
                match self.straight {
                    Some(Hold::BetweenJumps) => "between_jumps",
                    _ => "interpolated",
                }
            )
        })
    }
}

/// The time, UTC, as in `2026-01-31T23:59:59Z`.
pub fn now() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    date(since.map_or(0, |since| since.as_secs()))
}

/// The time so many seconds after 1970 began.
fn date(seconds: u64) -> String {
    let is_leap =
        |year: u64| year.is_multiple_of(400) || year.is_multiple_of(4) && !year.is_multiple_of(100);
    let (mut days, rest) = (seconds / 86_400, seconds % 86_400);
    let mut year = 1970;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let february = 28 + u64::from(is_leap(year));
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!(
        "{year:04}-{month:02}-{:02}T{hour:02}:{minute:02}:{second:02}Z",
        days + 1
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_through_leap_years() {
        for (seconds, expected) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }
}
