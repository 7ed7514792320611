//! What makes problems the same one, for everything that is kept of them.

use crate::evaluate::problem::{Data, Problem};
use std::sync::{Arc, Weak};

/// What makes models the same: the structure, the names of its parameters, which of them are fixed, and the loss. The
/// parameters' values and bounds may differ.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ModelIdentity(String);

impl ModelIdentity {
    /// That of `problem`'s model.
    pub fn of(problem: &Problem) -> Self {
        let parameters = problem.parameters.iter().map(|p| (&p.name, p.is_fixed()));
        // A loss is told the sizes of the noise, which the scale gives.
        let loss = problem.loss.map(|loss| (loss.name(), problem.scale));
        Self(format!(
            "{:?} {:?} {loss:?}",
            problem.structure,
            parameters.collect::<Vec<_>>()
        ))
    }

    /// It as text, the same on every machine.
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// What makes shaders the same: the model, and what of the data its loops are written for. Tracing the physics takes as long
/// as thousands of candidates do on a fast device; this does not.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ShaderIdentity {
    model: ModelIdentity,
    exact_steps: bool,
    even: bool,
}

impl ShaderIdentity {
    /// That of `problem`'s shader.
    pub fn of(problem: &Problem) -> Self {
        Self {
            model: ModelIdentity::of(problem),
            exact_steps: problem.has_exact_steps(),
            even: problem.is_even(),
        }
    }
}

/// Data in memory. It stays this data's as long as the identity is kept, also after the data is gone.
#[derive(Debug, Clone)]
pub struct DataIdentity(Weak<Data>);

impl DataIdentity {
    /// That of `data`.
    pub fn of(data: &Arc<Data>) -> Self {
        Self(Arc::downgrade(data))
    }

    /// Whether anybody can still ask for the data.
    pub fn is_alive(&self) -> bool {
        self.0.strong_count() > 0
    }
}

impl PartialEq for DataIdentity {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}

impl Eq for DataIdentity {}

impl std::hash::Hash for DataIdentity {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.as_ptr().hash(state);
    }
}

/// What makes problems the same: the model and the data.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Identity {
    /// The model's.
    pub model: ModelIdentity,
    /// The data's.
    pub data: DataIdentity,
}

impl Identity {
    /// That of `problem`.
    pub fn of(problem: &Problem) -> Self {
        Self {
            model: ModelIdentity::of(problem),
            data: DataIdentity::of(&problem.data),
        }
    }
}
