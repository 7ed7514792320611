//! What looks wrong in a file.

use super::inspection::{Inspected, Inspection, Signals};
use super::targets::COMMAND;
use super::timing::Timing;
use crate::record::text::{count, quoted};

/// Intervals that vary by more than this fraction are worth a warning.
const UNEVEN: f64 = 0.05;

/// What looks wrong but need not be, with its place.
pub(super) fn suspicions(signals: &Signals<'_>, inspection: &Inspection) -> Vec<String> {
    let Signals { table, targets } = signals;
    let mut found = Vec::new();
    let used = |column: &&Inspected| column.taken_as.is_some() || column.proposed.is_some();
    let columns = inspection.columns.iter().enumerate();
    for (index, column) in columns.filter(|(_, column)| used(column)) {
        let name = quoted(&column.name);
        if let Some((row, _)) = table.columns[index].odd.first() {
            let odd = table.columns[index].odd.len();
            let cells = count(odd, "cell");
            let place = table.place(*row, index);
            found.push(format!("{cells} without a number, first at {place}"));
        }
        // A command stays where it is told to.
        let is_command = targets
            .get(&COMMAND)
            .is_some_and(|&(command, _)| command == index);
        for (share, end) in column.values.clipped.iter().zip(["smallest", "largest"]) {
            if let Some(share) = share.filter(|_| !is_command) {
                let percent = 100.0 * share;
                found.push(format!(
                    "column {name} stays at its {end} value for {percent:.1} % of its rows: is it clipped?"
                ));
            }
        }
    }
    for (channel, follows) in &inspection.follows {
        if follows.rows < 0 && follows.is_close() {
            let rows = -follows.rows;
            found.push(format!(
                "{channel} leads the command by {}: are the two exchanged?",
                count(rows as usize, "row")
            ));
        }
    }
    if let Some(timing) = &inspection.timing {
        let Timing {
            interval,
            jitter,
            gaps,
            not_rising,
            ..
        } = timing;
        if jitter > &(UNEVEN * interval) {
            let percent = 100.0 * jitter / interval;
            found.push(format!("intervals of time vary by {percent:.0} %"));
        }
        if !gaps.is_empty() {
            let missing = gaps
                .iter()
                .fold(0_usize, |sum, gap| sum.saturating_add(gap.missing));
            found.push(format!(
                "{} in time, where {} may be missing",
                count(gaps.len(), "gap"),
                count(missing, "row")
            ));
        }
        if !not_rising.is_empty() {
            found.push(format!(
                "time does not rise at {}",
                count(not_rising.len(), "row")
            ));
        }
    }
    found
}
