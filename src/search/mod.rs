//! The search: Bees Algorithm, then a Levenberg-Marquardt polish.

mod bees;
pub mod datasheet;
mod fit;
pub mod polish;

pub use bees::{Bees, Moves, Neighbourhood, Settings, Start, Variant};
pub use fit::{Fit, Plan, Search, fit, refine};
