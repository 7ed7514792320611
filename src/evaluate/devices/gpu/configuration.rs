//! How an evaluator works: what its adapter allows and what its user has limited.

use std::time::Duration;

/// Whether the driver's checks guard the shader's loops and indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Checks {
    /// Loops are bounded and indices clamped: for tests.
    On,
    /// As the composed shader stands: for speed. Every index in it is below its buffer's length by construction.
    Off,
}

/// How an evaluator works.
#[derive(Debug, Clone, Copy)]
pub(super) struct Configuration {
    pub(super) checks: Checks,
    /// Invocations in a workgroup.
    pub(super) workgroup: u32,
    /// Largest storage buffer and binding, bytes.
    pub(super) largest_buffer: u64,
    /// Whether the driver limits loops.
    pub(super) limited_loops: bool,
    /// About how many bytes of results, states and data a batch has.
    pub(super) batch: u64,
    /// How long a submission may take, s.
    pub(super) submission: f64,
    /// How long it may take before the device counts as hung.
    pub(super) timeout: Duration,
}
