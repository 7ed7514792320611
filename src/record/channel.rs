//! The channels of a record.

use super::unit::Quantity;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// What is measured, or commanded, at every sample. Files and reports write it as [`Channel::name`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The valve's input in V, mA, %, mm or 1.
    Command,
    /// The spool's position in V, mA, %, mm or 1.
    Spool,
    /// The flow through the valve in L/min.
    Flow,
    /// The pressure at port P in bar.
    SupplyPressure,
    /// The pressure at port T in bar.
    ReturnPressure,
    /// The pressure at port A in bar.
    PressureA,
    /// The pressure at port B in bar.
    PressureB,
    /// The position of the driven cylinder in mm.
    Position,
    /// The oil's temperature in degC.
    Temperature,
}

impl Channel {
    /// Every channel, in the order of a record's columns.
    pub const ALL: [Self; 9] = [
        Self::Command,
        Self::Spool,
        Self::Flow,
        Self::SupplyPressure,
        Self::ReturnPressure,
        Self::PressureA,
        Self::PressureB,
        Self::Position,
        Self::Temperature,
    ];

    /// The channels that a model is fitted to.
    pub const RESPONSES: [Self; 3] = [Self::Spool, Self::Flow, Self::Position];

    /// The name in files, options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Spool => "spool",
            Self::Flow => "flow",
            Self::SupplyPressure => "supply_pressure",
            Self::ReturnPressure => "return_pressure",
            Self::PressureA => "pressure_a",
            Self::PressureB => "pressure_b",
            Self::Position => "position",
            Self::Temperature => "temperature",
        }
    }

    /// What the channel measures.
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Command | Self::Spool => Quantity::Signal,
            Self::Flow => Quantity::Flow,
            Self::SupplyPressure | Self::ReturnPressure | Self::PressureA | Self::PressureB => {
                Quantity::Pressure
            }
            Self::Position => Quantity::Length,
            Self::Temperature => Quantity::Temperature,
        }
    }
}

impl Display for Channel {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Channel {
    type Err = Error;

    /// # Errors
    /// A name that is none of [`Channel::ALL`].
    fn from_str(text: &str) -> Result<Self> {
        Self::ALL
            .into_iter()
            .find(|channel| channel.name() == text)
            .ok_or_else(|| {
                Error::input(
                    format!("channel {text:?}"),
                    "is not known",
                    format!("use one of {}", Self::ALL.map(Self::name).join(", ")),
                )
            })
    }
}
