//! The directions of parameter space, by how much the data say of them.

use super::Triangle;
use super::spectrum::Spectrum;
use nalgebra::{DMatrix, DVector};

/// The directions in parameter space along which the data do or do not determine the parameters.
pub(super) struct Directions {
    /// Index of the parameter that each column stands for.
    pub(super) parameters: Vec<usize>,
    /// Columns of `spectrum` that the data determine.
    pub(super) determined: Vec<usize>,
    /// Columns of `spectrum` that they do not.
    pub(super) undetermined: Vec<usize>,
    /// Of the Jacobian, its columns scaled to one.
    pub(super) spectrum: Spectrum,
    norms: DVector<f64>,
}

impl Directions {
    pub(super) fn new(triangle: &Triangle, parameters: &[usize], singular_ratio: f64) -> Self {
        let norms = triangle.column_norms();
        let parameters: Vec<usize> = parameters
            .iter()
            .copied()
            .filter(|&j| norms[j] > 0.0)
            .collect();
        let mut scaled = triangle.r().select_columns(&parameters);
        let norms = norms.select_rows(&parameters);
        for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
            column.unscale_mut(*norm);
        }
        let spectrum = Spectrum::new(scaled);
        let threshold = singular_ratio * spectrum.values.iter().copied().fold(0.0, f64::max);
        let (determined, undetermined) =
            (0..parameters.len()).partition(|&k| spectrum.values[k] > threshold);
        Self {
            parameters,
            determined,
            undetermined,
            spectrum,
            norms,
        }
    }

    /// Component `column` of direction `k`, divided by its singular value.
    pub(super) fn spread(&self, column: usize, k: usize) -> f64 {
        self.spectrum.vectors[(column, k)] / self.spectrum.values[k]
    }

    /// Component `column` of direction `k` in search coordinates: along it the residual changes by the direction's
    /// singular value.
    pub(super) fn component(&self, column: usize, k: usize) -> f64 {
        self.spectrum.vectors[(column, k)] / self.norms[column]
    }

    /// Projector onto the undetermined directions.
    pub(super) fn undetermined_projector(&self) -> DMatrix<f64> {
        let basis = self.spectrum.vectors.select_columns(&self.undetermined);
        &basis * basis.transpose()
    }

    /// Standard error of each column for residuals of unit variance, in search coordinates.
    pub(super) fn errors(&self) -> DVector<f64> {
        DVector::from_fn(self.parameters.len(), |column, _| {
            let squares = self
                .determined
                .iter()
                .map(|&k| self.spread(column, k).powi(2));
            squares.sum::<f64>().sqrt() / self.norms[column]
        })
    }
}
