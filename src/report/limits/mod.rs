//! Limits that a valve has to keep: a file of them, and whether a result is inside.

mod judgement;
mod limit_report;
mod range;

use super::toml_text::TomlText;
use crate::Result;
use crate::card::units;
use crate::model::Structure;
use crate::model::effects::Effect;
use crate::record::conversion_between;
pub use judgement::met;
pub use limit_report::{LimitReport, Outcome};
use range::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::DeValue;

const EXAMPLE: &str = "write hysteresis = \"<= 3 %\", \">= 12 Hz\" or \"57 .. 63 L/min\"";

/// The table whose names are of parameters alone.
const PARAMETERS: &str = "parameters";

/// A file of limits that has been read: `hysteresis = "<= 3 %"`, one line for each figure of the card or parameter, and under
/// `[parameters]` those parameters that are called like a figure.
#[derive(Debug)]
pub struct Limits {
    file: TomlText,
    entries: Vec<Entry>,
}

/// A line of the file.
#[derive(Debug)]
struct Entry {
    name: String,
    span: std::ops::Range<usize>,
    is_parameter: bool,
    range: Range,
}

/// A limit of something that a report can have.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// A figure's name, or a parameter's.
    pub name: String,
    /// Whether it is of a parameter of the model.
    pub is_parameter: bool,
    /// As it was written.
    pub text: String,
    /// Unit of `lower` and `upper`: that of the figure or parameter.
    pub unit: String,
    /// What it may not be below.
    pub lower: Option<f64>,
    /// What it may not be above.
    pub upper: Option<f64>,
}

impl Limits {
    /// Reads a file of limits.
    ///
    /// # Errors
    /// The file cannot be read, is longer than 1 MiB, is no TOML, has no limit, or one that is none. Whether names and units
    /// fit shows in [`Limits::on`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::of(TomlText::read(
            path.as_ref(),
            "give a file of limits",
            EXAMPLE,
        )?)
    }

    /// [`Limits::read`] from the text of the file called `path`.
    ///
    /// # Errors
    /// As [`Limits::read`], but for those of reading the file.
    pub fn parse(path: &str, text: &str) -> Result<Self> {
        Self::of(TomlText::new(path, text, EXAMPLE))
    }

    fn of(file: TomlText) -> Result<Self> {
        let mut entries = Vec::new();
        for (key, value) in file.table()? {
            match (key.get_ref().as_ref(), value.get_ref()) {
                (PARAMETERS, DeValue::Table(table)) => {
                    for (key, value) in table {
                        entries.push(entry(&file, key, value, true)?);
                    }
                }
                _ => entries.push(entry(&file, &key, &value, false)?),
            }
        }
        if entries.is_empty() {
            return Err(file.error(0..0, "there is no limit in it", EXAMPLE));
        }
        // The reader sorts by name: a report has them as they were written.
        entries.sort_by_key(|entry| entry.span.start);
        Ok(Self { file, entries })
    }

    /// The limits on what a report can have of `structure` and the `effects` that may be added to it, in their units.
    ///
    /// # Errors
    /// A name that is of none of them; a unit that is no unit of what it names.
    pub fn on(&self, structure: &Structure, effects: &[Effect]) -> Result<Vec<Limit>> {
        let figures: Vec<(String, String)> = units(structure)
            .map(|(quantity, unit)| (quantity.to_string(), unit))
            .collect();
        let mut parameters: Vec<(String, String)> = Vec::new();
        let with = |effect: &Effect| structure.with(*effect).parameters();
        let own = structure.parameters();
        for parameter in own.into_iter().chain(effects.iter().flat_map(with)) {
            if parameters.iter().all(|(name, _)| *name != parameter.name) {
                parameters.push((parameter.name, parameter.unit));
            }
        }
        let limit = |entry: &Entry| {
            let find = |list: &[(String, String)]| {
                let found = list.iter().find(|(name, _)| *name == entry.name);
                found.map(|(_, unit)| unit.clone())
            };
            let of_card = find(&figures).filter(|_| !entry.is_parameter);
            let is_parameter = of_card.is_none();
            let unit = of_card.or_else(|| find(&parameters)).ok_or_else(|| {
                let names = |list: &[(String, String)]| {
                    let names: Vec<&str> = list.iter().map(|(name, _)| name.as_str()).collect();
                    names.join(", ")
                };
                let figures = match entry.is_parameter {
                    true => String::new(),
                    false => format!("a figure of the card ({}) or ", names(&figures)),
                };
                self.file.error(
                    entry.span.clone(),
                    format!("nothing is called {}", entry.name),
                    format!("name {figures}a parameter ({})", names(&parameters)),
                )
            })?;
            let Range { lower, upper, .. } = &entry.range;
            let own = &entry.range.unit;
            let convert = match own.as_str() {
                "" if unit == "1" => conversion_between("1", "1"),
                own => conversion_between(own, &unit),
            };
            let convert = convert.ok_or_else(|| {
                let problem = match own.as_str() {
                    "" => "the limit has no unit".into(),
                    own => format!("the limit is in {own}, and {} in {unit}", entry.name),
                };
                let remedy = format!("give it in {unit}");
                self.file.error(entry.span.clone(), problem, remedy)
            })?;
            Ok(Limit {
                name: entry.name.clone(),
                is_parameter,
                text: entry.range.text.clone(),
                lower: lower.map(&convert),
                upper: upper.map(&convert),
                unit,
            })
        };
        self.entries.iter().map(limit).collect()
    }
}

/// The limit of one line.
fn entry(
    file: &TomlText,
    key: &Spanned<std::borrow::Cow<'_, str>>,
    value: &Spanned<DeValue<'_>>,
    is_parameter: bool,
) -> Result<Entry> {
    let DeValue::String(text) = value.get_ref() else {
        let problem = format!("the limit of {} is no text", key.get_ref());
        return Err(file.error(value.span(), problem, EXAMPLE));
    };
    let range = text
        .parse()
        .map_err(|problem: String| file.error(value.span(), problem, EXAMPLE))?;
    Ok(Entry {
        name: key.get_ref().as_ref().into(),
        span: key.span(),
        is_parameter,
        range,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::CATALOGUE;

    fn on(text: &str) -> Result<Vec<Limit>> {
        let structure = Structure::actuator(10.0, "V");
        let effects: Vec<Effect> = CATALOGUE.iter().flat_map(|e| e.on(&structure)).collect();
        Limits::parse("limits.toml", text)?.on(&structure, &effects)
    }

    #[test]
    fn limits_are_in_the_units_of_what_they_limit_and_in_the_order_of_the_file() {
        let limits = on("step_time = \"<= 0.03 s\"\nhysteresis = \"<= 3 %\"\n\
             delay = \"0 .. 4 ms\"\nflow_gain = \"5 .. 7 L/min/V\"\nnull_bias = \"-2..2 %\"\n\
             [parameters]\nnull_bias = \">= -0.1V\"\n")
        .unwrap();
        let told: Vec<_> = limits
            .iter()
            .map(|one| {
                let number = |value: Option<f64>| value.map(|value| (value * 1e9).round() / 1e9);
                let Limit { name, unit, .. } = one;
                (
                    name.as_str(),
                    unit.as_str(),
                    number(one.lower),
                    number(one.upper),
                    one.is_parameter,
                )
            })
            .collect();
        assert_eq!(
            told,
            [
                ("step_time", "ms", None, Some(30.0), false),
                ("hysteresis", "%", None, Some(3.0), false),
                ("delay", "s", Some(0.0), Some(0.004), true),
                ("flow_gain", "L/min/V", Some(5.0), Some(7.0), false),
                ("null_bias", "%", Some(-2.0), Some(2.0), false),
                ("null_bias", "V", Some(-0.1), None, true),
            ]
        );
    }

    #[test]
    fn what_is_no_limit_is_refused_with_its_line_and_a_remedy() {
        for (text, part) in [
            ("", "there is no limit in it"),
            ("hysteresis = 3", "is no text"),
            ("hysteresis = \"3 %\"", "says neither"),
            ("hysteresis = \"<= 3,5 %\"", "\"3,5 %\" is no number"),
            ("hysteresis = \"<= %\"", "is no number"),
            ("hysteresis = \"<= nan %\"", "is no number"),
            ("hysteresis = \"<= 1e999 %\"", "is no number"),
            ("hysteresis = \"<= 3\"", "has no unit"),
            ("hysteresis = \"<= 3 V\"", "in V, and hysteresis in %"),
            ("rated_flow = \"9 .. 3 L/min\"", "ends before it begins"),
            ("rated_flow = \"1 bar .. 3 L/min\"", "two units"),
            ("flow_gain = \"<= 3 L/min\"", "give it in L/min/V"),
            ("hysteressis = \"<= 3 %\"", "nothing is called hysteressis"),
            (
                "[parameters]\nrated_flow = \"<= 3 L/min\"",
                "nothing is called",
            ),
            (
                "[card]\nhysteresis = \"<= 3 %\"",
                "the limit of card is no text",
            ),
            ("hysteresis = \"<= 3 %", "line 1"),
        ] {
            let text = format!("{text}\n");
            let error = on(&text).unwrap_err().to_string();
            assert!(error.starts_with("limits.toml, line "), "{error}");
            assert!(error.contains(part), "{part} is not in: {error}");
            assert!(error.contains("; "), "{error}");
        }
    }
}
