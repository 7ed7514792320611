//! The physics, each equation written once.

pub mod actuator;
pub mod base;
mod complete;
pub mod declare;
pub mod edges;
pub mod effects;
#[doc(hidden)]
pub mod exact_step;
mod fluid;
mod four_ports;
mod free_form;
mod input;
#[doc(hidden)]
pub mod integrate;
pub mod orifice;
mod output;
mod parameter;
mod plant;
mod ports;
pub mod real;
mod setting;
mod structure;
pub mod valve;

pub use base::ServoValve;
pub use base::servo_valve::{Drive, Piston, Polarity};
pub use complete::Complete;
pub use fluid::Fluid;
pub use free_form::{FreeForm, Signal};
pub use input::Input;
pub use output::{Output, Outputs};
pub use parameter::{Pace, Parameter, Role, Scale};
pub use plant::{Alone, BarePlant, Dynamics, Plant, View, Whole};
pub use ports::Ports;
pub use real::{Real, Valued};
pub use setting::{Hold, Initial, Setting};
pub(crate) use structure::MOST_STATES;
pub use structure::Structure;
