//! What a run leaves behind: model files, and how files are written.

mod model_file;
mod output_file;

pub use model_file::ModelFile;
pub use output_file::OutputFile;
