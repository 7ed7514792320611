//! The search: Bees Algorithm, then a Levenberg-Marquardt polish.

mod bees;
pub mod datasheet;
mod fit;
pub mod fitted_sheet;
mod forage;
pub mod polish;

pub use bees::{Bees, Moves, Neighbourhood, Settings, Start, Variant};
pub use fit::{Fit, Plan, Search, fit, fit_all, refine};
pub(crate) use fit::{Stoppable, polish_on_data};
pub use forage::{Swarm, forage};
