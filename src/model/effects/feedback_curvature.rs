//! The transducer of the loop is not straight.

use super::curve::{self, Curve};
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port, Stage, host};
use crate::model::Real;

pub(super) const ENTRY: Entry = Entry {
    name: "feedback_curvature",
    port: Port::Actuator,
    summary: "The transducer of the spool's loop is not straight",
    finding: "the loop's transducer is off by {feedback_square} and {feedback_cubic} at full scale, with the square and the cube of the spool",
    equation: "sat(u - y, S), y = x + feedback_square s^2 + feedback_cubic s^3, s = x / feedback_span",
    shows: "a spool that settles beside its command, by more the further it is from null, and whose loop is faster or slower there",
    confused: "sensor_curvature, which the flow does not show; dc_gain, whose error is in proportion to the command; flow_force, which pulls towards null from a saturated loop's speed, too; gain_curvature, which the spool does not show. Where the spool alone is measured, its own sensor, and it is not looked for",
    source: "linearity of position transducers: ISO 10770-1; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        let names = ["feedback_square", "feedback_cubic", "feedback_span"];
        curve::parameters(names, &scale.command_unit, scale.command)
    },
    trials: |scale, _| curve::trials(scale.command),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_more_than_the_spool,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Command, Values::Trial(0))),
    frequency: None,
};

/// The transducer of the loop is not straight.
#[derive(Debug, Clone)]
pub(in crate::model) struct FeedbackCurvature<R>(Curve<R>);

impl<R: Real> FeedbackCurvature<R> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(Curve::new(next))
    }
}

impl<R: Real> Act<R> for FeedbackCurvature<R> {
    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, spool: R, _stage: &Stage<R>) -> R {
        command - self.0.off(spool)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_at_rest_where_its_transducer_shows_the_command() {
        let mut values = [0.5, -1.0, 10.0].into_iter();
        let effect: FeedbackCurvature<f64> = FeedbackCurvature::new(|| values.next().unwrap());
        let error = |command, spool| {
            effect.reference(&[], command, spool, &Stage::first(command, 0.0)) - spool
        };
        assert_eq!([error(9.5, 10.0), error(-8.5, -10.0)], [0.0, 0.0]);
        assert_eq!(error(5.0, 5.0), -(0.5 * 0.25 - 0.125));
    }
}
