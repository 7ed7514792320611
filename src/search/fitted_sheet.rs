//! A curve of a datasheet with its fits, and what each of them gives at its points.

use super::Fit;
use super::datasheet::Sheet;

/// One fit of a sheet.
#[derive(Debug, Clone)]
pub struct SheetFit {
    /// How it was searched, in a few words.
    pub search: &'static str,
    /// The fit.
    pub fit: Fit,
    /// What the fitted model has at every point for each quantity that is measured.
    pub simulated: Vec<Vec<f64>>,
    /// Measured less simulated, for each quantity at each point that has it.
    pub errors: Vec<Vec<Option<f64>>>,
}

/// A sheet with its fits; the last of them is the result.
#[derive(Debug, Clone)]
pub struct FittedSheet {
    /// The sheet.
    pub sheet: Sheet,
    /// The fits, at least one.
    pub fits: Vec<SheetFit>,
    /// The largest change of each quantity of the result at any point when the integration steps are halved.
    pub integration_error: Vec<f64>,
}

impl FittedSheet {
    /// `sheet` with its fits, each after the words for its search.
    ///
    /// # Panics
    /// If there is no fit.
    pub fn new(sheet: Sheet, fits: Vec<(&'static str, Fit)>) -> Self {
        let one = |(search, fit): (&'static str, Fit)| {
            let simulated = sheet.simulated(&sheet.problem, fit.values());
            let errors = sheet.measured.iter().zip(&simulated);
            let errors = errors.map(|(measured, simulated)| {
                let pairs = measured.values.iter().zip(simulated);
                pairs
                    .map(|(measured, simulated)| Some((*measured)? - simulated))
                    .collect()
            });
            SheetFit {
                search,
                fit,
                errors: errors.collect(),
                simulated,
            }
        };
        let fits: Vec<SheetFit> = fits.into_iter().map(one).collect();
        let result = fits.last().expect("every sheet is fitted");
        let finer = sheet.simulated(&sheet.problem.refined(2), result.fit.values());
        let change = |(coarse, fine): (&Vec<f64>, &Vec<f64>)| {
            let pairs = coarse.iter().zip(fine);
            pairs.fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
        };
        Self {
            integration_error: result.simulated.iter().zip(&finer).map(change).collect(),
            fits,
            sheet,
        }
    }

    /// The fit that is the result.
    pub fn result(&self) -> &SheetFit {
        self.fits.last().expect("every sheet is fitted")
    }
}

/// Root mean square of the errors of the points that have one.
pub fn rms(errors: &[Option<f64>]) -> f64 {
    let known = errors.iter().flatten();
    (known.clone().map(|value| value * value).sum::<f64>() / known.count() as f64).sqrt()
}
