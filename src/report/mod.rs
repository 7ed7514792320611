//! What a run tells: `report.json`, tables for the terminal, and the folder that holds the files.

mod document;
mod output;

pub use document::{
    AddedEffect, ChannelError, Document, ErrorPair, ParameterReport, RemainingReport, SCHEMA,
    Sides, Verdict,
};
pub use output::OutputFolder;

/// placeholder
pub fn model_toml(_: &crate::evaluate::Problem, _: &[f64]) -> String {
    String::new()
}
