//! A fitted model with everything that follows from it: what it gives in every row, its errors, and what it leaves.

use super::input_noise::{Driven, with_what_passes};
use super::known::KnownRows;
use super::left_over::left_over;
use super::measurements::{Measurements, starts};
use super::simulation::{Compared, Errors, Sides, Trajectories, errors, residual};
use super::statistics::bootstrap::mean_square;
use super::statistics::noise::{Noise, NoiseRows, noise_floor};
use super::statistics::residual::Remaining;
use super::unexcited::{Sharpened, Unexcited, set_what_is_open};
use super::verdict::NEAR;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Problem, Score, reference};
use crate::model::{Complete, Output, Outputs};
use crate::search::{Fit, Plan};
use std::collections::BTreeMap;

/// No channel's noise is taken to be smaller than this fraction of its range: no converter of 24 bits resolves it, and
/// single-precision logs do not store it.
const SMALLEST_NOISE: f64 = 6e-8;

/// The integrator may err by this fraction of a channel's deviation, or by its noise: more excuses no model.
pub(super) const TOLERATED: f64 = 1e-4;

/// A noise floor is lowered if what is left falls below this share of it.
const QUIETER: f64 = 0.93;

/// A fitted model with its errors.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The structure, its parameters and the fitted data.
    pub problem: Problem,
    /// The fit.
    pub fit: Fit,
    /// Values of all parameters.
    pub values: Complete<f64>,
    /// What the model gives for the records that were fitted and for those held out.
    pub simulated: Sides<Trajectories>,
    /// Its errors.
    pub errors: Sides<Errors>,
    /// What each observed channel's residual on the fitted data still depends on.
    pub remaining: BTreeMap<String, Remaining>,
    /// The noise by which that was tested, with what this model makes of noisy commands; empty where it was not.
    pub(super) tested_by: BTreeMap<String, Noise>,
    /// Parameters that the fitted rows leave open and the held-out ones had to set.
    pub unexcited: Vec<Unexcited>,
    /// What all parameters were moved by to follow the held-out rows, if they were.
    pub sharpened: Option<Sharpened>,
    /// Largest change of each channel when the integration steps are halved, in its unit.
    pub integration_error: BTreeMap<String, f64>,
}

impl Fitted {
    /// `fit` of `problem`, whose data are the fitted records of `measurements`. Where the `noise` is known the residual is
    /// tested.
    pub(super) fn new(
        problem: Problem,
        mut fit: Fit,
        measurements: &Measurements,
        noise: Option<&BTreeMap<String, Noise>>,
        plan: &Plan,
    ) -> Self {
        let (unexcited, sharpened) =
            set_what_is_open(&problem, plan.memory.interrupt(), &mut fit, measurements);
        let values = problem.complete(fit.values(), |fixed| fixed);
        let simulate =
            |records: &[Series]| reference::trajectories(&problem.structure, &values, records);
        let mut result = Self {
            simulated: Sides {
                fit: simulate(&measurements.fit),
                hold_out: simulate(&measurements.hold_out),
            },
            fit,
            values,
            errors: Sides::default(),
            remaining: BTreeMap::new(),
            tested_by: BTreeMap::new(),
            unexcited,
            sharpened,
            integration_error: BTreeMap::new(),
            problem,
        };
        let compared = result.beside(measurements);
        let structure = &result.problem.structure;
        result.errors = Sides {
            fit: errors(structure, &compared.fit),
            hold_out: errors(structure, &compared.hold_out),
        };
        result.integration_error = result.largest_changes();
        if let Some(noise) = noise {
            result.test_residual(measurements, noise);
        }
        result
    }

    /// The records beside what the model gives for them.
    pub fn beside<'a>(&'a self, measurements: &'a Measurements) -> Sides<Vec<Compared<'a>>> {
        Sides {
            fit: Compared::all(&measurements.fit, &self.simulated.fit),
            hold_out: Compared::all(&measurements.hold_out, &self.simulated.hold_out),
        }
    }

    /// The model, and what it gives for the records that were fitted.
    fn driven(&self) -> Driven<'_> {
        Driven {
            structure: &self.problem.structure,
            values: &self.values,
            simulated: &self.simulated.fit,
        }
    }

    /// Tests what is left in the residual of the fitted rows.
    pub(super) fn test_residual(
        &mut self,
        measurements: &Measurements,
        noise: &BTreeMap<String, Noise>,
    ) {
        let noise = with_what_passes(&self.driven(), measurements, noise.clone());
        let compared = self.beside(measurements).fit;
        let observed = self.problem.structure.observed.iter().copied();
        let (exact, tested): (Vec<Output>, Vec<Output>) =
            observed.partition(|&output| self.is_exact(output));
        let mut rest = left_over(&compared, &tested, &noise);
        for (output, rest) in tested.iter().zip(&mut rest) {
            let noise = &noise[output.name()];
            let floor = noise.value.max(self.least_error(*output));
            let above = |score: &Score| score.rmse > noise.method.margin() * floor;
            rest.structured |= self.scores(*output).any(above);
        }
        let nothing = exact.iter().map(|_| Remaining::nothing());
        let names = exact.iter().chain(&tested).map(|output| output.name());
        self.remaining = names.map(str::to_owned).zip(nothing.chain(rest)).collect();
        self.tested_by = noise;
    }

    /// Each observed channel's noise floor: what is quiet in the measurement, or in the residual.
    pub(super) fn noise(
        &self,
        measurements: &Measurements,
        of_residual: bool,
    ) -> BTreeMap<String, Noise> {
        let all = self.beside(measurements).fit;
        let noise = noise_floors(&all, &self.problem.structure.observed, of_residual);
        with_what_passes(&self.driven(), measurements, noise)
    }

    /// Whether any channel's residual has structure.
    pub fn structured(&self) -> bool {
        self.remaining.values().any(|left| left.structured)
    }

    /// Whether the model follows what was fitted to its `noise`, and not what is held out.
    pub(super) fn fails_on_held_out_rows_alone(&self, noise: &BTreeMap<String, Noise>) -> bool {
        is_near(&self.errors.fit, noise) && !is_near(&self.errors.hold_out, noise)
    }

    /// Whether the model follows what was fitted, and what is held out, nearly to its `noise`, and that is no motion in rests.
    pub(super) fn is_near(&self, noise: &BTreeMap<String, Noise>) -> bool {
        let sides = [&self.errors.fit, &self.errors.hold_out];
        let moves = noise.values().any(Noise::may_be_a_motion);
        !moves && sides.into_iter().all(|side| is_near(side, noise))
    }

    /// Whether the model follows the data, fitted and held out, to within the integrator's error.
    pub(super) fn exact(&self) -> bool {
        let observed = &self.problem.structure.observed;
        observed.iter().all(|&output| self.is_exact(output))
    }

    /// The same of one output.
    fn is_exact(&self, output: Output) -> bool {
        let least = self.least_error(output);
        self.scores(output).all(|score| score.rmse <= least)
    }

    /// The errors of one output on the sides that have rows.
    fn scores(&self, output: Output) -> impl Iterator<Item = &Score> {
        let sides = [&self.errors.fit, &self.errors.hold_out];
        sides
            .into_iter()
            .filter_map(move |side| side.get(output.name()))
    }

    /// What each observed channel changes by, in each of the fitted rows, when the integration steps are halved.
    pub(super) fn changes_of_half_steps(&self) -> impl Iterator<Item = (Output, Vec<f64>)> {
        let structure = &self.problem.structure;
        let refined = self.problem.refined(2);
        let fine = reference::trajectories(structure, &self.values, records(&refined));
        structure.observed.iter().map(move |&output| {
            let pairs = self
                .simulated
                .fit
                .iter()
                .flatten()
                .zip(fine.iter().flatten());
            let changes = pairs.map(|(a, b)| a[output] - b[output]);
            (output, changes.collect())
        })
    }

    /// Largest change of each observed channel when the integration steps of the fitted rows are halved.
    fn largest_changes(&self) -> BTreeMap<String, f64> {
        let largest = |(output, changes): (Output, Vec<f64>)| {
            let largest = changes
                .iter()
                .fold(0.0, |most: f64, change| most.max(change.abs()));
            (output.name().to_owned(), largest)
        };
        self.changes_of_half_steps().map(largest).collect()
    }

    /// An error of an output that says nothing of the model: the integrator's own, or what no file resolves.
    pub(super) fn least_error(&self, output: Output) -> f64 {
        let range = variance(records(&self.problem), output).sqrt();
        excused(self.integration_error[output.name()], range)
    }
}

/// The noise floor of each of the channels `observed` of what is `compared`: what is quiet in the measurement, or in the residual.
pub(super) fn noise_floors(
    compared: &[Compared],
    observed: &[Output],
    of_residual: bool,
) -> BTreeMap<String, Noise> {
    let one = |&output: &Output| {
        let measuring = Compared::measuring(compared, output);
        let known = KnownRows::new(&measuring);
        let residual = residual(&measuring, output);
        let rows = measuring.iter().flat_map(|one| one.rows(output));
        let measured: Vec<f64> = rows.map(|row| row.1).collect();
        let quiet = if of_residual { &residual } else { &measured };
        let beside: Vec<Vec<f64>> = observed
            .iter()
            .filter(|other| **other != output)
            .map(|&other| (other, Compared::measuring(compared, other)))
            .filter(|(_, measuring)| KnownRows::new(measuring).time == known.time)
            .map(|(other, measuring)| self::residual(&measuring, other))
            .collect();
        let rows = NoiseRows {
            starts: &known.starts,
            time: &known.time,
            command: &known.command,
            measured: &measured,
            residual: &residual,
            beside: &beside,
        };
        (output.name().to_owned(), noise_floor(rows, quiet))
    };
    observed.iter().map(one).collect()
}

/// Whether one of the channels' noise is plainly less in the first than in the second.
pub(super) fn quieter(noise: &BTreeMap<String, Noise>, before: &BTreeMap<String, Noise>) -> bool {
    let less = |(name, before): (&String, &Noise)| noise[name].value < QUIETER * before.value;
    before.iter().any(less)
}

/// What of an error in a channel of this `range` is no model's, where halving the integration steps changes it by as much as
/// `change`. A model whose motion depends on the steps by more than is tolerated follows nothing by that.
fn excused(change: f64, range: f64) -> f64 {
    change.clamp(SMALLEST_NOISE * range, TOLERATED * range)
}

/// Whether the error of every channel is near its `noise`.
fn is_near(errors: &Errors, noise: &BTreeMap<String, Noise>) -> bool {
    let mut errors = errors.iter();
    errors.all(|(name, error)| error.rmse < NEAR * noise[name].value)
}

/// The largest of what the error of each of `observed` is at least over its `floor`, with 97.5 % confidence.
pub(super) fn least_ratio(
    compared: &[Compared],
    observed: &[Output],
    floor: impl Fn(Output) -> f64,
) -> f64 {
    let ratios = observed.iter().map(|&output| {
        let measuring = Compared::measuring(compared, output);
        let starts = starts(measuring.iter().map(|one| one.series));
        let least = mean_square(&residual(&measuring, output), &starts).least_root();
        if least > 0.0 {
            least / floor(output)
        } else {
            0.0
        }
    });
    ratios.fold(0.0, f64::max)
}

fn records(problem: &Problem) -> &[Series] {
    match &*problem.data {
        Data::Series(records) => records,
        Data::Tones(_) => unreachable!("records were given"),
    }
}

/// What one unit of squared error in each output counts for where it has this `noise` in `records`.
pub(super) fn weights(noise: &BTreeMap<String, Noise>, records: &[Series]) -> Outputs<f64> {
    Outputs::from_fn(|output| {
        let range = variance(records, output).sqrt();
        let noise = noise.get(output.name());
        noise.map_or(0.0, |noise| {
            noise.value.max(SMALLEST_NOISE * range).powi(-2)
        })
    })
}

/// Variance of an output over all records; 1 where it does not vary.
pub(super) fn variance(records: &[Series], output: Output) -> f64 {
    let values = || {
        let measuring = records.iter().filter(|record| record.measured[output]);
        measuring
            .flat_map(|record| &record.samples)
            .map(|sample| sample.target[output])
    };
    let count = values().count() as f64;
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    if variance > 0.0 { variance } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_integrator_that_errs_by_volts_excuses_nothing() {
        assert_eq!(excused(2.785, 5.0), TOLERATED * 5.0);
        assert_eq!(excused(1e-5, 5.0), 1e-5);
        assert_eq!(excused(0.0, 5.0), SMALLEST_NOISE * 5.0);
    }
}
