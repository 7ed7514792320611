//! The result of `servobee identify` on the terminal.

use crate::cli::table::{number, table};
use crate::cli::{card, colour};
use servobee::diagnose::{Identified, Verdict};
use servobee::evaluate::problem::Series;
use servobee::report::{
    ConsideredEffect, Document, FreeFormReport, ImprovementReport, Knot, ParameterReport, Units,
    complete, explain, located, not_diagnosed, unexplained,
};

/// Prints the answer first, and then what it stands on.
pub(super) fn print(identified: &Identified, document: &Document, units: &Units) {
    let document = &document.in_units(units);
    let structure = &identified.after.problem.structure;
    let count = |records: &[Series]| {
        let rows = records.iter().flat_map(|r| &r.samples);
        rows.filter(|s| s.weight > 0.0).count()
    };
    let (full_scale, unit) = units.tell(structure.full_scale, &structure.command_unit);
    tell!(
        "Fitted {} rows of {} record(s), held out {} rows; full scale {} {unit}.",
        count(&identified.measurements.fit),
        identified.measurements.fit.len(),
        count(&identified.measurements.hold_out),
        number(full_scale),
    );
    if let Some(hold) = &document.hold {
        tell!("{}", hold.sentence());
    }
    for remark in &document.bench {
        tell!("Bench: {}.", units.text(remark));
    }
    tell!("{}", explain::HELD_OUT);
    tell!(
        "{}\n",
        explain::base_model(&identified.before.problem.structure)
    );
    print_effects(identified, document);
    print_errors(identified, units);
    print_parameters(document, units);
    card::print(document, units);
    card::print_limits(&document.limits, units);
    print_rest(identified, document, units);
}

/// The answer, and the chain of effects that it stands on.
fn print_effects(identified: &Identified, document: &Document) {
    let added = &identified.added;
    if let Some(cut) = &document.cut_short {
        colour::answer("No verdict: the run was cut short.");
        tell!("{}", cut.sentence());
    }
    match identified.verdict {
        _ if document.cut_short.is_some() => {}
        Verdict::None => {
            let why = complete(identified);
            colour::answer(format_args!("Verdict: none. {why}"));
        }
        Verdict::Found | Verdict::Partly => {
            let names: Vec<String> = added.iter().map(|one| one.effect.to_string()).collect();
            let names = names.join(" and ");
            let whole = match identified.verdict {
                Verdict::Found => format!("found. The base model lacks {names}."),
                _ => format!("partly. The base model lacks {names}, and something else is left."),
            };
            colour::answer(format_args!("Verdict: {whole}"));
        }
        Verdict::Unexplained => {
            let why = unexplained(identified);
            colour::answer(format_args!("Verdict: unexplained. {why}"));
        }
        Verdict::NotDiagnosed => {
            let why = not_diagnosed(identified);
            colour::answer(format_args!("Verdict: not diagnosed. {why}"));
        }
    }
    let error = |side: &ImprovementReport| {
        let ImprovementReport { percent, low, high } = side;
        format!("{percent:.1} % ({low:.1} .. {high:.1})")
    };
    if let Some(improvement) = &document.error.improvement.hold_out {
        let explained = identified.explained.map_or(String::new(), |share| {
            let percent = 100.0 * share;
            format!("; {percent:.0} % of what was above the noise is explained")
        });
        tell!("Held-out error lower by {}{explained}.", error(improvement));
    }
    if let Some(located) = located(identified) {
        tell!("{located}");
    }
    let nearest: Vec<String> = identified
        .nearest()
        .iter()
        .map(|(effect, explained)| format!("{effect} ({:.0} %)", 100.0 * explained))
        .collect();
    if !nearest.is_empty() {
        let nearest = nearest.join(", ");
        tell!("Of the error above the noise come closest: {nearest}.");
    }
    tell!();
    if let Some(form) = &document.free_form {
        print_free_form(form);
    }
    if !added.is_empty() {
        let rows = added.iter().map(|one| {
            let tied: Vec<String> = one.tied_with.iter().map(ToString::to_string).collect();
            vec![
                one.effect.to_string(),
                one.effect.entry.port.to_string(),
                format!("{:.3}", one.error_before),
                format!("{:.3}", one.error_after),
                if tied.is_empty() {
                    "-".into()
                } else {
                    tied.join(", ")
                },
            ]
        });
        let head = [
            "effect",
            "port",
            "error before",
            "after",
            "cannot be told from",
        ];
        tell!("{}", table(&head, rows.collect::<Vec<_>>()));
        tell!("(held-out RMS over all channels, in units of the noise floor)\n");
        for one in added {
            tell!(
                "{}: {}. It shows as {}.",
                one.effect,
                one.effect.entry.summary,
                one.effect.entry.shows
            );
        }
        tell!();
    }
}

fn print_free_form(form: &FreeFormReport) {
    let port = match &form.channel {
        Some(channel) => format!("the measured {channel}"),
        None => format!("the {} port", form.port),
    };
    tell!(
        "A curve of the {} added at {port} takes the held-out error from {:.3} to {:.3} times the noise floor:\n",
        form.signal,
        form.error_before,
        form.error_after
    );
    let row = |knot: &Knot| vec![number(knot.signal), number(knot.value)];
    let signal = format!("{} [{}]", form.signal, form.signal_unit);
    let added = format!("added [{}]", form.unit);
    let rows: Vec<Vec<String>> = form.curve.iter().map(row).collect();
    tell!("{}\n", table(&[signal.as_str(), added.as_str()], rows));
}

fn print_errors(identified: &Identified, units: &Units) {
    let structure = &identified.after.problem.structure;
    let (before, after) = (&identified.before.errors, &identified.after.errors);
    let mut rows = Vec::new();
    for &output in &structure.observed {
        let channel = output.name();
        let Some(held) = after.hold_out.get(channel) else {
            continue;
        };
        let percent = |fit: Option<f64>| fit.map_or("-".into(), |fit| format!("{fit:.2}"));
        let (unit, factor) = units.of(structure.unit(output));
        rows.push(vec![
            format!("{channel} [{unit}]"),
            number(factor * before.fit[channel].rmse),
            number(factor * after.fit[channel].rmse),
            number(factor * before.hold_out[channel].rmse),
            number(factor * held.rmse),
            percent(held.fit_percent),
            number(factor * identified.noise[channel].value),
            identified.noise[channel].method.name().into(),
        ]);
    }
    let head = [
        "channel",
        "fitted: before",
        "after",
        "held out: before",
        "after",
        "fit %",
        "noise floor",
        "from",
    ];
    tell!("{}\n", table(&head, rows));
}

fn print_parameters(document: &Document, units: &Units) {
    let row = |parameter: &ParameterReport| {
        let mut notes = Vec::new();
        if parameter.at_bound {
            notes.push("at its bound");
        }
        if parameter.moved {
            notes.push("moved");
        }
        vec![
            parameter.name.clone(),
            parameter.unit.clone(),
            parameter.before.map_or("-".into(), number),
            number(parameter.value),
            parameter.interval(".."),
            notes.join(", "),
        ]
    };
    let rows: Vec<Vec<String>> = document.parameters.iter().map(row).collect();
    let head = ["parameter", "unit", "before", "after", "95 % interval", ""];
    tell!("{}", table(&head, rows));
    if document.parameters.iter().any(|parameter| parameter.moved) {
        tell!("(moved: out of the interval of the base model, which was wrong and sure)");
    }
    for line in &document.not_identifiable {
        tell!("Not identifiable: {}", units.text(line));
    }
    tell!();
}

fn print_rest(identified: &Identified, document: &Document, units: &Units) {
    let first: Vec<&ConsideredEffect> = document
        .considered
        .iter()
        .filter(|one| one.error_after.is_some())
        .collect();
    if !first.is_empty() {
        let rows = first.iter().map(|one| {
            vec![
                one.round.to_string(),
                one.name.clone(),
                format!("{:.1} %", one.predicted_reduction),
                format!("{:.3}", one.p_value),
                one.error_after
                    .map_or("-".into(), |error| format!("{error:.3}")),
                one.decision.into(),
            ]
        });
        let head = [
            "round",
            "effect",
            "promise",
            "p",
            "held-out error",
            "decision",
        ];
        tell!("{}", explain::PREDICTED_REDUCTION);
        tell!("{}", table(&head, rows.collect::<Vec<_>>()));
        let others = document.considered.len() - first.len();
        tell!("({others} more were screened and not refitted; report.json has them all)\n");
    }
    let known = &document.remaining.correlates_with;
    match (document.remaining.structured, known.is_empty()) {
        (true, false) => tell!(
            "What is left in the residual is more than noise: {}.",
            known.join(", ")
        ),
        (true, true) => tell!(
            "What is left is far above the noise floor, but follows nothing that this record shows."
        ),
        (false, _) => {
            tell!("Only noise is left.")
        }
    }
    let after = &identified.after;
    let structure = &after.problem.structure;
    for output in &structure.observed {
        let channel = output.name();
        let Some(change) = after.integration_error.get(channel) else {
            continue;
        };
        let (change, unit) = units.tell(*change, structure.unit(*output));
        tell!(
            "Halving the integration steps changes {channel} by at most {} {unit}.",
            number(change)
        );
    }
}
