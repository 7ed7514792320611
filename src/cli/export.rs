//! `servobee export`.

use super::colour;
use servobee::Result;
use servobee::export::{Format, Model};
use servobee::report::{ModelFile, OutputFile};
use std::path::PathBuf;

/// Exports a model for other tools
///
/// The ending of the file says what it becomes: .fmu a functional mock-up unit (FMI 2.0, co-simulation, with its C
/// sources; compiled for this machine by $CC, or else cc), .mo a Modelica model, .m a MATLAB script that sets the
/// parameters of Simscape's valve and actuator blocks, .c the physics and its time loop as C.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee export model.toml --out valve.fmu
  servobee export model.toml --out valve.mo")]
pub(super) struct Arguments {
    /// The model, as identify writes it
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// The file to write, its name ending in .fmu, .mo, .m or .c
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let path = &arguments.out;
    let format = Format::of(path)?;
    let file = ModelFile::read(&arguments.model)?;
    let structure = file.complete_structure()?;
    let parameters = file.parameters(structure.parameters())?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let model = Model::new(&stem, structure, parameters);
    let output = OutputFile::create(path, arguments.force)?;
    let (bytes, said) = format.export(&model)?;
    if let Some(said) = said {
        colour::warning(said);
    }
    output.finish_bytes(&bytes)
}
