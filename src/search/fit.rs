//! A whole fit: a search finds the valley, the polish finds its bottom and says how sure that is.

use super::polish::{
    Kind, LeastSquares, PolishOptions, Polished, Uncertainty, UncertaintyOptions, Unidentifiable,
    autocorrelation_inflation, polish, polish_what_counts, profile,
};
use super::{Method, RunningSearch, Settings, Start, run_in_lockstep};
use crate::evaluate::problem::{Data, Problem};
use crate::evaluate::reference::{led_cost_up_to, led_residuals};
use crate::evaluate::{
    Cost, CpuEvaluator, Evaluator, Fingerprint, Interrupt, Lead, Memory, Population, Precision,
    Status, reference,
};
use crate::model::{Output, Outputs, Parameter};
use crate::{Error, Result};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::Arc;

impl LeastSquares for Problem {
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        reference::residuals(self, candidate, row)
    }

    fn cost(&mut self, candidate: &[f64]) -> Option<f64> {
        reference::cost(self, candidate)
    }

    fn cost_up_to(&mut self, candidate: &[f64], most: f64) -> Option<f64> {
        reference::cost_up_to(self, candidate, most)
    }

    fn costs(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<f64>> {
        costs(self, candidates)
    }
}

/// The costs of candidates, as vectors of them.
fn costs(problem: &Problem, candidates: &[Vec<f64>]) -> Vec<Option<f64>> {
    let Some(first) = candidates.first() else {
        return Vec::new();
    };
    let population = Population::of(first.len(), candidates.concat());
    let costs = CpuEvaluator::new(Precision::F64).costs(problem, &population);
    let finished = |cost: Cost| (cost.status == Status::Finished).then_some(cost.value);
    let costs = costs.expect("the CPU does not fail").into_iter();
    costs.map(finished).collect()
}

/// A problem that diverges everywhere once the run was asked to stop, so that whatever minimises it comes to its end.
pub(crate) struct Stoppable<'a> {
    problem: &'a Problem,
    interrupt: &'a Interrupt,
    lead: Lead,
}

impl<'a> Stoppable<'a> {
    /// A problem whose simulations run free.
    pub(crate) fn new(problem: &'a Problem, interrupt: &'a Interrupt) -> Self {
        Self::led(problem, interrupt, &Lead::default())
    }

    /// A problem whose simulations are led.
    pub(crate) fn led(problem: &'a Problem, interrupt: &'a Interrupt, lead: &Lead) -> Self {
        let lead = lead.clone();
        Self {
            problem,
            interrupt,
            lead,
        }
    }
}

impl LeastSquares for Stoppable<'_> {
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        !self.interrupt.asked() && led_residuals(self.problem, &self.lead, candidate, row)
    }

    fn cost(&mut self, candidate: &[f64]) -> Option<f64> {
        self.cost_up_to(candidate, f64::INFINITY)
    }

    fn cost_up_to(&mut self, candidate: &[f64], most: f64) -> Option<f64> {
        match self.interrupt.asked() {
            true => None,
            false => led_cost_up_to(self.problem, &self.lead, candidate, most),
        }
    }

    fn costs(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<f64>> {
        if self.interrupt.asked() {
            return vec![None; candidates.len()];
        }
        match self.lead.shown_by {
            None => costs(self.problem, candidates),
            Some(_) => candidates.iter().map(|one| self.cost(one)).collect(),
        }
    }
}

/// How to fit.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What searches the whole space.
    pub method: Arc<dyn Method>,
    /// Where its first candidates go.
    pub start: Start,
    /// What searches around a model that is changed a little: a diagnosis does with each effect that it tries.
    pub local: Arc<dyn Method>,
    /// Seed of the search and of intervals.
    pub seed: u64,
    /// Whether Levenberg-Marquardt follows.
    pub polish: bool,
    /// Whether consecutive residuals resemble each other, as those of a record do, so that each says less than an
    /// independent one; the points of a curve are taken as independent.
    pub coloured: bool,
    /// Remembers the polishes; the costs are remembered by the evaluator, [`Remembering`](crate::evaluate::Remembering).
    pub memory: Memory,
}

impl Plan {
    /// How measurements are fitted: enough bees to find the valley, whose bottom the polish finds.
    pub fn of_records(seed: u64) -> Self {
        let bees = Settings {
            itr: 60,
            ..Settings::standard()
        };
        Self {
            method: Arc::new(bees),
            start: Start::Uniform,
            local: Arc::new(Settings::local()),
            seed,
            polish: true,
            coloured: true,
            memory: Memory::default(),
        }
    }
}

/// What a search found.
#[derive(Debug, Clone)]
pub struct SearchResult {
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Their cost in f64, or `None` where every candidate diverged.
    pub cost: Option<f64>,
    /// Best cost after each population, as the evaluator computed it.
    pub history: Vec<Cost>,
    /// Candidates evaluated.
    pub evaluations: usize,
}

impl From<RunningSearch<'_>> for SearchResult {
    fn from(RunningSearch { problem, search }: RunningSearch<'_>) -> Self {
        let values = search.best().0.to_vec();
        Self {
            cost: reference::cost(problem, &values),
            values,
            history: search.history().to_vec(),
            evaluations: search.evaluations(),
        }
    }
}

/// A fit's result.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The free parameters.
    pub free: Vec<Parameter>,
    /// Cost at the start values, if they do not diverge.
    pub cost_at_start: Option<f64>,
    /// What the search found.
    pub search: SearchResult,
    /// The polish and what it says of the parameters; not there where none was planned, or the run was stopped before its end.
    pub polished: Option<(Polished, Uncertainty)>,
    /// Candidates evaluated in all, those of the polish included.
    pub evaluations: usize,
}

impl Fit {
    /// Values of the free parameters.
    pub fn values(&self) -> &[f64] {
        self.polished
            .as_ref()
            .map_or(&self.search.values, |(polished, _)| &polished.values)
    }

    /// The cost there, in f64.
    pub fn cost(&self) -> Option<f64> {
        self.polished
            .as_ref()
            .map_or(self.search.cost, |(polished, _)| Some(polished.cost))
    }
}

/// Searches `problem` on `evaluator`, and polishes the best candidate in f64 where the plan says so.
/// `progress` is told each generation that is done, and may break off the search: the best until then is the result.
///
/// # Errors
/// If the method refuses to begin, the evaluator fails, or every candidate diverges.
pub fn fit(
    problem: &Problem,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Fit> {
    let fits = fit_all(&[(problem, plan)], evaluator, progress)?;
    Ok(fits.into_iter().next().expect("one fit for one problem"))
}

/// Fits every problem by its plan, all at once: the searches [run in lockstep](run_in_lockstep), and then the polishes
/// share the CPU's cores. Each fit is what [`fit`] would make of it alone. One problem with several seeds is a search with restarts.
/// `progress` is told each generation that is done, and may break off the search: the best until then is the result.
///
/// # Errors
/// As [`fit`]; of several errors, that of the first problem.
pub fn fit_all(
    tasks: &[(&Problem, &Plan)],
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Vec<Fit>> {
    let mut searches = Vec::new();
    for &(problem, plan) in tasks {
        let begin = || RunningSearch::begin(problem, &*plan.method, plan.start.clone(), plan.seed);
        searches.push(match problem.free().is_empty() {
            // Nothing to search: the problem's own values are scored.
            true => None,
            false => Some(begin()?),
        });
    }
    run_in_lockstep(searches.iter_mut().flatten(), evaluator, progress)?;
    let fits: Vec<Result<Fit>> = tasks
        .par_iter()
        .zip(searches)
        .map(|(&(problem, plan), search)| match search {
            Some(search) => finish(problem, search.into(), plan),
            None => refine(problem, &[], plan),
        })
        .collect();
    fits.into_iter().collect()
}

/// Polishes `values` of the free parameters without a search before it, as [`fit`] does after its search.
///
/// # Errors
/// If the model diverges there.
pub fn refine(problem: &Problem, values: &[f64], plan: &Plan) -> Result<Fit> {
    let search = SearchResult {
        values: values.to_vec(),
        cost: reference::cost(problem, values),
        history: Vec::new(),
        evaluations: 1,
    };
    finish(problem, search, plan)
}

fn finish(problem: &Problem, search: SearchResult, plan: &Plan) -> Result<Fit> {
    let free = problem.free();
    let mut evaluations = search.evaluations;
    let polished = match plan.polish && !free.is_empty() {
        false => None,
        true => polished(problem, &free, &search, plan)?,
    };
    evaluations += polished
        .as_ref()
        .map_or(0, |(polished, _)| polished.evaluations);
    Ok(Fit {
        cost_at_start: reference::cost(problem, &problem.start()),
        free,
        search,
        polished,
        evaluations,
    })
}

/// Polishes `values` of the free parameters. What the rows of records do not ask for then sits where its start or a bound is;
/// the points of a sine stream are too few to say so of a parameter.
pub(crate) fn polish_on_data(
    problem: &Problem,
    interrupt: &Interrupt,
    free: &[Parameter],
    values: &[f64],
    options: &PolishOptions,
) -> Result<Polished> {
    let mut stoppable = Stoppable::new(problem, interrupt);
    match &*problem.data {
        Data::Series(_) => {
            let neutral = problem.start();
            polish_what_counts(&mut stoppable, free, [values, &neutral], options)
        }
        Data::Tones(_) => polish(&mut stoppable, free, values, options),
    }
}

/// The polish of what was found, and what it says of the parameters; `None` where the run was stopped before the end of it.
fn polished(
    problem: &Problem,
    free: &[Parameter],
    search: &SearchResult,
    plan: &Plan,
) -> Result<Option<(Polished, Uncertainty)>> {
    let interrupt = plan.memory.interrupt();
    let key = || {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("polish").problem(problem);
        fingerprint.values(&search.values).finish()
    };
    let polished = plan.memory.try_once(key, || {
        let options = PolishOptions::default();
        polish_on_data(problem, interrupt, free, &search.values, &options)
    });
    if interrupt.asked() {
        return match search.cost {
            Some(_) => Ok(None),
            None => Err(Error::failed(
                "every candidate has diverged until the run was stopped",
                "let it go on",
            )),
        };
    }
    let polished = polished?;
    let inflation = if plan.coloured {
        inflation(problem, &polished.values)
    } else {
        1.0
    };
    let options = UncertaintyOptions {
        inflation,
        ..Default::default()
    };
    let mut uncertainty = Uncertainty::new(free, &polished, &options);
    let mut stoppable = Stoppable::new(problem, interrupt);
    profile_doubtful(&mut stoppable, free, &polished, &mut uncertainty);
    for flat in &polished.flat {
        uncertainty.intervals[flat.parameter] = flat.interval(&free[flat.parameter]);
    }
    Ok((!interrupt.asked()).then_some((polished, uncertainty)))
}

/// Most parameters whose cost is followed, and most integration steps a candidate may take for that.
const PROFILED: (usize, u64) = (4, 2_000_000);
/// The same of steps, where a structure has no states.
const STILL: u64 = 10_000;

/// Where the curvature at the result says nothing of a parameter, because it sits on a bound or has no effect there, its
/// interval comes from following the cost along it: a saturation that is never reached has a lower limit all the same.
fn profile_doubtful(
    stoppable: &mut Stoppable,
    free: &[Parameter],
    polished: &Polished,
    uncertainty: &mut Uncertainty,
) {
    let problem = stoppable.problem;
    let few = free.len() <= PROFILED.0 && problem.steps() <= PROFILED.1;
    // Where nothing moves, a candidate costs next to nothing: the areas of a flow curve are many.
    let still = problem.structure.states().is_empty() && problem.steps() <= STILL;
    if !(few || still) {
        return;
    }
    let no_effect = |j: usize| {
        let alone =
            |group: &Unidentifiable| group.kind == Kind::NoEffect && group.parameters == [j];
        uncertainty.unidentifiable.iter().any(alone)
    };
    let is_flat = |j: usize| polished.flat.iter().any(|flat| flat.parameter == j);
    let doubtful: Vec<usize> = (0..free.len())
        .filter(|&j| !is_flat(j) && (polished.at_bound[j].is_some() || no_effect(j)))
        .collect();
    for j in doubtful {
        uncertainty.intervals[j] = profile(
            stoppable,
            free,
            polished,
            uncertainty,
            j,
            &PolishOptions::default(),
        );
    }
}

/// How much less a row of coloured residuals says than a white one would.
fn inflation(problem: &Problem, free: &[f64]) -> f64 {
    let Data::Series(records) = &*problem.data else {
        return 1.0;
    };
    let values = problem.complete(free, |fixed| fixed);
    let outputs = reference::trajectories(&problem.structure, &values, records);
    let observed = problem.observed();
    let mut stretches: Vec<Vec<f64>> = Vec::new();
    for (record, outputs) in records.iter().zip(&outputs) {
        let counts = |output: &Output| observed[*output] && record.measured[*output];
        for i in Output::ALL.into_iter().filter(counts) {
            let rows = record
                .samples
                .iter()
                .zip(outputs)
                .filter(|(sample, _)| sample.weight > 0.0);
            let weighted = |(sample, row): (&crate::evaluate::problem::Sample, &Outputs<f64>)| {
                (sample.weight * problem.scale[i]).sqrt() * (sample.target[i] - row[i])
            };
            stretches.push(rows.map(weighted).collect());
        }
    }
    let stretches: Vec<&[f64]> = stretches.iter().map(Vec::as_slice).collect();
    autocorrelation_inflation(&stretches)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::problem::{Sample, Series};
    use crate::evaluate::workload;
    use crate::model::Complete;
    use crate::model::{Input, Structure};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn candidates_side_by_side_cost_what_each_costs_alone() {
        for names in [&[][..], &["hysteresis", "friction~windup"]] {
            let mut problem = workload::with_effects(names, 400);
            let population = workload::population(&problem, 21);
            let mut candidates: Vec<Vec<f64>> = population.iter().map(<[f64]>::to_vec).collect();
            candidates[3][0] = f64::NAN;
            let alone: Vec<Option<f64>> = candidates.iter().map(|one| problem.cost(one)).collect();
            assert_eq!(alone[3], None);
            assert_eq!(LeastSquares::costs(&mut problem, &candidates), alone);
            let interrupt = Interrupt::default();
            let mut stoppable = Stoppable::new(&problem, &interrupt);
            assert_eq!(stoppable.costs(&candidates), alone);
            let stopped = Interrupt::new(|| true);
            let mut stoppable = Stoppable::new(&problem, &stopped);
            assert_eq!(stoppable.costs(&candidates[..2]), [None, None]);
        }
        assert_eq!(costs(&workload::actuator(10), &[]), []);
    }

    #[test]
    fn coloured_residuals_count_for_less_by_their_colour_alone() {
        let structure = Structure::actuator(10.0, "V");
        let parameters = structure.parameters();
        let time: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let sample = |t: &f64| Sample {
            pieces: 1,
            input: Input {
                command: 5.0 * (9.0 * t).sin(),
                time: *t,
                ..Input::default()
            },
            weight: f64::from(u8::from(*t >= 1.0)),
            ..Sample::default()
        };
        let samples = time.iter().map(sample).collect();
        let mut series = Series {
            name: "run".into(),
            measured: Outputs::all(true),
            time,
            samples,
        };
        series.set_steps(structure.fastest_rate(&parameters), 1);
        let values = Complete::nominal(&parameters);
        let outputs = reference::trajectories(&structure, &values, std::slice::from_ref(&series));
        for (rho, size, expected) in [(0.0, 0.1, 1.0), (0.8, 0.1, 9.0), (0.8, 1e-4, 9.0)] {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let mut residual = 0.0;
            for (sample, row) in series.samples.iter_mut().zip(&outputs[0]) {
                residual = rho * residual + rng.random_range(-1.0..1.0);
                // What runs in is not compared.
                let off = if sample.weight > 0.0 { 0.0 } else { 100.0 };
                sample.target[Output::Spool] = row[Output::Spool] + size * residual + off;
            }
            let data = Data::Series(vec![series.clone()]);
            let problem = Problem::new(structure.clone(), parameters.clone(), data);
            let found = inflation(&problem, &problem.start());
            assert!((found / expected - 1.0).abs() < 0.15, "{rho}: {found}");
        }
    }
}
