//! Every effect that was looked at, round by round.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use crate::diagnose::{Considered, Decision, Identified, Located, Place};
use crate::report::{Edition, explain, rounded};
use maud::{Markup, html};

/// Below this test ratio all effects are drawn alike.
const LEAST: f64 = 0.03;
/// Effects that a later round shows.
const FEW: usize = 10;

/// One figure a round; what is said instead where no effect was looked at.
pub(super) fn all(identified: &Identified, edition: &Edition) -> Vec<Markup> {
    let rounds = identified
        .considered
        .iter()
        .map(|one| one.round)
        .max()
        .unwrap_or(0);
    if rounds == 0 {
        let caption = html! {
            "No effect was looked at: none was allowed, nothing was held out, or the base model follows the record exactly."
        };
        return vec![figure("ranking", edition, &[], html! {}, &caption)];
    }
    (1..=rounds)
        .map(|round| of_round(identified, round, edition))
        .collect()
}

fn of_round(identified: &Identified, round: usize, edition: &Edition) -> Markup {
    let mut list: Vec<&Considered> = identified
        .considered
        .iter()
        .filter(|one| one.round == round)
        .collect();
    list.sort_by(|a, b| b.test_ratio.total_cmp(&a.test_ratio));
    // What looks like chance in a later round was shown in the first.
    let shown = if round == 1 {
        list.len()
    } else {
        list.len().min(FEW)
    };
    let refitted: Vec<&Considered> = list
        .iter()
        .copied()
        .filter(|one| one.error.is_some())
        .collect();
    let mut panels = vec![test_ratios(&list[..shown], round)];
    if !refitted.is_empty() {
        panels.push(errors(refitted));
    }
    let line = match panels.len() {
        1 => "limit that chance passes in 1 of 100 records",
        _ => "limit that chance passes in 1 of 100 records (left); noise floor (right)",
    };
    let entries = [
        (Role::After, Key::Area, "chosen"),
        (Role::Measured, Key::Area, "refitted"),
        (Role::Spread, Key::Area, "not refitted"),
        (Role::Noise, Key::Line, line),
    ];
    let significant = list.iter().filter(|one| one.test_ratio > 1.0).count();
    let caption = html! {
        (explain::PREDICTED_REDUCTION) " Here promises, from simulations at several values of the effect, are in units "
        "of what the best of all effects promises by chance in one of 100 records: " (significant) " of " (list.len())
        " reach beyond that line. The plausible ones of those were fitted together with the model; the error on rows that were "
        "held out decides, and of equal ones the simpler. "
        @if let Some(place) = first_place(identified, round) {
            "The base model fails " (place.words()) ": only what acts there or at the sensor of the spool was looked for first. "
        }
        @if shown < list.len() { "The others of this round promise less. " }
        @if round > 1 { "This round starts from the model with what the rounds before it added. " }
    };
    let id = if round == 1 {
        "ranking".to_owned()
    } else {
        format!("ranking-{round}")
    };
    html! {
        (figure(&id, edition, &panels, legend(&entries), &caption))
        details {
            summary { "Round " (round) ": why each effect was or was not chosen" }
            div.scroll { table {
                thead { tr { th { "effect" } th.n { "promise" } th.n { "p" } th.n { "held-out error" } th { "decision" } } }
                tbody { @for one in &list {
                    tr {
                        td { (one.effect) }
                        td.n { (format!("{:.1} %", one.predicted_reduction)) }
                        td.n { (format!("{:.3}", one.p_value)) }
                        td.n { (one.error.map_or("–".into(), |error| format!("{error:.3}"))) }
                        td { (one.decision.describe()) }
                    }
                } }
            } }
        }
    }
}

/// The side of the spool that alone was looked at in this `round`.
fn first_place(identified: &Identified, round: usize) -> Option<Place> {
    let located = identified.located_before.filter(Located::is_one_side)?;
    (round == 1).then_some(located.place)
}

fn is_chosen(one: &Considered) -> bool {
    one.decision == Decision::Chosen
}

fn names(list: &[&Considered]) -> Vec<String> {
    list.iter().map(|one| one.effect.to_string()).collect()
}

/// The test ratio of each effect: what it promises, in units of the limit of chance.
fn test_ratios(list: &[&Considered], round: usize) -> Panel {
    let role = |one: &Considered| match one.error {
        _ if is_chosen(one) => Role::After,
        Some(_) => Role::Measured,
        None => Role::Spread,
    };
    let bars = list
        .iter()
        .enumerate()
        .map(|(row, one)| Mark::Length(role(one), one.test_ratio.max(LEAST), row as f64));
    let mut marks: Vec<Mark> = bars.collect();
    marks.push(Mark::Upright(Role::Noise, 1.0));
    let values = list.iter().map(|one| one.test_ratio.max(LEAST));
    let finding = match list.first().filter(|best| best.test_ratio > 1.0) {
        Some(best) => format!(
            "{} promises {} times what chance does",
            best.effect,
            rounded(best.test_ratio, 2)
        ),
        None => "none promises more than chance".into(),
    };
    Panel {
        title: format!("Round {round}: {finding}"),
        size: (530, 62 + 20 * list.len() as u32),
        x: Axis::log("promise / limit of chance", values.chain([LEAST, 2.0])),
        y: Axis::names("", names(list)),
        marks,
    }
}

/// The held-out errors of what was refitted, the lowest first.
fn errors(mut list: Vec<&Considered>) -> Panel {
    let error = |one: &Considered| one.error.unwrap_or(f64::INFINITY);
    list.sort_by(|a, b| error(a).total_cmp(&error(b)));
    let dots = list.iter().enumerate().map(|(row, one)| {
        let role = if is_chosen(one) {
            Role::After
        } else {
            Role::Measured
        };
        Mark::Dots(role, vec![(error(one), row as f64)])
    });
    let mut marks = vec![Mark::Upright(Role::Noise, 1.0)];
    marks.extend(dots);
    let best = list.first().map_or(String::new(), |one| {
        format!(": {} leaves least", one.effect)
    });
    Panel {
        title: format!("Held-out error{best}"),
        size: (400, 62 + 20 * list.len() as u32),
        x: Axis::over(
            "error / noise floor",
            list.iter().map(|one| error(one)).chain([0.0, 1.0]),
        ),
        y: Axis::names("", names(&list)),
        marks,
    }
}
