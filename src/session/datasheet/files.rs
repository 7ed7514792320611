//! The files of the fitted curves of a datasheet.

use crate::report::{Document, Edition, ModelFile, datasheet_page};
use crate::search::datasheet::Measured;
use crate::search::fitted_sheet::FittedSheet;

/// The files of the fitted sheets: a report of all, and a model and its points for each.
pub(super) fn files(
    fitted: &[FittedSheet],
    report: &Document,
    edition: &Edition,
) -> Vec<(String, String)> {
    let mut files = vec![
        ("report.json".into(), report.to_json()),
        (
            "report.html".into(),
            datasheet_page(fitted, report, edition),
        ),
    ];
    for one in fitted {
        let prefix = match fitted.len() {
            1 => String::new(),
            _ => format!("{}_", one.sheet.measured[0].name),
        };
        files.push((format!("{prefix}model.toml"), model_toml(one)));
        files.push((format!("{prefix}points.csv"), points_csv(one)));
    }
    files
}

fn model_toml(fitted: &FittedSheet) -> String {
    let problem = &fitted.sheet.problem;
    let values = problem.complete(fitted.result().fit.values(), |fixed| fixed);
    ModelFile::to_toml(&problem.structure, &problem.parameters, &values)
}

fn points_csv(fitted: &FittedSheet) -> String {
    let sheet = &fitted.sheet;
    let mut lines = vec![sheet.axes.clone()];
    let cells = |point: &Vec<f64>| point.iter().map(ToString::to_string).collect();
    lines.extend(sheet.points.iter().map(cells));
    for (measured, simulated) in sheet.measured.iter().zip(&fitted.result().simulated) {
        let Measured { name, unit, values } = measured;
        lines[0].extend([
            format!("{name} [{unit}]"),
            format!("fitted {name} [{unit}]"),
        ]);
        for ((line, measured), simulated) in lines[1..].iter_mut().zip(values).zip(simulated) {
            let measured = measured.map_or(String::new(), |measured| measured.to_string());
            line.extend([measured, simulated.to_string()]);
        }
    }
    let line = |cells: &Vec<String>| cells.join(",") + "\n";
    lines.iter().map(line).collect()
}
