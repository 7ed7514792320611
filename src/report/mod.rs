//! What a run tells and leaves behind: `report.json`, `report.html`, model files, and how files are written.

mod document;
#[doc(hidden)]
pub mod explain;
mod findings;
mod html;
mod limits;
mod model_file;
mod no_name;
mod noise;
mod number;
mod output;
mod output_file;
mod parameter;
mod provenance;
mod toml_text;

pub use document::{Document, SCHEMA};
pub use findings::{
    AddedEffect, ConsideredEffect, CutShort, ErrorPair, FreeFormReport, ImprovementReport, Knot,
    RemainingReport,
};
pub use html::{datasheet_page, page};
pub use limits::{Limit, LimitReport, Limits, Outcome};
pub use model_file::ModelFile;
pub use no_name::{not_diagnosed, unexplained};
pub use noise::NoiseSource;
pub use number::{number, quantity, rounded};
pub use output::OutputFolder;
pub use output_file::OutputFile;
pub use parameter::{ParameterReport, not_identifiable};
pub use provenance::{Call, HoldErrors, HoldReport, InputFile, MovedParameter, Program, now};
