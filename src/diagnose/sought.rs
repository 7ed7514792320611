//! What the ways of seeking effects on top of a model have in common: where they begin, and what becomes of what they find.

use super::evidence::{Evidence, Model, Side, Start};
use crate::evaluate::Problem;
use crate::model::effects::Effect;
use crate::model::{Parameter, Scale};
use rayon::prelude::*;

/// What can be of either sign is sought this share of its range around its value at least.
const BESIDE: f64 = 0.05;

/// The starts for `effect` on top of `model` at its first trial.
pub(super) fn first_starts(evidence: &Evidence, model: &Model, effect: &Effect) -> Vec<Start> {
    let mut starts = evidence.search_starts(model, effect);
    let first = starts[0].trial.clone();
    starts.retain(|one| one.trial == first);
    starts
}

/// The `most` of what was `found` that cost least, of each effect as many as are `alike`.
pub(super) fn least_costly(
    mut found: Vec<(f64, Effect, Problem)>,
    most: usize,
    alike: usize,
) -> Vec<(Effect, Problem)> {
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<(Effect, Problem)> = Vec::new();
    for (_, effect, problem) in found {
        let same = kept.iter().filter(|(other, _)| *other == effect).count();
        if same < alike && kept.len() < most {
            kept.push((effect, problem));
        }
    }
    kept
}

/// What was `found`, polished to the end, where it follows the fitted rows more closely than `model`, and the candidates evaluated
/// for it.
pub(super) fn polished(
    evidence: &Evidence,
    model: &Model,
    found: Vec<(Effect, Problem)>,
) -> (Vec<(Effect, Model)>, usize) {
    let models: Vec<(Effect, Model)> = found
        .into_par_iter()
        .filter_map(|(effect, problem)| Some((effect, evidence.polished(problem)?)))
        .filter(|(_, one)| one.loss(Side::Fit) < model.loss(Side::Fit))
        .collect();
    let evaluations = models.iter().map(|(_, one)| one.evaluations).sum();
    (models, evaluations)
}

/// Bounds `parameter` by this factor around its value; where its scale is linear, by as much as that is to either side.
pub(super) fn around(parameter: &mut Parameter, factor: f64) {
    let value = parameter.nominal();
    let (low, high) = match parameter.scale {
        Scale::Log => (value / factor, value * factor),
        Scale::Linear => {
            let far = value.abs().max(BESIDE * (parameter.high - parameter.low));
            (value - far, value + far)
        }
    };
    parameter.low = parameter.low.max(low);
    parameter.high = parameter.high.min(high);
}
