//! What is asked of a base model of a user's own before it is known.

use super::{Base, OwnBase, WithEquations};
use crate::model::Structure;
use crate::model::declare::Listing;
use crate::model::real::trace::{OTHER_NAME, is_writable, not_writable};
use crate::{Error, Result};

/// Makes a base model known to this process: a structure can have it, model files name it, every evaluator computes it
/// and the polish differentiates it. It is described by its default value.
///
/// # Errors
/// There is a base model of this name already; a parameter or a state has a name that WGSL, C or Modelica do not allow.
pub fn register_base<B>() -> Result<OwnBase>
where
    B: WithEquations + Default,
{
    let base = B::default();
    let name = base.name();
    let bench = Structure::actuator(1.0, "V");
    let mut listing = Listing::default();
    base.equations::<f64>(&bench.setting(), &mut listing);
    let parameters = listing.0.iter().map(|parameter| parameter.name.as_str());
    let mut names = parameters.chain(base.states(&bench.setting()));
    if let Some(own) = names.find(|name| !is_writable(name)) {
        return Err(Error::input(
            format!("base model {name:?}"),
            not_writable(own),
            OTHER_NAME,
        ));
    }
    let own = match Base::built_in(name) {
        Some(_) => None,
        None => OwnBase::register(base),
    };
    own.ok_or_else(|| {
        Error::input(
            format!("base model {name:?}"),
            "is there already",
            "give it another name, and register it once",
        )
    })
}
