//! The fits of `servobee datasheet` on the terminal.

use crate::cli::table::{number, table};
use servobee::report::{ParameterReport, Units, not_identifiable};
use servobee::search::datasheet::{Measured, Sheet};
use servobee::search::fitted_sheet::{FittedSheet, SheetFit, rms};

/// Prints the fits of a sheet, and what its result leaves at each point.
pub(super) fn print(fitted: &FittedSheet, units: &Units) {
    let fitted = &units.sheet(fitted);
    let FittedSheet { sheet, fits, .. } = fitted;
    tell!("\n{}", capitalised(&units.text(&sheet.title)));
    for note in &sheet.notes {
        tell!("  {}", units.text(note));
    }
    let mut rows = Vec::new();
    for SheetFit {
        search,
        fit,
        errors,
        ..
    } in fits
    {
        let cost = |cost: Option<f64>| cost.map_or("diverged".into(), number);
        let mut row = vec![
            (*search).to_owned(),
            cost(fit.cost_at_start),
            cost(fit.cost()),
        ];
        for errors in errors {
            let known = errors.iter().flatten();
            let worst = known.fold(0.0f64, |worst, error| worst.max(error.abs()));
            row.extend([number(rms(errors)), number(worst)]);
        }
        row.push(fit.evaluations.to_string());
        rows.push(row);
    }
    let mut head = vec![
        "search".to_owned(),
        "cost before".into(),
        "cost after".into(),
    ];
    for Measured { unit, .. } in &sheet.measured {
        head.extend([format!("RMS [{unit}]"), format!("worst [{unit}]")]);
    }
    head.push("evaluations".into());
    tell!("{}", table(&head, rows));

    let result = fitted.result();
    let published = sheet.published.iter().any(Option::is_some);
    let mut rows = Vec::new();
    let parameters = ParameterReport::of(&sheet.problem, &result.fit);
    for (parameter, published_value) in units.parameters(parameters).iter().zip(&sheet.published) {
        let mut row = vec![parameter.name.clone(), parameter.unit.clone()];
        if published {
            row.push(published_value.map_or(String::new(), number));
        }
        row.push(number(parameter.value));
        row.push(parameter.interval(".."));
        row.push(if parameter.at_bound {
            "at its bound".into()
        } else {
            String::new()
        });
        rows.push(row);
    }
    let mut head = vec!["parameter", "unit"];
    head.extend(published.then_some("published"));
    head.extend(["fitted", "95 % interval", ""]);
    tell!("{}", table(&head, rows));
    for line in not_identifiable(&result.fit) {
        tell!("Not identifiable: {}", units.text(&line));
    }

    let mut rows: Vec<Vec<String>> = sheet
        .points
        .iter()
        .map(|point| point.iter().map(|&value| number(value)).collect())
        .collect();
    let mut head: Vec<String> = sheet.axes.clone();
    for (measured, simulated) in sheet.measured.iter().zip(&result.simulated) {
        head.extend([
            format!("{} [{}]", measured.name, measured.unit),
            "fitted".into(),
            "error".into(),
        ]);
        for ((row, measured), simulated) in rows.iter_mut().zip(&measured.values).zip(simulated) {
            let shown = |value: Option<f64>| value.map_or("-".into(), number);
            row.extend([
                shown(*measured),
                number(*simulated),
                shown(measured.map(|measured| measured - simulated)),
            ]);
        }
    }
    tell!("{}", table(&head, rows));
    for (measured, change) in sheet.measured.iter().zip(&fitted.integration_error) {
        let Measured { name, unit, .. } = measured;
        tell!(
            "Halving the integration steps changes the {name} by at most {} {unit}.",
            number(*change)
        );
    }
    if sheet.axes.len() == 2 {
        for (measured, errors) in sheet.measured.iter().zip(&result.errors) {
            print_by_amplitude(sheet, measured, errors);
        }
    }
}

/// What a response's fit leaves of a quantity at each amplitude, and where along the frequency.
fn print_by_amplitude(sheet: &Sheet, measured: &Measured, errors: &[Option<f64>]) {
    let mut amplitudes: Vec<f64> = sheet.points.iter().map(|point| point[0]).collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup();
    for amplitude in amplitudes {
        let own: Vec<(f64, f64)> = sheet
            .points
            .iter()
            .zip(errors)
            .filter(|(point, _)| point[0] == amplitude)
            .filter_map(|(point, &error)| Some((point[1], error?)))
            .collect();
        let extreme = |sign: f64| {
            own.iter()
                .max_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)))
        };
        let (Some(low), Some(high)) = (extreme(-1.0), extreme(1.0)) else {
            continue;
        };
        let all: Vec<Option<f64>> = own.iter().map(|pair| Some(pair.1)).collect();
        tell!(
            "Left at {} %: {} {unit} RMS, between {} {unit} at {} Hz and {} {unit} at {} Hz",
            number(amplitude),
            number(rms(&all)),
            number(low.1),
            number(low.0),
            number(high.1),
            number(high.0),
            unit = measured.unit,
        );
    }
}

fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(characters).collect()
    })
}
