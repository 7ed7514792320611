//! Evaluators: the costs of a whole population at once, on the CPU or on the GPU.

mod checking;
#[doc(hidden)]
pub mod checkpoint;
mod devices;
mod evaluator;
mod interrupt;
mod order;
mod population;
pub mod problem;
mod score;
mod simulation;
#[doc(hidden)]
pub mod workload;

pub use crate::model::base::servo_valve::{parameters_for, scale_of, structure_for};
pub use checking::cross_check::Thoroughness;
pub use checking::guard::{Guarded, Standby};
pub use checking::judgement::PARITY;
#[doc(hidden)]
pub use checkpoint::interrupted;
pub use checkpoint::{Checkpoint, Fingerprint, Memory, Remembering};
pub use devices::choose::{Choice, Chosen, Devices, choose};
pub use devices::cpu::{CpuEvaluator, Precision};
pub use devices::gpu;
#[doc(hidden)]
pub use devices::ranks;
#[doc(hidden)]
pub use devices::wgsl;
pub use evaluator::{Evaluator, Job};
pub use interrupt::Interrupt;
pub use population::{Cost, Population, Status};
pub use problem::Problem;
#[doc(hidden)]
pub use problem::identity;
pub use problem::loss::{Loss, OwnLoss, SizedLoss};
pub use score::Score;
pub(crate) use simulation::Lead;
pub use simulation::reference;
pub use simulation::simulate::STATE_LIMIT;
#[doc(hidden)]
pub use simulation::{physics, simulate};
