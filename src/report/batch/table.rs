//! The batch as a table: `batch.csv`.

use super::{Batch, BatchRow, NamedValue};
use crate::report::csv_cell;

/// A column for a value and two for its interval.
type Column<'a> = (&'a str, &'a str);

/// A line for every file: how it went, what was found, whether limits are met, what it departs in, and every figure and
/// parameter that any of them has, with its interval.
pub fn batch_csv(batch: &Batch) -> String {
    let figures = columns(&batch.rows, |row| &row.figures);
    let parameters = columns(&batch.rows, |row| &row.parameters);
    let mut heads: Vec<String> = [
        "file",
        "status",
        "problem",
        "baseline",
        "verdict",
        "effects",
        "limits met",
        "limits missed",
        "limits not determined",
        "departs in",
        "cause",
        "warnings",
        "seconds",
        "folder",
    ]
    .map(String::from)
    .into();
    for (kind, columns) in [("", &figures), ("parameter ", &parameters)] {
        for (name, unit) in columns {
            heads.push(format!("{kind}{name} [{unit}]"));
            heads.push(format!("{kind}{name} low [{unit}]"));
            heads.push(format!("{kind}{name} high [{unit}]"));
        }
    }
    let mut text = line(&heads);
    for (row, departures) in batch.rows.iter().zip(&batch.departures) {
        let departs = departures.as_ref().map_or(String::new(), |own| {
            let names: Vec<&str> = own.all().map(|one| one.name.as_str()).collect();
            names.join("; ")
        });
        let cause = departures.as_ref().and_then(|own| own.cause.clone());
        let mut cells = vec![
            row.file.clone(),
            row.status.word().into(),
            row.problem.clone().unwrap_or_default(),
            if row.baseline { "yes" } else { "" }.into(),
            row.verdict.map_or("", |verdict| verdict.word()).into(),
            row.effects.join("; "),
            row.limits.pass.join("; "),
            row.limits.fail.join("; "),
            row.limits.not_determined.join("; "),
            departs,
            cause.unwrap_or_default(),
            row.warnings.to_string(),
            format!("{:.2}", row.seconds),
            row.folder.clone().unwrap_or_default(),
        ];
        for (columns, values) in [(&figures, &row.figures), (&parameters, &row.parameters)] {
            for (name, unit) in columns {
                let same = |value: &&NamedValue| value.name == *name && value.unit == *unit;
                let value = values.iter().find(same);
                cells.push(value.map_or(String::new(), |one| one.value.to_string()));
                for end in [
                    value.and_then(|one| one.low),
                    value.and_then(|one| one.high),
                ] {
                    cells.push(end.map_or(String::new(), |end| end.to_string()));
                }
            }
        }
        text += &line(&cells);
    }
    text
}

/// Every name and unit, in the order in which the rows have them.
fn columns<'a>(
    rows: &'a [BatchRow],
    values: impl Fn(&'a BatchRow) -> &'a [NamedValue],
) -> Vec<Column<'a>> {
    let mut columns: Vec<Column> = Vec::new();
    for value in rows.iter().flat_map(values) {
        let column = (value.name.as_str(), value.unit.as_str());
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    columns
}

fn line(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| csv_cell(cell)).collect();
    format!("{}\n", cells.join(","))
}
