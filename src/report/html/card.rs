//! The valve as a datasheet shows it: figures, flow curve, frequency response, step.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::rows::Rows;
use super::words::capitalised;
use crate::card::{Card, Figure, Point, Quantity, Response, Step};
use crate::diagnose::Identified;
use crate::model::Output;
use crate::record::joined;
use crate::report::{Edition, LimitReport, explain, rounded};
use maud::{Markup, html};

/// Most measured rows that are drawn.
const ROWS: usize = 1500;
/// The styles of the amplitudes.
const ROLES: [Role; 3] = [Role::First, Role::Second, Role::Third];

/// Everything that the card has.
pub(super) fn all(
    card: &Card,
    figures: &[Figure],
    identified: &Identified,
    edition: &Edition,
) -> Markup {
    html! {
        @if let Some(worth) = explain::worth_of_card(identified.verdict) { p { (worth) } }
        (table(figures))
        (flow_curve(card, figures, identified, edition))
        (bode(card, figures, edition))
        @if let Some(step) = &card.step { (of_step(step, edition)) }
    }
}

/// The table of figures: those of the model, and beside them the measured ones where there are any.
pub(super) fn table(figures: &[Figure]) -> Markup {
    let measured = figures.iter().any(|figure| figure.measured.is_some());
    html! {
        div.scroll { table {
            thead { tr {
                th { "figure" } th { "unit" } th.n { "model" } th.n { "95 % interval" }
                @if measured { th.n { "measured" } th.n { "95 % interval" } }
                th { "conditions" @if measured { " and test" } }
            } }
            tbody { @for figure in figures {
                tr {
                    td { (figure.label) } td { (figure.unit) }
                    td.n { (figure.value.map_or("–".into(), shown)) }
                    td.n {
                        @if let (Some(low), Some(high)) = (figure.low, figure.high) { (shown(low)) " … " (shown(high)) }
                        @else if let Some(reason) = figure.no_interval { span.reason { (reason) } }
                    }
                    @if measured {
                        @if let Some(one) = &figure.measured {
                            td.n { @if figure.disagrees() { b { (shown(one.value)) } } @else { (shown(one.value)) } }
                            td.n { (shown(one.low)) " … " (shown(one.high)) }
                        } @else { td.n { "–" } td.n {} }
                    }
                    td.wrap { (figure.note) @if measured { (by_which_test(figure)) } }
                }
            } }
        } }
        p.note {
            "Read off the fitted model on a simulated bench, in the terms of ISO 10770-1, without what only the sensors add. "
            "A 95 % interval holds the true value in 95 of 100 such records, if the model lacks nothing."
        }
        p.note {
            @if measured {
                "Measured: read off the records' own curves by the same constructions, without the model, with what the sensors "
                "add. Bold where it differs from the model's by more than both intervals."
            } @else { "Nothing is read off the measured curves: " (reasons(figures)) "." }
        }
    }
}

/// Which limits are met.
pub(super) fn limits(limits: &[LimitReport]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr {
                th { "limit" } th {} th { "unit" } th.n { "value" } th.n { "95 % interval" } th { "from" } th { "outcome" }
            } }
            tbody { @for one in limits {
                tr {
                    td translate="no" { (one.name) } td { (one.limit) } td { (one.unit) }
                    td.n { (one.value.map_or("–".into(), shown)) }
                    td.n { @if let (Some(low), Some(high)) = (one.low, one.high) { (shown(low)) " … " (shown(high)) } }
                    td { (one.from.unwrap_or("–")) }
                    td.wrap { b { (one.outcome.words()) } @if let Some(reason) = &one.reason { ": " (reason) } }
                }
            } }
        } }
        p.note {
            "A limit is met where the whole 95 % interval is inside it, and missed where the whole interval is outside. "
            "Otherwise it is not determined: a longer or livelier record makes the interval smaller."
        }
    }
}

/// The test that a figure was measured by, or why there is none, in a line of its own.
fn by_which_test(figure: &Figure) -> Markup {
    let text = match (&figure.measured, &figure.no_measured) {
        (Some(one), _) => format!("measured by {}", one.test),
        (None, Some(reason)) => format!("not measured: {reason}"),
        (None, None) => return html! {},
    };
    html! { @if !figure.note.is_empty() { br; } span.note { (text) } }
}

/// Why nothing was measured.
fn reasons(figures: &[Figure]) -> String {
    let mut all: Vec<String> = figures
        .iter()
        .filter_map(|figure| figure.no_measured.clone())
        .collect();
    let mut before = Vec::new();
    all.retain(|reason| {
        let new = !before.contains(reason);
        before.push(reason.clone());
        new
    });
    all.join("; ")
}

/// A figure to four digits; what rounding left of zero is zero.
fn shown(value: f64) -> String {
    if value.abs() < 1e-5 {
        "0".into()
    } else {
        rounded(value, 4)
    }
}

/// The slow cycle, beside the flow as it was measured at the spool's positions.
fn flow_curve(
    card: &Card,
    figures: &[Figure],
    identified: &Identified,
    edition: &Edition,
) -> Markup {
    let structure = &identified.after.problem.structure;
    let flows = structure.valve().is_some();
    let unit = if flows {
        "L/min"
    } else {
        structure.command_unit.as_str()
    };
    let points = |branch: &[[f64; 2]]| branch.iter().map(|&[x, y]| (x, y)).collect::<Vec<_>>();
    let (falling, rising) = (points(&card.cycle.falling), points(&card.cycle.rising));
    // A spool in a unit of its own is no curve over this axis.
    let own = card
        .measured
        .as_ref()
        .filter(|_| flows || structure.spool_unit().is_none());
    let swept: Vec<Vec<(f64, f64)>> = match own.and_then(|one| one.cycle.as_ref()) {
        Some(cycle) => vec![points(&cycle.falling), points(&cycle.rising)],
        None => Vec::new(),
    };
    let measured = if flows {
        measured(identified)
    } else {
        Vec::new()
    };
    let both = || falling.iter().chain(&rising);
    let rated = figures
        .iter()
        .find(|one| one.quantity == Quantity::RatedFlow);
    let title = match rated.and_then(|one| Some((one, one.value?))) {
        Some((one, flow)) => format!(
            "{}: {} {}",
            capitalised(&one.label),
            rounded(flow, 3),
            one.unit
        ),
        None => "At rest for every command".into(),
    };
    let panel = Panel {
        title,
        size: (940, 320),
        x: Axis::over(
            format!("command [{}]", structure.command_unit),
            both().map(|p| p.0),
        ),
        y: Axis::over(
            format!("{} [{unit}]", if flows { "flow" } else { "spool" }),
            both()
                .chain(&measured)
                .chain(swept.iter().flatten())
                .map(|p| p.1),
        ),
        marks: [Mark::Specks(Role::Measured, measured.clone())]
            .into_iter()
            .chain(
                swept
                    .iter()
                    .map(|branch| Mark::Line(Role::Measured, branch.clone())),
            )
            .chain([
                Mark::Line(Role::Before, falling.clone()),
                Mark::Line(Role::After, rising.clone()),
            ])
            .collect(),
    };
    let mut entries = vec![
        (Role::After, Key::Line, "model, rising"),
        (Role::Before, Key::Line, "model, falling"),
    ];
    if !swept.is_empty() {
        entries.push((Role::Measured, Key::Line, "measured slow cycle"));
    }
    if !measured.is_empty() {
        entries.push((Role::Measured, Key::Dot, "measured flow over spool"));
    }
    let caption = html! {
        @if flows { "The flow at rest for every command, at the bench's pressure drop. " }
        @else { "Where the spool stands for every command; the record shows no flow. " }
        "The two branches part where the valve has hysteresis. "
        @if !measured.is_empty() {
            "The dots are measured rows, at the pressures and in the motion of the record: they lie on the curve where the valve "
            "moves slowly at the bench's pressure drop."
        }
    };
    figure("flow-curve", edition, &[panel], legend(&entries), &caption)
}

/// Rows of measured flow over the spool, measured where it is and simulated otherwise; none where the spool has a unit of its
/// own.
fn measured(identified: &Identified) -> Vec<(f64, f64)> {
    let structure = &identified.after.problem.structure;
    if !structure.observes(Output::Flow)
        || !structure.observes(Output::Spool)
        || structure.spool_unit().is_some()
    {
        return Vec::new();
    }
    let [spool, flow] =
        [Output::Spool, Output::Flow].map(|output| Rows::new(identified, output).measured);
    let every = spool.len().div_ceil(ROWS).max(1);
    spool.into_iter().zip(flow).step_by(every).collect()
}

fn bode(card: &Card, figures: &[Figure], edition: &Edition) -> Markup {
    let responses: &[Response] = &card.responses;
    let measured: Vec<Point> = match &card.measured {
        Some(own) => own
            .responses
            .iter()
            .flat_map(|one| &one.1)
            .copied()
            .collect(),
        None => Vec::new(),
    };
    if responses.is_empty() {
        let caption =
            html! { "Nothing in this model moves the spool: there is no frequency response." };
        return figure("bode", edition, &[], html! {}, &caption);
    }
    let panel = |title: String, label: &str, limit: f64, of: fn(&Point) -> f64| {
        let modelled = responses.iter().flat_map(|response| &response.points);
        let points = || modelled.clone().chain(&measured);
        let dots = measured.iter().map(|point| (point.frequency, of(point)));
        let mut marks = vec![Mark::Level(Role::Text, limit)];
        marks.extend(responses.iter().zip(ROLES).map(|(response, role)| {
            let line = response
                .points
                .iter()
                .map(|point| (point.frequency, of(point)));
            Mark::Line(role, line.collect())
        }));
        marks.push(Mark::Specks(Role::Measured, dots.collect()));
        Panel {
            title,
            size: (460, 280),
            x: Axis::log("frequency [Hz]", points().map(|point| point.frequency)),
            y: Axis::over(label, points().map(of).chain([limit, 0.0])),
            marks,
        }
    };
    let limits = |limit: fn(f64) -> Quantity| {
        let each = responses.iter().map(|response| {
            let quantity = limit(response.amplitude);
            let figure = figures.iter().find(|figure| figure.quantity == quantity);
            let known = figure.and_then(|figure| figure.value);
            known.map_or("–".into(), |hz| rounded(hz, 3))
        });
        joined(each.collect(), "and")
    };
    let panels = [
        panel(
            format!("−3 dB at {} Hz", limits(Quantity::AmplitudeLimit)),
            "gain [dB]",
            -3.0,
            |point| point.gain,
        ),
        panel(
            format!("−90° at {} Hz", limits(Quantity::PhaseLimit)),
            "phase [deg]",
            -90.0,
            |point| point.phase,
        ),
    ];
    let names: Vec<String> = responses
        .iter()
        .map(|r| format!("{} % of full scale", rounded(r.amplitude, 3)))
        .collect();
    let mut entries: Vec<(Role, Key, &str)> = ROLES
        .into_iter()
        .zip(&names)
        .map(|(role, name)| (role, Key::Line, name.as_str()))
        .collect();
    let amplitudes = card.measured.iter().flat_map(|own| &own.responses);
    let amplitudes = amplitudes.map(|(amplitude, _)| rounded(*amplitude, 2));
    let name = format!("measured, at {} %", joined(amplitudes.collect(), "and"));
    if !measured.is_empty() {
        entries.push((Role::Measured, Key::Dot, &name));
    }
    let caption = html! {
        "The spool's response to sines of three amplitudes (Bode plot). A linear valve has one curve; where they part, saturation, "
        "a limit of speed or a dead zone is at work."
        @if !measured.is_empty() { " The dots are the ratio of spectra of the records, where output and command are coherent: where one follows "
            "from the other." }
    };
    figure("bode", edition, &panels, legend(&entries), &caption)
}

fn of_step(step: &Step, edition: &Edition) -> Markup {
    let length = step.points.last().map_or(0.0, |point| point[0]);
    let (unit, factor) = if length > 2.0 {
        ("s", 1.0)
    } else {
        ("ms", 1e3)
    };
    let points: Vec<(f64, f64)> = step
        .points
        .iter()
        .map(|&[time, spool]| (factor * time, spool))
        .collect();
    let time = match step.time {
        Some(time) => format!("90 % after {} {unit}", rounded(factor * time, 3)),
        None => "90 % is not reached".into(),
    };
    let panel = Panel {
        title: format!("{time}, overshoot {} %", rounded(step.overshoot, 2)),
        size: (940, 260),
        x: Axis::over(format!("time [{unit}]"), points.iter().map(|point| point.0)),
        y: Axis::over("spool [% of its way]", points.iter().map(|point| point.1)),
        marks: vec![
            Mark::Level(Role::Text, 90.0),
            Mark::Line(Role::After, points),
        ],
    };
    let caption = html! { "The spool after a step of the command from zero to full scale." };
    figure(
        "step",
        edition,
        &[panel],
        legend(&[(Role::After, Key::Line, "spool")]),
        &caption,
    )
}
