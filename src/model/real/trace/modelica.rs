//! Modelica, in `Real`.

use super::{C, Language};

/// Modelica, in `Real`. What is read has a flat name: `state.spool` is `state_spool`.
#[derive(Debug)]
pub struct Modelica;

impl Language for Modelica {
    fn literal(value: f64) -> String {
        C::literal(value)
    }

    fn choice(value: &str, yes: &str, no: &str) -> String {
        format!("(if {value} > 0.0 then {yes} else {no})")
    }

    fn read(expression: &str) -> String {
        expression.replace('.', "_")
    }

    /// A name that Modelica does not use itself.
    fn label(name: String) -> String {
        match name.as_str() {
            "flow" => "flow_rate".into(),
            "delay" => "dead_time".into(),
            _ => name,
        }
    }
}
