//! What the fitted rows do not determine, or less closely than the held-out rows ask for.
//!
//! A parameter along which the cost of the fitted rows is flat can take any value there, and where held-out rows depend on
//! it their error would be arbitrary. So it takes the value of that flat range which suits the held-out rows best. Where a model
//! follows the fitted rows and its error on the held-out ones is larger, it may be wrong there, or its parameters are known
//! less closely than these rows ask for (Chow 1960, "Tests of equality between sets of coefficients in two linear regressions"):
//! then all parameters move within what the fitted rows allow. Both for the base model and for every rival alike, and the report
//! says so.

use super::measurements::Measurements;
use super::simulation::Compared;
use super::verdict::NEAR;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Interrupt, Problem, reference};
use crate::model::{Output, Parameter};
use crate::search::polish::{Flat, PolishOptions, polish, within_flats};
use crate::search::{Fit, Stoppable};
use statrs::distribution::{ChiSquared, ContinuousCDF};
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

/// Mean squared residual, in units of the noise, up to which a model follows the fitted rows.
const FOLLOWED: f64 = NEAR * NEAR;
/// What the cost of the fitted rows may rise by when parameters move within what these rows allow: three standard deviations.
const SURE: f64 = 0.9973;
/// So many times that after one step are more than further ones take back.
const FAR_BEYOND: f64 = 10.0;

/// What the held-out rows have set.
pub(super) struct Set {
    /// Values of the free parameters.
    pub(super) values: Vec<f64>,
    /// The flats on which the held-out rows depend.
    pub(super) flats: Vec<Flat>,
    /// Whether all parameters moved.
    pub(super) sharpened: bool,
}

/// The values of `problem`'s free parameters, of which those in `flats` suit the held-out records best, and all others as well
/// where only then the held-out rows are followed as the fitted ones are.
pub(super) fn set_by_held_out(
    problem: &Problem,
    interrupt: &Interrupt,
    values: &[f64],
    flats: &[Flat],
    held_out: &Arc<Data>,
    options: &PolishOptions,
) -> Set {
    let mut set = Set {
        values: values.to_vec(),
        flats: Vec::new(),
        sharpened: false,
    };
    let held = Problem {
        data: held_out.clone(),
        ..problem.clone()
    };
    let count = held.values();
    if count == 0 {
        return set;
    }
    let mut stoppable = Stoppable::new(&held, interrupt);
    if !flats.is_empty() {
        let free = problem.free();
        (set.values, set.flats) =
            within_flats(&mut stoppable, count, &free, values, flats, options);
    }
    if let Some(sharper) = sharpened(problem, &held, interrupt, &set.values, options) {
        (set.values, set.sharpened) = (sharper, true);
    }
    set
}

/// Values of the free parameters near `values` with which `problem` follows its rows as closely as with these, but for what
/// chance makes of its cost, and those of `held` as well; `None` where these are followed already, or cannot be.
fn sharpened(
    problem: &Problem,
    held: &Problem,
    interrupt: &Interrupt,
    values: &[f64],
    options: &PolishOptions,
) -> Option<Vec<f64>> {
    let (rows, held_rows) = (problem.values() as f64, held.values() as f64);
    let free = problem.free();
    let cost = reference::cost_up_to(problem, values, FOLLOWED * rows)?;
    let held_cost = reference::cost(held, values)?;
    if held_cost <= FOLLOWED * held_rows {
        return None;
    }
    let (Data::Series(fitted), Data::Series(others)) = (&*problem.data, &*held.data) else {
        return None;
    };
    let all = Problem {
        data: Arc::new(Data::Series([&fitted[..], &others[..]].concat())),
        ..problem.clone()
    };
    let mut stoppable = Stoppable::new(&all, interrupt);
    let mut moved = |from: &[f64], options: &PolishOptions| {
        let polished = polish(&mut stoppable, &free, from, options);
        polished.ok().map(|polished| polished.values)
    };
    let chance = ChiSquared::new(free.len() as f64).expect("there are free parameters");
    let allowed = chance.inverse_cdf(SURE) / rows;
    let allows = |values: &[f64], rise: f64| {
        reference::cost_up_to(problem, values, cost * (1.0 + rise)).is_some()
    };
    // A model that is wrong shows it by its first step.
    let first = PolishOptions {
        max_iterations: 1,
        ..*options
    };
    let begun = moved(values, &first).filter(|begun| allows(begun, FAR_BEYOND * allowed))?;
    let sharper = moved(&begun, options).filter(|sharper| allows(sharper, allowed))?;
    (reference::cost(held, &sharper)? < held_cost).then_some(sharper)
}

/// All parameters, moved within what the fitted rows allow to follow the held-out ones, and that one which moved by the largest
/// share of its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Sharpened {
    /// The parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// Its value before,
    pub from: f64,
    /// and after.
    pub to: f64,
}

/// Lets the held-out rows set what the fitted ones leave open, and says what that was.
pub(super) fn set_what_is_open(
    problem: &Problem,
    interrupt: &Interrupt,
    fit: &mut Fit,
    measurements: &Measurements,
) -> (Vec<Unexcited>, Option<Sharpened>) {
    let Some((polished, _)) = &mut fit.polished else {
        return (Vec::new(), None);
    };
    let records = &measurements.hold_out;
    let held_out = Arc::new(Data::Series(records.clone()));
    let options = PolishOptions::default();
    let set = set_by_held_out(
        problem,
        interrupt,
        &polished.values,
        &polished.flat,
        &held_out,
        &options,
    );
    let before = std::mem::replace(&mut polished.values, set.values);
    for flat in &set.flats {
        polished.at_bound[flat.parameter] = None;
    }
    let one = |flat| Unexcited::new(problem, &polished.values, flat, records);
    let unexcited: Vec<Unexcited> = set.flats.iter().map(one).collect();
    let share = |own: &Parameter, from: f64, to: f64| (own.to_unit(to) - own.to_unit(from)).abs();
    let moved = problem.free().into_iter().zip(before).zip(&polished.values);
    let said = |own: &Parameter| unexcited.iter().any(|one| one.parameter == own.name);
    let moved = moved.filter(|((own, _), _)| !said(own));
    let most = moved.max_by(|((own, a), b), ((other, c), d)| {
        share(own, *a, **b).total_cmp(&share(other, *c, **d))
    });
    let sharpened = most.filter(|_| set.sharpened);
    let sharpened = sharpened.map(|((own, from), &to)| Sharpened {
        parameter: own.name,
        unit: own.unit,
        from,
        to,
    });
    (unexcited, sharpened)
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;
    use crate::model::effects::entry;
    use crate::model::{Complete, Outputs, Structure};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const NOISE: f64 = 0.3;

    /// Steps of ± 9 V times `share` of a loop with a gain of 200/s and what `structure` has beside it, with noise of 0.3 V.
    fn record(structure: &Structure, share: f64, seed: u64) -> Vec<Series> {
        let Data::Series(mut records) = (*workload::actuator(1000).data).clone() else {
            unreachable!()
        };
        let mut parameters = structure.parameters();
        for (name, value) in [("gain", 200.0), ("delay", 0.008)] {
            let own = parameters.iter_mut().filter(|own| own.name == name);
            own.for_each(|own| own.set_nominal(value));
        }
        let values = Complete::nominal(&parameters);
        records[0]
            .samples
            .iter_mut()
            .for_each(|sample| sample.input.command *= share);
        let simulated = reference::trajectories(structure, &values, &records).remove(0);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for (sample, outputs) in records[0].samples.iter_mut().zip(simulated) {
            sample.target = outputs;
            let even = random.random::<f64>() - 0.5;
            sample.target[Output::Spool] += 12f64.sqrt() * NOISE * even;
        }
        records
    }

    /// What small steps and then large ones make of the gain of a loop that has `structure`, if the held-out rows set it.
    fn gain_of(structure: &Structure) -> (f64, Option<f64>) {
        let bare = Structure::actuator(10.0, "V");
        let mut problem = Problem::new(
            bare.clone(),
            bare.parameters(),
            Data::Series(record(structure, 0.04, 1)),
        );
        problem.scale = Outputs::all(NOISE.powi(-2));
        let held = Arc::new(Data::Series(record(structure, 1.0, 2)));
        let options = PolishOptions::default();
        let interrupt = Interrupt::default();
        let mut stoppable = Stoppable::new(&problem, &interrupt);
        let values = polish(&mut stoppable, &problem.free(), &problem.start(), &options)
            .unwrap()
            .values;
        let set = set_by_held_out(&problem, &interrupt, &values, &[], &held, &options);
        (values[0], set.sharpened.then_some(set.values[0]))
    }

    #[test]
    fn held_out_rows_sharpen_what_the_fitted_ones_allow_and_no_model_that_is_wrong() {
        let bare = Structure::actuator(10.0, "V");
        let (fitted, sharper) = gain_of(&bare);
        println!("{fitted} -> {sharper:?}");
        assert!((fitted / 200.0 - 1.0).abs() > 0.05);
        assert!((sharper.unwrap() / 200.0 - 1.0).abs() < 0.01);
        let late = bare.with(entry("delay").unwrap().on(&bare)[0]);
        let (fitted, sharper) = gain_of(&late);
        println!("{fitted} -> {sharper:?}");
        assert_eq!(sharper, None);
    }
}
