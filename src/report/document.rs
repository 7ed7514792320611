//! `report.json`: its fields are a contract with the programs that read it.

use crate::diagnose::{Identified, Sides};
use crate::evaluate::{Chosen, Problem};
use crate::model::Parameter;
use crate::search::Fit;
use serde::Serialize;
use std::collections::BTreeMap;

/// The version of the document.
pub const SCHEMA: &str = "servobee/report/1";

/// With fewer fitted rows than this for each parameter, a record is short.
const SHORT: usize = 20;

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Effects of the catalogue explain what the base model could not.
    Found,
    /// Nothing is missing that this data could show.
    None,
    /// Something is missing that is in no entry of the catalogue.
    Unexplained,
}

/// An effect that was added to the base model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedEffect {
    /// Its name in the catalogue.
    pub name: String,
    /// Where it acts.
    pub port: String,
    /// Effects that this data cannot tell from it.
    pub tied_with: Vec<String>,
    /// Held-out error before it was added.
    pub error_before: f64,
    /// Held-out error after.
    pub error_after: f64,
}

/// Errors of the base model and of the final one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ErrorPair {
    /// The base model.
    pub before: Sides,
    /// With the effects that were added.
    pub after: Sides,
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
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
    /// Whether the value sits on one of its bounds.
    pub at_bound: bool,
    /// Value in the base model; null where it has no such parameter.
    pub before: Option<f64>,
    /// Whether it was fixed; then the interval is the value.
    pub fixed: bool,
}

impl ParameterReport {
    /// The parameters of a fit, in the order of the problem's.
    pub fn of(problem: &Problem, fit: &Fit) -> Vec<Self> {
        let mut free = 0;
        let one = |parameter: &Parameter| {
            let (value, low, high, at_bound) = if parameter.fixed {
                (parameter.start, parameter.start, parameter.start, false)
            } else {
                free += 1;
                let value = fit.values()[free - 1];
                match &fit.polished {
                    Some((polished, uncertainty)) => {
                        let interval = &uncertainty.intervals[free - 1];
                        (
                            value,
                            interval.low,
                            interval.high,
                            polished.at_bound[free - 1].is_some(),
                        )
                    }
                    None => (
                        value,
                        parameter.low,
                        parameter.high,
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

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Document {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// What the diagnosis comes to.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<AddedEffect>,
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
    /// What is left.
    pub remaining: RemainingReport,
    /// Largest change of each channel's simulation when the integration steps are halved, in its unit.
    pub integration_error: BTreeMap<String, f64>,
    /// What evaluated the population.
    pub evaluator: String,
    /// Why it and no other.
    pub evaluator_reason: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// What undermines the result.
    pub warnings: Vec<String>,
}

impl Document {
    /// The document of a base model to which nothing was added.
    pub fn of(
        identified: &Identified,
        chosen: &Chosen,
        seed: u64,
        seconds: f64,
        mut warnings: Vec<String>,
    ) -> Self {
        let Identified {
            problem,
            fit,
            errors,
            noise,
            remaining,
            integration_error,
            ..
        } = identified;
        let not_identifiable = not_identifiable(fit);
        let parameters = ParameterReport::of(problem, fit);
        for parameter in parameters.iter().filter(|parameter| parameter.at_bound) {
            warnings.push(format!("{} sits on a bound of its range", parameter.name));
        }
        let rows = problem.rows();
        let free = fit.free.len();
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
        let correlates: Vec<String> = remaining
            .iter()
            .flat_map(|(channel, left)| {
                left.correlates_with
                    .iter()
                    .map(move |(name, _)| format!("{channel} ~ {name}"))
            })
            .collect();
        let structured = remaining.values().any(|left| left.structured);
        if structured {
            warnings.push("the intervals assume that the model is complete, and the residual says that it is not".into());
        }
        Self {
            schema: SCHEMA,
            verdict: if structured {
                Verdict::Unexplained
            } else {
                Verdict::None
            },
            effects: Vec::new(),
            error: ErrorPair {
                before: errors.clone(),
                after: errors.clone(),
            },
            noise_floor: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.value))
                .collect(),
            noise_method: noise
                .iter()
                .map(|(channel, noise)| (channel.clone(), noise.method.into()))
                .collect(),
            parameters,
            not_identifiable,
            remaining: RemainingReport {
                structured,
                correlates_with: correlates,
            },
            integration_error: integration_error.clone(),
            evaluator: chosen.evaluator.describe(),
            evaluator_reason: chosen.why.clone(),
            seed,
            evaluations: fit.evaluations,
            seconds,
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
        self.remaining.structured |= other.remaining.structured;
        self.remaining
            .correlates_with
            .extend(other.remaining.correlates_with);
        self.integration_error.extend(other.integration_error);
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

/// In words, the parameters that the data of a polished fit do not determine.
pub fn not_identifiable(fit: &Fit) -> Vec<String> {
    let Some((_, uncertainty)) = &fit.polished else {
        return Vec::new();
    };
    uncertainty
        .unidentifiable
        .iter()
        .map(|group| group.describe(&fit.free))
        .collect()
}
