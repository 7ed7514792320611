//! What a diagnosis found, as `report.json` has it: effects, errors, and what is left or missing.

use crate::diagnose::{
    Added, Considered, Errors, FoundForm, Identified, Improvement, Remaining, Sides,
};
use crate::model::Structure;
use crate::model::effects::Effect;
use crate::search::Fit;
use serde::Serialize;
use std::collections::BTreeMap;

/// An effect that was added to the base model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedEffect {
    /// What it is, as the catalogue calls it.
    pub name: String,
    /// By which of its equations: `usual`, or as the catalogue calls it behind a `~`.
    pub form: String,
    /// Forms that this data cannot tell from that.
    pub other_forms: Vec<String>,
    /// Where it acts.
    pub port: String,
    /// The channel that it is on, where it is on one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Effects that this data cannot tell from it.
    pub tied_with: Vec<String>,
    /// Held-out error before it was added: RMS over all channels, each in units of its noise floor.
    pub error_before: f64,
    /// The same after.
    pub error_after: f64,
}

impl From<&Added> for AddedEffect {
    fn from(added: &Added) -> Self {
        let entry = added.effect.entry;
        Self {
            name: entry.cause().into(),
            form: entry.form().into(),
            other_forms: other_forms(added),
            port: entry.port.to_string(),
            channel: added.effect.output.map(|output| output.name().into()),
            tied_with: names(&added.tied_with, entry.cause()),
            error_before: added.error_before,
            error_after: added.error_after,
        }
    }
}

/// The other forms of what was added that are tied with it.
fn other_forms(added: &Added) -> Vec<String> {
    let tied = added.tied_with.iter();
    let own = tied.filter(|other| other.is_form_of(&added.effect));
    own.map(|other| other.entry.form().into()).collect()
}

/// The causes of `effects`, each once, without `own`.
fn names(effects: &[Effect], own: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for effect in effects {
        let name = effect.entry.cause();
        if name != own && !names.iter().any(|other| other == name) {
            names.push(name.into());
        }
    }
    names
}

/// An effect that was looked at in one round of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConsideredEffect {
    /// Its name, with the channel where it is on one.
    pub name: String,
    /// The round, from 1.
    pub round: usize,
    /// Predicted reduction: the share of the squared error on fitted rows that it explains, linearised, in percent.
    #[serde(rename = "promise_percent")]
    pub predicted_reduction: f64,
    /// Chance of as large a predicted reduction by any effect where none is missing.
    pub p_value: f64,
    /// Held-out error with it, as in [`AddedEffect::error_after`]; null where it was not refitted.
    pub error_after: Option<f64>,
    /// Why it was or was not chosen.
    pub decision: &'static str,
}

impl From<&Considered> for ConsideredEffect {
    fn from(considered: &Considered) -> Self {
        Self {
            name: considered.effect.to_string(),
            round: considered.round,
            predicted_reduction: considered.predicted_reduction,
            p_value: considered.p_value,
            error_after: considered.error,
            decision: considered.decision.describe(),
        }
    }
}

/// A cause that comes close to what is missing, and does not explain it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NearestCause {
    /// What it is, as the catalogue calls it.
    pub name: String,
    /// By which of its equations.
    pub form: String,
    /// The channel that it is on, where it is on one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Share of the squared held-out error above the noise that it explains alone.
    pub explained: f64,
}

impl NearestCause {
    pub(super) fn of(effect: Effect, explained: f64) -> Self {
        Self {
            name: effect.entry.cause().into(),
            form: effect.entry.form().into(),
            channel: effect.output.map(|output| output.name().into()),
            explained,
        }
    }
}

/// A correction of unknown form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeFormReport {
    /// Where it acts.
    pub port: String,
    /// The channel that it is added to, at the measurement port.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// What it is a curve of.
    pub signal: String,
    /// The signal's unit.
    pub signal_unit: String,
    /// The unit of what is added.
    pub unit: String,
    /// Its knots: the signal, and what is added there. Linear between them, constant beyond.
    pub curve: Vec<Knot>,
    /// Held-out error without it: RMS over all channels, each in units of its noise floor.
    pub error_before: f64,
    /// The same with it.
    pub error_after: f64,
}

/// A point of a correction's curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Knot {
    /// The signal.
    pub signal: f64,
    /// What is added.
    pub value: f64,
}

impl FreeFormReport {
    pub(super) fn of(found: &FoundForm, structure: &Structure) -> Self {
        let form = &found.form;
        let curve = form.knots.iter().zip(&found.values);
        Self {
            port: form.port.to_string(),
            channel: form.output.map(|output| output.name().into()),
            signal: form.signal.name().into(),
            signal_unit: form.signal_unit(&structure.command_unit),
            unit: found.unit.clone(),
            curve: curve
                .map(|(&signal, &value)| Knot { signal, value })
                .collect(),
            error_before: found.error_before,
            error_after: found.error_after,
        }
    }
}

/// An improvement with its 95 % interval, in percent of the error before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImprovementReport {
    /// By how much the error fell.
    pub percent: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl From<&Improvement> for ImprovementReport {
    fn from(improvement: &Improvement) -> Self {
        let percent = improvement.percent;
        Self {
            percent: percent.value,
            low: percent.low,
            high: percent.high,
        }
    }
}

/// Errors of the base model and of the final one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ErrorPair {
    /// The base model.
    pub before: Sides<Errors>,
    /// With what was added.
    pub after: Sides<Errors>,
    /// By how much the error on fitted and on held-out rows fell; null where nothing was added.
    pub improvement: Sides<Option<ImprovementReport>>,
}

/// What is left in the residual of the result.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RemainingReport {
    /// Whether it depends on anything known.
    pub structured: bool,
    /// `channel ~ signal`, the strongest first.
    pub correlates_with: Vec<String>,
}

impl RemainingReport {
    pub(super) fn of(remaining: &BTreeMap<String, Remaining>) -> Self {
        let name = |channel: &String, signal: &String| format!("{channel} ~ {signal}");
        Self {
            structured: remaining.values().any(|left| left.structured),
            correlates_with: remaining
                .iter()
                .flat_map(|(channel, left)| {
                    let signals = left.correlates_with.iter();
                    signals.map(move |(signal, _)| name(channel, signal))
                })
                .collect(),
        }
    }
}

/// Where a run was cut short, and what is missing for that.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CutShort {
    /// The stage that was under way.
    pub stage: String,
    /// What the report would have otherwise.
    pub missing: Vec<String>,
}

impl CutShort {
    /// What is missing of a diagnosis that was broken off.
    pub(super) fn of(identified: &Identified) -> Option<Self> {
        let stage = identified.broken_off.clone()?;
        let before = &identified.before.fit;
        let after = &identified.after.fit;
        let unpolished = |fit: &Fit| fit.polished.is_none() && !fit.free.is_empty();
        let mut missing = vec![match identified.considered.is_empty() {
            true => "the verdict: no effect was looked at to its end".to_owned(),
            false => "the verdict: not every effect was looked at to its end".to_owned(),
        }];
        if unpolished(before) {
            missing.push("the end of the base model's fit, and its intervals".into());
        }
        if unpolished(after) && identified.changed() {
            missing.push("the end of the result's fit, and its intervals".into());
        }
        Some(Self { stage, missing })
    }

    /// Both in one sentence.
    pub fn sentence(&self) -> String {
        let Self { stage, missing } = self;
        format!("Cut short in \"{stage}\". Missing: {}.", missing.join("; "))
    }
}
