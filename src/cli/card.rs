//! The valve card on the terminal.

use super::table::{number, table};
use servobee::card::Figure;
use servobee::diagnose::Verdict;
use servobee::report::{Document, explain};

/// Prints the figures that have a value, and why the others have none. Conditions are in the report.
pub(super) fn print(document: &Document) {
    if document.verdict == Verdict::Unexplained {
        tell!("{}", explain::INCOMPLETE);
    }
    let (known, unknown): (Vec<&Figure>, Vec<&Figure>) = document
        .card
        .iter()
        .partition(|figure| figure.value.is_some());
    let row = |figure: &&Figure| {
        let interval = match (figure.low, figure.high) {
            (Some(low), Some(high)) => format!("{} .. {}", number(low), number(high)),
            _ => figure.no_interval.unwrap_or_default().into(),
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
    let mut reasons: Vec<&str> = Vec::new();
    for figure in &unknown {
        if !reasons.contains(&figure.note.as_str()) {
            reasons.push(&figure.note);
        }
    }
    for reason in reasons {
        let own = unknown.iter().filter(|figure| figure.note == reason);
        let labels: Vec<&str> = own.map(|figure| figure.label.as_str()).collect();
        tell!("No {}: {reason}.", labels.join(", "));
    }
    tell!();
}
