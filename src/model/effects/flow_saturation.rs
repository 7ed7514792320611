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

pub(super) const CHOKED: Entry = Entry {
    name: "flow_saturation~choked",
    summary: "The flow of either side comes gradually to a limit of its own, as where it is choked by cavitation",
    finding: "the flow comes to that of an opening of {choked_up} on the positive side and of {choked_down} on the negative one",
    equation: "h / (1 + (|h|/s)^4)^(1/4), s = choked_up for h > 0 and choked_down for h < 0",
    shows: "rounded tops of the flow at large openings, on one side or on both, which the spool does not show",
    confused: "flow_saturation, whose corner is sharp and alike on both sides; asymmetric_gain, which is there at small openings, too",
    source: "choked flow of cavitating orifices: Merritt, Hydraulic Control Systems, 1967; passages in series with the ports",
    parameters: |_, _| {
        let limit = |name| Parameter::log(name, "%", 5.0, FAR, FAR);
        vec![limit("choked_up"), limit("choked_down")]
    },
    trials: |_, _| {
        [
            (70.0, 70.0),
            (70.0, FAR),
            (FAR, 70.0),
            (40.0, FAR),
            (FAR, 40.0),
        ]
        .map(|(up, down)| vec![up, down])
        .to_vec()
    },
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(1))),
    ..ENTRY
};

/// A limit that is never met, %.
const FAR: f64 = 2000.0;

/// The flow of either side comes gradually to a limit.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowSaturationChoked<R> {
    up: R,
    down: R,
}

impl<R: Real> FlowSaturationChoked<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            up: next(),
            down: next(),
        }
    }
}

impl<R: Real> Act<R> for FlowSaturationChoked<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let share = opening / opening.if_positive(self.up, self.down);
        let square = share * share;
        opening / (R::constant(1.0) + square * square).sqrt().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choked_flow_comes_to_its_limit() {
        let mut values = [50.0, 80.0].into_iter();
        let effect: FlowSaturationChoked<f64> =
            FlowSaturationChoked::new(|| values.next().unwrap());
        for (opening, expected) in [
            (5.0, 5.0),
            (50.0, 50.0 / 2f64.powf(0.25)),
            (5000.0, 50.0),
            (-8.0, -8.0),
            (-80.0, -80.0 / 2f64.powf(0.25)),
        ] {
            let found = effect.opening(opening);
            assert!((found - expected).abs() < 3e-4, "{opening}: {found}");
        }
    }

    #[test]
    fn beyond_its_end_nothing_opens_further() {
        let mut values = [80.0].into_iter();
        let effect: FlowSaturation<f64> = FlowSaturation::new(|| values.next().unwrap());
        let found = [-95.0, -20.0, 79.0, 81.0].map(|x| effect.opening(x));
        assert_eq!(found, [-80.0, -20.0, 79.0, 80.0]);
    }
}
