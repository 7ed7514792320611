//! How well a simulation follows a measurement.

/// The error of one simulated output.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Score {
    /// Root of the mean squared error, in the output's unit.
    pub rmse: f64,
    /// 100 · (1 − ‖e‖ / ‖y − ȳ‖): 100 for no error, 0 for no better than the mean; none where the measurement is
    /// constant.
    pub fit_percent: Option<f64>,
}

impl Score {
    /// The score of `(measured, simulated)` pairs.
    pub fn new(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let count = pairs.clone().count() as f64;
        let mean = pairs.clone().map(|(measured, _)| measured).sum::<f64>() / count;
        let squares = |square: fn(f64, f64, f64) -> f64| -> f64 {
            pairs.clone().map(|(y, x)| square(y, x, mean)).sum()
        };
        let error = squares(|y, x, _| (y - x).powi(2));
        let spread = squares(|y, _, mean| (y - mean).powi(2));
        Self {
            rmse: (error / count).sqrt(),
            fit_percent: (spread > 0.0).then(|| 100.0 * (1.0 - (error / spread).sqrt())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_forms_hold() {
        let score = |pairs: &[(f64, f64)]| Score::new(pairs.iter().copied());
        let exact = score(&[(1.0, 1.0), (3.0, 3.0)]);
        assert_eq!((exact.rmse, exact.fit_percent), (0.0, Some(100.0)));
        let mean = score(&[(1.0, 2.0), (3.0, 2.0)]);
        assert_eq!((mean.rmse, mean.fit_percent), (1.0, Some(0.0)));
        assert_eq!(score(&[(1.0, 2.0), (1.0, 2.0)]).fit_percent, None);
    }
}
