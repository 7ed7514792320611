//! What a diagnosis is asked: a base model, and the measurements that it shall follow.

use super::{Cut, Measurements};
use crate::Result;
use crate::evaluate::{parameters_for, scale_of, structure_for};
use crate::model::effects::Scale;
use crate::model::{Parameter, Structure};
use crate::record::Record;

/// A base model, and the measurements that it shall follow.
#[derive(Debug, Clone)]
pub struct Question {
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
}

impl Question {
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
        })
    }
}
