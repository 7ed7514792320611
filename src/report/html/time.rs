//! Measured and simulated over time, and what they differ by.

use super::axis::Axis;
use super::figure::{Key, before_and_after, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::rows::{RecordRows, Rows};
use super::words;
use crate::diagnose::Identified;
use crate::model::Output;
use crate::report::noise::taken_from;
use crate::report::{Edition, rounded};
use maud::{Markup, html};
use std::ops::Range;

/// Measured, before and after over time: all of it, and where the models are worst.
pub(super) fn over_time(
    identified: &Identified,
    output: Output,
    rows: &Rows,
    edition: &Edition,
) -> Markup {
    let changed = identified.changed();
    let channel = output.name();
    let unit = identified.after.problem.structure.unit(output);
    let axis = format!("{channel} [{unit}]");
    let panel = |title: String, size, range: Range<usize>, shift: f64, label: &str| {
        let mut lines = vec![
            (Role::Measured, &rows.measured),
            (Role::Before, &rows.before),
        ];
        if changed {
            lines.push((Role::After, &rows.after));
        }
        let values = lines
            .iter()
            .flat_map(|(_, values)| values[range.clone()].iter().copied());
        let y = Axis::over(axis.clone(), values);
        let time = |row: usize| rows.time[row] + shift;
        let x = Axis::from_to(label, time(range.start), time(range.end - 1));
        let mut marks = held_out(rows, shift);
        marks.extend(lines.into_iter().map(|(role, values)| {
            let mut line = rows.line(values, range.clone());
            line.iter_mut().for_each(|point| point.0 += shift);
            Mark::Line(role, line)
        }));
        Panel {
            title,
            size,
            x,
            y,
            marks,
        }
    };
    let all = panel(
        format!("The whole {channel}{}", words::fall(identified, output)),
        (940, 260),
        0..rows.time.len(),
        0.0,
        time_axis(rows),
    );
    let [before, after] = [&rows.before, &rows.after].map(|simulated| rows.residual(simulated));
    let second = if changed {
        "Where the result is worst"
    } else {
        "Where it is second worst"
    };
    let first = if changed {
        "Where the base model is worst"
    } else {
        "Where the model is worst"
    };
    let zooms = rows.worst(&before, &after).into_iter().zip([first, second]);
    let mut panels = vec![all];
    panels.extend(zooms.map(|((range, one), title)| {
        panel(
            format!("{title}: {}", label(one)),
            (460, 260),
            range,
            one.shift,
            "time [s]",
        )
    }));
    let mut entries = vec![(Role::Measured, Key::Line, "measured")];
    entries.push((
        Role::Before,
        Key::Line,
        if changed {
            "base model (before)"
        } else {
            "base model"
        },
    ));
    if changed {
        entries.push((Role::After, Key::Line, "with what was added (after)"));
    }
    entries.push((Role::HeldOut, Key::Area, "held out"));
    let caption = html! {
        "The " (channel) " as it was measured and as it is simulated. The shaded rows were held out. "
        @if rows.records.iter().any(|one| one.record != rows.records[0].record) { "Records from left to right: " (records(rows)) ". " }
        "Below, the two stretches that differ most from the measurement, enlarged."
    };
    figure(
        &format!("time-{channel}"),
        edition,
        &panels,
        legend(&entries),
        &caption,
    )
}

/// The residual before and after, on one scale.
pub(super) fn residuals(
    identified: &Identified,
    output: Output,
    rows: &Rows,
    edition: &Edition,
) -> Markup {
    let changed = identified.changed();
    let channel = output.name();
    let unit = identified.after.problem.structure.unit(output);
    let noise = identified.noise[channel].value;
    let mut shown = vec![(
        "The base model leaves",
        Role::Before,
        rows.residual(&rows.before),
    )];
    if changed {
        shown.push(("The result leaves", Role::After, rows.residual(&rows.after)));
    }
    let values: Vec<f64> = shown
        .iter()
        .flat_map(|(_, _, values)| values.iter().copied())
        .collect();
    let largest = values
        .iter()
        .fold(2.2 * noise, |most, value| most.max(value.abs()));
    let panels: Vec<Panel> = shown
        .iter()
        .map(|(title, role, residual)| {
            let mut marks = held_out(rows, 0.0);
            marks.push(Mark::Line(*role, rows.line(residual, 0..residual.len())));
            marks.extend([-2.0, 2.0].map(|times| Mark::Level(Role::Noise, times * noise)));
            let held = |row: &usize| {
                rows.records
                    .iter()
                    .any(|one| one.held_out && one.rows.contains(row))
            };
            let squares: Vec<f64> = (0..residual.len())
                .filter(held)
                .map(|row| residual[row].powi(2))
                .collect();
            let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            let rms = if squares.is_empty() {
                String::new()
            } else {
                format!(" {} {unit} RMS on rows held out", rounded(rms, 3))
            };
            Panel {
                title: format!("{title}{rms}"),
                size: (940, 170),
                x: Axis::from_to(
                    time_axis(rows),
                    rows.time[0],
                    rows.time[rows.time.len() - 1],
                ),
                y: Axis::over(format!("residual [{unit}]"), [-largest, largest]),
                marks,
            }
        })
        .collect();
    let mut entries = before_and_after(changed);
    entries.push((Role::Noise, Key::Line, "twice the noise floor"));
    entries.push((Role::HeldOut, Key::Area, "held out"));
    let caption = html! {
        "Measured less simulated " (channel) ", on one scale. Noise alone stays between the dotted lines 95 % of the time: its "
        "floor is " (rounded(noise, 3)) " " (unit) ", taken from " (taken_from(&identified.noise[channel], unit)) "."
    };
    figure(
        &format!("residual-{channel}"),
        edition,
        &panels,
        legend(&entries),
        &caption,
    )
}

fn time_axis(rows: &Rows) -> &'static str {
    match rows.records.iter().any(|one| one.shift != 0.0) {
        true => "time, records one after another [s]",
        false => "time [s]",
    }
}

fn held_out(rows: &Rows, shift: f64) -> Vec<Mark> {
    let held = rows.records.iter().filter(|one| one.held_out);
    let time = |row: usize| rows.time[row] + shift;
    held.map(|one| {
        Mark::Span(
            Role::HeldOut,
            (time(one.rows.start), time(one.rows.end - 1)),
        )
    })
    .collect()
}

fn label(one: &RecordRows) -> String {
    let side = if one.held_out { "held out" } else { "fitted" };
    format!("{}, {side}", one.record)
}

fn records(rows: &Rows) -> String {
    let mut labels: Vec<String> = Vec::new();
    for label in rows.records.iter().map(label) {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.join("; ")
}
