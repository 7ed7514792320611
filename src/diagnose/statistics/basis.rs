//! Linear algebra on long columns: one entry for each residual.

use pulp::Arch;

/// A column whose component outside the basis is shorter than this fraction of it adds no direction.
const DEPENDENT: f64 = 1e-6;
/// A column that keeps this fraction of its length outside the basis is rid of it.
const CLEAR: f64 = 0.7;

/// Orthonormal directions.
#[derive(Debug, Clone, Default)]
pub(in crate::diagnose) struct Basis(pub(in crate::diagnose) Vec<Vec<f64>>);

impl Basis {
    /// Spans `columns`.
    pub(in crate::diagnose) fn spanning(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        Self::default().beyond(columns)
    }

    /// Spans what `columns` have outside of this basis.
    pub(in crate::diagnose) fn beyond(&self, columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut beyond = Self::default();
        for mut column in columns {
            let length = norm(&column);
            let mut rest = length;
            // What rounding leaves of a direction shows where little else is left; two passes are enough (Giraud et al. 2005).
            for _ in 0..2 {
                let before = rest;
                self.remove_from(&mut column);
                beyond.remove_from(&mut column);
                rest = norm(&column);
                if rest > CLEAR * before {
                    break;
                }
            }
            if rest > DEPENDENT * length && rest > 0.0 {
                column.iter_mut().for_each(|value| *value /= rest);
                beyond.0.push(column);
            }
        }
        beyond
    }

    /// Takes what the basis spans from `vector`.
    pub(in crate::diagnose) fn remove_from(&self, vector: &mut [f64]) {
        for direction in &self.0 {
            let share = dot(direction, vector);
            Arch::new().dispatch(
                #[inline(always)]
                || {
                    for (value, along) in vector.iter_mut().zip(direction) {
                        *value -= share * along;
                    }
                },
            );
        }
    }

    /// How much of `vector`'s square the basis spans.
    pub(in crate::diagnose) fn explained(&self, vector: &[f64]) -> f64 {
        self.0.iter().map(|d| dot(d, vector).powi(2)).sum()
    }
}

/// Inner product.
pub(in crate::diagnose) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Only what is inlined is compiled for the CPU's vectors.
    Arch::new().dispatch(
        #[inline(always)]
        || {
            // Eight independent sums, so that no addition waits for the one before.
            let ((eights_a, rest_a), (eights_b, rest_b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
            let mut sums = [0.0; 8];
            for (a, b) in eights_a.iter().zip(eights_b) {
                for i in 0..8 {
                    sums[i] += a[i] * b[i];
                }
            }
            let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
            sums.iter().sum::<f64>() + rest
        },
    )
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
        let basis = Basis::spanning(columns.clone());
        let [first, others @ ..] = columns;
        let first = Basis::spanning([first]);
        let beyond = first.beyond(others);
        assert_eq!((first.0.len(), beyond.0.len()), (1, 1));
        let any = [2.0, -1.0, 5.0];
        let apart = first.explained(&any) + beyond.explained(&any);
        assert!((apart - basis.explained(&any)).abs() < 1e-12);
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
