//! The lands overlap the ports.

use super::entry;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "overlap",
    port: Port::Area,
    summary: "The spool must move by the overlap before the ports open",
    finding: "the spool moves by {overlap} before the ports open",
    equation: "h = sign(x) max(|x| - overlap, 0)",
    shows: "no flow near null, single-valued; odd harmonics; the spool does not show it",
    confused: "hysteresis, whose dead band depends on the direction; gain_curvature, which has no corner",
    source: "Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, overlap",
    parameters: |_, _| vec![Parameter::linear("overlap", "%", 0.0, 0.0, 50.0)],
    trials: |_, _| [1.0, 3.0, 8.0, 20.0].map(|width| vec![width]).to_vec(),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: entry::has_lands,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(3))),
    frequency: None,
};

/// The spool must move by the overlap before the ports open.
#[derive(Debug, Clone)]
pub(in crate::model) struct Overlap<R> {
    width: R,
}

impl<R: Real> Overlap<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }
}

impl<R: Real> Act<R> for Overlap<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening - opening.clamp(-self.width, self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_opens_within_the_overlap() {
        let mut values = [5.0].into_iter();
        let effect: Overlap<f64> = Overlap::new(|| values.next().unwrap());
        let found = [-30.0, -5.0, 2.0, 6.0].map(|x| effect.opening(x));
        assert_eq!(found, [-25.0, 0.0, 0.0, 1.0]);
    }
}
