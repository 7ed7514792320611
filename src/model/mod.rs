//! The physics, each equation written once.

mod parameter;

pub use parameter::{Parameter, Scale};
