//! What a diagnosis judges models by: the measured rows in units of their noise, and models fitted to them.

use super::fitted::{Fitted, least_ratio, noise_floors, quieter, weights};
use super::hums::hums_show;
use super::left_over::{CHANCE, left_over};
use super::linear::Linear;
use super::measurements::{Measurements, sought_on, starts};
use super::settled::Settled;
use super::signals::Signals;
use super::simulation::{Compared, Sides, Trajectories, residual_in_all_rows};
use super::statistics::line::strongest_line;
use super::statistics::noise::Noise;
use super::stepped::{Stepped, rate_at, rate_at_start};
use super::unexcited::set_by_held_out;
use super::verdict::NEAR;
use crate::Result;
use crate::evaluate::problem::{Data, Problem, Series};
use crate::evaluate::{
    CpuEvaluator, Evaluator, Fingerprint, Lead, Memory, OwnLoss, Precision, reference,
};
use crate::model::actuator::{damping_ratio, gain_and_lag, natural_frequency};
use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
use crate::model::effects::{Effect, Scale};
use crate::model::integrate::STEP_FRACTION;
use crate::model::{Complete, Output, Outputs, Pace, Parameter, Signal, Structure};
use crate::search::polish::{Flat, PolishOptions, polish};
use crate::search::{
    self, Method, Plan, RunningSearch, Stoppable, hop_on, polish_on_data, run_in_lockstep,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::statistics::Statistics;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ops::{ControlFlow, Range};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Polishing a model that may be dropped again: the fifth digit of a cost in units of noise decides nothing.
pub(super) const QUICK: PolishOptions = PolishOptions {
    max_iterations: 40,
    gradient_tolerance: 1e-6,
    step_tolerance: 1e-7,
    cost_tolerance: 1e-5,
    damping: 1e-3,
    edge_tolerance: 0.03,
};
/// Moving within what the fitted rows allow, where a model is nearly linear: what takes longer leads out of that.
const NEARBY: PolishOptions = PolishOptions {
    max_iterations: 10,
    ..QUICK
};
/// A polish that shows which way a start leads.
const SHORT: PolishOptions = PolishOptions {
    max_iterations: 6,
    gradient_tolerance: 1e-4,
    step_tolerance: 1e-4,
    cost_tolerance: 1e-4,
    damping: 1e-3,
    edge_tolerance: 0.03,
};

/// What is integrated may err by this share of the noise at most where effects are chosen, and by a fifth of that on average.
const HIDDEN: f64 = 0.4;
/// The integration steps of a diagnosis follow rates this many times the fitted model's, at least and at most, as the noise asks:
/// effects make it faster, and where an effect begins and ends within a step, that errs the more the longer it is.
const HEADROOM: [f64; 2] = [1.0, 3.0];
/// The same where effects are only sought, at most: what is found is judged in the other steps.
const SEEKING_HEADROOM: f64 = 1.5;
/// How many times longer the steps may be there than those that suit what is faster.
const SEEKING_LONGER: f64 = 2.0;

/// Where the rows on which effects are sought are so many times fewer than all, a polish begins on them.
const FAR_FEWER: usize = 4;
/// The noise that hides what numbers of single precision err by, as a share of the largest value.
const SINGLE: f64 = 1e-4;
/// What is left of a lag that gives back what it imitates: more than half of a loop's lag is another than the one that its model has.
const LEFT_OF_LAG: f64 = 0.4;

/// Measured rows, fitted and held out, with errors in units of each channel's noise.
#[derive(Debug)]
pub(super) struct Evidence {
    /// Fitted.
    fit: Stepped,
    /// Held out.
    hold_out: Stepped,
    /// The fitted ones in the longer steps in which effects are sought.
    screened_on: Stepped,
    /// Those of the fitted ones on which effects are sought.
    sought_on: Stepped,
    /// One over the noise variance of each output.
    pub(super) scale: Outputs<f64>,
    /// What an error costs in the fits, where that is not its square.
    loss: Option<OwnLoss>,
    /// Each channel's noise.
    pub(super) noise: BTreeMap<String, Noise>,
    /// How large things are.
    pub(super) sizes: Scale,
    /// The base model's parameters with their bounds, those of known effects among them.
    pub(super) base: Vec<Parameter>,
    /// Seed of what is compared with chance.
    pub(super) seed: u64,
    /// What moves the spool, where that alone is followed.
    settled: Option<Settled>,
    /// What was computed before the run was cut off.
    pub(super) memory: Memory,
    /// Candidates evaluated on it so far.
    evaluations: AtomicUsize,
}

/// A structure fitted to the evidence.
#[derive(Debug, Clone)]
pub(super) struct Model {
    /// The structure, and its parameters, whose start values are the fitted ones.
    pub(super) problem: Problem,
    /// Residuals of each observed channel in units of its noise, one record after another, fitted rows; zero in those of a
    /// record that does not measure it.
    pub(super) fit: Vec<Vec<f64>>,
    /// The same for rows held out.
    pub(super) hold_out: Vec<Vec<f64>>,
    /// How many values either side has that were measured.
    pub(super) measured: Sides<usize>,
    /// Whether it leaves nothing but noise, once that was asked.
    followed: OnceLock<bool>,
    /// The strongest lines in what it leaves, once they were asked for.
    lines: OnceLock<Outputs<Option<f64>>>,
}

impl Model {
    /// The value of the parameter called `name`, if it has one.
    fn value(&self, name: &str) -> Option<f64> {
        let own = self.problem.parameters.iter();
        let mut own = own.filter(|parameter| parameter.name == name);
        own.next().map(Parameter::nominal)
    }

    /// Mean squared residual over all values that were measured.
    pub(super) fn loss(&self, side: Side) -> f64 {
        let count = match side {
            Side::Fit => self.measured.fit,
            Side::HoldOut => self.measured.hold_out,
        };
        let all = self.residuals(side).iter().flatten();
        all.map(|r| r * r).sum::<f64>() / count.max(1) as f64
    }

    /// Residuals of each observed channel.
    pub(super) fn residuals(&self, side: Side) -> &[Vec<f64>] {
        match side {
            Side::Fit => &self.fit,
            Side::HoldOut => &self.hold_out,
        }
    }

    /// What it leaves of `output` on the fitted rows, in units of the noise.
    pub(super) fn left(&self, output: Output) -> f64 {
        let channels = self.structure().observed.iter().zip(&self.fit);
        let own = channels.filter(|(channel, _)| **channel == output);
        let own = own.flat_map(|(_, residual)| residual);
        let (sum, count) = own.fold((0.0, 0), |(sum, count), r| (sum + r * r, count + 1));
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// What begins as this `problem`; its residuals are still those of before.
    pub(super) fn begun_with(&self, problem: Problem) -> Self {
        Self {
            problem,
            ..self.clone()
        }
    }

    /// The structure.
    pub(super) fn structure(&self) -> &Structure {
        &self.problem.structure
    }
}

/// A model with one effect more, where it is polished to the end from if it is to be followed.
#[derive(Debug, Clone)]
pub(super) struct Begun {
    /// The model, and as its start values where it has come.
    pub(super) problem: Problem,
    /// What it costs there on the rows on which effects are sought, a value.
    pub(super) cost: f64,
}

/// Where the search for an effect begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Start {
    /// Values of its free parameters.
    pub(super) trial: Vec<f64>,
    /// Whether what imitates it in the base model is taken back, and what is known of the valve, which then may imitate it.
    pub(super) released: bool,
}

/// Fitted or held out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Fitted.
    Fit,
    /// Held out.
    HoldOut,
}

impl Evidence {
    /// The rows by which effects are chosen, in units of their `noise`, in steps that suit the rates of `before`.
    pub(super) fn new(
        before: &Fitted,
        noise: &BTreeMap<String, Noise>,
        settled: Option<Settled>,
        measurements: &Measurements,
        sizes: Scale,
        plan: &Plan,
    ) -> Self {
        let rate = |headroom: f64| {
            let mut near = before.problem.parameters.clone();
            for (parameter, &value) in near.iter_mut().zip(before.values.as_slice()) {
                parameter.low = parameter.low.max(value / headroom);
                parameter.high = parameter.high.min(value * headroom);
            }
            before.problem.structure.fastest_rate(&near)
        };
        let chosen_by = measurements.chosen_by();
        let scale = weights(noise, &measurements.fit);
        let headroom = headroom(largest_over_noise(&chosen_by.fit, &scale));
        let judging = |records: Vec<Series>| Stepped::new(records, rate(headroom), 1.0);
        let least = headroom.min(SEEKING_HEADROOM);
        let seeking = |records: Vec<Series>| Stepped::new(records, rate(least), SEEKING_LONGER);
        let sought_on = match measurements.is_static {
            true => chosen_by.fit.clone(),
            false => sought_on(&chosen_by.fit),
        };
        Self {
            screened_on: seeking(chosen_by.fit.clone()),
            sought_on: seeking(sought_on),
            fit: judging(chosen_by.fit),
            hold_out: judging(chosen_by.hold_out),
            scale,
            loss: before.problem.loss,
            noise: noise.clone(),
            sizes,
            base: before.problem.parameters.clone(),
            seed: CHANCE,
            settled,
            memory: plan.memory.clone(),
            evaluations: AtomicUsize::default(),
        }
    }

    /// Candidates evaluated so far.
    pub(super) fn evaluations(&self) -> usize {
        self.evaluations.load(Ordering::Relaxed)
    }

    fn count(&self, evaluations: usize) {
        self.evaluations.fetch_add(evaluations, Ordering::Relaxed);
    }

    /// The base model on this evidence; `None` where it diverges or nothing was held out.
    pub(super) fn start_from(&self, before: &Fitted) -> Option<Model> {
        let held_out = |record: &Series| record.samples.iter().any(|s| s.weight > 0.0);
        if !self.records(Side::HoldOut).iter().any(held_out) {
            return None;
        }
        let mut problem = before.problem.clone();
        problem.scale = self.scale;
        set_start(&mut problem, before.fit.values());
        if let Some(settled) = &self.settled {
            settled.hold(&mut problem);
        }
        self.polished(problem)
    }

    /// Lets what was settled by the spool alone move again. Whether it was held.
    pub(super) fn release(&self, problem: &mut Problem) -> bool {
        let settled = self.settled.as_ref();
        settled.is_some_and(|settled| settled.release(problem))
    }

    /// `model` with what was settled by the spool alone free to move; `None` where nothing is held, or where the flow then bends the
    /// spool.
    pub(super) fn released(&self, model: &Model) -> Option<Model> {
        let mut problem = model.problem.clone();
        if !self.release(&mut problem) {
            return None;
        }
        let released = self.polished(problem)?;
        (released.left(Output::Spool) <= NEAR).then_some(released)
    }

    fn rows(&self, side: Side) -> &Stepped {
        match side {
            Side::Fit => &self.fit,
            Side::HoldOut => &self.hold_out,
        }
    }

    /// The records of one side, in steps that suit the base model.
    pub(super) fn records(&self, side: Side) -> &[Series] {
        self.rows(side).records()
    }

    /// What `problem` does at its start on the records of one side.
    fn simulated(&self, problem: &Problem, side: Side) -> Trajectories {
        let values = Complete::nominal(&problem.parameters);
        let Data::Series(records) = &**self.rows(side).suiting(rate_at_start(problem)) else {
            unreachable!("evidence is records")
        };
        reference::trajectories(&problem.structure, &values, records)
    }

    /// Where each record's rows that count begin among all that count.
    pub(super) fn starts(&self, side: Side) -> Vec<usize> {
        starts(self.records(side))
    }

    /// Looks where effects could lie: at lines in the residual of `model`, and at the largest speed of its spool.
    pub(super) fn look_at(&mut self, model: &Model) {
        let signals = Signals::new(self.records(Side::Fit), &model.problem);
        let speeds = signals.of(Signal::Speed).iter();
        let fastest = speeds.fold(0.0, |most: f64, speed| most.max(speed.abs()));
        if fastest.is_normal() {
            self.sizes.speed = fastest;
        }
        self.sizes.lines = self.lines(model);
    }

    /// The strongest line in what `model` leaves of each output on the fitted rows.
    fn lines(&self, model: &Model) -> Outputs<Option<f64>> {
        *model.lines.get_or_init(|| {
            let mut lines = Outputs::default();
            for (output, residual) in model.structure().observed.iter().zip(&model.fit) {
                let unit = self.scale[*output].sqrt();
                let measured = residual.iter().map(|value| value / unit).collect();
                // Rounding has lines where a slow ramp passes its steps.
                let beyond = match self.noise.get(output.name()) {
                    Some(noise) if noise.is_resolution() => &noise.beyond(measured),
                    _ => residual,
                };
                let piece = longest_piece(self.records(Side::Fit), *output);
                lines[*output] = strongest_line(&beyond[piece], self.sizes.interval);
            }
            lines
        })
    }

    /// How large things are, and the lines in what `model` leaves.
    pub(super) fn sizes_beside(&self, model: &Model) -> Scale {
        Scale {
            lines: self.lines(model),
            ..self.sizes.clone()
        }
    }

    /// The observed channels of which `model` leaves nothing on the fitted rows but what their resolution does. What lowers the
    /// error there follows the rounding.
    pub(super) fn resolved(&self, model: &Model) -> Vec<Output> {
        let observed = model.structure().observed.iter().copied();
        let coarse = |output: &Output| {
            let noise = self.noise.get(output.name());
            noise.is_some_and(Noise::is_resolution)
        };
        let coarse: Vec<Output> = observed.filter(coarse).collect();
        if coarse.is_empty() {
            return coarse;
        }
        let simulated = self.simulated(&model.problem, Side::Fit);
        let fitted = Compared::all(self.records(Side::Fit), &simulated);
        let left = left_over(&fitted, &coarse, &self.noise);
        let resolved = coarse.into_iter().zip(left);
        resolved
            .filter(|(_, left)| !left.structured)
            .map(|(output, _)| output)
            .collect()
    }

    /// Whether nothing that moves the spool is left to be found: `model` leaves only noise of a spool that is measured, and beside the noise
    /// of both that shows what moves it better than the flow does, which alone is measured with it.
    pub(super) fn has_moved_the_spool(&self, model: &Model) -> bool {
        let observed = &model.structure().observed;
        let beside = [Output::Spool, Output::Flow];
        if observed.len() != 2 || beside.iter().any(|output| !observed.contains(output)) {
            return false;
        }
        let simulated = self.simulated(&model.problem, Side::Fit);
        let fitted = Compared::all(self.records(Side::Fit), &simulated);
        let [spool, flow] = beside.map(|output| {
            let rows = fitted.iter().flat_map(|one| one.rows(output));
            rows.map(|(_, _, simulated)| simulated).std_dev() / self.noise[output.name()].value
        });
        spool >= flow && self.leaves_only_noise(model, &[Output::Spool])
    }

    /// Whether `model` leaves nothing but noise: nothing structured on the fitted rows, and on the held-out ones no more than there
    /// may be of it.
    pub(super) fn is_followed_by(&self, model: &Model) -> bool {
        *model
            .followed
            .get_or_init(|| self.leaves_only_noise(model, &model.structure().observed))
    }

    /// The noise of the channels, where `model` leaves plainly less of it than is assumed in one of them.
    pub(super) fn quieter(&self, model: &Model) -> Option<BTreeMap<String, Noise>> {
        let simulated = self.simulated(&model.problem, Side::Fit);
        let fitted = Compared::all(self.records(Side::Fit), &simulated);
        let mut noise = noise_floors(&fitted, &model.structure().observed, true);
        for (name, one) in &mut noise {
            if let Some(of_inputs) = &self.noise[name].of_inputs {
                *one = one.clone().with(of_inputs.clone());
            }
        }
        quieter(&noise, &self.noise).then_some(noise)
    }

    fn leaves_only_noise(&self, model: &Model, observed: &[Output]) -> bool {
        let [fit, hold_out] =
            [Side::Fit, Side::HoldOut].map(|side| self.simulated(&model.problem, side));
        let floor = |output: Output| self.noise[output.name()].value;
        let held_out = Compared::all(self.records(Side::HoldOut), &hold_out);
        if least_ratio(&held_out, observed, floor) >= NEAR {
            return false;
        }
        let fitted = Compared::all(self.records(Side::Fit), &fit);
        let left = left_over(&fitted, observed, &self.noise);
        left.iter().all(|left| !left.structured)
    }

    /// `structure` on the fitted rows: what the base model has as it is there, what is new with bounds that suit the
    /// records, and the free ones of both starting where `start` has values for them.
    pub(super) fn problem(&self, structure: &Structure, start: &[Parameter]) -> Problem {
        let named = |list: &[Parameter], name: &str| list.iter().find(|p| p.name == name).cloned();
        let mut parameters = structure.parameters_at(&self.sizes);
        for parameter in &mut parameters {
            // By name: an effect that is added may stand before the known ones.
            if let Some(known) = named(&self.base, &parameter.name) {
                *parameter = known;
            }
            if let Some(from) = named(start, &parameter.name)
                && !parameter.is_fixed()
            {
                parameter.set_nominal(parameter.clamp(from.nominal()));
                parameter.set_fixed(from.is_fixed());
            }
        }
        let rate = rate_at(structure, &parameters);
        Problem {
            structure: structure.clone(),
            parameters,
            data: self.fit.suiting(rate).clone(),
            scale: self.scale,
            loss: self.loss,
        }
    }

    /// `model` with `effect`, where `start` says.
    pub(super) fn extended(&self, model: &Model, effect: Effect, start: &Start) -> Problem {
        let Start { trial, released } = start;
        let structure = model.structure().with(effect);
        let mut start = model.problem.parameters.clone();
        let imitates = |p: &&mut Parameter| {
            !p.is_fixed() && effect.entry.imitated_by.contains(&p.name.as_str())
        };
        if *released {
            let imitating = start.iter_mut().filter(imitates);
            imitating.for_each(|parameter| parameter.set_nominal(out_of_the_way(parameter)));
            for known in self
                .known(model)
                .flat_map(|known| known.parameters(&self.sizes))
            {
                let own = start.iter_mut().filter(|own| own.name == known.name);
                let own = own.filter(|own| !own.is_fixed());
                own.for_each(|own| own.set_nominal(own.clamp(known.nominal())));
            }
        }
        start.extend(self.at(effect, trial));
        self.problem(&structure, &start)
    }

    /// `model` without `effect`, fitted again; also from where its loop saturates at the speed that the effect limits it to, which
    /// nothing showed while that did.
    pub(super) fn without(&self, model: &Model, effect: Effect) -> Option<Model> {
        let structure = model.structure().without(effect);
        let start = model.problem.parameters.clone();
        let saturating = saturation_for(model, effect, &self.sizes).map(|saturation| {
            let mut start = start.clone();
            let own = start.iter_mut().filter(|own| own.name == SATURATION);
            let free = own.filter(|own| !own.is_fixed());
            free.for_each(|own| own.set_nominal(own.clamp(saturation)));
            start
        });
        let starts = std::iter::once(start).chain(saturating);
        let models = starts.filter_map(|start| self.polished(self.problem(&structure, &start)));
        models.min_by(|a, b| a.loss(Side::Fit).total_cmp(&b.loss(Side::Fit)))
    }

    /// The free parameters of `effect` with the values of a `trial`.
    pub(super) fn at(&self, effect: Effect, trial: &[f64]) -> impl Iterator<Item = Parameter> {
        let free = effect.parameters(&self.sizes).into_iter();
        let free = free.filter(|parameter| !parameter.is_fixed());
        free.zip(trial).map(|(mut parameter, &value)| {
            parameter.set_nominal(parameter.clamp(value));
            parameter
        })
    }

    /// `model` with another `form` in the place of its `effect`, where a polish of few steps leads from there: with the best of the
    /// form's trials, or with the size that the effect had.
    pub(super) fn handed_on(&self, model: &Model, effect: Effect, form: Effect) -> Option<Begun> {
        let structure = model.structure().without(effect).with(form);
        let had = effect.parameters(&self.sizes).into_iter().next();
        let had = had.and_then(|size| {
            model
                .problem
                .parameters
                .iter()
                .find(|p| p.name == size.name)
        });
        let begun = |trial: Vec<f64>| {
            let own = model.problem.parameters.iter().cloned();
            let start: Vec<Parameter> = own.chain(self.at(form, &trial)).collect();
            self.problem(&structure, &start)
        };
        let trials = form.trials(&self.sizes);
        let sized = trials.clone().into_iter().map(|mut trial| {
            if let (Some(size), Some(had)) = (trial.first_mut(), had) {
                *size = had.nominal();
            }
            trial
        });
        self.best_begun(trials.into_iter().chain(sized).map(begun))
    }

    /// `model` with `other` in the place of its `effect`, where a polish of few steps leads from where the loop has the effect's
    /// poles and the other those of the loop: of one output alone, two pairs of poles in a row can be exchanged. `None` where either
    /// has no such pair.
    pub(super) fn with_poles_exchanged(
        &self,
        model: &Model,
        effect: Effect,
        other: Effect,
    ) -> Option<Begun> {
        let pairs = effect.is_of_second_order() && other.is_of_second_order();
        if !pairs || model.structure().observed.len() > 1 {
            return None;
        }
        let (gain, lag) = (model.value(GAIN)?, model.value(TIME_CONSTANT)?);
        let trial = [natural_frequency(gain, lag) / TAU, damping_ratio(gain, lag)];
        // Before those of the effect, which may be the same one.
        let start = self.with_poles_of(model, effect)?;
        let start: Vec<Parameter> = self.at(other, &trial).chain(start).collect();
        let structure = model.structure().without(effect).with(other);
        self.polished_a_little(self.problem(&structure, &start))
    }

    /// The same where the loop has the effect's poles and no longer does what imitates the other: of one output alone, a loop that
    /// saturates and a lag behind it are a limit and a loop. `None` where the effect has no poles, or nothing imitates the other.
    pub(super) fn with_limit_for_loop(
        &self,
        model: &Model,
        effect: Effect,
        other: Effect,
    ) -> Option<Begun> {
        let imitated = other.entry.imitated_by.contains(&SATURATION);
        if !imitated || !effect.is_of_second_order() || model.structure().observed.len() > 1 {
            return None;
        }
        let start = self.with_poles_of(model, effect)?;
        let without = model.structure().without(effect);
        let loop_alone = model.begun_with(self.problem(&without, &start));
        let trials = other.trials(&self.sizes).into_iter();
        let begun = trials.map(|trial| {
            let released = Start {
                trial,
                released: true,
            };
            self.extended(&loop_alone, other, &released)
        });
        self.best_begun(begun)
    }

    /// What a polish of few steps makes of the one of `starts` that costs least.
    fn best_begun(&self, starts: impl Iterator<Item = Problem>) -> Option<Begun> {
        let costs = starts.map(|start| (self.cost(&start), start));
        let (_, least) = costs.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        self.polished_a_little(least)
    }

    /// The parameters of `model` where its loop has the poles of its `effect`, which is of second order.
    fn with_poles_of(&self, model: &Model, effect: Effect) -> Option<Vec<Parameter>> {
        let own = effect.parameters(&self.sizes);
        let (frequency, damping) = (model.value(&own[0].name)?, model.value(&own[1].name)?);
        let [gain, lag] = gain_and_lag(TAU * frequency, damping);
        let mut start = model.problem.parameters.clone();
        for (name, value) in [(GAIN, gain), (TIME_CONSTANT, lag)] {
            let own = start.iter_mut().filter(|p| p.name == name && !p.is_fixed());
            own.for_each(|p| p.set_nominal(p.clamp(value)));
        }
        Some(start)
    }

    /// The effects of `model` that were known beforehand.
    fn known<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = &'a Effect> {
        let is_base = |parameter: Parameter| self.base.iter().any(|own| own.name == parameter.name);
        let effects = model.structure().effects.iter();
        effects.filter(move |effect| effect.parameters(&self.sizes).into_iter().all(is_base))
    }

    /// Where the search for `effect` on top of `model` begins.
    pub(super) fn search_starts(&self, model: &Model, effect: &Effect) -> Vec<Start> {
        let imitated = !effect.entry.imitated_by.is_empty() || self.known(model).next().is_some();
        let one = |trial: Vec<f64>| {
            [false, true]
                .into_iter()
                .take(1 + usize::from(imitated))
                .map(move |released| Start {
                    trial: trial.clone(),
                    released,
                })
        };
        let trials = effect.trials(&self.sizes_beside(model)).into_iter();
        trials.flat_map(one).collect()
    }

    /// `problem` on the rows on which effects are sought.
    pub(super) fn seeking(&self, problem: &Problem) -> Problem {
        self.sought_on.under(problem)
    }

    /// What `problem` costs at its start on those rows, a value; infinite where it diverges.
    pub(super) fn cost(&self, problem: &Problem) -> f64 {
        let problem = self.seeking(problem);
        let cost = reference::cost(&problem, &problem.start());
        cost.map_or(f64::INFINITY, |cost| cost / problem.values() as f64)
    }

    /// The best that a search by `method` finds around the start of each of the `problems`, all at once.
    pub(super) fn searched(
        &self,
        problems: &[Problem],
        method: &dyn Method,
        evaluator: &mut dyn Evaluator,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<Begun>> {
        let seeking: Vec<Problem> = problems.iter().map(|one| self.seeking(one)).collect();
        let begin = |problem| {
            let own = || search::Start::From(Problem::start(problem));
            RunningSearch::begin(problem, method, own(), self.seed)
        };
        let mut searches = seeking.iter().map(begin).collect::<Result<Vec<_>>>()?;
        run_in_lockstep(&mut searches, evaluator, progress)?;
        Ok(self.found(problems.iter().cloned(), searches))
    }

    /// The best that the `searches` found for each of the `problems`, whose parameters they share, or its start where that is
    /// better.
    pub(super) fn found(
        &self,
        problems: impl Iterator<Item = Problem>,
        searches: Vec<RunningSearch>,
    ) -> Vec<Begun> {
        let both: Vec<(Problem, RunningSearch)> = problems.zip(searches).collect();
        let found = |(mut problem, running): (Problem, RunningSearch)| {
            let RunningSearch {
                problem: space,
                search,
            } = running;
            self.count(search.evaluations());
            let cost = |free: &[f64]| reference::cost(space, free).unwrap_or(f64::INFINITY);
            let (best, start) = (search.best().0, space.start());
            let costs = [cost(best), cost(&start)];
            let better = costs[0] < costs[1];
            set_start(&mut problem, if better { best } else { &start });
            Begun {
                cost: costs[usize::from(!better)] / space.values() as f64,
                problem,
            }
        };
        both.into_par_iter().map(found).collect()
    }

    /// Residuals and derivatives at the problem's start; `None` where it diverges, or the run was stopped.
    pub(super) fn linear(&self, problem: &Problem) -> Option<Linear> {
        match self.memory.interrupt().asked() {
            true => None,
            false => Linear::new(problem),
        }
    }

    /// The same on all fitted rows at the start of each of `problems`, which differ in nothing else, in the longer steps, those that
    /// suit the fastest, and by differences.
    pub(super) fn linear_side_by_side(&self, problems: &[Problem]) -> Vec<Option<Linear>> {
        if self.memory.interrupt().asked() {
            return problems.iter().map(|_| None).collect();
        }
        let fastest = problems.iter().map(rate_at_start).fold(0.0, f64::max);
        let on = |problem: &Problem| Problem {
            data: self.screened_on.suiting(fastest).clone(),
            ..problem.clone()
        };
        let problems: Vec<Problem> = problems.iter().map(on).collect();
        let precision = match self.noise_hides_single_precision() {
            true => Precision::F32,
            false => Precision::F64,
        };
        Linear::by_differences(&problems, &CpuEvaluator::new(precision))
    }

    /// The same of one problem.
    pub(super) fn linear_in_long_steps(&self, problem: &Problem) -> Option<Linear> {
        let found = self.linear_side_by_side(std::slice::from_ref(problem));
        found.into_iter().next().flatten()
    }

    /// Whether the noise of every channel is far above what numbers of single precision err by at its largest value.
    fn noise_hides_single_precision(&self) -> bool {
        SINGLE * largest_over_noise(self.records(Side::Fit), &self.scale) < 1.0
    }

    /// What a polish of few steps makes of the problem's start on the rows on which effects are sought; `None` where that diverges,
    /// or the run was stopped before its end.
    pub(super) fn polished_a_little(&self, problem: Problem) -> Option<Begun> {
        self.polished_led(problem, &Lead::default(), &SHORT)
    }

    /// What a polish on those rows makes of the problem's start while it is led; `None` where that diverges, or the run was stopped
    /// before its end.
    pub(super) fn polished_led(
        &self,
        mut problem: Problem,
        lead: &Lead,
        options: &PolishOptions,
    ) -> Option<Begun> {
        let interrupt = self.memory.interrupt();
        let seeking = self.seeking(&problem);
        let key = || {
            let mut fingerprint = Fingerprint::default();
            let text = format!("short polish {options:?} {lead:?}");
            fingerprint.text(&text).problem(&seeking).finish()
        };
        let polished: Option<(f64, Vec<f64>, usize)> = self.memory.once(key, || {
            let mut stoppable = Stoppable::led(&seeking, interrupt, lead);
            let (free, start) = (seeking.free(), seeking.start());
            let polished = polish(&mut stoppable, &free, &start, options).ok()?;
            Some((polished.cost, polished.values, polished.evaluations))
        });
        if interrupt.asked() {
            return None;
        }
        let (cost, values, evaluations) = polished?;
        self.count(evaluations);
        set_start(&mut problem, &values);
        Some(Begun {
            cost: cost / seeking.values() as f64,
            problem,
        })
    }

    /// Polishes from the problem's start; `None` where that diverges, leads to a hum that no channel shows, or the run was stopped
    /// before its end.
    pub(super) fn polished(&self, problem: Problem) -> Option<Model> {
        let mut problem = self.fit.under(&problem);
        let interrupt = self.memory.interrupt();
        let free = problem.free();
        let start = problem.start();
        if !free.is_empty() {
            let key = || {
                let mut fingerprint = Fingerprint::default();
                fingerprint.text("quick polish").problem(&problem).finish()
            };
            let polished: Option<(Vec<f64>, Vec<Flat>, usize)> = self.memory.once(key, || {
                let start = self.most_of_the_way(&problem).unwrap_or(start);
                let polished = polish_on_data(&problem, interrupt, &free, &start, &QUICK).ok()?;
                Some((polished.values, polished.flat, polished.evaluations))
            });
            if interrupt.asked() {
                return None;
            }
            let (values, flats, evaluations) = polished?;
            self.count(evaluations);
            let held_out = &self.hold_out.under(&problem).data;
            let set = set_by_held_out(&problem, interrupt, &values, &flats, held_out, &NEARBY);
            set_start(&mut problem, &set.values);
        }
        let fit = self.residuals(&problem, Side::Fit)?;
        let hold_out = self.residuals(&problem, Side::HoldOut)?;
        let simulate = |problem: &Problem| self.simulated(problem, Side::Fit);
        let records = self.records(Side::Fit);
        if !hums_show(&problem, &self.base, records, &self.sizes, simulate) {
            return None;
        }
        Some(Model {
            measured: Sides {
                fit: problem.values(),
                hold_out: self.hold_out.under(&problem).values(),
            },
            problem,
            fit,
            hold_out,
            followed: OnceLock::new(),
            lines: OnceLock::new(),
        })
    }

    /// Where a polish on the rows on which effects are sought leads; `None` where they are not far fewer than all, or it costs no less
    /// on all.
    fn most_of_the_way(&self, problem: &Problem) -> Option<Vec<f64>> {
        let (seeking, start) = (self.seeking(problem), problem.start());
        if FAR_FEWER * seeking.values() > problem.values() {
            return None;
        }
        let mut stoppable = Stoppable::new(&seeking, self.memory.interrupt());
        let polished = polish(&mut stoppable, &seeking.free(), &start, &QUICK).ok()?;
        self.count(polished.evaluations);
        let cost = |values: &[f64]| reference::cost(problem, values).unwrap_or(f64::INFINITY);
        (cost(&polished.values) < cost(&start)).then_some(polished.values)
    }

    /// `model` in the deepest valley that hops from it lead to; `None` where they lead nowhere.
    pub(super) fn deepened(&self, model: &Model) -> Option<Model> {
        let mut problem = self.problem(model.structure(), &model.problem.parameters);
        let (values, evaluations) =
            hop_on(&problem, &model.problem.start(), self.seed, &self.memory);
        self.count(evaluations);
        set_start(&mut problem, &values?);
        let deeper = self.polished(problem)?;
        (deeper.loss(Side::Fit) < model.loss(Side::Fit)).then_some(deeper)
    }

    /// Residuals of each observed channel at the problem's start, in units of noise; `None` where the model diverges.
    fn residuals(&self, problem: &Problem, side: Side) -> Option<Vec<Vec<f64>>> {
        let simulated = self.simulated(problem, side);
        let compared = Compared::all(self.records(side), &simulated);
        let one = |&output: &Output| -> Vec<f64> {
            let errors = residual_in_all_rows(&compared, output).into_iter();
            errors
                .map(|error| error * self.scale[output].sqrt())
                .collect()
        };
        let channels: Vec<Vec<f64>> = problem.structure.observed.iter().map(one).collect();
        let finite = channels.iter().flatten().all(|value| value.is_finite());
        finite.then_some(channels)
    }
}

/// The largest value of any channel of `records` over its noise, whose variance is one over its `scale`.
fn largest_over_noise(records: &[Series], scale: &Outputs<f64>) -> f64 {
    let channels = records
        .iter()
        .flat_map(|record| Output::ALL.map(|output| (record, output)));
    let measured = channels.filter(|(record, output)| record.measured[*output]);
    let largest = measured.map(|(record, output)| {
        let values = record.samples.iter().map(|row| row.target[output].abs());
        values.fold(0.0, f64::max) * scale[output].sqrt()
    });
    largest.fold(0.0, f64::max)
}

/// How many times the rates of a model the steps have to follow for what they err by to be hidden in the noise, of which values
/// are so many times the `largest`: a step of length h within which a saturation begins or ends errs by up to (h λ)²/60 of that
/// where the fastest rate is λ, far more than the fifth power that other steps do.
fn headroom(largest: f64) -> f64 {
    let step = (60.0 * HIDDEN / largest).sqrt();
    let [least, most] = HEADROOM;
    (STEP_FRACTION / step).clamp(least, most)
}

/// Where a base parameter no longer imitates an effect.
fn out_of_the_way(parameter: &Parameter) -> f64 {
    match parameter.pace {
        Some(Pace::TimeConstant) => parameter.clamp(LEFT_OF_LAG * parameter.nominal()),
        _ => parameter.high,
    }
}

/// The longest piece of the `records` that measure `output`, among the rows that count of all of them.
fn longest_piece(records: &[Series], output: Output) -> Range<usize> {
    let mut longest = 0..0;
    let mut begin = 0;
    for record in records {
        for piece in record.pieces() {
            let own = begin..begin + piece.len();
            begin = own.end;
            if record.measured[output] && own.len() > longest.len() {
                longest = own;
            }
        }
    }
    longest
}

/// Lets the free parameters start at `values`.
pub(super) fn set_start(problem: &mut Problem, values: &[f64]) {
    let free = problem.parameters.iter_mut().filter(|p| !p.is_fixed());
    for (parameter, value) in free.zip(values) {
        parameter.set_nominal(*value);
    }
}

/// Where the loop of `model` saturates at the speed that its `effect` limits it to, if a saturation imitates that.
fn saturation_for(model: &Model, effect: Effect, sizes: &Scale) -> Option<f64> {
    let limit = effect.parameters(sizes).into_iter().next()?;
    let of_speed = limit.unit == format!("{}/s", sizes.command_unit);
    let imitated = effect.entry.imitated_by.contains(&SATURATION);
    if !(of_speed && imitated) {
        return None;
    }
    Some(model.value(&limit.name)? / model.value(GAIN)?)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::evaluate::scale_of;
    use crate::evaluate::workload;
    use crate::model::effects::{CATALOGUE, Port, entry};
    use crate::model::valve::{Meter, ValveForm};
    use crate::model::{FreeForm, ServoValve};
    use crate::record::{self, Channel, Record};

    /// Jumps of the command every 40 ms in rows of 20 ms, of a spool that saturates and that no exact step moves.
    #[test]
    fn what_steps_err_by_is_hidden_in_the_noise() {
        let structure = Structure::actuator(10.0, "V").with("integral_action".parse().unwrap());
        let parameters = structure.parameters();
        let rate = rate_at(&structure, &parameters);
        let Data::Series(mut series) = (*workload::actuator(4000).data).clone() else {
            unreachable!()
        };
        series[0].time = series[0].time.iter().copied().step_by(20).collect();
        series[0].samples = series[0].samples.iter().copied().step_by(20).collect();
        let simulated = |headroom: f64| {
            let rows = Stepped::new(series.clone(), headroom * rate, 1.0);
            let values = Complete::nominal(&parameters);
            reference::trajectories(&structure, &values, rows.records()).remove(0)
        };
        let (exact, most) = (simulated(30.0), 9.0);
        let mut steps = Vec::new();
        // Up to where the most is asked.
        for largest in [1.0, 30.0, 100.0, 300.0, 400.0] {
            let own = headroom(largest);
            let pairs = simulated(own).into_iter().zip(&exact);
            let errors = pairs.map(|(own, exact)| own[Output::Spool] - exact[Output::Spool]);
            let errors: Vec<f64> = errors.map(|error| error.abs() * largest / most).collect();
            let greatest = errors.iter().copied().fold(0.0, f64::max);
            let squares: f64 = errors.iter().map(|error| error * error).sum();
            let average = (squares / errors.len() as f64).sqrt();
            println!("{largest}: {own}, {greatest}, {average}");
            assert!(greatest < HIDDEN && average < 0.2 * HIDDEN, "{largest}");
            steps.push(own);
        }
        assert!(steps.is_sorted() && steps[0] == HEADROOM[0] && steps[4] > 2.0 * steps[0]);
        assert_eq!(headroom(1e6), HEADROOM[1]);
    }

    /// A spool with its flow, and a piston with what the supply delivers for it: every effect acts on one of them.
    fn structures() -> [Structure; 2] {
        [
            (vec![Output::Spool, Output::Flow], Meter::Load),
            (vec![Output::Flow, Output::Position], Meter::Supply),
        ]
        .map(|(observed, meter)| Structure {
            observed,
            base: ServoValve::with(ValveForm {
                meter,
                ..ValveForm::linear()
            })
            .into(),
            ..Structure::actuator(10.0, "V")
        })
    }

    /// Evidence without rows, on which the parameters of `structure` have bounds and starts that no catalogue gives, and every
    /// third is fixed.
    pub(in crate::diagnose) fn evidence(structure: &Structure) -> Evidence {
        let time: Vec<f64> = (0..1000).map(|k| 1e-3 * f64::from(k)).collect();
        let values = |most: f64| time.iter().map(|t| most * (6.0 * t).sin()).collect();
        let channels = [
            (Channel::Command, "V", 9.0),
            (Channel::Spool, "V", 8.0),
            (Channel::Flow, "L/min", 50.0),
            (Channel::Position, "mm", 30.0),
        ]
        .map(|(channel, unit, most)| (channel, record::Series::new(unit, values(most))));
        let record = Record::new("run", time.clone(), channels).unwrap();
        let mut sizes = scale_of(structure, &[record]);
        sizes.lines = Outputs::all(Some(37.0));
        let mut base = structure.parameters_at(&sizes);
        for (i, parameter) in base.iter_mut().enumerate() {
            let share = 0.3 + 1e-3 * i as f64;
            let [low, start, high] =
                [share - 0.1, share, share + 0.1].map(|u| parameter.from_unit(u));
            (parameter.low, parameter.high) = (low, high);
            parameter.set_nominal(start);
            parameter.set_fixed(i % 3 == 1);
        }
        let nothing = || Stepped::new(Vec::new(), 1.0, 1.0);
        Evidence {
            fit: nothing(),
            screened_on: nothing(),
            sought_on: nothing(),
            hold_out: nothing(),
            scale: Outputs::all(1.0),
            loss: None,
            noise: BTreeMap::new(),
            sizes,
            base,
            seed: 1,
            settled: None,
            memory: Memory::default(),
            evaluations: AtomicUsize::default(),
        }
    }

    pub(in crate::diagnose) fn model(evidence: &Evidence, structure: &Structure) -> Model {
        Model {
            problem: evidence.problem(structure, &evidence.base),
            fit: Vec::new(),
            hold_out: Vec::new(),
            measured: Sides::default(),
            followed: OnceLock::new(),
            lines: evidence.sizes.lines.into(),
        }
    }

    fn names(parameters: &[Parameter]) -> Vec<&str> {
        parameters.iter().map(|p| p.name.as_str()).collect()
    }

    /// The parameters of `problem` are those of its structure, in this order; what the base model has is as it is there.
    fn assert_in_place(evidence: &Evidence, problem: &Problem) {
        let ordered = problem.structure.parameters_at(&evidence.sizes);
        let what = || format!("{:?}", problem.structure.effects);
        assert_eq!(names(&problem.parameters), names(&ordered), "{}", what());
        for (parameter, generic) in problem.parameters.iter().zip(&ordered) {
            let known = evidence.base.iter().find(|p| p.name == parameter.name);
            let mut expected = known.unwrap_or(generic).clone();
            if !expected.is_fixed() {
                expected.set_nominal(parameter.nominal());
            }
            assert_eq!(*parameter, expected, "{}", what());
            assert_eq!(parameter.clamp(parameter.nominal()), parameter.nominal());
        }
    }

    #[test]
    fn known_effects_keep_their_parameters_whatever_is_added_or_dropped() {
        let form = FreeForm {
            port: Port::Command,
            signal: Signal::Command,
            output: None,
            knots: vec![-5.0, 0.0, 5.0],
        };
        for bare in structures() {
            let on = |entry: &&'static crate::model::effects::Entry| entry.on(&bare);
            let all: Vec<Effect> = CATALOGUE.iter().flat_map(on).collect();
            // None, each alone, and with others.
            let mut known: Vec<Vec<Effect>> = vec![Vec::new()];
            for (i, &first) in all.iter().enumerate() {
                known.push(vec![first]);
                known.extend(
                    all[i + 1..]
                        .iter()
                        .step_by(4)
                        .map(|&second| vec![first, second]),
                );
            }
            for known in known {
                let base = known.iter().fold(bare.clone(), |s, &effect| s.with(effect));
                let evidence = evidence(&base);
                let model = model(&evidence, &base);
                assert_eq!(model.problem.parameters, evidence.base, "{known:?}");
                let corrected = Structure {
                    free_form: Some(form.clone()),
                    ..base.clone()
                };
                assert_in_place(&evidence, &evidence.problem(&corrected, &evidence.base));
                for &effect in all.iter().filter(|effect| !known.contains(effect)) {
                    for start in evidence.search_starts(&model, &effect) {
                        let problem = evidence.extended(&model, effect, &start);
                        assert_in_place(&evidence, &problem);
                        let own = effect.parameters(&evidence.sizes);
                        for (own, value) in own.iter().filter(|p| !p.is_fixed()).zip(&start.trial) {
                            let found = problem.parameters.iter().find(|p| p.name == own.name);
                            assert_eq!(found.unwrap().nominal(), own.clamp(*value), "{effect}");
                        }
                        let without = problem.structure.without(effect);
                        let again = evidence.problem(&without, &model.problem.parameters);
                        assert_eq!(again.parameters, evidence.base, "{known:?}, {effect}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_imitates_an_effect_is_taken_back_only_where_it_is_free() {
        let structure = &structures()[0];
        let slew: Effect = "slew_limit".parse().unwrap();
        for fixed in [false, true] {
            let mut evidence = evidence(structure);
            let of = |list: &[Parameter]| list.iter().position(|p| p.name == "saturation").unwrap();
            let place = of(&evidence.base);
            evidence.base[place].set_fixed(fixed);
            let known = evidence.base[place].clone();
            let start = Start {
                trial: vec![100.0],
                released: true,
            };
            let problem = evidence.extended(&model(&evidence, structure), slew, &start);
            let found = problem.parameters[of(&problem.parameters)].nominal();
            assert_eq!(found, if fixed { known.nominal() } else { known.high });
        }
    }

    #[test]
    fn a_lag_gives_back_a_part_of_itself_to_what_it_imitates() {
        let structure = &structures()[0];
        let late: Effect = "delay~loop".parse().unwrap();
        let mut evidence = evidence(structure);
        let lag = evidence.base.iter_mut().find(|p| p.name == TIME_CONSTANT);
        let lag = lag.unwrap();
        (lag.low, lag.high) = (1e-3, 0.1);
        lag.set_fixed(false);
        lag.set_nominal(0.01);
        let model = model(&evidence, structure);
        for (released, expected) in [(false, 0.01), (true, LEFT_OF_LAG * 0.01)] {
            let trial = vec![0.002];
            let problem = evidence.extended(&model, late, &Start { trial, released });
            let found = problem.parameters.iter().find(|p| p.name == TIME_CONSTANT);
            assert_eq!(found.unwrap().nominal(), expected);
        }
    }

    /// A parameter that has this value.
    pub(in crate::diagnose) fn at(name: &str, value: f64) -> Parameter {
        let mut parameter = Parameter::linear(name, "", value, value, value);
        parameter.set_nominal(value);
        parameter
    }

    /// Evidence without noise, of 2 s, of `bare` with `effect`, whose parameters are `planted`.
    pub(in crate::diagnose) fn planted(
        bare: &Structure,
        effect: Effect,
        planted: &[Parameter],
    ) -> Evidence {
        let mut evidence = evidence(bare);
        evidence.base = bare.parameters_at(&evidence.sizes);
        let truth = evidence.problem(&bare.with(effect), planted);
        let Data::Series(mut series) = (*workload::actuator(2000).data).clone() else {
            unreachable!()
        };
        let rate = truth.structure.fastest_rate(&truth.parameters);
        series[0].set_steps(rate, 1);
        let values = Complete::nominal(&truth.parameters);
        let targets = reference::trajectories(&truth.structure, &values, &series).remove(0);
        for (sample, target) in series[0].samples.iter_mut().zip(targets) {
            sample.target = target;
        }
        let rows = || Stepped::new(series.clone(), rate, 1.0);
        evidence.fit = rows();
        evidence.hold_out = rows();
        evidence.screened_on = rows();
        evidence.sought_on = rows();
        evidence
    }

    /// Another cause may have lines of its own, until it is named.
    #[test]
    fn hums_are_sought_at_the_line_that_a_model_leaves() {
        let bare = Structure::actuator(10.0, "V");
        let effect = |name: &str| name.parse::<Effect>().unwrap();
        let values = [at("gain", 100.0), at("feed_forward", 0.002)];
        let evidence = planted(&bare, effect("feed_forward"), &values);
        for line in [20.0, 71.0] {
            let mut model = evidence.polished(evidence.problem(&bare, &values)).unwrap();
            for (row, left) in model.fit[0].iter_mut().enumerate() {
                *left += 100.0 * (TAU * line * 1e-3 * row as f64).sin();
            }
            let starts = evidence.search_starts(&model, &effect("command_hum"));
            let found = starts[0].trial[0];
            assert!((found - line).abs() < 0.2, "{found} instead of {line}");
        }
    }

    #[test]
    fn without_a_limit_of_its_speed_a_loop_saturates_there_again() {
        let bare = Structure::actuator(10.0, "V");
        let limit = entry("slew_limit").unwrap().on(&bare)[0];
        let valve = |saturation: f64, speed: f64| {
            [
                at("gain", 137.0),
                at("time_constant", 0.0028),
                at("saturation", saturation),
                at("slew_limit", speed),
            ]
        };
        let evidence = planted(&bare, limit, &valve(3.0, 1e5));
        let imitating = evidence.problem(&bare.with(limit), &valve(100.0, 400.0));
        let model = model(&evidence, &bare.with(limit)).begun_with(imitating);
        let from_there = evidence.problem(&bare, &model.problem.parameters);
        let from_there = evidence.polished(from_there).unwrap();
        let without = evidence.without(&model, limit).unwrap();
        let loss = |model: &Model| model.loss(Side::Fit).sqrt();
        println!("{}, not {}", loss(&without), loss(&from_there));
        assert!(loss(&from_there) > 1e-2 && loss(&without) < 1e-4);
    }

    #[test]
    fn another_form_begins_where_one_ended() {
        let bare = Structure::actuator(10.0, "V");
        let form = |name| entry(name).unwrap().on(&bare)[0];
        let (sharp, rounded) = (form("slew_limit~windup"), form("slew_limit~rounded"));
        let values = [
            at("gain", 100.0),
            at("time_constant", 0.005),
            at("saturation", 6.0),
            at("slew_limit_rounded", 150.0),
            at("slew_rounding", 0.8),
        ];
        let evidence = planted(&bare, rounded, &values);
        let start = [&values[..3], &[at("slew_limit_windup", 120.0)]].concat();
        let problem = evidence.problem(&bare.with(sharp), &start);
        let model = evidence.polished(problem).unwrap();
        let begun = evidence.handed_on(&model, sharp, rounded).unwrap();
        let other = evidence.polished(begun.problem).unwrap();
        let loss = |model: &Model| model.loss(Side::Fit).sqrt();
        println!("{} -> {}", loss(&model), loss(&other));
        assert!(loss(&model) > 1e-3 && loss(&other) < 1e-6);
    }
}
