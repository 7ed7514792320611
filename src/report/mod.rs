//! What a run tells and leaves behind: `report.json`, `report.html`, model files, and how files are written.

mod about;
mod batch;
mod comparison;
mod csv;
mod document;
mod edition;
mod effects;
#[doc(hidden)]
pub mod explain;
mod findings;
mod held_out;
mod html;
mod html_text;
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

pub use about::{About, AboutLine};
pub use batch::{
    Against, BATCH_SCHEMA, Batch, BatchRow, Departure, Departures, Journal, LimitNames, NamedValue,
    RowStatus, batch_csv, departures,
};
pub use comparison::{
    COMPARE_SCHEMA, ComparisonDocument, ConfounderReport, EffectChangeReport, SideReport,
};
#[doc(hidden)]
pub use csv::csv_cell;
pub use document::{Document, SCHEMA};
pub use edition::{Edition, Language, Units};
pub use effects::{EffectReport, effects_json};
pub use findings::{
    AddedEffect, ConsideredEffect, CutShort, ErrorPair, FreeFormReport, ImprovementReport, Knot,
    RemainingReport,
};
pub use html::{batch_page, comparison_page, datasheet_page, page};
pub use limits::{Limit, LimitReport, Limits, Outcome, met};
pub use model_file::ModelFile;
pub use no_name::{complete, located, not_diagnosed, unexplained};
pub use noise::NoiseSource;
pub use number::{number, quantity, rounded};
pub use output::OutputFolder;
pub use output_file::OutputFile;
pub use parameter::{ParameterReport, not_identifiable};
pub use provenance::{Call, HoldErrors, HoldReport, InputFile, MovedParameter, Program, now};
