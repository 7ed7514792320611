//! The words that terminal and page explain where they first use them.

use crate::model::Structure;

/// What held-out rows are.
pub const HELD_OUT: &str =
    "Held-out rows are never fitted: what is left there shows what a result is worth.";

/// What an effect's predicted reduction is, which a reader is told as its promise, and the p beside it.
pub const PREDICTED_REDUCTION: &str = "The promise of an effect is the share of what was left on fitted rows that it could take away, \
    estimated before it is fitted; p is the chance that some effect promises as much where none is missing.";

/// What the card of a model is worth that does not explain its record.
pub const INCOMPLETE: &str = "The model lacks something that it has no name for (verdict: unexplained). These are the figures \
    of the model; how far those of the valve are from them is not known.";

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
