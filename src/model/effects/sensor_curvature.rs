//! The spool's sensor is not straight.

use super::curve::{self, Curve};
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Host, Moment, Port};
use super::{entry, host};
use crate::model::{Output, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "sensor_curvature",
    port: Port::Measurement,
    summary: "The sensor is not straight",
    finding: "the {output} sensor is off by {sensor_square} and {sensor_cubic} at its largest reading, with the square and the cube of it",
    equation: "y + sensor_square s^2 + sensor_cubic s^3, s = y / sensor_span",
    shows: "a spool that settles beside its command, by more the further it is from null, and a flow that does not",
    confused: "feedback_curvature, which the flow shows as the spool does. Where the spool alone is measured, a controller that is not straight, and it is not looked for",
    source: "linearity of position transducers: ISO 10770-1",
    parameters: |scale, output| {
        let names = ["sensor_square", "sensor_cubic", "sensor_span"];
        let names = names.map(|name| entry::on(name, output));
        let names = names.each_ref().map(String::as_str);
        curve::parameters(names, scale.unit(output), scale.output(output))
    },
    trials: |scale, output| curve::trials(scale.output(output)),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_more_than_the_spool,
    outputs: Some(of_the_spool),
    view: Some(View::new(view::SLOW, Over::Command, Values::Trial(0))),
    frequency: None,
};

/// A flow meter that is not straight is a valve whose gain is not.
fn of_the_spool(_: &dyn Host, output: Output) -> bool {
    output == Output::Spool
}

/// The sensor is not straight.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorCurvature<R>(Curve<R>);

impl<R: Real> SensorCurvature<R> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(Curve::new(next))
    }
}

impl<R: Real> Act<R> for SensorCurvature<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, _moment: &Moment<R>) -> R {
        value + self.0.off(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_off_by_square_and_cube_of_what_it_measures() {
        let mut values = [0.5, -1.0, 10.0].into_iter();
        let effect: SensorCurvature<f64> = SensorCurvature::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        let shown = [10.0, -10.0, 0.0].map(|value| effect.measure(&[], value, &moment));
        assert_eq!(shown, [9.5, -8.5, 0.0]);
    }
}
