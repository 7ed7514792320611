//! The page of a datasheet: its curves and what the model makes of them.

use super::axis::Axis;
use super::figure::{Key, Role, figure, legend};
use super::plot::{Mark, Panel};
use super::words::{capitalised, listed};
use super::{card, convergence, section, tables, whole};
use crate::report::{Document, ParameterReport, rounded};
use crate::search::Fit;
use crate::search::datasheet::Sheet;
use maud::{Markup, html};

/// Styles of the amplitudes of a response; more than these share the last.
const ROLES: [Role; 3] = [Role::First, Role::Second, Role::Third];

/// The page of curves that were fitted, each with its searches; the last of them is the result.
pub fn datasheet_page(sheets: &[(Sheet, Vec<(&str, Fit)>)], document: &Document) -> String {
    let answers = sheets.iter().map(|(sheet, fits)| {
        let errors = errors(sheet, best(fits).values());
        format!(
            "the {} to {} {} RMS",
            sheet.quantity.0,
            rounded(rms(&errors), 2),
            sheet.quantity.1
        )
    });
    let lead = html! {
        h1 { "The model follows " (listed(answers.collect(), "and")) "." }
        @for (sheet, _) in sheets { @for note in &sheet.notes { p { (note) } } }
    };
    let content = html! {
        @for (i, (sheet, fits)) in sheets.iter().enumerate() {
            (section(&format!("sheet-{}", i + 1), &capitalised(&sheet.title), html! {
                (curve(&format!("curve-{}", i + 1), sheet, best(fits)))
                (tables::parameters(&ParameterReport::of(&sheet.problem, best(fits)), false))
                (searches(&format!("convergence-{}", i + 1), fits))
            }))
        }
        (section("card", "The valve", card::figures(&document.card)))
        (section("remaining", "What remains", tables::undetermined(document, &|name| {
            let sheet = sheets.iter().find(|(sheet, _)| sheet.quantity.0 == name);
            sheet.map_or(String::new(), |(sheet, _)| sheet.quantity.1.clone())
        })))
        (section("run", "How it was run", tables::run(document)))
    };
    whole("datasheet – servobee", &lead, &content)
}

fn best<'a>(fits: &'a [(&str, Fit)]) -> &'a Fit {
    &fits.last().expect("every sheet is fitted").1
}

fn errors(sheet: &Sheet, free: &[f64]) -> Vec<f64> {
    let simulated = sheet.simulated(&sheet.problem, free);
    let pairs = sheet.measured().into_iter().zip(simulated);
    pairs
        .map(|(measured, simulated)| measured - simulated)
        .collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The points of the sheet, the fitted model through them, and what it leaves.
fn curve(id: &str, sheet: &Sheet, fit: &Fit) -> Markup {
    let (quantity, unit) = (sheet.quantity.0, &sheet.quantity.1);
    let simulated = sheet.simulated(&sheet.problem, fit.values());
    let measured = sheet.measured();
    // The last axis is along the curve; one before it parts the points into curves.
    let along = |point: &[f64]| *point.last().expect("a point has a place");
    let label = sheet.axes.last().expect("a sheet has an axis").clone();
    let places: Vec<f64> = sheet.points.iter().map(|point| along(point)).collect();
    let mut amplitudes: Vec<f64> = sheet
        .points
        .iter()
        .filter(|point| point.len() > 1)
        .map(|point| point[0])
        .collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup();
    let of = |amplitude: Option<f64>, values: &[f64]| -> Vec<(f64, f64)> {
        let own = |point: &Vec<f64>| amplitude.is_none_or(|amplitude| point[0] == amplitude);
        let rows = sheet
            .points
            .iter()
            .zip(values)
            .filter(|(point, _)| own(point));
        rows.map(|(point, value)| (along(point), *value)).collect()
    };
    let curves: Vec<(Option<f64>, Role)> = match amplitudes.is_empty() {
        true => vec![(None, Role::After)],
        false => {
            let roles = ROLES.into_iter().chain(std::iter::repeat(ROLES[2]));
            amplitudes.into_iter().map(Some).zip(roles).collect()
        }
    };
    let error: Vec<f64> = measured
        .iter()
        .zip(&simulated)
        .map(|(measured, simulated)| measured - simulated)
        .collect();
    let x = match sheet.axes.len() {
        1 => Axis::over(label, places),
        _ => Axis::log(label, places),
    };
    let lines = |values: &[f64]| -> Vec<Mark> {
        let line =
            |(amplitude, role): &(Option<f64>, Role)| Mark::Line(*role, of(*amplitude, values));
        curves.iter().map(line).collect()
    };
    let dots = |values: &[f64]| -> Vec<Mark> {
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
            title: format!("{} points of the sheet and the model", measured.len()),
            size: (460, 300),
            x: x.clone(),
            y: Axis::over(
                format!("{quantity} [{unit}]"),
                measured.iter().chain(&simulated).copied(),
            ),
            marks: both(lines(&simulated), dots(&measured)),
        },
        Panel {
            title: format!("What is left: {} {unit} RMS", rounded(rms(&error), 2)),
            size: (460, 300),
            x,
            y: Axis::over(
                format!("measured less model [{unit}]"),
                error.iter().copied().chain([0.0]),
            ),
            marks: both(vec![Mark::Level(Role::Text, 0.0)], dots(&error)),
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
    figure(id, &panels, legend(&entries), &caption)
}

/// The best cost of each search over its generations.
fn searches(id: &str, fits: &[(&str, Fit)]) -> Markup {
    let panels: Vec<Panel> = fits
        .iter()
        .map(|(name, fit)| convergence::bees(&capitalised(name), fit, "cost", &|cost| cost))
        .collect();
    let entries = [
        (Role::Before, Key::Line, "best of the bees"),
        (Role::After, Key::Line, "end of the search"),
    ];
    let caption = html! {
        "The best cost (weighted sum of squared errors) after each generation of the Bees Algorithm, and at the end. The parameters above "
        "are those of the last search."
    };
    figure(id, &panels, legend(&entries), &caption)
}
