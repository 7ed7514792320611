//! `compare.json`: what changed from before a repair to after it.

use super::about::AboutLine;
use super::number::{number, quantity};
use super::provenance::{Call, InputFile, Program, now};
use super::{Document, LimitReport};
use crate::compare::{Change, Comparison, Condition, Confounder, EffectChange, Fate, Outcome};
use crate::diagnose::{Used, Verdict};
use crate::record::joined;
use serde::Serialize;

/// The version of the document.
pub const COMPARE_SCHEMA: &str = "servobee/compare/1";

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparisonDocument {
    /// [`COMPARE_SCHEMA`].
    pub schema: &'static str,
    /// What changed, in a sentence.
    pub answer: String,
    /// What was found of the records before.
    pub before: SideReport,
    /// What was found of those after.
    pub after: SideReport,
    /// The effects of the structure that was fitted to both.
    pub effects: Vec<EffectChangeReport>,
    /// Every parameter that was fitted and every figure of the card that both sides have.
    pub changes: Vec<Change>,
    /// What else differs, or may, and could be taken for a change of the valve.
    pub confounded: Vec<ConfounderReport>,
    /// What the user says of the valve and the test.
    pub about: Vec<AboutLine>,
    /// The limits that the valve has to keep after, and whether it does; none where none was given.
    pub limits: Vec<LimitReport>,
    /// What evaluated the population.
    pub evaluator: String,
    /// Seed of the searches and of intervals.
    pub seed: u64,
    /// Files that were read beside the records.
    pub files: Vec<InputFile>,
    /// What wrote this.
    pub program: Program,
    /// The arguments that it was given.
    pub arguments: Vec<String>,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// When it was written, UTC.
    pub date: String,
    /// What undermines the result.
    pub warnings: Vec<String>,
}

/// What was found of one side alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideReport {
    /// What its diagnosis comes to.
    pub verdict: Verdict,
    /// The effects that it found.
    pub effects: Vec<String>,
    /// Its records.
    pub records: Vec<Used>,
}

impl From<&Document> for SideReport {
    fn from(document: &Document) -> Self {
        Self {
            verdict: document.verdict,
            effects: document.effect_names(),
            records: document.records.clone(),
        }
    }
}

/// An effect, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectChangeReport {
    /// Its name, with the channel where it is on one.
    pub name: String,
    /// Where it acts.
    pub port: String,
    /// Whether it was found before.
    pub found_before: bool,
    /// Whether it was found after.
    pub found_after: bool,
    /// What became of it.
    pub fate: Fate,
    /// Effects that the records cannot tell from it.
    pub tied_with: Vec<String>,
}

impl From<&EffectChange> for EffectChangeReport {
    fn from(change: &EffectChange) -> Self {
        Self {
            name: change.effect.to_string(),
            port: change.effect.entry.port.to_string(),
            found_before: change.found[0],
            found_after: change.found[1],
            fate: change.fate,
            tied_with: change.tied_with.iter().map(ToString::to_string).collect(),
        }
    }
}

/// A condition that differs, or may.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfounderReport {
    /// Which.
    pub name: Condition,
    /// Its unit.
    pub unit: &'static str,
    /// Its mean before; null where it was not measured.
    pub before: Option<f64>,
    /// Its mean after; null where it was not measured.
    pub after: Option<f64>,
    /// Whether the model follows it.
    pub modelled: bool,
    /// All of that in a sentence.
    pub sentence: String,
}

impl From<&Confounder> for ConfounderReport {
    fn from(confounder: &Confounder) -> Self {
        let (words, unit, suspect) = match confounder.condition {
            Condition::SupplyPressure => ("supply pressure", "bar", "flow, leakage or speed"),
            Condition::Temperature => ("temperature", "degC", "flow, leakage, friction or speed"),
        };
        let suspicion = format!("a change of {suspect} may come of it");
        let sentence = match (confounder.before, confounder.after) {
            (Some(before), Some(after)) => {
                let [before, after] = [before, after].map(|value| quantity(value, unit));
                let differs = format!("the {words} was {before} before and is {after} after");
                match confounder.modelled {
                    true => format!("{differs}; the model follows it"),
                    false => format!("{differs}, which the model does not follow: {suspicion}"),
                }
            }
            (None, None) => format!("the {words} was not measured: if it differs, {suspicion}"),
            (before, _) => {
                let side = if before.is_some() { "before" } else { "after" };
                format!("the {words} was measured {side} alone: if it differs, {suspicion}")
            }
        };
        Self {
            name: confounder.condition,
            unit,
            before: confounder.before,
            after: confounder.after,
            modelled: confounder.modelled,
            sentence,
        }
    }
}

impl ComparisonDocument {
    /// The document of a comparison, whose sides alone have these documents: the limits are judged by what is there after.
    pub fn of(
        comparison: &Comparison,
        [before, after]: [&Document; 2],
        call: Call,
        seconds: f64,
    ) -> Self {
        let mut warnings = Vec::new();
        for (new, old) in &comparison.taken_for {
            warnings.push(format!(
                "{new}, found after, and {old}, found before, cannot be told from each other: both are taken for {old}"
            ));
        }
        for (side, document) in [("before", before), ("after", after)] {
            if document.is_incomplete() {
                warnings.push(format!(
                    "the model does not explain what was measured {side}: what is said of changes assumes that it does"
                ));
            }
            let own = document.warnings.iter();
            warnings.extend(own.map(|warning| format!("{side}: {warning}")));
        }
        let confounded = comparison.confounders.iter().map(Into::into).collect();
        Self {
            schema: COMPARE_SCHEMA,
            answer: answer(comparison),
            before: before.into(),
            after: after.into(),
            effects: comparison.effects.iter().map(Into::into).collect(),
            changes: comparison.changes.clone(),
            confounded,
            about: call.about.0,
            limits: after.limits.clone(),
            evaluator: after.evaluator.clone(),
            seed: after.seed,
            files: call.files,
            program: Program::default(),
            arguments: call.arguments,
            seconds,
            date: now(),
            warnings,
        }
    }

    /// What changed, or not, or is not determined.
    pub fn with(&self, outcome: Outcome) -> impl Iterator<Item = &Change> {
        let changes = self.changes.iter();
        changes.filter(move |change| change.outcome == outcome)
    }

    /// The document as JSON text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("the document is plain data");
        text.push('\n');
        text
    }
}

/// What changed, in a sentence: each effect with its parameters, then the parameters of the base model.
fn answer(comparison: &Comparison) -> String {
    let changed: Vec<&Change> = comparison
        .changes
        .iter()
        .filter(|one| one.of == "parameter" && one.outcome == Outcome::Changed)
        .collect();
    let figures = comparison
        .changes
        .iter()
        .any(|one| one.outcome == Outcome::Changed);
    let mut told = Vec::new();
    let mut of_effects: Vec<&str> = Vec::new();
    for effect in &comparison.effects {
        let own = comparison.parameters_of(effect);
        let own: Vec<&&Change> = changed
            .iter()
            .filter(|one| own.contains(&one.name))
            .collect();
        of_effects.extend(own.iter().map(|one| one.name.as_str()));
        let tied = effect.tied_with.iter().map(ToString::to_string);
        let names = std::iter::once(effect.effect.to_string()).chain(tied);
        let name = joined(names.collect(), "or");
        let verb = match effect.fate {
            Fate::Stayed => continue,
            Fate::Came => "came",
            Fate::Went => "went",
            Fate::Changed => "changed",
        };
        let moves: Vec<String> = own.iter().map(|one| from_to(one)).collect();
        told.push(format!("{name} {verb} ({})", moves.join(", ")));
    }
    let base = changed
        .iter()
        .filter(|one| !of_effects.contains(&one.name.as_str()));
    told.extend(base.map(|one| format!("{} changed ({})", one.name, from_to(one))));
    match (told.is_empty(), figures) {
        (false, _) => {
            let text = joined(told, "and");
            format!("{text}.")
        }
        (true, true) => "No parameter changed for certain, but figures of the valve did.".into(),
        (true, false) => "Nothing changed that these records show.".into(),
    }
}

fn from_to(change: &Change) -> String {
    let (before, after) = (change.before.value, change.after.value);
    let unit = match change.unit.as_str() {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    format!("{} to {}{unit}", number(before), number(after))
}
