//! The valve card on the terminal.

use super::colour;
use super::table::{number, table};
use servobee::card::Figure;
use servobee::report::{Document, LimitReport, Units, explain, met};

/// Prints the figures that the model or a measurement gives, by which tests they were measured, and why there are no others.
/// Conditions are in the report. Numbers are in the `units` of the document, and so are those of sentences.
pub(super) fn print(document: &Document, units: &Units) {
    if let Some(worth) = explain::worth_of_card(document.verdict) {
        tell!("{worth}");
    }
    let figures = &document.card;
    let measured = figures.iter().any(|figure| figure.measured.is_some());
    let known = figures
        .iter()
        .filter(|figure| figure.value.is_some() || figure.measured.is_some());
    let row = |figure: &Figure| {
        let interval = match (figure.low, figure.high) {
            (Some(low), Some(high)) => format!("{} .. {}", number(low), number(high)),
            _ => figure.no_interval.unwrap_or_default().into(),
        };
        let mut cells = vec![
            units.text(&figure.label),
            figure.unit.clone(),
            figure.value.map_or("-".into(), number),
            interval,
        ];
        if measured {
            cells.extend(match &figure.measured {
                None => ["-".into(), String::new()],
                Some(one) => [
                    number(one.value),
                    format!("{} .. {}", number(one.low), number(one.high)),
                ],
            });
        }
        cells
    };
    let mut heads = vec!["valve card", "unit", "value", "95 % interval"];
    if measured {
        heads[2] = "model";
        heads.extend(["measured", "95 % interval"]);
    }
    tell!("{}", table(&heads, known.map(row)));
    for (reason, labels) in grouped(figures, |figure| {
        figure.value.is_none().then_some(figure.note.as_str())
    }) {
        tell!("{}", units.text(&format!("No {labels}: {reason}.")));
    }
    for (test, labels) in grouped(figures, |figure| {
        figure.measured.as_ref().map(|one| one.test.as_str())
    }) {
        tell!("{}", units.text(&format!("Measured by {test}: {labels}.")));
    }
    if !document.records.is_empty() {
        for (reason, labels) in grouped(figures, |figure| figure.no_measured.as_deref()) {
            tell!(
                "{}",
                units.text(&format!("Not measured: {labels}: {reason}."))
            );
        }
    }
    tell!();
}

/// Prints which limits are met, if there are any.
pub(super) fn print_limits(limits: &[LimitReport], units: &Units) {
    if limits.is_empty() {
        return;
    }
    let (met, all) = (met(limits), limits.len());
    colour::answer(format_args!("{met} of {all} limits are met."));
    let row = |one: &LimitReport| {
        let interval = match (one.low, one.high) {
            (Some(low), Some(high)) => format!("{} .. {}", number(low), number(high)),
            _ => String::new(),
        };
        vec![
            one.name.clone(),
            units.text(&one.limit),
            one.unit.clone(),
            one.value.map_or("-".into(), number),
            interval,
            one.from.unwrap_or("-").into(),
            one.outcome.words().into(),
        ]
    };
    let heads = [
        "limit",
        "",
        "unit",
        "value",
        "95 % interval",
        "from",
        "outcome",
    ];
    tell!("{}", table(&heads, limits.iter().map(row)));
    for one in limits {
        if let Some(reason) = &one.reason {
            tell!("Not determined: {}: {}.", one.name, units.text(reason));
        }
    }
    tell!();
}

/// What `of` says of figures, each text once, and the labels of those that it says it of.
fn grouped<'f>(
    figures: &'f [Figure],
    of: impl Fn(&'f Figure) -> Option<&'f str>,
) -> Vec<(&'f str, String)> {
    let mut groups: Vec<(&str, String)> = Vec::new();
    for figure in figures {
        let Some(text) = of(figure) else { continue };
        match groups.iter_mut().find(|(own, _)| *own == text) {
            Some((_, labels)) => *labels += &format!(", {}", figure.label),
            None => groups.push((text, figure.label.clone())),
        }
    }
    groups
}
