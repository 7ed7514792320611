//! The functions of a structure that a time loop calls, traced: what the shader and the exports are written from.

use crate::evaluate::simulation::exact_step::Course;
use crate::model::actuator::Actuator;
use crate::model::effects::Stage;
use crate::model::exact_step::{Place, Stride};
use crate::model::integrate::RungeKutta;
use crate::model::real::trace::Trace;
use crate::model::{
    Complete, Dynamics, Input, MOST_STATES, Output, Outputs, Plant, Real, Structure, real::Traced,
};

/// What a traced function takes or returns. In the text, `plant.gain` is the field `gain` of the argument `plant`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Real,
    /// What is computed once a candidate.
    Plant,
    /// The states.
    State,
    /// What drives the model: the fields [`INPUTS`].
    Input,
    /// Every output.
    Outputs,
    /// What all exact steps of one length have in common.
    Stride,
    /// Integrator and spool after an exact step, and above zero: what is left to do.
    ExactStep,
}

/// The fields of an input.
pub const INPUTS: [&str; Input::<f64>::COUNT] = Input::<f64>::NAMES;
/// The fields of an exact step.
pub const EXACT_STEP: [&str; 3] = ["integrator", "spool", "more"];

/// A traced function.
#[derive(Debug)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// Its arguments.
    pub arguments: &'static [(&'static str, Kind)],
    /// What it returns.
    pub kind: Kind,
    /// The numbers of what it returns.
    pub results: Vec<Traced>,
}

/// The traced functions of a structure.
#[derive(Debug)]
pub struct Physics {
    /// The recording that they are on.
    pub trace: Trace,
    /// The names of the states; one that is not used where there are none.
    pub states: Vec<String>,
    /// `initial`, `command`, `remember`, `delay`, `observe` and `advance`; `stride_of`, `exact_step`, `turn` and `follow` where
    /// the spool moves in exact steps; `derivative`.
    pub functions: Vec<Function>,
    /// Whether the derivative says all about the states: none remembers a command, none is set where a step ends.
    pub smooth: bool,
}

impl Physics {
    /// Traces `structure` for values of its parameters that `values` records. `exact_steps` says whether its spool moves in exact steps.
    pub fn new(
        structure: &Structure,
        exact_steps: bool,
        values: impl FnOnce(&Trace) -> Complete<Traced>,
    ) -> Self {
        let mut trace = Trace::start();
        let values = values(&trace);
        let (functions, smooth) = traced(structure, exact_steps, &values, &mut trace);
        let mut states = structure.states();
        if states.is_empty() {
            states.push("unused".into());
        }
        Self {
            trace,
            states,
            functions,
            smooth,
        }
    }

    /// The function called `name`.
    ///
    /// # Panics
    /// If the structure has none of this name.
    pub fn function(&self, name: &str) -> &Function {
        let found = self.functions.iter().find(|function| function.name == name);
        found.unwrap_or_else(|| panic!("no function {name} was traced"))
    }
}

fn traced(
    structure: &Structure,
    exact_steps: bool,
    values: &Complete<Traced>,
    trace: &mut Trace,
) -> (Vec<Function>, bool) {
    let names = structure.states();
    let plant = Plant::new(structure, values);
    trace.seal();

    let state = state_of("state", &names, trace);
    let now = input(trace, "input");
    let position = trace.read("position");
    let step = trace.read("step");
    let arrived = trace.read("arrived");

    let mut measured = Outputs::all(Traced::constant(0.0));
    measured[Output::Position] = position;
    let initial: [Traced; MOST_STATES] = plant.initial(&now, &measured);
    let mut remembered = state;
    let command = plant.command(&mut remembered, arrived);
    let delay = plant.delay().unwrap_or(Traced::constant(0.0));
    let observed = plant.observe(&state, &now);
    let inputs = ["start", "middle", "end"].map(|when| input(trace, when));
    let mut moved = state;
    RungeKutta::new().advance(&plant, &mut moved, inputs.each_ref(), step);

    let padded = |values| padded(values, &names);
    const INPUT: (&str, Kind) = ("input", Kind::Input);
    const ARRIVED: (&str, Kind) = ("arrived", Kind::Real);
    let mut functions = vec![
        function(
            "initial",
            &[PLANT, INPUT, ("position", Kind::Real)][..],
            Kind::State,
            padded(initial),
        ),
        function(
            "command",
            &[PLANT, STATE, ARRIVED],
            Kind::Real,
            vec![command],
        ),
        function(
            "remember",
            &[PLANT, STATE, ARRIVED],
            Kind::State,
            padded(remembered),
        ),
        function("delay", &[PLANT], Kind::Real, vec![delay]),
        function(
            "observe",
            &[PLANT, STATE, INPUT],
            Kind::Outputs,
            observed.0.to_vec(),
        ),
        function(
            "advance",
            &[
                PLANT,
                STATE,
                ("start", Kind::Input),
                ("middle", Kind::Input),
                ("end", Kind::Input),
                ("step", Kind::Real),
            ],
            Kind::State,
            padded(moved),
        ),
    ];
    if exact_steps {
        functions.extend(of_exact_steps(trace, structure, &plant, &state, step));
    }
    let slip_direction = plant.slip_direction(&state, &now);
    let stage = Stage {
        slip_direction,
        ..Stage::first(now.command, now.time)
    };
    let mut slope = [Traced::constant(0.0); MOST_STATES];
    plant.derivative(&state, &now, &stage, &mut slope);
    functions.push(function(
        "derivative",
        &[PLANT, STATE, INPUT],
        Kind::State,
        padded(slope),
    ));
    let after = state_of("after", &names, trace);
    let mut settled = after;
    plant.end_step(&state, &mut settled, [&now, &now], slip_direction, step);
    (functions, remembered == state && settled == after)
}

const PLANT: (&str, Kind) = ("plant", Kind::Plant);
const STATE: (&str, Kind) = ("state", Kind::State);

fn function(
    name: &'static str,
    arguments: &'static [(&'static str, Kind)],
    kind: Kind,
    results: Vec<Traced>,
) -> Function {
    Function {
        name,
        arguments,
        kind,
        results,
    }
}

/// The states that have these names; one that is not used where there are none.
fn padded(values: [Traced; MOST_STATES], names: &[String]) -> Vec<Traced> {
    match names.is_empty() {
        true => vec![Traced::constant(0.0)],
        false => values[..names.len()].to_vec(),
    }
}

/// What a spool that moves in exact steps has besides, from `state` on: the steps, and what follows them.
fn of_exact_steps(
    trace: &Trace,
    structure: &Structure,
    plant: &Plant<Traced>,
    state: &[Traced; MOST_STATES],
    step: Traced,
) -> [Function; 4] {
    let names = structure.states();
    let [stride, exact_step, turn] = exact_steps_of(trace, structure, plant);
    let mut after = state_of("after", &names, trace);
    let [start, middle, end] = ["start", "middle", "end"].map(|when| input(trace, when));
    let actuator = actuator_of(structure, plant);
    if let Some(mut course) = Course::at(plant, state, &start) {
        let before = Place::of(state);
        course.follow(plant, actuator, before, &mut after, [&middle, &end], step);
    }
    const STRIDE: (&str, Kind) = ("stride", Kind::Stride);
    const RUNS: [(&str, Kind); 2] = [("command", Kind::Real), ("ramp", Kind::Real)];
    [
        function(
            "stride_of",
            &[PLANT, ("length", Kind::Real)],
            Kind::Stride,
            stride,
        ),
        function(
            "exact_step",
            &[PLANT, STRIDE, STATE, RUNS[0], RUNS[1]],
            Kind::ExactStep,
            exact_step,
        ),
        function(
            "turn",
            &[PLANT, STRIDE, STATE, RUNS[0], RUNS[1], ("left", Kind::Real)],
            Kind::ExactStep,
            turn,
        ),
        function(
            "follow",
            &[
                PLANT,
                STATE,
                ("after", Kind::State),
                ("start", Kind::Input),
                ("middle", Kind::Input),
                ("end", Kind::Input),
                ("step", Kind::Real),
            ],
            Kind::State,
            padded(after, &names),
        ),
    ]
}

/// What drives the model, read from the fields of `argument`.
fn input(trace: &Trace, argument: &str) -> Input<Traced> {
    Input::from_names(|field| trace.read(format!("{argument}.{field}")))
}

/// The states, read from the fields `names` of `argument`.
fn state_of(argument: &str, names: &[String], trace: &Trace) -> [Traced; MOST_STATES] {
    let mut state = [Traced::constant(0.0); MOST_STATES];
    for (own, name) in state.iter_mut().zip(names) {
        *own = trace.read(format!("{argument}.{name}"));
    }
    state
}

fn actuator_of<'a>(structure: &Structure, plant: &'a Plant<Traced>) -> &'a Actuator<Traced> {
    let actuator = plant.exact_step::<MOST_STATES>(structure);
    actuator.expect("a model that moves so")
}

/// The results of `stride_of`, `exact_step` and `turn`.
fn exact_steps_of(trace: &Trace, structure: &Structure, plant: &Plant<Traced>) -> [Vec<Traced>; 3] {
    let [length, command, left, ramp] =
        ["length", "command", "left", "ramp"].map(|name| trace.read(name));
    let stride = Stride::from_numbers(
        Stride::<Traced>::NAMES.map(|name| trace.read(format!("stride.{name}"))),
    );
    let from = Place {
        integrator: trace.read("state.integrator"),
        spool: trace.read("state.spool"),
    };
    let ramp = structure.hold.is_straight().then_some(ramp);
    let actuator = actuator_of(structure, plant);
    let results =
        |(place, more): (Place<Traced>, Traced)| vec![place.integrator, place.spool, more];
    [
        actuator.stride(length).numbers().to_vec(),
        results(actuator.exact_step(&stride, from, command, ramp)),
        results(actuator.turn(&stride, from, command, ramp, left)),
    ]
}
