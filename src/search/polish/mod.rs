//! Levenberg-Marquardt polish of a candidate, and what the data say about its parameters.
//!
//! With residuals r(θ) = measured − simulated, weighted, and J = ∂r/∂θ, [`polish`] minimises the sum of squares
//! |r|². Everything is done in search coordinates u: the value itself on a linear scale, its logarithm on a
//! logarithmic one. The Jacobian is never stored: its rows stream into a [`Triangle`], from which come the steps, the
//! [`Uncertainty`] of each parameter, and the [`Unidentifiable`] ones; [`profile()`] follows the cost itself where its
//! curvature says too little.

mod autocorrelation;
mod coordinates;
mod directions;
mod flat;
mod identifiability;
mod profile;
mod spectrum;
mod spread;
mod step;
mod triangle;
mod uncertainty;

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::model::Parameter;
use crate::{Error, Result};
pub use autocorrelation::autocorrelation_inflation;
use coordinates::Coordinates;
pub use flat::{Flat, polish_what_counts, within_flats};
pub use identifiability::{Kind, Unidentifiable};
pub use profile::profile;
pub use spread::{Axis, spread};
use step::bounded_step;
pub use triangle::Triangle;
pub use uncertainty::{Interval, Uncertainty, UncertaintyOptions};

/// A step must achieve at least this fraction of the decrease that the linearised model predicts.
const MIN_GAIN: f64 = 1e-4;
/// Less damping would let rounding errors move parameters that the data do not determine.
const MIN_DAMPING: f64 = f64::EPSILON;

/// A sum of squares to be minimised, whose Jacobian is handed over row by row.
pub trait LeastSquares {
    /// Calls `row(residual, gradient)` for every weighted residual at `candidate`, where `gradient[j]` is the
    /// derivative of the residual with respect to parameter `j` in its own unit. False if the simulation diverged.
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool;

    /// The sum of the squares of the residuals that [`rows`](Self::rows) hands over at `candidate`, or `None` if the
    /// simulation diverged.
    fn cost(&mut self, candidate: &[f64]) -> Option<f64>;

    /// Whether that sum is at most `most`; false if the simulation diverged. Where a part of the sum is above it, the rest
    /// need not be known.
    fn costs_at_most(&mut self, candidate: &[f64], most: f64) -> bool {
        self.cost(candidate).is_some_and(|cost| cost <= most)
    }
}

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
}

impl Default for PolishOptions {
    fn default() -> Self {
        Self {
            max_iterations: 200,
            gradient_tolerance: 1e-10,
            step_tolerance: 1e-12,
            cost_tolerance: 1e-12,
            damping: 1e-3,
        }
    }
}

/// Why [`polish`] ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stop {
    /// The residual is orthogonal to every column of the Jacobian that is free to move.
    Gradient,
    /// The steps became too small to matter.
    Step,
    /// The cost does not fall any more.
    Cost,
    /// The iteration limit: not converged.
    Iterations,
}

impl Stop {
    /// Whether this is convergence.
    pub fn converged(self) -> bool {
        self != Self::Iterations
    }
}

/// An end of a parameter's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bound {
    /// Its lower bound.
    Low,
    /// Its upper bound.
    High,
}

/// A local minimum of the cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polished {
    /// The parameter values, each in its own unit.
    pub values: Vec<f64>,
    /// Sum of squared residuals at `values`.
    pub cost: f64,
    /// Trial steps, accepted or not.
    pub iterations: usize,
    /// Simulations asked of the problem, with or without gradients.
    pub evaluations: usize,
    /// Why the polish ended.
    pub stop: Stop,
    /// The bound that each parameter sits on, if any.
    pub at_bound: Vec<Option<Bound>>,
    /// Triangular factor of the Jacobian and residual at `values`, in search coordinates.
    pub triangle: Triangle,
    /// Parameters along which the cost is flat, where [`polish_what_counts`] has looked.
    pub flat: Vec<Flat>,
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
    let mut scale = DVector::zeros(parameters.len());
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
        scale.zip_apply(&triangle.column_norms(), |s: &mut f64, norm| {
            *s = s.max(norm)
        });
        let (low, high) = space.room(&position);
        let step = bounded_step(&triangle, damping, &scale, &low, &high);
        let trial = space.moved(&position, &step);
        let trial_values = space.to_values(&trial);
        let predicted = triangle.predicted_decrease(&step);
        let small_step = space.is_small(&position, &step, options.step_tolerance);
        if trial_values == values {
            break Stop::Step;
        }

        evaluations += 1;
        let trial_cost = problem.cost(&trial_values).unwrap_or(f64::INFINITY);
        let decrease = cost - trial_cost;
        let gain = decrease / predicted;
        let settled = predicted.max(decrease.abs()) <= options.cost_tolerance * cost;
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
        if settled {
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
