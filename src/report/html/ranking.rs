//! Every effect that was looked at, round by round.

use super::axis::Axis;
use super::plot::{Key, Mark, Panel, Role, figure, legend};
use crate::diagnose::{Considered, Identified};
use maud::{Markup, html};

/// Below this share of what would be significant all promises look alike.
const LEAST: f64 = 0.03;

/// One figure a round; what is said instead where no effect was looked at.
pub(super) fn all(identified: &Identified) -> Vec<Markup> {
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
        return vec![figure("ranking", &[], html! {}, &caption)];
    }
    (1..=rounds)
        .map(|round| of_round(identified, round))
        .collect()
}

fn of_round(identified: &Identified, round: usize) -> Markup {
    let list: Vec<&Considered> = identified
        .considered
        .iter()
        .filter(|one| one.round == round)
        .collect();
    let names: Vec<String> = list.iter().map(|one| one.effect.to_string()).collect();
    let height = 60 + 20 * names.len() as u32;
    let chosen = |one: &Considered| one.decision.starts_with("chosen");
    let role = |one: &Considered| {
        if chosen(one) {
            Role::After
        } else {
            Role::Spread
        }
    };
    let rows = || list.iter().enumerate().map(|(row, one)| (row as f64, *one));
    let mut marks: Vec<Mark> = rows()
        .map(|(row, one)| Mark::Length(role(one), one.above_chance.max(LEAST), row))
        .collect();
    marks.push(Mark::Upright(Role::Noise, 1.0));
    let promises = list.iter().map(|one| one.above_chance.max(LEAST));
    let promise = Panel {
        title: format!("Round {round}: what each effect promises"),
        size: (560, height),
        x: Axis::log(
            "promise / what chance promises at most",
            promises.chain([LEAST, 2.0]),
        ),
        y: Axis::names("", names),
        marks,
    };
    let errors: Vec<(f64, f64, bool)> = rows()
        .filter_map(|(row, one)| Some((one.error?, row, chosen(one))))
        .collect();
    let mut panels = vec![promise];
    if !errors.is_empty() {
        let dots = |which: bool| {
            errors
                .iter()
                .filter(move |dot| dot.2 == which)
                .map(|dot| (dot.0, dot.1))
                .collect()
        };
        let worst = errors.iter().map(|dot| dot.0).fold(0.0, f64::max);
        let refitted: Vec<String> = list
            .iter()
            .map(|one| one.error.map_or(String::new(), |_| one.effect.to_string()))
            .collect();
        panels.push(Panel {
            title: "Refitted: held-out error".into(),
            size: (360, height),
            x: Axis::over("error / noise floor", [0.0, 1.0, worst]),
            y: Axis::names("", refitted),
            marks: vec![
                Mark::Upright(Role::Noise, 1.0),
                Mark::Dots(Role::Measured, dots(false)),
                Mark::Dots(Role::After, dots(true)),
            ],
        });
    }
    let entries = [
        (Role::After, Key::Area, "chosen"),
        (Role::Spread, Key::Area, "not chosen"),
        (
            Role::Noise,
            Key::Line,
            "limit: chance promises as much in 1 of 100 records (left); noise floor (right)",
        ),
    ];
    let significant = list.iter().filter(|one| one.above_chance > 1.0).count();
    let caption = html! {
        "How much of the residual each effect promises to explain, simulated at several values and linearised there, in units "
        "of what the best of all effects promises by chance in one of 100 records: " (significant) " of " (list.len())
        " reach beyond that line. The plausible ones of those were fitted together with the model; the error on rows that were "
        "held out decides, and of equal ones the simpler. "
        @if round > 1 { "This round starts from the model with what the rounds before it added. " }
    };
    let id = if round == 1 {
        "ranking".to_owned()
    } else {
        format!("ranking-{round}")
    };
    html! {
        (figure(&id, &panels, legend(&entries), &caption))
        details {
            summary { "Round " (round) ": why each effect was or was not chosen" }
            div.scroll { table {
                thead { tr { th { "effect" } th.n { "promise" } th.n { "p" } th.n { "held-out error" } th { "decision" } } }
                tbody { @for one in &list {
                    tr {
                        td { (one.effect) }
                        td.n { (format!("{:.1} %", one.promise)) }
                        td.n { (format!("{:.3}", one.p_value)) }
                        td.n { (one.error.map_or("–".into(), |error| format!("{error:.3}"))) }
                        td { (one.decision) }
                    }
                } }
            } }
        }
    }
}
