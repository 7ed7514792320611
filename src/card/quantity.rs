//! What the figures of a card are figures of.

use serde::{Serialize, Serializer};
use std::fmt::{self, Display, Formatter};

/// Amplitudes of the frequency responses, % of full scale.
pub const AMPLITUDES: [f64; 3] = [5.0, 25.0, 90.0];

/// What a figure of the card is a figure of. As text, and in JSON, it is a name such as `rated_flow`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// Flow at full command.
    RatedFlow,
    /// Slope of the flow over the command.
    FlowGain,
    /// Difference of the flow gains of both sides.
    Asymmetry,
    /// Half the [`Quantity::Lap`]: that of one side.
    Overlap,
    /// From where the straight part of one side of the flow curve meets zero to where the other's does.
    Lap,
    /// Deviation of the flow curve from a straight line.
    Linearity,
    /// Sign of the flow at a positive command.
    Polarity,
    /// Width of the slow cycle.
    Hysteresis,
    /// How far the command has to turn back before the output follows.
    Threshold,
    /// Command of no output.
    NullBias,
    /// Load pressure over the supply's for each unit of command over full scale, at null with blocked ports.
    PressureGain,
    /// Flow from P to T at null.
    Leakage,
    /// Frequency of -3 dB at one of the [`AMPLITUDES`].
    AmplitudeLimit(f64),
    /// Frequency of -90° at one of the [`AMPLITUDES`].
    PhaseLimit(f64),
    /// Time that a step takes.
    StepTime,
    /// Overshoot of a step.
    Overshoot,
}

impl Quantity {
    /// Whether it is another figure where the full scale of the command is another.
    pub(super) fn needs_full_scale(self) -> bool {
        !matches!(
            self,
            Self::FlowGain | Self::Asymmetry | Self::Polarity | Self::Leakage
        )
    }
}

impl Display for Quantity {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::RatedFlow => "rated_flow",
            Self::FlowGain => "flow_gain",
            Self::Asymmetry => "asymmetry",
            Self::Overlap => "overlap",
            Self::Lap => "lap",
            Self::Linearity => "linearity",
            Self::Polarity => "polarity",
            Self::Hysteresis => "hysteresis",
            Self::Threshold => "threshold",
            Self::NullBias => "null_bias",
            Self::PressureGain => "pressure_gain",
            Self::Leakage => "leakage",
            Self::AmplitudeLimit(amplitude) => return write!(f, "amplitude_limit_{amplitude}"),
            Self::PhaseLimit(amplitude) => return write!(f, "phase_limit_{amplitude}"),
            Self::StepTime => "step_time",
            Self::Overshoot => "overshoot",
        })
    }
}

impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
