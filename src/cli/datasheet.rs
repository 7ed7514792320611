//! `servobee datasheet`.

mod print;

use super::options::{self, Options, progress};
use super::work::{end, told};
use super::{card, colour};
use clap::ValueEnum;
use servobee::Result;
use servobee::evaluate::problem::Stream;
use servobee::report::Call;
use servobee::search::datasheet::{Case, DROP};
use servobee::search::{Neighbourhood, Settings};
use servobee::session::Datasheet;
use std::path::PathBuf;

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
    #[arg(long, value_name = "BAR", default_value_t = DROP, requires = "flow")]
    drop: f64,
    /// Amplitude of the response, % of full scale, where its file has none
    #[arg(long, value_name = "PERCENT", requires = "response")]
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
    let options = &arguments.options;
    let output = options.output()?;
    let prepared = datasheet(arguments).prepare()?;
    prepared.warnings().iter().for_each(colour::warning);
    let mut chosen = options.evaluator()?;
    let memory = options.begin(prepared.fingerprint())?;
    let prepared = prepared.remembering(memory.clone());
    let (bar, mut tick) = progress("", prepared.generations());
    let fitted = prepared.fit(&mut chosen, &mut |title, generation| {
        bar.set_message(title.to_owned());
        tick(generation)
    });
    bar.finish_and_clear();
    let fitted = told(fitted, &mut chosen, &memory)?;
    let units = fitted.edition.units;
    if options.talks() {
        for sheet in &fitted.sheets {
            print::print(sheet, &units);
        }
    }
    fitted.warnings.iter().for_each(colour::warning);
    let report = &fitted.document;
    if options.talks() {
        tell!();
        if let Some(cut) = &report.cut_short {
            colour::answer(cut.sentence());
        }
        card::print(&report.in_units(&units), &units);
    }
    options.hand_over(&report.to_json(), output, || fitted.files())?;
    end(&memory, fitted.broken_off.as_deref())
}

/// What the call says.
fn datasheet(arguments: &Arguments) -> Datasheet {
    let run = &arguments.options.run;
    Datasheet {
        case: arguments.case.map_or(Case::D675, Case::from),
        flow: arguments.flow.clone(),
        response: arguments.response.clone(),
        step: arguments.step.clone(),
        drop: arguments.drop,
        amplitude: arguments.amplitude,
        full_scale: run.full_scale,
        stream: arguments.stream.into(),
        paper: arguments.ngh.paper(),
        seed: run.seed,
        call: Call {
            arguments: options::arguments(),
            ..Call::default()
        },
        edition: run.edition(),
    }
}
