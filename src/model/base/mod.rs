//! Base models: what is simulated where no effect is attached.
//!
//! To add one: a file here that implements [`BaseModel`], [`WithEquations`] and [`Equations`], and its line in `base_models!` below. From
//! outside this crate: the same traits and [`register_base`].

mod equations;
mod own;
pub mod servo_valve;

pub use equations::{BaseModel, Equations, Shown, WithEquations};
pub use own::OwnBase;
pub use servo_valve::ServoValve;

use super::declare::{Declare, Listing};
use super::real::trace::{OTHER_NAME, is_writable, not_writable};
use super::setting::Setting;
use super::{Real, Structure};
use crate::{Error, Result};

macro_rules! base_models {
    ($($module:ident :: $Type:ident => $Equations:ident),+ $(,)?) => {
        /// The base model of a structure.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Base {
            $(#[doc = concat!("[`", stringify!($module), "`].")] $Type($Type),)+
            /// One from outside this crate.
            Own(OwnBase),
        }

        $(impl From<$Type> for Base {
            fn from(base: $Type) -> Self {
                Self::$Type(base)
            }
        })+

        impl Base {
            /// The base model of this crate called `name`, with its default parts.
            fn built_in(name: &str) -> Option<Self> {
                $(if $Type::default().name() == name {
                    return Some($Type::default().into());
                })+
                None
            }
        }

        /// The equations of a base model.
        #[derive(Debug, Clone)]
        pub(super) enum BaseEquations<R> {
            $($Type($module::$Equations<R>),)+
            Own(own::OwnEquations<R>),
        }

        /// What `$value` makes of the base model, whichever it is.
        macro_rules! each_base {
            ($Enum:ident, $base:expr, $name:ident => $value:expr) => {
                match $base { $($Enum::$Type($name) => $value,)+ $Enum::Own($name) => $value }
            };
        }

        impl<R: Real> BaseEquations<R> {
            /// The equations of `base` in this setting.
            #[inline(always)]
            pub(super) fn new(base: &Base, setting: &Setting, parameters: &mut dyn Declare<R>) -> Self {
                match base {
                    $(Base::$Type(base) => Self::$Type(base.equations(setting, parameters)),)+
                    Base::Own(base) => Self::Own(base.equations(setting, parameters)),
                }
            }
        }
    };
}

base_models! {
    servo_valve::ServoValve => ServoValveEquations,
}
pub(super) use each_base;

impl Base {
    /// The base model called `name`: one of this crate, with its default parts, or one that has been
    /// [registered](register_base).
    pub fn named(name: &str) -> Option<Self> {
        Self::built_in(name).or_else(|| OwnBase::named(name).map(Self::Own))
    }

    /// Its name in model files.
    pub fn name(&self) -> &'static str {
        each_base!(Base, self, base => base.name())
    }
}

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
