//! The valve card on the terminal.

use super::table::{number, table};
use servobee::card::Figure;

/// Prints the figures that have a value, and why the others have none. Conditions are in the report.
pub(super) fn print(figures: &[Figure]) {
    let (known, unknown): (Vec<&Figure>, Vec<&Figure>) =
        figures.iter().partition(|figure| figure.value.is_some());
    let row = |figure: &&Figure| {
        let interval = match (figure.low, figure.high) {
            (Some(0.0), Some(0.0)) => "the model has none".into(),
            (Some(low), Some(high)) => format!("{} .. {}", number(low), number(high)),
            _ => "not determined".into(),
        };
        vec![
            figure.label.clone(),
            figure.unit.clone(),
            figure.value.map_or("-".into(), number),
            interval,
        ]
    };
    let head = ["valve card", "unit", "value", "95 % interval"];
    tell!("{}", table(&head, known.iter().map(row)));
    let mut reasons: Vec<&str> = unknown.iter().map(|figure| figure.note.as_str()).collect();
    reasons.dedup();
    for reason in reasons {
        let own = unknown.iter().filter(|figure| figure.note == reason);
        let labels: Vec<&str> = own.map(|figure| figure.label.as_str()).collect();
        tell!("No {}: {reason}.", labels.join(", "));
    }
    tell!();
}
