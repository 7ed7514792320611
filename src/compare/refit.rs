//! One structure, fitted to both sides.

use crate::Result;
use crate::card::Card;
use crate::diagnose::{Added, Identified, seconds_apart};
use crate::evaluate::Problem;
use crate::evaluate::problem::Data;
use crate::model::effects::Effect;
use crate::model::{Parameter, Structure};
use crate::search::{Fit, Plan, refine};
use std::sync::Arc;

/// A side, fitted with the common structure.
#[derive(Debug, Clone)]
pub(super) struct Refitted {
    pub(super) problem: Problem,
    pub(super) fit: Fit,
}

impl Refitted {
    pub(super) fn card(&self) -> Card {
        Card::of(&self.problem, &self.fit)
    }

    /// The index among the free parameters of the one called `name`.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.fit.free.iter().position(|own| own.name == name)
    }
}

/// The base model with the effects of both sides, and which effects found after stand for one found before.
pub(super) fn union(before: &Identified, after: &Identified) -> (Structure, Vec<(Effect, Effect)>) {
    let base = &before.before.problem.structure;
    let mut structure = before
        .added
        .iter()
        .fold(base.clone(), |structure, one| structure.with(one.effect));
    let mut taken_for = Vec::new();
    for new in &after.added {
        if structure.effects.contains(&new.effect) {
            continue;
        }
        let tied = |old: &&Added| {
            let open = after.added.iter().all(|one| one.effect != old.effect);
            let same = old.tied_with.contains(&new.effect) || new.tied_with.contains(&old.effect);
            open && same
        };
        match before.added.iter().find(tied) {
            Some(old) => taken_for.push((new.effect, old.effect)),
            None => structure = structure.with(new.effect),
        }
    }
    (structure, taken_for)
}

/// Both sides with the `structure`.
pub(super) fn both(
    structure: &Structure,
    sides: [&Identified; 2],
    plan: &Plan,
) -> Result<[Refitted; 2]> {
    let parameters = parameters(structure, sides);
    // In which phase of a hum the logger was switched on is no change.
    let hums = structure
        .effects
        .iter()
        .any(|effect| effect.frequency().is_some());
    let later = if hums { seconds_apart(sides) } else { 0.0 };
    let [first, second] = [(0, 0.0), (1, later)].map(|(side, later)| {
        let problem = Problem {
            data: shifted(&sides[side].after.problem.data, later),
            ..sides[side].after.problem.clone()
        };
        fitted(structure, &parameters, sides, side, problem, plan)
    });
    Ok([first?, second?])
}

/// The parameters of the `structure`, with bounds that hold what either side allows.
fn parameters(structure: &Structure, sides: [&Identified; 2]) -> Vec<Parameter> {
    let known = |name: &str| -> Vec<&Parameter> {
        let all = sides.iter().flat_map(|side| {
            let (base, result) = (&side.before.problem, &side.after.problem);
            base.parameters.iter().chain(&result.parameters)
        });
        all.filter(|own| own.name == name).collect()
    };
    let widened = |generic: Parameter| {
        let known = known(&generic.name);
        let mut parameter = known.first().map_or(generic, |&own| own.clone());
        for own in known {
            parameter.low = parameter.low.min(own.low);
            parameter.high = parameter.high.max(own.high);
        }
        parameter
    };
    structure.parameters().into_iter().map(widened).collect()
}

/// `data` whose time, as the model sees it, is so many `seconds` later.
fn shifted(data: &Arc<Data>, seconds: f64) -> Arc<Data> {
    let mut shifted = data.clone();
    if seconds != 0.0
        && let Data::Series(all) = Arc::make_mut(&mut shifted)
    {
        all.iter_mut()
            .for_each(|series| series.shift_clock(seconds));
    }
    shifted
}

/// The better of two fits of a side's `problem`: from the other side's values of what it lacks itself, and from what does nothing.
fn fitted(
    structure: &Structure,
    parameters: &[Parameter],
    sides: [&Identified; 2],
    side: usize,
    mut problem: Problem,
    plan: &Plan,
) -> Result<Refitted> {
    let (own, other) = (sides[side], sides[1 - side]);
    problem.structure = structure.clone();
    problem.parameters = parameters.to_vec();
    let value = |side: &Identified, name: &str| {
        let after = &side.after;
        let values = after.problem.parameters.iter().zip(after.values.as_slice());
        let found = values.clone().find(|(parameter, _)| parameter.name == name);
        found.map(|(_, value)| *value)
    };
    let start = |lent: bool| -> Vec<f64> {
        let one = |parameter: &Parameter| {
            let known = value(own, &parameter.name);
            let lent = || value(other, &parameter.name).filter(|_| lent);
            let start = known.or_else(lent).unwrap_or(parameter.nominal());
            parameter.clamp(start)
        };
        let free = parameters.iter().filter(|parameter| !parameter.is_fixed());
        free.map(one).collect()
    };
    let lent = refine(&problem, &start(true), plan);
    let fit = match own.after.problem.parameters.len() == parameters.len() {
        true => lent?,
        false => match (lent, refine(&problem, &start(false), plan)) {
            (Ok(a), Ok(b)) if b.cost() < a.cost() => b,
            (Ok(a), _) => a,
            (Err(_), own) => own?,
        },
    };
    Ok(Refitted { problem, fit })
}
