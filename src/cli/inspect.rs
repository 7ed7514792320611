//! `servobee inspect`.

use super::reading::ReadingOptions;
use super::table::{number, table};
use servobee::record::inspect::{Gap, Inspected, Inspection, Timing, inspect_as};
use servobee::{Error, Result};
use std::path::PathBuf;

/// Say what a file of measurements holds, what is wrong with it, and which --map makes a record of it
///
/// Reads what identify reads, CSV, Excel and MAT, and also files that identify refuses. A proposal is taken from the names, units
/// and values of the columns and comes with its reason: check it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee inspect bench.csv
  servobee inspect log.mat --map \"out.u=command [V]\"
  servobee inspect run1.csv run2.mat --json")]
pub(super) struct Arguments {
    /// Files to look into; a.csv+b.csv are two of one record
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingOptions,
    /// Print JSON: a list with an object for each file
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let reading = arguments.reading.reading();
    let inspections = arguments
        .files
        .iter()
        .map(|path| inspect_as(path, &reading))
        .collect::<Result<Vec<Inspection>>>()?;
    if arguments.json {
        let json = serde_json::to_string_pretty(&inspections)
            .map_err(|error| Error::failed(format!("no JSON: {error}"), "report this"))?;
        tell!("{json}");
        return Ok(());
    }
    for (index, inspection) in inspections.iter().enumerate() {
        if index > 0 {
            tell!();
        }
        print(inspection);
    }
    Ok(())
}

fn print(inspection: &Inspection) {
    tell!("{}: {}", inspection.path, inspection.format);
    if let Some(timing) = &inspection.timing {
        tell!("{}", times(timing));
        for line in gaps(&timing.gaps) {
            tell!("{line}");
        }
    }
    if let Some(period) = inspection.command_period {
        tell!("The command repeats itself every {} s.", number(period));
    }
    for (channel, follows) in inspection.follows.iter().filter(|(_, f)| f.is_close()) {
        tell!(
            "The {channel} is most like the command {} rows before it (correlation {:.3}).",
            follows.rows,
            follows.correlation
        );
    }
    tell!("\n{}", columns(&inspection.columns));
    for (name, what) in &inspection.others {
        tell!("{name} is no column: {what}");
    }
    tell!();
    for warning in &inspection.warnings {
        tell!("Warning: {warning}");
    }
    if !inspection.proposals.is_empty() {
        tell!("Proposed, to be checked:");
        for proposal in &inspection.proposals {
            tell!("  {}: {}", proposal.map, proposal.reason);
        }
    }
    match (&inspection.problem, &inspection.problem_left) {
        (None, _) => tell!("Ready for identify:\n  {}", inspection.call),
        (Some(problem), None) => {
            tell!("Not ready for identify: {problem}");
            tell!("Ready with what is proposed:\n  {}", inspection.call);
        }
        (Some(problem), Some(left)) => {
            tell!("Not ready for identify: {problem}");
            if left != problem {
                tell!("With what is proposed there is still: {left}");
            }
        }
    }
}

fn times(timing: &Timing) -> String {
    let jitter = match timing.jitter {
        0.0 => "without jitter".into(),
        jitter => format!("jitter {} ms", number(1e3 * jitter)),
    };
    format!(
        "{} s, a row every {} ms ({} Hz), {jitter}",
        number(timing.length),
        number(1e3 * timing.interval),
        number(timing.rate()),
    )
}

/// The first gaps, one a line.
fn gaps(gaps: &[Gap]) -> Vec<String> {
    const MOST: usize = 5;
    let line = |gap: &Gap| {
        format!(
            "Gap after sample {} at {} s: {} missing",
            gap.after + 1,
            number(gap.time),
            gap.missing
        )
    };
    let mut lines: Vec<String> = gaps.iter().take(MOST).map(line).collect();
    if gaps.len() > MOST {
        lines.push(format!("and {} more gaps", gaps.len() - MOST));
    }
    lines
}

fn columns(columns: &[Inspected]) -> String {
    let value = |value: Option<f64>| value.map_or("-".into(), number);
    let row = |column: &Inspected| {
        let values = &column.values;
        let is = match (&column.taken_as, &column.proposed) {
            (Some(taken), _) => taken.clone(),
            (None, Some(proposed)) => format!("{proposed}?"),
            (None, None) => "-".into(),
        };
        let odd: Vec<String> = [
            (values.empty, "empty"),
            (values.text, "text"),
            (values.not_finite, "not finite"),
        ]
        .into_iter()
        .filter(|&(count, _)| count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        let remark = match (values.is_constant(), odd.is_empty()) {
            (true, true) => "constant".into(),
            (true, false) => format!("constant, {}", odd.join(", ")),
            (false, _) => odd.join(", "),
        };
        vec![
            column.name.clone(),
            is,
            column.unit.clone().unwrap_or("-".into()),
            values.rows.to_string(),
            value(values.min),
            value(values.max),
            value(values.step),
            values.levels.to_string(),
            remark,
        ]
    };
    table(
        &[
            "column", "is", "unit", "rows", "min", "max", "step", "levels", "",
        ],
        columns.iter().map(row),
    )
}
