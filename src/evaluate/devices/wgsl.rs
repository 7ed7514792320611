//! Composing a shader: the physics of a structure, traced, and the loops of `shaders/evaluate.wgsl`.

use crate::evaluate::population::Status;
use crate::evaluate::problem::{Problem, SAMPLES_PER_PERIOD};
use crate::evaluate::simulation::physics::{EXACT_STEP, INPUTS, Kind, Physics};
use crate::evaluate::simulation::simulate::STATE_LIMIT;
use crate::evaluate::simulation::simulate::{CHUNK, SLICE};
use crate::model::exact_step::{MOST_PARTS, Stride};
use crate::model::real::Traced;
use crate::model::real::trace::{Body, Trace, Wgsl};
use crate::model::{Hold, Output, Real};
use std::fmt::{Display, Write};

/// The loops over rows and tones, bindings and sums: everything that is the same for all structures.
pub const LOOPS: &str = include_str!("../../../shaders/evaluate.wgsl");
/// From row to row in integration steps.
const STEPS: &str = include_str!("../../../shaders/steps.wgsl");
/// From row to row in exact steps.
const EXACT_STEPS: &str = include_str!("../../../shaders/exact_steps.wgsl");

/// Invocations in a workgroup, unless something else is asked for. `servobee bench --workgroups` on lavapipe: 64 and
/// 128 are as fast as each other, 32 and 256 up to 7 % slower; on an H100 32 to 512 are within 2 %.
pub const WORKGROUP: u32 = 64;

/// The shader that evaluates `problem`'s structure.
pub fn compose(problem: &Problem) -> String {
    compose_for(problem, WORKGROUP)
}

/// The shader that evaluates `problem`'s structure, with `workgroup` invocations in a workgroup.
pub fn compose_for(problem: &Problem, workgroup: u32) -> String {
    let travel = match problem.has_exact_steps() {
        true => EXACT_STEPS,
        false => STEPS,
    };
    format!(
        "const WORKGROUP: u32 = {workgroup}u;\n{}\n{}\n{LOOPS}\n{travel}",
        settings(problem),
        physics(problem)
    )
}

fn settings(problem: &Problem) -> String {
    format!(
        "const INTERPOLATED: bool = {};\nconst BETWEEN_JUMPS: bool = {};\nconst EVEN: bool = {};\nconst FOLLOWED: bool = {};\nconst STEPS_OF_AN_EXACT_STEP: u32 = {}u;\nconst MOST_PARTS: u32 = {MOST_PARTS}u;\n\
         const DELAYED: bool = {};\nconst OUTPUTS: u32 = {}u;\nconst FINISHED: u32 = {}u;\nconst DIVERGED: u32 = {}u;\n\
         const CHUNK: u32 = {CHUNK}u;\nconst SLICE: u32 = {SLICE}u;\n\
         const SAMPLES_PER_PERIOD: u32 = {SAMPLES_PER_PERIOD}u;\nconst STATE_LIMIT: f32 = {STATE_LIMIT:?}f;\n",
        problem.interpolates(),
        problem.structure.hold == Hold::BetweenJumps,
        problem.is_even(),
        problem.structure.has_followers(),
        problem.structure.steps_of_an_exact_step(),
        problem.structure.delays(),
        problem.structure.observed.len(),
        Status::Finished as u32,
        Status::Diverged as u32,
    )
}

/// What knows the fields of `problem`'s structure, as WGSL: the structs `Input`, `Measured`, `Outputs`, `State` and `Plant`,
/// and the functions that the loops call. `Measured` has every output, as the rows of a record have it; `Outputs` has those
/// that the structure observes.
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
        for (parameter, value) in problem.parameters.iter().zip(values.as_slice()) {
            trace.name(*value, &parameter.name);
        }
        values
    };
    let exact_steps = problem.has_exact_steps();
    let outputs = &problem.structure.observed;
    let mut physics = Physics::new(&problem.structure, exact_steps, values);
    let mut functions = String::new();
    for function in &physics.functions {
        let results = match function.kind {
            _ if function.name == "derivative" => continue,
            Kind::Outputs => outputs
                .iter()
                .map(|&o| function.results[o as usize])
                .collect(),
            _ => function.results.clone(),
        };
        let arguments = function.arguments.iter();
        let arguments: Vec<_> = arguments
            .map(|&(name, kind)| (name, type_name(kind)))
            .collect();
        let body = physics.trace.function::<Wgsl>(&results);
        functions += &function_text(function.name, &arguments, type_name(function.kind), &body);
    }
    functions += &channels(problem, &mut physics.trace);
    let (mut fields, mut prepare) = physics.trace.plant::<Wgsl>();
    if fields.is_empty() {
        fields.push("unused".into());
        prepare.results.push("0.0".into());
    }
    let number = [("candidate", "u32"), ("population", "u32")];
    let prepare = function_text("prepare", &number, "Plant", &prepare);
    let outputs: Vec<&str> = outputs.iter().map(|output| output.name()).collect();
    let texts = [
        struct_text("Input", &INPUTS),
        struct_text("Measured", &Output::ALL.map(Output::name)),
        struct_text("Outputs", &outputs),
        buffer_text("results", "Outputs", &outputs),
        struct_text("State", &physics.states),
        buffer_text("states", "State", &physics.states),
        diverged_text(&physics.states),
        if exact_steps {
            stride_text()
        } else {
            String::new()
        },
        struct_text("Plant", &fields),
        prepare,
        functions,
    ];
    texts.concat().trim_start().into()
}

/// The functions that know the channels and no equation.
fn channels(problem: &Problem, trace: &mut Trace) -> String {
    let outputs = &problem.structure.observed;
    let read = |argument: &str| -> Vec<Traced> {
        let names = outputs.iter().map(|output| output.name());
        names
            .map(|name| trace.read(format!("{argument}.{name}")))
            .collect()
    };
    let [sums, more, measured, simulated] = ["sums", "more", "measured", "simulated"].map(read);
    let weight = trace.read("weight");
    let loss = problem.own_loss::<Traced>();
    let cost = |i: usize| {
        let error = measured[i] - simulated[i];
        match &loss {
            None => error * error,
            Some((loss, sizes)) => loss(error, Traced::constant(sizes[outputs[i]])),
        }
    };
    let range = 0..outputs.len();
    let with_errors: Vec<Traced> = range.clone().map(|i| sums[i] + weight * cost(i)).collect();
    let with_more: Vec<Traced> = range.map(|i| sums[i] + more[i]).collect();
    let position = trace.read(format!("measured.{}", Output::Position.name()));
    // As on the CPU: a tone is heard in the spool, which is zero where it is not observed.
    let spool = outputs.iter().position(|&output| output == Output::Spool);
    let spool = spool.map_or(Traced::constant(0.0), |i| simulated[i]);
    let share = trace.read("share");
    let between = INPUTS.map(|input| {
        let [start, end] = ["start", "end"].map(|side| trace.read(format!("{side}.{input}")));
        start + share * (end - start)
    });
    let mut write = |name, arguments: &[_], result, results: &[Traced]| {
        function_text(name, arguments, result, &trace.function::<Wgsl>(results))
    };
    const SUMS: (&str, &str) = ("sums", "Outputs");
    const MEASURED: (&str, &str) = ("measured", "Measured");
    const SIMULATED: (&str, &str) = ("simulated", "Outputs");
    [
        write("first_position", &[MEASURED], "f32", &[position]),
        write(
            "add_errors",
            &[SUMS, ("weight", "f32"), MEASURED, SIMULATED],
            "Outputs",
            &with_errors,
        ),
        write("add", &[SUMS, ("more", "Outputs")], "Outputs", &with_more),
        write("response", &[SIMULATED], "f32", &[spool]),
        write(
            "between",
            &[("start", "Input"), ("end", "Input"), ("share", "f32")],
            "Input",
            &between,
        ),
    ]
    .concat()
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Real => "f32",
        Kind::Plant => "Plant",
        Kind::State => "State",
        Kind::Input => "Input",
        Kind::Outputs => "Outputs",
        Kind::Stride => "Stride",
        Kind::ExactStep => "ExactStep",
    }
}

/// A function that takes `arguments` (name and type) and returns a `result`.
fn function_text(name: &str, arguments: &[(&str, &str)], result: &str, body: &Body) -> String {
    let arguments: Vec<String> = arguments
        .iter()
        .map(|(name, kind)| format!("{name}: {kind}"))
        .collect();
    let mut text = format!("\nfn {name}({}) -> {result} {{\n", arguments.join(", "));
    for (name, expression) in &body.locals {
        writeln!(text, "    let {name} = {expression};").expect("writing to a string");
    }
    let results = body.results.join(", ");
    writeln!(text, "    return {result}({results});\n}}").expect("writing to a string");
    text
}

fn struct_text<T: Display>(name: &str, fields: &[T]) -> String {
    let fields: Vec<String> = fields
        .iter()
        .map(|field| format!("    {field}: f32,\n"))
        .collect();
    format!("\nstruct {name} {{\n{}}}\n", fields.concat())
}

/// The structs `Stride` and `ExactStep`.
fn stride_text() -> String {
    format!(
        "{}\n// Integrator and spool, and above zero: what is left to do.{}",
        struct_text("Stride", &Stride::<Traced>::NAMES),
        struct_text("ExactStep", &EXACT_STEP)
    )
}

/// The functions that bring a struct from the buffer `name` and back, where its fields are `stride` numbers apart.
fn buffer_text<T: Display>(name: &str, kind: &str, fields: &[T]) -> String {
    let place = |i| format!("{name}[at + {i}u * stride]");
    let loads: Vec<String> = (0..fields.len()).map(place).collect();
    let stores = fields.iter().enumerate();
    let stores: Vec<String> = stores
        .map(|(i, field)| format!("    {} = value.{field};\n", place(i)))
        .collect();
    format!(
        "\nfn load_{name}(at: u32, stride: u32) -> {kind} {{\n    return {kind}({});\n}}\n\n\
         fn store_{name}(at: u32, stride: u32, value: {kind}) {{\n{}}}\n",
        loads.join(", "),
        stores.concat()
    )
}

/// Whether a state has left the finite range.
fn diverged_text(states: &[String]) -> String {
    let tests: Vec<String> = states
        .iter()
        .map(|name| format!("!(abs(state.{name}) < STATE_LIMIT)"))
        .collect();
    format!(
        "\nfn diverged(state: State) -> bool {{\n    return {};\n}}\n",
        tests.join(" || ")
    )
}
