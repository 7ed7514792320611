//! Which format a file gets, by how its name ends.

use super::{Model, c, fmu, modelica, simscape};
use crate::{Error, Result};
use std::path::Path;

/// A format that a model is exported in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A functional mock-up unit, `.fmu`.
    Fmu,
    /// Modelica, `.mo`.
    Modelica,
    /// A script for Simscape, `.m`.
    Simscape,
    /// C, `.c`.
    C,
}

impl Format {
    /// The one that the name of the file at `path` says.
    ///
    /// # Errors
    /// It says none.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("fmu") => Ok(Self::Fmu),
            Some("mo") => Ok(Self::Modelica),
            Some("m") => Ok(Self::Simscape),
            Some("c") => Ok(Self::C),
            _ => Err(Error::input(
                format!("--out {}", path.display()),
                "its ending names no format",
                "end the name in .fmu, .mo, .m or .c",
            )),
        }
    }

    /// What a file of `model` holds, and what has to be said of it. An FMU is compiled by `$CC`, or else `cc`.
    ///
    /// # Errors
    /// As of [`fmu::fmu`].
    pub fn export(self, model: &Model) -> Result<(Vec<u8>, Option<String>)> {
        let text = match self {
            Self::Fmu => {
                let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
                let made = fmu::fmu(model, &compiler)?;
                let said = made
                    .without_binary
                    .map(|why| format!("the FMU has its C sources but no binary: {why}"));
                return Ok((made.bytes, said));
            }
            Self::Modelica => modelica::modelica(model),
            Self::Simscape => simscape::script(model),
            Self::C => c::program(model),
        };
        Ok((text.into_bytes(), None))
    }
}
