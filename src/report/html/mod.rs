//! `report.html`: one file that shows the answer and everything it stands on. It needs no script and nothing beside it.

mod axis;
mod card;
mod convergence;
mod datasheet;
mod figure;
mod plot;
mod ranking;
mod rows;
mod signature;
mod spectrum;
mod tables;
mod time;
mod words;

use super::{Document, explain};
use crate::card::Card;
use crate::diagnose::{Identified, Verdict};
use crate::model::Output;
pub use datasheet::datasheet_page;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use rows::Rows;

const STYLE: &str = include_str!("style.css");

/// The page of a diagnosis.
pub fn page(identified: &Identified, document: &Document, card: &Card) -> String {
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
        (section("card", "The valve", card::all(card, &document.card, identified)))
        (section("time", "Measured and simulated", html! {
            @for (output, rows) in &channels { (time::over_time(identified, *output, rows)) }
            (tables::errors(identified))
        }))
        (section("residual", "What is left over", html! {
            @for (output, rows) in &channels { (time::residuals(identified, *output, rows)) }
        }))
        (section("signatures", match identified.verdict {
            Verdict::Found => "What gave it away",
            Verdict::None | Verdict::NotDiagnosed => "What the residual depends on",
            Verdict::Unexplained => "What is missing",
        }, html! {
            @for figure in signature::all(identified) { (figure) }
            @if let Some(form) = &document.free_form { (tables::free_form(form)) }
        }))
        (section("spectrum", "Over frequency", html! {
            @for (output, rows) in &channels { (spectrum::of(identified, *output, rows)) }
        }))
        (section("effects", "Every effect that was looked at", html! {
            @for figure in ranking::all(identified) { (figure) }
        }))
        (section("parameters", "Parameters", tables::parameters(&document.parameters, changed)))
        (section("search", "Search", convergence::of(identified)))
        (section("remaining", "What remains", tables::remaining(document, &unit)))
        (section("run", "How it was run", tables::run(document)))
    };
    let lead = html! {
        @match &document.cut_short {
            None => h1 { (words::answer(identified)) },
            Some(cut) => { h1 { "Cut short: there is no verdict." } p.lead { (cut.sentence()) } }
        }
        p.lead { (words::errors(identified)) }
        p.note { (explain::base_model(&identified.before.problem.structure)) " " (explain::HELD_OUT) }
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
    whole(&format!("{name} – servobee"), &lead, &content)
}

/// The page around its content.
fn whole(title: &str, lead: &Markup, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { header { (lead) } (content) } }
        }
    };
    page.into_string()
}

fn section(id: &str, title: &str, content: Markup) -> Markup {
    html! { section id=(id) { h2 { (title) } (content) } }
}
