//! The answer in words.

use crate::diagnose::{Added, Fitted, Identified, Verdict};
use crate::model::effects::Effect;
use crate::model::{Complete, Output, Parameter};
use crate::record::joined;
use crate::report::{FreeFormReport, complete, not_diagnosed, quantity, rounded, unexplained};

/// The answer in one sentence.
pub(super) fn answer(identified: &Identified) -> String {
    let Identified {
        verdict,
        added,
        after,
        ..
    } = identified;
    match (verdict, added.as_slice()) {
        (Verdict::None, _) => complete(identified).into(),
        (Verdict::Unexplained, _) => unexplained(identified),
        (Verdict::NotDiagnosed, _) => not_diagnosed(identified),
        (Verdict::Partly, _) => {
            let share = 100.0 * identified.explained.unwrap_or(0.0);
            format!(
                "{} That is {share:.0} % of what is missing; the rest has no name.",
                found(added, after)
            )
        }
        (Verdict::Found, _) => found(added, after),
    }
}

/// What was `added`, in one sentence.
fn found(added: &[Added], after: &Fitted) -> String {
    match added {
        [one] => {
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
        many => {
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
                capitalised(&joined(many.iter().map(one).collect(), "and"))
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
    let port = match &form.channel {
        Some(channel) => format!("to the measured {channel}"),
        None => format!("at the {} port", form.port),
    };
    format!(
        "A curve of the {} that is added {port} lowers the held-out error from {} to {} times the noise.",
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
        let own = value_of(name, output, &fitted.problem.parameters, &fitted.values);
        let own = own.unwrap_or_default();
        text = format!("{head}{own}{tail}");
    }
    text
}

/// The value of an effect's parameter `name`. One of an effect on one `output` ends in that; some names say more, where the
/// record decides which of two parameters is fitted.
fn value_of(
    name: &str,
    output: &str,
    parameters: &[Parameter],
    values: &Complete<f64>,
) -> Option<String> {
    let full = match output {
        "" => name.to_owned(),
        output => format!("{name}_{output}"),
    };
    let find = |wanted: &dyn Fn(&Parameter) -> bool| {
        let mut matching = parameters
            .iter()
            .zip(values.as_slice())
            .filter(|(parameter, _)| wanted(parameter));
        matching.next().map(|(p, value)| quantity(*value, &p.unit))
    };
    find(&|p| p.name == full && !p.is_fixed())
        .or_else(|| find(&|p| p.name.starts_with(&format!("{full}_per_")) && !p.is_fixed()))
        .or_else(|| find(&|p| p.name == full))
}

/// What an effect is called in a text: its cause, and which form of it.
fn words_of(effect: Effect) -> String {
    let cause = effect.entry.cause().replace('_', " ");
    match effect.entry.form() {
        "usual" => cause,
        form => format!("{cause} ({})", form.replace('_', " ")),
    }
}

/// An effect's name as it is spoken.
pub(super) fn spoken(effect: Effect) -> String {
    let name = words_of(effect);
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
            Some(output) => format!("{} of the {}", words_of(*other), output.name()),
            None => spoken(*other),
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    joined(names, "or")
}

/// `text` with a capital letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::CATALOGUE;
    use crate::model::valve::ValveForm;
    use crate::model::{ServoValve, Structure};

    #[test]
    fn every_finding_has_the_values_of_its_own_effect() {
        let base = Structure {
            observed: vec![Output::Spool, Output::Flow, Output::Position],
            base: ServoValve::with(ValveForm::linear()).into(),
            ..Structure::actuator(10.0, "V")
        };
        let known = base.parameters();
        for entry in CATALOGUE {
            for effect in entry.on(&base) {
                let parameters = base.with(effect).parameters();
                let values: Complete<f64> = (1..=parameters.len()).map(|i| i as f64).collect();
                let output = effect.output.map_or("", Output::name);
                let finding = entry.finding.replace("{output}", output);
                for name in finding.split('{').skip(1) {
                    let name = name.split('}').next().unwrap();
                    let found = value_of(name, output, &parameters, &values);
                    let own = parameters
                        .iter()
                        .zip(values.as_slice())
                        .filter(|(parameter, _)| {
                            !parameter.is_fixed()
                                && known.iter().all(|base| base.name != parameter.name)
                        });
                    let mut own = own.map(|(parameter, value)| quantity(*value, &parameter.unit));
                    let found = found.unwrap_or_else(|| panic!("{effect}: {name}"));
                    assert!(own.any(|own| own == found), "{effect}: {name} is {found}");
                }
            }
        }
    }

    #[test]
    fn of_two_forms_of_a_parameter_the_fitted_one_is_told() {
        let time = Parameter::linear("viscosity_drift", "1/s", -1.0, 0.0, 1.0);
        let heat = Parameter::linear("viscosity_drift_per_kelvin", "1/K", -1.0, 0.0, 1.0);
        let told = |parameters: [Parameter; 2]| {
            value_of(
                "viscosity_drift",
                "",
                &parameters,
                &Complete::from_iter([0.001, 0.002]),
            )
            .unwrap()
        };
        assert_eq!(told([time.clone(), heat.clone().fixed()]), "0.1 %/s");
        assert_eq!(told([time.fixed(), heat]), "0.2 %/K");
    }
}
