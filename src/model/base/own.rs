//! Base models from outside this crate.

use super::{Base, BaseModel, Equations, WithEquations};
use crate::model::declare::Declare;
use crate::model::ports::Attached;
use crate::model::real::reading::{Readings, for_number, reading};
use crate::model::{Real, Structure};
use crate::{Error, Result};
use std::fmt;
use std::ops::Deref;
use std::rc::Rc;
use std::sync::RwLock;

/// A base model that has been registered.
#[derive(Clone, Copy)]
pub struct OwnBase(&'static Registered);

struct Registered {
    description: Box<dyn BaseModel>,
    readings: Readings,
}

type Make<R> = fn(&Structure, &mut dyn Declare<R>) -> OwnEquations<R>;

static REGISTERED: RwLock<Vec<OwnBase>> = RwLock::new(Vec::new());

/// Makes a base model known to this process: a structure can have it, model files name it, every evaluator computes it
/// and the polish differentiates it. It is described by its default value.
///
/// # Errors
/// There is a base model of this name already.
pub fn register_base<B>() -> Result<OwnBase>
where
    B: WithEquations + Default,
{
    let base = B::default();
    let mut registered = REGISTERED.write().expect("no panic while it is held");
    let name = base.name();
    if Base::built_in(name).is_some() || registered.iter().any(|own| own.name() == name) {
        return Err(Error::input(
            format!("base model {name:?}"),
            "is there already",
            "give it another name, and register it once",
        ));
    }
    let own = OwnBase(Box::leak(Box::new(Registered {
        description: Box::new(base),
        readings: |number| for_number!(number, R => make::<B, R> as Make<R>),
    })));
    registered.push(own);
    Ok(own)
}

fn make<B: WithEquations + Default, R: Real>(
    structure: &Structure,
    parameters: &mut dyn Declare<R>,
) -> OwnEquations<R> {
    OwnEquations(Rc::new(B::default().equations(structure, parameters)))
}

impl OwnBase {
    /// The registered base model called `name`.
    pub fn named(name: &str) -> Option<Self> {
        let registered = REGISTERED.read().expect("no panic while it is held");
        registered.iter().copied().find(|own| own.name() == name)
    }
}

impl PartialEq for OwnBase {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl fmt::Debug for OwnBase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Deref for OwnBase {
    type Target = dyn BaseModel;

    fn deref(&self) -> &Self::Target {
        &*self.0.description
    }
}

impl OwnBase {
    /// Its equations, as [`WithEquations::equations`].
    pub(super) fn equations<R: Real>(
        &self,
        structure: &Structure,
        parameters: &mut dyn Declare<R>,
    ) -> OwnEquations<R> {
        let make: Make<R> = reading::<R, _>(self.0.readings);
        make(structure, parameters)
    }
}

/// Equations whose type is not known here.
#[derive(Clone)]
pub(in crate::model) struct OwnEquations<R>(Rc<dyn Equations<R, Attached<R>>>);

impl<R> fmt::Debug for OwnEquations<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("OwnEquations")
    }
}

impl<R: 'static> Deref for OwnEquations<R> {
    type Target = dyn Equations<R, Attached<R>>;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}
