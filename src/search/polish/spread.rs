//! Candidates at the edge of what the data allow: for the intervals of figures that follow from all parameters together.

use super::coordinates::{to_search, to_value};
use super::directions::Directions;
use super::{Kind, Polished, Uncertainty, UncertaintyOptions};
use crate::model::Parameter;

/// A direction of parameter space, from the result as far as the data allow.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The candidates at both ends.
    pub ends: [Vec<f64>; 2],
    /// Whether the data set the ends; otherwise the bounds do.
    pub determined: bool,
}

/// The directions of parameter space, with candidates at their ends.
///
/// Where the data determine a direction these are the two ends of an axis of the 95 % ellipsoid of one parameter,
/// `u ± t s v/σ` in search coordinates: the half-width of a smooth function's interval is then the root of the sum of the
/// squares of its changes (linear propagation, Bates and Watts 1988, section 2.3). Where they do not, the candidates lie
/// where the direction leaves the bounds. A parameter that sits on a bound or has no effect goes to the ends of its own
/// interval; a fixed one stays.
pub fn spread(
    parameters: &[Parameter],
    polished: &Polished,
    uncertainty: &Uncertainty,
) -> Vec<Axis> {
    // What rounding leaves of a column is no effect either.
    let silent = |j: usize| {
        let groups = uncertainty.unidentifiable.iter();
        groups
            .filter(|group| group.kind == Kind::NoEffect)
            .any(|group| group.parameters.contains(&j))
    };
    let interior: Vec<usize> = (0..parameters.len())
        .filter(|&j| !parameters[j].is_fixed() && polished.at_bound[j].is_none() && !silent(j))
        .collect();
    let options = UncertaintyOptions::default();
    let directions = Directions::new(&polished.triangle, &interior, options.singular_ratio);
    let radius = uncertainty.cost_margin.sqrt();
    let along = (0..directions.parameters.len()).map(|k| {
        let step: Vec<(usize, f64)> = directions
            .parameters
            .iter()
            .enumerate()
            .map(|(column, &j)| (j, directions.component(column, k)))
            .collect();
        let determined = directions.determined.contains(&k);
        let length = match determined {
            true => radius / directions.spectrum.values[k],
            false => f64::INFINITY,
        };
        let end = |sign| moved(parameters, &polished.values, &step, sign, length);
        Axis {
            ends: [1.0, -1.0].map(end),
            determined,
        }
    });
    let alone = (0..parameters.len())
        .filter(|j| !parameters[*j].is_fixed() && !directions.parameters.contains(j))
        .map(|j| {
            let interval = &uncertainty.intervals[j];
            let end = |end: f64| {
                let mut values = polished.values.clone();
                values[j] = end;
                values
            };
            Axis {
                ends: [interval.high, interval.low].map(end),
                determined: !(interval.open_low && interval.open_high),
            }
        });
    along.chain(alone).collect()
}

/// `values` moved by `step`, which names parameters and their changes in search coordinates, times `length`, or as far as
/// the bounds let it.
fn moved(
    parameters: &[Parameter],
    values: &[f64],
    step: &[(usize, f64)],
    sign: f64,
    length: f64,
) -> Vec<f64> {
    let room = |&(j, share): &(usize, f64)| {
        let parameter = &parameters[j];
        let end = match sign * share > 0.0 {
            true => parameter.high,
            false => parameter.low,
        };
        let way = to_search(parameter, end) - to_search(parameter, values[j]);
        if share == 0.0 {
            f64::INFINITY
        } else {
            (way / share).abs()
        }
    };
    let length = sign * step.iter().map(room).fold(length, f64::min);
    let mut moved = values.to_vec();
    for &(j, share) in step {
        let coordinate = to_search(&parameters[j], values[j]) + length * share;
        moved[j] = to_value(&parameters[j], coordinate);
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_followed_to_its_length_or_the_first_bound() {
        let parameters = ["a", "b"].map(|name| Parameter::linear(name, "1", 0.0, 1.0, 10.0));
        let step = [(0, 1.0), (1, -0.5)];
        let end = |sign, length| moved(&parameters, &[2.0, 3.0], &step, sign, length);
        assert_eq!(end(1.0, 1.0), [3.0, 2.5]);
        assert_eq!(end(-1.0, 1.0), [1.0, 3.5]);
        // The second is at its lower bound first, and on the way back the first.
        assert_eq!(end(1.0, f64::INFINITY), [8.0, 0.0]);
        assert_eq!(end(-1.0, f64::INFINITY), [0.0, 4.0]);
        let still = [(0, 0.0), (1, 1.0)];
        let up = moved(&parameters, &[2.0, 3.0], &still, 1.0, f64::INFINITY);
        assert_eq!(up, [2.0, 10.0]);
    }
}
