//! What the ways of seeking effects on top of a model have in common: where they begin, and what becomes of what they find.

use super::evidence::{Begun, Evidence, Model, Side, Start};
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

/// The `starts` after a polish of few steps.
pub(super) fn begun(evidence: &Evidence, starts: Vec<(Effect, Problem)>) -> Vec<(Effect, Begun)> {
    let starts = starts.into_par_iter();
    let begun =
        starts.filter_map(|(effect, start)| Some((effect, evidence.polished_a_little(start)?)));
    begun.collect()
}

/// The `most` of what was `begun` that cost least, of each effect as many as are `alike`.
pub(super) fn least_costly(
    mut begun: Vec<(Effect, Begun)>,
    most: usize,
    alike: usize,
) -> Vec<(Effect, Problem)> {
    begun.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<(Effect, Problem)> = Vec::new();
    for (effect, one) in begun {
        let same = kept.iter().filter(|(other, _)| *other == effect).count();
        if same < alike && kept.len() < most {
            kept.push((effect, one.problem));
        }
    }
    kept
}

/// Those of what was `begun` that cost less than `most`, and the one that costs least.
pub(super) fn near(mut begun: Vec<(Effect, Begun)>, most: f64) -> Vec<(Effect, Begun)> {
    let costs = begun.iter().map(|(_, one)| one.cost);
    let least = costs.fold(f64::INFINITY, f64::min);
    begun.retain(|(_, one)| one.cost < most || one.cost <= least);
    begun
}

/// The `starts` polished to the end.
pub(super) fn to_the_end(
    evidence: &Evidence,
    starts: Vec<(Effect, Problem)>,
) -> Vec<(Effect, Model)> {
    let starts = starts.into_par_iter();
    let models = starts.filter_map(|(effect, start)| Some((effect, evidence.polished(start)?)));
    models.collect()
}

/// Those of the `starts` that, polished to the end, follow the fitted rows more closely than `model`.
pub(super) fn better(
    evidence: &Evidence,
    model: &Model,
    starts: Vec<(Effect, Problem)>,
) -> Vec<(Effect, Model)> {
    let mut models = to_the_end(evidence, starts);
    models.retain(|(_, one)| one.loss(Side::Fit) < model.loss(Side::Fit));
    models
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    #[test]
    fn what_is_near_costs_less_than_a_limit_or_least_of_all() {
        let effect = "delay".parse::<Effect>().unwrap();
        let begun = |cost: f64| {
            let problem = workload::actuator(2);
            (effect, Begun { problem, cost })
        };
        let kept = |most: f64| {
            let near = near([3.0, 1.0, 7.0].map(begun).to_vec(), most);
            near.iter().map(|(_, one)| one.cost).collect::<Vec<_>>()
        };
        assert_eq!(kept(f64::INFINITY), [3.0, 1.0, 7.0]);
        assert_eq!(kept(5.0), [3.0, 1.0]);
        assert_eq!(kept(0.5), [1.0]);
        assert!(near(Vec::new(), 5.0).is_empty());
    }
}
