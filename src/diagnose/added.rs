//! What was looked at for the result, and what became of it.

use super::verdict::taken;
use crate::evaluate::Problem;
use crate::model::effects::Effect;
use crate::model::{Complete, Parameter, Structure};

/// A structure as it was fitted on the way to the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Refit {
    /// The structure.
    pub structure: Structure,
    /// All its parameters, whose start values are the fitted ones.
    pub parameters: Vec<Parameter>,
}

impl Refit {
    /// Values of all parameters.
    pub fn values(&self) -> Complete<f64> {
        Complete::nominal(&self.parameters)
    }
}

impl From<&Problem> for Refit {
    fn from(problem: &Problem) -> Self {
        Self {
            structure: problem.structure.clone(),
            parameters: problem.parameters.clone(),
        }
    }
}

/// What became of an effect that was looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Considered {
    /// The effect.
    pub effect: Effect,
    /// The round, from 1.
    pub round: usize,
    /// Share of the fitted cost by which it is predicted to fall, linearised, in percent.
    pub predicted_reduction: f64,
    /// Chance of as large a predicted reduction by any effect where none is missing.
    pub p_value: f64,
    /// Its test statistic over the critical value: above 1 it is significant.
    pub test_ratio: f64,
    /// The model so far with it; only where it was refitted.
    pub refit: Option<Refit>,
    /// Held-out error with it, RMS in units of noise over all channels; only where it was refitted.
    pub error: Option<f64>,
    /// Held-out error of what it was added to, where no cause had been chosen yet: the base model, and later what the sensors add.
    pub(super) before_first: Option<f64>,
    /// Whether it was chosen, and why.
    pub decision: Decision,
}

impl Considered {
    /// What share of what was left above the noise, squared, it explains by itself as the first cause; `None` in other rounds.
    fn alone(&self) -> Option<f64> {
        Some(taken(self.before_first?.powi(2), self.error?.powi(2)))
    }
}

/// What was refitted as the first cause, with the share that each alone explains of what was left above the noise, the most first.
pub(super) fn first_causes(considered: &[Considered]) -> Vec<(&Considered, f64)> {
    let first = considered.iter().filter(|one| one.before_first.is_some());
    let round = first.clone().map(|one| one.round).max();
    let own = first.filter(|one| Some(one.round) == round);
    let mut own: Vec<(&Considered, f64)> =
        own.filter_map(|one| Some((one, one.alone()?))).collect();
    own.sort_by(|a, b| b.1.total_cmp(&a.1));
    own
}

/// Why an effect was or was not chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// With it the held-out error is the lowest.
    Chosen,
    /// It helps, but less than the one chosen, or with more parameters.
    Outdone,
    /// Refitted, it does not lower the held-out error enough.
    NotEnough,
    /// Its predicted reduction is no larger than by chance.
    NotSignificant,
    /// It is significant, but its predicted reduction is far smaller than that of the best, or others cost less after a polish of
    /// few steps.
    FarLess,
    /// It was chosen, but what is left is too much to name it.
    NotNamed,
    /// It was chosen, but too many others do as well to name it, or one that was chosen with it.
    Undecided,
}

impl Decision {
    /// The decision in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Chosen => "chosen: lowest held-out error",
            Self::Outdone => "helps, but less than the one chosen or with more parameters",
            Self::NotEnough => "refitted: does not lower the held-out error enough",
            Self::NotSignificant => "not significant: chance promises as much",
            Self::FarLess => {
                "significant, but promises far less than the best, or costs more after a few steps"
            }
            Self::NotNamed => "helps, but leaves too much: no name for what is missing",
            Self::Undecided => "helps, but too many others as much: no name for what is missing",
        }
    }
}

/// An effect of the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// The effect.
    pub effect: Effect,
    /// Effects that the record cannot tell from it.
    pub tied_with: Vec<Effect>,
    /// Held-out error without it, RMS in units of noise over all channels.
    pub error_before: f64,
    /// The same with it.
    pub error_after: f64,
    /// What it is compared on with its closest rival.
    pub contest: Option<Contest>,
}

/// Of so many causes that the record cannot tell from each other none is named.
const TOO_MANY: usize = 4;

impl Added {
    /// Its cause and those that the record cannot tell from it.
    pub(crate) fn causes(&self) -> Vec<String> {
        let mut causes: Vec<String> = Vec::new();
        for cause in [&self.effect]
            .into_iter()
            .chain(&self.tied_with)
            .map(Effect::cause)
        {
            if !causes.contains(&cause) {
                causes.push(cause);
            }
        }
        causes
    }

    /// Whether the record cannot tell it from so many causes that none is named.
    pub(super) fn is_undecided(&self) -> bool {
        self.causes().len() >= TOO_MANY
    }

    /// What share it takes of what was left above the noise.
    pub(super) fn taken(&self) -> f64 {
        taken(self.error_before.powi(2), self.error_after.powi(2))
    }
}

/// The result beside the same model with one effect less, and with another instead.
#[derive(Debug, Clone, PartialEq)]
pub struct Contest {
    /// The result without the effect, fitted again.
    pub without: Refit,
    /// The result.
    pub with: Refit,
    /// The effect that does best instead, if any other is plausible.
    pub rival: Option<Rival>,
}

/// An effect instead of another.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    /// The effect.
    pub effect: Effect,
    /// The result with it instead.
    pub refit: Refit,
    /// Its held-out error, RMS in units of noise over all channels.
    pub error: f64,
}
