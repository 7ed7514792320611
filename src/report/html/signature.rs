//! What gave an effect away.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::words::{capitalised, spoken};
use crate::diagnose::{Added, Contest, Identified, Signature, Verdict};
use crate::model::Structure;
use crate::report::{Edition, rounded};
use maud::{Markup, html};

/// The signatures of everything that was added, or of the residual where nothing was.
pub(super) fn all(identified: &Identified, edition: &Edition) -> Vec<Markup> {
    let structure = &identified.before.problem.structure;
    let contested = identified
        .added
        .iter()
        .filter_map(|one| Some((one, one.contest.as_ref()?)));
    let figures: Vec<Markup> = contested
        .zip(&identified.signatures)
        .enumerate()
        .map(|(i, ((added, contest), found))| {
            of_effect((&id(i), edition), added, contest, found, structure)
        })
        .collect();
    match figures.is_empty() {
        true => vec![of_residual(identified, edition)],
        false => figures,
    }
}

/// The page's name for the signature of the `i`-th effect.
fn id(i: usize) -> String {
    match i {
        0 => "signature".into(),
        _ => format!("signature-{}", i + 1),
    }
}

fn of_effect(
    (id, edition): (&str, &Edition),
    added: &Added,
    contest: &Contest,
    found: &[Signature],
    structure: &Structure,
) -> Markup {
    let effect = &spoken(added.effect);
    let rival = &contest.rival;
    let tied = rival
        .as_ref()
        .is_some_and(|rival| added.tied_with.contains(&rival.effect));
    let rival = rival
        .as_ref()
        .map(|rival| (spoken(rival.effect), rival.error));
    let mut entries = marks_of_rows();
    entries.push((Role::After, Key::Line, effect));
    if let Some((rival, _)) = &rival {
        entries.push((Role::Rival, Key::Line, rival));
    }
    let over = |i: usize| found.get(i).map_or("", |one| one.signal.as_str());
    let titles = [
        capitalised(&format!("{effect} shows over the {}", over(0))),
        match &rival {
            Some((rival, _)) if tied => capitalised(&format!(
                "{effect} and {rival} cannot be told apart, not even here"
            )),
            Some((rival, _)) => {
                capitalised(&format!("{effect} and {rival} part over the {}", over(1)))
            }
            None => String::new(),
        },
    ];
    let caption = html! {
        "What the model leaves without " (effect) ", in groups of rows with nearly the same " (signal(found, 0)) ": the median "
        "of each, and its spread. The line is what " (effect) " adds to the simulation of these rows, so that it should go "
        "through the medians. "
        @if let (Some((rival, error)), Some(_)) = (&rival, found.get(1)) {
            "Its closest rival is " (rival) ", fitted in its place (held-out error " (rounded(*error, 3)) " times the noise): "
            "on the right the signal over which the two differ most, " (signal(found, 1)) ". "
            @if tied { "This record cannot tell the two apart. " }
        } @else {
            "No other effect came close enough to be fitted in its place. "
        }
        (explained(found))
    };
    figure(
        id,
        edition,
        &panels(found, structure, titles),
        legend(&entries),
        &caption,
    )
}

fn of_residual(identified: &Identified, edition: &Edition) -> Markup {
    let found = identified.signatures.first().map_or(&[][..], Vec::as_slice);
    let has_form = identified.free_form.is_some();
    let unexplained = identified.verdict == Verdict::Unexplained;
    let over = |i: usize| found.get(i).map_or("", |one| one.signal.as_str());
    let rival = identified.closest().map(|one| spoken(one.effect));
    let mut entries = marks_of_rows();
    let mut roles = Vec::new();
    if has_form {
        roles.push((Role::After, Key::Line, "the curve of free form"));
    }
    if let Some(rival) = rival.as_ref().filter(|_| has_form) {
        roles.push((Role::Rival, Key::Line, rival));
    }
    entries.extend(&roles);
    let titles = [
        format!("What the base model leaves over the {}", over(0)),
        format!("Where the two part: over the {}", over(1)),
    ];
    let caption = html! {
        "What the base model leaves, in groups of rows with nearly the same " (signal(found, 0)) ": the median of each, and its "
        "spread. "
        @match (unexplained, has_form, &rival) {
            (false, _, _) => "No signal of this record shows more: this is the one on which the residual depends most. ",
            (true, true, _) => "The line is what the curve of free form adds to the simulation of these rows. ",
            (true, false, _) => "No curve of a signal helped on the rows that were held out. ",
        }
        @if let Some(rival) = &rival {
            @if identified.asked_all() { "Of the catalogue " } @else { "Of the effects that were asked " }
            (rival) " comes closest, and does not follow. "
        }
        (explained(found))
    };
    let roles: Vec<Role> = roles.iter().map(|(role, _, _)| *role).collect();
    figure(
        "signature",
        edition,
        &panels_as(found, &identified.before.problem.structure, titles, &roles),
        legend(&entries),
        &caption,
    )
}

fn marks_of_rows() -> Vec<(Role, Key, &'static str)> {
    vec![
        (Role::Measured, Key::Dot, "median of the residual"),
        (Role::Spread, Key::Area, "68 % of the rows"),
    ]
}

/// The signal of the `i`-th panel and the channel whose residual it shows.
fn signal(found: &[Signature], i: usize) -> String {
    let name = |one: &Signature| format!("{} (residual of the {})", one.signal, one.output.name());
    found.get(i).map_or(String::new(), name)
}

fn explained(found: &[Signature]) -> String {
    found.first().map_or(String::new(), |one| {
        format!(
            "The {} makes up {:.0} % of the squared residual.",
            one.signal,
            100.0 * one.explained
        )
    })
}

fn panels(found: &[Signature], structure: &Structure, titles: [String; 2]) -> Vec<Panel> {
    panels_as(found, structure, titles, &[Role::After, Role::Rival])
}

/// One panel a signature, what each model adds drawn in its role.
fn panels_as(
    found: &[Signature],
    structure: &Structure,
    titles: [String; 2],
    roles: &[Role],
) -> Vec<Panel> {
    let panel = |(one, title): (&Signature, String)| {
        let Signature {
            output,
            signal,
            unit,
            bins,
            ..
        } = one;
        let mut marks: Vec<Mark> = bins
            .iter()
            .map(|bin| Mark::Bar(Role::Spread, bin.signal, bin.spread))
            .collect();
        let dots = bins.iter().map(|bin| (bin.signal, bin.median));
        marks.push(Mark::Dots(Role::Measured, dots.collect()));
        for (i, role) in roles.iter().enumerate() {
            let line = bins
                .iter()
                .filter_map(|bin| Some((bin.signal, *bin.added.get(i)?)));
            marks.push(Mark::Line(*role, line.collect()));
        }
        let values = bins.iter().flat_map(|bin| {
            let ends = [bin.spread.0, bin.spread.1, bin.median];
            ends.into_iter().chain(bin.added.iter().copied())
        });
        Panel {
            title,
            size: (460, 300),
            x: Axis::over(
                format!("{signal} [{unit}]"),
                bins.iter().map(|bin| bin.signal),
            ),
            y: Axis::over(
                format!("{} residual [{}]", output.name(), structure.unit(*output)),
                values,
            ),
            marks,
        }
    };
    found.iter().zip(titles).map(panel).collect()
}
