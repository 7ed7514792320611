//! Search coordinates: a parameter's value on a linear scale, its logarithm on a logarithmic one.

use super::{LeastSquares, Triangle};
use crate::model::{Parameter, Scale};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// An end of a parameter's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bound {
    /// Its lower bound.
    Low,
    /// Its upper bound.
    High,
}

/// The box that a polish moves in, in search coordinates.
pub(super) struct Coordinates<'a> {
    parameters: &'a [Parameter],
    low: DVector<f64>,
    high: DVector<f64>,
}

impl<'a> Coordinates<'a> {
    /// The box of `parameters`, in which a fixed one has no room around its value in `start`.
    pub(super) fn new(parameters: &'a [Parameter], start: &[f64]) -> Self {
        assert_eq!(parameters.len(), start.len(), "one value per parameter");
        let ends = |bound: fn(&Parameter) -> f64| {
            DVector::from_fn(parameters.len(), |j, _| {
                let parameter = &parameters[j];
                let fixed = parameter.clamp(start[j]);
                let end = if parameter.is_fixed() {
                    fixed
                } else {
                    bound(parameter)
                };
                to_search(parameter, end)
            })
        };
        Self {
            parameters,
            low: ends(|parameter| parameter.low),
            high: ends(|parameter| parameter.high),
        }
    }

    /// The point of the box nearest to `values`.
    pub(super) fn to_search(&self, values: &[f64]) -> DVector<f64> {
        let point = DVector::from_fn(values.len(), |j, _| {
            to_search(&self.parameters[j], values[j])
        });
        self.inside(point)
    }

    /// The parameter values at `position`.
    pub(super) fn to_values(&self, position: &DVector<f64>) -> Vec<f64> {
        let parameters = self.parameters.iter();
        parameters
            .zip(position)
            .map(|(p, &u)| to_value(p, u))
            .collect()
    }

    /// Where `step` leads, kept inside against rounding.
    pub(super) fn moved(&self, position: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        self.inside(position + step)
    }

    /// How far each coordinate can still move down (negative) and up.
    pub(super) fn room(&self, position: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        (&self.low - position, &self.high - position)
    }

    /// The triangular factor at `values`, its Jacobian with respect to the search coordinates.
    pub(super) fn triangle(
        &self,
        problem: &mut dyn LeastSquares,
        values: &[f64],
    ) -> Option<Triangle> {
        let raw = Triangle::gather(values.len(), |row| problem.rows(values, row))?;
        let slopes = self
            .parameters
            .iter()
            .zip(values)
            .map(|(p, &value)| slope(p, value));
        Some(raw.scaled(slopes))
    }

    /// The largest cosine between the residual and a column of the Jacobian that its bounds let it follow.
    pub(super) fn stationarity(&self, triangle: &Triangle, position: &DVector<f64>) -> f64 {
        let gradient = triangle.gradient();
        let norms = triangle.column_norms() * triangle.cost().sqrt();
        let cosine = |j: usize| {
            let can_follow = if gradient[j] > 0.0 {
                position[j] > self.low[j]
            } else {
                position[j] < self.high[j]
            };
            if can_follow && gradient[j] != 0.0 {
                gradient[j].abs() / norms[j]
            } else {
                0.0
            }
        };
        (0..gradient.len()).map(cosine).fold(0.0, f64::max)
    }

    /// Whether `step` changes every value by less than the fraction `tolerance`.
    pub(super) fn is_small(
        &self,
        position: &DVector<f64>,
        step: &DVector<f64>,
        tolerance: f64,
    ) -> bool {
        self.parameters.iter().enumerate().all(|(j, parameter)| {
            let size = match parameter.scale {
                Scale::Linear => position[j].abs(),
                Scale::Log => 1.0,
            };
            step[j].abs() <= tolerance * (size + tolerance)
        })
    }

    /// The bound each free parameter sits on at `position`.
    pub(super) fn at_bound(&self, position: &DVector<f64>) -> Vec<Option<Bound>> {
        let bound = |(j, parameter): (usize, &Parameter)| {
            if parameter.is_fixed() {
                None
            } else if position[j] <= self.low[j] {
                Some(Bound::Low)
            } else if position[j] >= self.high[j] {
                Some(Bound::High)
            } else {
                None
            }
        };
        self.parameters.iter().enumerate().map(bound).collect()
    }

    fn inside(&self, position: DVector<f64>) -> DVector<f64> {
        position.sup(&self.low).inf(&self.high)
    }
}

/// The search coordinate of `value`.
pub(super) fn to_search(parameter: &Parameter, value: f64) -> f64 {
    match parameter.scale {
        Scale::Linear => value,
        Scale::Log => value.ln(),
    }
}

/// The value at a search coordinate; exactly the bound where the coordinate is the bound's.
pub(super) fn to_value(parameter: &Parameter, coordinate: f64) -> f64 {
    match parameter.scale {
        Scale::Linear => parameter.clamp(coordinate),
        Scale::Log if coordinate <= parameter.low.ln() => parameter.low,
        Scale::Log if coordinate >= parameter.high.ln() => parameter.high,
        Scale::Log => parameter.clamp(coordinate.exp()),
    }
}

/// The derivative of the value with respect to its search coordinate.
pub(super) fn slope(parameter: &Parameter, value: f64) -> f64 {
    match parameter.scale {
        Scale::Linear => 1.0,
        Scale::Log => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> [Parameter; 2] {
        [
            Parameter::linear("length", "mm", 0.0, 2.0, 5.0),
            Parameter::log("gain", "1/s", 1.0, 100.0, 1000.0),
        ]
    }

    #[test]
    fn a_step_is_small_beside_a_value_or_by_its_logarithm() {
        let parameters = parameters();
        let space = Coordinates::new(&parameters, &[2.0, 100.0]);
        let small = |position: [f64; 2], step: [f64; 2]| {
            space.is_small(&position.to_vec().into(), &step.to_vec().into(), 1e-3)
        };
        assert!(small([2.0, 7.0], [2.0e-3, 1.0e-3]));
        assert!(small([2.0, 7.0], [-2.0e-3, -1.0e-3]));
        assert!(!small([2.0, 7.0], [2.01e-3, 0.0]));
        assert!(!small([2.0, 7.0], [0.0, 1.01e-3]));
        assert!(!small([-2.0, 7.0], [-2.01e-3, 0.0]));
        // Beside nothing at all the square of the tolerance is small.
        assert!(small([0.0, 7.0], [0.9e-6, 0.0]));
        assert!(!small([0.0, 7.0], [1.1e-6, 0.0]));
    }

    #[test]
    fn a_residual_that_leads_out_of_the_box_is_not_followed() {
        let parameters = &parameters()[..1];
        let space = Coordinates::new(parameters, &[2.0]);
        // A quarter of the residual's square can be followed: its cosine is a half.
        let cosine = |slope: f64, position: f64| {
            let triangle = Triangle::gather(1, |row| {
                row(1.0, &[slope]);
                row(3_f64.sqrt(), &[0.0]);
                true
            });
            space.stationarity(&triangle.unwrap(), &DVector::from_element(1, position))
        };
        for (slope, position, expected) in [
            (7.0, 2.0, 0.5),
            (-7.0, 2.0, 0.5),
            (7.0, 0.0, 0.0),
            (-7.0, 0.0, 0.5),
            (7.0, 5.0, 0.5),
            (-7.0, 5.0, 0.0),
            (0.0, 2.0, 0.0),
        ] {
            let found = cosine(slope, position);
            assert!(
                (found - expected).abs() < 1e-12,
                "{slope} {position}: {found}"
            );
        }
    }
}
