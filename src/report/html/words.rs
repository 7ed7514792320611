//! The answer in words.

use crate::diagnose::{Added, Fitted, Identified, Verdict};
use crate::model::Output;
use crate::model::effects::Effect;
use crate::report::{FreeFormReport, not_diagnosed, quantity, rounded, unexplained};

/// The answer in one sentence.
pub(super) fn answer(identified: &Identified) -> String {
    let Identified {
        verdict,
        added,
        after,
        ..
    } = identified;
    match (verdict, added.as_slice()) {
        (Verdict::None, _) => "The base model lacks nothing that this record shows.".into(),
        (Verdict::Unexplained, _) => unexplained(identified),
        (Verdict::NotDiagnosed, _) => not_diagnosed(identified),
        (Verdict::Found, [one]) => {
            let doubt = match doubts(one).as_str() {
                "" => String::new(),
                doubts => format!(" (this record cannot tell it from {doubts})"),
            };
            format!(
                "{}: {}{doubt}.",
                capitalised(&finding(one.effect, after)),
                spoken(one.effect)
            )
        }
        (Verdict::Found, many) => {
            let one = |added: &Added| {
                let doubt = match doubts(added).as_str() {
                    "" => String::new(),
                    doubts => format!(", or {doubts}"),
                };
                format!(
                    "{} ({}{doubt})",
                    finding(added.effect, after),
                    spoken(added.effect)
                )
            };
            format!(
                "{}.",
                capitalised(&listed(many.iter().map(one).collect(), "and"))
            )
        }
    }
}

/// What the error was and is, by channel, beside the noise.
pub(super) fn errors(identified: &Identified) -> String {
    let structure = &identified.after.problem.structure;
    let one = |output: &Output| {
        let channel = output.name();
        let noise = rounded(identified.noise.get(channel)?.value, 3);
        let unit = structure.unit(*output);
        let many = structure.observed.len() > 1;
        let name = if many {
            format!("{channel} ")
        } else {
            String::new()
        };
        Some(format!(
            "{name}{} (sensor noise {noise} {unit})",
            error(identified, *output)?
        ))
    };
    let all: Vec<String> = structure.observed.iter().filter_map(one).collect();
    let side = if held_out(identified) {
        "Held-out error"
    } else {
        "Error (nothing was held out)"
    };
    format!("{side}: {}.", all.join("; "))
}

/// How the error of `output` fell, as the end of a title.
pub(super) fn fall(identified: &Identified, output: Output) -> String {
    let side = if held_out(identified) {
        "held-out"
    } else {
        "fitted"
    };
    error(identified, output).map_or(String::new(), |error| format!(": {side} error {error}"))
}

fn held_out(identified: &Identified) -> bool {
    !identified.after.errors.hold_out.is_empty()
}

/// The error of `output` before and after with its unit; on rows held out, if there are any.
fn error(identified: &Identified, output: Output) -> Option<String> {
    let side = |fitted: &Fitted| {
        let errors = &fitted.errors;
        let side = if held_out(identified) {
            &errors.hold_out
        } else {
            &errors.fit
        };
        side.get(output.name()).map(|score| score.rmse)
    };
    let (before, after) = (side(&identified.before)?, side(&identified.after)?);
    let unit = identified.after.problem.structure.unit(output);
    Some(match identified.changed() {
        true => format!("{} → {} {unit}", rounded(before, 3), rounded(after, 3)),
        false => format!("{} {unit}", rounded(after, 3)),
    })
}

/// What a correction of free form does.
pub(super) fn correction(form: &FreeFormReport) -> String {
    let place = match &form.channel {
        Some(channel) => format!("to the measured {channel}"),
        None => format!("at the {} port", form.port),
    };
    format!(
        "A curve of the {} that is added {place} lowers the held-out error from {} to {} times the noise.",
        form.signal,
        rounded(form.error_before, 3),
        rounded(form.error_after, 3)
    )
}

/// What was found of `effect`, with the values of its parameters in `fitted`.
fn finding(effect: Effect, fitted: &Fitted) -> String {
    let output = effect.output.map_or("", |output| output.name());
    let mut text = effect.entry.finding.replace("{output}", output);
    while let Some((head, rest)) = text.split_once('{') {
        let Some((name, tail)) = rest.split_once('}') else {
            break;
        };
        // Parameters of an effect on one output end in its name; some names say more.
        let own = |suffix: &str| {
            let parameters = fitted.problem.parameters.iter().zip(&fitted.values);
            let mut matching =
                parameters.filter(|(p, _)| p.name.starts_with(name) && p.name.ends_with(suffix));
            matching.next().map(|(p, value)| quantity(*value, &p.unit))
        };
        text = format!("{head}{}{tail}", own(output).unwrap_or_default());
    }
    text
}

/// An effect's name as it is spoken.
pub(super) fn spoken(effect: Effect) -> String {
    let name = effect.entry.name.replace('_', " ");
    match effect.output {
        Some(output) if !effect.entry.finding.contains("{output}") => {
            format!("{name} of the {}", output.name())
        }
        _ => name,
    }
}

/// What the record cannot tell an effect from.
pub(super) fn doubts(added: &Added) -> String {
    let mut names: Vec<String> = Vec::new();
    for other in &added.tied_with {
        let name = match other.output {
            Some(output) => format!(
                "{} of the {}",
                other.entry.name.replace('_', " "),
                output.name()
            ),
            None => spoken(*other),
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    listed(names, "or")
}

/// `a, b and c`.
pub(super) fn listed(mut names: Vec<String>, word: &str) -> String {
    match names.pop() {
        None => String::new(),
        Some(last) if names.is_empty() => last,
        Some(last) => format!("{} {word} {last}", names.join(", ")),
    }
}

/// `text` with a capital letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}
