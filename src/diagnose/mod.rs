//! What the fit left over: how much of it is noise, and whether the rest has structure.

mod noise;
mod residual;

pub use noise::{Noise, noise_floor};
pub use residual::{Remaining, remaining};
