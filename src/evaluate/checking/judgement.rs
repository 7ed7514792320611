//! What one cost says of the evaluator that computed it.
//!
//! A cost in f32 that is off by more than [`PARITY`] need not be wrong: a hardly damped spool in deep saturation is chaotic,
//! and there any rounding grows large; where a model follows its data exactly, rounding is all that is left of the cost.
//! How much rounding can do to a candidate shows when it is computed in f32 on the CPU, as it is and with its values moved
//! by a rounding each. A cost within [`MARGIN`] times that says nothing, and one that is the CPU's in f32 is right.

use crate::evaluate::population::Cost;

/// Largest relative difference of a cost in f32 from the same in f64, or of two in f32, for candidates anywhere inside
/// the bounds: measured at up to 3e-5, where a hardly damped spool rings through the whole record.
pub const PARITY: f64 = 1e-4;

/// What rounding does to a candidate on the CPU, times this, is what it may do on another device.
const MARGIN: f64 = 10.0;

/// What a cost says of the evaluator that computed it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::evaluate) enum Judgement {
    /// It is right.
    Right,
    /// It may be right or wrong: rounding alone can make such a difference.
    Inconclusive,
    /// It is wrong by this share.
    Wrong(f64),
}

impl Judgement {
    /// What a cost that is not the `reference` in f64 says, given those in f32 on the CPU of the same candidate and of its
    /// neighbours.
    pub(in crate::evaluate) fn new(cost: Cost, reference: Cost, rounded: &[Cost]) -> Self {
        if cost.difference(&rounded[0]) <= PARITY {
            return Self::Right;
        }
        if rounded.iter().any(|cost| cost.status != reference.status) {
            return Self::Inconclusive;
        }
        let off = |cost: &Cost| (cost.value - reference.value).abs();
        let rounding = rounded.iter().map(off).fold(0.0, f64::max);
        if cost.status == reference.status && off(&cost) <= MARGIN * rounding {
            return Self::Inconclusive;
        }
        Self::Wrong(cost.difference(&reference))
    }

    /// By how much the cost is wrong, where it is.
    pub(in crate::evaluate) fn fault(&self) -> Option<f64> {
        match *self {
            Self::Wrong(by) => Some(by),
            Self::Right | Self::Inconclusive => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn costs<const N: usize>(values: [f64; N]) -> [Cost; N] {
        values.map(Cost::finished)
    }

    #[test]
    fn a_cost_is_wrong_where_rounding_cannot_explain_it() {
        let [reference] = costs([1.0]);
        let steady = costs([1.0 + 2e-6, 1.0 - 1e-6, 1.0]);
        for wrong in [1.0 + 2e-4, 1.0 - 2e-4, 0.0, f64::INFINITY] {
            let found = Judgement::new(Cost::finished(wrong), reference, &steady);
            assert!(matches!(found, Judgement::Wrong(_)), "{wrong}: {found:?}");
        }
        let diverged = Judgement::new(reference, Cost::DIVERGED, &[Cost::DIVERGED; 3]);
        assert_eq!(diverged, Judgement::Wrong(f64::INFINITY));
    }

    #[test]
    fn a_candidate_that_rounding_carries_away_says_nothing() {
        let [reference, far] = costs([1.0, 1.7]);
        let chaotic = costs([1.3, 0.9, 1.1]);
        assert_eq!(
            Judgement::new(far, reference, &chaotic),
            Judgement::Inconclusive
        );
        let brink = [reference, reference, Cost::DIVERGED];
        assert_eq!(
            Judgement::new(far, reference, &brink),
            Judgement::Inconclusive
        );
        // As the CPU's f32 has it.
        let [near] = costs([1.3 + 1e-5]);
        assert_eq!(Judgement::new(near, reference, &chaotic), Judgement::Right);
        assert_eq!(
            Judgement::new(Cost::DIVERGED, reference, &[Cost::DIVERGED; 3]),
            Judgement::Right
        );
        // Next to zero only rounding is left of a cost.
        let [nothing, rest] = costs([1e-20, 4e-13]);
        let rounded = costs([2e-13, 1e-13, 3e-13]);
        assert_eq!(
            Judgement::new(rest, nothing, &rounded),
            Judgement::Inconclusive
        );
    }
}
