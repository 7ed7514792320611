//! Modelica: the equations of the structure, or where it has memory, the steps that the simulation takes.

mod text;

use super::{Input, Model, inputs};
use crate::evaluate::physics::{INPUTS, Physics};
use crate::model::integrate::STEP_FRACTION;
use crate::model::real::Traced;
use crate::model::real::trace::{Language, Modelica, Trace};
use crate::model::{Output, Parameter};
use std::fmt::Write;
use text::{Context, function_text, parameter_text, unit_text};

/// The name of the class: with a capital, so that it is no keyword.
pub fn class_name(model: &Model) -> String {
    let (first, rest) = model.name.split_at(1);
    first.to_uppercase() + rest
}

/// A self-contained model, `when` and `der` as the structure needs them.
pub fn modelica(model: &Model) -> String {
    let read = |trace: &Trace| {
        let value = |parameter: &Parameter| {
            let value = trace.read(Modelica::label(parameter.name.clone()));
            trace.name(value, &parameter.name);
            value
        };
        model.parameters.iter().map(value).collect()
    };
    let mut physics = Physics::new(&model.structure, false, read);
    let smooth = physics.smooth;
    let (functions, sections) = match smooth {
        true => continuous(model, &mut physics),
        false => sampled(model, &mut physics),
    };
    let inputs = inputs(&model.structure, &physics);
    let (names, prepare) = physics.trace.plant::<Modelica>();
    let mut text = format!("model {} \"{}\"\n", class_name(model), model.summary());
    text += match smooth {
        true => {
            "  // Traced from the equations of servobee. Inputs act as they are: servobee's simulation holds or\n  \
             // interpolates them between the rows of a record, a Modelica source decides that itself.\n"
        }
        false => {
            "  // Traced from the equations of servobee. The structure has memory, or is set where an integration step\n  \
             // ends, which no differential equation says: the model makes servobee's integration steps at sample times.\n  \
             // Inputs are read and held at these; a smaller interval follows them, and all else, more closely.\n"
        }
    };
    text += &functions;
    for parameter in model.settings() {
        text += &parameter_text(&parameter);
    }
    for Input { name, unit, .. } in &inputs {
        let unit = unit_text(unit);
        let _ = writeln!(text, "  input Real {name}(unit = \"{unit}\");");
    }
    for &output in &model.structure.observed {
        let (name, unit) = (output.name(), unit_text(model.structure.unit(output)));
        let _ = writeln!(text, "  output Real simulated_{name}(unit = \"{unit}\");");
    }
    text += "protected\n";
    let fields = names.into_iter().zip(prepare.results);
    for (name, expression) in prepare.locals.into_iter().chain(fields) {
        // A parameter that is read as it is needs no second name.
        if name != expression {
            let _ = writeln!(text, "  final parameter Real {name} = {expression};");
        }
    }
    text += &sections;
    let _ = writeln!(text, "end {};", class_name(model));
    text
}

/// The fields of the argument `argument`, an input, each with what `value` makes of the name and place of its channel.
fn input_fields(argument: &str, value: impl Fn(&str, usize) -> String) -> Vec<(String, String)> {
    let names = super::variable::CHANNELS.iter().chain(&["time"]);
    INPUTS
        .iter()
        .zip(names)
        .enumerate()
        .map(|(place, (field, name))| (format!("{argument}.{field}"), value(name, place)))
        .collect()
}

/// The command on its arrival.
fn arrived(model: &Model) -> String {
    match model.structure.delays() {
        true => "delay(command, dead_time)".into(),
        false => "command".into(),
    }
}

/// Functions, and the sections of equations, of a structure whose derivative says all.
fn continuous(model: &Model, physics: &mut Physics) -> (String, String) {
    let has_states = !model.structure.states().is_empty();
    let mut results: Vec<Traced> = physics.function("command").results.clone();
    let observed = &physics.function("observe").results;
    results.extend(
        model
            .structure
            .observed
            .iter()
            .map(|&output| observed[output as usize]),
    );
    if has_states {
        results.extend(&physics.function("derivative").results);
    }
    let initial = physics.function("initial").results.clone();
    let body = physics.trace.function::<Modelica>(&results);
    let initial = physics.trace.function::<Modelica>(&initial);

    let states = &physics.states;
    let own = states
        .iter()
        .map(|name| (format!("state.{name}"), name.clone()));
    let acting = |name: &str, place: usize| match place {
        0 => "acting_command".to_owned(),
        _ => name.to_owned(),
    };
    let mut pairs = input_fields("input", acting);
    pairs.push(("arrived".into(), arrived(model)));
    let context = Context::new(pairs.into_iter().chain(own));
    let mut pairs = input_fields("input", |name, _| name.to_owned());
    pairs.push(("position".into(), "initial_position".into()));
    let first = Context::new(pairs);

    let mut functions = String::new();
    let mut text = String::from("  Real acting_command \"The command as it acts\";\n");
    for name in states.iter().filter(|_| has_states) {
        let _ = writeln!(text, "  Real {name};");
    }
    for (name, _) in &body.locals {
        let _ = writeln!(text, "  Real {name};");
    }
    if has_states {
        text += "initial equation\n";
        if initial.locals.is_empty() {
            for (name, expression) in states.iter().zip(&initial.results) {
                let _ = writeln!(text, "  {name} = {};", first.put(expression));
            }
        } else {
            functions = function_text(
                "start_state",
                "The states at the first moment",
                &initial,
                false,
            );
            let _ = writeln!(
                text,
                "  {} = {};",
                format_args!("{{{}}}", states.join(", ")),
                first.call("start_state", &initial)
            );
        }
    }
    text += "equation\n";
    for (name, expression) in &body.locals {
        let _ = writeln!(text, "  {name} = {};", context.put(expression));
    }
    let outputs = model
        .structure
        .observed
        .iter()
        .map(|o| format!("simulated_{}", o.name()));
    let left = std::iter::once("acting_command".to_owned())
        .chain(outputs)
        .chain(states.iter().map(|name| format!("der({name})")));
    for (left, right) in left.zip(&body.results) {
        let _ = writeln!(text, "  {left} = {};", context.put(right));
    }
    (functions, text)
}

/// Functions, and the sections of equations, of a structure that goes in steps.
fn sampled(model: &Model, physics: &mut Physics) -> (String, String) {
    let mut functions = String::new();
    let mut body = |name: &str, called: &str, what: &str| {
        let results = physics.function(name).results.clone();
        let body = physics.trace.function::<Modelica>(&results);
        functions += &function_text(called, what, &body, name == "command");
        body
    };
    let initial = body("initial", "start_state", "The states at the first moment");
    let command = body("command", "acting", "The command as it acts");
    let remember = body(
        "remember",
        "remembering",
        "The states when a command has arrived",
    );
    let advance = body(
        "advance",
        "advanced",
        "The states after an integration step",
    );
    let observe = body("observe", "observed", "The outputs as they are measured");

    let states = &physics.states;
    let count = states.len();
    let place = |what: &str| {
        let pair =
            |(i, name): (usize, &String)| (format!("state.{name}"), format!("{what}[{}]", i + 1));
        states.iter().enumerate().map(pair).collect::<Vec<_>>()
    };
    let before = |name: &str, place: usize| match place {
        0 => "pre(acting_command)".to_owned(),
        6 => "(time - interval)".to_owned(),
        _ => format!("pre(held_{name})"),
    };
    let mut pairs = ["start", "middle", "end"]
        .map(|argument| input_fields(argument, before))
        .concat();
    pairs.push(("step".into(), "interval".into()));
    let step = Context::new(
        pairs.into_iter().chain(
            states
                .iter()
                .enumerate()
                .map(|(i, name)| (format!("state.{name}"), format!("pre(state[{}])", i + 1))),
        ),
    );
    let mut pairs = input_fields("input", |name, _| name.to_owned());
    pairs.push(("position".into(), "initial_position".into()));
    let first = Context::new(pairs);
    let arrival = Context::new(
        place("moved")
            .into_iter()
            .chain([("arrived".into(), "arrived_command".into())]),
    );
    let acting = |name: &str, place: usize| match place {
        0 => "acting_command".to_owned(),
        _ => name.to_owned(),
    };
    let now = Context::new(
        input_fields("input", acting)
            .into_iter()
            .chain(place("state")),
    );

    let rate = model.structure.fastest_rate(&model.parameters);
    let interval = if rate > 0.0 {
        (STEP_FRACTION / rate).min(1e-3)
    } else {
        1e-3
    };
    let mut text = format!(
        "public\n  parameter Real interval(unit = \"s\") = {interval:?} \"Time between two steps\";\nprotected\n  \
         Real arrived_command;\n  discrete Boolean begun(start = false, fixed = true);\n  \
         discrete Real acting_command(start = 0.0, fixed = true) \"The command as it acts\";\n  \
         // {}\n  discrete Real state[{count}](each start = 0.0, each fixed = true);\n  \
         discrete Real moved[{count}](each start = 0.0, each fixed = true);\n  \
         discrete Real seen[{outputs}](each start = 0.0, each fixed = true);\n",
        states.join(", "),
        outputs = Output::COUNT
    );
    let held: Vec<Input> = inputs(&model.structure, physics)
        .into_iter()
        .filter(|input| input.place > 0)
        .collect();
    for Input { name, .. } in &held {
        let _ = writeln!(
            text,
            "  discrete Real held_{name}(start = 0.0, fixed = true);"
        );
    }
    let _ = write!(
        text,
        "equation\n  arrived_command = {};\n  when sample(0.0, interval) then\n    begun = true;\n    \
         moved = if pre(begun) then {} else {};\n    acting_command = {};\n    state = {};\n    seen = {};\n",
        arrived(model),
        step.call("advanced", &advance),
        first.call("start_state", &initial),
        arrival.call("acting", &command),
        arrival.call("remembering", &remember),
        now.call("observed", &observe),
    );
    for Input { name, .. } in &held {
        let _ = writeln!(text, "    held_{name} = {name};");
    }
    text += "  end when;\n";
    for &output in &model.structure.observed {
        let number = Output::ALL
            .iter()
            .position(|o| *o == output)
            .expect("one of them")
            + 1;
        let _ = writeln!(text, "  simulated_{} = seen[{number}];", output.name());
    }
    (functions, text)
}
