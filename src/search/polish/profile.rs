//! Profile likelihood: the interval of one parameter from the cost itself instead of its curvature.

use super::coordinates::{to_search, to_value};
use super::{Interval, LeastSquares, PolishOptions, Polished, Uncertainty, polish};
use crate::model::{Parameter, Scale};

/// Steps in which the search for a limit doubles its distance; 2⁴⁰ is far enough for any parameter without a bound.
const MAX_DOUBLINGS: usize = 40;
/// Refits that may be spent on pinning a limit down once it is bracketed.
const MAX_REFINEMENTS: usize = 30;
/// Relative precision of a limit's distance from the value.
const PRECISION: f64 = 1e-3;

/// The 95 % interval of parameter `index`: the values at which refitting the others keeps the cost within
/// `uncertainty.cost_margin` of the minimum (Bates and Watts 1988, section 6.1; the margin is the F(1, n − p) one).
///
/// Where the cost stays within the margin up to a bound, or the parameter has none and the cost never rises, the
/// interval is open at that end. A candidate that diverges counts as beyond the limit.
pub fn profile(
    problem: &mut dyn LeastSquares,
    parameters: &[Parameter],
    polished: &Polished,
    uncertainty: &Uncertainty,
    index: usize,
    options: &PolishOptions,
) -> Interval {
    let mut held = parameters.to_vec();
    held[index].set_fixed(true);
    let mut ray = Ray {
        problem,
        held,
        polished,
        margin: uncertainty.cost_margin,
        index,
        options,
    };
    let first = first_distance(
        &parameters[index],
        polished.values[index],
        &uncertainty.intervals[index],
    );
    let (low, open_low) = ray.limit(-1.0, first);
    let (high, open_high) = ray.limit(1.0, first);
    Interval {
        low,
        high,
        open_low,
        open_high,
    }
}

/// Where to look first: at the limit that the curvature suggests, else at a tenth of the range.
fn first_distance(parameter: &Parameter, value: f64, interval: &Interval) -> f64 {
    let at = |value| to_search(parameter, value);
    let half_width = 0.5 * (at(interval.high) - at(interval.low));
    let tenth = 0.1 * (at(parameter.high) - at(parameter.low));
    let size = match parameter.scale {
        Scale::Linear if value != 0.0 => 0.1 * value.abs(),
        Scale::Linear | Scale::Log => 0.1,
    };
    let open = interval.open_low && interval.open_high;
    let candidates = [half_width, tenth, size];
    let usable = |distance: &f64| distance.is_finite() && *distance > 0.0;
    *candidates[usize::from(open)..]
        .iter()
        .find(|d| usable(d))
        .unwrap_or(&size)
}

/// The cost along one parameter, the others refitted.
struct Ray<'a> {
    problem: &'a mut dyn LeastSquares,
    held: Vec<Parameter>,
    polished: &'a Polished,
    margin: f64,
    index: usize,
    options: &'a PolishOptions,
}

impl Ray<'_> {
    /// The limit towards `sign`, and whether it is open.
    fn limit(&mut self, sign: f64, first: f64) -> (f64, bool) {
        let parameter = self.held[self.index].clone();
        let origin = to_search(&parameter, self.polished.values[self.index]);
        let bound = if sign < 0.0 {
            parameter.low
        } else {
            parameter.high
        };
        let farthest = (to_search(&parameter, bound) - origin).abs();
        let value_at = |distance: f64| to_value(&parameter, origin + sign * distance);

        let mut inside = Probe {
            distance: 0.0,
            excess: 0.0,
            values: self.polished.values.clone(),
        };
        let mut distance = first;
        for _ in 0..MAX_DOUBLINGS {
            if inside.distance >= farthest {
                break;
            }
            distance = distance.min(farthest);
            let probe = self.probe(&inside.values, distance, value_at(distance));
            if probe.excess > 1.0 {
                return (value_at(self.between(inside, probe, value_at)), false);
            }
            inside = probe;
            distance *= 2.0;
        }
        (bound, true)
    }

    /// The distance between `inside` and `outside` where the cost crosses the margin.
    ///
    /// Regula falsi on the square root of the excess, which is nearly linear; the height of a side that stays
    /// twice in a row is halved (Illinois).
    fn between(
        &mut self,
        mut inside: Probe,
        mut outside: Probe,
        value_at: impl Fn(f64) -> f64,
    ) -> f64 {
        let height = |excess: f64| excess.max(0.0).sqrt() - 1.0;
        let (mut low, mut high) = (height(inside.excess), height(outside.excess));
        let mut moved_inside = None;
        for _ in 0..MAX_REFINEMENTS {
            let width = outside.distance - inside.distance;
            if width <= PRECISION * outside.distance {
                break;
            }
            let fraction = if high.is_finite() {
                low / (low - high)
            } else {
                0.5
            };
            let distance = inside.distance + fraction.clamp(0.01, 0.99) * width;
            let probe = self.probe(&inside.values, distance, value_at(distance));
            let found = height(probe.excess);
            if found.abs() <= 0.1 * PRECISION {
                return distance;
            }
            let moves_inside = found < 0.0;
            let again = moved_inside == Some(moves_inside);
            moved_inside = Some(moves_inside);
            let shrink = if again { 0.5 } else { 1.0 };
            if moves_inside {
                (inside, low, high) = (probe, found, shrink * high);
            } else {
                (outside, low, high) = (probe, shrink * low, found);
            }
        }
        0.5 * (inside.distance + outside.distance)
    }

    /// Refits the others from `start` with the parameter at `value`.
    fn probe(&mut self, start: &[f64], distance: f64, value: f64) -> Probe {
        let mut start = start.to_vec();
        start[self.index] = value;
        match polish(self.problem, &self.held, &start, self.options) {
            Ok(refit) => Probe {
                distance,
                excess: (refit.cost - self.polished.cost) / self.margin,
                values: refit.values,
            },
            Err(_) => Probe {
                distance,
                excess: f64::INFINITY,
                values: start,
            },
        }
    }
}

/// A refit at some distance from the minimum.
struct Probe {
    distance: f64,
    /// Rise of the cost over the margin: 1 at the limit.
    excess: f64,
    values: Vec<f64>,
}
