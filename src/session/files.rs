//! What the files of a result hold that no report does: the model, and every row.

use crate::diagnose::Identified;
use crate::report::{ModelFile, csv_cell};

/// The result as a model file.
pub(super) fn model_toml(identified: &Identified) -> String {
    let after = &identified.after;
    let problem = &after.problem;
    ModelFile::to_toml(&problem.structure, &problem.parameters, &after.values)
}

/// Every row of every record: measured, simulated before, simulated after; empty where the record does not measure it.
pub(super) fn residual_csv(identified: &Identified) -> String {
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
