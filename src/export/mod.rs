//! Formats out: a fitted model for other tools, from the same physics as the simulation.

pub mod c;
pub mod fmu;
mod format;
pub mod modelica;
pub mod simscape;
mod variable;

pub use format::Format;
pub use variable::{Input, inputs};

use crate::model::{Parameter, Structure};

/// What is exported: a structure with the values of its parameters.
#[derive(Debug, Clone)]
pub struct Model {
    /// Its name, a word: letters, digits and underscores, no digit first.
    pub name: String,
    /// Which parts it has.
    pub structure: Structure,
    /// All its parameters in the order of [`Structure::parameters`]; their values are the start values, and their bounds
    /// decide how long integration steps are.
    pub parameters: Vec<Parameter>,
}

impl Model {
    /// The model called `name`, of which characters that no name of a program has become underscores.
    pub fn new(name: &str, structure: Structure, parameters: Vec<Parameter>) -> Self {
        let mut word: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .collect();
        if !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            word.insert_str(0, "model_");
        }
        Self {
            name: word,
            structure,
            parameters,
        }
    }

    /// The parameters, and where a piston's position is integrated where that begins.
    pub fn settings(&self) -> Vec<Parameter> {
        let mut list = self.parameters.clone();
        if self.structure.integrates_position() {
            list.push(Parameter::linear(
                "initial_position",
                "mm",
                f64::MIN,
                0.0,
                f64::MAX,
            ));
        }
        list
    }

    /// What the model is, in one line.
    pub fn summary(&self) -> String {
        let names: Vec<String> = self
            .structure
            .effects
            .iter()
            .map(ToString::to_string)
            .collect();
        let effects = match names.is_empty() {
            true => String::new(),
            false => format!(" with {}", names.join(", ")),
        };
        format!("Electro-hydraulic servo valve{effects}, fitted by servobee")
    }
}
