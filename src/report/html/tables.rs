//! Numbers: errors, parameters, what remains, and how it was run.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use crate::diagnose::{Conditions, Errors, Identified, Used};
use crate::report::{
    AboutLine, Document, Edition, FreeFormReport, ParameterReport, number, rounded,
};
use maud::{Markup, html};

/// Errors before and after, channel by channel.
pub(super) fn errors(identified: &Identified, edition: &Edition) -> Markup {
    let structure = &identified.after.problem.structure;
    let (before, after) = (&identified.before.errors, &identified.after.errors);
    let cell = |side: &Errors, channel: &str, factor: f64| {
        side.get(channel)
            .map_or("–".into(), |score| number(factor * score.rmse))
    };
    html! {
        div.scroll { table {
            thead {
                tr { th {} th colspan="2" { "fitted" } th colspan="3" { "held out" } th {} }
                tr {
                    th { "channel" } th.n { "before" } th.n { "after" } th.n { "before" } th.n { "after" } th.n { "fit" } th.n { "noise floor" }
                }
            }
            tbody { @for output in &structure.observed {
                @let channel = output.name();
                @let (unit, factor) = edition.units.of(structure.unit(*output));
                tr {
                    td { (channel) " [" (unit) "]" }
                    td.n { (cell(&before.fit, channel, factor)) } td.n { (cell(&after.fit, channel, factor)) }
                    td.n { (cell(&before.hold_out, channel, factor)) } td.n { (cell(&after.hold_out, channel, factor)) }
                    td.n { (after.hold_out.get(channel).and_then(|s| s.fit_percent).map_or("–".into(), |fit| format!("{fit:.2} %"))) }
                    td.n { (number(factor * identified.noise[channel].value)) }
                }
            } }
        } }
        p.note {
            "Root mean square of measured less simulated, in the channel's unit. Fit: 100 (1 − ‖e‖ / ‖y − mean y‖), 100 % "
            "where nothing is left. The noise floor is what the noise of the measurement alone leaves: no model comes below it."
        }
    }
}

/// The parameters with their intervals.
pub(super) fn parameters(parameters: &[ParameterReport], before: bool) -> Markup {
    let note = |parameter: &ParameterReport| {
        let mut notes = Vec::new();
        if parameter.at_bound {
            notes.push("at its bound");
        }
        if parameter.moved {
            notes.push("left the interval of the base model, which was wrong and sure");
        }
        notes.join(", ")
    };
    html! {
        div.scroll { table {
            thead { tr {
                th { "parameter" } th { "unit" }
                @if before { th.n { "before" } }
                th.n { "value" } th.n { "95 % interval" } th {}
            } }
            tbody { @for parameter in parameters {
                tr {
                    td translate="no" { (parameter.name) } td { (parameter.unit) }
                    @if before { td.n { (parameter.before.map_or("–".into(), number)) } }
                    td.n { (number(parameter.value)) }
                    td.n { (parameter.interval("…")) }
                    td { (note(parameter)) }
                }
            } }
        } }
    }
}

/// What is left, and what undermines the result.
pub(super) fn remaining(document: &Document, unit: &dyn Fn(&str) -> String) -> Markup {
    let remaining = &document.remaining;
    html! {
        p {
            @match (remaining.structured, remaining.correlates_with.as_slice()) {
                (false, _) => "Only noise is left.",
                (true, []) => "What is left is far above the noise floor, but follows nothing that this record shows.",
                (true, known) => { "What is left in the residual is more than noise: " (known.join(", ")) "." }
            }
        }
        (undetermined(document, unit))
        @if !document.warnings.is_empty() {
            p { "What undermines the result:" }
            ul { @for line in &document.warnings { li { (line) } } }
        }
    }
}

/// What the data do not determine, and what the integration steps leave open.
pub(super) fn undetermined(document: &Document, unit: &dyn Fn(&str) -> String) -> Markup {
    html! {
        @if !document.not_identifiable.is_empty() {
            p { "Not identifiable from this data:" }
            ul { @for line in &document.not_identifiable { li { (line) } } }
        }
        @for (channel, change) in &document.integration_error {
            p.note { "Halving the integration steps changes the " (channel) " by at most " (number(*change)) " " (unit(channel)) "." }
        }
    }
}

/// What the user says of the valve and the test.
pub(super) fn lines(about: &[AboutLine]) -> Markup {
    html! { @if !about.is_empty() {
        dl.about translate="no" { @for line in about { dt { (line.name) } dd { (line.value) } } }
    } }
}

/// Of which valve this is the report, from which files, when, and at which pressure and temperature.
pub(super) fn about(document: &Document) -> Markup {
    let Conditions {
        supply_pressure,
        return_pressure,
        temperature,
    } = document.conditions;
    let files: Vec<&str> = document
        .records
        .iter()
        .map(|one| one.path.as_str())
        .collect();
    let day = document.date.split('T').next().unwrap_or_default();
    let told = |value: f64, unit: &str| format!("{} {unit}", rounded(value, 3));
    html! {
        (lines(&document.about))
        dl.about {
            dt { "Records" } dd translate="no" { (files.join(", ")) }
            dt { "Report of" } dd { (day) }
            @if let Some(supply) = supply_pressure {
                dt { "Supply pressure" } dd {
                    (told(supply, "bar"))
                    @if let Some(back) = return_pressure { ", return " (told(back, "bar")) }
                    ", means"
                }
            }
            @if let Some(temperature) = temperature { dt { "Temperature" } dd { (told(temperature, "°C")) ", mean" } }
        }
    }
}

/// The sum of a file's content.
fn sum(sha256: &Option<String>) -> Markup {
    html! { @if let Some(sum) = sha256 { br; "SHA-256 " code { (sum) } } }
}

/// Records, and how many of their rows were used for what.
pub(super) fn records(records: &[Used]) -> Markup {
    html! {
        dl { @for record in records {
            dt { "Record" }
            dd {
                span translate="no" { (record.path) } ": " (record.rows) " rows, " (record.fitted) " fitted, " (record.held_out) " held out"
                (sum(&record.sha256))
            }
        } }
    }
}

/// What was made of which records by what: enough to do it again.
pub(super) fn run(document: &Document) -> Markup {
    html! {
        (records(&document.records))
        dl {
            dt { "Program" } dd translate="no" { (document.program.name) " " (document.program.version) }
            dt { "Arguments" } dd { code { (document.arguments.join(" ")) } }
            @for file in &document.files { dt { "File" } dd translate="no" { (file.path) (sum(&file.sha256)) } }
            @if let Some(hold) = &document.hold { dt { "Command" } dd { (hold.sentence()) } }
            dt { "Evaluator" } dd { (document.evaluator) " (" (document.evaluator_reason) ")" }
            dt { "Seed" } dd { (document.seed) }
            dt { "Evaluations" } dd { (document.evaluations) }
            dt { "Time" } dd { (document.date) ", " (format!("{:.1} s", document.seconds)) }
        }
    }
}

/// The curve that describes what no entry of the catalogue explains.
pub(super) fn free_form(form: &FreeFormReport, edition: &Edition) -> Markup {
    let points: Vec<(f64, f64)> = form
        .curve
        .iter()
        .map(|knot| (knot.signal, knot.value))
        .collect();
    let port = match &form.channel {
        Some(channel) => format!("the measured {channel}"),
        None => format!("the {} port", form.port),
    };
    let panel = Panel {
        title: format!("A curve of the {} at {port}", form.signal),
        size: (940, 260),
        x: Axis::over(
            format!("{} [{}]", form.signal, form.signal_unit),
            points.iter().map(|p| p.0),
        ),
        y: Axis::over(
            format!("added [{}]", form.unit),
            points.iter().map(|p| p.1).chain([0.0]),
        ),
        marks: vec![
            Mark::Level(Role::Text, 0.0),
            Mark::Line(Role::After, points.clone()),
            Mark::Dots(Role::After, points),
        ],
    };
    let caption = html! {
        "What is missing, without a name: what has to be added at " (port) " for each value of the " (form.signal) ". Straight "
        "between the knots, constant beyond them."
    };
    figure(
        "free-form",
        edition,
        &[panel],
        legend(&[(Role::After, Key::Line, "what is added")]),
        &caption,
    )
}
