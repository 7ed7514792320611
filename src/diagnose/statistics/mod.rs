//! Statistics of measured rows: resampling, spectra, noise, and tests of a residual. Nothing here knows a model, an evaluator, a
//! search or an effect.

pub(super) mod basis;
pub(super) mod bootstrap;
pub(super) mod compare;
pub(super) mod density;
pub(super) mod jumps;
pub(super) mod line;
pub(super) mod noise;
pub(super) mod residual;
pub(super) mod rows;
#[cfg(test)]
pub(super) mod simulated;
