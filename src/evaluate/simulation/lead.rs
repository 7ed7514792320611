//! Simulations that are led along the measurement.

use crate::evaluate::problem::Series;
use crate::model::{
    Complete, Dynamics, Input, MOST_STATES, Output, Outputs, Real, Structure, Valued, View, Whole,
};

/// What draws the states of a simulation towards the measurement: after each row `states` move by a share of what the output that
/// shows them is off, alike, so that they keep their distances. What is far off in parameters then still follows, and the cost
/// falls steadily towards the true ones, which a free simulation only shows from close by (Abarbanel, Creveling, Farsian and
/// Kostuk, "Dynamical state and parameter estimation", 2009).
#[derive(Debug, Clone, Default)]
pub(crate) struct Lead {
    /// How fast they are drawn, 1/s.
    pub(crate) rate: f64,
    /// The output that shows them; with none nothing is led.
    pub(crate) shown_by: Option<Output>,
    /// The numbers of the states.
    pub(crate) states: &'static [usize],
    /// How far to either side of zero they go, in their unit, where it is asked how much of the output that is.
    pub(crate) reach: f64,
}

/// What draws one candidate along one record.
pub(super) struct Pull<'a, R> {
    lead: &'a Lead,
    record: &'a Series,
    /// What one unit of the output's error moves the states by, in theirs. It is the candidate's own: one whose output says much
    /// of them would otherwise be drawn more, and be preferred for that.
    per_unit: R,
}

impl Lead {
    /// What draws a candidate with `values` of all parameters along `record`.
    #[inline(always)]
    pub(super) fn along<'a, R: Valued>(
        &'a self,
        record: &'a Series,
        structure: &Structure,
        values: &Complete<R>,
    ) -> Pull<'a, R> {
        let one = R::constant(1.0);
        let per_unit = match self.shown_by {
            None => one,
            Some(output) => R::outlined(
                #[inline(always)]
                || one / self.slope(output, record, structure, values),
            ),
        };
        Pull {
            lead: self,
            record,
            per_unit,
        }
    }

    /// How much of `output` one unit of the states is, with the other states at zero and what else drives the model as at the
    /// first row of `record`; zero where it does not show which way they are off.
    #[inline(always)]
    pub(crate) fn slope<R: Valued>(
        &self,
        output: Output,
        record: &Series,
        structure: &Structure,
        values: &Complete<R>,
    ) -> R {
        let plant = Whole::plant(structure, values);
        let input = Input::constant(&record.samples[0].input);
        let mut sides = [R::constant(0.0); 2];
        for (side, reach) in sides.iter_mut().zip([self.reach, -self.reach]) {
            let mut state = [R::constant(0.0); MOST_STATES];
            for &i in self.states {
                state[i] = R::constant(reach);
            }
            *side = plant.observe(&state, &input)[output];
        }
        (sides[0] - sides[1]) * R::constant(0.5 / self.reach)
    }
}

impl<R: Real> Pull<'_, R> {
    /// Draws `state` after row `k`, which shows these `outputs`.
    #[inline(always)]
    pub(super) fn draw(&self, k: usize, outputs: &Outputs<R>, state: &mut [R]) {
        let Some(output) = self.lead.shown_by else {
            return;
        };
        let sample = &self.record.samples[k];
        if !self.record.measured[output] || sample.weight == 0.0 {
            return;
        }
        let share = -(-self.lead.rate * sample.step * f64::from(sample.substeps)).exp_m1();
        let off = R::constant(sample.target[output]) - outputs[output];
        let pull = R::constant(share) * self.per_unit * off;
        for &i in self.lead.states {
            state[i] = state[i] + pull;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::reference::{cost, led_cost_up_to, led_residuals};
    use crate::evaluate::workload;

    fn lead(rate: f64) -> Lead {
        Lead {
            rate,
            shown_by: Some(Output::Spool),
            states: &[0, 1],
            reach: 10.0,
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
