//! Pieces of Modelica: declarations, functions, and what names stand for.

use crate::model::Parameter;
use crate::model::real::trace::{Body, Language, Modelica};
use std::collections::HashMap;
use std::fmt::Write;

/// A unit with one division sign outside of parentheses: L/min/s is L/(min.s).
pub(super) fn unit_text(unit: &str) -> String {
    let parts: Vec<&str> = unit.split('/').collect();
    match &parts[..] {
        [above, below @ ..] if below.len() > 1 && !unit.contains('(') => {
            format!("{above}/({})", below.join("."))
        }
        _ => unit.to_owned(),
    }
}

/// The declaration of a parameter.
pub(super) fn parameter_text(parameter: &Parameter) -> String {
    let Parameter {
        unit, low, high, ..
    } = parameter;
    let bounds = match *low > f64::MIN {
        true => format!(", min = {low:?}, max = {high:?}"),
        false => String::new(),
    };
    let (name, unit) = (Modelica::label(parameter.name.clone()), unit_text(unit));
    let how = if parameter.is_fixed() {
        "not fitted"
    } else {
        "fitted"
    };
    format!(
        "  parameter Real {name}(unit = \"{unit}\"{bounds}) = {:?} \"{how}\";\n",
        parameter.nominal()
    )
}

/// What the names of a body stand for where it is called or written.
pub(super) struct Context(HashMap<String, String>);

impl Context {
    /// The parameters by their own names, and what `pairs` say of all else.
    pub(super) fn new(pairs: impl IntoIterator<Item = (String, String)>) -> Self {
        Self(
            pairs
                .into_iter()
                .map(|(read, text)| (Modelica::read(&read), text))
                .collect(),
        )
    }

    /// What the flat name of something read stands for.
    fn of(&self, name: &str) -> Option<String> {
        let field = || name.strip_prefix("plant_").map(String::from);
        self.0.get(name).cloned().or_else(field)
    }

    /// `text` with what its names stand for.
    pub(super) fn put(&self, text: &str) -> String {
        let mut result = String::new();
        let mut word = String::new();
        for character in text.chars().chain(['\n']) {
            if character.is_ascii_alphanumeric() || character == '_' || character == '.' {
                word.push(character);
                continue;
            }
            result += &self.of(&word).unwrap_or_else(|| word.clone());
            word.clear();
            result.push(character);
        }
        result.pop();
        result
    }

    /// A call of the function `name` with this body.
    pub(super) fn call(&self, name: &str, body: &Body) -> String {
        let arguments: Vec<String> = body
            .reads
            .iter()
            .map(|read| Modelica::read(read))
            .map(|read| self.of(&read).unwrap_or(read))
            .collect();
        format!("{name}({})", arguments.join(", "))
    }
}

/// A function with this body, what it is in one line, and whether it returns one number instead of an array.
pub(super) fn function_text(name: &str, what: &str, body: &Body, scalar: bool) -> String {
    let mut text = format!("  function {name} \"{what}\"\n");
    for read in &body.reads {
        let _ = writeln!(text, "    input Real {};", Modelica::read(read));
    }
    let count = body.results.len();
    let size = if scalar {
        String::new()
    } else {
        format!("[{count}]")
    };
    let _ = writeln!(text, "    output Real result{size};");
    if !body.locals.is_empty() {
        text += "  protected\n";
    }
    for (name, _) in &body.locals {
        let _ = writeln!(text, "    Real {name};");
    }
    text += "  algorithm\n";
    for (name, expression) in &body.locals {
        let _ = writeln!(text, "    {name} := {expression};");
    }
    for (i, expression) in body.results.iter().enumerate() {
        let place = if scalar {
            String::new()
        } else {
            format!("[{}]", i + 1)
        };
        let _ = writeln!(text, "    result{place} := {expression};");
    }
    let _ = writeln!(text, "  end {name};\n");
    text
}
