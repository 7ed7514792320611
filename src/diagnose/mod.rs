//! What the fit left over: how much of it is noise, and whether the rest has structure.

mod bootstrap;
mod compare;
mod identify;
mod noise;
mod residual;
mod score;
#[cfg(test)]
mod simulated;

pub use bootstrap::{
    Improvement, Interval, block_length, improvement, resample_indices, surrogate,
};
pub use compare::{Comparison, indistinguishable};
pub use identify::{Identified, Measurements, Sides, identify};
pub use noise::{Noise, noise_floor};
pub use residual::{Remaining, Residuals, coloured, remaining};
pub use score::{Compared, errors};
