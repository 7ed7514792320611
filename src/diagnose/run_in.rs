//! Records that begin in motion. A model begins in equilibrium with the first command, or at rest; a logger is switched on at
//! any time. What the model needs to forget where it began is simulated and compared with nothing.

use super::fitted::Fitted;
use super::measurements::first_counting;
use super::problem::IdentificationProblem;
use super::simulation::{Compared, Sides, residual};
use crate::model::{Initial, Output, Structure};

/// The rows at the start of a record that show whether a model begins where the record does.
const FIRST: usize = 3;
/// Their mean square error is that of another beginning above so many times that of the other rows and the noise together.
const OFF: f64 = 9.0;
/// The simulation runs in over one in so many rows of a record, and again over as many while the first that count are still off.
const STEP: usize = 20;
/// At most one row in so many runs it in.
const MOST: usize = 5;
/// Records begin at rest if that leaves less than this share of the cost.
const AT_REST: f64 = 0.5;

/// `problem` with the rows of its records that run the simulation in, where `fitted` does not follow the first ones that count;
/// otherwise `None`.
pub(super) fn with_run_in(
    problem: &IdentificationProblem,
    fitted: &Fitted,
) -> Option<IdentificationProblem> {
    let measurements = &problem.measurements;
    let noise = fitted.noise(measurements, false);
    let beside = fitted.beside(measurements);
    let rows = |compared: &[Compared]| -> Vec<usize> {
        let off = |one: &Compared| {
            let observed = fitted.problem.structure.observed.iter();
            let mut measured = observed.filter(|&&output| one.series.measured[output]);
            measured.any(|&output| begins_off(one, output, noise[output.name()].value))
        };
        let wanted = |one: &Compared| match off(one) {
            true => first_counting(one.series) + (one.series.samples.len() / STEP).max(FIRST),
            false => 0,
        };
        compared.iter().map(wanted).collect()
    };
    let [fit, hold_out] = [rows(&beside.fit), rows(&beside.hold_out)];
    let moving = fit.iter().chain(&hold_out).any(|rows| *rows > 0);
    moving.then(|| {
        let mut later = problem.clone();
        later.measurements.run_in(&Sides { fit, hold_out });
        later
    })
}

/// The same problem of records that begin at rest, where one begins with a command that is not zero.
pub(super) fn at_rest(problem: &IdentificationProblem) -> Option<IdentificationProblem> {
    let all = problem.measurements.fit.iter();
    let mut all = all.chain(&problem.measurements.hold_out);
    let commanded = all.any(|series| series.samples[0].input.command != 0.0);
    let equilibrium = problem.structure.initial == Initial::Equilibrium;
    (equilibrium && commanded).then(|| {
        let mut rest = problem.clone();
        rest.structure = Structure {
            initial: Initial::Rest,
            ..rest.structure
        };
        let remark = "the records begin at rest, not in equilibrium with their first command";
        rest.measurements.beginnings.push(remark.into());
        rest
    })
}

/// Whether records begin at rest, as `rest` has it, not in equilibrium: then that follows them from their first row.
pub(super) fn is_better(rest: &Fitted, of: &IdentificationProblem, equilibrium: &Fitted) -> bool {
    let costs = (rest.fit.cost(), equilibrium.fit.cost());
    let cheaper = matches!(costs, (Some(rest), Some(other)) if rest < AT_REST * other);
    cheaper && with_run_in(of, rest).is_none()
}

/// Whether the first rows that count are off by more than the others and the `noise` account for.
fn begins_off(compared: &Compared, output: Output, noise: f64) -> bool {
    let series = compared.series;
    let first = first_counting(series);
    if first * MOST >= series.samples.len() {
        return false;
    }
    let errors = residual(&[*compared], output);
    let mean_square =
        |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64;
    let [first, later] = [FIRST, series.samples.len() / STEP].map(|row| row.min(errors.len()));
    let others = mean_square(&errors[later..]);
    mean_square(&errors[..first]) > OFF * (others + noise * noise)
}
