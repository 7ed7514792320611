//! A model linearised about a candidate.

use crate::evaluate::{Problem, reference};

/// A candidate's residuals and their derivatives, one column a free parameter.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    /// Residuals, the channels of a row side by side.
    pub(super) residual: Vec<f64>,
    /// Derivatives of the residuals.
    pub(super) columns: Vec<Vec<f64>>,
}

impl Linear {
    /// At the problem's start; `None` where that diverges.
    pub(super) fn new(problem: &Problem) -> Option<Self> {
        let start = problem.start();
        let room = || Vec::with_capacity(problem.values());
        let mut residual = room();
        let mut columns: Vec<Vec<f64>> = start.iter().map(|_| room()).collect();
        let finished = reference::residuals(problem, &start, &mut |value, gradient| {
            residual.push(value);
            for (column, slope) in columns.iter_mut().zip(gradient) {
                column.push(*slope);
            }
        });
        let finite = |values: &Vec<f64>| values.iter().all(|value| value.is_finite());
        (finished && finite(&residual) && columns.iter().all(finite))
            .then_some(Self { residual, columns })
    }
}
