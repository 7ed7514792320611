//! The way from the curves of a datasheet to a page.

mod files;

use super::{check, check_full_scale};
use crate::card::Card;
use crate::evaluate::problem::Stream;
use crate::evaluate::{Chosen, Fingerprint, Memory, interrupted};
use crate::record::{FlowCurve, ResponseCurve, StepCurve};
use crate::report::{Call, CutShort, Document, Edition, InputFile, OutputFolder};
use crate::search::datasheet::{Case, DROP, FULL_SCALE, Sheet};
use crate::search::fitted_sheet::FittedSheet;
use crate::search::{Fit, Plan, Settings, Start, fit_all};
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// The search whose best is polished: it need find the valley, and no more.
const LARGE: Settings = Settings {
    itr: 25,
    ..Settings::large()
};

/// The curves of a datasheet, and how they are fitted: what the command `datasheet` does with them, too.
#[derive(Debug, Clone)]
pub struct Datasheet {
    /// The published valve that is fitted where no curve is given.
    pub case: Case,
    /// A file of flow over opening.
    pub flow: Option<PathBuf>,
    /// A file of phase, gain or both over frequency.
    pub response: Option<PathBuf>,
    /// A file of a step from rest.
    pub step: Option<PathBuf>,
    /// Pressure drop of the flow curve from P to T, bar.
    pub drop: f64,
    /// Amplitude of the response, % of full scale, where its file has none.
    pub amplitude: Option<f64>,
    /// The command at full scale, in its unit, where it is known.
    pub full_scale: Option<f64>,
    /// How long the sines of the response last.
    pub stream: Stream,
    /// The settings of the searches that are as in the paper.
    pub paper: Settings,
    /// Seed of the searches.
    pub seed: u64,
    /// What the report says of how it came about; the curves join its files.
    pub call: Call,
    /// The units and the language of its page.
    pub edition: Edition,
}

impl Default for Datasheet {
    /// What `servobee datasheet` does where nothing is said.
    fn default() -> Self {
        Self {
            case: Case::D675,
            flow: None,
            response: None,
            step: None,
            drop: DROP,
            amplitude: None,
            full_scale: None,
            stream: Stream::Paper,
            paper: Settings::paper(),
            seed: 1,
            call: Call::default(),
            edition: Edition::default(),
        }
    }
}

/// The curves as they were read, before they are fitted.
#[derive(Debug)]
pub struct PreparedSheets {
    sheets: Vec<Sheet>,
    warnings: Vec<String>,
    paper: Settings,
    seed: u64,
    memory: Memory,
    call: Call,
    edition: Edition,
}

/// The curves with their fits.
#[derive(Debug)]
pub struct FittedSheets {
    /// Each curve.
    pub sheets: Vec<FittedSheet>,
    /// The report of all: `report.json`.
    pub document: Document,
    /// What has to be said of the run.
    pub warnings: Vec<String>,
    /// Where it was broken off, if it was.
    pub broken_off: Option<String>,
    /// The units and the language of the page.
    pub edition: Edition,
}

impl Datasheet {
    /// Reads the curves.
    ///
    /// # Errors
    /// A file that is no such curve; a pressure drop or an amplitude that none has.
    pub fn prepare(&self) -> Result<PreparedSheets> {
        check_full_scale(self.full_scale)?;
        let drop = (1.0..=400.0).contains(&self.drop);
        check(drop, "--drop", self.drop, "a number from 1 to 400")?;
        if let Some(amplitude) = self.amplitude {
            let right = amplitude > 0.0 && amplitude <= 100.0;
            check(
                right,
                "--amplitude",
                amplitude,
                "a number above 0, at most 100",
            )?;
        }
        let (sheets, warnings) = self.sheets()?;
        let files = [&self.flow, &self.response, &self.step];
        let files = files.into_iter().flatten();
        let mut call = self.call.clone();
        call.files.extend(files.map(|path| InputFile::at(path)));
        Ok(PreparedSheets {
            sheets,
            warnings,
            paper: self.paper,
            seed: self.seed,
            memory: Memory::default(),
            call,
            edition: self.edition,
        })
    }

    /// The curves, and what has to be said of them.
    fn sheets(&self) -> Result<(Vec<Sheet>, Vec<String>)> {
        let full_scale = self.full_scale.unwrap_or(FULL_SCALE);
        let mut sheets = Vec::new();
        let mut warnings = Vec::new();
        if let Some(path) = &self.flow {
            let curve = FlowCurve::read(path)?;
            if curve.opening.len() < 4 {
                return Err(Error::input(
                    path.display(),
                    "a table needs at least four openings",
                    "digitise more points",
                ));
            }
            warnings.extend(curve.warnings.clone());
            sheets.push(Sheet::flow(&curve, self.drop));
        }
        if let Some(path) = &self.response {
            let mut curve = ResponseCurve::read(path)?;
            if let Some(amplitude) = self.amplitude {
                if curve.points[0].amplitude.is_some() {
                    return Err(Error::input(
                        path.display(),
                        format!("has amplitudes, and --amplitude says {amplitude} %"),
                        "leave out --amplitude, or delete the column",
                    ));
                }
                for point in &mut curve.points {
                    point.amplitude = Some(amplitude);
                }
            }
            warnings.extend(curve.warnings.clone());
            sheets.push(Sheet::response(&curve, full_scale, self.stream));
        }
        if let Some(path) = &self.step {
            let curve = StepCurve::read(path)?;
            warnings.extend(curve.warnings.clone());
            sheets.push(Sheet::step(&curve, self.full_scale)?);
        }
        if sheets.is_empty() {
            sheets = self.case.sheets(full_scale, self.stream)?;
        }
        Ok((sheets, warnings))
    }
}

impl PreparedSheets {
    /// How many generations the longest search of a curve has.
    pub fn generations(&self) -> usize {
        LARGE.itr
    }

    /// What has to be said of the curves.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The same with what this `memory` remembers, and stopped by what stops it.
    pub fn remembering(self, memory: Memory) -> Self {
        Self { memory, ..self }
    }

    /// What tells these fits from any other.
    #[doc(hidden)]
    pub fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("datasheet");
        for sheet in &self.sheets {
            let plans = self.plans(sheet);
            fingerprint.text(&format!("{:?} {plans:?}", sheet.problem));
        }
        fingerprint.finish()
    }

    /// Fits every curve with the paper's settings from a hand-set start and from a uniform one, and with a large search that is
    /// polished, which is the result. `progress` is told the curve and the generation, and may break off.
    ///
    /// # Errors
    /// The evaluator fails.
    pub fn fit(
        self,
        chosen: &mut Chosen,
        progress: &mut dyn FnMut(&str, usize) -> ControlFlow<()>,
    ) -> Result<FittedSheets> {
        let mut all = Vec::new();
        let mut told = Vec::new();
        let mut report: Option<Document> = None;
        let mut broken_off = None;
        for sheet in &self.sheets {
            let started = Instant::now();
            let (fits, mut warnings) = chosen.run(&self.memory, |evaluator| {
                let plans = self.plans(sheet);
                let tasks: Vec<_> = plans
                    .iter()
                    .map(|(_, plan)| (&sheet.problem, plan))
                    .collect();
                let found = fit_all(&tasks, evaluator, &mut |generation| {
                    progress(&sheet.title, generation)
                })?;
                let names = plans.iter().map(|(name, _)| *name);
                Ok(names.zip(found).collect::<Vec<(&str, Fit)>>())
            })?;
            let fitted = FittedSheet::new(sheet.clone(), fits);
            let best = &fitted.result().fit;
            // The history begins with the start, which is no generation.
            let generations = best.search.history.len() - 1;
            if generations < self.generations() || best.polished.is_none() {
                let stage = format!("{}, generation {generations}", sheet.title);
                warnings.push(interrupted(&stage));
                broken_off = Some(stage);
            }
            told.extend(warnings.clone());
            let mut document = Document::of_sheet(
                &fitted,
                &Card::of(&sheet.problem, best).beside_sheet(sheet),
                chosen,
                self.seed,
                started.elapsed().as_secs_f64(),
                self.call.clone(),
                warnings,
            );
            document.cut_short = broken_off.clone().map(|stage| CutShort {
                stage,
                missing: vec![format!("the end of the fit of {}", sheet.title)],
            });
            report = Some(match report {
                Some(earlier) => earlier.and(document),
                None => document,
            });
            all.push(fitted);
        }
        Ok(FittedSheets {
            sheets: all,
            document: report.expect("at least one sheet"),
            warnings: told,
            broken_off,
            edition: self.edition,
        })
    }

    /// The searches of a curve; the last is the result.
    fn plans(&self, sheet: &Sheet) -> Vec<(&'static str, Plan)> {
        let plan = |settings: Settings, start, polish| Plan {
            method: Arc::new(settings),
            start,
            polish,
            coloured: false,
            memory: self.memory.clone(),
            ..Plan::of_records(self.seed)
        };
        let hand_set = Start::Near(sheet.problem.start());
        vec![
            (
                "paper's settings, hand-set start",
                plan(self.paper, hand_set, false),
            ),
            (
                "paper's settings, uniform start",
                plan(self.paper, Start::Uniform, false),
            ),
            (
                "large search, uniform start, polished",
                plan(LARGE, Start::Uniform, true),
            ),
        ]
    }
}

impl FittedSheets {
    /// The files of the result, each with its name: report and page of all, and a model and its points for each curve.
    pub fn files(&self) -> Vec<(String, String)> {
        files::files(&self.sheets, &self.document, &self.edition)
    }

    /// Writes the files into `folder`, which is made; into one that exists only by `force`.
    ///
    /// # Errors
    /// It exists, or cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>, force: bool) -> Result<()> {
        OutputFolder::reserve(folder.as_ref(), force)?.write(&self.files())
    }
}
