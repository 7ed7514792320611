//! The GPU evaluator: one invocation a candidate and record, or a candidate and tone.

mod adapter;
mod batching;
mod clock;
mod configuration;
mod context;
mod evaluator;
mod fault_injection;
pub mod layout;
mod limits;
mod loops;
mod pace;
mod pipeline;
mod pool;
mod prepared;
mod resident;
mod session;
mod submitter;
mod timings;

pub use adapter::{adapters, best, describe, is_software, kind, none_found, ranked};
pub(super) use adapter::{not_there, ranked_for};
pub use configuration::Checks;
pub use evaluator::GpuEvaluator;
#[doc(hidden)]
pub use fault_injection::InjectedFault;
pub use timings::Timings;
