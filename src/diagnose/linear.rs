//! Linear algebra on long columns: one entry for each residual.

use crate::evaluate::Problem;
use crate::evaluate::reference;

/// A column whose part outside the basis is shorter than this fraction of itself adds no direction.
const DEPENDENT: f64 = 1e-6;

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
        let mut residual = Vec::new();
        let mut columns = vec![Vec::new(); start.len()];
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

/// Orthonormal directions.
#[derive(Debug, Clone, Default)]
pub(super) struct Basis(pub(super) Vec<Vec<f64>>);

impl Basis {
    /// Spans `columns`.
    pub(super) fn spanning(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut basis = Self::default();
        for column in columns {
            basis.add(column);
        }
        basis
    }

    /// Adds the direction of `column`, unless the basis spans it already.
    pub(super) fn add(&mut self, mut column: Vec<f64>) {
        let length = norm(&column);
        // Twice is enough (Giraud et al. 2005): what rounding leaves of the first pass goes with the second.
        self.remove_from(&mut column);
        self.remove_from(&mut column);
        let rest = norm(&column);
        if rest > DEPENDENT * length && rest > 0.0 {
            column.iter_mut().for_each(|value| *value /= rest);
            self.0.push(column);
        }
    }

    /// Takes what the basis spans from `vector`.
    pub(super) fn remove_from(&self, vector: &mut [f64]) {
        for direction in &self.0 {
            let share = dot(direction, vector);
            for (value, along) in vector.iter_mut().zip(direction) {
                *value -= share * along;
            }
        }
    }

    /// How much of `vector`'s square the basis spans.
    pub(super) fn explained(&self, vector: &[f64]) -> f64 {
        self.0.iter().map(|d| dot(d, vector).powi(2)).sum()
    }
}

/// Inner product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight sums side by side: one alone waits for each addition.
    let (chunks_a, chunks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = chunks_a
        .remainder()
        .iter()
        .zip(chunks_b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    let mut sums = [0.0; 8];
    for (a, b) in chunks_a.zip(chunks_b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_basis_spans_its_columns_and_no_more() {
        let columns = [
            vec![3.0, 0.0, 4.0],
            vec![6.0, 0.0, 8.0],
            vec![1.0, 1.0, 0.0],
        ];
        let basis = Basis::spanning(columns);
        assert_eq!(basis.0.len(), 2);
        let mut normal = vec![4.0, -4.0, -3.0];
        assert!(basis.explained(&normal) < 1e-24);
        let before = normal.clone();
        basis.remove_from(&mut normal);
        assert!(
            normal
                .iter()
                .zip(before)
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
        assert!((basis.explained(&[3.0, 0.0, 4.0]) - 25.0).abs() < 1e-12);
    }
}
