//! Evaluators: the costs of a whole population at once, on the CPU or on the GPU.

mod arrival;
mod base;
mod choose;
mod cpu;
pub mod gpu;
mod leaps;
mod population;
pub mod problem;
pub mod reference;
mod score;
mod series;
pub mod simulate;
pub mod wgsl;
pub mod workload;

pub use base::{parameters_for, scale_of, structure_for};
pub use choose::{Choice, Chosen, choose};
pub use cpu::{CpuEvaluator, Precision, STATE_LIMIT};
pub use population::{Cost, Population, Status};
pub use problem::Problem;
pub use score::Score;

use crate::Result;

/// Computes the costs of a population.
pub trait Evaluator {
    /// What it is, for a report: the device and how it computes.
    fn describe(&self) -> String;

    /// The cost of every candidate of `population` (values of the problem's free parameters), in order.
    ///
    /// # Errors
    /// If the device fails.
    fn costs(&mut self, problem: &Problem, population: &Population) -> Result<Vec<Cost>>;
}
