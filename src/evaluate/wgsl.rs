//! Composing a shader: the physics of a structure, traced, and the loops of `shaders/evaluate.wgsl`.

use super::STATE_LIMIT;
use super::problem::{Problem, SAMPLES_PER_PERIOD};
use super::simulate::{CHUNK, SLICE, with_states};
use crate::model::integrate::advance;
use crate::model::real::{Function, Trace, Wgsl};
use crate::model::{Input, Plant, Real, Structure};
use std::fmt::Write;

/// The loops, bindings and sums: everything that is the same for all structures.
pub const LOOPS: &str = include_str!("../../shaders/evaluate.wgsl");

/// Invocations in a workgroup, unless something else is asked for. `servobee bench --workgroups` on lavapipe: 64 and
/// 128 are as fast as each other, 32 and 256 up to 7 % slower. No hardware GPU has been measured yet.
pub const WORKGROUP: u32 = 64;

/// The shader that evaluates `problem`'s structure.
pub fn compose(problem: &Problem) -> String {
    compose_for(problem, WORKGROUP)
}

/// The shader that evaluates `problem`'s structure, with `workgroup` invocations in a workgroup.
pub fn compose_for(problem: &Problem, workgroup: u32) -> String {
    format!(
        "const WORKGROUP: u32 = {workgroup}u;\n{}\n{}\n{LOOPS}",
        settings(problem),
        physics(problem)
    )
}

fn settings(problem: &Problem) -> String {
    format!(
        "const INTERPOLATED: bool = {};\nconst DELAYED: bool = {};\nconst OBSERVED: vec3<f32> = vec3<f32>({});\nconst CHUNK: u32 = {CHUNK}u;\n\
         const SLICE: u32 = {SLICE}u;\nconst SAMPLES_PER_PERIOD: u32 = {SAMPLES_PER_PERIOD}u;\n\
         const STATE_LIMIT: f32 = {STATE_LIMIT:?}f;\n",
        problem.interpolates(),
        problem.structure.delays(),
        problem
            .observed()
            .map(|observed| if observed { "1.0" } else { "0.0" })
            .join(", "),
    )
}

/// The physics of `problem`'s structure as WGSL: the structs `Plant` and `State`, and the functions `prepare`,
/// `initial`, `command`, `remember`, `delay`, `observe`, `advance`, `load`, `store` and `diverged` that the loops call.
pub fn physics(problem: &Problem) -> String {
    #[allow(
        clippy::extra_unused_type_parameters,
        reason = "with_states names the numbers first, and these are always text"
    )]
    fn traced<R, const N: usize, const EFFECTS: bool>(problem: &Problem) -> String {
        physics_with::<N, EFFECTS>(problem)
    }
    with_states!(&problem.structure, traced::<Wgsl>(problem))
}

fn physics_with<const N: usize, const EFFECTS: bool>(problem: &Problem) -> String {
    let structure: &Structure = &problem.structure;
    let names = structure.states();
    let mut trace = Trace::start();

    let free: Vec<Wgsl> = (0..problem.free().len())
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
    let plant = Plant::new(structure, &values);
    trace.seal();

    let input = |name: &str| {
        let fields = ["command", "supply", "tank", "a", "b", "temperature", "time"];
        Input::new(fields.map(|field| trace.read(format!("{name}.{field}"))))
    };
    let mut state = [Wgsl::constant(0.0); N];
    for (i, name) in names.iter().enumerate() {
        state[i] = trace.read(format!("state.{name}"));
    }
    let now = input("input");
    let position = trace.read("position");
    let step = trace.read("step");
    let arrived = trace.read("arrived");

    let initial = plant.initial::<N, EFFECTS>(&now, position);
    let mut remembered = state;
    let command = match EFFECTS {
        true => plant.command(&mut remembered, arrived),
        false => arrived,
    };
    let delay = plant.delay().unwrap_or(Wgsl::constant(0.0));
    let observed = plant.observe::<EFFECTS>(&state, &now);
    let moved = advance::<Wgsl, N, EFFECTS>(
        &plant,
        state,
        [&input("start"), &input("middle"), &input("end")],
        step,
    );

    let padded = |values: [Wgsl; N]| {
        let mut values = values[..names.len()].to_vec();
        if names.is_empty() {
            values.push(Wgsl::constant(0.0));
        }
        values
    };
    let mut functions = String::new();
    for (signature, constructor, results) in [
        (
            "initial(plant: Plant, input: Input, position: f32) -> State",
            "State",
            padded(initial),
        ),
        (
            "command(plant: Plant, state: State, arrived: f32) -> f32",
            "f32",
            vec![command],
        ),
        (
            "remember(plant: Plant, state: State, arrived: f32) -> State",
            "State",
            padded(remembered),
        ),
        ("delay(plant: Plant) -> f32", "f32", vec![delay]),
        (
            "observe(plant: Plant, state: State, input: Input) -> vec3<f32>",
            "vec3<f32>",
            observed.to_vec(),
        ),
        (
            "advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State",
            "State",
            padded(moved),
        ),
    ] {
        functions += "\n";
        functions += &trace.function(&Function {
            signature,
            constructor,
            results: &results,
        });
    }
    let prepare = trace.plant("prepare(candidate: u32, population: u32) -> Plant");
    format!("{}\n{prepare}{functions}", state_text(&names))
}

/// The struct `State` and the functions that know its fields.
fn state_text(names: &[String]) -> String {
    let unused = ["unused".to_owned()];
    let names = if names.is_empty() { &unused } else { names };
    let mut text = String::from("struct State {\n");
    for name in names {
        writeln!(text, "    {name}: f32,").expect("writing to a string");
    }
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
        "}}\n\nconst STATES: u32 = {count}u;\n\nfn load(at: u32, stride: u32) -> State {{\n    return State({});\n}}\n\n\
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
