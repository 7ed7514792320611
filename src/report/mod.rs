//! What a run tells and leaves behind: `report.json`, model files, and how files are written.

mod document;
mod model_file;
mod output;
mod output_file;

pub use document::{
    AddedEffect, ConsideredEffect, Document, ErrorPair, FreeFormReport, ImprovementReport,
    Improvements, Knot, ParameterReport, RemainingReport, SCHEMA, not_identifiable,
};
pub use model_file::ModelFile;
pub use output::OutputFolder;
pub use output_file::OutputFile;
