//! What a column can be: time or a channel.

use super::channel::Channel;
use super::text::quoted;
use super::unit::{Quantity, Unit};
use crate::{Error, Result};
use std::fmt::{self, Display, Formatter};

/// Where a column of a record goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Target {
    Time,
    Channel(Channel),
}

impl Target {
    /// The target called `name`, if there is one.
    pub(super) fn named(name: &str) -> Option<Self> {
        match name {
            "time" => Some(Self::Time),
            _ => name.parse().ok().map(Self::Channel),
        }
    }

    pub(super) fn quantity(self) -> Quantity {
        match self {
            Self::Time => Quantity::Time,
            Self::Channel(channel) => channel.quantity(),
        }
    }

    /// The unit spelt `text` of a column that is called `column`.
    ///
    /// # Errors
    /// As [`Quantity::unit`]; what is no known unit can be made one by a factor.
    pub(super) fn unit(
        self,
        text: Option<&str>,
        place: impl Display,
        column: &str,
    ) -> Result<&'static Unit> {
        let quantity = self.quantity();
        quantity.unit(text, place).map_err(|error| match (error, text) {
            (Error::Input { place, problem, remedy }, Some(text)) => {
                let usual = quantity.usual().kept();
                let unit = quoted(text);
                Error::input(
                    place,
                    problem,
                    format!(
                        "{remedy}, or let FACTOR say how many {usual} one {unit} is: --map \"{column}={self} [{usual}] *FACTOR\""
                    ),
                )
            }
            (error, _) => error,
        })
    }
}

impl Display for Target {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time => f.pad("time"),
            Self::Channel(channel) => channel.fmt(f),
        }
    }
}
