//! Chances, one by one and of a whole family.

use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::erfc;
use std::f64::consts::SQRT_2;

/// The chance that something is called by its name in a family in which nothing is.
pub(crate) const LEVEL: f64 = 0.05;
/// Half a 95 % interval in standard errors.
pub(crate) const HALF: f64 = 1.959_963_984_540_054;

/// Degrees of freedom from which on Student's distribution is the normal one.
const MANY: f64 = 1e5;

/// The chance that a value of Student's distribution is as far off, either way.
pub(crate) fn two_sided(deviations: f64, freedom: f64) -> f64 {
    let apart = deviations.abs();
    let student = StudentsT::new(0.0, 1.0, freedom).ok();
    match student.filter(|_| freedom < MANY) {
        Some(student) => 2.0 * student.cdf(-apart),
        None => erfc(apart / SQRT_2),
    }
}

/// The chances of a family, each corrected so that below 0.05 no more than 5 % of families have one by chance (Holm 1979).
pub(crate) fn family_wise(chances: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..chances.len()).collect();
    order.sort_by(|&a, &b| chances[a].total_cmp(&chances[b]));
    let mut corrected = vec![1.0; chances.len()];
    let mut least = 0.0;
    for (rank, &i) in order.iter().enumerate() {
        let left = (chances.len() - rank) as f64;
        least = f64::max(least, (left * chances[i]).min(1.0));
        corrected[i] = least;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chances_of_a_family_are_those_of_holm() {
        let corrected = family_wise(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in corrected.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{corrected:?}");
        }
    }

    #[test]
    fn the_chance_of_two_deviations_is_that_of_the_tables() {
        for (deviations, freedom, expected) in [
            (HALF, f64::INFINITY, 0.05),
            (-HALF, 1e9, 0.05),
            (2.228_138_85, 10.0, 0.05),
            (12.706_204_7, 1.0, 0.05),
            (0.0, 3.0, 1.0),
        ] {
            let found = two_sided(deviations, freedom);
            assert!((found - expected).abs() < 1e-6, "{deviations}: {found}");
        }
    }
}
