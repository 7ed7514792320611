//! Intervals of the parameters from the curvature of the cost at its minimum.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::coordinates::{slope, to_search};
use super::directions::Directions;
use super::identifiability::{self, Unidentifiable};
use super::{Interval, Polished};
use crate::model::{Parameter, Scale};

/// What [`Uncertainty::new`] assumes of the residuals, and what it calls undetermined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertaintyOptions {
    /// Residuals that carry the information of one independent residual: 1 for white residuals, otherwise
    /// [`autocorrelation_inflation`](super::autocorrelation_inflation).
    pub inflation: f64,
    /// A direction in parameter space is undetermined if its singular value, columns scaled to one, is below this
    /// fraction of the largest.
    pub singular_ratio: f64,
    /// A parameter is weak if the half-width of its interval exceeds this many times its reach: half its range on a
    /// linear scale, a factor of two or half its range on a logarithmic one.
    pub weak: f64,
}

impl Default for UncertaintyOptions {
    fn default() -> Self {
        Self {
            inflation: 1.0,
            singular_ratio: 1e-7,
            weak: 1.0,
        }
    }
}

/// How well the data determine each parameter, from the Jacobian at a polished candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// 95 % interval of each parameter; its whole range where the parameter sits on a bound or is undetermined, and
    /// its value alone where it is fixed.
    pub intervals: Vec<Interval>,
    /// Standard error of each parameter in its own unit; `None` where it is fixed, on a bound or undetermined.
    pub standard_errors: Vec<Option<f64>>,
    /// Parameters that the data do not determine, alone or together.
    pub unidentifiable: Vec<Unidentifiable>,
    /// Effective number of residuals less the number of fitted directions.
    pub degrees_of_freedom: f64,
    /// Rise of the cost that separates the 95 % region of one parameter: s² t², infinite without degrees of freedom.
    pub cost_margin: f64,
}

impl Uncertainty {
    /// Linear regression theory at the minimum: covariance s² (JᵀJ)⁻¹ in search coordinates, with Student's t
    /// (Bates and Watts, Nonlinear Regression Analysis and Its Applications, 1988, section 2.3).
    ///
    /// Coloured residuals count as n / inflation independent ones: s² = |r|² / (n / inflation − p), with as many
    /// degrees of freedom. Directions that the data do not determine are left out of the inverse, and the parameters
    /// that take part in them get no standard error.
    pub fn new(
        parameters: &[Parameter],
        polished: &Polished,
        options: &UncertaintyOptions,
    ) -> Self {
        let triangle = &polished.triangle;
        let mut unidentifiable = identifiability::without_effect(parameters, triangle);
        let silent = |j: usize| {
            unidentifiable
                .iter()
                .any(|group| group.parameters.contains(&j))
        };
        let interior: Vec<usize> = (0..parameters.len())
            .filter(|&j| !parameters[j].is_fixed() && polished.at_bound[j].is_none() && !silent(j))
            .collect();
        let directions = Directions::new(triangle, &interior, options.singular_ratio);

        let rank = directions.determined.len() as f64;
        let degrees_of_freedom = triangle.rows() as f64 / options.inflation - rank;
        let variance = if degrees_of_freedom > 0.0 {
            polished.cost / degrees_of_freedom
        } else {
            f64::INFINITY
        };
        let quantile = student_t(degrees_of_freedom);

        unidentifiable.extend(identifiability::combinations(&directions));
        let undetermined = |j| {
            unidentifiable
                .iter()
                .any(|group| group.parameters.contains(&j))
        };
        let errors = directions.errors() * variance.sqrt();
        let error_of = |j: usize| {
            let column = directions.parameters.iter().position(|&k| k == j)?;
            (degrees_of_freedom > 0.0 && !undetermined(j)).then_some(errors[column])
        };
        let coordinate_errors: Vec<Option<f64>> = (0..parameters.len()).map(error_of).collect();

        let interval = |(j, parameter): (usize, &Parameter)| match coordinate_errors[j] {
            _ if parameter.is_fixed() => Interval {
                low: polished.values[j],
                high: polished.values[j],
                open_low: false,
                open_high: false,
            },
            Some(error) => Interval::around(parameter, polished.values[j], quantile * error),
            None => Interval::whole(parameter),
        };
        let is_weak = |&column: &usize| {
            let j = directions.parameters[column];
            coordinate_errors[j]
                .is_some_and(|error| quantile * error > options.weak * reach(&parameters[j]))
        };
        let weak = (0..directions.parameters.len()).filter(is_weak);
        unidentifiable.extend(identifiability::weak(&directions, weak));
        Self {
            intervals: parameters.iter().enumerate().map(interval).collect(),
            standard_errors: (0..parameters.len())
                .map(|j| Some(coordinate_errors[j]? * slope(&parameters[j], polished.values[j])))
                .collect(),
            unidentifiable,
            degrees_of_freedom,
            cost_margin: variance * quantile * quantile,
        }
    }
}

/// How far a parameter can be off, in search coordinates, before it counts as undetermined; infinite without bounds.
fn reach(parameter: &Parameter) -> f64 {
    let half_range =
        0.5 * (to_search(parameter, parameter.high) - to_search(parameter, parameter.low));
    match parameter.scale {
        Scale::Linear => half_range,
        Scale::Log => half_range.min(std::f64::consts::LN_2),
    }
}

/// The 97.5 % quantile of Student's t; infinite without degrees of freedom.
///
/// Above a thousand degrees of freedom, where statrs loses digits (1.83 at 10⁷), it is Fisher's expansion about the
/// normal quantile (Abramowitz and Stegun 26.7.5).
pub(crate) fn student_t(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom > 1000.0 {
        let z: f64 = 1.959_963_984_540_054;
        let first = z * (z.powi(2) + 1.0) / 4.0;
        let second = z * (5.0 * z.powi(4) + 16.0 * z.powi(2) + 3.0) / 96.0;
        return z + (first + second / degrees_of_freedom) / degrees_of_freedom;
    }
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::student_t;

    #[test]
    fn quantiles_of_student_t_match_the_tables() {
        assert!((student_t(1.0) - 12.706_204_736).abs() < 1e-6);
        assert!((student_t(10.0) - 2.228_138_852).abs() < 1e-8);
        assert!((student_t(1e7) - 1.959_964_222).abs() < 1e-9);
        // Where the two formulas meet.
        assert!((student_t(1000.0) - student_t(1000.001)).abs() < 1e-7);
        assert_eq!(student_t(0.0), f64::INFINITY);
    }
}
