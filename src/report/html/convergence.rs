//! How the search went.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use crate::diagnose::Identified;
use crate::report::{Edition, rounded};
use crate::search::Fit;
use maud::{Markup, html};

/// The search's best cost over the generations, and the held-out error as effects were added.
pub(super) fn of(identified: &Identified, edition: &Edition) -> Markup {
    let search = &identified.search;
    let values = identified.before.problem.values().max(1) as f64;
    // Each channel is in units of its own deviation there.
    let error = |cost: f64| 100.0 * (cost / values).sqrt();
    let searched = panel(
        "The search on the base model",
        search,
        "error [% of the signal's deviation]",
        &error,
    );
    let mut panels = vec![searched];
    let chain = chain(identified);
    if chain.len() > 1 {
        let names: Vec<String> = chain.iter().map(|(name, _)| name.clone()).collect();
        let dots = chain
            .iter()
            .enumerate()
            .map(|(row, (_, error))| (*error, row as f64));
        let largest = chain.iter().map(|(_, error)| *error).fold(1.0, f64::max);
        panels.push(Panel {
            title: format!(
                "Held-out error falls to {} times the noise",
                rounded(chain[chain.len() - 1].1, 3)
            ),
            size: (460, 260),
            x: Axis::over("error / noise floor", [0.0, largest]),
            y: Axis::names("", names),
            marks: vec![
                Mark::Upright(Role::Noise, 1.0),
                Mark::Dots(Role::After, dots.collect()),
            ],
        });
    }
    let entries = [
        (Role::Before, Key::Line, "best of the search"),
        (Role::After, Key::Line, "after the polish"),
        (Role::Noise, Key::Line, "noise floor"),
    ];
    let shown = if chain.len() > 1 {
        &entries[..]
    } else {
        &entries[..2]
    };
    let caption = html! {
        "The best error on fitted rows after each generation of the search (a round of trial values), and where the polish ends "
        "that starts from there (Levenberg-Marquardt, a local search along the slopes): " (search.search.evaluations) " evaluations by the search, " (search.evaluations - search.search.evaluations)
        " by the polish. "
        @if chain.len() > 1 { "Right: RMS over all channels of the rows held out, each in units of its noise floor." }
    };
    figure("convergence", edition, &panels, legend(shown), &caption)
}

/// The search's best cost over the generations, and the polish's, each as `error` reads it.
pub(super) fn panel(title: &str, search: &Fit, label: &str, error: &dyn Fn(f64) -> f64) -> Panel {
    let history = search.search.history.iter().enumerate();
    let line: Vec<(f64, f64)> = history
        .map(|(generation, cost)| (generation as f64 + 1.0, error(cost.value)))
        .collect();
    let end = search.cost().map(error).filter(|end| *end > 0.0);
    let values = line
        .iter()
        .map(|point| point.1)
        .filter(|value| *value > 0.0)
        .chain(end);
    let mut marks = vec![Mark::Line(Role::Before, line.clone())];
    marks.extend(end.map(|end| Mark::Level(Role::After, end)));
    Panel {
        title: title.into(),
        size: (460, 260),
        x: Axis::over("generation", [0.0, line.len().max(1) as f64]),
        y: Axis::log(label, values),
        marks,
    }
}

/// Held-out errors from the base model on.
fn chain(identified: &Identified) -> Vec<(String, f64)> {
    let added = &identified.added;
    let first = added.first().map(|one| one.error_before);
    let form = identified.free_form.as_ref();
    let first = first.or(form.map(|form| form.error_before));
    let base = first.map(|error| ("base model".to_owned(), error));
    let effects = added
        .iter()
        .map(|one| (format!("+ {}", one.effect), one.error_after));
    let form = form.map(|form| ("+ free form".to_owned(), form.error_after));
    base.into_iter().chain(effects).chain(form).collect()
}
