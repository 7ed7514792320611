//! From records to a diagnosed model: fit, score on the hold-out, look at what is left.

use super::attribution::{Decision, Search, excess, worth};
use super::evidence::{Evidence, Model, Side, set_start};
use super::free_form::{FoundForm, found as found_form, free_forms};
use super::hold::{Between, OtherHold, other_way};
use super::measurements::Measurements;
use super::score::{Compared, errors};
use super::stage::Stage;
use super::unexcited::{Unexcited, set_by_held_out};
use super::verdict::Grounds;
use super::{Added, Considered, Improvement, Noise, Question, Remaining, Residuals, Verdict};
use super::{improvement, noise_floor, remaining};
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Evaluator, Interrupt, Problem, Score, reference};
use crate::model::effects::{CATALOGUE, Effect, Entry, Scale};
use crate::model::{Input, Output, Outputs, Structure};
use crate::search::polish::PolishOptions;
use crate::search::{Fit, Plan, fit, refine};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A residual this many times the noise floor is not noise, whatever it does or does not correlate with: where the noise was
/// seen by itself, and where it was taken from the residual's own differences.
const ABOVE_NOISE: (f64, f64) = (1.3, 2.0);

/// No channel's noise is taken to be smaller than this fraction of its range: no converter of 24 bits resolves it, and
/// single-precision logs do not store it.
const SMALLEST_NOISE: f64 = 6e-8;

/// The integrator may err by this fraction of a channel's deviation, or by its noise, before its figures are refused.
const TOLERATED: f64 = 1e-4;

/// Seed of what a verdict compares with chance: the same for every run, so that the seed of the search decides no verdict.
const CHANCE: u64 = 1;

/// A noise floor is lowered if what is left at rest falls below this share of it.
const QUIETER: f64 = 0.93;

/// The integration steps of a diagnosis follow rates this many times the fitted model's: effects make it faster.
const HEADROOM: f64 = 3.0;

/// Errors on fitted and on held-out data, by channel.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Sides {
    /// On the data that was fitted.
    pub fit: BTreeMap<String, Score>,
    /// On data never fitted; empty where none was held out.
    pub hold_out: BTreeMap<String, Score>,
}

/// What a diagnosis may add to the base model.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The effects; those that do not act on the structure are passed over.
    pub effects: Vec<Effect>,
    /// At most so many are added.
    pub max_effects: usize,
}

impl Options {
    /// At most `max_effects` of `entries`, in every form in which they can act on `structure`.
    pub fn on(structure: &Structure, entries: &[&'static Entry], max_effects: usize) -> Self {
        let effects = entries.iter().flat_map(|entry| entry.on(structure));
        Self {
            effects: effects.collect(),
            max_effects,
        }
    }

    /// The effects that may be added to `structure`.
    fn asked(&self, structure: &Structure) -> Vec<Effect> {
        let new = |effect: &&Effect| {
            !structure.effects.contains(effect) && effect.entry.on(structure).contains(effect)
        };
        match self.max_effects {
            0 => Vec::new(),
            _ => self.effects.iter().filter(new).copied().collect(),
        }
    }
}

/// A fitted model with its errors.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The structure, its parameters and the fitted data.
    pub problem: Problem,
    /// The fit.
    pub fit: Fit,
    /// Values of all parameters.
    pub values: Vec<f64>,
    /// Its errors.
    pub errors: Sides,
    /// What each observed channel's residual on the fitted data still depends on.
    pub remaining: BTreeMap<String, Remaining>,
    /// Parameters that the fitted rows leave open and the held-out ones had to set.
    pub unexcited: Vec<Unexcited>,
    /// Largest change of each channel when the integration steps are halved, in its unit.
    pub integration_error: BTreeMap<String, f64>,
}

/// A model with what the data say of it.
#[derive(Debug, Clone)]
pub struct Identified {
    /// What the diagnosis comes to.
    pub verdict: Verdict,
    /// The effects that were looked for.
    pub asked: Vec<Effect>,
    /// The base model.
    pub before: Fitted,
    /// The base model with what was added; the base model itself where nothing was.
    pub after: Fitted,
    /// The effects of the result, in the order in which they were added.
    pub added: Vec<Added>,
    /// Where the verdict is unexplained: the curve that best describes what is missing, if any helps.
    pub free_form: Option<FoundForm>,
    /// Every effect that was looked at, round by round.
    pub considered: Vec<Considered>,
    /// By how much the error fell, on fitted and on held-out rows, all channels in units of their noise.
    pub improvement: [Option<Improvement>; 2],
    /// Share of the held-out error above the noise, squared, that the effects that were found explain; `None` where none was.
    pub explained: Option<f64>,
    /// The records.
    pub measurements: Measurements,
    /// Each observed channel's noise.
    pub noise: BTreeMap<String, Noise>,
    /// What was taken for the command between two rows.
    pub between: Between,
    /// The search for the base model, with each channel in units of its own deviation: the noise was not known yet.
    pub search: Fit,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// The stage in which it was broken off: everything is as far as it was known then.
    pub broken_off: Option<String>,
}

impl Identified {
    /// Whether the result is more than the base model.
    pub fn changed(&self) -> bool {
        !self.added.is_empty() || self.free_form.is_some()
    }

    /// Whether every effect of the catalogue that can act was looked for, but for those that the base model has.
    pub fn asked_all(&self) -> bool {
        let structure = &self.before.problem.structure;
        let mut all = CATALOGUE.iter().flat_map(|entry| entry.on(structure));
        all.all(|effect| structure.effects.contains(&effect) || self.asked.contains(&effect))
    }

    /// Refuses a model whose integrator errs by more than the noise: its figures would say more of the integrator. What is known
    /// of a run that was broken off is told with that warning.
    fn check_integration(&self) -> Result<()> {
        if self.broken_off.is_some() {
            return Ok(());
        }
        for &output in &self.after.problem.structure.observed {
            let name = output.name();
            let range = variance(&self.measurements.fit, output).sqrt();
            let floor = self.noise[name].value.max(TOLERATED * range);
            let change = self.after.integration_error[name];
            if change > floor {
                let unit = self.after.problem.structure.unit(output);
                return Err(Error::failed(
                    format!(
                        "halving the integration steps changes the {name} by up to {change:.3e} {unit}, which is more than \
                         its noise of {floor:.3e} {unit}"
                    ),
                    "raise the upper bound of the fastest parameter with --model: the steps follow from the bounds",
                ));
            }
        }
        Ok(())
    }
}

/// Fits the base model to the measurements, finds out which effects it lacks, and looks at the residual. `progress` is told
/// each stage and generation, and may break off: the result is then what is known so far.
///
/// # Errors
/// If the search fails: see [`fit`]; or the integrator errs by more than the noise.
pub fn identify(
    question: Question,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    options: &Options,
    progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Identified> {
    let Question {
        structure,
        parameters,
        sizes,
        measurements,
        hold_known,
    } = question;
    let mut stage = Stage::new(progress, plan.memory.interrupt());
    let mut problem = Problem::new(
        structure,
        parameters,
        Data::Series(measurements.fit.clone()),
    );
    problem.scale = Outputs::from_fn(|output| 1.0 / variance(&measurements.fit, output));
    stage.begins("base model");
    let found = fit(&problem, evaluator, plan, &mut |done| {
        stage.generation(done)
    })?;
    let mut evaluations = found.evaluations;
    let mut first = Fitted::new(problem.clone(), found, &measurements, None, plan);
    let mut noise = first.noise(&measurements, false);
    let search = first.fit.clone();
    if !hold_known
        && stage.goes_on()
        && let Some(other) = first.completed_by_other_hold(&measurements, plan)?
    {
        evaluations += other.fit.evaluations;
        problem.structure.hold = other.problem.structure.hold;
        noise = other.noise(&measurements, false);
        first = other;
    }
    let start = first.fit.values();
    let mut diagnosis = Diagnosis {
        evaluator,
        plan,
        options,
        stage,
        measurements: &measurements,
        sizes,
        hold_known,
        search: &search,
    };
    let mut result = diagnosis.of(problem.clone(), start, noise)?;
    evaluations += result.evaluations;
    // What was taken for noise at rest may have been an effect: a hum, say. Once it is named, the floor is lower.
    let floor = result.after.noise(&measurements, true);
    let lower = |(name, before): (&String, &Noise)| floor[name].value < QUIETER * before.value;
    if !result.added.is_empty() && result.noise.iter().any(lower) && diagnosis.stage.goes_on() {
        let again = diagnosis.of(problem, start, floor)?;
        evaluations += again.evaluations;
        match again.broken_off {
            // What is known is the whole of the first diagnosis.
            Some(stage) => result.broken_off = Some(stage),
            None => result = again,
        }
    }
    result.evaluations = evaluations;
    result.check_integration()?;
    Ok(result)
}

/// What does not change while a record is diagnosed.
struct Diagnosis<'a> {
    evaluator: &'a mut dyn Evaluator,
    plan: &'a Plan,
    options: &'a Options,
    stage: Stage<'a>,
    measurements: &'a Measurements,
    sizes: Scale,
    hold_known: bool,
    search: &'a Fit,
}

impl Diagnosis<'_> {
    /// Diagnoses `problem`, whose base parameters are near `start`, where the channels have this `noise`.
    fn of(
        &mut self,
        mut problem: Problem,
        start: &[f64],
        noise: BTreeMap<String, Noise>,
    ) -> Result<Identified> {
        let Self {
            evaluator,
            plan,
            options,
            stage,
            measurements,
            sizes,
            hold_known,
            search,
        } = self;
        let mut evaluations = 0;
        for output in Output::ALL {
            let range = variance(&measurements.fit, output).sqrt();
            problem.scale[output] = match noise.get(output.name()) {
                Some(noise) => noise.value.max(SMALLEST_NOISE * range).powi(-2),
                None => 0.0,
            };
        }
        // Each channel now counts by its noise.
        stage.begins("base model: polishing");
        let polished = refine(&problem, start, plan)?;
        evaluations += polished.evaluations;
        let before = Fitted::new(problem, polished, measurements, Some(&noise), plan);

        let mut evidence = Evidence::new(&before, measurements, sizes.clone(), plan);
        let base = evidence.start_from(&before);
        let asked = options.asked(&before.problem.structure);
        let mut attribution = None;
        if !asked.is_empty()
            && !before.exact()
            && stage.goes_on()
            && let Some(base) = &base
        {
            evidence.look_at(base);
            let allowed = |effect: &Effect| asked.contains(effect);
            let search = Search::new(
                &evidence,
                base,
                &mut **evaluator,
                &allowed,
                options.max_effects,
                stage,
            );
            attribution = Some(search.run(base)?);
        }
        let mut after = before.clone();
        let mut added = Vec::new();
        let mut considered = Vec::new();
        let mut grounds = Grounds {
            diagnosed: !asked.is_empty() && base.is_some() && stage.goes_on(),
            before: 1.0,
            after: 1.0,
            added: false,
            structured_before: before.structured(),
            structured_after: before.structured(),
        };
        if let (Some(base), Some(found)) = (&base, attribution) {
            evaluations += found.evaluations;
            considered = found.considered;
            grounds.before = base.loss(Side::HoldOut);
            grounds.after = found.model.loss(Side::HoldOut);
            if !found.added.is_empty() {
                stage.begins("polishing the result");
                let problem = Problem {
                    data: before.problem.data.clone(),
                    ..found.model.problem.clone()
                };
                let polished = refine(&problem, &problem.start(), plan)?;
                evaluations += polished.evaluations;
                let candidate = Fitted::new(problem, polished, measurements, Some(&noise), plan);
                grounds.added = true;
                grounds.structured_after = candidate.structured();
                if grounds.verdict() == Verdict::Found {
                    after = candidate;
                    added = found.added;
                } else {
                    for one in &mut considered {
                        if found.added.iter().any(|added| added.effect == one.effect) {
                            one.decision = Decision::NotNamed;
                        }
                    }
                }
            }
        }
        let mut free_form = None;
        if let Some(base) = &base
            && stage.goes_on()
            && grounds.verdict() == Verdict::Unexplained
        {
            stage.begins("a correction of free form");
            let forms = free_forms(&evidence, base);
            let best = forms
                .iter()
                .find(|form| worth(&evidence, excess(base), base, form));
            if let Some(best) = best {
                let problem = Problem {
                    data: before.problem.data.clone(),
                    ..best.problem.clone()
                };
                let polished = refine(&problem, &problem.start(), plan)?;
                evaluations += polished.evaluations;
                after = Fitted::new(problem, polished, measurements, Some(&noise), plan);
                free_form = found_form(base, best, &after);
            }
        }
        let other = match *hold_known || !stage.goes_on() {
            true => None,
            false => other_way(&after, plan),
        };
        let between = Between {
            taken: after.problem.structure.hold,
            known: *hold_known,
            other: other.map(|other| OtherHold::beside(&after, &other, measurements)),
        };
        Ok(Identified {
            verdict: grounds.verdict(),
            asked,
            free_form,
            explained: (!added.is_empty()).then(|| grounds.explained()),
            improvement: improvements(&before, &after, measurements, &noise, plan.seed),
            before,
            after,
            added,
            considered,
            measurements: measurements.clone(),
            noise,
            between,
            search: search.clone(),
            evaluations,
            broken_off: stage.broken_off().map(str::to_owned),
        })
    }
}

impl Fitted {
    fn new(
        problem: Problem,
        mut fit: Fit,
        measurements: &Measurements,
        noise: Option<&BTreeMap<String, Noise>>,
        plan: &Plan,
    ) -> Self {
        let unexcited = set_what_is_open(&problem, plan.memory.interrupt(), &mut fit, measurements);
        let values = problem.complete(fit.values(), |fixed| fixed);
        let structure = &problem.structure;
        let fitted = Compared::all(structure, &values, &measurements.fit);
        let held = Compared::all(structure, &values, &measurements.hold_out);
        let errors = Sides {
            fit: errors(structure, &fitted),
            hold_out: errors(structure, &held),
        };
        let mut result = Self {
            fit,
            values,
            errors,
            remaining: BTreeMap::new(),
            unexcited,
            integration_error: BTreeMap::new(),
            problem: problem.clone(),
        };
        result.integration_error = result.largest_changes();
        if let Some(noise) = noise {
            result.look_at_residual(&fitted, noise);
        }
        result
    }

    /// The base model with the other of held and interpolated, where the rows prefer that and it leaves nothing but noise. Where
    /// it leaves more, what is missing may prefer either: that says nothing of the command.
    fn completed_by_other_hold(
        &self,
        measurements: &Measurements,
        plan: &Plan,
    ) -> Result<Option<Self>> {
        let Some(other) = other_way(self, plan) else {
            return Ok(None);
        };
        let beside = OtherHold::beside(self, &other, measurements);
        if beside.preferred != Some(other.structure.hold) {
            return Ok(None);
        }
        let refined = refine(&other, &other.start(), plan)?;
        let mut other = Self::new(other, refined, measurements, None, plan);
        let noise = other.noise(measurements, false);
        let fitted = Compared::all(&other.problem.structure, &other.values, &measurements.fit);
        other.look_at_residual(&fitted, &noise);
        Ok((!other.structured()).then_some(other))
    }

    /// Tests what is left in the residual of the fitted rows.
    fn look_at_residual(&mut self, fitted: &[Compared], noise: &BTreeMap<String, Noise>) {
        let known = Known::new(fitted);
        let mut names = Vec::new();
        let mut residuals = Vec::new();
        for &output in &self.problem.structure.observed {
            let name = output.name().to_owned();
            if self.is_exact(&name) {
                self.remaining.insert(name, Remaining::nothing());
                continue;
            }
            let rows = fitted.iter().flat_map(|compared| compared.rows(output));
            residuals.push(rows.map(|row| row.1 - row.2).collect::<Vec<f64>>());
            names.push(name);
        }
        let channels: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let signals: Vec<(&str, &[f64])> = known
            .signals
            .iter()
            .map(|(name, values)| (*name, values.as_slice()))
            .collect();
        let rest = remaining(
            &Residuals {
                channels: &channels,
                starts: &known.starts,
                time: &known.time,
                command: &known.command,
                known: &signals,
            },
            CHANCE,
        );
        for (name, mut rest) in names.into_iter().zip(rest) {
            let noise = &noise[&name];
            let most = match noise.method {
                super::noise::DIFFERENCES => ABOVE_NOISE.1,
                _ => ABOVE_NOISE.0,
            };
            let floor = noise.value.max(self.least_error(&name));
            let sides = [self.errors.fit.get(&name), self.errors.hold_out.get(&name)];
            let above = |score: &Score| score.rmse > most * floor;
            rest.structured |= sides.into_iter().flatten().any(above);
            self.remaining.insert(name, rest);
        }
    }

    /// Each observed channel's noise floor: what is quiet in the measurement, or in the residual.
    fn noise(&self, measurements: &Measurements, of_residual: bool) -> BTreeMap<String, Noise> {
        let structure = &self.problem.structure;
        let fitted = Compared::all(structure, &self.values, &measurements.fit);
        let known = Known::new(&fitted);
        let one = |&output: &Output| {
            let rows = fitted.iter().flat_map(|compared| compared.rows(output));
            let (measured, residual): (Vec<f64>, Vec<f64>) =
                rows.map(|row| (row.1, row.1 - row.2)).unzip();
            let quiet = if of_residual { &residual } else { &measured };
            let floor = noise_floor(&known.starts, &known.command, quiet, &residual);
            (output.name().to_owned(), floor)
        };
        structure.observed.iter().map(one).collect()
    }

    /// Whether any channel's residual has structure.
    pub fn structured(&self) -> bool {
        self.remaining.values().any(|left| left.structured)
    }

    /// Whether the model follows the data, fitted and held out, to within the integrator's error.
    fn exact(&self) -> bool {
        self.errors.fit.keys().all(|name| self.is_exact(name))
    }

    /// The same of one channel.
    fn is_exact(&self, channel: &str) -> bool {
        let least = self.least_error(channel);
        let sides = [
            self.errors.fit.get(channel),
            self.errors.hold_out.get(channel),
        ];
        sides.into_iter().flatten().all(|score| score.rmse <= least)
    }

    /// Largest change of each observed channel when the integration steps of the fitted rows are halved.
    fn largest_changes(&self) -> BTreeMap<String, f64> {
        let structure = &self.problem.structure;
        let records = |problem: &Problem| match &*problem.data {
            Data::Series(records) => reference::trajectories(structure, &self.values, records),
            Data::Tones(_) => unreachable!("records were given"),
        };
        let (coarse, fine) = (records(&self.problem), records(&self.problem.refined(2)));
        let change = |&output: &Output| {
            let pairs = coarse.iter().flatten().zip(fine.iter().flatten());
            let change = pairs.map(|(a, b)| (a[output] - b[output]).abs());
            (output.name().to_owned(), change.fold(0.0, f64::max))
        };
        structure.observed.iter().map(change).collect()
    }

    /// An error of a channel that says nothing of the model: the integrator's own, or what no file resolves.
    fn least_error(&self, channel: &str) -> f64 {
        let output = Output::ALL.into_iter().find(|one| one.name() == channel);
        let records: &[Series] = match &*self.problem.data {
            Data::Series(records) => records,
            Data::Tones(_) => &[],
        };
        let range = output.map_or(0.0, |output| variance(records, output).sqrt());
        self.integration_error[channel].max(SMALLEST_NOISE * range)
    }
}

/// Lets the held-out rows set what the fitted ones leave open, and says what that was.
fn set_what_is_open(
    problem: &Problem,
    interrupt: &Interrupt,
    fit: &mut Fit,
    measurements: &Measurements,
) -> Vec<Unexcited> {
    let Some((polished, _)) = &mut fit.polished else {
        return Vec::new();
    };
    if polished.flat.is_empty() {
        return Vec::new();
    }
    let records = &measurements.hold_out;
    let held_out = Arc::new(Data::Series(records.clone()));
    let options = PolishOptions::default();
    let (values, asked) = set_by_held_out(
        problem,
        interrupt,
        &polished.values,
        &polished.flat,
        &held_out,
        &options,
    );
    polished.values = values;
    for flat in &asked {
        polished.at_bound[flat.parameter] = None;
    }
    let one = |flat| Unexcited::new(problem, &polished.values, flat, records);
    asked.iter().map(one).collect()
}

impl Evidence {
    /// The measurements in units of the noise by which `before` was fitted, in steps that suit its rates.
    fn new(before: &Fitted, measurements: &Measurements, sizes: Scale, plan: &Plan) -> Self {
        let mut near = before.problem.parameters.clone();
        for (parameter, &value) in near.iter_mut().zip(&before.values) {
            parameter.low = parameter.low.max(value / HEADROOM);
            parameter.high = parameter.high.min(value * HEADROOM);
        }
        let rate = before.problem.structure.fastest_rate(&near);
        let steps = |records: &[Series]| {
            let mut records = records.to_vec();
            records
                .iter_mut()
                .for_each(|record| record.set_steps(rate, 1));
            Arc::new(Data::Series(records))
        };
        Self {
            fit: steps(&measurements.fit),
            hold_out: steps(&measurements.hold_out),
            scale: before.problem.scale,
            sizes,
            base: before.problem.parameters.clone(),
            seed: CHANCE,
            memory: plan.memory.clone(),
        }
    }

    /// The base model on this evidence; `None` where it diverges or nothing was held out.
    fn start_from(&self, before: &Fitted) -> Option<Model> {
        let held_out = |record: &Series| record.samples.iter().any(|s| s.weight > 0.0);
        if !self.records(Side::HoldOut).iter().any(held_out) {
            return None;
        }
        let mut problem = Problem {
            data: self.fit.clone(),
            ..before.problem.clone()
        };
        set_start(&mut problem, before.fit.values());
        self.polished(problem)
    }
}

/// How much the held-out (second) and the fitted error (first) fell from one model to another.
fn improvements(
    before: &Fitted,
    after: &Fitted,
    measurements: &Measurements,
    noise: &BTreeMap<String, Noise>,
    seed: u64,
) -> [Option<Improvement>; 2] {
    let structure = &before.problem.structure;
    [&measurements.fit, &measurements.hold_out].map(|records| {
        let residuals = |fitted: &Fitted| -> Vec<Vec<f64>> {
            let compared = Compared::all(&fitted.problem.structure, &fitted.values, records);
            let channel = |&output: &Output| {
                let rows = compared.iter().flat_map(|compared| compared.rows(output));
                rows.map(|row| row.1 - row.2).collect()
            };
            structure.observed.iter().map(channel).collect()
        };
        let weights: Vec<f64> = structure
            .observed
            .iter()
            .map(|output| noise[output.name()].value.powi(-2))
            .collect();
        let compared = Compared::all(structure, &before.values, records);
        let starts = Known::new(&compared).starts;
        let (old, new) = (residuals(before), residuals(after));
        let enough = old.first().is_some_and(|rows| rows.len() > 10);
        (enough && weights.iter().all(|w| w.is_finite()))
            .then(|| improvement(&old, &new, &weights, &starts, seed))
    })
}

/// What is known of the rows that count, one record after another.
pub(super) struct Known {
    pub(super) starts: Vec<usize>,
    pub(super) time: Vec<f64>,
    pub(super) command: Vec<f64>,
    pub(super) signals: Vec<(&'static str, Vec<f64>)>,
}

impl Known {
    pub(super) fn new(fitted: &[Compared]) -> Self {
        type Row = (f64, Input<f64>, Outputs<f64>);
        let mut starts = Vec::new();
        let mut rows: Vec<Row> = Vec::new();
        for compared in fitted {
            starts.push(rows.len());
            let series = compared.series;
            let all = series
                .time
                .iter()
                .zip(&series.samples)
                .zip(&compared.simulated);
            let counted = all.filter(|((_, sample), _)| sample.weight > 0.0);
            rows.extend(counted.map(|((time, sample), outputs)| (*time, sample.input, *outputs)));
        }
        let signal = |f: fn(&Row) -> f64| rows.iter().map(f).collect::<Vec<f64>>();
        let signals = vec![
            ("simulated spool", signal(|row| row.2[Output::Spool])),
            (
                "flow^2",
                signal(|row| row.2[Output::Flow] * row.2[Output::Flow].abs()),
            ),
            ("supply pressure", signal(|row| row.1.supply)),
            ("load pressure", signal(|row| row.1.a - row.1.b)),
            (
                "spool times pressure drop",
                signal(|row| row.2[Output::Spool] * (row.1.supply - row.1.tank)),
            ),
            ("temperature", signal(|row| row.1.temperature)),
        ];
        Self {
            starts,
            time: signal(|row| row.0),
            command: signal(|row| row.1.command),
            // A signal that was not measured is zero throughout.
            signals: signals
                .into_iter()
                .filter(|(_, values)| values.iter().any(|value| *value != 0.0))
                .collect(),
        }
    }
}

/// Variance of an output over all records; 1 where it does not vary.
fn variance(records: &[Series], output: Output) -> f64 {
    let values = || {
        records
            .iter()
            .flat_map(|record| &record.samples)
            .map(|sample| sample.target[output])
    };
    let count = values().count() as f64;
    let mean = values().sum::<f64>() / count;
    let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    if variance > 0.0 { variance } else { 1.0 }
}
