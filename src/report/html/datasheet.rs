//! The page of a datasheet: its curves and what the model makes of them.

use super::axis::Axis;
use super::figure::{Key, figure, legend};
use super::page::{section, whole};
use super::plot::{Mark, Panel};
use super::role::Role;
use super::words::capitalised;
use super::{card, convergence, tables};
use crate::record::joined;
use crate::report::{Document, Edition, ParameterReport, rounded};
use crate::search::datasheet::{Measured, Sheet};
use crate::search::fitted_sheet::{FittedSheet, SheetFit, rms};
use maud::{Markup, html};

/// Styles of the amplitudes of a response; more than these share the last.
const ROLES: [Role; 3] = [Role::First, Role::Second, Role::Third];

/// The page of curves that were fitted, each with its searches; the last of them is the result.
pub fn datasheet_page(sheets: &[FittedSheet], document: &Document, edition: &Edition) -> String {
    let units = &edition.units;
    let document = &document.in_units(units);
    let sheets: Vec<FittedSheet> = sheets.iter().map(|one| units.sheet(one)).collect();
    let parameters = |fitted: &FittedSheet| {
        let own = ParameterReport::of(&fitted.sheet.problem, &fitted.result().fit);
        units.parameters(own)
    };
    let answers = sheets.iter().flat_map(|fitted| {
        let one = |(measured, errors): (&Measured, &Vec<Option<f64>>)| {
            let rms = rounded(rms(errors), 2);
            format!("the {} to {rms} {} RMS", measured.name, measured.unit)
        };
        let measured = fitted.sheet.measured.iter();
        measured
            .zip(&fitted.result().errors)
            .map(one)
            .collect::<Vec<_>>()
    });
    let lead = html! {
        h1 { "The model follows " (joined(answers.collect(), "and")) "." }
        @for fitted in &sheets { @for note in &fitted.sheet.notes { p { (note) } } }
    };
    let content = html! {
        (section("card", "The valve", card::table(&document.card)))
        @for (i, fitted) in sheets.iter().enumerate() {
            (section(&format!("sheet-{}", i + 1), &capitalised(&fitted.sheet.title), html! {
                @for figure in curves(i + 1, fitted, edition) { (figure) }
                (tables::parameters(&parameters(fitted), false))
                (searches(&format!("convergence-{}", i + 1), &fitted.fits, edition))
            }))
        }
        (section("remaining", "What remains", tables::undetermined(document, &|name| {
            let mut all = sheets.iter().flat_map(|fitted| &fitted.sheet.measured);
            let known = all.find(|measured| measured.name == name);
            known.map_or(String::new(), |measured| measured.unit.clone())
        })))
        (section("run", "How it was run", tables::run(document)))
    };
    whole(edition, "datasheet – servobee", &lead, &content)
}

/// A figure for each quantity of sheet number `number`: the first one's is called after the sheet alone.
fn curves(number: usize, fitted: &FittedSheet, edition: &Edition) -> Vec<Markup> {
    let FittedSheet { sheet, .. } = fitted;
    let SheetFit {
        simulated, errors, ..
    } = fitted.result();
    let all = sheet.measured.iter().zip(simulated.iter().zip(errors));
    all.enumerate()
        .map(|(i, (measured, (simulated, errors)))| {
            let id = match i {
                0 => format!("curve-{number}"),
                _ => format!("curve-{number}-{}", measured.name),
            };
            curve((&id, edition), sheet, measured, simulated, errors)
        })
        .collect()
}

/// The points of the sheet, the fitted model through them, and what it leaves.
fn curve(
    (id, edition): (&str, &Edition),
    sheet: &Sheet,
    measured: &Measured,
    simulated: &[f64],
    error: &[Option<f64>],
) -> Markup {
    let (quantity, unit) = (measured.name, &measured.unit);
    let simulated: Vec<Option<f64>> = simulated.iter().copied().map(Some).collect();
    let measured = &measured.values;
    // The last axis is along the curve; one before it separates the points into curves.
    let along = |point: &[f64]| *point.last().expect("a point lies on an axis");
    let label = sheet.axes.last().expect("a sheet has an axis").clone();
    let positions: Vec<f64> = sheet.points.iter().map(|point| along(point)).collect();
    let mut amplitudes: Vec<f64> = sheet
        .points
        .iter()
        .filter(|point| point.len() > 1)
        .map(|point| point[0])
        .collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup();
    let of = |amplitude: Option<f64>, values: &[Option<f64>]| -> Vec<(f64, f64)> {
        let own = |point: &Vec<f64>| amplitude.is_none_or(|amplitude| point[0] == amplitude);
        let rows = sheet
            .points
            .iter()
            .zip(values)
            .filter(|(point, _)| own(point));
        rows.filter_map(|(point, value)| Some((along(point), (*value)?)))
            .collect()
    };
    let curves: Vec<(Option<f64>, Role)> = match amplitudes.is_empty() {
        true => vec![(None, Role::After)],
        false => {
            let roles = ROLES.into_iter().chain(std::iter::repeat(ROLES[2]));
            amplitudes.into_iter().map(Some).zip(roles).collect()
        }
    };
    let x = match sheet.axes.len() {
        1 => Axis::over(label, positions),
        _ => Axis::log(label, positions),
    };
    let lines = |values: &[Option<f64>]| -> Vec<Mark> {
        let line =
            |(amplitude, role): &(Option<f64>, Role)| Mark::Line(*role, of(*amplitude, values));
        curves.iter().map(line).collect()
    };
    let dots = |values: &[Option<f64>]| -> Vec<Mark> {
        let dots =
            |(amplitude, role): &(Option<f64>, Role)| Mark::Dots(*role, of(*amplitude, values));
        curves.iter().map(dots).collect()
    };
    let both = |mut first: Vec<Mark>, second: Vec<Mark>| {
        first.extend(second);
        first
    };
    let panels = [
        Panel {
            title: format!(
                "{} points of the sheet and the model",
                error.iter().flatten().count()
            ),
            size: (460, 300),
            x: x.clone(),
            y: Axis::over(
                format!("{quantity} [{unit}]"),
                measured.iter().chain(&simulated).flatten().copied(),
            ),
            marks: both(lines(&simulated), dots(measured)),
        },
        Panel {
            title: format!("What is left: {} {unit} RMS", rounded(rms(error), 2)),
            size: (460, 300),
            x,
            y: Axis::over(
                format!("measured less model [{unit}]"),
                error.iter().flatten().copied().chain([0.0]),
            ),
            marks: both(vec![Mark::Level(Role::Text, 0.0)], dots(error)),
        },
    ];
    let names = |what: &str| -> Vec<String> {
        let name = |amplitude: Option<f64>| {
            amplitude.map_or(what.into(), |amplitude| format!("{what} at {amplitude} %"))
        };
        curves
            .iter()
            .map(|(amplitude, _)| name(*amplitude))
            .collect()
    };
    let (points, models) = (names("datasheet"), names("model"));
    let entries =
        curves
            .iter()
            .zip(points.iter().zip(&models))
            .flat_map(|((_, role), (points, model))| {
                [
                    (*role, Key::Dot, points.as_str()),
                    (*role, Key::Line, model.as_str()),
                ]
            });
    let entries: Vec<(Role, Key, &str)> = entries.collect();
    let caption = html! {
        "Left, the " (quantity) " of the sheet and that of the fitted model at the same points; right, their difference."
    };
    figure(id, edition, &panels, legend(&entries), &caption)
}

/// The best cost of each search over its generations.
fn searches(id: &str, fits: &[SheetFit], edition: &Edition) -> Markup {
    let panels: Vec<Panel> = fits
        .iter()
        .map(|one| convergence::panel(&capitalised(one.search), &one.fit, "cost", &|cost| cost))
        .collect();
    let entries = [
        (Role::Before, Key::Line, "best of the search"),
        (Role::After, Key::Line, "end of the search"),
    ];
    let caption = html! {
        "The best cost (weighted sum of squared errors) after each generation of the search (a round of trial values), and at "
        "the end. The parameters above are those of the last search."
    };
    figure(id, edition, &panels, legend(&entries), &caption)
}
