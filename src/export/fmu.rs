//! A functional mock-up unit: FMI 2.0, co-simulation, with the C that it is compiled from.

use super::c::{self, Source};
use super::variable::BaseUnit;
use super::{Input, Model};
use crate::{Error, Result};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::path::Path;
use std::process::Command;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const HEADER: &str = include_str!("fmu/fmi2.h");
const FUNCTIONS: &str = include_str!("fmu/fmi2.c");
/// The one file that is compiled.
const MAIN: &str = "fmu.c";

/// An FMU as bytes.
#[derive(Debug)]
pub struct Fmu {
    /// The zip file.
    pub bytes: Vec<u8>,
    /// What drives it.
    pub inputs: Vec<Input>,
    /// Why there is no compiled binary in it, where there is none.
    pub without_binary: Option<String>,
}

/// The FMU of `model`, with a binary for this machine where `compiler`, a command such as `cc`, can make one; its own options
/// come last, so that they win.
///
/// # Errors
/// A file for the compiler cannot be written.
pub fn fmu(model: &Model, compiler: &str) -> Result<Fmu> {
    let source = c::physics(model);
    let guid = guid(&[&model.name, &source.text, c::TRAVEL, FUNCTIONS]);
    let main = format!(
        "#include \"fmi2.h\"\n#include \"physics.c\"\n#define GUID \"{guid}\"\n#include \"travel.c\"\n#include \"fmi2.c\"\n"
    );
    let sources = [
        (MAIN, main.as_str()),
        ("physics.c", &source.text),
        ("travel.c", c::TRAVEL),
        ("fmi2.c", FUNCTIONS),
        ("fmi2.h", HEADER),
    ];
    let description = description(model, &source, &guid);
    let (binary, without_binary) = match compile(&sources, compiler)? {
        Ok(binary) => (Some(binary), None),
        Err(why) => (None, Some(why)),
    };

    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |name: String, bytes: &[u8]| {
        zip.start_file(name, SimpleFileOptions::default())?;
        zip.write_all(bytes)?;
        zip::result::ZipResult::Ok(())
    };
    let in_memory = "writing to memory";
    add("modelDescription.xml".into(), description.as_bytes()).expect(in_memory);
    for (name, text) in sources {
        add(format!("sources/{name}"), text.as_bytes()).expect(in_memory);
    }
    if let (Some(bytes), Some((platform, ending))) = (binary, platform()) {
        let path = format!("binaries/{platform}/{}.{ending}", model.name);
        add(path, &bytes).expect(in_memory);
    }
    let bytes = zip.finish().expect(in_memory).into_inner();
    Ok(Fmu {
        bytes,
        inputs: source.inputs,
        without_binary,
    })
}

/// FMI 2.0's name of this machine's platform, and the ending of its libraries; none where it has no name.
fn platform() -> Option<(&'static str, &'static str)> {
    match (std::env::consts::OS, std::env::consts::ARCH) {
        ("linux", "x86_64") => Some(("linux64", "so")),
        ("linux", "x86") => Some(("linux32", "so")),
        ("windows", "x86_64") => Some(("win64", "dll")),
        ("windows", "x86") => Some(("win32", "dll")),
        ("macos", _) => Some(("darwin64", "dylib")),
        _ => None,
    }
}

/// The library that `compiler` makes of the sources, or why it makes none.
fn compile(
    sources: &[(&str, &str)],
    compiler: &str,
) -> Result<std::result::Result<Vec<u8>, String>> {
    if platform().is_none() {
        return Ok(Err("FMI 2.0 has no name for this platform".into()));
    }
    let cannot = |error: std::io::Error| {
        Error::failed(
            format!("the FMU's sources cannot be written for the compiler: {error}"),
            "check the folder of temporary files and the space left",
        )
    };
    let folder = tempfile::tempdir().map_err(cannot)?;
    for (name, text) in sources {
        std::fs::write(folder.path().join(name), text).map_err(cannot)?;
    }
    let library = folder.path().join("library");
    Ok(run(compiler, folder.path(), &library)
        .and_then(|()| std::fs::read(&library).map_err(|error| error.to_string())))
}

fn run(compiler: &str, folder: &Path, library: &Path) -> std::result::Result<(), String> {
    let mut words = compiler.split_whitespace();
    let program = words.next().ok_or("no C compiler is named")?;
    // Multiplication and addition stay two operations, as in the simulation.
    let options = [
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-fPIC",
        "-shared",
        "-fvisibility=hidden",
    ];
    let ran = Command::new(program)
        .args(options)
        .args(words)
        .arg("-o")
        .arg(library)
        .arg(MAIN)
        .arg("-lm")
        .current_dir(folder)
        .output();
    match ran {
        Err(error) => Err(format!("the C compiler {compiler} cannot be run: {error}")),
        Ok(output) if !output.status.success() => {
            let errors = String::from_utf8_lossy(&output.stderr);
            let first = errors.lines().find(|line| line.contains("error"));
            Err(format!(
                "the C compiler {compiler} fails: {}",
                first.unwrap_or("it says nothing")
            ))
        }
        Ok(_) => Ok(()),
    }
}

/// A GUID that is the same for the same texts: two FNV-1a hashes.
fn guid(texts: &[&str]) -> String {
    let hash = |mut hash: u64| {
        for byte in texts.iter().flat_map(|text| text.bytes().chain([0])) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
        hash
    };
    let (a, b) = (hash(0xcbf2_9ce4_8422_2325), hash(0x9ae1_6a3b_2f90_404f));
    format!(
        "{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}",
        a >> 32,
        (a >> 16) & 0xffff,
        a & 0xffff,
        b >> 48,
        b & 0xffff_ffff_ffff
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

/// `modelDescription.xml`.
fn description(model: &Model, source: &Source, guid: &str) -> String {
    let structure = &model.structure;
    let interpolated = structure.hold.is_straight();
    let settings = model.settings();
    let mut variables = String::new();
    let mut units = BTreeSet::new();
    let mut reference = 0;
    let mut add = |name: &str, unit: &str, attributes: &str, description: &str, values: &str| {
        let unit = escaped(unit);
        let _ = write!(
            variables,
            "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {attributes} description=\"{}\">\n      \
             <Real unit=\"{unit}\"{values}/>\n    </ScalarVariable>\n",
            escaped(description)
        );
        units.insert(unit);
        reference += 1;
    };
    let between = match interpolated {
        true => "goes on with its derivative until the next communication point",
        false => "is held until the next communication point",
    };
    for input in &source.inputs {
        let attributes = "causality=\"input\" variability=\"continuous\"";
        add(
            input.name,
            &input.unit,
            attributes,
            between,
            " start=\"0.0\"",
        );
    }
    for parameter in &settings {
        let bounds = match parameter.low > f64::MIN {
            true => format!(" min=\"{:?}\" max=\"{:?}\"", parameter.low, parameter.high),
            false => String::new(),
        };
        let values = format!(" start=\"{:?}\"{bounds}", parameter.nominal());
        let attributes = "causality=\"parameter\" variability=\"fixed\" initial=\"exact\"";
        let what = match parameter.is_fixed() {
            true => "was not fitted",
            false => "fitted",
        };
        add(&parameter.name, &parameter.unit, attributes, what, &values);
    }
    for &output in &structure.observed {
        let attributes = "causality=\"output\" variability=\"continuous\" initial=\"calculated\"";
        add(
            output.name(),
            structure.unit(output),
            attributes,
            "simulated",
            "",
        );
    }
    let first = source.inputs.len() + settings.len() + 1;
    let unknowns: String = (first..first + structure.observed.len())
        .map(|index| format!("      <Unknown index=\"{index}\"/>\n"))
        .collect();
    let units: String = units.iter().map(|unit| unit_text(unit)).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{guid}\" description=\"{}\" \
         generationTool=\"servobee {}\" variableNamingConvention=\"flat\" numberOfEventIndicators=\"0\">\n  \
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"true\" \
         canInterpolateInputs=\"{interpolated}\" canNotUseMemoryManagementFunctions=\"true\" \
         canGetAndSetFMUstate=\"true\">\n    \
         <SourceFiles>\n      <File name=\"{MAIN}\"/>\n    </SourceFiles>\n  </CoSimulation>\n  \
         <UnitDefinitions>\n{units}  </UnitDefinitions>\n  \
         <LogCategories>\n    <Category name=\"logStatusError\"/>\n  </LogCategories>\n  \
         <ModelVariables>\n{variables}  </ModelVariables>\n  \
         <ModelStructure>\n    <Outputs>\n{unknowns}    </Outputs>\n    \
         <InitialUnknowns>\n{unknowns}    </InitialUnknowns>\n  </ModelStructure>\n</fmiModelDescription>\n",
        escaped(&model.summary()),
        env!("CARGO_PKG_VERSION"),
        name = model.name,
    )
}

fn unit_text(unit: &str) -> String {
    let Some(base) = BaseUnit::parse(unit) else {
        return format!("    <Unit name=\"{unit}\"/>\n");
    };
    let mut attributes = String::new();
    for (name, exponent) in BaseUnit::NAMES.iter().zip(base.exponents) {
        if exponent != 0 {
            let _ = write!(attributes, " {name}=\"{exponent}\"");
        }
    }
    let (factor, offset) = (base.factor, base.offset);
    format!(
        "    <Unit name=\"{unit}\">\n      <BaseUnit{attributes} factor=\"{factor:?}\" offset=\"{offset:?}\"/>\n    </Unit>\n"
    )
}
