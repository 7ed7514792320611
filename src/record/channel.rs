//! The channels of a record.

use super::unit::Quantity;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

macro_rules! channels {
    ($($(#[$doc:meta])* $Name:ident => $name:literal, $Quantity:ident $(, $response:ident)?;)+) => {
        /// What is measured, or commanded, at every sample. Files and reports write it as [`Channel::name`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Channel {
            $($(#[$doc])* $Name,)+
        }

        impl Channel {
            /// Every channel, in the order of a record's columns.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$Name),+];

            /// The channels that are always what a model is fitted to. The pressures at A and B are as well where these ports are
            /// blocked: see [`Record::responses`](super::Record::responses).
            pub const RESPONSES: [Self; [$($(stringify!($response),)?)+].len()] =
                [$($(channels!(@$response $Name),)?)+];

            /// The name in files, options and reports.
            pub fn name(self) -> &'static str {
                match self { $(Self::$Name => $name,)+ }
            }

            /// What the channel measures.
            pub fn quantity(self) -> Quantity {
                match self { $(Self::$Name => Quantity::$Quantity,)+ }
            }
        }
    };
    (@response $Name:ident) => { Self::$Name };
}

channels! {
    /// The valve's input in V, mA, %, mm or 1.
    Command => "command", Signal;
    /// The spool's position in V, mA, %, mm or 1.
    Spool => "spool", Signal, response;
    /// The flow through the valve in L/min.
    Flow => "flow", Flow, response;
    /// The flow from port T in L/min, while the ports A and B are blocked.
    ReturnFlow => "return_flow", Flow, response;
    /// The pressure at port P in bar.
    SupplyPressure => "supply_pressure", Pressure;
    /// The pressure at port T in bar.
    ReturnPressure => "return_pressure", Pressure;
    /// The pressure at port A in bar.
    PressureA => "pressure_a", Pressure;
    /// The pressure at port B in bar.
    PressureB => "pressure_b", Pressure;
    /// The pressure at port A less that at port B in bar, while both are blocked.
    LoadPressure => "load_pressure", Pressure, response;
    /// The position of the driven cylinder in mm.
    Position => "position", Length, response;
    /// The oil's temperature in degC.
    Temperature => "temperature", Temperature;
}

impl Channel {
    /// The head of a column that holds it, in the unit that is usual.
    pub fn column(self) -> String {
        let unit = match self {
            Self::Spool => "%",
            _ => self.quantity().usual().kept(),
        };
        format!("{self} [{unit}]")
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
