//! Which column is what.

use crate::record::mapping::Target;
use crate::record::{Channel, Unit};
use std::collections::BTreeMap;

/// The command as a target.
pub(super) const COMMAND: Target = Target::Channel(Channel::Command);

/// Columns by what they are.
pub(super) type Targets = BTreeMap<Target, (usize, &'static Unit)>;
