//! What a batch keeps of a record.

use crate::card::{Card, Figure};
use crate::diagnose::Verdict;
use crate::report::{Document, Outcome, ParameterReport};
use crate::{Error, record::joined};
use serde::{Deserialize, Serialize};

/// Points of the slow cycle that are kept, of each branch.
const POINTS: usize = 25;

/// How it went with a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowStatus {
    /// It has a report.
    Ok,
    /// It is no record that can be identified: see its problem.
    Refused,
    /// The run failed.
    Failed,
}

impl RowStatus {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Refused => "refused",
            Self::Failed => "failed",
        }
    }
}

/// A figure of the card, or a parameter that was fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedValue {
    /// Its name.
    pub name: String,
    /// What people call it.
    pub label: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Lower end of its 95 % interval; null where there is none.
    pub low: Option<f64>,
    /// Upper end of its 95 % interval; null where there is none.
    pub high: Option<f64>,
    /// Whether it is zero because the model has nothing that causes it.
    pub none_in_model: bool,
}

/// Limits by what they come to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LimitNames {
    /// Those that are met.
    pub pass: Vec<String>,
    /// Those that are missed.
    pub fail: Vec<String>,
    /// The others.
    pub not_determined: Vec<String>,
}

impl LimitNames {
    fn of(document: &Document) -> Self {
        let names = |outcome: Outcome| {
            let those = document.limits.iter().filter(|one| one.outcome == outcome);
            those.map(|one| one.name.clone()).collect()
        };
        Self {
            pass: names(Outcome::Pass),
            fail: names(Outcome::Fail),
            not_determined: names(Outcome::NotDetermined),
        }
    }

    /// Whether every limit is met.
    pub fn all_met(&self) -> bool {
        self.fail.is_empty() && self.not_determined.is_empty()
    }
}

/// What a batch keeps of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BatchRow {
    /// The file, as it was given or found.
    pub file: String,
    /// SHA-256 of its content in hexadecimal digits; null where it could not be read.
    pub sha256: Option<String>,
    /// Whether it is what the others are compared with.
    pub baseline: bool,
    /// How it went.
    pub status: RowStatus,
    /// Why it was refused or failed; null where it was not.
    pub problem: Option<String>,
    /// Where its report lies, in the folder of the batch; null where it has none.
    pub folder: Option<String>,
    /// What its diagnosis comes to; null where it has none.
    pub verdict: Option<Verdict>,
    /// The effects that were found, in the order in which they were added.
    pub effects: Vec<String>,
    /// The figures of the card that have a value.
    pub figures: Vec<NamedValue>,
    /// The parameters that were fitted.
    pub parameters: Vec<NamedValue>,
    /// The limits, where some were given.
    pub limits: LimitNames,
    /// How many warnings its report has.
    pub warnings: usize,
    /// The slow cycle, from minus full scale up and down again: command, and flow or spool.
    pub cycle: Vec<[f64; 2]>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

impl BatchRow {
    /// The row of the `file` whose report this is.
    pub fn of(file: &str, document: &Document, card: &Card, folder: String) -> Self {
        let sha256 = document.records.first().and_then(|one| one.sha256.clone());
        Self {
            sha256,
            folder: Some(folder),
            verdict: Some(document.verdict),
            effects: document.effect_names(),
            figures: document.card.iter().filter_map(figure).collect(),
            parameters: document.parameters.iter().filter_map(parameter).collect(),
            limits: LimitNames::of(document),
            warnings: document.warnings.len(),
            cycle: thinned(&card.cycle.rising)
                .chain(thinned(&card.cycle.falling))
                .collect(),
            seconds: document.seconds,
            ..Self::empty(file, RowStatus::Ok)
        }
    }

    /// The row of a `file` that has no report, and why not.
    pub fn without_report(file: &str, sha256: Option<String>, error: &Error) -> Self {
        let status = match error {
            Error::Input { .. } => RowStatus::Refused,
            _ => RowStatus::Failed,
        };
        Self {
            sha256,
            problem: Some(error.to_string()),
            ..Self::empty(file, status)
        }
    }

    fn empty(file: &str, status: RowStatus) -> Self {
        Self {
            file: file.into(),
            sha256: None,
            baseline: false,
            status,
            problem: None,
            folder: None,
            verdict: None,
            effects: Vec::new(),
            figures: Vec::new(),
            parameters: Vec::new(),
            limits: LimitNames::default(),
            warnings: 0,
            cycle: Vec::new(),
            seconds: 0.0,
        }
    }

    /// What came of it, in a few words.
    pub fn summary(&self) -> String {
        let verdict = match (&self.problem, self.verdict) {
            (Some(problem), _) => return problem.clone(),
            (None, Some(Verdict::Found)) => {
                format!("found {}", joined(self.effects.clone(), "and"))
            }
            (None, Some(Verdict::Partly)) => {
                format!("partly {}", joined(self.effects.clone(), "and"))
            }
            (None, Some(Verdict::None)) => "nothing missing".into(),
            (None, Some(Verdict::Unexplained)) => "unexplained".into(),
            (None, _) => "not diagnosed".into(),
        };
        let limits = [
            ("fails", &self.limits.fail),
            ("not determined:", &self.limits.not_determined),
        ];
        let missed = limits.iter().filter(|(_, names)| !names.is_empty());
        let missed = missed.map(|(what, names)| format!("; {what} {}", names.join(", ")));
        format!("{verdict}{}", missed.collect::<String>())
    }
}

fn figure(figure: &Figure) -> Option<NamedValue> {
    Some(NamedValue {
        name: figure.quantity.to_string(),
        label: figure.label.clone(),
        unit: figure.unit.clone(),
        value: figure.value?,
        low: figure.low,
        high: figure.high,
        none_in_model: figure.is_none_in_model(),
    })
}

fn parameter(parameter: &ParameterReport) -> Option<NamedValue> {
    let known = |end: f64| Some(end).filter(|end| end.is_finite());
    let determined = !parameter.flat && !parameter.at_bound;
    (!parameter.fixed).then(|| NamedValue {
        name: parameter.name.clone(),
        label: parameter.name.replace('_', " "),
        unit: parameter.unit.clone(),
        value: parameter.value,
        low: known(parameter.low).filter(|_| determined),
        high: known(parameter.high).filter(|_| determined),
        none_in_model: false,
    })
}

/// So few points of a branch that a small picture of it is the same.
fn thinned(branch: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    let last = branch.len().saturating_sub(1);
    let count = POINTS.min(branch.len());
    (0..count).map(move |i| branch[i * last / (count - 1).max(1)])
}
