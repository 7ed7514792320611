//! The catalogue for programs.

use crate::model::effects::{CATALOGUE, Entry, Port};
use serde::Serialize;

/// What is said of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectReport {
    /// Its name.
    pub name: &'static str,
    /// Where it acts.
    pub port: Port,
    /// What it is.
    pub summary: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// What it shows as.
    pub shows: &'static str,
    /// What it is confused with.
    pub confused: &'static str,
    /// Where that is said.
    pub source: &'static str,
}

impl From<&Entry> for EffectReport {
    fn from(entry: &Entry) -> Self {
        Self {
            name: entry.name,
            port: entry.port,
            summary: entry.summary,
            equation: entry.equation,
            shows: entry.shows,
            confused: entry.confused,
            source: entry.source,
        }
    }
}

/// The catalogue as JSON text.
pub fn effects_json() -> String {
    let effects: Vec<EffectReport> = CATALOGUE.iter().map(|entry| (*entry).into()).collect();
    serde_json::to_string_pretty(&effects).expect("plain data")
}
