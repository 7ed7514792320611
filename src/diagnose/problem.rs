//! The problem of a diagnosis: a base model, the measurements that it shall follow, and the effects that may be added to it.

use super::fitted::variance;
use super::measurements::{Cut, Measurements};
use crate::Result;
use crate::evaluate::problem::Data;
use crate::evaluate::{OwnLoss, Problem, parameters_for, scale_of, structure_for};
use crate::model::effects::{Effect, Entry, Scale};
use crate::model::{Outputs, Parameter, Structure};
use crate::record::Record;

/// A base model, and the measurements that it shall follow.
#[derive(Debug, Clone)]
pub struct IdentificationProblem {
    /// The base model.
    pub structure: Structure,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// How large things are in the records.
    pub sizes: Scale,
    /// The records, cut into what is fitted and what is held out.
    pub measurements: Measurements,
    /// Whether it is known that the command between two rows is as the structure has it. Otherwise both ways are tried.
    pub hold_known: bool,
    /// What an error costs in the fits, where that is not its square. Noise, held-out errors and tests are of errors as they are.
    pub loss: Option<OwnLoss>,
}

impl IdentificationProblem {
    /// The base model that the channels of `records` ask for, with bounds from their values: see [`structure_for`] and
    /// [`parameters_for`].
    ///
    /// # Errors
    /// As of [`structure_for`] and [`Measurements::new`].
    pub fn of(records: &[Record], hold_out: &[Record], cut: Cut) -> Result<Self> {
        let structure = structure_for(records)?;
        let parameters = parameters_for(&structure, records);
        Ok(Self {
            hold_known: false,
            ..Self::new(structure, parameters, records, hold_out, cut)?
        })
    }

    /// A base model of one's own, which also says what the command does between two rows, with integration steps that suit the
    /// fastest dynamics within its parameters' bounds.
    ///
    /// # Errors
    /// As of [`Measurements::new`].
    pub fn new(
        structure: Structure,
        parameters: Vec<Parameter>,
        records: &[Record],
        hold_out: &[Record],
        cut: Cut,
    ) -> Result<Self> {
        let rate = structure.fastest_rate(&parameters);
        Ok(Self {
            sizes: scale_of(&structure, records),
            measurements: Measurements::new(records, hold_out, cut, &structure, rate)?,
            structure,
            parameters,
            hold_known: true,
            loss: None,
        })
    }

    /// What is fitted first: the base model, on the records that are not held out, in which each channel counts by how much it
    /// varies.
    pub fn first_fit(&self) -> Problem {
        let records = &self.measurements.fit;
        let data = Data::Series(records.clone());
        let mut problem = Problem::new(self.structure.clone(), self.parameters.clone(), data);
        problem.scale = Outputs::from_fn(|output| 1.0 / variance(records, output));
        problem.loss = self.loss;
        problem
    }
}

/// What a diagnosis may add to the base model.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The effects; those that do not act on the structure are passed over.
    pub effects: Vec<Effect>,
    /// At most so many are added.
    pub max_effects: usize,
}

impl Options {
    /// At most `max_effects` of `entries`, in every form in which they can act on `structure`.
    pub fn on(structure: &Structure, entries: &[&'static Entry], max_effects: usize) -> Self {
        let effects = entries.iter().flat_map(|entry| entry.on(structure));
        Self {
            effects: effects.collect(),
            max_effects,
        }
    }

    /// The effects that may be added to `structure`; where the records are static sweeps, none that only quick motion shows.
    pub(super) fn asked(&self, structure: &Structure, is_static: bool) -> Vec<Effect> {
        let new = |effect: &&Effect| {
            let shows = !is_static || !effect.needs_quick_motion();
            let acts = effect.entry.on(structure).contains(effect);
            shows && acts && !structure.has_cause_of(effect)
        };
        match self.max_effects {
            0 => Vec::new(),
            _ => self.effects.iter().filter(new).copied().collect(),
        }
    }
}
