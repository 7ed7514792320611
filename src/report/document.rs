//! `report.json`: its fields are a contract with the programs that read it.

use super::about::AboutLine;
use super::findings::{
    AddedEffect, ConsideredEffect, CutShort, ErrorPair, FreeFormReport, ImprovementReport,
    NearestCause, RemainingReport,
};
use super::held_out;
use super::limits::LimitReport;
use super::no_name::asked;
use super::noise::{NoiseSource, disagreements, swings};
use super::number::number;
use super::parameter::{ParameterReport, not_identifiable};
use super::provenance::{Call, HoldReport, InputFile, Program, now};
use crate::card::{Card, Figure, Quantity};
use crate::diagnose::{Conditions, Identified, Improvement, Located, Sides, Used, Verdict};
use crate::evaluate::{Chosen, Score};
use crate::model::Structure;
use crate::model::effects::{Effect, Port};
use crate::record::joined;
use crate::search::datasheet::Measured;
use crate::search::fitted_sheet::FittedSheet;
use serde::Serialize;
use std::collections::BTreeMap;

/// The version of the document.
pub const SCHEMA: &str = "servobee/report/2";

/// With fewer fitted rows than this for each parameter, a record is short.
const SHORT: usize = 20;

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
    /// Where something is missing that is not named: before the measured spool, at its sensor or behind it; null where nothing is,
    /// or the records do not tell.
    pub located: Option<Located>,
    /// Where the base model fails, whatever is named; the place of `located` is what is left.
    pub located_before: Option<Located>,
    /// Where the verdict is unexplained: the causes that come closest, the closest first.
    pub nearest: Vec<NearestCause>,
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
    /// What every source says of it that there is; on the residual of the result.
    pub noise_sources: BTreeMap<String, Vec<NoiseSource>>,
    /// The parameters.
    pub parameters: Vec<ParameterReport>,
    /// Parameters that this data does not determine, in words.
    pub not_identifiable: Vec<String>,
    /// The valve card: figures in the terms of ISO 10770-1, from the result.
    pub card: Vec<Figure>,
    /// The limits that the valve has to keep, and whether it does: see [`Document::judge`]. None where none was given.
    pub limits: Vec<LimitReport>,
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
    /// What the bench of the records is taken to be, where that is not what most are: to be checked first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bench: Vec<String>,
    /// What the user says of the valve and the test.
    pub about: Vec<AboutLine>,
    /// What the oil was at, on the mean of all records.
    pub conditions: Conditions,
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

/// Why something has no name that shows in held-out rows alone.
const UNSEEN: &str = "what is missing shows in held-out rows alone: the fitted ones are followed to their noise, and nothing is \
    learnt from the others. Fit rows like these as well";

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
        let mut parameters = ParameterReport::beside(&base, &after.problem, &after.fit);
        let hold = HoldReport::from(&identified.between);
        hold.widen(&mut parameters);
        for parameter in &parameters {
            if parameter.at_bound && !parameter.flat {
                warnings.push(format!("{} sits on a bound of its range", parameter.name));
            }
        }
        warnings.extend(identified.measurements.beginnings.iter().cloned());
        warnings.extend(after.unexcited.iter().map(held_out::unexcited));
        warnings.extend(after.sharpened.iter().map(held_out::sharpened));
        if identified.shows_in_held_out_rows_alone() {
            warnings.push(UNSEEN.into());
        }
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
        warnings.extend(differences(card, &after.problem.structure));
        warnings.extend(disagreements(identified));
        warnings.extend(swings(identified));
        let remaining = RemainingReport::of(&after.remaining);
        if remaining.structured {
            warnings.push("the intervals assume that the model is complete, and the residual says that it is not".into());
        }
        let improvement = |side: &Option<Improvement>| match identified.changed() {
            true => side.as_ref().map(ImprovementReport::from),
            false => None,
        };
        Self {
            schema: SCHEMA,
            verdict: identified.verdict,
            asked: asked(identified),
            cut_short: CutShort::of(identified),
            effects: identified.added.iter().map(AddedEffect::from).collect(),
            considered: identified
                .considered
                .iter()
                .map(ConsideredEffect::from)
                .collect(),
            located: identified.located,
            located_before: identified.located_before,
            nearest: identified
                .nearest()
                .into_iter()
                .map(|(effect, explained)| NearestCause::of(effect, explained))
                .collect(),
            free_form: identified
                .free_form
                .as_ref()
                .map(|found| FreeFormReport::of(found, &after.problem.structure)),
            explained: identified.explained,
            error: ErrorPair {
                before: before.errors.clone(),
                after: after.errors.clone(),
                improvement: Sides {
                    fit: improvement(&identified.improvement.fit),
                    hold_out: improvement(&identified.improvement.hold_out),
                },
            },
            noise_floor: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.value))
                .collect(),
            noise_method: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.method.name().into()))
                .collect(),
            noise_sources: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), NoiseSource::all(noise)))
                .collect(),
            not_identifiable: not_identifiable(&after.fit),
            parameters,
            card: figures(card, identified.verdict),
            limits: Vec::new(),
            remaining,
            integration_error: integration_error.clone(),
            evaluator: chosen.evaluator.describe(),
            evaluator_reason: chosen.why.clone(),
            seed,
            evaluations: identified.evaluations,
            hold: Some(hold),
            bench: identified.measurements.bench.clone(),
            records: identified.measurements.records.clone(),
            about: call.about.0,
            conditions: identified.measurements.conditions,
            files: call.files,
            program: Program::default(),
            arguments: call.arguments,
            seconds,
            date: now(),
            warnings,
        }
    }

    /// The document of a curve that was fitted, and of the card of its result.
    pub fn of_sheet(
        fitted: &FittedSheet,
        card: &Card,
        chosen: &Chosen,
        seed: u64,
        seconds: f64,
        call: Call,
        warnings: Vec<String>,
    ) -> Self {
        let FittedSheet {
            sheet,
            fits,
            integration_error,
        } = fitted;
        let result = fitted.result();
        let score = |(measured, simulated): (&Measured, &Vec<f64>)| {
            let pairs = measured.values.iter().zip(simulated);
            let known = pairs.filter_map(|(measured, &simulated)| Some(((*measured)?, simulated)));
            (measured.name.to_owned(), Score::new(known))
        };
        let scores = sheet.measured.iter().zip(&result.simulated).map(score);
        let errors = Sides {
            fit: scores.collect(),
            hold_out: BTreeMap::new(),
        };
        let names = sheet.measured.iter().map(|one| one.name.to_owned());
        Self {
            schema: SCHEMA,
            verdict: Verdict::NotDiagnosed,
            asked: Vec::new(),
            cut_short: None,
            effects: Vec::new(),
            considered: Vec::new(),
            located: None,
            located_before: None,
            nearest: Vec::new(),
            free_form: None,
            explained: None,
            error: ErrorPair {
                before: errors.clone(),
                after: errors,
                improvement: Sides::default(),
            },
            noise_floor: BTreeMap::new(),
            noise_method: BTreeMap::new(),
            noise_sources: BTreeMap::new(),
            parameters: ParameterReport::of(&sheet.problem, &result.fit),
            not_identifiable: not_identifiable(&result.fit),
            card: card.figures.clone(),
            limits: Vec::new(),
            remaining: RemainingReport::default(),
            integration_error: names.zip(integration_error.iter().copied()).collect(),
            evaluator: chosen.evaluator.describe(),
            evaluator_reason: chosen.why.clone(),
            seed,
            evaluations: fits.iter().map(|one| one.fit.evaluations).sum(),
            hold: None,
            bench: Vec::new(),
            records: Vec::new(),
            about: call.about.0,
            conditions: Conditions::default(),
            files: call.files,
            program: Program::default(),
            arguments: call.arguments,
            seconds,
            date: now(),
            warnings: sheet
                .notes
                .iter()
                .cloned()
                .chain(warnings)
                .chain(differences(card, &sheet.problem.structure))
                .collect(),
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
        self.noise_sources.extend(other.noise_sources);
        self.parameters.extend(other.parameters);
        self.not_identifiable.extend(other.not_identifiable);
        for (own, other) in self.card.iter_mut().zip(other.card) {
            let known = |one: &Figure| one.value.is_some() || one.measured.is_some();
            if !known(own) && known(&other) {
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

    /// The names of the effects that were found, with the channel where one is on one.
    pub fn effect_names(&self) -> Vec<String> {
        let name = |effect: &AddedEffect| match &effect.channel {
            Some(channel) => format!("{}.{channel}", effect.name),
            None => effect.name.clone(),
        };
        self.effects.iter().map(name).collect()
    }

    /// Whether intervals mean nothing: the residual has structure, and nothing was found that explains all of it.
    pub fn is_incomplete(&self) -> bool {
        match self.verdict {
            Verdict::Unexplained | Verdict::Partly => true,
            Verdict::None | Verdict::NotDiagnosed => self.remaining.structured,
            Verdict::Found => false,
        }
    }

    /// The document as JSON text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("the document is plain data");
        text.push('\n');
        text
    }
}

/// Which figures of the model and of the measured curves differ by more than their intervals. Where a sensor lags they must:
/// the model's are without it.
fn differences(card: &Card, structure: &Structure) -> Vec<String> {
    let differ = card.figures.iter().filter(|figure| figure.disagrees());
    let lags =
        |effect: &Effect| effect.entry.port == Port::Measurement && !effect.entry.states.is_empty();
    if !structure.effects.iter().any(lags) {
        return differ.filter_map(difference).collect();
    }
    let labels: Vec<&str> = differ.map(|figure| figure.label.as_str()).collect();
    match labels[..] {
        [] => Vec::new(),
        _ => vec![format!(
            "the measured curves hold the lag of a sensor, which the model's figures are without: they differ in {}",
            joined(
                labels.iter().map(|label| (*label).to_owned()).collect(),
                "and"
            )
        )],
    }
}

/// The model's figure and the measured one.
fn difference(figure: &Figure) -> Option<String> {
    let (value, measured) = (figure.value?, figure.measured.as_ref()?);
    let unit = match figure.unit.as_str() {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    let what = match figure.quantity {
        // A loop shows what lags, too, the meter not least.
        Quantity::Hysteresis => "the measured loop, with what lags in it, ",
        _ => "the measured curve ",
    };
    Some(format!(
        "{}: the model has {}{unit}, {what}{}{unit} ({})",
        figure.label,
        number(value),
        number(measured.value),
        measured.test
    ))
}

/// The figures of the card: of a model that does not explain its record, without intervals.
fn figures(card: &Card, verdict: Verdict) -> Vec<Figure> {
    let figures = card.figures.iter().cloned();
    match verdict {
        Verdict::Unexplained | Verdict::Partly => figures.map(Figure::without_interval).collect(),
        _ => figures.collect(),
    }
}
