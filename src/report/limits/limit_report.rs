//! A limit, and what a result is beside it.

use serde::Serialize;

/// What a limit comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The whole 95 % interval is inside.
    Pass,
    /// The whole 95 % interval is outside.
    Fail,
    /// Neither: the interval has a limit inside, or there is none.
    NotDetermined,
}

impl Outcome {
    /// As people say it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotDetermined => "not determined",
        }
    }
}

/// A limit, and what the result is beside it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitReport {
    /// The figure's or the parameter's name.
    pub name: String,
    /// `figure` of the card, or `parameter`.
    pub of: &'static str,
    /// The limit as it was written.
    pub limit: String,
    /// Unit of all numbers here.
    pub unit: String,
    /// What it may not be below; null where that is open.
    pub lower: Option<f64>,
    /// What it may not be above; null where that is open.
    pub upper: Option<f64>,
    /// What it is, by which the limit is judged; null where nothing can be said.
    pub value: Option<f64>,
    /// Lower end of its 95 % interval.
    pub low: Option<f64>,
    /// Upper end of its 95 % interval.
    pub high: Option<f64>,
    /// What that is taken from: `model`, or the `measured` curve; null where nothing can be said.
    pub from: Option<&'static str>,
    /// Whether it is inside.
    pub outcome: Outcome,
    /// Why that is not determined; null where it is.
    pub reason: Option<String>,
}
