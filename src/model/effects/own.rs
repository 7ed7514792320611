//! Effects of a user's own, from outside this crate.

use super::act::Act;
use super::entry::Entry;
use crate::model::Real;
use crate::model::real::reading::{Readings, for_number, reading};
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

/// An effect of a user's own that this process knows.
pub(super) struct Registered {
    pub(super) entry: &'static Entry,
    /// Names of its parameters, on each output that it can act on.
    pub(super) parameters: Vec<String>,
    readings: Readings,
}

impl Registered {
    pub(super) fn new<L: Law>(entry: Entry, parameters: Vec<String>) -> Self {
        Self {
            entry: Box::leak(Box::new(entry)),
            parameters,
            readings: |number| for_number!(number, R => make::<L, R> as Make<R>),
        }
    }
}

pub(super) static REGISTERED: RwLock<Vec<Registered>> = RwLock::new(Vec::new());

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

fn make<L: Law, R: Real>(next: &mut dyn FnMut() -> R) -> Own<R> {
    Own(Rc::new(L::act(next)))
}
