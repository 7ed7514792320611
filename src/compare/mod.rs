//! Before and after a repair: one structure fitted to both, what changed, and what did not.
//!
//! 1. Each side is diagnosed alone, on the same base model. The effects of both together are the structure; of two that a
//!    record cannot tell apart the one that was found before stands for both.
//! 2. Both are fitted again with that structure, so that every parameter and every figure has a value on both sides.
//! 3. How sure a parameter is towards the other side's value is read off the cost itself: held there, and all others fitted
//!    again, it rises by so much (likelihood ratio). That holds on a bound, too, where the curvature says nothing: a play of
//!    zero has no standard error.
//! 4. The differences are tested as one family (Holm 1979): the chance that anything is said to have changed where nothing has
//!    is 5 %.

mod change;
mod confounder;
pub(crate) mod family;
mod refit;

pub use change::{Change, EffectChange, Estimate, Fate, Outcome};
pub use confounder::{Condition, Confounder, check_alike};

use crate::card::{Card, Measured};
use crate::diagnose::Identified;
use crate::model::Structure;
use crate::model::effects::Effect;
use crate::search::Plan;
use crate::{Error, Result};
use refit::Refitted;
use std::ops::ControlFlow;

/// Two sides, and what changed from one to the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What was fitted to both.
    pub structure: Structure,
    /// Effects of the structure, and what became of each.
    pub effects: Vec<EffectChange>,
    /// Every parameter and every figure that both sides have.
    pub changes: Vec<Change>,
    /// The valve's cards, from that structure.
    pub cards: [Card; 2],
    /// What differs beside the valve, or may.
    pub confounders: Vec<Confounder>,
    /// Effects found after that stand for one found before, since the records cannot tell the two apart.
    pub taken_for: Vec<(Effect, Effect)>,
}

impl Comparison {
    /// The names of the parameters of an effect.
    pub fn parameters_of(&self, effect: &EffectChange) -> Vec<String> {
        let scale = self.structure.generic_scale();
        let own = effect.effect.parameters(&scale);
        own.into_iter().map(|parameter| parameter.name).collect()
    }
}

/// Compares two diagnoses on the same base model. The measured figures join the cards; `progress` is told each stage and may
/// break off.
///
/// # Errors
/// A fit that diverges; a run that was broken off.
pub fn compare(
    [before, after]: [&Identified; 2],
    measured: [Measured; 2],
    plan: &Plan,
    progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Comparison> {
    let mut tell = |stage: &str| match progress(stage) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::failed(
            format!("interrupted in \"{stage}\""),
            "add --resume to go on, where there is an --out",
        )),
    };
    let (structure, taken_for) = refit::union(before, after);
    tell("both: fitting")?;
    let sides = refit::both(&structure, [before, after], plan)?;
    tell("both: how sure each parameter is")?;
    let (parameters, sides) = change::of_parameters(sides, plan)?;
    tell("both: valve card")?;
    let cards = sides.each_ref().map(Refitted::card);
    let figures = change::of_figures(&cards, &sides);
    let changes = change::tested(parameters, figures);
    let [first, second] = measured;
    let [old, new] = cards;
    let cards = [
        old.beside(first, structure.hold),
        new.beside(second, structure.hold),
    ];
    Ok(Comparison {
        confounders: confounder::confounders(
            [before, after].map(|side| &side.measurements.conditions),
            &structure,
        ),
        effects: change::of_effects(&structure, [before, after], &changes),
        changes,
        cards,
        structure,
        taken_for,
    })
}
