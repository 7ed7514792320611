//! Which column is what.

use crate::record::Channel;
use crate::record::mapping::Taken;
use crate::record::target::Target;

/// The command as a target.
pub(super) const COMMAND: Target = Target::Channel(Channel::Command);

/// Columns by what they are.
pub(super) type Targets = Taken;
