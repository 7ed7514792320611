//! The two directions have different gains.

use super::host;
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "asymmetric_gain",
    port: Port::Area,
    summary: "The valve opens more in one direction than in the other",
    finding: "the valve opens more in one direction than in the other, by {asymmetric_gain} either way",
    equation: "h = x (1 + asymmetric_gain) for x > 0, x (1 - asymmetric_gain) for x < 0",
    shows: "a residual in proportion to |x|: second harmonic, single-valued; the spool does not show it",
    confused: "sensor_offset and null_bias, which are there at null, too",
    source: "asymmetric metering edges, differential cylinders; ISO 10770-1, symmetry",
    parameters: |_, _| vec![Parameter::linear("asymmetric_gain", "1", -0.9, 0.0, 0.9)],
    trials: |_, _| vec![vec![0.05]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_its_area,
    outputs: None,
    view: None,
    frequency: None,
};

/// The valve opens more in one direction than in the other.
#[derive(Debug, Clone)]
pub(in crate::model) struct AsymmetricGain<R> {
    share: R,
}

impl<R: Real> AsymmetricGain<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for AsymmetricGain<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening + self.share * opening.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_direction_has_its_gain() {
        let mut values = [0.25].into_iter();
        let effect: AsymmetricGain<f64> = AsymmetricGain::new(|| values.next().unwrap());
        assert_eq!([8.0, -8.0].map(|x| effect.opening(x)), [10.0, -6.0]);
    }
}
