//! Oil leaks past the lands.

use super::entry;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Output, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "leakage",
    port: Port::Flow,
    summary: "Oil leaks past the lands: a peak of flow at null, and a laminar part",
    finding: "{leakage} leak past the lands at null",
    equation: "Q + leakage/(1 + (x/leakage_width)^2) + leakage_laminar dp",
    shows: "flow at closed lands, largest at null and gone when the valve is open",
    confused: "sensor_offset on the flow, which does not go when the valve opens; overlap",
    source: "Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, internal leakage",
    parameters: |scale, _| {
        let flow = scale.outputs[Output::Flow];
        let laminar = Parameter::linear(
            "leakage_laminar",
            "L/min/bar",
            -0.01 * flow,
            0.0,
            0.01 * flow,
        );
        vec![
            Parameter::linear("leakage", "L/min", -0.3 * flow, 0.0, 0.3 * flow),
            Parameter::log("leakage_width", "%", 0.1, 3.0, 30.0),
            // At a constant drop it is an offset.
            if scale.pressure {
                laminar
            } else {
                laminar.fixed()
            },
        ]
    },
    trials: |scale, _| {
        [1.0, 4.0, 12.0]
            .map(|width| {
                let mut trial = vec![0.02 * scale.outputs[Output::Flow], width];
                trial.extend(scale.pressure.then_some(0.0));
                trial
            })
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: entry::leaks_into_the_flow,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(2))),
    frequency: None,
};

/// Oil leaks past the lands: a peak of flow at null, and a laminar part.
#[derive(Debug, Clone)]
pub(in crate::model) struct Leakage<R> {
    peak: R,
    width: R,
    laminar: R,
}

impl<R: Real> Leakage<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            peak: next(),
            width: next(),
            laminar: next(),
        }
    }
}

impl<R: Real> Act<R> for Leakage<R> {
    #[inline(always)]
    fn flow(&self, flow: R, moment: &Moment<R>) -> R {
        let ratio = moment.opening / self.width;
        let peak = self.peak / (R::constant(1.0) + ratio * ratio);
        flow + peak + self.laminar * moment.drop
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_half_at_its_width() {
        let mut values = [1.5, 3.0, 0.02].into_iter();
        let effect: Leakage<f64> = Leakage::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
        };
        assert!((effect.flow(30.0, &moment) - (30.0 + 0.75 + 0.2)).abs() < 1e-12);
    }
}
