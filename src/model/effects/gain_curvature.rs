//! The opening curves with the stroke.

use super::entry;
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "gain_curvature",
    port: Port::Area,
    summary: "The flow gain changes along the stroke",
    finding: "the flow gain changes along the stroke, by {gain_curvature} from its mean to its end",
    equation: "h = x + gain_curvature x (|x| - 1), x = 1 at full scale",
    shows: "an odd, static residual that grows with |x| and is zero at full scale",
    confused: "overlap, which has a corner near null; supply_droop, whose error goes with the flow squared and lags",
    source: "shaped metering edges; ISO 10770-1, linearity",
    parameters: |_, _| vec![Parameter::linear("gain_curvature", "1", -0.95, 0.0, 0.95)],
    trials: |_, _| vec![vec![0.05], vec![0.3]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: entry::shows_its_area,
    outputs: None,
    view: None,
    frequency: None,
};

/// The flow gain changes along the stroke.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainCurvature<R> {
    share: R,
}

impl<R: Real> GainCurvature<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for GainCurvature<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let full = R::constant(0.01);
        opening + self.share * opening * (opening.abs() * full - R::constant(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_bends_between_null_and_full_scale() {
        let mut values = [0.2].into_iter();
        let effect: GainCurvature<f64> = GainCurvature::new(|| values.next().unwrap());
        let found = [0.0, 50.0, -50.0, 100.0].map(|x| effect.opening(x));
        assert_eq!(found, [0.0, 45.0, -45.0, 100.0]);
    }
}
