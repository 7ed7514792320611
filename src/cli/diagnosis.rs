//! Options that say how records are read and diagnosed.

use super::options::RunOptions;
use super::reading::ReadingOptions;
use servobee::card::Accuracy;
use servobee::diagnose::{Cut, ROWS};
use servobee::record::HOLD_OUT;
use servobee::report::{About, Call, InputFile, Limits, ModelFile};
use servobee::search::Plan;
use servobee::session::{MAX_EFFECTS, effects_named};
use servobee::{Result, Session};
use std::path::PathBuf;

/// Options that say how records are read and diagnosed.
#[derive(clap::Args)]
pub(super) struct DiagnosisOptions {
    /// Share of each record that is held out where no record is
    #[arg(long, value_name = "SHARE", default_value_t = HOLD_OUT)]
    hold_out_share: f64,
    /// Largest number of rows that are fitted and held out; of records that have more, stretches all along them are
    #[arg(long, value_name = "N", default_value_t = ROWS)]
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
    #[arg(long, value_name = "N", default_value_t = MAX_EFFECTS)]
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

impl DiagnosisOptions {
    /// What the call says of every record; files that it names beside them are read.
    ///
    /// # Errors
    /// An effect that there is not; a file that cannot be read.
    pub(super) fn session(&self, run: &RunOptions) -> Result<Session> {
        let model = self.model.as_deref().map(ModelFile::read).transpose()?;
        let limits = self.limits.as_deref().map(Limits::read).transpose()?;
        let beside = self.model.iter().chain(&self.limits);
        Ok(Session {
            reading: self.reading.reading(),
            model,
            limits,
            effects: effects_named(&self.effects)?,
            max_effects: self.max_effects,
            accuracy: self.accuracy.clone().unwrap_or_default(),
            cut: Cut {
                hold_out: self.hold_out_share,
                rows: self.max_rows,
            },
            full_scale: run.full_scale,
            plan: Plan::of_records(run.seed),
            call: Call {
                arguments: super::options::arguments(),
                about: self.about.clone().unwrap_or_default(),
                files: beside.map(|path| InputFile::at(path)).collect(),
            },
            edition: run.edition(),
            ..Session::default()
        })
    }
}
