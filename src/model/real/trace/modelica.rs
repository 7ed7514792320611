//! Modelica, in `Real`.

use super::{C, Language};

/// Modelica, in `Real`.
#[derive(Debug)]
pub struct Modelica;

impl Language for Modelica {
    fn literal(value: f64) -> String {
        C::literal(value)
    }

    fn choice(value: &str, yes: &str, no: &str) -> String {
        format!("(if {value} > 0.0 then {yes} else {no})")
    }

    /// `flow` is a keyword.
    fn label(name: String) -> String {
        match name.as_str() {
            "flow" => "flow_rate".into(),
            _ => name,
        }
    }
}
