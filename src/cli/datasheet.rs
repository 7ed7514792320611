//! `servobee datasheet`.

mod files;
mod print;

use super::options::{self, Options, progress};
use super::work::{end, told};
use super::{card, colour};
use clap::ValueEnum;
use servobee::card::Card;
use servobee::evaluate::problem::Stream;
use servobee::evaluate::{Evaluator, Fingerprint, Memory, interrupted};
use servobee::record::{FlowCurve, ResponseCurve, StepCurve};
use servobee::report::{Call, CutShort, Document, InputFile};
use servobee::search::datasheet::{Case, DROP, FULL_SCALE, Sheet};
use servobee::search::fitted_sheet::FittedSheet;
use servobee::search::{Fit, Neighbourhood, Plan, Settings, Start, fit_all};
use servobee::{Error, Result};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Fit a valve's parameters to the curves of a datasheet
///
/// Without --case, --flow, --response or --step the paper's valve (d675) is fitted. Each curve is fitted with the
/// paper's settings from a hand-set start and from a uniform one, and with a large search that is polished.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee datasheet --case d675
  servobee datasheet --flow my_flow.csv --response my_response.csv --out my_valve

A flow curve has the columns \"opening [%], flow [L/min]\", of one side or, with signs, of both; a response \"frequency
[Hz]\", \"phase [deg]\" or \"gain [dB]\" or both, and \"amplitude [%]\", in any order; a step \"time [s], spool [V]\" and
perhaps \"command [V]\", otherwise the command steps to full scale at 0 s. Points of flow and response may have a
\"weight\". Gains are relative to that of a slow command, and 1 dB counts as 6.6 deg of phase.")]
pub(super) struct Arguments {
    /// A published valve
    #[arg(long, value_enum, conflicts_with_all = ["flow", "response", "step"])]
    case: Option<CaseName>,
    /// Flow over opening, from 0 or on both sides, a CSV file
    #[arg(long, value_name = "FILE")]
    flow: Option<PathBuf>,
    /// Phase, gain or both over frequency and amplitude, a CSV file
    #[arg(long, value_name = "FILE")]
    response: Option<PathBuf>,
    /// A step from rest at 0 s, a CSV file
    #[arg(long, value_name = "FILE")]
    step: Option<PathBuf>,
    /// Pressure drop of the flow curve from P to T, bar
    #[arg(long, value_name = "BAR", default_value_t = DROP, value_parser = drop, requires = "flow")]
    drop: f64,
    /// Amplitude of the response, % of full scale, where its file has none
    #[arg(long, value_name = "PERCENT", value_parser = amplitude, requires = "response")]
    amplitude: Option<f64>,
    /// Sines of the frequency response: as in the paper (four periods, one of which settles), or settled
    #[arg(long, value_enum, default_value_t = StreamName::Paper)]
    stream: StreamName,
    /// What the paper's neighbourhood of 0.01 is a part of: of each parameter's range, or absolute in its unit
    #[arg(long, value_enum, default_value_t = NeighbourhoodName::Relative)]
    ngh: NeighbourhoodName,
    #[command(flatten)]
    options: Options,
}

#[derive(Clone, Copy, ValueEnum)]
enum CaseName {
    D675,
    Kbfdg5v,
    TwoAmplitude,
    Step,
}

impl From<CaseName> for Case {
    fn from(name: CaseName) -> Self {
        match name {
            CaseName::D675 => Self::D675,
            CaseName::Kbfdg5v => Self::Kbfdg5v,
            CaseName::TwoAmplitude => Self::TwoAmplitude,
            CaseName::Step => Self::Step,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum NeighbourhoodName {
    Relative,
    Absolute,
}

impl NeighbourhoodName {
    /// The paper's settings with this reading of its neighbourhood.
    fn paper(self) -> Settings {
        let paper = Settings::paper();
        let (Neighbourhood::Relative(size) | Neighbourhood::Absolute(size)) = paper.ngh;
        let ngh = match self {
            Self::Relative => Neighbourhood::Relative(size),
            Self::Absolute => Neighbourhood::Absolute(size),
        };
        Settings { ngh, ..paper }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum StreamName {
    Paper,
    Settled,
}

impl From<StreamName> for Stream {
    fn from(name: StreamName) -> Self {
        match name {
            StreamName::Paper => Self::Paper,
            StreamName::Settled => Self::Settled,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let output = arguments.options.output()?;
    let edition = arguments.options.run.edition();
    let sheets = sheets(arguments)?;
    let mut chosen = arguments.options.evaluator()?;
    let mut fingerprint = Fingerprint::default();
    fingerprint.text("datasheet");
    for sheet in &sheets {
        let plans = plans(sheet, arguments, &Memory::default());
        fingerprint.text(&format!("{:?} {plans:?}", sheet.problem));
    }
    let memory = arguments.options.begin(fingerprint.finish())?;
    let mut report: Option<Document> = None;
    let mut all = Vec::new();
    let mut broken_off = None;
    for sheet in sheets {
        let started = Instant::now();
        let results = chosen.run(&memory, |evaluator| {
            fits(&sheet, evaluator, arguments, &memory)
        });
        let (results, mut warnings) = told(results, &mut chosen, &memory)?;
        let fitted = FittedSheet::new(sheet, results);
        let best = &fitted.result().fit;
        // The history begins with the start, which is no generation.
        let generations = best.search.history.len() - 1;
        if generations < Settings::large().itr || best.polished.is_none() {
            let stage = format!("{}, generation {generations}", fitted.sheet.title);
            warnings.push(interrupted(&stage));
            broken_off = Some(stage);
        }
        if arguments.options.talks() {
            print::print(&fitted, &edition.units);
        }
        for warning in &warnings {
            colour::warning(warning);
        }
        let mut document = Document::of_sheet(
            &fitted,
            &Card::of(&fitted.sheet.problem, best).beside_sheet(&fitted.sheet),
            &chosen,
            arguments.options.run.seed,
            started.elapsed().as_secs_f64(),
            Call {
                arguments: options::arguments(),
                files: curves(arguments),
                ..Call::default()
            },
            warnings,
        );
        document.cut_short = broken_off.clone().map(|stage| CutShort {
            stage,
            missing: vec![format!("the end of the fit of {}", fitted.sheet.title)],
        });
        report = Some(match report {
            Some(earlier) => earlier.and(document),
            None => document,
        });
        all.push(fitted);
    }
    let report = report.expect("at least one sheet");
    if arguments.options.talks() {
        tell!();
        if let Some(cut) = &report.cut_short {
            colour::answer(cut.sentence());
        }
        card::print(&report.in_units(&edition.units), &edition.units);
    }
    arguments.options.hand_over(&report.to_json(), output, || {
        files::files(&all, &report, &edition)
    })?;
    end(&memory, broken_off.as_deref())
}

/// The files of the curves.
fn curves(arguments: &Arguments) -> Vec<InputFile> {
    let files = [&arguments.flow, &arguments.response, &arguments.step];
    let given = files.into_iter().flatten();
    given.map(|path| InputFile::at(path)).collect()
}

fn sheets(arguments: &Arguments) -> Result<Vec<Sheet>> {
    let full_scale = arguments.options.run.full_scale.unwrap_or(FULL_SCALE);
    let stream = arguments.stream.into();
    let mut sheets = Vec::new();
    let mut warnings = Vec::new();
    if let Some(path) = &arguments.flow {
        let curve = FlowCurve::read(path)?;
        if curve.opening.len() < 4 {
            return Err(Error::input(
                path.display(),
                "a table needs at least four openings",
                "digitise more points",
            ));
        }
        warnings.extend(curve.warnings.clone());
        sheets.push(Sheet::flow(&curve, arguments.drop));
    }
    if let Some(path) = &arguments.response {
        let mut curve = ResponseCurve::read(path)?;
        if let Some(amplitude) = arguments.amplitude {
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
        sheets.push(Sheet::response(&curve, full_scale, stream));
    }
    if let Some(path) = &arguments.step {
        let curve = StepCurve::read(path)?;
        warnings.extend(curve.warnings.clone());
        sheets.push(Sheet::step(&curve, arguments.options.run.full_scale)?);
    }
    for warning in warnings {
        colour::warning(warning);
    }
    if sheets.is_empty() {
        return Case::from(arguments.case.unwrap_or(CaseName::D675)).sheets(full_scale, stream);
    }
    Ok(sheets)
}

fn drop(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(drop) if (1.0..=400.0).contains(&drop) => Ok(drop),
        _ => Err("a number from 1 to 400".into()),
    }
}

fn amplitude(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(amplitude) if amplitude > 0.0 && amplitude <= 100.0 => Ok(amplitude),
        _ => Err("a number above 0, at most 100".into()),
    }
}

/// The paper's settings from both starts, and a large search with polish, which is the result.
fn plans(sheet: &Sheet, arguments: &Arguments, memory: &Memory) -> Vec<(&'static str, Plan)> {
    let paper = arguments.ngh.paper();
    let plan = |settings: Settings, start, polish| Plan {
        method: Arc::new(settings),
        start,
        polish,
        coloured: false,
        memory: memory.clone(),
        ..Plan::of_records(arguments.options.run.seed)
    };
    let hand_set = Start::Near(sheet.problem.start());
    vec![
        (
            "paper's settings, hand-set start",
            plan(paper, hand_set, false),
        ),
        (
            "paper's settings, uniform start",
            plan(paper, Start::Uniform, false),
        ),
        (
            "large search, uniform start, polished",
            plan(Settings::large(), Start::Uniform, true),
        ),
    ]
}

fn fits(
    sheet: &Sheet,
    evaluator: &mut dyn Evaluator,
    arguments: &Arguments,
    memory: &Memory,
) -> Result<Vec<(&'static str, Fit)>> {
    let plans = plans(sheet, arguments, memory);
    // The large search is the longest.
    let (bar, mut tick) = progress(&sheet.title, Settings::large().itr);
    let tasks: Vec<_> = plans
        .iter()
        .map(|(_, plan)| (&sheet.problem, plan))
        .collect();
    let found = fit_all(&tasks, evaluator, &mut tick);
    bar.finish_and_clear();
    Ok(plans.iter().map(|(name, _)| *name).zip(found?).collect())
}
