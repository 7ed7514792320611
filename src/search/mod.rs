//! Searches as ask and tell, and a Levenberg-Marquardt polish of what they find.
//!
//! To add a search, implement [`Search`] and [`Method`] (the file `ask_and_tell.rs`), as [`Bees`] and its [`Settings`] do,
//! here or in a crate of your own, and name the method in a [`Plan`]: fits and diagnoses then search by it.

mod ask_and_tell;
mod bees;
pub mod datasheet;
mod fit;
pub mod fitted_sheet;
mod hop;
mod lockstep;
pub mod polish;

pub use ask_and_tell::{Method, Search, Start};
pub use bees::{Bees, Moves, Neighbourhood, Settings, Variant};
pub use fit::{Fit, Plan, SearchResult, fit, fit_all, refine};
pub(crate) use fit::{Stoppable, polish_on_data};
pub use hop::fit_and_hop;
pub(crate) use hop::hop_on;
pub use lockstep::{RunningSearch, run_in_lockstep};
