//! What any bench adds to a record: zeros that are a little off, a scale of the spool that is, and a flow meter that lags. Each takes
//! little of what the others and a cause leave, so that none would be chosen alone: they are sought together, and count as one.

use super::evidence::{Evidence, Model, Side};
use crate::model::effects::{Effect, Port, known};
use crate::model::{Output, Structure};
use rayon::prelude::*;

/// `model` with two or more of the `allowed` ones of them, of which each is `worth` what it adds to the others; `None` where there
/// are no two.
pub(super) fn with_sensors(
    evidence: &Evidence,
    model: &Model,
    allowed: impl Fn(&Effect) -> bool,
    worth: impl Fn(&Model, &Model) -> bool,
) -> Option<(Vec<Effect>, Model)> {
    let all = of_any_bench(model.structure());
    let all: Vec<Effect> = all.filter(allowed).collect();
    let own = |effect: &Effect| effect.output.is_some();
    // Where all channels are off by what one shift of the command makes, it is that.
    let choices: [Vec<Effect>; 2] = [true, false].map(|sensors| {
        let zero = |effect: &&Effect| !effect.is_a_zero() || own(effect) == sensors;
        all.iter().filter(zero).copied().collect()
    });
    let several = choices.into_par_iter().filter(|effects| effects.len() > 1);
    let found = several.filter_map(|effects| {
        let model = together(evidence, model, &effects)?;
        Some((effects, model))
    });
    let found: Vec<(Vec<Effect>, Model)> = found.collect();
    let found: Vec<(Vec<Effect>, Model)> = found
        .into_iter()
        // What all of them do not take some of them do not.
        .filter(|(_, all)| worth(model, all))
        .map(|(effects, model)| needed(evidence, effects, model, &worth))
        .filter(|(effects, one)| effects.len() > 1 && worth(model, one))
        .collect();
    let models: Vec<&Model> = found.iter().map(|(_, one)| one).collect();
    let best = evidence.best(&models)?;
    let place = models.iter().position(|one| std::ptr::eq(*one, best))?;
    found.into_iter().nth(place)
}

/// Whether `effect` is a zero or a scale that is off, or a lag of a channel other than the spool, of which a lag is one more of the
/// loop that moves it.
pub(super) fn of_a_sensor(effect: &Effect) -> bool {
    let lags = effect.is_a_lag() && effect.output != Some(Output::Spool);
    effect.is_a_zero() || effect.is_a_gain() || lags
}

/// The zeros and lags that the sensors of `structure` may have, and the zero and the scale of its command, where it has none of these
/// causes.
fn of_any_bench(structure: &Structure) -> impl Iterator<Item = Effect> {
    let all = known().flat_map(|entry| entry.on(structure));
    let new = |effect: &Effect| !structure.has_cause_of(effect);
    let own = |one: &Effect| !one.is_a_lag() || one.entry.port == Port::Measurement;
    all.filter(move |one| of_a_sensor(one) && own(one) && new(one))
}

/// Those of its sensors: where the spool is in the command's unit, its scale.
pub(super) fn of_sensors(structure: &Structure) -> Vec<Effect> {
    let own = |effect: &Effect| effect.output.is_some() || effect.is_a_gain();
    of_any_bench(structure).filter(own).collect()
}

/// `model` with all of `effects`.
fn together(evidence: &Evidence, model: &Model, effects: &[Effect]) -> Option<Model> {
    let structure = effects
        .iter()
        .fold(model.structure().clone(), |all, &effect| all.with(effect));
    let mut start = model.problem.parameters.clone();
    for &effect in effects {
        let trials = effect.trials(&evidence.sizes);
        start.extend(evidence.at(effect, trials.first()?));
    }
    evidence.polished(evidence.problem(&structure, &start))
}

/// `model` with those of its `effects` that are `worth` what they add to the others.
fn needed(
    evidence: &Evidence,
    mut effects: Vec<Effect>,
    mut model: Model,
    worth: impl Fn(&Model, &Model) -> bool,
) -> (Vec<Effect>, Model) {
    while effects.len() > 1 {
        let without = |&effect: &Effect| {
            let structure = model.structure().without(effect);
            let problem = evidence.problem(&structure, &model.problem.parameters);
            Some((effect, evidence.polished(problem)?))
        };
        let reduced: Vec<(Effect, Model)> = effects.par_iter().filter_map(without).collect();
        let spare = reduced.into_iter().filter(|(_, one)| !worth(one, &model));
        let loss = |one: &(Effect, Model)| one.1.loss(Side::HoldOut);
        let Some((effect, one)) = spare.min_by(|a, b| loss(a).total_cmp(&loss(b))) else {
            break;
        };
        effects.retain(|other| *other != effect);
        model = one;
    }
    (effects, model)
}
