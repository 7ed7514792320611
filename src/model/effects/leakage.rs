//! Oil leaks past the lands, from P to T. A meter between A and B does not see it.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Output, Parameter, Real};

/// Of the reference drop, the least of which a root is taken.
const LEAST_DROP: f64 = 1e-9;

pub(super) const ENTRY: Entry = Entry {
    name: "leakage",
    port: Port::Flow,
    summary: "Oil leaks past the lands from P to T: a peak at null, and a laminar part",
    finding: "{leakage} leak past the lands at null",
    equation: "Q + leakage sqrt(dp/dp0)/(1 + (x/leakage_width)^2) + leakage_laminar dp, dp0 the rated drop, or 70 bar where \
               pressures are measured",
    shows: "where the flow meter stands in the pressure line or in the return line, not between A and B: flow at closed lands, \
            largest at null and gone when the valve is open",
    confused: "sensor_offset on the flow, which does not go when the valve opens; overlap",
    source: "Merritt, Hydraulic Control Systems, 1967: turbulent past worn edges, laminar through clearances; ISO 10770-1, \
             internal leakage",
    parameters: |scale, _| {
        let flow = scale.outputs[Output::Flow];
        let laminar = Parameter::linear("leakage_laminar", "L/min/bar", 0.0, 0.0, 0.01 * flow);
        vec![
            Parameter::linear("leakage", "L/min", 0.0, 0.0, 0.3 * flow),
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
    applies: host::shows_what_is_delivered,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(2))),
    frequency: None,
};

/// Oil leaks past the lands: a peak at null, and a laminar part.
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
    fn delivered(&self, flow: R, moment: &Moment<R>) -> R {
        let ratio = moment.opening / self.width;
        let drop = moment.relative_drop.max(R::constant(LEAST_DROP));
        let peak = self.peak * drop.sqrt() / (R::constant(1.0) + ratio * ratio);
        flow + peak + self.laminar * moment.drop
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delivered(opening: f64, relative_drop: f64) -> f64 {
        let mut values = [1.5, 3.0, 0.02].into_iter();
        let effect: Leakage<f64> = Leakage::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening,
            drop: 70.0 * relative_drop,
            relative_drop,
        };
        effect.delivered(30.0, &moment)
    }

    #[test]
    fn it_is_half_at_its_width() {
        assert!((delivered(3.0, 1.0) - (30.0 + 0.75 + 1.4)).abs() < 1e-12);
    }

    #[test]
    fn at_four_times_the_drop_the_peak_is_twice_and_the_laminar_part_four_times_as_large() {
        assert!((delivered(0.0, 4.0) - (30.0 + 3.0 + 5.6)).abs() < 1e-12);
        assert!((delivered(0.0, 0.0) - 30.0).abs() < 1e-4);
    }
}
