//! Sequential QR: the triangular factor of a Jacobian whose rows are seen once and forgotten.

use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Rows gathered before they are folded into the triangle.
const BLOCK: usize = 256;

/// The factor R of the QR decomposition of [J | r], J the Jacobian and r the residual.
///
/// Its singular values are those of J itself: no precision is lost to the squares of JᵀJ.
/// (Golub and Van Loan, Matrix Computations, updating QR; Lawson and Hanson 1974, sequential accumulation.)
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Triangle {
    #[serde(with = "square")]
    augmented: DMatrix<f64>,
    rows: usize,
}

impl Triangle {
    /// Gathers the rows that `stream` emits as (residual, gradient), each gradient of length `columns`.
    /// `None` if `stream` returns false or a number is not finite.
    pub fn gather(
        columns: usize,
        stream: impl FnOnce(&mut dyn FnMut(f64, &[f64])) -> bool,
    ) -> Option<Self> {
        let width = columns + 1;
        let mut block = DMatrix::zeros(width + BLOCK, width);
        let mut filled = width;
        let mut rows = 0;
        let complete = stream(&mut |residual, gradient| {
            assert_eq!(gradient.len(), columns, "one derivative per parameter");
            if filled == block.nrows() {
                block = fold(std::mem::replace(&mut block, DMatrix::zeros(0, 0)));
                filled = width;
            }
            for (column, derivative) in gradient.iter().enumerate() {
                block[(filled, column)] = *derivative;
            }
            block[(filled, columns)] = residual;
            filled += 1;
            rows += 1;
        });
        let augmented = fold(block).rows(0, width).into_owned();
        (complete && augmented.iter().all(|entry| entry.is_finite()))
            .then_some(Self { augmented, rows })
    }

    /// Number of parameters.
    pub fn columns(&self) -> usize {
        self.augmented.ncols() - 1
    }

    /// Number of residuals gathered.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Sum of squared residuals.
    pub fn cost(&self) -> f64 {
        self.augmented.column(self.columns()).norm_squared()
    }

    /// The triangular factor of the Jacobian alone.
    pub fn r(&self) -> DMatrix<f64> {
        let columns = self.columns();
        self.augmented.view((0, 0), (columns, columns)).into_owned()
    }

    /// Qᵀr: the residual as seen from the column space of the Jacobian.
    pub fn projected(&self) -> DVector<f64> {
        let columns = self.columns();
        self.augmented
            .view((0, columns), (columns, 1))
            .column(0)
            .into_owned()
    }

    /// Norms of the Jacobian's columns.
    pub fn column_norms(&self) -> DVector<f64> {
        DVector::from_fn(self.columns(), |column, _| {
            self.augmented.column(column).norm()
        })
    }

    /// Jᵀr: half the gradient of the cost.
    pub fn gradient(&self) -> DVector<f64> {
        self.r().tr_mul(&self.projected())
    }

    /// How far the linearised model lets the cost fall under `step`: |r|² − |r + J step|².
    pub fn predicted_decrease(&self, step: &DVector<f64>) -> f64 {
        let change = self.r() * step;
        -change.dot(&self.projected()) * 2.0 - change.norm_squared()
    }

    /// The same for parameters measured in other units: column j times `factors[j]`.
    pub fn scaled(mut self, factors: impl Iterator<Item = f64>) -> Self {
        for (column, factor) in factors.enumerate() {
            self.augmented.column_mut(column).scale_mut(factor);
        }
        self
    }
}

/// The block with its triangle on top and zeros below.
fn fold(block: DMatrix<f64>) -> DMatrix<f64> {
    let height = block.nrows();
    QR::new(block).unpack_r().resize_vertically(height, 0.0)
}

/// A square matrix as its numbers, column by column: nalgebra's own would need its feature std, and with that vectors of
/// its own to compile.
mod square {
    use nalgebra::DMatrix;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    pub(super) fn serialize<S: Serializer>(
        matrix: &DMatrix<f64>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        matrix.as_slice().serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<DMatrix<f64>, D::Error> {
        let numbers = Vec::deserialize(deserializer)?;
        let width = numbers.len().isqrt();
        if width == 0 || width * width != numbers.len() {
            return Err(de::Error::custom("not a square matrix"));
        }
        Ok(DMatrix::from_vec(width, width, numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_of_many_blocks_has_the_products_of_the_rows() {
        let count = 3 * BLOCK + 17;
        let matrix = DMatrix::from_fn(count, 3, |row, column| {
            (row as f64 * 0.7 + column as f64).sin()
        });
        let residual = DVector::from_fn(count, |row, _| (row as f64 * 0.3).cos() + 0.1);
        let triangle = Triangle::gather(3, |row| {
            for index in 0..count {
                row(residual[index], matrix.row(index).transpose().as_slice());
            }
            true
        })
        .unwrap();
        assert_eq!(triangle.rows(), count);
        assert!((triangle.cost() / residual.norm_squared() - 1.0).abs() < 1e-13);
        assert!((triangle.r().tr_mul(&triangle.r()) - matrix.tr_mul(&matrix)).amax() < 1e-10);
        assert!((triangle.gradient() - matrix.tr_mul(&residual)).amax() < 1e-10);
        assert!((0..3).all(|j| (0..j).all(|k| triangle.r()[(j, k)] == 0.0)));
    }

    #[test]
    fn a_triangle_is_written_and_read_again_and_one_cut_short_is_refused() {
        let triangle = Triangle::gather(2, |row| {
            row(0.1, &[1.0, 2.0 / 3.0]);
            row(-0.3, &[0.5, 4.0]);
            true
        });
        let mut written = serde_json::to_value(&triangle).unwrap();
        let read: Option<Triangle> = serde_json::from_value(written.clone()).unwrap();
        assert_eq!(read, triangle);
        written["augmented"].as_array_mut().unwrap().pop();
        let error = serde_json::from_value::<Triangle>(written).unwrap_err();
        assert!(error.to_string().contains("not a square matrix"), "{error}");
    }

    #[test]
    fn a_divergence_or_a_number_that_is_not_finite_leaves_no_triangle() {
        assert_eq!(Triangle::gather(1, |_| false), None);
        let poisoned = Triangle::gather(1, |row| {
            row(1.0, &[f64::NAN]);
            true
        });
        assert_eq!(poisoned, None);
    }
}
