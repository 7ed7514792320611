//! A position transducer that is not straight: in the spool's loop, or beside it.

use crate::model::{Parameter, Real};

/// Its parameters: how far it is off at `full` (in `unit`) with the square and with the cube of what it measures, and `full`.
pub(super) fn parameters(names: [&str; 3], unit: &str, full: f64) -> Vec<Parameter> {
    let [square, cubic, span] = names;
    let off = |name| Parameter::linear(name, unit, -0.2 * full, 0.0, 0.2 * full);
    let span = Parameter::linear(span, unit, 0.0, full, full).fixed();
    vec![off(square), off(cubic), span]
}

/// A cube alone, and one with a square beside it.
pub(super) fn trials(full: f64) -> Vec<Vec<f64>> {
    let shares = [[0.0, 0.03], [0.01, -0.03]];
    shares
        .map(|shares| shares.map(|share| share * full).to_vec())
        .to_vec()
}

/// The curve with values for its parameters.
#[derive(Debug, Clone)]
pub(super) struct Curve<R> {
    square: R,
    cubic: R,
    span: R,
}

impl<R: Real> Curve<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            square: next(),
            cubic: next(),
            span: next(),
        }
    }

    /// How far the transducer is off at `position`.
    #[inline(always)]
    pub(super) fn off(&self, position: R) -> R {
        let share = position / self.span;
        share * share * (self.square + self.cubic * share)
    }
}
