//! What a base model is told of its surroundings.

use super::Output;
use serde::{Deserialize, Serialize};

/// The command between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Keeps the earlier sample's value, as a DAC does.
    #[default]
    Held,
    /// Goes straight from one to the next.
    Interpolated,
    /// The same, but where it jumps from one to the next it keeps the earlier sample's value until then, as a generator of steps
    /// and sweeps does.
    BetweenJumps,
}

impl Hold {
    /// Whether it goes straight from one sample to the next, jumps aside.
    pub fn is_straight(self) -> bool {
        self != Self::Held
    }
}

/// The state at the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Initial {
    /// In equilibrium with the first command.
    #[default]
    Equilibrium,
    /// All zero.
    Rest,
    /// Fitted: the spool stands still at the parameter `initial_spool`.
    Free,
}

/// The surroundings of a base model: how a record drives it, and what is observed of it.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// The command at full scale, in the command's unit.
    pub full_scale: f64,
    /// The command's unit.
    pub command_unit: &'a str,
    /// The observed outputs, in the order of [`Output::ALL`].
    pub observed: &'a [Output],
    /// The state at the first sample.
    pub initial: Initial,
}

impl Setting<'_> {
    /// Whether `output` is observed.
    pub fn observes(&self, output: Output) -> bool {
        self.observed.contains(&output)
    }

    /// Whether an output is observed while the ports A and B are blocked.
    pub fn observes_blocked_ports(&self) -> bool {
        let mut observed = self.observed.iter();
        observed.any(|output| output.is_of_blocked_ports())
    }
}
