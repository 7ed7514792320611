//! Composing a shader: the physics of a structure, traced, and the loops of `shaders/evaluate.wgsl`.

use super::STATE_LIMIT;
use super::problem::{Problem, SAMPLES_PER_PERIOD};
use super::simulate::{CHUNK, SLICE, with_states};
use crate::model::integrate::advance;
use crate::model::leap::{MOST_PARTS, Place, Stride};
use crate::model::real::{Function, Trace, Wgsl};
use crate::model::{Input, Plant, Real, Structure};
use std::fmt::Write;

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
            .map(|observed| if observed { "1.0" } else { "0.0" })
            .join(", "),
    )
}

/// The physics of `problem`'s structure as WGSL: the structs `Plant` and `State`, and the functions `prepare`,
/// `initial`, `command`, `remember`, `delay`, `observe`, `loss`, `advance`, `load`, `store` and `diverged` that the loops call.
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

    let errors = ["x", "y", "z"].map(|i| trace.read(format!("error.{i}")));
    let loss = match problem.own_loss::<Wgsl>() {
        None => errors.map(|error| error * error),
        Some((loss, sizes)) => [0, 1, 2].map(|i| loss(errors[i], Wgsl::constant(sizes[i]))),
    };

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
            "loss(plant: Plant, error: vec3<f32>) -> vec3<f32>",
            "vec3<f32>",
            loss.to_vec(),
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
    let mut structs = String::new();
    if problem.leaps() {
        let (text, leaps) = leaps(&mut trace, &plant, problem.interpolates());
        structs = text;
        functions += &leaps;
    }
    let prepare = trace.plant("prepare(candidate: u32, population: u32) -> Plant");
    format!("{}\n{structs}{prepare}{functions}", state_text(&names))
}

/// The structs `Stride` and `Leap`, and the functions `stride_of`, `leap` and `turn`.
fn leaps(trace: &mut Trace, plant: &Plant<Wgsl>, interpolated: bool) -> (String, String) {
    let fields = Stride::<Wgsl>::NAMES.map(|name| format!("    {name}: f32,\n"));
    let structs = format!(
        "struct Stride {{\n{}}}\n\n// Integrator and spool, and above zero: what is left to do.\n\
         struct Leap {{\n    integrator: f32,\n    spool: f32,\n    more: f32,\n}}\n\n",
        fields.concat()
    );
    let [length, command, left, ramp] =
        ["length", "command", "left", "ramp"].map(|name| trace.read(name));
    let stride = Stride::from_numbers(
        Stride::<Wgsl>::NAMES.map(|name| trace.read(format!("stride.{name}"))),
    );
    let from = Place {
        integrator: trace.read("state.integrator"),
        spool: trace.read("state.spool"),
    };
    let ramp = interpolated.then_some(ramp);
    let actuator = plant.actuator();
    let numbers = actuator.stride(length).numbers();
    let mut text = String::new();
    let results = |(place, more): (Place<Wgsl>, Wgsl)| [place.integrator, place.spool, more];
    let leap = results(actuator.leap(&stride, from, command, ramp));
    let turn = results(actuator.turn(&stride, from, command, ramp, left));
    for (signature, constructor, results) in [
        (
            "stride_of(plant: Plant, length: f32) -> Stride",
            "Stride",
            &numbers[..],
        ),
        (
            "leap(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> Leap",
            "Leap",
            &leap,
        ),
        (
            "turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> Leap",
            "Leap",
            &turn,
        ),
    ] {
        text += "\n";
        text += &trace.function(&Function {
            signature,
            constructor,
            results,
        });
    }
    (structs, text)
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
