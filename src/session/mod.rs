//! The way from records to a page, in one call: what the commands `identify`, `compare` and `batch` go, too.
//!
//! A [`Session`] holds what is said of every record: how it is read, which effects are looked for, what an error costs, by which
//! search. It is plain data with defaults; what differs is named. The evaluator stands beside it, as it lives longer.
//!
//! The first page of this crate's documentation has one; `examples/own.rs` another, with an evaluator, a loss, a search and an
//! effect that somebody else has written.

mod batch;
mod compared;
mod datasheet;
mod diagnosed;
mod files;
mod prepared;
mod simulated;

pub use batch::{RunningBatch, Task, found};
pub use compared::{Compared, Pair};
pub use datasheet::{Datasheet, FittedSheets, PreparedSheets};
pub use diagnosed::Diagnosed;
pub use prepared::Prepared;
pub use simulated::{Simulated, SimulatedChannel};

use crate::card::{Accuracy, Measured};
use crate::diagnose::{self, Cut, IdentificationProblem};
use crate::evaluate::{Chosen, Fingerprint, OwnLoss, parameters_for, structure_for};
use crate::model::Structure;
use crate::model::effects::{CATALOGUE, Entry, known};
use crate::record::{Reading, Record, check_mappings, usual_full_scale};
use crate::report::{Call, Edition, Limits, ModelFile};
use crate::search::Plan;
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// How many effects are added at most, unless one says otherwise.
pub const MAX_EFFECTS: usize = 4;

/// What is said of every record that is diagnosed.
#[derive(Debug)]
pub struct Session {
    /// How files are read.
    pub reading: Reading,
    /// A whole model, or the settings and parameters that differ from the base model's.
    pub model: Option<ModelFile>,
    /// The effects that may be added to it, those of the catalogue or one's own.
    pub effects: Vec<&'static Entry>,
    /// At most so many are added.
    pub max_effects: usize,
    /// What an error costs in the fits, where that is not its square. Held-out errors and tests are of errors as they are.
    pub loss: Option<OwnLoss>,
    /// What of the records is fitted and held out.
    pub cut: Cut,
    /// The command at full scale, in its unit, where it is known.
    pub full_scale: Option<f64>,
    /// How far the sensors may be off.
    pub accuracy: Accuracy,
    /// What the valve has to keep.
    pub limits: Option<Limits>,
    /// How it is fitted: by which search, from which seed, with what it remembers of a run that was cut off, and what stops it.
    pub plan: Plan,
    /// What a report says of how it came about.
    pub call: Call,
    /// The units and the language of its page.
    pub edition: Edition,
}

impl Default for Session {
    /// What `servobee identify` does where nothing is said.
    fn default() -> Self {
        Self {
            reading: Reading::default(),
            model: None,
            effects: CATALOGUE.to_vec(),
            max_effects: MAX_EFFECTS,
            loss: None,
            cut: Cut::default(),
            full_scale: None,
            accuracy: Accuracy::default(),
            limits: None,
            plan: Plan::of_records(1),
            call: Call::default(),
            edition: Edition::default(),
        }
    }
}

impl Session {
    /// Refuses numbers that no record can be cut or scaled by.
    ///
    /// # Errors
    /// Those numbers.
    pub fn check(&self) -> Result<()> {
        let Cut { hold_out, rows } = self.cut;
        let share = (0.05..=0.9).contains(&hold_out);
        check(
            share,
            "--hold-out-share",
            hold_out,
            "a number from 0.05 to 0.9",
        )?;
        check(
            rows >= 1000,
            "--max-rows",
            rows as f64,
            "a whole number from 1000 on",
        )?;
        check_full_scale(self.full_scale)
    }

    /// The records at `paths`.
    ///
    /// # Errors
    /// A file that is no such record.
    pub fn read(&self, paths: &[impl AsRef<Path>]) -> Result<Vec<Record>> {
        let read = |path| Record::read_as(path, &self.reading);
        paths.iter().map(read).collect()
    }

    /// Fits a model to `records`, finds out which effects it lacks, and scores it on those `held_out`, or on the rest of the same
    /// records where there are none. `progress` is told each stage and may break off: the result is then what is known so far.
    ///
    /// # Errors
    /// As of [`Session::prepare`] and [`Prepared::diagnose`].
    pub fn identify(
        &self,
        records: &[Record],
        held_out: &[Record],
        chosen: &mut Chosen,
        progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
    ) -> Result<Diagnosed> {
        self.prepare(records, held_out)?.diagnose(chosen, progress)
    }

    /// The problem that `records` pose, scored on those `held_out`.
    ///
    /// # Errors
    /// As of [`Session::check`]; records in which nothing moves or no response was measured, that have not the same channels, that the model file does
    /// not suit, or in which an effect that was chosen has nothing to act on.
    pub fn prepare(&self, records: &[Record], held_out: &[Record]) -> Result<Prepared> {
        self.prepare_among(records, records, held_out)
    }

    /// The same, on the base model that all of `family` ask for, of which `records` are some.
    fn prepare_among(
        &self,
        family: &[Record],
        records: &[Record],
        held_out: &[Record],
    ) -> Result<Prepared> {
        let started = Instant::now();
        self.check()?;
        let all: Vec<&Record> = records.iter().chain(held_out).collect();
        all.iter().try_for_each(|record| record.check_response())?;
        check_mappings(&self.reading.mappings, &all)?;
        records.iter().try_for_each(Record::check_excited)?;
        let mut structure = match &self.model {
            Some(file) => file.structure(|| structure_for(family))?,
            None => structure_for(family)?,
        };
        let says_full_scale = self.model.as_ref().is_some_and(ModelFile::says_full_scale);
        match self.full_scale {
            Some(full_scale) => structure.full_scale = full_scale,
            None if says_full_scale => {}
            None => all
                .iter()
                .try_for_each(|record| record.check_live_zeros())?,
        }
        all.iter()
            .try_for_each(|record| record.check_reach(structure.full_scale))?;
        let parameters = parameters_for(&structure, family);
        let parameters = match &self.model {
            Some(file) => file.parameters(parameters)?,
            None => parameters,
        };
        let mut problem =
            IdentificationProblem::new(structure, parameters, records, held_out, self.cut)?;
        self.check_effects(&problem.structure, records)?;
        problem.hold_known = self.model.as_ref().is_some_and(ModelFile::says_hold);
        problem.loss = self.loss;
        let structure = &problem.structure;
        let options = diagnose::Options::on(structure, &self.effects, self.max_effects);
        let limits = match &self.limits {
            Some(limits) => limits.on(structure, &options.effects)?,
            None => Vec::new(),
        };
        let knows_full_scale = self.full_scale.is_some()
            || says_full_scale
            || usual_full_scale(&structure.command_unit).is_some();
        let measured = Measured::of(structure, &all, &self.accuracy);
        let warnings = all.iter().flat_map(|record| record.remarks()).collect();
        let mut prepared = Prepared {
            problem,
            options,
            plan: self.plan.clone(),
            measured,
            knows_full_scale,
            limits,
            warnings,
            call: self.call.clone(),
            edition: self.edition,
            started,
        };
        prepared.remark();
        Ok(prepared)
    }

    /// Refuses an effect of whose forms that were chosen none can be in `records`, unless the whole catalogue is looked through.
    fn check_effects(&self, structure: &Structure, records: &[Record]) -> Result<()> {
        let asked = |entry: &&Entry| self.effects.iter().any(|own| own.name == entry.name);
        let mut effects = self.effects.iter();
        let acts = |entry: &'static Entry| !entry.on(structure).is_empty();
        let in_any_form = |entry: &Entry| {
            let mut own = self.effects.iter();
            own.any(|own| own.cause() == entry.cause() && acts(own))
        };
        let idle = effects.find(|entry| !in_any_form(entry));
        let Some(idle) = idle.filter(|_| !CATALOGUE.iter().all(asked)) else {
            return Ok(());
        };
        let name = idle.name;
        let record = records.first().map_or("the record", |record| &record.name);
        Err(Error::input(
            format!("--effects, {name}"),
            format!(
                "has nothing to act on in {record}; it shows: {}",
                idle.shows
            ),
            format!("leave {name} out, or measure where it shows"),
        ))
    }

    /// What tells results of this session from those of any other, whatever the records.
    #[doc(hidden)]
    pub fn fingerprint(&self) -> String {
        let names: Vec<&str> = self.effects.iter().map(|entry| entry.name).collect();
        let mut fingerprint = Fingerprint::default();
        fingerprint.text(&format!(
            "{:?} {names:?} {} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
            self.reading,
            self.max_effects,
            self.loss.map(OwnLoss::name),
            self.accuracy,
            self.cut,
            self.full_scale,
            self.plan,
            self.call.files,
            self.edition
        ));
        format!("{:016x}", fingerprint.finish())
    }
}

/// The effects that `text` names: `all` of the catalogue, `none`, or `NAME,...`, one's own among them; a name without `~form`
/// stands for all forms.
///
/// # Errors
/// There is no such effect.
pub fn effects_named(text: &str) -> Result<Vec<&'static Entry>> {
    match text {
        "all" => return Ok(CATALOGUE.to_vec()),
        "none" => return Ok(Vec::new()),
        _ => {}
    }
    let mut effects = Vec::new();
    for name in text.split(',').map(str::trim) {
        let before = effects.len();
        effects.extend(known().filter(|one| one.name == name || one.cause() == name));
        if effects.len() == before {
            let names: Vec<&str> = known().map(|entry| entry.name).collect();
            return Err(Error::input(
                format!("--effects {text}"),
                format!("there is no effect {name:?}"),
                format!("give all, none, or some of {}", names.join(",")),
            ));
        }
    }
    Ok(effects)
}

/// Refuses the `value` of the option at `place` unless it is `right`.
fn check(right: bool, place: &str, value: f64, wanted: &str) -> Result<()> {
    match right {
        true => Ok(()),
        false => Err(Error::input(
            place,
            format!("is {value}"),
            format!("give {wanted}"),
        )),
    }
}

fn check_full_scale(full_scale: Option<f64>) -> Result<()> {
    let value = full_scale.unwrap_or(1.0);
    let right = value > 0.0 && value.is_finite();
    check(right, "--full-scale", value, "a number above zero")
}
