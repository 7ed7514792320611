//! The files that `servobee identify` writes.

use servobee::card::Card;
use servobee::diagnose::Identified;
use servobee::report::{Document, Edition, ModelFile, csv_cell, page};

/// The files of a result: their names and what they hold.
pub(super) fn files(
    identified: &Identified,
    document: &Document,
    card: &Card,
    edition: &Edition,
) -> Vec<(String, String)> {
    let mut files = report(identified, document, card, edition);
    files.push(("residual.csv".into(), residual_csv(identified)));
    files
}

/// Those of them that are no longer with a longer record.
pub(in crate::cli) fn report(
    identified: &Identified,
    document: &Document,
    card: &Card,
    edition: &Edition,
) -> Vec<(String, String)> {
    vec![
        ("report.json".into(), document.to_json()),
        (
            "report.html".into(),
            page(identified, document, card, edition),
        ),
        ("model.toml".into(), model_toml(identified)),
    ]
}

fn model_toml(identified: &Identified) -> String {
    let after = &identified.after;
    let problem = &after.problem;
    ModelFile::to_toml(&problem.structure, &problem.parameters, &after.values)
}

/// Every row of every record: measured, simulated before, simulated after; empty where the record does not measure it.
fn residual_csv(identified: &Identified) -> String {
    let (before, after) = (&identified.before, &identified.after);
    let structure = &after.problem.structure;
    let mut text = String::from("record,part,time [s]");
    for output in &structure.observed {
        let (name, unit) = (output.name(), structure.unit(*output));
        for model in ["measured", "before", "after"] {
            text += &format!(",{name} {model} [{unit}]");
        }
    }
    text.push('\n');
    let [old, new] = [before, after].map(|fitted| fitted.beside(&identified.measurements));
    let sides = [
        ("fit", old.fit, new.fit),
        ("hold_out", old.hold_out, new.hold_out),
    ];
    for (side, old, new) in sides {
        for (old, new) in old.iter().zip(&new) {
            let series = new.series;
            let name = csv_cell(&series.name);
            for (row, sample) in series.samples.iter().enumerate() {
                if sample.weight == 0.0 {
                    continue;
                }
                text += &format!("{name},{side},{}", series.time[row]);
                for &output in &structure.observed {
                    if !series.measured[output] {
                        text += ",,,";
                        continue;
                    }
                    let (measured, old, new) = (
                        sample.target[output],
                        old.simulated[row][output],
                        new.simulated[row][output],
                    );
                    text += &format!(",{measured},{old},{new}");
                }
                text.push('\n');
            }
        }
    }
    text
}
