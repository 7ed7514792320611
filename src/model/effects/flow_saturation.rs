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

pub(super) const SERIES: Entry = Entry {
    name: "flow_saturation~series",
    summary: "Fixed passages in series with the ports take ever more of the pressure, the further these open",
    finding: "passages in series with the ports take {series_loss} times as much of the pressure as these where they are fully open",
    equation: "h / sqrt(1 + series_loss (h/100 %)^2)",
    shows: "a flow that grows ever less with the opening, alike on both sides, which the spool does not show",
    confused: "supply_droop~turbulent, a loss with the square of the flow as well, in the supply and with its lag; gain_curvature, which need not \
               come from a loss; flow_saturation, whose corner is sharp",
    source: "orifices in series: Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, flow saturation",
    parameters: |_, _| vec![Parameter::linear("series_loss", "1", 0.0, 0.0, 25.0)],
    trials: |_, _| [0.1, 0.5, 2.0].map(|loss| vec![loss]).to_vec(),
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(2))),
    ..ENTRY
};

/// Passages in series with the ports.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowSaturationOfSeries<R> {
    loss: R,
}

impl<R: Real> FlowSaturationOfSeries<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { loss: next() }
    }
}

impl<R: Real> Act<R> for FlowSaturationOfSeries<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let share = opening * R::constant(0.01);
        opening / (R::constant(1.0) + self.loss * (share * share)).sqrt()
    }
}

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
    fn orifices_in_series_share_the_pressure() {
        let effect: FlowSaturationOfSeries<f64> = FlowSaturationOfSeries::new(|| 0.5);
        // The same flow through both: q² = (h/100)² d = loss⁻¹ (1 - d), d the ports' share of the pressure.
        for opening in [-80.0, 5.0, 90.0] {
            let flow = effect.opening(opening) / 100.0;
            let ports = (flow / (opening / 100.0)).powi(2);
            let series = 0.5 * flow.powi(2);
            assert!((ports + series - 1.0).abs() < 1e-12, "{opening}");
            assert_eq!(flow.signum(), opening.signum());
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
