//! The residual over frequency.

use super::axis::Axis;
use super::figure::{Key, before_and_after, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::rows::Rows;
use crate::diagnose::{Identified, spectral_density};
use crate::model::Output;
use crate::report::{Edition, rounded};
use maud::{Markup, html};

/// The spectrum of the residual before and after, beside what white noise would show.
pub(super) fn of(
    identified: &Identified,
    output: Output,
    rows: &Rows,
    edition: &Edition,
) -> Markup {
    let changed = identified.changed();
    let channel = output.name();
    let unit = identified.after.problem.structure.unit(output);
    let interval = rows.interval();
    let density = |simulated: &[f64]| {
        let residual = rows.residual(simulated);
        let stretches: Vec<&[f64]> = rows
            .records
            .iter()
            .map(|one| &residual[one.rows.clone()])
            .collect();
        spectral_density(&stretches, interval)
    };
    let mut lines = vec![(Role::Before, density(&rows.before))];
    if changed {
        lines.push((Role::After, density(&rows.after)));
    }
    let noise = identified.noise[channel].value * (2.0 * interval).sqrt();
    let all = || lines.iter().flat_map(|(_, line)| line.iter());
    let positive = all().map(|point| point.1).filter(|value| *value > 0.0);
    let x = Axis::log("frequency [Hz]", all().map(|point| point.0));
    let y = Axis::log(
        format!("{channel} residual [{unit}/√Hz]"),
        positive.chain([noise]),
    );
    let mut marks: Vec<Mark> = lines
        .iter()
        .map(|(role, line)| Mark::Line(*role, line.clone()))
        .collect();
    marks.push(Mark::Level(Role::Noise, noise));
    let highest = |line: &[(f64, f64)]| line.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let found = lines.first().and_then(|(_, line)| highest(line));
    let title = found.map_or(
        "Too few rows for a spectrum".to_owned(),
        |(frequency, height)| {
            let times = rounded(height / noise, 2);
            format!(
                "The {channel}'s residual was largest at {} Hz: {times} times the floor",
                rounded(frequency, 2)
            )
        },
    );
    let panel = Panel {
        title,
        size: (940, 300),
        x,
        y,
        marks,
    };
    let mut entries = before_and_after(changed);
    entries.push((Role::Noise, Key::Line, "white noise of the floor's size"));
    let caption = html! {
        "Where over frequency the " (channel) "'s residual lies (amplitude spectral density, averaged over segments). What stands "
        "above the dotted line is more than white noise of the floor's size; a peak is a line, such as hum or ringing."
    };
    figure(
        &format!("spectrum-{channel}"),
        edition,
        &[panel],
        legend(&entries),
        &caption,
    )
}
