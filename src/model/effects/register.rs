//! What is asked of an effect of a user's own before it is known.

use super::own::{Law, REGISTERED, Registered};
use super::{Act, CATALOGUE, Entry};
use crate::model::real::trace::{OTHER_NAME, is_writable, not_writable};
use crate::model::valve::{Meter, ValveForm};
use crate::model::{Initial, MOST_STATES, Output, Parameter, ServoValve, Structure};
use crate::{Error, Result};

/// Adds an effect to those of this process: [`entry`](super::entry()) and model files know it from then on, every evaluator
/// computes it, the polish differentiates it, and a diagnosis whose [`Options`](crate::diagnose::Options) list it looks for
/// it. It acts after the effects of [`CATALOGUE`] at its port.
///
/// A structure has at most 77 states. The base model and the catalogue can take 71 of them; 6 are for all effects that are
/// registered, where one that acts on one output at a time takes its states three times, once for each.
///
/// # Errors
/// There is an effect of this name already, or a parameter of the name of one of its own; a parameter or a state has a name that
/// WGSL, C or Modelica do not allow; it has more states than are left; it
/// delays the command.
pub fn register<L: Law>(entry: Entry) -> Result<&'static Entry> {
    let refuse = |problem: String, remedy: &str| {
        let place = format!("effect {:?}", entry.name);
        Err(Error::input(place, problem, remedy))
    };
    let everything = everything();
    let mut taken: Vec<String> = names(everything.parameters());
    let scale = everything.generic_scale();
    let on = |output| names((entry.parameters)(&scale, output));
    let own: Vec<String> = outputs(&entry).into_iter().flat_map(on).collect();
    let mut registered = REGISTERED.write().expect("no panic while it is held");
    let mut known = CATALOGUE
        .iter()
        .copied()
        .chain(registered.iter().map(|own| own.entry));
    if known.any(|known| known.name == entry.name) {
        return refuse(
            "is in the catalogue already".into(),
            "give it another name, and register it once",
        );
    }
    taken.extend(registered.iter().flat_map(|own| own.parameters.clone()));
    let mut written = own
        .iter()
        .map(String::as_str)
        .chain(entry.states.iter().copied());
    if let Some(name) = written.find(|name| !is_writable(name)) {
        return refuse(not_writable(name), OTHER_NAME);
    }
    for name in &own {
        // Values are matched by name.
        if taken.contains(name) {
            return refuse(
                format!("has a parameter {name:?}, and there is one of this name already"),
                "give each parameter a name of its own, on each output that it can act on",
            );
        }
        taken.push(name.clone());
    }
    let others = registered.iter().map(|own| states(own.entry));
    let left = MOST_STATES.saturating_sub(everything.states().len() + others.sum::<usize>());
    if states(&entry) > left {
        return refuse(
            format!(
                "takes {} states, and {left} are left of the {MOST_STATES} that a structure can have",
                states(&entry)
            ),
            "give it fewer",
        );
    }
    let mut starts = (entry.parameters)(&scale, outputs(&entry)[0]).into_iter();
    let mut next = || starts.next().map_or(0.0, |parameter| parameter.nominal());
    if L::act::<f64>(&mut next).delay().is_some() {
        return refuse(
            "delays the command, which only the catalogue's delay can".into(),
            "leave Act::delay as it is",
        );
    }
    let new = Registered::new::<L>(entry, own);
    let entry = new.entry;
    registered.push(new);
    Ok(entry)
}

/// The outputs that an effect can be on, as far as its entry says it without a structure.
fn outputs(entry: &Entry) -> Vec<Option<Output>> {
    match entry.outputs {
        None => vec![None],
        Some(_) => Output::ALL.map(Some).to_vec(),
    }
}

/// The states that an effect takes at most.
fn states(entry: &Entry) -> usize {
    entry.states.len() * outputs(entry).len()
}

fn names(parameters: Vec<Parameter>) -> Vec<String> {
    parameters.into_iter().map(|one| one.name).collect()
}

/// A structure with every part that has states, and with every effect of the catalogue.
fn everything() -> Structure {
    let bare = Structure {
        observed: vec![Output::Spool, Output::Flow, Output::Position],
        initial: Initial::Free,
        base: ServoValve {
            spool_unit: Some("%".into()),
            ..ServoValve::with(ValveForm {
                meter: Meter::Supply,
                ..ValveForm::linear()
            })
        }
        .into(),
        ..Structure::actuator(10.0, "V")
    };
    let effects = CATALOGUE.iter().flat_map(|entry| entry.on(&bare));
    let effects = effects.collect();
    Structure { effects, ..bare }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_catalogue_leaves_states_and_gives_each_of_them_and_each_parameter_a_name_of_its_own() {
        let everything = everything();
        let (taken, most) = (everything.states().len(), MOST_STATES);
        let (all, left) = (format!("at most {most} states"), most - taken);
        let said = format!("the catalogue can take {taken} of them; {left} are for");
        let documentation = include_str!("register.rs");
        let documentation = documentation.split("pub fn register<").next().unwrap();
        for said in [all, said] {
            assert!(documentation.contains(&said), "{said}");
        }
        for mut all in [everything.states(), names(everything.parameters())] {
            let count = all.len();
            all.sort();
            all.dedup();
            assert_eq!(all.len(), count, "{all:?}");
        }
    }
}
