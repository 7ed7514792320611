//! The composed shaders are valid, translate to every backend, and lay out memory as the host does. No GPU is needed.

use crate::common;
use crate::common::{case, cases};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, TypeInner, back};
use servobee::evaluate::gpu::layout;
use servobee::evaluate::identity::ShaderIdentity;
use servobee::evaluate::physics::INPUTS;
use servobee::evaluate::problem::Data;
use servobee::evaluate::{Loss, Problem, wgsl};
use servobee::model::{Output, Outputs, Real, Structure};
use std::collections::HashMap;
use std::mem::{offset_of, size_of};
use std::path::Path;

/// The usual cost, as one's own.
struct Square;

impl Loss for Square {
    fn of<R: Real>(error: R, _size: R) -> R {
        error * error
    }
}

const ENTRY_POINTS: [&str; 2] = ["evaluate_series", "evaluate_tones"];

/// Parses and validates a shader for a device without any extra capability.
fn validated(name: &str, source: &str) -> (Module, ModuleInfo) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    (module, info)
}

#[test]
fn every_structure_gives_a_valid_shader_for_every_backend() {
    let base = cases()
        .into_iter()
        .map(|case| (case.name.to_owned(), case.problem));
    for (name, problem) in base.chain(common::effects::cases()) {
        let (module, info) = validated(&name, &wgsl::compose(&problem));

        let words = back::spv::write_vec(&module, &info, &back::spv::Options::default(), None)
            .unwrap_or_else(|error| panic!("{name}: SPIR-V: {error}"));
        // SPIR-V holds names as bytes of little-endian words.
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let spirv = String::from_utf8_lossy(&bytes).into_owned();

        let (msl, _) = back::msl::write_string(
            &module,
            &info,
            &back::msl::Options::default(),
            &back::msl::PipelineOptions::default(),
        )
        .unwrap_or_else(|error| panic!("{name}: MSL: {error}"));

        let mut hlsl = String::new();
        let options = back::hlsl::Options::default();
        let pipeline = back::hlsl::PipelineOptions::default();
        back::hlsl::Writer::new(&mut hlsl, &options, &pipeline)
            .write(&module, &info, None)
            .unwrap_or_else(|error| panic!("{name}: HLSL: {error}"));

        for (language, text) in [("SPIR-V", spirv), ("MSL", msl), ("HLSL", hlsl)] {
            for entry in ENTRY_POINTS {
                assert!(text.contains(entry), "{name}: no {entry} in {language}");
            }
        }
    }
}

/// Offsets of a struct's members in the shader, and its size.
fn shader_layout(module: &Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let found = module
        .types
        .iter()
        .find(|(_, ty)| ty.name.as_deref() == Some(name));
    let (_, ty) = found.unwrap_or_else(|| panic!("no struct {name} in the shader"));
    let TypeInner::Struct { members, span } = &ty.inner else {
        panic!("{name} is no struct")
    };
    let member = |m: &naga::StructMember| (m.name.clone().expect("a name"), m.offset);
    (members.iter().map(member).collect(), *span)
}

/// The names and offsets of a host struct's fields.
macro_rules! fields {
    ($ty:ident: $($field:ident),*) => {
        vec![$((stringify!($field).to_owned(), offset_of!(layout::$ty, $field) as u32)),*]
    };
}

#[test]
fn host_and_shader_lay_out_memory_alike() {
    let problem = case("actuator, held").problem;
    let (module, _) = validated("actuator", &wgsl::compose(&problem));
    let sample = fields!(Sample: step, substeps, pieces, weight, input, time_rest, jumps, measured);
    let tone = fields!(Tone: amplitude, step, substeps, stride, settle, measure);
    let pairs = [
        (
            "Work",
            fields!(Work: population, items, first, last, begin, end),
            size_of::<layout::Work>(),
        ),
        ("Sample", sample, size_of::<layout::Sample>()),
        (
            "Series",
            fields!(Series: first, count, slot),
            size_of::<layout::Series>(),
        ),
        ("Tone", tone, size_of::<layout::Tone>()),
    ];
    for (name, fields, size) in pairs {
        assert_eq!(
            shader_layout(&module, name),
            (fields, size as u32),
            "{name}"
        );
    }
    // The host's arrays are structs of the shader.
    for (name, fields) in [
        ("Input", INPUTS.to_vec()),
        ("Measured", Output::ALL.map(Output::name).to_vec()),
        ("Outputs", vec!["spool"]),
    ] {
        let size = 4 * fields.len() as u32;
        let fields = fields.into_iter().map(String::from).zip((0..).step_by(4));
        assert_eq!(shader_layout(&module, name), (fields.collect(), size));
    }
}

/// The physics that is committed for people to read is the physics that the model gives now.
#[test]
fn the_committed_physics_is_up_to_date() {
    let base = Structure::actuator(10.0, "V");
    let parameters = base.parameters();
    let base = Problem::new(base, parameters, Data::Series(vec![]));
    for (file, what, problem) in [
        (
            "base.wgsl",
            "the actuator alone, as `Structure::actuator(10.0, \"V\")` has it",
            base,
        ),
        (
            "valve.wgsl",
            "an actuator and a valve with an area table, all ports measured",
            case("actuator and table valve").problem,
        ),
    ] {
        let text = format!(
            "// The physics of {what}:\n// traced from src/model, to be composed with evaluate.wgsl. For reading; a test \
             keeps it up to date.\n\n{}",
            wgsl::physics(&problem)
        );
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("shaders")
            .join(file);
        if std::env::var("SERVOBEE_BLESS").is_ok_and(|value| value == "1") {
            std::fs::write(&path, &text).expect("a file that can be written");
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            committed == text,
            "shaders/{file} is stale: run `SERVOBEE_BLESS=1 cargo test --test all shader::` and read what changed"
        );
    }
}

/// What tells shaders apart in a cache tells all of them apart, and nothing else.
#[test]
fn problems_of_one_identity_have_one_shader() {
    let base = cases().into_iter().map(|case| case.problem);
    let effects = common::effects::cases()
        .into_iter()
        .map(|(_, problem)| problem);
    let mut all: Vec<Problem> = base.chain(effects).collect();
    for i in (0..all.len()).step_by(5) {
        let problem = all[i].clone();
        let mut fixed = problem.clone();
        let last = fixed.parameters.last_mut().expect("a parameter");
        last.set_fixed(!last.is_fixed());
        let mut started = problem.clone();
        let parameter = &mut started.parameters[0];
        parameter.set_nominal(1.5 * parameter.nominal());
        let losing = problem.clone().with_loss::<Square>();
        let mut scaled = losing.clone();
        scaled.scale = Outputs::all(0.25);
        all.extend([fixed, started, losing, scaled, problem]);
    }
    let mut shaders = HashMap::new();
    for problem in &all {
        for workgroup in [32, 64] {
            let shader = wgsl::compose_for(problem, workgroup);
            let known = shaders.entry((ShaderIdentity::of(problem), workgroup));
            assert_eq!(*known.or_insert(shader.clone()), shader);
        }
    }
    println!("{} shaders of {} problems", shaders.len(), 2 * all.len());
    assert!(shaders.len() < 2 * all.len() - 60);
}

#[test]
fn every_file_that_a_text_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [
        "src/",
        "shaders/",
        "tests/",
        "benches/",
        "examples/",
        "python/",
    ];
    let mut texts = vec![root.join("README.md")];
    let mut left: Vec<_> = ["shaders", "src", "examples"]
        .map(|folder| root.join(folder))
        .into();
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => left.push(path),
                false => texts.push(path),
            }
        }
    }
    let mut named = 0;
    for text in texts {
        let Ok(words) = std::fs::read_to_string(&text) else {
            continue;
        };
        for word in words.split(|c: char| !(c.is_ascii_alphanumeric() || "_./".contains(c))) {
            let word = word.trim_end_matches('.');
            let ending = word.rsplit_once('.').map(|(_, ending)| ending);
            if folders.iter().any(|folder| word.starts_with(folder))
                && matches!(
                    ending,
                    Some("rs" | "wgsl" | "py" | "sh" | "md" | "toml" | "csv")
                )
            {
                named += 1;
                assert!(root.join(word).exists(), "{} names {word}", text.display());
            }
        }
    }
    assert!(named > 20, "{named}");
}
