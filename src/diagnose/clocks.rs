//! Clocks of records that are files of their own. What hums runs on while the logger is off, so that each file has another phase
//! of it, of which the model has one. The time of the later records is shifted by less than half a period, until all are in phase.

use super::fitted::Fitted;
use super::identified::Identified;
use super::problem::IdentificationProblem;
use super::simulation::{Compared, stretches};
use super::statistics::line::{Hum, common_hum};
use crate::model::Output;

/// Records that are out of phase by less than this share of a period are in phase.
const IN_PHASE: f64 = 0.01;

/// `problem` with the clocks of its records set, where in what `fitted` leaves all of them have one hum, and not in phase;
/// otherwise `None`.
pub(super) fn with_clocks_set(
    problem: &IdentificationProblem,
    fitted: &Fitted,
) -> Option<IdentificationProblem> {
    let measurements = &problem.measurements;
    if measurements.clocks.iter().any(|shift| *shift != 0.0) {
        return None;
    }
    let beside = fitted.beside(measurements);
    let mut records = vec![Vec::new(); measurements.records.len()];
    let of_record = &measurements.of_record;
    let all = beside.fit.into_iter().zip(&of_record.fit);
    for (one, &of) in all.chain(beside.hold_out.into_iter().zip(&of_record.hold_out)) {
        records[of].push(one);
    }
    let Common {
        output,
        measuring,
        hum,
    } = hum_of(&records, &fitted.problem.structure.observed)?;
    let apart = |turns: &f64| turns.abs() > IN_PHASE;
    hum.turns.iter().any(apart).then(|| {
        let mut set = problem.clone();
        let all = &mut set.measurements;
        let first = all.records[measuring[0]].name.clone();
        let turns = measuring.iter().zip(&hum.turns);
        for (&record, turns) in turns.filter(|(_, turns)| apart(turns)) {
            let seconds = turns / hum.frequency;
            all.shift_clock(record, seconds);
            all.beginnings.push(format!(
                "{} hums with {:.3} Hz in its {} as {first} does, out of phase: its time is shifted by {:.3} ms",
                all.records[record].name,
                hum.frequency,
                output.name(),
                1e3 * seconds
            ));
        }
        set
    })
}

/// By how many s the time of the second of two sides has to be shifted, so that what hums in what the base model leaves of both
/// is in phase; 0 where nothing does.
pub(crate) fn seconds_apart(sides: [&Identified; 2]) -> f64 {
    let records = sides.map(|side| {
        let beside = side.before.beside(&side.measurements);
        [beside.fit, beside.hold_out].concat()
    });
    let common = hum_of(&records, &sides[0].before.problem.structure.observed);
    common.map_or(0.0, |Common { hum, .. }| hum.turns[1] / hum.frequency)
}

/// A hum that several records have in common.
struct Common {
    output: Output,
    /// Which of the records measure that.
    measuring: Vec<usize>,
    /// Its turns are of those.
    hum: Hum,
}

/// The strongest hum that several records have in common, each given in parts.
fn hum_of(records: &[Vec<Compared>], observed: &[Output]) -> Option<Common> {
    let of = |&output: &Output| {
        let of_record = |parts: &Vec<Compared>| {
            stretches(parts, output, |part, row| {
                parts[part].series.samples[row].input.command
            })
        };
        let parts = records.iter().map(of_record);
        let measuring = parts.enumerate().filter(|(_, parts)| !parts.is_empty());
        let (measuring, parts): (Vec<usize>, Vec<_>) = measuring.unzip();
        let hum = common_hum(&parts)?;
        Some(Common {
            output,
            measuring,
            hum,
        })
    };
    let hums = observed.iter().filter_map(of);
    hums.max_by(|a, b| a.hum.stands_out.total_cmp(&b.hum.stands_out))
}
