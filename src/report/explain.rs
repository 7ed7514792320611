//! The words that terminal and page explain where they first use them.

use crate::diagnose::Verdict;
use crate::model::Structure;

/// What held-out rows are.
pub const HELD_OUT: &str = "Held-out rows are not fitted: what is left there shows what a result is worth. Where they had to set \
    what the fitted rows leave open, a warning says so.";

/// What errors are, and what a residual is.
pub const RESIDUAL: &str = "Errors are RMS, the root of the mean square of measured less simulated; what is left of a measurement like \
    that is its residual.";

/// What an effect's predicted reduction is, which a reader is told as its promise, and the p beside it.
pub const PREDICTED_REDUCTION: &str = "The promise of an effect is the share of what was left on fitted rows that it could take away, \
    estimated before it is fitted; p is the chance that some effect promises as much where none is missing.";

/// What the card of a model is worth that does not explain its whole record.
pub fn worth_of_card(verdict: Verdict) -> Option<&'static str> {
    match verdict {
        Verdict::Unexplained => Some(INCOMPLETE),
        Verdict::Partly => Some(IN_PART),
        _ => None,
    }
}

/// What the card of a model is worth that does not explain its record.
const INCOMPLETE: &str = "The model lacks something that it has no name for (verdict: unexplained). These are the figures \
    of the model; how far those of the valve are from them is not known.";

/// What the card of a model is worth that explains most of its record, not all.
const IN_PART: &str = "The model lacks something beside what was named (verdict: partly). These are the figures of the \
    model; how far those of the valve are from them is not known.";

/// What the base model of this `structure` consists of.
pub fn base_model(structure: &Structure) -> String {
    let parts = structure.base_parts().into_iter();
    let mut parts: Vec<String> = parts.map(String::from).collect();
    let known: Vec<String> = structure.effects.iter().map(ToString::to_string).collect();
    if !known.is_empty() {
        parts.push(format!(
            "what the model file says is known ({})",
            known.join(", ")
        ));
    }
    format!(
        "The base model is {}: everything but the effects that may be missing.",
        parts.join(", and ")
    )
}

/// The equations of the base model of this `structure`, with the names of its parameters.
pub fn base_equations(structure: &Structure) -> Vec<&'static str> {
    let names: Vec<String> = structure
        .parameters()
        .into_iter()
        .map(|parameter| parameter.name)
        .collect();
    let has = |name: &str| names.iter().any(|own| own == name);
    EQUATIONS
        .iter()
        .filter(|(needs, _)| has(needs))
        .map(|(_, equation)| *equation)
        .collect()
}

/// The equations of the servo valve, each with the parameter without which it is not there.
const EQUATIONS: &[(&str, &str)] = &[
    (
        "gain",
        "dz/dt = gain · sat(u − x, ± saturation): the amplifier drives the spool with the error between command u and spool x, \
         which is cut off at the saturation",
    ),
    (
        "time_constant",
        "dx/dt = (z − x) / time_constant: the spool follows with a lag",
    ),
    (
        "discharge_coefficient",
        "q = discharge_coefficient · A(h) · √(2 Δp / density): each metering edge passes a flow that grows with its area A at the \
         opening h and with the root of the pressure drop Δp across it",
    ),
    (
        "max_area",
        "A(h) = max_area · h / 100 % for h > 0, and leakage_area at least",
    ),
    (
        "piston_area",
        "dy/dt = Q / piston_area: the flow Q moves the piston at y",
    ),
];

/// What each parameter of the servo valve means.
const MEANINGS: &[(&str, &str)] = &[
    (
        "gain",
        "gain of the loop that moves the spool: the higher, the faster",
    ),
    ("time_constant", "lag of the spool behind its drive"),
    (
        "saturation",
        "error at which the drive is at its limit: it sets the highest speed of the spool",
    ),
    (
        "initial_spool",
        "where the spool stands when the record begins",
    ),
    (
        "spool_gain",
        "reading of the spool's transducer for each unit of command",
    ),
    ("position_gain", "piston position for each unit of command"),
    ("position_zero", "piston position at zero command"),
    (
        "discharge_coefficient",
        "share of the ideal flow that an edge passes; only its product with the area can be measured",
    ),
    ("density", "density of the oil"),
    ("viscosity", "viscosity of the oil"),
    ("leakage_area", "area that a closed edge still has"),
    (
        "opening_offset",
        "opening of all edges at the spool's zero: below zero they overlap",
    ),
    (
        "rated_drop",
        "pressure drop from P to T at which the flow was measured",
    ),
    ("max_area", "area of an edge at full opening"),
    ("piston_area", "area of the piston that the flow fills"),
];

/// What a parameter of the base model means; nothing where it is an effect's or a base model's of one's own.
pub fn meaning(name: &str) -> Option<&'static str> {
    let known = MEANINGS.iter().find(|(own, _)| *own == name);
    let table = || {
        name.starts_with("area_")
            .then_some("area of an edge at this opening of the table")
    };
    known.map(|(_, meaning)| *meaning).or_else(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::valve::ValveForm;
    use crate::model::{Initial, Output, ServoValve};

    #[test]
    fn every_parameter_of_the_base_model_has_a_meaning_and_is_in_an_equation_that_names_it() {
        let structure = Structure {
            observed: Output::ALL.into(),
            initial: Initial::Free,
            base: ServoValve::with(ValveForm::linear()).into(),
            ..Structure::actuator(10.0, "V")
        };
        let parameters = structure.parameters();
        assert!(parameters.len() > 8);
        for parameter in &parameters {
            assert!(meaning(&parameter.name).is_some(), "{}", parameter.name);
        }
        let equations = base_equations(&structure).join("; ");
        for (name, _) in EQUATIONS {
            assert!(equations.contains(name), "{name}");
        }
        let spool = base_equations(&Structure::actuator(10.0, "V"));
        assert_eq!(spool.len(), 2);
    }
}
