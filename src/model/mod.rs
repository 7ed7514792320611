//! The physics, each equation written once.

pub mod actuator;
pub mod effects;
mod fluid;
mod free_form;
#[doc(hidden)]
pub mod integrate;
#[doc(hidden)]
pub mod leap;
pub mod orifice;
mod parameter;
pub mod real;
mod structure;
pub mod valve;

pub use fluid::Fluid;
pub use free_form::{FreeForm, Signal};
pub use parameter::{Pace, Parameter, Scale};
pub use real::{Real, Valued};
pub(crate) use structure::MOST_STATES;
pub use structure::{Drive, Hold, Initial, Input, Output, Piston, Plant, Structure};
