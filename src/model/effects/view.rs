//! How an effect is looked at: the command that shows it, and what its residual is drawn over.

use super::act::Port;
use crate::model::Output;

/// The view that shows an effect best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// What is commanded.
    pub excitation: Excitation,
    /// What the residual is drawn over.
    pub over: Over,
    /// The values of its free parameters.
    pub values: Values,
}

/// What is commanded of a valve of ±10 V.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Excitation {
    /// Periods of so many seconds between ± `height` V.
    Triangle {
        /// V.
        height: f64,
        /// s.
        period: f64,
        /// How many.
        periods: u8,
    },
    /// A sine of 5 V whose frequency rises from 0.5 to 5 Hz in 4 s.
    Chirp,
    /// 5 V from a tenth of these seconds on.
    Step {
        /// s.
        seconds: f64,
    },
}

/// What a residual is drawn over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Over {
    /// Time.
    Time,
    /// The command.
    Command,
    /// The rate of the command.
    CommandRate,
    /// The spool of the model without the effect.
    Spool,
    /// The flow of that model.
    Flow,
    /// The rate of the output that the effect shows in, in that model.
    OutputRate,
}

/// The values of an effect's free parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Values {
    /// Which of those that a diagnosis tries, or the last.
    Trial(usize),
    /// These.
    Given(&'static [f64]),
}

/// A large slow triangle.
pub const SLOW: Excitation = triangle(9.0, 8.0, 2);
/// A small triangle.
pub const SMALL: Excitation = triangle(1.0, 1.0, 2);

/// A triangle.
pub const fn triangle(height: f64, period: f64, periods: u8) -> Excitation {
    Excitation::Triangle {
        height,
        period,
        periods,
    }
}

impl View {
    /// The view of a command over something, at a trial.
    pub const fn new(excitation: Excitation, over: Over, values: Values) -> Self {
        Self {
            excitation,
            over,
            values,
        }
    }

    /// Where an effect at `port` usually shows.
    pub fn of_port(port: Port) -> Self {
        let step = Excitation::Step { seconds: 4.0 };
        match port {
            Port::Command | Port::Actuator => Self::new(SLOW, Over::Command, Values::Trial(0)),
            Port::Area => Self::new(SLOW, Over::Spool, Values::Trial(1)),
            Port::Flow | Port::Measurement => Self::new(step, Over::Time, Values::Trial(0)),
        }
    }
}

/// The output in which an effect at `port`, on `output` where it is on one, is looked at.
pub fn looked_at(port: Port, output: Option<Output>) -> Output {
    match port {
        Port::Command | Port::Actuator => Output::Spool,
        _ => output.unwrap_or(Output::Flow),
    }
}
