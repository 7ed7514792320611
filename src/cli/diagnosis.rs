//! From records to a diagnosed model and its card: the way that a command goes with one valve, and again with many.

use super::interrupt;
use super::options::RunOptions;
use super::reading::ReadingOptions;
use super::table::number;
use super::work::{Work, interrupted};
use indicatif::ProgressBar;
use servobee::card::{Accuracy, Card, Measured};
use servobee::diagnose::{self, Cut, IdentificationProblem, Identified, ROWS, identify};
use servobee::evaluate::problem::Series;
use servobee::evaluate::{Chosen, Fingerprint, parameters_for, structure_for};
use servobee::model::Structure;
use servobee::model::effects::{CATALOGUE, Entry, entry};
use servobee::record::{HOLD_OUT, Reading, Record, check_mappings, usual_full_scale};
use servobee::report::{About, Call, Document, InputFile, Limit, Limits, ModelFile};
use servobee::search::Plan;
use servobee::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Options that say how records are read and diagnosed.
#[derive(clap::Args)]
pub(super) struct DiagnosisOptions {
    /// Share of each record that is held out where no record is
    #[arg(long, value_name = "SHARE", default_value_t = HOLD_OUT, value_parser = share)]
    hold_out_share: f64,
    /// Largest number of rows that are fitted and held out; of records that have more, stretches all along them are
    #[arg(long, value_name = "N", default_value_t = ROWS, value_parser = rows)]
    max_rows: usize,
    #[command(flatten)]
    reading: ReadingOptions,
    /// A model file: a whole model, or just the settings and parameters that differ from the base model's
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Effects that may be added to the base model
    #[arg(long, value_name = "all|none|NAME,...", default_value = "all")]
    effects: String,
    /// Largest number of effects that are added
    #[arg(long, value_name = "N", default_value_t = 4)]
    max_effects: usize,
    /// How far sensors may be off (95 %), which joins the intervals of the valve card: "flow=0.5 %, pressure=0.2 %", in % of
    /// the largest value of the curve, of the command in % of full scale
    #[arg(long, value_name = "SENSOR=PERCENT,...")]
    accuracy: Option<Accuracy>,
    /// Limits that the valve has to keep, a file with lines such as hysteresis = "<= 3 %", of figures of the valve card or
    /// parameters: met by whole 95 % intervals; exit code 3 unless all are
    #[arg(long, value_name = "LIMITS.toml")]
    limits: Option<PathBuf>,
    /// What the report shall say of the valve and the test: "serial = 4711, operator = J. Doe, oil = ISO VG 46"
    #[arg(long, value_name = "NAME=VALUE,...")]
    about: Option<About>,
}

/// What the call says of every record that it diagnoses.
pub(super) struct Setup {
    reading: Reading,
    file: Option<ModelFile>,
    limits: Option<Limits>,
    entries: Vec<&'static Entry>,
    /// Whether the call names these, and no other word stands for them.
    named: bool,
    max_effects: usize,
    accuracy: Accuracy,
    cut: Cut,
    full_scale: Option<f64>,
    seed: u64,
    /// The call, and the files that it names beside the records.
    pub(super) call: Call,
}

impl DiagnosisOptions {
    /// Reads what the call names beside the records.
    ///
    /// # Errors
    /// An effect that there is not; a file that cannot be read.
    pub(super) fn setup(&self, run: &RunOptions) -> Result<Setup> {
        let file = self.model.as_deref().map(ModelFile::read).transpose()?;
        let limits = self.limits.as_deref().map(Limits::read).transpose()?;
        let beside = self.model.iter().chain(&self.limits);
        Ok(Setup {
            reading: self.reading.reading(),
            file,
            limits,
            entries: entries(&self.effects)?,
            named: !matches!(self.effects.as_str(), "all" | "none"),
            max_effects: self.max_effects,
            accuracy: self.accuracy.clone().unwrap_or_default(),
            cut: Cut {
                hold_out: self.hold_out_share,
                rows: self.max_rows,
            },
            full_scale: run.full_scale,
            seed: run.seed,
            call: Call {
                arguments: super::options::arguments(),
                about: self.about.clone().unwrap_or_default(),
                files: beside.map(|path| InputFile::at(path)).collect(),
            },
        })
    }
}

impl Setup {
    /// What tells results of this call from those of any other, whatever the records.
    pub(super) fn fingerprint(&self) -> String {
        let names: Vec<&str> = self.entries.iter().map(|entry| entry.name).collect();
        let files = &self.call.files;
        let mut fingerprint = Fingerprint::default();
        fingerprint.text(&format!(
            "{:?} {names:?} {} {:?} {:?} {:?} {} {files:?}",
            self.reading, self.max_effects, self.accuracy, self.cut, self.full_scale, self.seed
        ));
        format!("{:016x}", fingerprint.finish())
    }

    /// The records at `paths`, each with a channel that can be fitted.
    ///
    /// # Errors
    /// A file that is no such record.
    pub(super) fn read(&self, paths: &[PathBuf]) -> Result<Vec<Record>> {
        let read = |path: &PathBuf| {
            let record = Record::read_as(path, &self.reading)?;
            record.check_response()?;
            Ok(record)
        };
        paths.iter().map(read).collect()
    }

    /// The problem that `records` pose, scored on those `held_out`.
    ///
    /// # Errors
    /// Records in which nothing moves, that have not the same channels, that the model file does not suit, or in which an effect
    /// that the call names has nothing to act on.
    pub(super) fn prepare(&self, records: &[Record], held_out: &[Record]) -> Result<Prepared> {
        self.prepare_among(records, records, held_out)
    }

    /// The same, on the base model that all of `family` ask for, of which `records` are some.
    ///
    /// # Errors
    /// As of [`Setup::prepare`].
    pub(super) fn prepare_among(
        &self,
        family: &[Record],
        records: &[Record],
        held_out: &[Record],
    ) -> Result<Prepared> {
        let all: Vec<&Record> = records.iter().chain(held_out).collect();
        check_mappings(&self.reading.mappings, &all)?;
        records.iter().try_for_each(Record::check_excited)?;
        let mut structure = match &self.file {
            Some(file) => file.structure(|| structure_for(family))?,
            None => structure_for(family)?,
        };
        let says_full_scale = self.file.as_ref().is_some_and(ModelFile::says_full_scale);
        match self.full_scale {
            Some(full_scale) => structure.full_scale = full_scale,
            None if says_full_scale => {}
            None => all
                .iter()
                .try_for_each(|record| record.check_live_zeros())?,
        }
        let parameters = parameters_for(&structure, family);
        let parameters = match &self.file {
            Some(file) => file.parameters(parameters)?,
            None => parameters,
        };
        let problem =
            IdentificationProblem::new(structure, parameters, records, held_out, self.cut)?;
        if self.named {
            check_asked(&self.entries, &problem.structure, records)?;
        }
        let options = diagnose::Options::on(&problem.structure, &self.entries, self.max_effects);
        let limits = match &self.limits {
            Some(limits) => limits.on(&problem.structure, &options.effects)?,
            None => Vec::new(),
        };
        let mut prepared = Prepared {
            options,
            limits,
            plan: Plan::of_records(self.seed),
            measured: Measured::of(&problem.structure, &all, &self.accuracy),
            knows_full_scale: self.full_scale.is_some()
                || says_full_scale
                || usual_full_scale(&problem.structure.command_unit).is_some(),
            warnings: all.iter().flat_map(|record| record.remarks()).collect(),
            problem,
        };
        prepared.problem.hold_known = self.file.as_ref().is_some_and(ModelFile::says_hold);
        prepared.remark();
        Ok(prepared)
    }
}

/// A problem before its diagnosis.
pub(super) struct Prepared {
    problem: IdentificationProblem,
    options: diagnose::Options,
    plan: Plan,
    measured: Measured,
    knows_full_scale: bool,
    limits: Vec<Limit>,
    /// What undermines the result whatever it is.
    warnings: Vec<String>,
}

impl Prepared {
    /// Says what was assumed and what was left out.
    fn remark(&mut self) {
        let structure = &self.problem.structure;
        let measurements = &mut self.problem.measurements;
        if !self.knows_full_scale {
            measurements.bench.push(format!(
                "full scale is taken to be the largest |command|, {} {}: what the valve card has in shares of it is not \
                 determined until --full-scale or a model file gives it",
                number(structure.full_scale),
                structure.command_unit
            ));
        }
        let used = measurements.used();
        if used < measurements.rows {
            let stretches = measurements.fit.len() + measurements.hold_out.len();
            self.warnings.push(format!(
                "of {} rows {used} are used, in {stretches} stretches all along the records: --max-rows sets how many",
                measurements.rows
            ));
        }
    }

    /// What the records show of the card.
    pub(super) fn measured(&self) -> Measured {
        self.measured.clone()
    }

    /// How it is fitted, with what `work` remembers.
    pub(super) fn plan(&self, work: &Work) -> Plan {
        Plan {
            memory: work.memory.clone(),
            ..self.plan.clone()
        }
    }

    /// The command between two rows is taken as in `other`: one logger wrote both.
    pub(super) fn takes_hold_of(&mut self, other: &Identified) {
        self.problem.structure.hold = other.after.problem.structure.hold;
        self.problem.hold_known = true;
    }

    /// What tells this diagnosis from any other.
    pub(super) fn fingerprint(&self) -> u64 {
        let Self {
            problem,
            plan,
            options,
            ..
        } = self;
        let mut fingerprint = Fingerprint::default();
        fingerprint.text(&format!(
            "identify {:?} {:?} {} {plan:?} {options:?}",
            problem.structure, problem.parameters, problem.hold_known
        ));
        let measurements = &problem.measurements;
        for series in measurements.fit.iter().chain(&measurements.hold_out) {
            tell_of(&mut fingerprint, series);
        }
        fingerprint.finish()
    }

    /// The diagnosis, the card of its result, and what the user has to be told of the run; `bar` shows the stage.
    ///
    /// # Errors
    /// As of [`identify`] and [`Work::run`].
    pub(super) fn diagnose(
        self,
        chosen: &mut Chosen,
        work: &Work,
        bar: &ProgressBar,
    ) -> Result<Diagnosed> {
        let plan = self.plan(work);
        let result = work.run(chosen, |evaluator| {
            identify(
                self.problem.clone(),
                evaluator,
                &plan,
                &self.options,
                &mut |stage| {
                    bar.set_message(stage.to_owned());
                    interrupt::goes_on()
                },
            )
        });
        bar.set_message("valve card");
        result.map(|(identified, of_run)| {
            let after = &identified.after;
            let hold = after.problem.structure.hold;
            let card = Card::of(&after.problem, &after.fit).beside(self.measured, hold);
            let card = match self.knows_full_scale {
                true => card,
                false => card.without_full_scale(),
            };
            let warnings = self.warnings.into_iter().chain(of_run).collect();
            Diagnosed {
                identified,
                card,
                limits: self.limits,
                warnings,
            }
        })
    }
}

/// A diagnosis and what belongs to it.
pub(super) struct Diagnosed {
    pub(super) identified: Identified,
    pub(super) card: Card,
    limits: Vec<Limit>,
    warnings: Vec<String>,
}

impl Diagnosed {
    /// The report of it, of a run that has `started` then.
    pub(super) fn document(
        &self,
        chosen: &Chosen,
        run: &RunOptions,
        started: Instant,
        call: Call,
    ) -> Document {
        let interrupted = self.identified.broken_off.as_deref().map(interrupted);
        let mut document = Document::of(
            &self.identified,
            &self.card,
            chosen,
            run.seed,
            started.elapsed().as_secs_f64(),
            call,
            self.warnings.iter().cloned().chain(interrupted).collect(),
        );
        document.judge(&self.limits);
        document
    }
}

/// Tells `fingerprint` what is measured.
fn tell_of(fingerprint: &mut Fingerprint, series: &Series) {
    fingerprint.text(&series.name).values(&series.time);
    for sample in &series.samples {
        fingerprint
            .values(&sample.input.numbers())
            .values(&sample.target.0)
            .values(&[sample.weight]);
    }
}

fn share(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.05..=0.9).contains(&share) => Ok(share),
        _ => Err("a number from 0.05 to 0.9".into()),
    }
}

fn rows(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(rows) if rows >= 1000 => Ok(rows),
        _ => Err("a whole number from 1000 on".into()),
    }
}

/// Refuses an effect among `entries` that was asked for by its name and cannot be in `records`.
fn check_asked(
    entries: &[&'static Entry],
    structure: &Structure,
    records: &[Record],
) -> Result<()> {
    let Some(idle) = entries.iter().find(|entry| entry.on(structure).is_empty()) else {
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

/// The entries of the catalogue that `--effects` names.
fn entries(text: &str) -> Result<Vec<&'static Entry>> {
    match text {
        "all" => return Ok(CATALOGUE.to_vec()),
        "none" => return Ok(Vec::new()),
        _ => {}
    }
    let find = |name: &str| {
        entry(name.trim()).ok_or_else(|| {
            let names: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
            Error::input(
                format!("--effects {text}"),
                format!("there is no effect {:?}", name.trim()),
                format!("give all, none, or some of {}", names.join(",")),
            )
        })
    };
    text.split(',').map(find).collect()
}
