//! What a polish comes to.

use super::{Bound, Interval, Triangle};
use crate::model::Parameter;
use serde::{Deserialize, Serialize};

/// Why [`polish`](super::polish()) ended.
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
    /// Parameters along which the cost is flat, where [`polish_what_counts`](super::polish_what_counts) has looked.
    pub flat: Vec<Flat>,
}

/// A range of values of one parameter, up to a bound or to both, in which the cost does not change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Flat {
    /// The parameter's index.
    pub parameter: usize,
    /// Lower end of the range.
    pub low: f64,
    /// Upper end of the range.
    pub high: f64,
}

impl Flat {
    /// The interval of `parameter`, whose cost is flat here: open at the bounds.
    pub fn interval(&self, parameter: &Parameter) -> Interval {
        Interval {
            low: self.low,
            high: self.high,
            open_low: self.low <= parameter.low,
            open_high: self.high >= parameter.high,
        }
    }
}
