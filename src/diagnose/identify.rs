//! From records to a diagnosed model: fit, score on the hold-out, look at what is left.

use super::score::{Compared, errors};
use super::{Noise, Remaining, Residuals, noise_floor, remaining};
use crate::Result;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Evaluator, Problem, Score, reference};
use crate::model::{Output, Parameter, Structure};
use crate::record::{HOLD_OUT, Record};
use crate::search::{Fit, Plan, fit};
use std::collections::BTreeMap;

/// Records cut into what is fitted and what is held out.
#[derive(Debug, Clone)]
pub struct Measurements {
    /// Fitted.
    pub fit: Vec<Series>,
    /// Never fitted. Rows of weight 0 run the simulation in.
    pub hold_out: Vec<Series>,
}

impl Measurements {
    /// All of `records` are fitted where there are records to hold out; otherwise the last 30 % of each are held out.
    ///
    /// # Errors
    /// A record lacks a channel that the structure needs, or has it in another unit.
    pub fn new(
        records: &[Record],
        hold_out: &[Record],
        structure: &Structure,
        rate: f64,
    ) -> Result<Self> {
        let series = |record: &Record| {
            let mut series = Series::from_record(record, structure)?;
            series.set_steps(rate, 1);
            Ok(series)
        };
        let mut fit = records
            .iter()
            .map(series)
            .collect::<Result<Vec<Series>>>()?;
        if !hold_out.is_empty() {
            let hold_out = hold_out.iter().map(series).collect::<Result<_>>()?;
            return Ok(Self { fit, hold_out });
        }
        let mut held = fit.clone();
        for ((record, fit), held) in records.iter().zip(&mut fit).zip(&mut held) {
            let split = record.split(HOLD_OUT);
            fit.time.truncate(split);
            fit.samples.truncate(split);
            for sample in &mut held.samples[..split] {
                sample.weight = 0.0;
            }
        }
        Ok(Self {
            fit,
            hold_out: held,
        })
    }
}

/// A residual this many times the noise floor is not noise, whatever it does or does not correlate with.
const ABOVE_NOISE: f64 = 2.0;

/// A fit (%) beyond which the residual is that of the integrator, not of the model.
const EXACT: f64 = 99.99;

/// Errors on fitted and on held-out data, by channel.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Sides {
    /// On the data that was fitted.
    pub fit: BTreeMap<String, Score>,
    /// On data never fitted; empty where none was held out.
    pub hold_out: BTreeMap<String, Score>,
}

/// A model with what the data say of it.
#[derive(Debug, Clone)]
pub struct Identified {
    /// The structure, its parameters and the fitted data.
    pub problem: Problem,
    /// The fit.
    pub fit: Fit,
    /// Values of all parameters.
    pub values: Vec<f64>,
    /// The records.
    pub measurements: Measurements,
    /// Its errors.
    pub errors: Sides,
    /// Each observed channel's noise.
    pub noise: BTreeMap<String, Noise>,
    /// What each observed channel's residual on the fitted data still depends on.
    pub remaining: BTreeMap<String, Remaining>,
    /// Largest change of each channel when the integration steps are halved, in its unit.
    pub integration_error: BTreeMap<String, f64>,
}

/// Fits `structure` to the measurements, and looks at the residual.
///
/// # Errors
/// If the search fails: see [`fit`].
pub fn identify(
    structure: Structure,
    parameters: Vec<Parameter>,
    measurements: Measurements,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    progress: &mut dyn FnMut(usize),
) -> Result<Identified> {
    let mut problem = Problem::new(
        structure,
        parameters,
        Data::Series(measurements.fit.clone()),
    );
    problem.scale = Output::ALL.map(|output| 1.0 / variance(&measurements.fit, output));
    let fit = fit(&problem, evaluator, plan, progress)?;
    let values = problem.complete(fit.values(), |fixed| fixed);
    let structure = &problem.structure;
    let fitted = Compared::all(structure, &values, &measurements.fit);
    let held = Compared::all(structure, &values, &measurements.hold_out);
    let errors = Sides {
        fit: errors(structure, &fitted),
        hold_out: errors(structure, &held),
    };
    let known = Known::new(&fitted);
    let mut noise = BTreeMap::new();
    let mut left = BTreeMap::new();
    let mut integration_error = BTreeMap::new();
    let finer = problem.refined(2);
    let Data::Series(finer) = &*finer.data else {
        unreachable!("records were given")
    };
    let finer = reference::trajectories(structure, &values, finer);
    let mut residuals = Vec::new();
    for &output in &structure.observed {
        let rows: Vec<(f64, f64, f64)> = fitted
            .iter()
            .flat_map(|compared| compared.rows(output))
            .collect();
        let measured: Vec<f64> = rows.iter().map(|row| row.1).collect();
        let residual: Vec<f64> = rows.iter().map(|row| row.1 - row.2).collect();
        let name = output.name().to_owned();
        let floor = noise_floor(&known.starts, &known.command, &measured, &residual);
        noise.insert(name.clone(), floor);
        let exact = errors.fit[&name]
            .fit_percent
            .is_some_and(|percent| percent > EXACT);
        if exact {
            left.insert(name.clone(), Remaining::nothing());
        } else {
            residuals.push((name.clone(), residual));
        }
        let pairs = fitted
            .iter()
            .flat_map(|compared| &compared.simulated)
            .zip(finer.iter().flatten());
        let change = pairs
            .map(|(a, b)| (a[output as usize] - b[output as usize]).abs())
            .fold(0.0, f64::max);
        integration_error.insert(name, change);
    }
    let channels: Vec<&[f64]> = residuals
        .iter()
        .map(|(_, residual)| &residual[..])
        .collect();
    let rest = remaining(
        &Residuals {
            channels: &channels,
            starts: &known.starts,
            time: &known.time,
            command: &known.command,
            known: &[("simulated spool", &known.spool)],
        },
        plan.seed,
    );
    for ((name, _), mut rest) in residuals.into_iter().zip(rest) {
        rest.structured |= errors.fit[&name].rmse > ABOVE_NOISE * noise[&name].value;
        left.insert(name, rest);
    }
    drop((fitted, held));
    Ok(Identified {
        errors,
        noise,
        remaining: left,
        integration_error,
        values,
        fit,
        measurements,
        problem,
    })
}

/// What is known of the rows that count, one record after another.
struct Known {
    starts: Vec<usize>,
    time: Vec<f64>,
    command: Vec<f64>,
    spool: Vec<f64>,
}

impl Known {
    fn new(fitted: &[Compared]) -> Self {
        let mut known = Self {
            starts: Vec::new(),
            time: Vec::new(),
            command: Vec::new(),
            spool: Vec::new(),
        };
        for compared in fitted {
            known.starts.push(known.time.len());
            let series = compared.series;
            let rows = series
                .time
                .iter()
                .zip(&series.samples)
                .zip(&compared.simulated);
            for ((time, sample), simulated) in rows.filter(|((_, sample), _)| sample.weight > 0.0) {
                known.time.push(*time);
                known.command.push(sample.input[0]);
                known.spool.push(simulated[Output::Spool as usize]);
            }
        }
        known
    }
}

/// Variance of an output over all records; 1 where it does not vary.
fn variance(records: &[Series], output: Output) -> f64 {
    let values = || {
        records
            .iter()
            .flat_map(|record| &record.samples)
            .map(|sample| sample.target[output as usize])
    };
    let count = values().count() as f64;
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    if variance > 0.0 { variance } else { 1.0 }
}
