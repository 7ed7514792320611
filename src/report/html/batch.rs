//! The page of a batch: how it went with every file, its figures side by side, and links to the reports.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::page::{section, whole};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::words::capitalised;
use crate::record::joined;
use crate::report::batch::{Batch, BatchRow, Departures, NamedValue, RowStatus};
use crate::report::{Edition, rounded};
use maud::{Markup, html};

/// Width and height of the small picture of a valve, in pixels.
const SMALL: (f64, f64) = (96.0, 48.0);

/// The page of a batch, for a folder in which the reports lie.
pub fn batch_page(batch: &Batch, edition: &Edition) -> String {
    let batch = &batch.in_units(&edition.units);
    let lead = html! {
        h1 { (title(batch)) }
        p.lead { (capitalised(&batch.compared)) "." }
        @for (row, own) in departing(batch) {
            p {
                (name(row)) " departs in " (joined(own.all().map(|one| format!(
                    "{} ({} {}, usual {})", one.label, rounded(one.value, 4), unit(&one.unit), rounded(one.usual, 4)
                )).collect(), "and"))
                @if let Some(cause) = &own.cause { ". Cause: " b { (cause.replace('_', " ")) } }
                "."
            }
        }
    };
    let content = html! {
        (section("figures", "Figure by figure", figures(batch, edition)))
        (section("records", "File by file", records(batch)))
        (section("run", "How it was run", html! {
            dl {
                dt { "Program" } dd translate="no" { (batch.program.name) " " (batch.program.version) }
                dt { "Arguments" } dd { code { (batch.arguments.join(" ")) } }
                dt { "Time" } dd { (batch.date) }
            }
            p.note { "batch.csv has every number of this page as a table, batch.json for programs." }
        }))
    };
    whole(edition, "batch – servobee", &lead, &content)
}

fn title(batch: &Batch) -> String {
    let count = |status: RowStatus| batch.count(|row| row.status == status);
    let all = batch.count(|_| true);
    let mut title = format!("{all} records: {} ok", count(RowStatus::Ok));
    for status in [RowStatus::Refused, RowStatus::Failed] {
        match count(status) {
            0 => {}
            some => title += &format!(", {some} {}", status.word()),
        }
    }
    match batch.count(|row| row.status == RowStatus::Ok && !row.limits.all_met()) {
        0 => {}
        missing => title += &format!("; {missing} do not meet every limit"),
    }
    match departing(batch).count() {
        0 => {}
        departing => title += &format!("; {departing} depart"),
    }
    format!("{title}.")
}

/// The rows that depart, and in what.
fn departing(batch: &Batch) -> impl Iterator<Item = (&BatchRow, &Departures)> {
    let rows = batch.rows.iter().zip(&batch.departures);
    rows.filter_map(|(row, own)| {
        let own = own.as_ref()?;
        own.all().next().is_some().then_some((row, own))
    })
}

/// The file's name, with a link to its report where it has one.
fn name(row: &BatchRow) -> Markup {
    html! {
        @match &row.folder {
            Some(folder) => a translate="no" href=(format!("{}/report.html", link(folder))) { (row.file) },
            None => span translate="no" { (row.file) }
        }
    }
}

/// A path as a link.
fn link(path: &str) -> String {
    let byte = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
            char::from(byte).to_string()
        }
        other => format!("%{other:02X}"),
    };
    path.bytes().map(byte).collect()
}

fn unit(unit: &str) -> &str {
    match unit {
        "1" => "",
        unit => unit,
    }
}

/// A small plot for each figure that is not the same for all: its value and interval in every record.
fn figures(batch: &Batch, edition: &Edition) -> Markup {
    let mut known: Vec<&NamedValue> = Vec::new();
    for value in batch.rows.iter().flat_map(|row| &row.figures) {
        if known.iter().all(|own| !same(own, value)) {
            known.push(value);
        }
    }
    let is_constant = |figure: &&NamedValue| {
        let all = batch.rows.iter().flat_map(|row| &row.figures);
        let mut all = all.filter(|value| same(figure, value));
        all.all(|value| value.value == figure.value && value.low.is_none())
    };
    let (constant, varying): (Vec<&NamedValue>, Vec<&NamedValue>) =
        known.into_iter().partition(is_constant);
    let panels: Vec<Panel> = varying.into_iter().map(|one| panel(batch, one)).collect();
    let told = |one: &&NamedValue| {
        format!(
            "{} {} {}",
            one.label,
            rounded(one.value, 4),
            unit(&one.unit)
        )
    };
    let constant: Vec<String> = constant.iter().map(told).collect();
    let caption = html! {
        "Each record has its place from left to right, in the order of the list below. Upright: the 95 % interval, which holds "
        "the true value in 95 of 100 such records. Triangles depart by more than chance and the spread of the others allow."
    };
    html! {
        @if panels.is_empty() { p { "No record has figures." } }
        @else {
            (figure("batch-figures", edition, &panels, legend(&[
                (Role::Measured, Key::Dot, "a valve"),
                (Role::Before, Key::Dot, "a valve that departs"),
                (Role::Noise, Key::Line, "baseline"),
            ]), &caption))
        }
        @if !constant.is_empty() { p.note { "The same in all: " (constant.join(", ")) "." } }
    }
}

/// Whether both are values of the same figure.
fn same(a: &NamedValue, b: &NamedValue) -> bool {
    a.name == b.name && a.unit == b.unit
}

fn panel(batch: &Batch, figure: &NamedValue) -> Panel {
    let (mut usual, mut far, mut marks) = (Vec::new(), Vec::new(), Vec::new());
    let mut extent = Vec::new();
    for (i, (row, departures)) in batch.rows.iter().zip(&batch.departures).enumerate() {
        let Some(value) = row.figures.iter().find(|value| same(figure, value)) else {
            continue;
        };
        extent.push(value.value);
        if row.baseline {
            marks.push(Mark::Level(Role::Noise, value.value));
            continue;
        }
        let at = (i + 1) as f64;
        let departs = departures
            .as_ref()
            .is_some_and(|own| own.figures.iter().any(|one| one.name == figure.name));
        let role = if departs {
            Role::Before
        } else {
            Role::Measured
        };
        if let (Some(low), Some(high)) = (value.low, value.high) {
            extent.extend([low, high]);
            marks.push(Mark::Line(role, vec![(at, low), (at, high)]));
        }
        match departs {
            true => far.push((at, value.value)),
            false => usual.push((at, value.value)),
        }
    }
    marks.push(Mark::Specks(Role::Measured, usual));
    marks.push(Mark::Dots(Role::Before, far));
    Panel {
        title: capitalised(&figure.label),
        size: (300, 180),
        // No tick stands where there is no record.
        x: Axis::from_to("record", 0.4, batch.rows.len() as f64 + 0.6),
        y: Axis::over(format!("[{}]", figure.unit), extent),
        marks,
    }
}

/// A line for every file.
fn records(batch: &Batch) -> Markup {
    let limits = batch
        .rows
        .iter()
        .any(|row| !row.limits.pass.is_empty() || !row.limits.all_met());
    let reach = Reach::of(&batch.rows);
    html! {
        div.scroll { table {
            thead { tr {
                th.n { "record" } th {} th { "file" } th { "status" } th { "outcome" }
                @if limits { th.n { "limits met" } }
                th { "departs in" } th { "cause" }
            } }
            tbody { @for (i, (row, departures)) in batch.rows.iter().zip(&batch.departures).enumerate() { tr {
                td.n { (i + 1) }
                td { (reach.picture(row)) }
                td { (name(row)) @if row.baseline { " (baseline)" } }
                td { @if row.status == RowStatus::Ok { "ok" } @else { b { (row.status.word()) } } }
                td.wrap { (row.summary()) }
                @if limits { td.n {
                    @let met = row.limits.pass.len();
                    @let all = met + row.limits.fail.len() + row.limits.not_determined.len();
                    @if all > 0 { (met) " of " (all) }
                } }
                td.wrap { @if let Some(own) = departures {
                    (own.all().map(|one| one.label.as_str()).collect::<Vec<_>>().join(", "))
                } }
                td { @if let Some(cause) = departures.as_ref().and_then(|own| own.cause.as_ref()) { (cause.replace('_', " ")) } }
            } } }
        } }
        p.note { "The small pictures are slow cycles over full command, all on the same axes." }
    }
}

/// How far the slow cycles reach: small pictures are compared on the same axes.
struct Reach {
    x: f64,
    y: f64,
}

impl Reach {
    fn of(rows: &[BatchRow]) -> Self {
        let most = |of: usize| {
            let points = rows.iter().flat_map(|row| &row.cycle);
            let most = points.map(|point| point[of].abs()).fold(0.0, f64::max);
            if most > 0.0 { most } else { 1.0 }
        };
        Self {
            x: most(0),
            y: most(1),
        }
    }

    fn picture(&self, row: &BatchRow) -> Markup {
        let (width, height) = SMALL;
        let point = |point: &[f64; 2]| {
            let x = 0.5 * width * (1.0 + point[0] / self.x);
            let y = 0.5 * height * (1.0 - point[1] / self.y);
            format!("{x:.1},{y:.1}")
        };
        let points: Vec<String> = row.cycle.iter().map(point).collect();
        html! { @if !points.is_empty() {
            svg.small width=(width) height=(height) viewBox=(format!("-1 -1 {} {}", width + 2.0, height + 2.0)) aria-hidden="true" {
                polyline points=(points.join(" ")) fill="none" stroke=(Role::After.hex()) stroke-width="1.5" {}
            }
        } }
    }
}

#[cfg(test)]
mod tests {
    use super::link;

    #[test]
    fn a_link_leads_to_the_folder_whatever_it_is_called() {
        assert_eq!(link("records/run 1%.csv"), "records/run%201%25.csv");
        assert_eq!(link("records/ü\"'#?.csv"), "records/%C3%BC%22%27%23%3F.csv");
    }
}
