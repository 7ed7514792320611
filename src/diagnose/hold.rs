//! The command between two rows: a converter holds it, a generator may go straight on. Where nobody says, both are tried.

use super::evidence::{QUICK, set_start};
use super::identify::Fitted;
use super::{Compared, Comparison, Measurements};
use crate::evaluate::problem::Series;
use crate::evaluate::{Fingerprint, Problem};
use crate::model::{Hold, Output};
use crate::search::polish::polish;
use crate::search::{Plan, Stoppable};

/// The two are told apart if their squared errors differ by this many standard errors.
const TOLD_APART: f64 = 3.0;
/// And by more than this share of the lower one.
const SAME_COST: f64 = 0.003;
/// A parameter that moves by less than this share of its value is not worth a word.
const NOTABLE: f64 = 0.01;

/// What was taken for the command between two rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    /// It.
    pub taken: Hold,
    /// Whether the model says so.
    pub known: bool,
    /// The result with the other one; not there where the model says which it is, or the run was stopped.
    pub other: Option<OtherHold>,
}

/// A result with the other of held and interpolated, fitted again.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherHold {
    /// RMS errors over the fitted rows of all channels, in units of noise: with what was taken, and with the other.
    pub errors: [f64; 2],
    /// Which of the two the fitted rows prefer, where they surely do.
    pub preferred: Option<Hold>,
    /// Parameters that leave their 95 % interval by it, with the value in the result and the other.
    pub moved: Vec<(String, [f64; 2])>,
}

/// `fitted` with the other of held and interpolated, fitted again from there; `None` where that diverges, or the run was
/// stopped.
pub(super) fn other_way(fitted: &Fitted, plan: &Plan) -> Option<Problem> {
    let mut problem = fitted.problem.clone();
    set_start(&mut problem, fitted.fit.values());
    problem.structure.hold = match problem.structure.hold {
        Hold::Held => Hold::Interpolated,
        Hold::Interpolated => Hold::Held,
    };
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
        let mut stoppable = Stoppable {
            problem: &problem,
            interrupt,
        };
        let polished = polish(&mut stoppable, &free, &start, &QUICK).ok()?;
        Some(polished.values)
    });
    set_start(&mut problem, &values?);
    (!interrupt.asked()).then_some(problem)
}

impl OtherHold {
    /// `taken` beside `other`, on the fitted rows.
    pub(super) fn beside(taken: &Fitted, other: &Problem, measurements: &Measurements) -> Self {
        let values: Vec<f64> = other.parameters.iter().map(|p| p.start).collect();
        let (own, starts) = residuals(&taken.problem, &taken.values, measurements);
        let (others, _) = residuals(other, &values, measurements);
        let comparison = Comparison::new(&others, &own, &vec![1.0; own.len()], &starts);
        let errors = [&own, &others].map(|channels| rms(channels));
        let [cost, other_cost] = errors.map(|error| error * error);
        let apart = (cost - other_cost).abs() > SAME_COST * cost.min(other_cost);
        let preferred = match comparison.z {
            z if apart && z < -TOLD_APART => Some(other.structure.hold),
            z if apart && z > TOLD_APART => Some(taken.problem.structure.hold),
            _ => None,
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
            errors,
            preferred,
            moved: moved.collect(),
        }
    }
}

/// The residuals of each observed channel in the fitted rows, in units of noise, and where each record begins.
fn residuals(
    problem: &Problem,
    values: &[f64],
    measurements: &Measurements,
) -> (Vec<Vec<f64>>, Vec<usize>) {
    let structure = &problem.structure;
    let compared = Compared::all(structure, values, &measurements.fit);
    let channel = |&output: &Output| -> Vec<f64> {
        let noise = problem.scale[output].sqrt();
        let rows = compared.iter().flat_map(|compared| compared.rows(output));
        rows.map(|row| noise * (row.1 - row.2)).collect()
    };
    let mut count = 0;
    let begin = |record: &Series| {
        let begin = count;
        count += record.samples.iter().filter(|s| s.weight > 0.0).count();
        begin
    };
    let starts = measurements.fit.iter().map(begin).collect();
    (structure.observed.iter().map(channel).collect(), starts)
}

fn rms(channels: &[Vec<f64>]) -> f64 {
    let count: usize = channels.iter().map(Vec::len).sum();
    let sum: f64 = channels.iter().flatten().map(|value| value * value).sum();
    (sum / count.max(1) as f64).sqrt()
}
