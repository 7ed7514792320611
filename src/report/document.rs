//! `report.json`: its fields are a contract with the programs that read it.

use super::no_name::asked;
use super::number::number;
use super::provenance::{Call, HoldReport, InputFile, Program, now};
use crate::card::{Card, Figure};
use crate::diagnose::{
    Fitted, FoundForm, Identified, Improvement, Remaining, Sides, Unexcited, Used, Verdict,
};
use crate::evaluate::{Chosen, Problem};
use crate::model::Parameter;
use crate::model::effects::Effect;
use crate::search::Fit;
use crate::search::polish::Unidentifiable;
use serde::Serialize;
use std::collections::BTreeMap;

/// The version of the document.
pub const SCHEMA: &str = "servobee/report/1";

/// With fewer fitted rows than this for each parameter, a record is short.
const SHORT: usize = 20;

/// An effect that was added to the base model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedEffect {
    /// Its name in the catalogue.
    pub name: String,
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

/// An effect that was looked at in one round of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConsideredEffect {
    /// Its name, with the channel where it is on one.
    pub name: String,
    /// The round, from 1.
    pub round: usize,
    /// Share of the squared error on fitted rows that it promised to explain, linearised, in percent.
    pub promise_percent: f64,
    /// Chance of as good a promise of any effect where none is missing.
    pub p_value: f64,
    /// Held-out error with it, as in [`AddedEffect::error_after`]; null where it was not refitted.
    pub error_after: Option<f64>,
    /// Why it was or was not chosen.
    pub decision: &'static str,
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
    fn of(found: &FoundForm, after: &Fitted) -> Self {
        let form = &found.form;
        let structure = &after.problem.structure;
        let unit = |parameter: &&Parameter| parameter.name.starts_with("correction_");
        let curve = form.knots.iter().zip(&found.values);
        Self {
            port: form.port.to_string(),
            channel: form.output.map(|output| output.name().into()),
            signal: form.signal.name().into(),
            signal_unit: form.signal_unit(&structure.command_unit),
            unit: after
                .problem
                .parameters
                .iter()
                .find(unit)
                .map_or(String::new(), |parameter| parameter.unit.clone()),
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
    pub before: Sides,
    /// With what was added.
    pub after: Sides,
    /// By how much the error on fitted and on held-out rows fell; null where nothing was added.
    pub improvement: Improvements,
}

/// The improvement on each side.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Improvements {
    /// On the data that was fitted.
    pub fit: Option<ImprovementReport>,
    /// On data never fitted.
    pub hold_out: Option<ImprovementReport>,
}

/// A parameter of the result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// Name as in the model file.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Fitted value.
    pub value: f64,
    /// Lower end of the 95 % interval; not a number, in JSON null, where the fit was not polished to its end.
    pub low: f64,
    /// Upper end of the 95 % interval, likewise.
    pub high: f64,
    /// Whether the value sits on one of its bounds.
    pub at_bound: bool,
    /// Value in the base model; null where it has no such parameter.
    pub before: Option<f64>,
    /// Whether it was fixed; then the interval is the value.
    pub fixed: bool,
    /// Whether it moved out of its 95 % interval in the base model.
    pub moved: bool,
    /// Whether the fitted rows leave it open: from `low` to `high` it makes no difference to them.
    pub flat: bool,
}

impl ParameterReport {
    /// The 95 % interval in words, with `to` between its ends.
    pub fn interval(&self, to: &str) -> String {
        match self {
            Self { fixed: true, .. } => "fixed".into(),
            Self { low, high, .. } if low.is_nan() || high.is_nan() => "not known".into(),
            Self { low, high, .. } => format!("{} {to} {}", number(*low), number(*high)),
        }
    }

    /// The parameters of a fit, in the order of the problem's, beside those of the base model.
    pub fn beside(before: &[Self], problem: &Problem, fit: &Fit) -> Vec<Self> {
        let mut list = Self::of(problem, fit);
        for parameter in &mut list {
            let base = before.iter().find(|base| base.name == parameter.name);
            parameter.before = base.map(|base| base.value);
            parameter.moved = base.is_some_and(|base| {
                !base.fixed && (parameter.value < base.low || parameter.value > base.high)
            });
        }
        list
    }

    /// The parameters of a fit, in the order of the problem's.
    pub fn of(problem: &Problem, fit: &Fit) -> Vec<Self> {
        let mut free = 0;
        let one = |parameter: &Parameter| {
            let mut flat = false;
            let (value, low, high, at_bound) = if parameter.fixed {
                (parameter.start, parameter.start, parameter.start, false)
            } else {
                free += 1;
                let value = fit.values()[free - 1];
                match &fit.polished {
                    Some((polished, uncertainty)) => {
                        let interval = &uncertainty.intervals[free - 1];
                        flat = polished.flat.iter().any(|one| one.parameter == free - 1);
                        (
                            value,
                            interval.low,
                            interval.high,
                            polished.at_bound[free - 1].is_some(),
                        )
                    }
                    None => (
                        value,
                        f64::NAN,
                        f64::NAN,
                        value <= parameter.low || value >= parameter.high,
                    ),
                }
            };
            Self {
                name: parameter.name.clone(),
                unit: parameter.unit.clone(),
                value,
                low,
                high,
                at_bound,
                before: Some(value),
                fixed: parameter.fixed,
                moved: false,
                flat,
            }
        };
        problem.parameters.iter().map(one).collect()
    }
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
    fn of(remaining: &BTreeMap<String, Remaining>) -> Self {
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
    fn of(identified: &Identified) -> Option<Self> {
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

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Document {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// What the diagnosis comes to.
    pub verdict: Verdict,
    /// The effects that were looked for, by name.
    pub asked: Vec<&'static str>,
    /// Where the run was cut short, if it was: then everything is as far as it was known.
    pub cut_short: Option<CutShort>,
    /// Effects in the order in which they were added.
    pub effects: Vec<AddedEffect>,
    /// Every effect that was looked at, round by round, with the reason for its choice or rejection.
    pub considered: Vec<ConsideredEffect>,
    /// Where the verdict is unexplained: the curve that best describes what is missing, if any helps.
    pub free_form: Option<FreeFormReport>,
    /// Share of the squared held-out error above the noise that the effects which were found explain; null where none was.
    pub explained: Option<f64>,
    /// Errors before and after.
    pub error: ErrorPair,
    /// Standard deviation of each channel's noise, in its unit.
    pub noise_floor: BTreeMap<String, f64>,
    /// How each was estimated.
    pub noise_method: BTreeMap<String, String>,
    /// The parameters.
    pub parameters: Vec<ParameterReport>,
    /// Parameters that this data does not determine, in words.
    pub not_identifiable: Vec<String>,
    /// The valve card: figures in the terms of ISO 10770-1, from the result.
    pub card: Vec<Figure>,
    /// What is left.
    pub remaining: RemainingReport,
    /// Largest change of each channel's simulation when the integration steps are halved, in its unit.
    pub integration_error: BTreeMap<String, f64>,
    /// What evaluated the population.
    pub evaluator: String,
    /// Why it and no other.
    pub evaluator_reason: String,
    /// Seed of the search and of intervals.
    pub seed: u64,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// What was taken for the command between two rows; null where there are no rows in time.
    pub hold: Option<HoldReport>,
    /// The records.
    pub records: Vec<Used>,
    /// Files that were read beside them.
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

impl Document {
    /// The document of a diagnosis, and of the card of its result.
    pub fn of(
        identified: &Identified,
        card: &Card,
        chosen: &Chosen,
        seed: u64,
        seconds: f64,
        call: Call,
        mut warnings: Vec<String>,
    ) -> Self {
        let Identified {
            before,
            after,
            noise,
            ..
        } = identified;
        let integration_error = &after.integration_error;
        let base = ParameterReport::of(&before.problem, &before.fit);
        let parameters = ParameterReport::beside(&base, &after.problem, &after.fit);
        for parameter in &parameters {
            if parameter.at_bound && !parameter.flat {
                warnings.push(format!("{} sits on a bound of its range", parameter.name));
            }
        }
        warnings.extend(after.unexcited.iter().map(Unexcited::describe));
        let hold = HoldReport::from(&identified.between);
        warnings.extend(hold.warning());
        let rows = after.problem.rows();
        let free = after.fit.free.len();
        if rows < SHORT * free {
            warnings.push(format!(
                "only {rows} rows for {free} parameters: values and verdict mean little"
            ));
        }
        for (channel, change) in integration_error {
            let floor = noise[channel].value;
            if *change > floor {
                warnings.push(format!(
                    "halving the integration steps changes {channel} by {change:.3e}, more than its noise of {floor:.3e}"
                ));
            }
        }
        let remaining = RemainingReport::of(&after.remaining);
        if remaining.structured {
            warnings.push("the intervals assume that the model is complete, and the residual says that it is not".into());
        }
        let considered = identified.considered.iter().map(|one| ConsideredEffect {
            name: one.effect.to_string(),
            round: one.round,
            promise_percent: one.promise,
            p_value: one.p_value,
            error_after: one.error,
            decision: one.decision.describe(),
        });
        let effects = identified.added.iter().map(|added| AddedEffect {
            name: added.effect.entry.name.into(),
            port: added.effect.entry.port.to_string(),
            channel: added.effect.output.map(|output| output.name().into()),
            tied_with: names(&added.tied_with, added.effect.entry.name),
            error_before: added.error_before,
            error_after: added.error_after,
        });
        let [fit, hold_out] = &identified.improvement;
        let improvement = |side: &Option<Improvement>| match identified.added.is_empty()
            && identified.free_form.is_none()
        {
            true => None,
            false => side.as_ref().map(ImprovementReport::from),
        };
        Self {
            schema: SCHEMA,
            verdict: identified.verdict,
            asked: asked(identified),
            cut_short: CutShort::of(identified),
            effects: effects.collect(),
            considered: considered.collect(),
            free_form: identified
                .free_form
                .as_ref()
                .map(|found| FreeFormReport::of(found, after)),
            explained: identified.explained,
            error: ErrorPair {
                before: before.errors.clone(),
                after: after.errors.clone(),
                improvement: Improvements {
                    fit: improvement(fit),
                    hold_out: improvement(hold_out),
                },
            },
            noise_floor: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.value))
                .collect(),
            noise_method: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.method.into()))
                .collect(),
            not_identifiable: not_identifiable(&after.fit),
            parameters,
            card: figures(card, identified.verdict),
            remaining,
            integration_error: integration_error.clone(),
            evaluator: chosen.evaluator.describe(),
            evaluator_reason: chosen.why.clone(),
            seed,
            evaluations: identified.evaluations,
            hold: Some(hold),
            records: identified.measurements.records.clone(),
            files: call.files,
            program: Program::default(),
            arguments: call.arguments,
            seconds,
            date: now(),
            warnings,
        }
    }

    /// This document and `other`, of another curve of the same valve and the same run, in one.
    pub fn and(mut self, other: Self) -> Self {
        for (own, more) in [
            (&mut self.error.before, other.error.before),
            (&mut self.error.after, other.error.after),
        ] {
            own.fit.extend(more.fit);
            own.hold_out.extend(more.hold_out);
        }
        self.noise_floor.extend(other.noise_floor);
        self.noise_method.extend(other.noise_method);
        self.parameters.extend(other.parameters);
        self.not_identifiable.extend(other.not_identifiable);
        for (own, other) in self.card.iter_mut().zip(other.card) {
            if own.value.is_none() && other.value.is_some() {
                *own = other;
            }
        }
        self.remaining.structured |= other.remaining.structured;
        self.remaining
            .correlates_with
            .extend(other.remaining.correlates_with);
        self.integration_error.extend(other.integration_error);
        self.cut_short = self.cut_short.or(other.cut_short);
        self.evaluations += other.evaluations;
        self.seconds += other.seconds;
        self.warnings.extend(other.warnings);
        self
    }

    /// The document as JSON text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("the document is plain data");
        text.push('\n');
        text
    }
}

/// The figures of the card: of a model that does not explain its record, without intervals.
fn figures(card: &Card, verdict: Verdict) -> Vec<Figure> {
    let figures = card.figures.iter().cloned();
    match verdict {
        Verdict::Unexplained => figures.map(Figure::without_interval).collect(),
        _ => figures.collect(),
    }
}

/// The names of `effects`, each once, without `own`.
fn names(effects: &[Effect], own: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for effect in effects {
        let name = effect.entry.name;
        if name != own && !names.iter().any(|other| other == name) {
            names.push(name.into());
        }
    }
    names
}

/// In words, the parameters that the data of a polished fit do not determine.
pub fn not_identifiable(fit: &Fit) -> Vec<String> {
    let Some((polished, uncertainty)) = &fit.polished else {
        return Vec::new();
    };
    let is_flat = |group: &&Unidentifiable| {
        let flat = polished.flat.iter().map(|flat| [flat.parameter]);
        flat.into_iter().any(|alone| group.parameters == alone)
    };
    let flat = polished.flat.iter().map(|flat| {
        let Parameter { name, unit, .. } = &fit.free[flat.parameter];
        let (low, high) = (flat.low, flat.high);
        format!("{name}: from {low:.4} to {high:.4} {unit} it makes no difference to the data")
    });
    let groups = uncertainty.unidentifiable.iter();
    let others = groups.filter(|group| !is_flat(group));
    flat.chain(others.map(|group| group.describe(&fit.free)))
        .collect()
}
