//! Composing a shader: the physics of a structure, traced, and the loops of `shaders/evaluate.wgsl`.

use super::STATE_LIMIT;
use super::physics::{Function, Kind, LEAP, Physics};
use super::problem::{Problem, SAMPLES_PER_PERIOD};
use super::simulate::{CHUNK, SLICE};
use crate::model::Real;
use crate::model::leap::{MOST_PARTS, Stride};
use crate::model::real::Traced;
use crate::model::real::trace::{Body, Trace, Wgsl};
use std::fmt::{Display, Write};

/// The loops over rows and tones, bindings and sums: everything that is the same for all structures.
pub const LOOPS: &str = include_str!("../../shaders/evaluate.wgsl");
/// From row to row in integration steps.
const STEPS: &str = include_str!("../../shaders/steps.wgsl");
/// From row to row in exact leaps.
const LEAPS: &str = include_str!("../../shaders/leaps.wgsl");

/// Invocations in a workgroup, unless something else is asked for. `servobee bench --workgroups` on lavapipe: 64 and
/// 128 are as fast as each other, 32 and 256 up to 7 % slower. No hardware GPU has been measured yet.
pub const WORKGROUP: u32 = 64;

/// The shader that evaluates `problem`'s structure.
pub fn compose(problem: &Problem) -> String {
    compose_for(problem, WORKGROUP)
}

/// The shader that evaluates `problem`'s structure, with `workgroup` invocations in a workgroup.
pub fn compose_for(problem: &Problem, workgroup: u32) -> String {
    let travel = match problem.leaps() {
        true => LEAPS,
        false => STEPS,
    };
    format!(
        "const WORKGROUP: u32 = {workgroup}u;\n{}\n{}\n{LOOPS}\n{travel}",
        settings(problem),
        physics(problem)
    )
}

/// What [`compose_for`] makes its text of: problems for which this is the same have the same shader. Tracing the physics takes
/// as long as thousands of candidates do on a fast device; this does not.
pub fn identity(problem: &Problem, workgroup: u32) -> String {
    let parameters = problem.parameters.iter().map(|p| (&p.name, p.fixed));
    format!(
        "{workgroup} {} {} {:?} {:?} {:?}",
        problem.leaps(),
        problem.is_even(),
        problem.loss.map(|loss| (loss.name(), problem.scale)),
        parameters.collect::<Vec<_>>(),
        problem.structure,
    )
}

fn settings(problem: &Problem) -> String {
    format!(
        "const INTERPOLATED: bool = {};\nconst EVEN: bool = {};\nconst MOST_PARTS: u32 = {MOST_PARTS}u;\nconst DELAYED: bool = {};\nconst OBSERVED: vec3<f32> = vec3<f32>({});\nconst CHUNK: u32 = {CHUNK}u;\n\
         const SLICE: u32 = {SLICE}u;\nconst SAMPLES_PER_PERIOD: u32 = {SAMPLES_PER_PERIOD}u;\n\
         const STATE_LIMIT: f32 = {STATE_LIMIT:?}f;\n",
        problem.interpolates(),
        problem.is_even(),
        problem.structure.delays(),
        problem
            .observed()
            .0
            .map(|observed| if observed { "1.0" } else { "0.0" })
            .join(", "),
    )
}

/// The physics of `problem`'s structure as WGSL: the structs `Plant` and `State`, and the functions `prepare`,
/// `initial`, `command`, `remember`, `delay`, `observe`, `advance`, `loss`, `load`, `store` and `diverged` that the loops call.
pub fn physics(problem: &Problem) -> String {
    let values = |trace: &Trace| {
        let free: Vec<Traced> = (0..problem.free().len())
            .map(|i| trace.read(format!("candidates[{i}u * population + candidate]")))
            .collect();
        let mut fixed = 0;
        let values = problem.complete(&free, |_| {
            fixed += 1;
            trace.read(format!("constants[{}u]", fixed - 1))
        });
        for (parameter, value) in problem.parameters.iter().zip(&values) {
            trace.name(*value, &parameter.name);
        }
        values
    };
    let mut physics = Physics::new(&problem.structure, problem.leaps(), values);
    physics.functions.push(loss(problem, &physics.trace));
    let mut functions = String::new();
    for function in &physics.functions {
        if function.name != "derivative" {
            let body = physics.trace.function::<Wgsl>(&function.results);
            functions += &format!("\n{}", function_text(function, &body));
        }
    }
    let structs = match problem.leaps() {
        true => stride_text(),
        false => String::new(),
    };
    let (mut fields, mut prepare) = physics.trace.plant::<Wgsl>();
    if fields.is_empty() {
        fields.push("unused".into());
        prepare.results.push("0.0".into());
    }
    format!(
        "{}\n{structs}{}\nfn prepare(candidate: u32, population: u32) -> Plant {{\n{}}}\n{functions}",
        state_text(&physics.states),
        struct_text("Plant", &fields),
        body_text("Plant", &prepare),
    )
}

/// What an error of each output costs.
fn loss(problem: &Problem, trace: &Trace) -> Function {
    let errors = ["x", "y", "z"].map(|i| trace.read(format!("error.{i}")));
    let results = match problem.own_loss::<Traced>() {
        None => errors.map(|error| error * error),
        Some((loss, sizes)) => [0, 1, 2].map(|i| loss(errors[i], Traced::constant(sizes.0[i]))),
    };
    Function {
        name: "loss",
        arguments: &[("error", Kind::Outputs)],
        kind: Kind::Outputs,
        results: results.to_vec(),
    }
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Real => "f32",
        Kind::Plant => "Plant",
        Kind::State => "State",
        Kind::Input => "Input",
        Kind::Outputs => "vec3<f32>",
        Kind::Stride => "Stride",
        Kind::Leap => "Leap",
    }
}

fn function_text(function: &Function, body: &Body) -> String {
    let arguments: Vec<String> = function
        .arguments
        .iter()
        .map(|&(name, kind)| format!("{name}: {}", type_name(kind)))
        .collect();
    let result = type_name(function.kind);
    format!(
        "fn {}({}) -> {result} {{\n{}}}\n",
        function.name,
        arguments.join(", "),
        body_text(result, body)
    )
}

/// Local numbers, and the return of `constructor`'s value.
fn body_text(constructor: &str, body: &Body) -> String {
    let mut text = String::new();
    for (name, expression) in &body.locals {
        writeln!(text, "    let {name} = {expression};").expect("writing to a string");
    }
    let results = body.results.join(", ");
    writeln!(text, "    return {constructor}({results});").expect("writing to a string");
    text
}

fn struct_text<T: Display>(name: &str, fields: &[T]) -> String {
    let fields: Vec<String> = fields
        .iter()
        .map(|field| format!("    {field}: f32,\n"))
        .collect();
    format!("struct {name} {{\n{}}}\n", fields.concat())
}

/// The structs `Stride` and `Leap`.
fn stride_text() -> String {
    format!(
        "{}\n// Integrator and spool, and above zero: what is left to do.\n{}\n",
        struct_text("Stride", &Stride::<Traced>::NAMES),
        struct_text("Leap", &LEAP)
    )
}

/// The struct `State` and the functions that know its fields.
fn state_text(names: &[String]) -> String {
    let mut text = struct_text("State", names);
    let count = names.len();
    let loads: Vec<String> = (0..count)
        .map(|i| format!("states[at + {i}u * stride]"))
        .collect();
    let tests: Vec<String> = names
        .iter()
        .map(|name| format!("!(abs(state.{name}) < STATE_LIMIT)"))
        .collect();
    write!(
        text,
        "\nconst STATES: u32 = {count}u;\n\nfn load(at: u32, stride: u32) -> State {{\n    return State({});\n}}\n\n\
         fn store(at: u32, stride: u32, state: State) {{\n",
        loads.join(", ")
    )
    .expect("writing to a string");
    for (i, name) in names.iter().enumerate() {
        writeln!(text, "    states[at + {i}u * stride] = state.{name};")
            .expect("writing to a string");
    }
    write!(
        text,
        "}}\n\nfn diverged(state: State) -> bool {{\n    return {};\n}}\n",
        tests.join(" || ")
    )
    .expect("writing to a string");
    text
}
