//! What everything long asks between two of its steps: whether it shall stop.

use std::fmt::{self, Debug, Formatter};
use std::sync::Arc;

/// Says whether a run was asked to stop. A run that was asked computes nothing more: what was under way is left, what was
/// known before stands.
#[derive(Clone)]
pub struct Interrupt(Arc<dyn Fn() -> bool + Send + Sync>);

impl Interrupt {
    /// One that `asked` answers, on any thread and often. Once it has said yes it does not take that back.
    pub fn new(asked: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(asked))
    }

    /// Whether the run was asked to stop.
    pub fn asked(&self) -> bool {
        (self.0)()
    }
}

impl Default for Interrupt {
    /// One that never comes.
    fn default() -> Self {
        Self::new(|| false)
    }
}

impl Debug for Interrupt {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("Interrupt")
    }
}
