//! Base models: what is simulated where no effect is attached.
//!
//! To add one: a file here that implements [`BaseModel`], [`WithEquations`] and [`Equations`], and its line in `base_models!` below. From
//! outside this crate: the same traits and [`register_base`].

mod equations;
mod own;
mod register;
pub mod servo_valve;

pub use equations::{BaseModel, Equations, Shown, WithEquations};
pub use own::OwnBase;
pub use register::register_base;
pub use servo_valve::ServoValve;

use super::Real;
use super::declare::Declare;
use super::setting::Setting;

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
