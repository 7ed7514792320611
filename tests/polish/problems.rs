//! Small least-squares problems with known answers.

use servobee::model::Parameter;
use servobee::search::polish::LeastSquares;

/// A curve y(x, parameters), which also writes its gradient with respect to the parameters.
pub(crate) type Model = fn(f64, &[f64], &mut [f64]) -> f64;

/// A curve fitted to points (x, y).
pub(crate) struct Curve {
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) model: Model,
}

impl Curve {
    /// Residuals in the order of the points.
    pub(crate) fn residuals(&self, at: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; at.len()];
        let residual = |&(x, y)| y - (self.model)(x, at, &mut gradient);
        self.points.iter().map(residual).collect()
    }
}

impl LeastSquares for Curve {
    fn rows(&mut self, at: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        let mut gradient = vec![0.0; at.len()];
        for &(x, y) in &self.points {
            let simulated = (self.model)(x, at, &mut gradient);
            gradient.iter_mut().for_each(|slope| *slope = -*slope);
            row(y - simulated, &gradient);
        }
        true
    }

    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        let cost: f64 = self.residuals(at).iter().map(|r| r * r).sum();
        cost.is_finite().then_some(cost)
    }
}

/// Rosenbrock's valley, residuals 10 (b − a²) and 1 − a: minimum 0 at (1, 1).
pub(crate) struct Valley;

impl LeastSquares for Valley {
    fn rows(&mut self, at: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        row(10.0 * (at[1] - at[0] * at[0]), &[-20.0 * at[0], 10.0]);
        row(1.0 - at[0], &[-1.0, 0.0]);
        true
    }

    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        Some(100.0 * (at[1] - at[0] * at[0]).powi(2) + (1.0 - at[0]).powi(2))
    }
}

/// |a| + 1 as the only residual: a kink at the minimum, and diverging beyond 3.
pub(crate) struct Kink;

impl LeastSquares for Kink {
    fn rows(&mut self, at: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        row(at[0].abs() + 1.0, &[at[0].signum()]);
        at[0].abs() < 3.0
    }

    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        (at[0].abs() < 3.0).then(|| (at[0].abs() + 1.0).powi(2))
    }
}

/// A parameter without bounds.
pub(crate) fn unbounded(name: &str) -> Parameter {
    Parameter::linear(name, "1", f64::NEG_INFINITY, 0.0, f64::INFINITY)
}
