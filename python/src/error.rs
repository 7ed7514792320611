//! Errors as exceptions, with the same words.

use pyo3::prelude::*;

/// The exception for `error`: what was given is wrong, or the run has failed.
pub(crate) fn raised(py: Python<'_>, error: servobee::Error) -> PyErr {
    let said = error.to_string();
    let (class, parts) = match error {
        servobee::Error::Input {
            place,
            problem,
            remedy,
        } => ("InputError", [place, problem, remedy]),
        servobee::Error::Failed { problem, remedy } => {
            ("RunError", [String::new(), problem, remedy])
        }
        servobee::Error::Unmet { problem, which } => ("RunError", [String::new(), problem, which]),
    };
    let [place, problem, remedy] = parts;
    let made = py
        .import("servobee._errors")
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call1((said, place, problem, remedy)));
    match made {
        Ok(made) => PyErr::from_value(made),
        Err(error) => error,
    }
}

/// The exception for what was given wrongly.
pub(crate) fn refused(py: Python<'_>, place: &str, problem: &str, remedy: &str) -> PyErr {
    raised(py, servobee::Error::input(place, problem, remedy))
}
