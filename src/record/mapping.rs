//! Renaming the columns of somebody else's file.

use super::channel::Channel;
use super::table::Label;
use super::unit::{Quantity, Unit};
use crate::{Error, Result};
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

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
}

impl Display for Target {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time => f.pad("time"),
            Self::Channel(channel) => channel.fmt(f),
        }
    }
}

/// `x_cmd_mm=command [mm]`: the column `x_cmd_mm` of a file is the channel `command` in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    pub(super) column: String,
    pub(super) target: Target,
    pub(super) unit: &'static Unit,
}

impl FromStr for Mapping {
    type Err = Error;

    /// # Errors
    /// No `=`, nothing before it, or no known channel and unit behind it.
    fn from_str(text: &str) -> Result<Self> {
        let place = format!("--map {text:?}");
        let wrong = |problem: String| {
            Error::input(
                &place,
                problem,
                "write it as \"COLUMN=CHANNEL [UNIT]\", such as \"x_cmd=command [mm]\"",
            )
        };
        let (column, label) = text
            .rsplit_once('=')
            .ok_or_else(|| wrong("has no \"=\"".into()))?;
        let column = column.trim();
        if column.is_empty() {
            return Err(wrong("names no column before \"=\"".into()));
        }
        let label = Label::parse(label);
        let target = Target::named(&label.name).ok_or_else(|| {
            wrong(format!(
                "{:?} is neither time nor one of {}",
                label.name,
                Channel::ALL.map(Channel::name).join(", ")
            ))
        })?;
        Ok(Self {
            column: column.into(),
            target,
            unit: target.quantity().unit(label.unit.as_deref(), &place)?,
        })
    }
}
