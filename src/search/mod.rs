//! The search: Bees Algorithm, then a Levenberg-Marquardt polish.

mod bees;
pub mod polish;

pub use bees::{Bees, Moves, Neighbourhood, Settings, Start, Variant};
