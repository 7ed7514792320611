//! Evaluators: the costs of a whole population at once, on the CPU or on the GPU.

mod arrival;
#[doc(hidden)]
pub mod checkpoint;
mod choose;
mod cpu;
mod cross_check;
mod evaluator;
pub mod gpu;
mod guard;
#[doc(hidden)]
pub mod identity;
mod interrupt;
mod judgement;
mod leaps;
mod loss;
#[doc(hidden)]
pub mod physics;
mod population;
pub mod problem;
pub mod reference;
mod score;
mod series;
#[doc(hidden)]
pub mod simulate;
mod warnings;
#[doc(hidden)]
pub mod wgsl;
#[doc(hidden)]
pub mod workload;

pub use crate::model::base::servo_valve::{parameters_for, scale_of, structure_for};
pub(crate) use arrival::JITTER;
pub use checkpoint::{Checkpoint, Fingerprint, Memory, Remembering};
pub use choose::{Choice, Chosen, choose};
pub use cpu::{CpuEvaluator, Precision, STATE_LIMIT};
pub use cross_check::Thoroughness;
pub use evaluator::{Evaluator, Job};
pub use guard::{Guarded, Standby};
pub use interrupt::Interrupt;
pub use judgement::PARITY;
pub use loss::{Loss, OwnLoss, SizedLoss};
pub use population::{Cost, Population, Status};
pub use problem::Problem;
pub use score::Score;
