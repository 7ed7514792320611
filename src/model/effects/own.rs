//! Effects of a user's own, from outside this crate.

use super::act::Act;
use super::{CATALOGUE, Entry};
use crate::model::Real;
use crate::model::real::reading::{Readings, for_number, reading};
use crate::{Error, Result};
use std::fmt;
use std::rc::Rc;
use std::sync::RwLock;

/// The equation of an effect, for every kind of number.
pub trait Law: 'static {
    /// The effect with values for its parameters.
    type Act<R: Real>: Act<R> + 'static;

    /// The effect with the values that `next` gives, in the order of [`Entry::parameters`].
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Self::Act<R>;
}

type Make<R> = fn(&mut dyn FnMut() -> R) -> Own<R>;

/// An effect of a user's own with values for its parameters.
#[derive(Clone)]
pub(in crate::model) struct Own<R>(pub(super) Rc<dyn Act<R>>);

impl<R> fmt::Debug for Own<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Own")
    }
}

struct Registered {
    entry: &'static Entry,
    readings: Readings,
}

static REGISTERED: RwLock<Vec<Registered>> = RwLock::new(Vec::new());

/// Adds an effect to the catalogue of this process: [`entry`](super::entry) and model files know it from then on, every
/// evaluator computes it, the polish differentiates it, and a diagnosis that is given it looks for it. It acts after the
/// effects of [`CATALOGUE`] at its port.
///
/// # Errors
/// There is an effect of this name already.
pub fn register<L: Law>(entry: Entry) -> Result<&'static Entry> {
    let mut registered = REGISTERED.write().expect("no panic while it is held");
    let mut names = CATALOGUE
        .iter()
        .copied()
        .chain(registered.iter().map(|own| own.entry))
        .map(|known| known.name);
    if names.any(|name| name == entry.name) {
        return Err(Error::input(
            format!("effect {:?}", entry.name),
            "is in the catalogue already",
            "give it another name, and register it once",
        ));
    }
    let entry: &'static Entry = Box::leak(Box::new(entry));
    registered.push(Registered {
        entry,
        readings: |number| for_number!(number, R => make::<L, R> as Make<R>),
    });
    Ok(entry)
}

fn make<L: Law, R: Real>(next: &mut dyn FnMut() -> R) -> Own<R> {
    Own(Rc::new(L::act(next)))
}

/// The entries that have been registered, in this order.
pub(super) fn registered() -> Vec<&'static Entry> {
    let registered = REGISTERED.read().expect("no panic while it is held");
    registered.iter().map(|own| own.entry).collect()
}

impl<R: Real> Own<R> {
    /// The registered effect called `name`.
    pub(super) fn new(name: &str, next: &mut dyn FnMut() -> R) -> Self {
        let make: Make<R> = {
            let registered = REGISTERED.read().expect("no panic while it is held");
            let own = registered.iter().find(|own| own.entry.name == name);
            reading::<R, _>(own.expect("an effect has been registered").readings)
        };
        make(next)
    }
}
