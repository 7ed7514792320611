//! The ports are fully open before the spool is at its end.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "flow_saturation",
    port: Port::Area,
    summary: "The ports are fully open before the spool is at its end",
    finding: "the ports are fully open at {flow_saturation}",
    equation: "|h| <= flow_saturation",
    shows: "flat tops of the flow at large openings, which the spool does not show",
    confused: "stroke_limit, which the spool shows too; gain_curvature, which has no corner; supply_droop",
    source: "ISO 10770-1, flow saturation: the region where the flow no longer follows the input",
    parameters: |_, _| vec![Parameter::linear("flow_saturation", "%", 5.0, 300.0, 300.0)],
    trials: |_, _| {
        [110.0, 100.0, 90.0, 75.0, 55.0, 35.0]
            .map(|end| vec![end])
            .to_vec()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::has_lands,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(3))),
    frequency: None,
};

/// The ports are fully open before the spool is at its end.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowSaturation<R> {
    end: R,
}

impl<R: Real> FlowSaturation<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { end: next() }
    }
}

impl<R: Real> Act<R> for FlowSaturation<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening.clamp(-self.end, self.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_its_end_nothing_opens_further() {
        let mut values = [80.0].into_iter();
        let effect: FlowSaturation<f64> = FlowSaturation::new(|| values.next().unwrap());
        let found = [-95.0, -20.0, 79.0, 81.0].map(|x| effect.opening(x));
        assert_eq!(found, [-80.0, -20.0, 79.0, 80.0]);
    }
}
