//! The command between two rows: a converter holds it, a generator may go straight on. Where nobody says, both are tried, the
//! latter first where the valve answers a jump sooner than it could answer a converter.

use super::evidence::{Evidence, Model, QUICK, Side, set_start};
use super::fitted::Fitted;
use super::jumps::{answers, measured};
use super::measurements::{Measurements, starts};
use super::preference::{plainly_differ, surely_differ};
use super::simulation::{Compared, residual_in_all_rows};
use super::statistics::compare::Comparison;
use super::verdict::NEAR;
use crate::Result;
use crate::evaluate::problem::Data;
use crate::evaluate::{Fingerprint, Problem, reference};
use crate::model::effects::Effect;
use crate::model::{Complete, Hold, Output, Outputs};
use crate::search::polish::polish;
use crate::search::{Plan, Stoppable, refine};
use rayon::prelude::*;

/// A parameter that moves by less than this share of its value is not reported.
const NOTABLE: f64 = 0.01;

/// The other of held and interpolated is tried with all effects if it leaves an error that is less by this share.
const CLOSER: f64 = 0.05;
/// What was taken for the command between two rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    /// The one with which the result was fitted.
    pub taken: Hold,
    /// Whether the model says so.
    pub known: bool,
    /// The result with the other one; not there where the model says which it is, or the run was stopped.
    pub other: Option<OtherHold>,
    /// Whether with the other one the result, or a cause of the first round, leaves less.
    pub(super) closer: bool,
}

/// A result with the other of held and interpolated, fitted again.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherHold {
    /// Which one it is.
    pub hold: Hold,
    /// RMS errors over the fitted rows of all channels, in units of noise: with what was taken, and with the other.
    pub errors: [f64; 2],
    /// Which of the two the fitted rows prefer, where the difference is significant.
    pub preferred: Option<Hold>,
    /// Parameters that leave their 95 % interval with the other, with the value in the result and the other.
    pub moved: Vec<(String, [f64; 2])>,
}

/// Whether the command of `fitted` goes straight through its jumps: then it is there half, and the valve moves, when the row has all of
/// it. Whatever the model lacks does not move before it is told to. `None` where noise or a delay hides it.
fn goes_through_its_jumps(fitted: &Fitted) -> Option<bool> {
    let Data::Series(records) = &*fitted.problem.data else {
        return None;
    };
    let mut problem = fitted.problem.clone();
    set_start(&mut problem, fitted.fit.values());
    problem.structure.hold = Hold::Interpolated;
    let values = Complete::nominal(&problem.parameters);
    let simulated = reference::trajectories(&problem.structure, &values, records);
    let mut observed = problem.structure.observed.iter();
    observed.find_map(|&output| {
        let of_rows = |rows: &Vec<Outputs<f64>>| rows.iter().map(|row| row[output]).collect();
        let ramps: Vec<Vec<f64>> = simulated.iter().map(of_rows).collect();
        let ramps = answers(records, output, &ramps);
        answers(records, output, &measured(records, output)).are(&ramps)
    })
}

/// What else `fitted` may take the command for: held instead of straight, and straight through its jumps or between them, as the valve
/// answers them; where that does not show, whichever brings it closer to its rows.
pub(super) fn other_hold(fitted: &Fitted, plan: &Plan) -> Hold {
    if fitted.problem.structure.hold.is_straight() {
        return Hold::Held;
    }
    if !jumps(&fitted.problem.data) {
        return Hold::Interpolated;
    }
    let through = goes_through_its_jumps(fitted).unwrap_or_else(|| {
        let [through, between] = [Hold::Interpolated, Hold::BetweenJumps].map(|hold| {
            let problem = other_way(fitted, hold, plan);
            let cost = problem.and_then(|problem| reference::cost(&problem, &problem.start()));
            cost.unwrap_or(f64::INFINITY)
        });
        through <= between
    });
    match through {
        true => Hold::Interpolated,
        false => Hold::BetweenJumps,
    }
}

/// Whether the command jumps anywhere in these records.
fn jumps(data: &Data) -> bool {
    match data {
        Data::Series(records) => {
            let mut samples = records.iter().flat_map(|record| &record.samples);
            samples.any(|sample| sample.jumps)
        }
        Data::Tones(_) => false,
    }
}

/// `fitted` with this `hold`, fitted again from there; `None` where that diverges, or the run was stopped.
pub(super) fn other_way(fitted: &Fitted, hold: Hold, plan: &Plan) -> Option<Problem> {
    let mut problem = fitted.problem.clone();
    set_start(&mut problem, fitted.fit.values());
    problem.structure.hold = hold;
    if problem.free().is_empty() {
        return Some(problem);
    }
    let interrupt = plan.memory.interrupt();
    let key = || {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("other hold").problem(&problem).finish()
    };
    let values: Option<Vec<f64>> = plan.memory.once(key, || {
        let (free, start) = (problem.free(), problem.start());
        let mut stoppable = Stoppable::new(&problem, interrupt);
        let polished = polish(&mut stoppable, &free, &start, &QUICK).ok()?;
        Some(polished.values)
    });
    set_start(&mut problem, &values?);
    (!interrupt.asked()).then_some(problem)
}

/// `fitted` with this other `hold`, where that leaves nothing but noise, and the rows prefer it or `fitted` leaves more than that. Where it
/// leaves more, what is missing may prefer either: that says nothing of the command.
pub(super) fn complete_other_way(
    fitted: &Fitted,
    hold: Hold,
    measurements: &Measurements,
    plan: &Plan,
) -> Result<Option<Fitted>> {
    let Some(other) = other_way(fitted, hold, plan) else {
        return Ok(None);
    };
    let beside = OtherHold::beside(fitted, &other, measurements);
    let preferred = beside.preferred == Some(other.structure.hold);
    let leaves_something = || leaves_structure(&mut fitted.clone(), measurements);
    if !preferred && (beside.errors[1] >= beside.errors[0] || !leaves_something()) {
        return Ok(None);
    }
    let refined = refine(&other, &other.start(), plan)?;
    let mut other = Fitted::new(other, refined, measurements, None, plan);
    Ok((!leaves_structure(&mut other, measurements)).then_some(other))
}

/// Whether `fitted` leaves more than noise.
fn leaves_structure(fitted: &mut Fitted, measurements: &Measurements) -> bool {
    let noise = fitted.noise(measurements, false);
    fitted.test_residual(measurements, &noise);
    fitted.structured()
}

/// Whether with the `other` of held and interpolated `base`, or one of the `causes` that were tried on top of it, leaves less than all
/// of them do as it was taken, each after a few steps on the rows on which effects are sought. What was added to those may make up
/// for the wrong of the two: they say more than a result. The fitted rows may be too slow to tell: where the one that follows them best
/// does so nearly to the noise, and no worse with the other, it is what that makes of the rows held out.
pub(super) fn come_closer(
    evidence: &Evidence,
    other: Hold,
    base: &Model,
    causes: &[(Effect, Model)],
) -> bool {
    let models = causes.iter().map(|(_, model)| model).chain([base]);
    let problems: Vec<&Problem> = models.map(|model| &model.problem).collect();
    let least = |hold: Hold| {
        let error = |problem: &&Problem| {
            let mut problem = (*problem).clone();
            problem.structure.hold = hold;
            Some(evidence.polished_a_little(problem)?.cost.sqrt())
        };
        let errors = problems.par_iter().filter_map(error);
        errors.reduce(|| f64::INFINITY, f64::min)
    };
    let by_fit = |a: &&Model, b: &&Model| a.loss(Side::Fit).total_cmp(&b.loss(Side::Fit));
    let best = causes.iter().map(|(_, model)| model).min_by(by_fit);
    let best = best.filter(|best| best.loss(Side::Fit).sqrt() < NEAR);
    let goes_on_closer = |best: &Model| {
        let mut problem = best.problem.clone();
        problem.structure.hold = other;
        let other = evidence.polished(problem);
        other.is_some_and(|other| {
            let errors = [best, &other].map(|one| one.loss(Side::HoldOut).sqrt());
            other.loss(Side::Fit) <= best.loss(Side::Fit) && is_closer(errors)
        })
    };
    is_closer([base.structure().hold, other].map(least)) || best.is_some_and(goes_on_closer)
}

/// Whether the second of two `errors` is less by so much that all effects are to be tried with what makes that.
pub(super) fn is_closer(errors: [f64; 2]) -> bool {
    errors[1] < (1.0 - CLOSER) * errors[0]
}

impl Between {
    /// Whether the fitted rows prefer the other one.
    pub(super) fn other_is_preferred(&self) -> bool {
        let other = self.other.as_ref();
        other.is_some_and(|other| other.preferred == Some(other.hold))
    }
}

impl OtherHold {
    /// `taken` beside `other`, on the fitted rows.
    pub(super) fn beside(taken: &Fitted, other: &Problem, measurements: &Measurements) -> Self {
        let values = Complete::nominal(&other.parameters);
        let records = &measurements.fit;
        let simulated = reference::trajectories(&other.structure, &values, records);
        let own = residuals(&taken.problem, &taken.beside(measurements).fit);
        let others = residuals(other, &Compared::all(records, &simulated));
        let comparison = Comparison::new(&others, &own, &vec![1.0; own.len()], &starts(records));
        let values = taken.problem.values().max(1) as f64;
        let errors = [&own, &others].map(|channels| (squares(channels) / values).sqrt());
        let costs = errors.map(|error| error * error);
        let preferred = match measurements.shown_hold {
            Some(shown) => Some(shown),
            None if !surely_differ(comparison.z, costs) && !plainly_differ(costs) => None,
            None if costs[1] < costs[0] => Some(other.structure.hold),
            None => Some(taken.problem.structure.hold),
        };
        let intervals = taken.fit.polished.iter();
        let intervals = intervals.flat_map(|(_, uncertainty)| &uncertainty.intervals);
        let free = taken.fit.free.iter().zip(taken.fit.values());
        let moved = free
            .zip(other.start())
            .zip(intervals)
            .filter(|(((_, own), other), interval)| {
                let inside = interval.low <= *other && *other <= interval.high;
                !inside && (other - *own).abs() > NOTABLE * own.abs()
            })
            .map(|(((parameter, own), other), _)| (parameter.name.clone(), [*own, other]));
        Self {
            hold: other.structure.hold,
            errors,
            preferred,
            moved: moved.collect(),
        }
    }
}

/// The residuals of each observed channel, in units of the noise by which `problem` was fitted.
pub(super) fn residuals(problem: &Problem, compared: &[Compared]) -> Vec<Vec<f64>> {
    let channel = |&output: &Output| -> Vec<f64> {
        let noise = problem.scale[output].sqrt();
        let residual = residual_in_all_rows(compared, output).into_iter();
        residual.map(|value| noise * value).collect()
    };
    problem.structure.observed.iter().map(channel).collect()
}

pub(super) fn squares(channels: &[Vec<f64>]) -> f64 {
    channels.iter().flatten().map(|value| value * value).sum()
}
