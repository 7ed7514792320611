//! The page of a diagnosis.

use super::page::{section, whole};
use super::rows::Rows;
use super::{card, convergence, model, ranking, signature, spectrum, tables, time, words};
use crate::card::Card;
use crate::diagnose::{Identified, Verdict};
use crate::model::Output;
use crate::report::{Document, Edition, explain, located, met};
use maud::html;

/// The page of a diagnosis, for this `edition`.
pub fn page(
    identified: &Identified,
    document: &Document,
    card: &Card,
    edition: &Edition,
) -> String {
    let units = &edition.units;
    let document = &document.in_units(units);
    let observed = &identified.after.problem.structure.observed;
    let channels: Vec<_> = observed
        .iter()
        .map(|&output| (output, Rows::new(identified, output)))
        .collect();
    let changed = identified.changed();
    let unit = |channel: &str| {
        let known = observed.iter().find(|output| output.name() == channel);
        let unit = |output: &Output| identified.after.problem.structure.unit(*output).to_owned();
        known.map_or(String::new(), unit)
    };
    let content = html! {
        (section("card", "The valve", card::all(card, &document.card, identified, edition)))
        @if !document.limits.is_empty() {
            (section("limits", &format!("Limits: {} of {} are met", met(&document.limits), document.limits.len()),
                card::limits(&document.limits)))
        }
        (section("time", "Measured and simulated", html! {
            @for (output, rows) in &channels { (time::over_time(identified, *output, rows, edition)) }
            (tables::errors(identified, edition))
        }))
        (section("residual", "What is left over", html! {
            @for (output, rows) in &channels { (time::residuals(identified, *output, rows, edition)) }
        }))
        (section("signatures", match identified.verdict {
            Verdict::Found | Verdict::Partly => "What gave it away",
            Verdict::None | Verdict::NotDiagnosed => "What the residual depends on",
            Verdict::Unexplained => "What is missing",
        }, html! {
            @if let Some(located) = located(identified) { p { (located) } }
            @for figure in signature::all(identified, edition) { (figure) }
            @if let Some(form) = &document.free_form { (tables::free_form(form, edition)) }
        }))
        (section("spectrum", "Over frequency", html! {
            @for (output, rows) in &channels { (spectrum::of(identified, *output, rows, edition)) }
        }))
        (section("effects", "Every effect that was looked at", html! {
            @for figure in ranking::all(identified, edition) { (figure) }
        }))
        (section("parameters", "Parameters", tables::parameters(&document.parameters, changed)))
        (section("model", "The model in equations", model::of(&identified.after.problem.structure, &document.parameters)))
        (section("search", "Search", convergence::of(identified, edition)))
        (section("remaining", "What remains", tables::remaining(document, &unit)))
        (section("run", "How it was run", tables::run(document)))
    };
    let lead = html! {
        @match &document.cut_short {
            None => h1 { (words::answer(identified)) },
            Some(cut) => { h1 { "Cut short: there is no verdict." } p.lead { (cut.sentence()) } }
        }
        (tables::about(document))
        p.lead { (words::errors(identified)) }
        @for remark in &document.bench { p { b { "Bench" } ": " (remark) "." } }
        p.note { (explain::base_model(&identified.before.problem.structure)) " " (explain::HELD_OUT) " " (explain::RESIDUAL) }
        @if let Some(form) = &document.free_form { p { (words::correction(form)) } }
        @if let Some(fell) = &document.error.improvement.hold_out {
            p {
                (format!("The held-out error fell by {:.1} % (95 % interval {:.1} … {:.1} %)", fell.percent, fell.low, fell.high))
                @if let Some(explained) = document.explained {
                    (format!("; {:.0} % of what was above the noise is explained", 100.0 * explained))
                }
                "."
            }
        }
        @for added in &identified.added {
            p { b { (words::spoken(added.effect)) } ": " (added.effect.entry.summary) ". It shows as " (added.effect.entry.shows) "." }
        }
    };
    let name = identified
        .measurements
        .fit
        .first()
        .map_or("", |record| &record.name);
    whole(edition, &format!("{name} – servobee"), &lead, &content)
}
