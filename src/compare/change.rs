//! What changed from one side to the other: parameters, figures and effects, tested as one family.

use super::family::{HALF, LEVEL, family_wise, two_sided};
use super::refit::Refitted;
use crate::card::{Card, Figure, Quantity};
use crate::diagnose::Identified;
use crate::evaluate::Fingerprint;
use crate::model::effects::{Effect, Scale};
use crate::model::{Parameter, Structure};
use crate::search::polish::{PolishOptions, Uncertainty, polish, student_t};
use crate::search::{Plan, Stoppable};
use crate::{Error, Result};
use serde::Serialize;

/// A share of a value below which two of them are the same.
const ARITHMETIC: f64 = 1e-6;
/// Below so many standard errors nothing has changed, and the cost is not asked.
const NEAR: f64 = 1.0;

/// A value on one side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Lower end of its 95 % interval; null where the data do not determine it.
    pub low: Option<f64>,
    /// Upper end, likewise.
    pub high: Option<f64>,
}

/// Whether something changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// By more than chance allows in the whole family.
    Changed,
    /// Not by more than chance allows: the interval of the difference says by how much it can have.
    NotChanged,
    /// One of the two records does not determine it.
    NotDetermined,
}

/// A parameter or a figure on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// `parameter` of the model, or `figure` of the card.
    pub of: &'static str,
    /// Its name.
    pub name: String,
    /// What people call it.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// What it was.
    pub before: Estimate,
    /// What it is.
    pub after: Estimate,
    /// After less before.
    pub difference: f64,
    /// Lower end of the difference's 95 % interval; null where it is not determined.
    pub low: Option<f64>,
    /// Upper end, likewise.
    pub high: Option<f64>,
    /// The chance of such a difference where nothing has changed, corrected for the whole family; null where it is not
    /// determined.
    pub p_value: Option<f64>,
    /// Whether it changed.
    pub outcome: Outcome,
}

/// What became of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// It was not found before, and what it does has changed.
    Came,
    /// It was found before alone, and what it does has changed.
    Went,
    /// It is there on both sides, and what it does has changed.
    Changed,
    /// What it does has not changed by more than chance allows.
    Stayed,
}

/// An effect of the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectChange {
    /// The effect.
    pub effect: Effect,
    /// Whether each side's diagnosis had it.
    pub found: [bool; 2],
    /// What became of it.
    pub fate: Fate,
    /// Effects that the records in which it was found cannot tell from it.
    pub tied_with: Vec<Effect>,
}

impl Change {
    /// `before` and `after`, whose standard errors towards each other these are.
    fn new(
        of: &'static str,
        [name, label, unit]: [&str; 3],
        [before, after]: [Estimate; 2],
        errors: [Option<f64>; 2],
        freedom: f64,
    ) -> Self {
        let difference = after.value - before.value;
        let error = match errors {
            [Some(old), Some(new)] => Some(old.hypot(new)).filter(|error| error.is_finite()),
            _ => None,
        };
        let size = before.value.abs().max(after.value.abs());
        let same = difference.abs() <= ARITHMETIC * size;
        let p_value = error.map(|error| match same {
            true => 1.0,
            false => two_sided(difference / error.max(f64::MIN_POSITIVE), freedom),
        });
        Self {
            of,
            name: name.into(),
            label: label.into(),
            unit: unit.into(),
            before,
            after,
            difference,
            low: error.map(|error| difference - HALF * error),
            high: error.map(|error| difference + HALF * error),
            p_value,
            outcome: Outcome::NotDetermined,
        }
    }
}

/// The free parameters of both sides, and the sides with the intervals that were found for those whose curvature says nothing.
pub(super) fn of_parameters(
    mut sides: [Refitted; 2],
    plan: &Plan,
) -> Result<(Vec<Change>, [Refitted; 2])> {
    let names: Vec<Parameter> = sides[0].fit.free.clone();
    let mut changes = Vec::new();
    for parameter in &names {
        let indices = sides
            .each_ref()
            .map(|side| side.index(&parameter.name).expect("the same structure"));
        let values = [0, 1].map(|i: usize| sides[i].fit.values()[indices[i]]);
        let mut errors = [None, None];
        for i in [0, 1] {
            errors[i] = towards(&sides[i], indices[i], values[1 - i], plan)?;
            widen(&mut sides[i], indices[i], errors[i]);
        }
        let estimates = [0, 1].map(|i: usize| estimate(&sides[i], indices[i]));
        let freedom = sides.iter().map(freedom).fold(f64::INFINITY, f64::min);
        let Parameter { name, unit, .. } = parameter;
        let change = Change::new("parameter", [name, name, unit], estimates, errors, freedom);
        changes.push(change);
    }
    Ok((changes, sides))
}

fn freedom(side: &Refitted) -> f64 {
    let polished = side.fit.polished.as_ref();
    polished.map_or(0.0, |(_, uncertainty)| uncertainty.degrees_of_freedom)
}

/// The variance of a residual.
fn variance(uncertainty: &Uncertainty) -> f64 {
    uncertainty.cost_margin / student_t(uncertainty.degrees_of_freedom).powi(2)
}

/// How sure free parameter number `j` of a side is towards `value`: so many standard errors away as the root of the rise of
/// the cost, in units of a residual's variance, where it is held there and the others are fitted again.
fn towards(side: &Refitted, j: usize, value: f64, plan: &Plan) -> Result<Option<f64>> {
    let Some((polished, uncertainty)) = &side.fit.polished else {
        return Ok(None);
    };
    if uncertainty.degrees_of_freedom <= 0.0 {
        return Ok(None);
    }
    let own = polished.values[j];
    let known = uncertainty.standard_errors[j];
    let apart = (value - own).abs();
    if known.is_some_and(|error| apart < NEAR * error) || apart <= ARITHMETIC * own.abs() {
        return Ok(known);
    }
    let mut problem = side.problem.clone();
    let name = &side.fit.free[j].name;
    for parameter in &mut problem.parameters {
        if let Some(index) = side.index(&parameter.name) {
            parameter.set_nominal(polished.values[index]);
        }
        if parameter.name == *name {
            parameter.set_nominal(value);
            parameter.set_fixed(true);
        }
    }
    let interrupt = plan.memory.interrupt();
    let key = || {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("held at").problem(&problem).finish()
    };
    let held: Option<f64> = plan.memory.once(key, || {
        let (free, start) = (problem.free(), problem.start());
        let mut stoppable = Stoppable::new(&problem, interrupt);
        match free.is_empty() {
            true => crate::evaluate::reference::cost(&problem, &[]),
            false => {
                let options = PolishOptions::default();
                let held = polish(&mut stoppable, &free, &start, &options).ok()?;
                Some(held.cost)
            }
        }
    });
    if interrupt.asked() {
        return Err(Error::failed(
            "interrupted while both sides were compared",
            "add --resume to go on, where there is an --out",
        ));
    }
    // A model that diverges there is as far off as can be.
    let rise = held.map_or(f64::INFINITY, |cost| (cost - polished.cost).max(0.0));
    let deviations = (rise / variance(uncertainty)).sqrt();
    Ok(Some(apart / deviations).filter(|error| error.is_finite()))
}

/// Gives a parameter whose curvature says nothing the interval that its cost has.
fn widen(side: &mut Refitted, j: usize, error: Option<f64>) {
    let parameter = side.fit.free[j].clone();
    let Some((polished, uncertainty)) = &mut side.fit.polished else {
        return;
    };
    let (None, Some(error)) = (uncertainty.standard_errors[j], error) else {
        return;
    };
    let value = polished.values[j];
    let half = student_t(uncertainty.degrees_of_freedom) * error;
    let interval = &mut uncertainty.intervals[j];
    interval.low = parameter.clamp(value - half);
    interval.high = parameter.clamp(value + half);
    interval.open_low = false;
    interval.open_high = false;
}

fn estimate(side: &Refitted, j: usize) -> Estimate {
    let value = side.fit.values()[j];
    let interval = side
        .fit
        .polished
        .as_ref()
        .map(|(_, uncertainty)| &uncertainty.intervals[j]);
    let interval = interval.filter(|one| !one.open_low && !one.open_high);
    Estimate {
        value,
        low: interval.map(|one| one.low),
        high: interval.map(|one| one.high),
    }
}

/// The figures that both cards have.
pub(super) fn of_figures(cards: &[Card; 2], sides: &[Refitted; 2]) -> Vec<Change> {
    let freedom = sides.iter().map(freedom).fold(f64::INFINITY, f64::min);
    let [before, after] = cards;
    let both = before.figures.iter().zip(&after.figures);
    let change = |(old, new): (&Figure, &Figure)| {
        let one = |figure: &Figure| {
            let value = figure.value?;
            Some(Estimate {
                value,
                low: figure.low,
                high: figure.high,
            })
        };
        let (before, after) = (one(old)?, one(new)?);
        if old.is_none_in_model() && new.is_none_in_model() {
            return None;
        }
        let error = |own: &Estimate, other: f64| {
            // A direction is known or not.
            if old.quantity == Quantity::Polarity {
                return Some(0.0);
            }
            let end = if other > own.value {
                own.high?
            } else {
                own.low?
            };
            Some((end - own.value).abs() / HALF)
        };
        let errors = [error(&before, after.value), error(&after, before.value)];
        let name = old.quantity.to_string();
        let names = [name.as_str(), &old.label, &old.unit];
        Some(Change::new(
            "figure",
            names,
            [before, after],
            errors,
            freedom,
        ))
    };
    both.filter_map(change).collect()
}

/// All of them, tested as one family.
pub(super) fn tested(parameters: Vec<Change>, figures: Vec<Change>) -> Vec<Change> {
    let mut all: Vec<Change> = parameters.into_iter().chain(figures).collect();
    let chances: Vec<f64> = all.iter().filter_map(|one| one.p_value).collect();
    let mut corrected = family_wise(&chances).into_iter();
    for one in all.iter_mut().filter(|one| one.p_value.is_some()) {
        let p_value = corrected.next().expect("as many as there were");
        one.p_value = Some(p_value);
        one.outcome = match p_value < LEVEL {
            true => Outcome::Changed,
            false => Outcome::NotChanged,
        };
    }
    all
}

/// What became of the effects of the `structure`.
pub(super) fn of_effects(
    structure: &Structure,
    sides: [&Identified; 2],
    changes: &[Change],
) -> Vec<EffectChange> {
    let scale: Scale = structure.generic_scale();
    let fate = |&effect: &Effect| {
        let own = effect.parameters(&scale);
        let changed = changes.iter().any(|one| {
            one.of == "parameter"
                && one.outcome == Outcome::Changed
                && own.iter().any(|parameter| parameter.name == one.name)
        });
        let found = sides.map(|side| side.after.problem.structure.effects.contains(&effect));
        let mut tied_with: Vec<Effect> = Vec::new();
        for added in sides.iter().flat_map(|side| &side.added) {
            let own = added.tied_with.iter().filter(|_| added.effect == effect);
            for &other in own {
                if !tied_with.contains(&other) && !structure.effects.contains(&other) {
                    tied_with.push(other);
                }
            }
        }
        EffectChange {
            effect,
            found,
            tied_with,
            fate: match (changed, found) {
                (false, _) => Fate::Stayed,
                (true, [false, true]) => Fate::Came,
                (true, [true, false]) => Fate::Went,
                (true, _) => Fate::Changed,
            },
        }
    };
    structure.effects.iter().map(fate).collect()
}
