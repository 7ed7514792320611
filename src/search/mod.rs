//! The search: Bees Algorithm, then a Levenberg-Marquardt polish.

mod bees;

pub use bees::{Bees, Moves, Neighbourhood, Settings, Start, Variant};
