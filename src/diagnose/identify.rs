//! The procedure: from records to a diagnosed model.

use super::added::{Considered, Decision};
use super::attribution::{Allowed, Attribution, Selection, Sought};
use super::between_rows::{Jumping, with_jumps_placed};
use super::clocks::with_clocks_set;
use super::curved::with_curves;
use super::evidence::{Evidence, Model, Side, set_start};
use super::fitted::{Fitted, least_ratio, quieter, weights};
use super::free_form::{FoundForm, found as found_form, free_forms};
use super::hold::{Between, OtherHold, complete_other_way, is_closer, other_hold, other_way};
use super::identified::Identified;
use super::located::{Located, located, of_the_spool};
use super::measurements::{Measurements, starts};
use super::problem::{IdentificationProblem, Options};
use super::quiet_inputs::with_quiet_inputs;
use super::run_in::{at_rest, is_better, with_run_in};
use super::settled::{Settled, tears, with_flow_left};
use super::signature::{closest, of_effects, of_residual};
use super::simulation::{Compared, Sides, residual_in_all_rows};
use super::stage::Stage;
use super::statistics::bootstrap::{Improvement, improvement};
use super::statistics::noise::Noise;
use super::verdict::{Criteria, Verdict};
use crate::Result;
use crate::evaluate::problem::Series;
use crate::evaluate::{Evaluator, Problem};
use crate::model::effects::Effect;
use crate::model::{Output, Parameter};
use crate::search::{Fit, Plan, fit_and_hop, refine};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Fits the base model to the measurements, finds out which effects it lacks, and looks at the residual. `progress` is told
/// each stage and generation, and may break off: the result is then what is known so far.
///
/// # Errors
/// If the search fails: see [`fit_and_hop`]; or the integrator errs by more than the noise.
pub fn identify(
    problem: IdentificationProblem,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    options: &Options,
    progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
) -> Result<Identified> {
    let mut asked = problem;
    if let (false, Some(shown)) = (asked.hold_known, asked.measurements.shown_hold) {
        asked.structure.hold = shown;
    }
    let measurements = &asked.measurements;
    let plan = &Plan {
        memory: plan.memory.of_one_run(),
        ..plan.clone()
    };
    let hold_known = asked.hold_known;
    let hold_shown = hold_known || measurements.shown_hold.is_some();
    let mut stage = Stage::new(progress, plan.memory.interrupt());
    stage.begins("base model");
    let mut first = base_fit(&asked, evaluator, plan, &mut stage)?;
    if stage.goes_on()
        && let Some(later) = with_run_in(&asked, &first)
    {
        if let Some(rest) = at_rest(&asked) {
            let fitted = base_fit(&rest, evaluator, plan, &mut stage)?;
            if is_better(&fitted, &rest, &first) {
                return identify(rest, evaluator, plan, options, progress);
            }
        }
        return identify(later, evaluator, plan, options, progress);
    }
    if stage.goes_on()
        && let Some(set) =
            with_quiet_inputs(&asked, &first).or_else(|| with_clocks_set(&asked, &first))
    {
        return identify(set, evaluator, plan, options, progress);
    }
    // What the command does between its rows is what answers it that shows.
    let spool = match of_the_spool(&asked) {
        Some(own) if stage.goes_on() => Some(base_fit(&own, evaluator, plan, &mut stage)?),
        _ => None,
    };
    let answering = spool.as_ref().unwrap_or(&first);
    if stage.goes_on()
        && let Some(set) = with_curves(&asked, answering, plan)
            .or_else(|| with_jumps_placed_by(&asked, &first, plan))
    {
        return identify(set, evaluator, plan, options, progress);
    }
    let mut problem = first.problem.clone();
    let mut evaluations = first.fit.evaluations;
    let search = first.fit.clone();
    if !hold_shown
        && stage.goes_on()
        && let other = other_hold(answering, plan)
        && let Some(other) = complete_other_way(answering, other, measurements, plan)?
    {
        let hold = other.problem.structure.hold;
        if spool.is_some() {
            let mut shown = asked.clone();
            shown.measurements.shown_hold = Some(hold);
            return identify(shown, evaluator, plan, options, progress);
        }
        evaluations += other.fit.evaluations;
        problem.structure.hold = hold;
        first = other;
    }
    let noise = first.noise(measurements, false);
    let start = first.fit.values();
    let mut diagnosis = Diagnosis {
        evaluator,
        plan,
        options: options.clone(),
        stage,
        asked: &asked,
        measurements,
        hold_known,
        hold_shown,
        search: &search,
        evaluations,
        spool: spool.as_ref(),
        // Once: what is named in the end places them better than any first cause.
        places_jumps: asked.measurements.placed_jumps.times == 0,
    };
    let mut result = match diagnosis.until_jumps_show(problem.clone(), start, noise.clone())? {
        Diagnosed::So(result) => *result,
        Diagnosed::WithJumpsPlaced(placed) => {
            return identify(*placed, evaluator, plan, options, progress);
        }
    };
    problem.structure.hold = result.after.problem.structure.hold;
    if !hold_shown && result.may_be_the_other_way() && diagnosis.stage.goes_on() {
        let mut other = problem.clone();
        other.structure.hold = other_hold(&result.after, plan);
        // Beside what is complete only fewer effects count: where those do not do as well, the others need not be looked for.
        let mut may_be_better = true;
        if result.is_complete() && !result.between.other_is_preferred() {
            diagnosis.options.max_effects = result.added.len() - 1;
            let simpler = diagnosis.of(other.clone(), start, noise.clone())?;
            diagnosis.options.max_effects = options.max_effects;
            may_be_better = simpler.broken_off.is_none() && simpler.is_as_good_as(&result);
        }
        if may_be_better {
            let other_result = diagnosis.of(other.clone(), start, noise)?;
            if other_result.broken_off.is_none() && other_result.is_preferred_to(&result) {
                (problem, result) = (other, other_result);
            }
        }
    }
    // What was taken for noise at rest may have been an effect: a hum, say. Once it is named, the floor is lower.
    let floor = result.after.noise(measurements, true);
    if !result.added.is_empty() && quieter(&floor, &result.noise) && diagnosis.stage.goes_on() {
        let again = diagnosis.of(problem, start, floor)?;
        match again.broken_off {
            // What is known is the whole of the first diagnosis.
            Some(stage) => result.broken_off = Some(stage),
            None => result = again,
        }
    }
    // The sources beside the floor, and what swings, are those of what is left in the end.
    for (name, noise) in result.after.noise(measurements, false) {
        let own = result.noise.get_mut(&name).expect("of the same channels");
        (own.sources, own.swing) = (noise.sources, noise.swing);
    }
    result.evaluations = diagnosis.evaluations;
    // What was beside a strong effect when the base model was fitted may show now.
    let later = || {
        let after = &result.after;
        with_run_in(&asked, after)
            .or_else(|| with_quiet_inputs(&asked, after))
            .or_else(|| with_clocks_set(&asked, after))
            .or_else(|| with_curves(&asked, after, plan))
            .or_else(|| with_jumps_placed_by(&asked, after, plan))
    };
    if diagnosis.stage.goes_on()
        && let Some(later) = later()
    {
        let again = identify(later, evaluator, plan, options, progress)?;
        match again.broken_off {
            Some(stage) => result.broken_off = Some(stage),
            None => return Ok(again),
        }
    }
    result.check_integration()?;
    Ok(result)
}

/// The base model, fitted to the records that are not held out.
fn base_fit(
    asked: &IdentificationProblem,
    evaluator: &mut dyn Evaluator,
    plan: &Plan,
    stage: &mut Stage,
) -> Result<Fitted> {
    let problem = asked.first_fit();
    let found = fit_and_hop(&problem, evaluator, plan, &mut |done| {
        stage.generation(done)
    })?;
    Ok(Fitted::new(problem, found, &asked.measurements, None, plan))
}

/// As [`with_jumps_placed`], by a model that is `fitted`.
fn with_jumps_placed_by(
    asked: &IdentificationProblem,
    fitted: &Fitted,
    plan: &Plan,
) -> Option<IdentificationProblem> {
    let mut model = fitted.problem.clone();
    set_start(&mut model, fitted.fit.values());
    let noise = fitted.noise(&asked.measurements, false);
    with_jumps_placed(asked, &model, &noise, plan)
}

/// What share of a held-out channel's motion `fitted` follows at least, beside the `noise`.
fn least_followed(fitted: &Fitted, noise: &BTreeMap<String, Noise>) -> f64 {
    let errors = fitted.errors.hold_out.iter();
    let followed = errors.filter_map(|(name, error)| {
        let left = 1.0 - error.fit_percent? / 100.0;
        let beside = 1.0 - (noise[name].value / error.rmse).powi(2);
        Some(1.0 - left * beside.max(0.0).sqrt())
    });
    followed.fold(1.0, f64::min)
}

/// A diagnosis under way.
struct Diagnosis<'a> {
    evaluator: &'a mut dyn Evaluator,
    plan: &'a Plan,
    options: Options,
    stage: Stage<'a>,
    asked: &'a IdentificationProblem,
    measurements: &'a Measurements,
    hold_known: bool,
    /// Whether that is known, or the record shows it.
    hold_shown: bool,
    search: &'a Fit,
    evaluations: usize,
    /// What moves the spool, fitted to that alone, where more is measured.
    spool: Option<&'a Fitted>,
    /// Whether it ends where a first cause shows when the command jumped.
    places_jumps: bool,
}

/// What a diagnosis comes to.
enum Diagnosed {
    So(Box<Identified>),
    /// All is to be sought in what this asks, from the beginning.
    WithJumpsPlaced(Box<IdentificationProblem>),
}

/// What a diagnosis decides on: the base model, its noise, and what follows from them.
struct Base<'a> {
    fitted: &'a Fitted,
    noise: &'a BTreeMap<String, Noise>,
    evidence: Evidence,
    /// The base model on the evidence; `None` where it diverges there or nothing was held out.
    model: Option<Model>,
    /// The effects that may be missing.
    asked: Vec<Effect>,
    /// Where it fails.
    located: Option<Located>,
}

impl<'d> Diagnosis<'d> {
    /// Diagnoses `problem`, whose base parameters are near `start`, where the channels have this `noise`, with the command's jumps where
    /// they are.
    fn of(
        &mut self,
        problem: Problem,
        start: &[f64],
        noise: BTreeMap<String, Noise>,
    ) -> Result<Identified> {
        self.places_jumps = false;
        match self.until_jumps_show(problem, start, noise)? {
            Diagnosed::So(result) => Ok(*result),
            Diagnosed::WithJumpsPlaced(_) => unreachable!("none are placed"),
        }
    }

    /// The same, unless its first cause shows when the command jumped between two rows.
    fn until_jumps_show(
        &mut self,
        mut problem: Problem,
        start: &[f64],
        noise: BTreeMap<String, Noise>,
    ) -> Result<Diagnosed> {
        // Each channel now counts by its noise.
        problem.scale = weights(&noise, &self.measurements.fit);
        self.stage.begins("base model: polishing");
        let mut before = self.polished(problem, start, &noise)?;
        // Also where no effect is asked: it takes a second.
        let (located_before, spool) = match before.structured() {
            true => self.located(&before, &noise).unzip(),
            false => (None, None),
        };
        let behind = located_before.is_some_and(|located| located.is_behind_alone());
        let settled = spool.filter(|_| behind && tears(&before, &noise));
        let settled = settled.map(Settled::new);
        if let (Some(settled), Some(located)) = (&settled, &located_before) {
            let mut problem = before.problem.clone();
            set_start(&mut problem, before.fit.values());
            settled.set(&mut problem);
            before = self.beside_the_flow(problem, located.path, &noise)?;
        }
        let sizes = self.asked.sizes.clone();
        let evidence = Evidence::new(
            &before,
            &noise,
            settled,
            self.measurements,
            sizes,
            self.plan,
        );
        let asked = self
            .options
            .asked(&before.problem.structure, self.measurements.is_static);
        let mut base = Base {
            model: evidence.start_from(&before),
            fitted: &before,
            noise: &noise,
            evidence,
            asked: asked.clone(),
            located: located_before,
        };
        let attribution = match self.attribution(&mut base)? {
            Some(Sought::Quieter(noise)) => {
                self.evaluations += base.evidence.evaluations();
                return self.until_jumps_show(before.problem, start, noise);
            }
            Some(Sought::OtherHold(hold)) => {
                self.evaluations += base.evidence.evaluations();
                let mut problem = before.problem;
                problem.structure.hold = hold;
                self.hold_shown = true;
                return self.until_jumps_show(problem, start, noise);
            }
            Some(Sought::Placed(placed)) => return Ok(Diagnosed::WithJumpsPlaced(placed)),
            Some(Sought::Found(found)) => Some(*found),
            None => None,
        };
        let mut criteria = Criteria {
            diagnosed: !asked.is_empty() && base.model.is_some() && self.stage.goes_on(),
            before: 1.0,
            after: 1.0,
            least_taken: 1.0,
            unseen: before.fails_on_held_out_rows_alone(&noise),
            swings: noise.values().any(|noise| noise.swing.is_some()),
            undecided: false,
            added: 0,
            structured_before: before.structured(),
            structured_after: before.structured(),
            least_followed: 1.0,
            least_ratio: 0.0,
            near_before: before.is_near(&noise),
        };
        let mut after = None;
        let mut closer = false;
        let mut added = Vec::new();
        let mut undecided = None;
        let mut considered = Vec::new();
        if let (Some(model), Some(mut found)) = (&base.model, attribution) {
            criteria.before = model.loss(Side::HoldOut);
            criteria.after = found.model.loss(Side::HoldOut);
            let candidate = self.with_effects(&base, &found, &mut criteria)?;
            let named = |criteria: &Criteria| {
                matches!(criteria.verdict(), Verdict::Found | Verdict::Partly)
            };
            if candidate.is_some() && named(&criteria) {
                self.selection(&base, model).contests(&mut found)?;
                undecided = found.added.iter().find(|one| one.is_undecided()).cloned();
                criteria.undecided = undecided.is_some();
            }
            if candidate.is_some() && named(&criteria) {
                (after, added) = (candidate, found.added);
            } else {
                let why = match criteria.undecided {
                    true => Decision::Undecided,
                    false => Decision::NotNamed,
                };
                let chosen = |one: &&mut Considered| one.decision == Decision::Chosen;
                let chosen = found.considered.iter_mut().filter(chosen);
                chosen.for_each(|one| one.decision = why);
            }
            considered = found.considered;
            closer = found.closer_the_other_way;
        }
        let verdict = criteria.verdict();
        let mut free_form = None;
        if verdict == Verdict::Unexplained && self.stage.goes_on() {
            (after, free_form) = self.free_form(&base)?.unzip();
        }
        let after = after.unwrap_or_else(|| before.clone());
        let noise = after.tested_by.clone();
        let located = match verdict {
            Verdict::Unexplained | Verdict::NotDiagnosed => located_before,
            Verdict::Partly => self.located(&after, &noise).map(|(located, _)| located),
            Verdict::Found | Verdict::None => None,
        };
        let between = self.between(&after, closer);
        self.evaluations += base.evidence.evaluations();
        let records = &self.measurements.fit;
        let mut signatures = of_effects(&added, records);
        if signatures.is_empty() {
            let form = free_form.is_some().then_some(&after);
            let closest = closest(verdict, &considered);
            signatures.push(of_residual(&before, form, closest, records));
        }
        Ok(Diagnosed::So(Box::new(Identified {
            verdict,
            asked,
            explained: (!added.is_empty()).then(|| criteria.explained()),
            improvement: self.improvements(&before, &after, &noise),
            signatures,
            before,
            after,
            added,
            undecided,
            free_form: free_form.flatten(),
            error_before: criteria.before.sqrt(),
            located_before,
            located,
            considered,
            measurements: self.measurements.clone(),
            noise,
            between,
            search: self.search.clone(),
            evaluations: self.evaluations,
            broken_off: self.stage.broken_off().map(str::to_owned),
        })))
    }

    /// The fit of `problem` from `start`, in units of the `noise`.
    fn polished(
        &mut self,
        problem: Problem,
        start: &[f64],
        noise: &BTreeMap<String, Noise>,
    ) -> Result<Fitted> {
        let polished = refine(&problem, start, self.plan)?;
        self.evaluations += polished.evaluations;
        Ok(Fitted::new(
            problem,
            polished,
            self.measurements,
            Some(noise),
            self.plan,
        ))
    }

    /// The fit of `problem` from its start, where the flow counts by so many times its `noise` as are left of it.
    fn beside_the_flow(
        &mut self,
        mut problem: Problem,
        left: f64,
        noise: &BTreeMap<String, Noise>,
    ) -> Result<Fitted> {
        problem.scale = with_flow_left(&problem.scale, left);
        let start = problem.start();
        self.polished(problem, &start, noise)
    }

    /// The fit, on the records as they are, of a `model` that was fitted to the evidence.
    fn fitted(&mut self, base: &Base, model: &Model) -> Result<Fitted> {
        let mut problem = Problem {
            data: base.fitted.problem.data.clone(),
            ..model.problem.clone()
        };
        let held = base.evidence.release(&mut problem);
        let start = problem.start();
        let fitted = self.polished(problem.clone(), &start, base.noise)?;
        match held && tears(&fitted, base.noise) {
            true => self.beside_the_flow(problem, model.left(Output::Flow), base.noise),
            false => Ok(fitted),
        }
    }

    /// Which of the effects that were asked the base model lacks; `None` where none was looked for.
    fn attribution(&mut self, base: &mut Base) -> Result<Option<Sought>> {
        let Some(model) = &base.model else {
            return Ok(None);
        };
        if base.asked.is_empty() || base.fitted.exact() || !self.stage.goes_on() {
            return Ok(None);
        }
        base.evidence.look_at(model);
        let found = self.selection(base, model).run(model)?;
        Ok(Some(found))
    }

    /// A selection of what is missing of `base`, whose model this is.
    fn selection<'s>(&'s mut self, base: &'s Base, model: &Model) -> Selection<'s, 'd> {
        let jumping = self.places_jumps.then_some(Jumping {
            asked: self.asked,
            base: &base.fitted.problem,
            noise: base.noise,
            plan: self.plan,
        });
        Selection::new(
            &base.evidence,
            model,
            &mut *self.evaluator,
            &*self.plan.local,
            Allowed {
                asked: &base.asked,
                located: base.located,
                other_hold: (!self.hold_shown).then(|| other_hold(base.fitted, self.plan)),
                jumping,
            },
            self.options.max_effects,
            &mut self.stage,
        )
    }

    /// The base model with the effects that were `found`, and what decides whether they explain enough to be named.
    fn with_effects(
        &mut self,
        base: &Base,
        found: &Attribution,
        criteria: &mut Criteria,
    ) -> Result<Option<Fitted>> {
        if found.added.is_empty() {
            return Ok(None);
        }
        self.stage.begins("polishing the result");
        let candidate = self.fitted(base, &found.model)?;
        criteria.added = found.shares.len();
        criteria.least_taken = found.shares.iter().copied().fold(1.0, f64::min);
        criteria.structured_after = candidate.structured();
        let left = candidate.noise(self.measurements, false);
        criteria.swings = left.values().any(|noise| noise.swing.is_some());
        criteria.least_followed = least_followed(&candidate, base.noise);
        criteria.least_ratio = self.least_ratio(&candidate);
        Ok(Some(candidate))
    }

    /// What the held-out error of every channel is at least over the noise by which `fitted` was tested.
    fn least_ratio(&self, fitted: &Fitted) -> f64 {
        let compared = fitted.beside(self.measurements).hold_out;
        // What no file resolves, or no integrator, is none of the model's error.
        let noise = |output: Output| fitted.tested_by[output.name()].value;
        let floor = |output: Output| noise(output).max(fitted.least_error(output));
        least_ratio(&compared, &fitted.problem.structure.observed, floor)
    }

    /// Where `fitted` fails, and what the spool alone was fitted by.
    fn located(
        &mut self,
        fitted: &Fitted,
        noise: &BTreeMap<String, Noise>,
    ) -> Option<(Located, Vec<Parameter>)> {
        if !self.stage.goes_on() {
            return None;
        }
        self.stage.begins("where it acts");
        located(
            fitted,
            self.spool,
            self.measurements,
            noise,
            self.plan.memory.interrupt(),
        )
    }

    /// The base model with the curve that best describes what is missing, if any helps.
    fn free_form(&mut self, base: &Base) -> Result<Option<(Fitted, Option<FoundForm>)>> {
        let Some(model) = &base.model else {
            return Ok(None);
        };
        self.stage.begins("a correction of free form");
        let forms = free_forms(&base.evidence, model);
        let helps = |form: &&Model| base.evidence.worth(model.excess(), model, form);
        let Some(best) = forms.iter().find(helps) else {
            return Ok(None);
        };
        let after = self.fitted(base, best)?;
        let form = found_form(&base.evidence, model, best, &after);
        Ok(Some((after, form)))
    }

    /// What was taken for the command between two rows, beside the result with the other of held and interpolated.
    /// `closer` says whether causes come closer with that.
    fn between(&self, after: &Fitted, closer: bool) -> Between {
        let other = match self.hold_known || !self.stage.goes_on() {
            true => None,
            false => other_way(after, other_hold(after, self.plan), self.plan),
        };
        let other = other.map(|other| OtherHold::beside(after, &other, self.measurements));
        Between {
            taken: after.problem.structure.hold,
            known: self.hold_known,
            closer: closer || other.as_ref().is_some_and(|other| is_closer(other.errors)),
            other,
        }
    }

    /// How much the error fell from one model to another, all channels in units of their noise; where there are too few rows
    /// for an interval, that is not known.
    fn improvements(
        &self,
        before: &Fitted,
        after: &Fitted,
        noise: &BTreeMap<String, Noise>,
    ) -> Sides<Option<Improvement>> {
        let observed = &before.problem.structure.observed;
        let weights = observed.iter().map(|one| noise[one.name()].value.powi(-2));
        let weights: Vec<f64> = weights.collect();
        let of = |records: &[Series], before: &[Compared], after: &[Compared]| {
            let residuals = |compared: &[Compared]| -> Vec<Vec<f64>> {
                let channel = |&output: &Output| residual_in_all_rows(compared, output);
                observed.iter().map(channel).collect()
            };
            let (old, new) = (residuals(before), residuals(after));
            let enough = old.first().is_some_and(|rows| rows.len() > 10);
            let starts = starts(records);
            (enough && weights.iter().all(|weight| weight.is_finite()))
                .then(|| improvement(&old, &new, &weights, &starts, self.plan.seed))
        };
        let Measurements { fit, hold_out, .. } = self.measurements;
        let [before, after] = [before, after].map(|fitted| fitted.beside(self.measurements));
        Sides {
            fit: of(fit, &before.fit, &after.fit),
            hold_out: of(hold_out, &before.hold_out, &after.hold_out),
        }
    }
}
