//! The one error type. Every variant says what is wrong, where, and what to do about it.

use std::fmt::Display;

/// Everything that can go wrong, told in one line.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// What the user gave is wrong: a file, a cell, an option. Exit code 2.
    #[error("{place}: {problem}; {remedy}")]
    Input {
        /// File, row and column, option or parameter.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// The run itself failed. Exit code 1.
    #[error("{problem}; {remedy}")]
    Failed {
        /// What failed.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// The run is done, and its result is not inside the limits that it was given. Exit code 3.
    #[error("{problem}; {which}")]
    Unmet {
        /// How many limits are met.
        problem: String,
        /// Which are not.
        which: String,
    },
}

impl Error {
    /// An error in what the user gave.
    pub fn input(place: impl Display, problem: impl Display, remedy: impl Display) -> Self {
        Self::Input {
            place: place.to_string(),
            problem: problem.to_string(),
            remedy: remedy.to_string(),
        }
    }

    /// An error while running.
    pub fn failed(problem: impl Display, remedy: impl Display) -> Self {
        Self::Failed {
            problem: problem.to_string(),
            remedy: remedy.to_string(),
        }
    }

    /// A result that is not inside its limits.
    pub fn unmet(problem: impl Display, which: impl Display) -> Self {
        Self::Unmet {
            problem: problem.to_string(),
            which: which.to_string(),
        }
    }

    /// The process's exit code: 2 where the input or the call is wrong, 1 where running failed, 3 where a limit is not met.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } => 2,
            Self::Failed { .. } => 1,
            Self::Unmet { .. } => 3,
        }
    }
}

/// `Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
