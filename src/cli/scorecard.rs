//! `servobee scorecard`.

use super::table::{number, table};
use super::{colour, interrupt};
use indicatif::{ProgressBar, ProgressStyle};
use servobee::diagnose::Identified;
use servobee::evaluate::{CpuEvaluator, Precision};
use servobee::report::{OutputFile, ParameterReport};
use servobee::scorecard::{self, Case, Group, Ledger, Outcome, Plan, Rate, Row, Summary, Tally};
use servobee::{Error, Result};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Counts how often the diagnosis is right, on hundreds of records with planted effects
///
/// The records are made by the simulator of servobee synthesize: nothing planted (null), one effect (single), one effect in
/// another form than the catalogue's (forms), two effects (pairs), what is in no catalogue (outsiders), and one
/// effect that the diagnosis is not allowed to name (left_out). What is
/// planted makes the base model's held-out error, in units of the noise on its worst channel, about 1.75, 3 and 6 (single and
/// forms), 3 (left_out), or 2.1 to 6 (pairs and outsiders). Each record is diagnosed as servobee identify does it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  servobee scorecard --count 0.2 --groups null,single
  servobee scorecard --out scorecard.csv        again with the same file: goes on where it was interrupted
  servobee scorecard --case single/hysteresis/3x/2 --write records
  servobee identify records/single_hysteresis_3x_2.csv")]
pub(super) struct Arguments {
    /// Seed of all records; the same seed gives the same records
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Groups of cases that are run
    #[arg(
        long,
        value_name = "null,single,forms,pairs,outsiders,left_out",
        value_delimiter = ',',
        default_value = "null,single,forms,pairs,outsiders,left_out",
        hide_default_value = true
    )]
    groups: Vec<Group>,
    /// Factor on the number of records of each group, of which one at least is run; 0.2 is a quick look
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    count: f64,
    /// Only cases that plant this effect or outsider
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Run the one case of this name and say more of it
    #[arg(long, value_name = "ID", conflicts_with_all = ["only", "out", "threads"])]
    case: Option<String>,
    /// Also store the case's record in this folder, which is made
    #[arg(long, value_name = "DIR", requires = "case")]
    write: Option<PathBuf>,
    /// Write a line for every record to this CSV file; cases that are in it are not run again
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Go on with the file of --out, as is done in any case
    #[arg(long, requires = "out")]
    resume: bool,
    /// Records that are diagnosed at the same time [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let plan = Plan {
        seed: arguments.seed,
        groups: arguments.groups.clone(),
        count: arguments.count,
        only: arguments.only.clone(),
    };
    if let Some(id) = &arguments.case {
        return one(&plan.case(id)?, plan.seed, arguments.write.as_deref());
    }
    let cases = plan.cases()?;
    let mut ledger = match &arguments.out {
        Some(path) => Ledger::open(path, plan.seed)?,
        None => Ledger::in_memory(plan.seed),
    };
    let open: Vec<Case> = cases
        .iter()
        .filter(|case| !ledger.has(&case.id))
        .cloned()
        .collect();
    if open.len() < cases.len() {
        tell!(
            "{} of {} records are done",
            cases.len() - open.len(),
            cases.len()
        );
    }
    if !open.is_empty() {
        tell!("{} records to diagnose: {}", open.len(), counted(&open));
    }
    let threads = match arguments.threads {
        Some(threads) => threads.into(),
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    interrupt::watch()?;
    let bar = bar(open.len());
    let done = |row: Row| {
        if row.outcome == Outcome::Failed {
            bar.suspend(|| colour::warning(format_args!("{}: {}", row.case, row.verdict)));
        }
        bar.set_message(row.case.clone());
        bar.inc(1);
        ledger.push(row)
    };
    let result = scorecard::run(&open, plan.seed, threads, &interrupt::interrupt(), done);
    let result = match interrupt::goes_on() {
        ControlFlow::Continue(()) => result,
        ControlFlow::Break(()) => Err(Error::failed(
            "interrupted: the figures are those of the records that are done",
            "call it again with the same --out to go on",
        )),
    };
    bar.finish_and_clear();
    let planned = |row: &&Row| cases.iter().any(|case| case.id == row.case);
    let rows: Vec<Row> = ledger.rows().iter().filter(planned).cloned().collect();
    print(&Summary::of(&rows), rows.len());
    result
}

/// How many of the cases are in which group.
fn counted(cases: &[Case]) -> String {
    let count = |group: &Group| cases.iter().filter(|case| case.group == *group).count();
    let groups = Group::ALL.iter().map(|group| (count(group), group));
    let counted = groups.filter(|(count, _)| *count > 0);
    let counted: Vec<String> = counted
        .map(|(count, group)| format!("{count} {group}"))
        .collect();
    counted.join(", ")
}

fn bar(records: usize) -> ProgressBar {
    let style = ProgressStyle::with_template(
        "{wide_bar} {pos}/{len} records, {elapsed} gone, {eta} left  {msg}",
    );
    ProgressBar::new(records as u64).with_style(style.expect("a valid template"))
}

/// Runs one case and tells all of it.
fn one(case: &Case, seed: u64, folder: Option<&Path>) -> Result<()> {
    let setup = case.setup(seed)?;
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|error| {
            Error::input(
                format!("--write {}", folder.display()),
                format!("cannot be made: {error}"),
                "name another folder",
            )
        })?;
        let path = folder.join(format!("{}.csv", case.id.replace('/', "_")));
        OutputFile::create(&path, true)?.finish(&setup.record()?.to_csv())?;
        tell!("Record: {}", path.display());
    }
    let (row, identified) = case.diagnose(&setup, &mut CpuEvaluator::new(Precision::F32))?;
    tell!(
        "Planted: {}",
        if row.values.is_empty() {
            "nothing"
        } else {
            &row.values
        }
    );
    tell!("Conditions: {}", row.conditions);
    tell!(
        "Held-out error in noise, worst channel: {:.3} before, {:.3} after; noise floor {:.3} of the noise",
        row.base,
        row.after,
        row.floor
    );
    tell!(
        "Verdict: {}. Named: {}",
        row.verdict,
        if row.named.is_empty() {
            "nothing"
        } else {
            &row.named
        }
    );
    tell!("Outcome: {}, in {:.1} s\n", row.outcome, row.seconds);
    print_diagnosis(&identified);
    Ok(())
}

/// What was looked at, and the parameters of the result with their 95 % intervals.
fn print_diagnosis(identified: &Identified) {
    let rows = identified.considered.iter().map(|one| {
        vec![
            one.effect.to_string(),
            one.round.to_string(),
            format!("{:.2} %", one.predicted_reduction),
            format!("{:.3}", one.p_value),
            one.error.map_or("-".into(), |error| format!("{error:.4}")),
            one.decision.describe().into(),
        ]
    });
    let heads = [
        "effect",
        "round",
        "promise",
        "p",
        "held-out error",
        "decision",
    ];
    tell!("{}\n", table(&heads, rows));
    let after = &identified.after;
    let parameters = ParameterReport::of(&after.problem, &after.fit);
    let rows = parameters.iter().filter(|one| !one.fixed).map(|one| {
        let cells = [one.value, one.low, one.high].map(number);
        [vec![format!("{} [{}]", one.name, one.unit)], cells.to_vec()].concat()
    });
    tell!("{}", table(&["parameter", "after", "low", "high"], rows));
}

fn print(summary: &Summary, records: usize) {
    tell!("{records} records\n");
    let heads = [
        "",
        "records",
        "good",
        "good %",
        "95 %",
        "misnamed",
        "misnamed %",
        "95 %",
        "right",
        "tied",
        "tied wide",
        "right plus",
        "partly",
        "wrong",
        "missed",
        "unexplained",
        "failed",
    ];
    for (what, tallies) in [
        ("Groups", &summary.groups),
        (
            "By the base model's held-out error in noise",
            &summary.bands,
        ),
        ("By what is planted, error at least 1.5", &summary.effects),
    ] {
        if tallies.is_empty() {
            continue;
        }
        tell!("{what}\n{}\n", table(&heads, tallies.iter().map(cells)));
    }
    tell!(
        "good: named exactly or in a tie of at most three; null: verdict none; outsiders, left_out: unexplained.\n\
         misnamed: a name for what is not there (right plus, wrong, a false alarm with a name).\n"
    );
    if !summary.confusions.is_empty() {
        let mut rows = summary.confusions.clone();
        rows.sort_by_key(|row| std::cmp::Reverse(row.2));
        let rows = rows
            .into_iter()
            .map(|(planted, named, count)| vec![planted, named, count.to_string()]);
        tell!(
            "Not good\n{}\n",
            table(&["planted", "named", "records"], rows)
        );
    }
    if let Some((median, high, close)) = summary.after {
        tell!(
            "Held-out error after, single effects, in noise: median {median:.3}, 90 % below {high:.3}; at most 1.10: {}",
            rate(close)
        );
    }
    for (place, located) in &summary.located {
        tell!(
            "What acts {}, is located there: {}",
            place.words(),
            rate(*located)
        );
    }
    for (name, covered) in &summary.coverage {
        if covered.of > 0 {
            tell!(
                "95 % intervals that hold the true {name}: {}",
                rate(*covered)
            );
        }
    }
    if let Some((median, most)) = summary.seconds {
        tell!(
            "Seconds a diagnosis on one core: median {}, at most {}",
            number(median),
            number(most)
        );
        let within = summary.within.iter();
        let within = within.map(|(limit, good)| format!("{limit} s {:.1} %", 100.0 * good.share()));
        tell!("Good within {}", within.collect::<Vec<_>>().join(", "));
    }
}

fn cells((name, tally): &(String, Tally)) -> Vec<String> {
    let percent = |rate: Rate| {
        let (low, high) = rate.interval();
        [
            format!("{:.1}", 100.0 * rate.share()),
            format!("{:.1} .. {:.1}", 100.0 * low, 100.0 * high),
        ]
    };
    let mut cells = vec![name.clone(), tally.good.of.to_string()];
    for rate in [tally.good, tally.misnamed] {
        cells.push(rate.hits.to_string());
        cells.extend(percent(rate));
    }
    let counts = [
        &[Outcome::Right][..],
        &[Outcome::Tied],
        &[Outcome::TiedWide],
        &[Outcome::RightPlus],
        &[Outcome::Partly],
        &[Outcome::Wrong, Outcome::FalseFound],
        &[Outcome::Missed],
        &[Outcome::Unexplained, Outcome::FalseUnexplained],
        &[Outcome::Failed],
    ];
    cells.extend(counts.map(|outcomes| {
        let count: usize = outcomes.iter().map(|outcome| tally.count(*outcome)).sum();
        count.to_string()
    }));
    cells
}

fn rate(rate: Rate) -> String {
    let (low, high) = rate.interval();
    format!(
        "{:.1} % ({} of {}; {:.1} .. {:.1} %)",
        100.0 * rate.share(),
        rate.hits,
        rate.of,
        100.0 * low,
        100.0 * high
    )
}
