//! Evaluators: the costs of a whole population at once, on the CPU or on the GPU.

mod population;

pub use population::{Cost, Population, Status};
