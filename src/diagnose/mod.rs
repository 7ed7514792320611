//! What the fit left over: how much of it is noise, and whether the rest has structure.

mod attribution;
mod bootstrap;
mod compare;
mod density;
mod evidence;
mod free_form;
mod identify;
mod line;
mod linear;
mod noise;
mod residual;
mod score;
mod screen;
mod signals;
mod signature;
#[cfg(test)]
mod simulated;
mod verdict;

pub use attribution::{Added, Considered, Contest, Refit, Rival};
pub use bootstrap::{
    Improvement, Interval, block_length, improvement, resample_indices, surrogate,
};
pub use compare::{Comparison, indistinguishable};
pub use density::spectral_density;
pub use free_form::FoundForm;
pub use identify::{Fitted, Identified, Measurements, Options, Sides, identify};
pub use noise::{Noise, noise_floor};
pub use residual::{Remaining, Residuals, coloured, remaining};
pub use score::{Compared, errors};
pub use signature::{Bin, Signature, signatures};
pub use verdict::Verdict;
