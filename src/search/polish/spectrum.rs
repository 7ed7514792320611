//! Singular values and right singular vectors of a small square matrix.

use nalgebra::{DMatrix, DVector};

/// Sweeps after which the rotations are given up; a dozen is the usual number.
const MAX_SWEEPS: usize = 60;

/// Singular values (not sorted) and, column by column, their right singular vectors.
pub(super) struct Spectrum {
    pub(super) values: DVector<f64>,
    pub(super) vectors: DMatrix<f64>,
}

impl Spectrum {
    /// One-sided Jacobi: rotates pairs of columns until all are orthogonal (Hestenes 1958; Demmel and Veselić 1992
    /// for why it finds small singular values to high relative accuracy).
    ///
    /// nalgebra's own decomposition is not used because it returns wrong values for some rank-deficient matrices
    /// (nalgebra issue 1172), the very ones that matter here.
    pub(super) fn new(mut matrix: DMatrix<f64>) -> Self {
        let count = matrix.ncols();
        let mut vectors = DMatrix::identity(count, count);
        for _ in 0..MAX_SWEEPS {
            let mut orthogonal = true;
            for p in 0..count {
                for q in p + 1..count {
                    let (pp, qq) = (
                        matrix.column(p).norm_squared(),
                        matrix.column(q).norm_squared(),
                    );
                    let pq = matrix.column(p).dot(&matrix.column(q));
                    if pq.abs() <= 1e-15 * (pp * qq).sqrt() {
                        continue;
                    }
                    orthogonal = false;
                    let zeta = (qq - pp) / (2.0 * pq);
                    let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                    let cosine = 1.0 / tangent.hypot(1.0);
                    rotate(&mut matrix, p, q, cosine, cosine * tangent);
                    rotate(&mut vectors, p, q, cosine, cosine * tangent);
                }
            }
            if orthogonal {
                break;
            }
        }
        let values = DVector::from_fn(count, |column, _| matrix.column(column).norm());
        Self { values, vectors }
    }
}

fn rotate(matrix: &mut DMatrix<f64>, p: usize, q: usize, cosine: f64, sine: f64) {
    for row in 0..matrix.nrows() {
        let (a, b) = (matrix[(row, p)], matrix[(row, q)]);
        matrix[(row, p)] = cosine * a - sine * b;
        matrix[(row, q)] = sine * a + cosine * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_null_vector_of_a_matrix_of_ones() {
        let spectrum = Spectrum::new(DMatrix::from_element(3, 3, 1.0));
        assert!((spectrum.values.max() - 3.0).abs() < 1e-14);
        assert!((spectrum.values.sum() - 3.0).abs() < 1e-14);
    }

    #[test]
    fn keeps_the_accuracy_of_small_singular_values() {
        // diag(1, 1e-12) seen through a rotation of its domain.
        let (sine, cosine) = 0.3_f64.sin_cos();
        let small = 1e-12;
        let matrix = DMatrix::from_row_slice(2, 2, &[cosine, -sine, small * sine, small * cosine]);
        let spectrum = Spectrum::new(matrix);
        let weakest = spectrum.values.imin();
        assert!((spectrum.values[weakest] / small - 1.0).abs() < 1e-3);
        assert!((spectrum.vectors[(0, weakest)].abs() - sine).abs() < 1e-9);
    }
}
