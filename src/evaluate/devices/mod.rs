//! What evaluates populations: the CPU's vectors, GPUs, and the choice among them.

mod by_size;
pub(super) mod choose;
pub(super) mod cpu;
pub mod gpu;
#[doc(hidden)]
pub mod ranks;
pub mod wgsl;
