//! Levenberg-Marquardt within bounds.

use super::coordinates::Coordinates;
use super::step::bounded_step;
use super::{LeastSquares, Polished, Stop};
use crate::model::Parameter;
use crate::{Error, Result};
use nalgebra::DVector;

/// A step must achieve at least this fraction of the decrease that the linearised model predicts.
const MIN_GAIN: f64 = 1e-4;
/// Less damping would let rounding errors move parameters that the data do not determine.
const MIN_DAMPING: f64 = f64::EPSILON;

/// When [`polish`] stops, and how cautiously it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolishOptions {
    /// Largest number of trial steps, accepted or not.
    pub max_iterations: usize,
    /// Converged when the cosine of the angle between the residual and every column of the Jacobian is below this.
    pub gradient_tolerance: f64,
    /// Converged when a step changes every parameter by less than this fraction of its value.
    pub step_tolerance: f64,
    /// Converged when a step lowers the cost by less than this fraction, as predicted and in fact.
    pub cost_tolerance: f64,
    /// Damping of the first step, relative to the squared column norms of the Jacobian.
    pub damping: f64,
    /// The end of a range in which the cost is flat is found to within this share of the distance from the result to the bound.
    pub edge_tolerance: f64,
}

impl Default for PolishOptions {
    fn default() -> Self {
        Self {
            max_iterations: 200,
            gradient_tolerance: 1e-10,
            step_tolerance: 1e-9,
            cost_tolerance: 1e-9,
            damping: 1e-3,
            edge_tolerance: 2.5e-4,
        }
    }
}

/// Finds the local minimum of the cost next to `start` within the bounds of `parameters`.
///
/// Levenberg-Marquardt with the scaling of Moré (1978, "The Levenberg-Marquardt algorithm: implementation and
/// theory") and the damping control of Nielsen (1999, "Damping parameter in Marquardt's method"). Each step solves
/// the damped linear problem exactly within the bounds, so a parameter pushed against its bound stays there and can
/// leave again. A step that raises the cost or diverges is rejected. Fixed parameters keep their value in `start`.
///
/// Fails if the simulation diverges at `start`.
pub fn polish(
    problem: &mut dyn LeastSquares,
    parameters: &[Parameter],
    start: &[f64],
    options: &PolishOptions,
) -> Result<Polished> {
    let space = Coordinates::new(parameters, start);
    let mut position = space.to_search(start);
    let mut values = space.to_values(&position);
    let mut triangle = space.triangle(problem, &values).ok_or_else(|| {
        Error::failed(
            "the simulation diverges at the candidate to be polished",
            "start from a candidate with a finite cost",
        )
    })?;
    let mut cost = triangle.cost();
    let mut norms = DVector::zeros(parameters.len());
    let mut damping = options.damping;
    let mut growth = 2.0;
    let mut iterations = 0;
    let mut evaluations = 1;

    let stop = loop {
        if space.stationarity(&triangle, &position) <= options.gradient_tolerance {
            break Stop::Gradient;
        }
        if iterations == options.max_iterations {
            break Stop::Iterations;
        }
        iterations += 1;
        norms.zip_apply(&triangle.column_norms(), |most: &mut f64, norm| {
            *most = most.max(norm)
        });
        let (low, high) = space.room(&position);
        let step = bounded_step(&triangle, damping, &norms, &low, &high);
        let trial = space.moved(&position, &step);
        let trial_values = space.to_values(&trial);
        let predicted = triangle.predicted_decrease(&step);
        let small_step = space.is_small(&position, &step, options.step_tolerance);
        if trial_values == values {
            break Stop::Step;
        }

        evaluations += 1;
        let most = cost * (1.0 + options.cost_tolerance);
        let trial_cost = problem.cost_up_to(&trial_values, most);
        let trial_cost = trial_cost.unwrap_or(f64::INFINITY);
        let decrease = cost - trial_cost;
        let gain = decrease / predicted;
        let converged = predicted.max(decrease.abs()) <= options.cost_tolerance * cost;
        let next = if decrease > 0.0 && gain > MIN_GAIN {
            evaluations += 1;
            space.triangle(problem, &trial_values)
        } else {
            None
        };
        if let Some(next) = next {
            (position, values, triangle, cost) = (trial, trial_values, next, trial_cost);
            let factor = 1.0 - (2.0 * gain.min(1.0) - 1.0).powi(3);
            damping = (damping * factor.max(1.0 / 3.0)).max(MIN_DAMPING);
            growth = 2.0;
        } else {
            damping *= growth;
            growth *= 2.0;
        }
        if converged {
            break Stop::Cost;
        }
        if small_step {
            break Stop::Step;
        }
    };

    Ok(Polished {
        at_bound: space.at_bound(&position),
        values,
        cost,
        iterations,
        evaluations,
        stop,
        triangle,
        flat: Vec::new(),
    })
}
