//! What the fitted rows never excite and the held-out rows ask for.
//!
//! A parameter along which the cost of the fitted rows is flat can take any value there, and where held-out rows depend on
//! it their error would be arbitrary. So it takes the value of that flat range which suits the held-out rows best: for the
//! base model and for every rival alike, and the report says so.

use super::measurements::Measurements;
use super::simulation::Compared;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Interrupt, Problem, reference};
use crate::model::{Output, Parameter};
use crate::search::polish::{Flat, PolishOptions, within_flats};
use crate::search::{Fit, Stoppable};
use std::sync::Arc;

/// A parameter that the held-out rows had to set.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexcited {
    /// The parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// The values that make no difference to the fitted rows: from here
    pub low: f64,
    /// to here.
    pub high: f64,
    /// The value that suits the held-out rows best.
    pub value: f64,
    /// Held-out rows that depend on which of these values it has.
    pub rows: usize,
    /// The record that has most of them.
    pub record: String,
    /// Its time from the first of them to the last, s.
    pub time: (f64, f64),
}

/// The values of `problem`'s free parameters, of which those in `flats` suit the held-out records best, and the flats on which
/// these records depend.
pub(super) fn set_by_held_out(
    problem: &Problem,
    interrupt: &Interrupt,
    values: &[f64],
    flats: &[Flat],
    held_out: &Arc<Data>,
    options: &PolishOptions,
) -> (Vec<f64>, Vec<Flat>) {
    let held = Problem {
        data: held_out.clone(),
        ..problem.clone()
    };
    let values_held = held.values();
    if flats.is_empty() || values_held == 0 {
        return (values.to_vec(), Vec::new());
    }
    let mut stoppable = Stoppable {
        problem: &held,
        interrupt,
    };
    within_flats(
        &mut stoppable,
        values_held,
        &problem.free(),
        values,
        flats,
        options,
    )
}

/// Lets the held-out rows set what the fitted ones leave open, and says what that was.
pub(super) fn set_what_is_open(
    problem: &Problem,
    interrupt: &Interrupt,
    fit: &mut Fit,
    measurements: &Measurements,
) -> Vec<Unexcited> {
    let Some((polished, _)) = &mut fit.polished else {
        return Vec::new();
    };
    if polished.flat.is_empty() {
        return Vec::new();
    }
    let records = &measurements.hold_out;
    let held_out = Arc::new(Data::Series(records.clone()));
    let options = PolishOptions::default();
    let (values, asked) = set_by_held_out(
        problem,
        interrupt,
        &polished.values,
        &polished.flat,
        &held_out,
        &options,
    );
    polished.values = values;
    for flat in &asked {
        polished.at_bound[flat.parameter] = None;
    }
    let one = |flat| Unexcited::new(problem, &polished.values, flat, records);
    asked.iter().map(one).collect()
}

impl Unexcited {
    /// What a report says of the parameter that is flat over `flat` and that held-out `records` have set to its value among
    /// `values`.
    fn new(problem: &Problem, values: &[f64], flat: &Flat, records: &[Series]) -> Self {
        let free = problem.free();
        let Parameter { name, unit, .. } = &free[flat.parameter];
        let simulated = |value: f64| {
            let mut values = values.to_vec();
            values[flat.parameter] = value;
            let all = problem.complete(&values, |fixed| fixed);
            reference::trajectories(&problem.structure, &all, records)
        };
        let (low, high) = (simulated(flat.low), simulated(flat.high));
        let (low, high) = (Compared::all(records, &low), Compared::all(records, &high));
        let mut found = Self {
            parameter: name.clone(),
            unit: unit.clone(),
            low: flat.low,
            high: flat.high,
            value: values[flat.parameter],
            rows: 0,
            record: String::new(),
            time: (0.0, 0.0),
        };
        let mut most = 0;
        for (low, high) in low.iter().zip(high) {
            let differs = |row: &usize| {
                let apart = |&output: &Output| {
                    let change = low.simulated[*row][output] - high.simulated[*row][output];
                    let counts = low.series.measured[output];
                    counts && change * change * problem.scale[output] > 1.0
                };
                low.series.samples[*row].weight > 0.0
                    && problem.structure.observed.iter().any(apart)
            };
            let rows: Vec<usize> = (0..low.series.samples.len()).filter(differs).collect();
            found.rows += rows.len();
            if rows.len() > most {
                most = rows.len();
                found.record = low.series.name.clone();
                found.time = (low.series.time[rows[0]], low.series.time[rows[most - 1]]);
            }
        }
        found
    }

    /// In words, for a report.
    pub fn describe(&self) -> String {
        let Self {
            parameter,
            unit,
            low,
            high,
            value,
            rows,
            record,
            time,
        } = self;
        let (from, to) = time;
        let asked = match rows {
            0 => "No held-out row alone depends on it, all together do".to_string(),
            _ => format!(
                "{rows} held-out rows depend on it (in {record} from {from:.3} to {to:.3} s)"
            ),
        };
        format!(
            "the fitted rows do not determine {parameter}: between {low:.4} and {high:.4} {unit} it makes no difference to them. \
             {asked}: it was set to {value:.4} {unit} by these, for the base model and every rival alike. Fit rows that excite it \
             as well"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_depend_on_it_together_alone_are_not_counted_as_none() {
        let mut found = Unexcited {
            parameter: "stiction".into(),
            unit: "V".into(),
            low: 0.0,
            high: 0.029,
            value: 0.01,
            rows: 0,
            record: String::new(),
            time: (0.0, 0.0),
        };
        let said = found.describe();
        assert!(
            said.contains(
                "No held-out row alone depends on it, all together do: it was set to 0.0100 V"
            ),
            "{said}"
        );
        (found.rows, found.record, found.time) = (3, "bench".into(), (1.0, 2.0));
        let said = found.describe();
        assert!(
            said.contains(
                "3 held-out rows depend on it (in bench from 1.000 to 2.000 s): it was set"
            ),
            "{said}"
        );
    }
}
