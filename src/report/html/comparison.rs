//! The page of a comparison: what changed, what did not, and the curves of both sides.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::page::{section, whole};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::words::capitalised;
use super::{card, tables};
use crate::card::{Card, Response};
use crate::compare::{Change, Comparison, Estimate, Fate, Outcome};
use crate::report::{ComparisonDocument, Edition, met, number};
use maud::{Markup, html};

/// The page of a comparison. The reports of both sides alone are `before.html` and `after.html` beside it.
pub fn comparison_page(
    comparison: &Comparison,
    document: &ComparisonDocument,
    edition: &Edition,
) -> String {
    let document = &document.in_units(&edition.units);
    let lead = html! {
        h1 { (capitalised(&document.answer)) }
        (tables::lines(&document.about))
        p { "One model was fitted to what was measured " a href="before.html" { "before" } " and " a href="after.html" { "after" }
            ". All differences together are tested as one family: the chance that anything at all is said to have changed where "
            "nothing has is 5 %." }
        @for one in &document.confounded { p { b { "Mind" } ": " (one.sentence) "." } }
    };
    let content = html! {
        (section("changed", "What changed", changes(document, Outcome::Changed, "Nothing changed that these records show.")))
        (section("effects", "Effects", effects(document)))
        @if !document.limits.is_empty() {
            (section("limits", &format!("Limits: {} of {} are met after", met(&document.limits), document.limits.len()),
                card::limits(&document.limits)))
        }
        (section("curves", "The valve before and after", curves(comparison, edition)))
        (section("unchanged", "What did not change", html! {
            (changes(document, Outcome::NotChanged, "Everything changed."))
            p.note { "The interval of the difference says by how much each can have changed without being seen." }
        }))
        @if document.with(Outcome::NotDetermined).next().is_some() {
            (section("undetermined", "What these records do not tell",
                changes(document, Outcome::NotDetermined, "")))
        }
        @if !document.warnings.is_empty() {
            (section("remaining", "What undermines the result", html! {
                ul { @for line in &document.warnings { li { (line) } } }
            }))
        }
        (section("run", "How it was run", html! {
            @for (title, side) in [("Before", &document.before), ("After", &document.after)] {
                p { b { (title) } }
                (tables::records(&side.records))
            }
            dl {
                dt { "Program" } dd translate="no" { (document.program.name) " " (document.program.version) }
                dt { "Arguments" } dd { code { (document.arguments.join(" ")) } }
                dt { "Evaluator" } dd { (document.evaluator) }
                dt { "Seed" } dd { (document.seed) }
                dt { "Time" } dd { (document.date) ", " (format!("{:.1} s", document.seconds)) }
            }
        }))
    };
    whole(edition, "before and after – servobee", &lead, &content)
}

/// A table of those changes that came out like that.
fn changes(document: &ComparisonDocument, outcome: Outcome, none: &str) -> Markup {
    let rows: Vec<&Change> = document.with(outcome).collect();
    if rows.is_empty() {
        return html! { p { (none) } };
    }
    let within = |value: f64, low: Option<f64>, high: Option<f64>| {
        html! {
            (number(value))
            @if let (Some(low), Some(high)) = (low, high) { br; span.note { (number(low)) " … " (number(high)) } }
        }
    };
    let estimate = |one: &Estimate| within(one.value, one.low, one.high);
    html! {
        div.scroll { table {
            thead { tr {
                th {} th { "unit" } th.n { "before" } th.n { "after" } th.n { "difference" } th.n { "p" }
            } }
            tbody { @for one in rows { tr {
                td { (one.label.replace('_', " ")) br; span.note { (one.of) } } td { (one.unit) }
                td.n { (estimate(&one.before)) } td.n { (estimate(&one.after)) }
                td.n { (within(one.difference, one.low, one.high)) }
                td.n { (one.p_value.map_or("–".into(), |p| format!("{p:.3}"))) }
            } } }
        } }
        p.note { "Below each value its 95 % interval; p is the chance of such a difference where nothing has changed." }
    }
}

/// What became of each effect.
fn effects(document: &ComparisonDocument) -> Markup {
    if document.effects.is_empty() {
        return html! { p { "Neither side lacks an effect: the base model follows both." } };
    }
    let yes = |found: bool| if found { "yes" } else { "no" };
    html! {
        div.scroll { table {
            thead { tr { th { "effect" } th { "acts at" } th { "found before" } th { "found after" } th { "outcome" } } }
            tbody { @for one in &document.effects { tr {
                td {
                    (one.name.replace('_', " "))
                    @for other in &one.tied_with { br; span.note { "or " (other.replace('_', " ")) } }
                }
                td { (one.port) }
                td { (yes(one.found_before)) } td { (yes(one.found_after)) }
                td { @match one.fate {
                    Fate::Came => b { "came" },
                    Fate::Went => b { "went" },
                    Fate::Changed => b { "changed" },
                    Fate::Stayed => "no change beyond chance"
                } }
            } } }
        } }
    }
}

/// The slow cycles and the frequency responses of both sides.
fn curves(comparison: &Comparison, edition: &Edition) -> Markup {
    let [before, after] = &comparison.cards;
    let cycle = |card: &Card| -> Vec<(f64, f64)> {
        let both = card.cycle.rising.iter().chain(&card.cycle.falling);
        both.map(|&[x, y]| (x, y)).collect()
    };
    let (old, new) = (cycle(before), cycle(after));
    let structure = &comparison.structure;
    let (output, unit) = match structure.valve() {
        Some(_) => ("flow", "L/min"),
        None => ("spool", structure.command_unit.as_str()),
    };
    let panel = |title: &str, (width, x, y): (u32, Axis, Axis), lines: [Vec<(f64, f64)>; 2]| {
        let [old, new] = lines;
        Panel {
            title: title.into(),
            size: (width, 300),
            x,
            y,
            marks: vec![Mark::Line(Role::Before, old), Mark::Line(Role::After, new)],
        }
    };
    let x = Axis::over(
        format!("command [{}]", structure.command_unit),
        old.iter().chain(&new).map(|p| p.0),
    );
    let y = Axis::over(
        format!("{output} [{unit}]"),
        old.iter().chain(&new).map(|p| p.1),
    );
    let mut panels = vec![panel("Slow cycle", (940, x, y), [old, new])];
    for (title, label, of) in [("Gain", "gain [dB]", 0), ("Phase", "phase [deg]", 1)] {
        let line = |card: &Card| -> Vec<(f64, f64)> {
            let points = |response: &Response| response.points.clone();
            let smallest = card.responses.first().map(points).unwrap_or_default();
            let value = |point: &crate::card::Point| match of {
                0 => point.gain,
                _ => point.phase,
            };
            smallest
                .iter()
                .map(|point| (point.frequency, value(point)))
                .collect()
        };
        let (old, new) = (line(before), line(after));
        if old.is_empty() || new.is_empty() {
            continue;
        }
        let x = Axis::log("frequency [Hz]", old.iter().chain(&new).map(|p| p.0));
        let y = Axis::over(label, old.iter().chain(&new).map(|p| p.1));
        let amplitude = before.responses[0].amplitude;
        let title = format!("{title} at {amplitude} % amplitude");
        panels.push(panel(&title, (460, x, y), [old, new]));
    }
    let entries = [
        (Role::Before, Key::Line, "before"),
        (Role::After, Key::Line, "after"),
    ];
    let caption = html! {
        "The model of each side on the same simulated bench: the slow cycle over full command, and the response to sines."
    };
    figure("before-after", edition, &panels, legend(&entries), &caption)
}
