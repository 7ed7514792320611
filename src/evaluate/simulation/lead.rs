//! Simulations that are led along the measurement.

use crate::evaluate::problem::Series;
use crate::model::{Outputs, Real};

/// What draws the states of a simulation towards the measurement: after each row `states` move by a share of what an output is
/// off, alike, so that they keep their distances. What is far off in parameters then still follows, and the cost falls
/// steadily towards the true ones, which a free simulation only shows from close by (Abarbanel, Creveling, Farsian and Kostuk,
/// "Dynamical state and parameter estimation", 2009). At a rate of zero nothing is led.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lead {
    /// How fast they are drawn, 1/s.
    pub(crate) rate: f64,
    /// What one unit of each output's error moves the states by, in theirs; zero where it moves nothing.
    pub(crate) per_unit: Outputs<f64>,
    /// The numbers of the states.
    pub(crate) states: &'static [usize],
}

impl Lead {
    /// Draws `state` after row `k` of `record`, which shows these `outputs`.
    #[inline(always)]
    pub(super) fn pull<R: Real>(
        &self,
        record: &Series,
        k: usize,
        outputs: &Outputs<R>,
        state: &mut [R],
    ) {
        if self.rate == 0.0 {
            return;
        }
        let sample = &record.samples[k];
        let share = -(-self.rate * sample.step * f64::from(sample.substeps)).exp_m1();
        for (output, &per_unit) in self.per_unit.iter() {
            if per_unit == 0.0 || !record.measured[output] || sample.weight == 0.0 {
                continue;
            }
            let off = R::constant(sample.target[output]) - outputs[output];
            for &i in self.states {
                state[i] = state[i] + R::constant(share * per_unit) * off;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::reference::{cost, led_cost_up_to, led_residuals};
    use crate::evaluate::workload;
    use crate::model::Output;

    fn lead(rate: f64) -> Lead {
        let mut per_unit = Outputs::all(0.0);
        per_unit[Output::Spool] = 1.0;
        Lead {
            rate,
            per_unit,
            states: &[0, 1],
        }
    }

    #[test]
    fn what_is_led_follows_the_closer_the_faster_it_is_drawn() {
        let problem = workload::actuator(500);
        let mut start = problem.start();
        start[0] *= 0.5;
        let led = |rate| led_cost_up_to(&problem, &lead(rate), &start, f64::INFINITY).unwrap();
        let costs = [0.0, 3.0, 30.0, 300.0].map(led);
        assert_eq!(Some(costs[0]), cost(&problem, &start));
        assert!(costs.is_sorted_by(|a, b| a > b), "{costs:?}");
        assert!(costs[3] < 0.5 * costs[0], "{costs:?}");
    }

    #[test]
    fn its_sensitivities_are_the_slopes_of_its_cost() {
        let problem = workload::actuator(500);
        let start = problem.start();
        let lead = lead(100.0);
        let (mut sum, mut slopes) = (0.0, vec![0.0; start.len()]);
        let finished = led_residuals(&problem, &lead, &start, &mut |residual, gradient| {
            sum += residual * residual;
            for (slope, own) in slopes.iter_mut().zip(gradient) {
                *slope += 2.0 * residual * own;
            }
        });
        let led = |free: &[f64]| led_cost_up_to(&problem, &lead, free, f64::INFINITY).unwrap();
        assert!(finished && (sum / led(&start) - 1.0).abs() < 1e-12);
        for (j, slope) in slopes.iter().enumerate() {
            let [above, below] = [1e-5, -1e-5].map(|share| {
                let mut moved = start.clone();
                moved[j] *= 1.0 + share;
                led(&moved)
            });
            let expected = (above - below) / (2e-5 * start[j]);
            assert!(
                (slope - expected).abs() < 1e-4 * expected.abs().max(sum / start[j]),
                "{j}: {slope}, {expected}"
            );
        }
    }
}
