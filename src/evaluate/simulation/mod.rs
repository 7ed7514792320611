//! The time loops, in which a candidate runs through a record or a tone, and what is traced of them for other languages.

pub(super) mod exact_step;
pub(super) mod instructions;
mod lead;
pub mod physics;
pub mod reference;
pub mod simulate;
pub(super) mod transport_delay;

pub(crate) use lead::Lead;
