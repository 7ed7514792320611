//! `servobee datasheet`.

use super::options::{self, Options, progress};
use super::table::{number, table};
use super::work::interrupted;
use super::{card, colour};
use clap::ValueEnum;
use servobee::card::Card;
use servobee::diagnose::Sides;
use servobee::diagnose::Verdict;
use servobee::evaluate::Score;
use servobee::evaluate::problem::Stream;
use servobee::evaluate::{Chosen, Evaluator, Fingerprint, Memory, Problem};
use servobee::record::{FlowCurve, ResponseCurve, StepCurve};
use servobee::report::ModelFile;
use servobee::report::{
    CutShort, Document, ErrorPair, Improvements, InputFile, ParameterReport, Program,
    RemainingReport, SCHEMA, datasheet_page, not_identifiable, now,
};
use servobee::search::datasheet::{Case, DROP, FULL_SCALE, Measured, Sheet};
use servobee::search::{Fit, Neighbourhood, Plan, Settings, Start, fit_all};
use servobee::{Error, Result};
use std::collections::BTreeMap;
use std::path::PathBuf;
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
    let sheets = sheets(arguments)?;
    let mut chosen = arguments.options.evaluator()?;
    let mut fingerprint = Fingerprint::default();
    fingerprint.text("datasheet");
    for sheet in &sheets {
        let plans = plans(sheet, arguments, &Memory::default());
        fingerprint.text(&format!("{:?} {plans:?}", sheet.problem));
    }
    let work = arguments.options.begin(fingerprint.finish())?;
    let mut report: Option<Document> = None;
    let mut fitted = Vec::new();
    let mut broken_off = None;
    for sheet in sheets {
        let started = Instant::now();
        let (results, mut warnings) = work.run(&mut chosen, |evaluator| {
            fits(&sheet, evaluator, arguments, &work.memory)
        })?;
        let best = results
            .last()
            .map(|(_, fit)| fit)
            .expect("every sheet is fitted");
        // The history begins with the start, which is no generation.
        let generations = best.search.history.len() - 1;
        if generations < Settings::large().itr || best.polished.is_none() {
            let stage = format!("{}, generation {generations}", sheet.title);
            warnings.push(interrupted(&stage));
            broken_off = Some(stage);
        }
        if arguments.options.talks() {
            print(&sheet, &results);
        }
        let seconds = started.elapsed().as_secs_f64();
        let evaluations = results.iter().map(|(_, fit)| fit.evaluations).sum();
        for warning in &warnings {
            colour::warning(warning);
        }
        let mut document = document(
            &sheet,
            best,
            &chosen,
            arguments.options.seed,
            evaluations,
            seconds,
        );
        document.warnings.extend(warnings);
        document.files = curves(arguments);
        document.cut_short = broken_off.clone().map(|stage| CutShort {
            stage,
            missing: vec![format!("the end of the fit of {}", sheet.title)],
        });
        report = Some(match report {
            Some(earlier) => earlier.and(document),
            None => document,
        });
        fitted.push((sheet, results));
    }
    let report = report.expect("at least one sheet");
    if arguments.options.talks() {
        tell!();
        if let Some(cut) = &report.cut_short {
            colour::answer(cut.sentence());
        }
        card::print(&report);
    }
    arguments
        .options
        .hand_over(&report, output, || files(&fitted, &report))?;
    work.end(broken_off.as_deref())
}

/// The files of the curves.
fn curves(arguments: &Arguments) -> Vec<InputFile> {
    let files = [&arguments.flow, &arguments.response, &arguments.step];
    let given = files.into_iter().flatten();
    given.map(|path| InputFile::at(path)).collect()
}

/// The files of the fitted sheets: a report of all, and a model and its points for each.
fn files(fitted: &[(Sheet, Vec<(&'static str, Fit)>)], report: &Document) -> Vec<(String, String)> {
    let mut files = vec![
        ("report.json".into(), report.to_json()),
        ("report.html".into(), datasheet_page(fitted, report)),
    ];
    for (sheet, results) in fitted {
        let (_, best) = results.last().expect("every sheet is fitted");
        let prefix = match fitted.len() {
            1 => String::new(),
            _ => format!("{}_", sheet.measured[0].name),
        };
        files.push((
            format!("{prefix}model.toml"),
            model_toml(&sheet.problem, best),
        ));
        files.push((format!("{prefix}points.csv"), points_csv(sheet, best)));
    }
    files
}

fn sheets(arguments: &Arguments) -> Result<Vec<Sheet>> {
    let full_scale = arguments.options.full_scale.unwrap_or(FULL_SCALE);
    let stream = arguments.stream.into();
    let mut sheets = Vec::new();
    let mut warnings = Vec::new();
    if let Some(path) = &arguments.flow {
        let curve = FlowCurve::read(path)?;
        if curve.opening.len() < 4 {
            let place = path.display();
            return Err(Error::input(
                place,
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
        sheets.push(Sheet::step(&curve, arguments.options.full_scale)?);
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
    let plan = |settings, start, polish| Plan {
        settings,
        start,
        seed: arguments.options.seed,
        polish,
        coloured: false,
        memory: memory.clone(),
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
    let generations = plans.iter().map(|(_, plan)| plan.settings.itr).max();
    let (bar, mut tick) = progress(&sheet.title, generations.expect("three plans"));
    let tasks: Vec<_> = plans
        .iter()
        .map(|(_, plan)| (&sheet.problem, plan))
        .collect();
    let found = fit_all(&tasks, evaluator, &mut tick);
    bar.finish_and_clear();
    Ok(plans.iter().map(|(name, _)| *name).zip(found?).collect())
}

fn print(sheet: &Sheet, results: &[(&str, Fit)]) {
    tell!("\n{}", capitalised(&sheet.title));
    for note in &sheet.notes {
        tell!("  {note}");
    }
    let mut rows = Vec::new();
    for (name, fit) in results {
        let cost = |cost: Option<f64>| cost.map_or("diverged".into(), number);
        let mut row = vec![
            (*name).to_owned(),
            cost(fit.cost_at_start),
            cost(fit.cost()),
        ];
        for errors in sheet.errors(fit.values()) {
            let known = errors.iter().flatten();
            let worst = known.fold(0.0f64, |worst, error| worst.max(error.abs()));
            row.extend([number(rms(&errors)), number(worst)]);
        }
        row.push(fit.evaluations.to_string());
        rows.push(row);
    }
    let mut head = vec![
        "search".to_owned(),
        "cost before".into(),
        "cost after".into(),
    ];
    for Measured { unit, .. } in &sheet.measured {
        head.extend([format!("RMS [{unit}]"), format!("worst [{unit}]")]);
    }
    head.push("evaluations".into());
    tell!("{}", table(&head, rows));

    let best = results
        .last()
        .map(|(_, fit)| fit)
        .expect("every sheet is fitted");
    let published = sheet.published.iter().any(Option::is_some);
    let mut rows = Vec::new();
    for (parameter, published_value) in ParameterReport::of(&sheet.problem, best)
        .iter()
        .zip(&sheet.published)
    {
        let mut row = vec![parameter.name.clone(), parameter.unit.clone()];
        if published {
            row.push(published_value.map_or(String::new(), number));
        }
        row.push(number(parameter.value));
        row.push(parameter.interval(".."));
        row.push(if parameter.at_bound {
            "at its bound".into()
        } else {
            String::new()
        });
        rows.push(row);
    }
    let mut head = vec!["parameter", "unit"];
    head.extend(published.then_some("published"));
    head.extend(["fitted", "95 % interval", ""]);
    tell!("{}", table(&head, rows));
    for line in not_identifiable(best) {
        tell!("Not identifiable: {line}");
    }

    let simulated = sheet.simulated(&sheet.problem, best.values());
    let mut rows: Vec<Vec<String>> = sheet
        .points
        .iter()
        .map(|point| point.iter().map(|&value| number(value)).collect())
        .collect();
    let mut head: Vec<String> = sheet.axes.clone();
    for (measured, simulated) in sheet.measured.iter().zip(simulated) {
        head.extend([
            format!("{} [{}]", measured.name, measured.unit),
            "fitted".into(),
            "error".into(),
        ]);
        for ((row, measured), simulated) in rows.iter_mut().zip(&measured.values).zip(simulated) {
            let shown = |value: Option<f64>| value.map_or("-".into(), number);
            row.extend([
                shown(*measured),
                number(simulated),
                shown(measured.map(|measured| measured - simulated)),
            ]);
        }
    }
    tell!("{}", table(&head, rows));
    for (measured, change) in sheet.measured.iter().zip(integration_errors(sheet, best)) {
        let Measured { name, unit, .. } = measured;
        tell!(
            "Halving the integration steps changes the {name} by at most {} {unit}.",
            number(change)
        );
    }
    if sheet.axes.len() == 2 {
        for (measured, errors) in sheet.measured.iter().zip(sheet.errors(best.values())) {
            print_by_amplitude(sheet, measured, &errors);
        }
    }
}

/// What a response's fit leaves of a quantity at each amplitude, and where along the frequency.
fn print_by_amplitude(sheet: &Sheet, measured: &Measured, errors: &[Option<f64>]) {
    let mut amplitudes: Vec<f64> = sheet.points.iter().map(|point| point[0]).collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup();
    for amplitude in amplitudes {
        let own: Vec<(f64, f64)> = sheet
            .points
            .iter()
            .zip(errors)
            .filter(|(point, _)| point[0] == amplitude)
            .filter_map(|(point, &error)| Some((point[1], error?)))
            .collect();
        let extreme = |sign: f64| {
            own.iter()
                .max_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)))
        };
        let (Some(low), Some(high)) = (extreme(-1.0), extreme(1.0)) else {
            continue;
        };
        let all: Vec<Option<f64>> = own.iter().map(|pair| Some(pair.1)).collect();
        tell!(
            "Left at {} %: {} {unit} RMS, between {} {unit} at {} Hz and {} {unit} at {} Hz",
            number(amplitude),
            number(rms(&all)),
            number(low.1),
            number(low.0),
            number(high.1),
            number(high.0),
            unit = measured.unit,
        );
    }
}

fn rms(errors: &[Option<f64>]) -> f64 {
    let known: Vec<f64> = errors.iter().flatten().copied().collect();
    (known.iter().map(|value| value * value).sum::<f64>() / known.len() as f64).sqrt()
}

fn document(
    sheet: &Sheet,
    fit: &Fit,
    chosen: &Chosen,
    seed: u64,
    evaluations: usize,
    seconds: f64,
) -> Document {
    let problem: &Problem = &sheet.problem;
    let simulated = sheet.simulated(problem, fit.values());
    let score = |(measured, simulated): (&Measured, &Vec<f64>)| {
        let pairs = measured.values.iter().zip(simulated);
        let known = pairs.filter_map(|(measured, &simulated)| Some(((*measured)?, simulated)));
        (measured.name.to_owned(), Score::new(known))
    };
    let names = sheet
        .measured
        .iter()
        .map(|measured| measured.name.to_owned());
    let sides = Sides {
        fit: sheet.measured.iter().zip(&simulated).map(score).collect(),
        hold_out: BTreeMap::new(),
    };
    Document {
        schema: SCHEMA,
        verdict: Verdict::NotDiagnosed,
        asked: Vec::new(),
        cut_short: None,
        effects: Vec::new(),
        considered: Vec::new(),
        free_form: None,
        explained: None,
        error: ErrorPair {
            before: sides.clone(),
            after: sides,
            improvement: Improvements::default(),
        },
        noise_floor: BTreeMap::new(),
        noise_method: BTreeMap::new(),
        parameters: ParameterReport::of(problem, fit),
        not_identifiable: not_identifiable(fit),
        card: Card::of(problem, fit).figures,
        remaining: RemainingReport::default(),
        integration_error: names.zip(integration_errors(sheet, fit)).collect(),
        evaluator: chosen.evaluator.describe(),
        evaluator_reason: chosen.why.clone(),
        seed,
        evaluations,
        hold: None,
        records: Vec::new(),
        files: Vec::new(),
        program: Program::default(),
        arguments: options::arguments(),
        seconds,
        date: now(),
        warnings: sheet.notes.clone(),
    }
}

/// The largest change of each quantity at any point when the integration steps are halved.
fn integration_errors(sheet: &Sheet, fit: &Fit) -> Vec<f64> {
    let simulated = sheet.simulated(&sheet.problem, fit.values());
    let finer = sheet.simulated(&sheet.problem.refined(2), fit.values());
    let change = |(coarse, fine): (&Vec<f64>, &Vec<f64>)| {
        let pairs = coarse.iter().zip(fine);
        pairs.fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
    };
    simulated.iter().zip(&finer).map(change).collect()
}

fn model_toml(problem: &Problem, fit: &Fit) -> String {
    let values = problem.complete(fit.values(), |fixed| fixed);
    ModelFile::to_toml(&problem.structure, &problem.parameters, &values)
}

fn points_csv(sheet: &Sheet, fit: &Fit) -> String {
    let mut lines = vec![sheet.axes.clone()];
    let cells = |point: &Vec<f64>| point.iter().map(ToString::to_string).collect();
    lines.extend(sheet.points.iter().map(cells));
    let simulated = sheet.simulated(&sheet.problem, fit.values());
    for (measured, simulated) in sheet.measured.iter().zip(simulated) {
        let Measured { name, unit, values } = measured;
        lines[0].extend([
            format!("{name} [{unit}]"),
            format!("fitted {name} [{unit}]"),
        ]);
        for ((line, measured), simulated) in lines[1..].iter_mut().zip(values).zip(simulated) {
            let measured = measured.map_or(String::new(), |measured| measured.to_string());
            line.extend([measured, simulated.to_string()]);
        }
    }
    let line = |cells: &Vec<String>| cells.join(",") + "\n";
    lines.iter().map(line).collect()
}

fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| {
        first.to_uppercase().chain(characters).collect()
    })
}
