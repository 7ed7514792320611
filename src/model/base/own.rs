//! Base models from outside this crate.

use super::equations::{BaseModel, Equations, WithEquations};
use crate::model::Real;
use crate::model::declare::Declare;
use crate::model::ports::Attached;
use crate::model::real::reading::{Readings, for_number, reading};
use crate::model::setting::Setting;
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

type Make<R> = fn(&Setting, &mut dyn Declare<R>) -> OwnEquations<R>;

static REGISTERED: RwLock<Vec<OwnBase>> = RwLock::new(Vec::new());

fn make<B: WithEquations + Default, R: Real>(
    setting: &Setting,
    parameters: &mut dyn Declare<R>,
) -> OwnEquations<R> {
    OwnEquations(Rc::new(B::default().equations(setting, parameters)))
}

impl OwnBase {
    /// Registers `base`, where none of its name is.
    pub(super) fn register<B: WithEquations + Default>(base: B) -> Option<Self> {
        let mut registered = REGISTERED.write().expect("no panic while it is held");
        if registered.iter().any(|own| own.name() == base.name()) {
            return None;
        }
        let own = Self(Box::leak(Box::new(Registered {
            description: Box::new(base),
            readings: |number| for_number!(number, R => make::<B, R> as Make<R>),
        })));
        registered.push(own);
        Some(own)
    }

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
        setting: &Setting,
        parameters: &mut dyn Declare<R>,
    ) -> OwnEquations<R> {
        let make: Make<R> = reading::<R, _>(self.0.readings);
        make(setting, parameters)
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
