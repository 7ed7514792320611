//! Levenberg-Marquardt polish of a candidate, and what the data say about its parameters.
//!
//! With residuals r(θ) = measured − simulated, weighted, and J = ∂r/∂θ, [`polish`] minimises the sum of squares
//! |r|². Everything is done in search coordinates u: the value itself on a linear scale, its logarithm on a
//! logarithmic one. The Jacobian is never stored: its rows stream into a [`Triangle`], from which come the steps, the
//! [`Uncertainty`] of each parameter, and the [`Unidentifiable`] ones; [`profile()`] follows the cost itself where its
//! curvature says too little.

mod autocorrelation;
mod coordinates;
mod directions;
mod flat;
mod identifiability;
mod interval;
mod least_squares;
mod levenberg_marquardt;
mod polished;
mod profile;
mod spectrum;
mod spread;
mod step;
mod triangle;
mod uncertainty;

pub use autocorrelation::autocorrelation_inflation;
pub use coordinates::Bound;
pub use flat::{polish_what_counts, within_flats};
pub use identifiability::{Kind, Unidentifiable};
pub use interval::Interval;
pub use least_squares::LeastSquares;
pub use levenberg_marquardt::{PolishOptions, polish};
pub use polished::{Flat, Polished, Stop};
pub use profile::profile;
pub use spread::{Axis, spread};
pub use triangle::Triangle;
pub(crate) use uncertainty::student_t;
pub use uncertainty::{Uncertainty, UncertaintyOptions};
