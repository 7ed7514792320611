//! C: the traced physics, and the loop that goes from one communication point to the next as the simulation does.

use super::{Model, inputs};
use crate::evaluate::STATE_LIMIT;
use crate::evaluate::physics::{EXACT_STEP, Function, INPUTS, Kind, Physics};
use crate::evaluate::problem::JITTER;
use crate::model::exact_step::{MOST_PARTS, Stride};
use crate::model::integrate::STEP_FRACTION;
use crate::model::real::Traced;
use crate::model::real::trace::{Body, C, Trace};
use crate::model::{Complete, Output};
use std::fmt::{Display, Write};

/// From one communication point to the next: the twin of `evaluate::simulate`.
pub const TRAVEL: &str = include_str!("c/travel.c");

/// The physics of a model as C, and what drives it.
#[derive(Debug)]
pub struct Source {
    /// Structs, constants and functions.
    pub text: String,
    /// Its inputs.
    pub inputs: Vec<super::Input>,
}

/// A program text with the model's physics and the loop around it, to be included where a valve is simulated.
pub fn program(model: &Model) -> String {
    let name = &model.name;
    format!(
        "/* {}.\n\n   double values[INPUT_COUNT + PARAMETER_COUNT];    inputs, then parameters; START has the fitted values\n   \
         Model {name} = {{ 0 }};\n   {name}.plant = prepare(values + INPUT_COUNT);\n   \
         {name}.state = initial({name}.plant, input_of(values, 0.0), initial_position(values + INPUT_COUNT));\n   \
         Outputs now = look(&{name}, input_of(values, time), time);\n   \
         travel(&{name}, input_of(values, time), input_of(values, time + step), time, step);\n*/\n\n{}\n{TRAVEL}",
        model.summary(),
        physics(model).text
    )
}

/// The physics of `model`.
pub fn physics(model: &Model) -> Source {
    let structure = &model.structure;
    let exact_steps = structure.has_exact_steps();
    let read = |trace: &Trace| {
        let value = |i| trace.read(format!("parameters[{i}]"));
        let values: Complete<Traced> = (0..model.parameters.len()).map(value).collect();
        for (parameter, value) in model.parameters.iter().zip(values.as_slice()) {
            trace.name(*value, &parameter.name);
        }
        values
    };
    let mut physics = Physics::new(structure, exact_steps, read);
    let mut functions = String::new();
    for function in &physics.functions {
        if function.name != "derivative" {
            let body = physics.trace.function::<C>(&function.results);
            functions += &format!("\n{}", function_text(function, &body));
        }
    }
    let (mut fields, mut prepare) = physics.trace.plant::<C>();
    if fields.is_empty() {
        fields.push("unused".into());
        prepare.results.push("0.0".into());
    }
    let inputs = inputs(structure, &physics);

    let mut text = String::from(
        "/* Traced from the equations of servobee: not to be edited, but exported again. */\n\n#include <math.h>\n\
         #include <stdlib.h>\n#include <string.h>\n\n#undef min\n#undef max\n\n",
    );
    text += &constants(model, exact_steps);
    text += &variables(model, &inputs);
    for (name, fields) in [
        ("Plant", fields),
        ("State", physics.states.clone()),
        ("Input", INPUTS.map(String::from).to_vec()),
        ("Outputs", Output::ALL.map(|o| o.name().into()).to_vec()),
        ("Stride", Stride::<Traced>::NAMES.map(String::from).to_vec()),
        ("ExactStep", EXACT_STEP.map(String::from).to_vec()),
    ] {
        text += &struct_text(name, &fields);
    }
    text += "static double min(double a, double b)\n{\n    return a < b ? a : b;\n}\n\n\
             static double max(double a, double b)\n{\n    return a > b ? a : b;\n}\n\n";
    text += &input_text(&inputs);
    text += &setting_text(model);
    text += &diverged_text(&physics.states);
    let _ = write!(
        text,
        "static Plant prepare(const double *parameters)\n{{\n{}}}\n{functions}",
        body_text("Plant", &prepare)
    );
    Source { text, inputs }
}

fn constants(model: &Model, exact_steps: bool) -> String {
    let structure = &model.structure;
    let flag = i32::from;
    let rate = structure.fastest_rate(&model.parameters);
    format!(
        "/* Whether inputs go straight from one communication point to the next, instead of being held. */\n\
         #define INTERPOLATED {}\n/* Whether the command arrives late. */\n#define DELAYED {}\n\
         /* Whether the spool moves in exact steps, or in integration steps. */\n#define EXACT_STEPS {}\n\
         /* Whether something follows the spool. */\n#define FOLLOWED {}\n\
         /* The fastest rate inside the bounds of the parameters, 1/s, and which share of its time a step lasts. */\n\
         #define FASTEST_RATE {rate:?}\n#define STEP_FRACTION {STEP_FRACTION:?}\n\
         /* How many of them an exact step takes the place of, at most, and in how many parts. */\n\
         #define STEPS_OF_AN_EXACT_STEP {}u\n#define MOST_PARTS {MOST_PARTS}u\n\
         /* How much of a step may be rounding of the time. */\n#define JITTER {JITTER:?}\n\
         /* What is larger has diverged. */\n#define STATE_LIMIT {STATE_LIMIT:?}\n\n",
        flag(structure.hold.is_straight()),
        flag(structure.delays()),
        flag(exact_steps),
        flag(structure.has_followers()),
        structure.steps_of_an_exact_step(),
    )
}

/// The numbers and value references of inputs, parameters and outputs.
fn variables(model: &Model, inputs: &[super::Input]) -> String {
    let settings = model.settings();
    let mut text = String::from("/* Value references: inputs, parameters, outputs.\n");
    let named = inputs.iter().map(|input| (input.name, input.unit.as_str()));
    let named = named.chain(settings.iter().map(|p| (p.name.as_str(), p.unit.as_str())));
    let outputs = &model.structure.observed;
    let named = named.chain(outputs.iter().map(|&o| (o.name(), model.structure.unit(o))));
    for (number, (name, unit)) in named.enumerate() {
        let _ = writeln!(text, "   {number:3}  {name} [{unit}]");
    }
    let list = |values: &mut dyn Iterator<Item = f64>| {
        let mut values: Vec<String> = values.map(|value| format!("{value:?}")).collect();
        if values.is_empty() {
            values.push("0.0".into());
        }
        values.join(", ")
    };
    let start = inputs.iter().map(|_| 0.0);
    let _ = write!(
        text,
        "*/\nenum {{ INPUT_COUNT = {}, PARAMETER_COUNT = {}, OUTPUT_COUNT = {} }};\n\
         static const double START[INPUT_COUNT + PARAMETER_COUNT] = {{ {} }};\nstatic const double LOW[PARAMETER_COUNT + 1] = {{ {} }};\n\
         static const double HIGH[PARAMETER_COUNT + 1] = {{ {} }};\n\n",
        inputs.len(),
        settings.len(),
        outputs.len(),
        list(&mut start.chain(settings.iter().map(|p| p.nominal()))),
        list(&mut settings.iter().map(|p| p.low)),
        list(&mut settings.iter().map(|p| p.high)),
    );
    text
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Real => "double",
        Kind::Plant => "Plant",
        Kind::State => "State",
        Kind::Input => "Input",
        Kind::Outputs => "Outputs",
        Kind::Stride => "Stride",
        Kind::ExactStep => "ExactStep",
    }
}

fn function_text(function: &Function, body: &Body) -> String {
    let arguments: Vec<String> = function
        .arguments
        .iter()
        .map(|&(name, kind)| format!("{} {name}", type_name(kind)))
        .collect();
    let result = type_name(function.kind);
    format!(
        "static {result} {}({})\n{{\n{}}}\n",
        function.name,
        arguments.join(", "),
        body_text(result, body)
    )
}

/// Local numbers, and the return of a value of this type.
fn body_text(result: &str, body: &Body) -> String {
    let mut text = String::new();
    for (name, expression) in &body.locals {
        let _ = writeln!(text, "    const double {name} = {expression};");
    }
    let results = body.results.join(", ");
    let _ = match result {
        "double" => writeln!(text, "    return {results};"),
        _ => writeln!(text, "    return ({result}){{ {results} }};"),
    };
    text
}

fn struct_text<T: Display>(name: &str, fields: &[T]) -> String {
    let fields: Vec<String> = fields.iter().map(T::to_string).collect();
    format!(
        "typedef struct {{\n    double {};\n}} {name};\n\n",
        fields.join(", ")
    )
}

/// Which variable is which input.
fn input_text(inputs: &[super::Input]) -> String {
    let mut fields = INPUTS.map(|_| "0.0".to_owned());
    for (number, input) in inputs.iter().enumerate() {
        fields[input.place] = format!("values[{number}]");
    }
    fields[INPUTS.len() - 1] = "time".into();
    format!(
        "static Input input_of(const double *values, double time)\n{{\n    return (Input){{ {} }};\n}}\n\n",
        fields.join(", ")
    )
}

/// Which parameter is where a piston starts, and which number is which output.
fn setting_text(model: &Model) -> String {
    let structure = &model.structure;
    let position = match structure.integrates_position() {
        true => format!("parameters[{}]", model.parameters.len()),
        false => "0.0".into(),
    };
    let mut cases = String::new();
    for (number, output) in structure.observed.iter().enumerate() {
        let _ = writeln!(
            cases,
            "    case {number}: return outputs.{};",
            output.name()
        );
    }
    format!(
        "static double initial_position(const double *parameters)\n{{\n    (void)parameters;\n    return {position};\n}}\n\n\
         static double output_of(Outputs outputs, unsigned number)\n{{\n    switch (number) {{\n{cases}    \
         default: return NAN;\n    }}\n}}\n\n"
    )
}

fn diverged_text(states: &[String]) -> String {
    let tests: Vec<String> = states
        .iter()
        .map(|name| format!("!(fabs(state.{name}) < STATE_LIMIT)"))
        .collect();
    format!(
        "static int diverged(State state)\n{{\n    return {};\n}}\n\n",
        tests.join(" || ")
    )
}
