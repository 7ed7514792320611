//! What the fit left over: how much of it is noise, and whether the rest has structure.

mod identify;
mod noise;
mod residual;
mod score;

pub use identify::{Identified, Measurements, Sides, identify};
pub use noise::{Noise, noise_floor};
pub use residual::{Remaining, remaining};
pub use score::{Compared, errors};
