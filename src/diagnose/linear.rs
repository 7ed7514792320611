//! A model linearised about a candidate.

use crate::evaluate::{CpuEvaluator, Population, Problem, reference};
use crate::model::{Parameter, Scale};

/// By this share a parameter is changed to see what that does, of its value or, where its scale is linear, of a tenth of its range
/// where that is more: what single precision errs by is far less.
const CHANGE: f64 = 1e-3;

/// A candidate's residuals and their derivatives, one column a free parameter.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    /// Residuals, the channels of a row side by side.
    pub(super) residual: Vec<f64>,
    /// Derivatives of the residuals.
    pub(super) columns: Vec<Vec<f64>>,
}

impl Linear {
    /// At the problem's start; `None` where that diverges.
    pub(super) fn new(problem: &Problem) -> Option<Self> {
        let start = problem.start();
        let room = || Vec::with_capacity(problem.values());
        let mut residual = room();
        let mut columns: Vec<Vec<f64>> = start.iter().map(|_| room()).collect();
        let finished = reference::residuals(problem, &start, &mut |value, gradient| {
            residual.push(value);
            for (column, slope) in columns.iter_mut().zip(gradient) {
                column.push(*slope);
            }
        });
        let finite = |values: &Vec<f64>| values.iter().all(|value| value.is_finite());
        (finished && finite(&residual) && columns.iter().all(finite))
            .then_some(Self { residual, columns })
    }

    /// At the start of each of `problems`, which differ in nothing else, by differences: one evaluation for the candidates of all.
    pub(super) fn by_differences(
        problems: &[Problem],
        evaluator: &CpuEvaluator,
    ) -> Vec<Option<Self>> {
        let Some(first) = problems.first() else {
            return Vec::new();
        };
        let free = first.free();
        let mut population = Population::new(free.len());
        let mut changes = Vec::new();
        for problem in problems {
            let start = problem.start();
            population.push(&start);
            for (i, parameter) in free.iter().enumerate() {
                let mut changed = start.clone();
                changed[i] += change(parameter, start[i]);
                changes.push(changed[i] - start[i]);
                population.push(&changed);
            }
        }
        let residuals = evaluator.residuals(first, &population);
        let mut residuals = residuals.into_iter();
        let mut changes = changes.into_iter();
        let one = |_: &Problem| {
            let residual = residuals.next().flatten();
            let columns: Vec<Option<Vec<f64>>> = residuals.by_ref().take(free.len()).collect();
            let changes: Vec<f64> = changes.by_ref().take(free.len()).collect();
            let (residual, columns) = (residual?, columns.into_iter().collect::<Option<Vec<_>>>()?);
            let mut linear = Self { residual, columns };
            for (column, change) in linear.columns.iter_mut().zip(changes) {
                for (value, before) in column.iter_mut().zip(&linear.residual) {
                    *value = (*value - before) / change;
                }
            }
            Some(linear)
        };
        problems.iter().map(one).collect()
    }
}

/// By how much a parameter is changed that has this `value`: within its bounds.
fn change(parameter: &Parameter, value: f64) -> f64 {
    let size = match parameter.scale {
        Scale::Log => value.abs(),
        Scale::Linear => value.abs().max(0.1 * (parameter.high - parameter.low)),
    };
    let change = CHANGE * size;
    match value + change <= parameter.high {
        true => change,
        false => -change,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::problem::Data;
    use crate::evaluate::{Loss, Precision, workload};
    use crate::model::{Output, Outputs, Real};
    use std::sync::Arc;

    /// Squares, and beyond the noise's size lines.
    struct Huber;

    impl Loss for Huber {
        fn of<R: Real>(error: R, size: R) -> R {
            let far = error.abs() - size;
            far.if_positive(size * size + (size + size) * far, error * error)
        }
    }

    /// Two records: the first rows of one do not count, the other has no spool.
    fn records(problem: &Problem) -> Arc<Data> {
        let Data::Series(one) = &*problem.data else {
            unreachable!()
        };
        let (mut first, mut second) = (one[0].clone(), one[0].clone());
        first.samples[..100]
            .iter_mut()
            .for_each(|row| row.weight = 0.0);
        second.measured[Output::Spool] = false;
        Arc::new(Data::Series(vec![first, second]))
    }

    #[test]
    fn differences_are_what_derivatives_say_candidate_by_candidate() {
        let mut bare = workload::with_effects(&["sensor_lag", "integral_action"], 700);
        bare.structure.observed = vec![Output::Spool, Output::Flow];
        bare.data = records(&bare);
        bare.scale = Outputs::all(0.3);
        for problem in [bare.clone(), bare.with_loss::<Huber>()] {
            let middle = workload::population(&problem, 5);
            let at = |free: &[f64]| {
                let mut one = problem.clone();
                let own = one.parameters.iter_mut().filter(|own| !own.is_fixed());
                own.zip(free).for_each(|(own, value)| {
                    let [start, far] = [own.nominal(), *value].map(|value| own.to_unit(value));
                    own.set_nominal(own.from_unit(0.9 * start + 0.1 * far));
                });
                one
            };
            let problems: Vec<Problem> = middle.iter().map(at).collect();
            for precision in [Precision::F64, Precision::F32] {
                let found = Linear::by_differences(&problems, &CpuEvaluator::new(precision));
                assert_eq!(found.len(), problems.len());
                for (found, problem) in found.iter().zip(&problems) {
                    let (found, exact) = (found.as_ref().unwrap(), Linear::new(problem).unwrap());
                    assert_eq!(found.residual.len(), problem.values());
                    let apart = |a: &[f64], b: &[f64]| {
                        let square = |values: &mut dyn Iterator<Item = f64>| {
                            values.map(|value| value * value).sum::<f64>().sqrt()
                        };
                        let differences = &mut a.iter().zip(b).map(|(a, b)| a - b);
                        (square(differences), square(&mut b.iter().copied()))
                    };
                    let (off, size) = apart(&found.residual, &exact.residual);
                    assert!(off < 1e-4 * size, "{precision:?}: {off} of {size}");
                    for (i, (a, b)) in found.columns.iter().zip(&exact.columns).enumerate() {
                        let (off, size) = apart(a, b);
                        assert!(off <= 0.05 * size, "{precision:?}, {i}: {off} of {size}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_diverges_has_no_derivatives_and_takes_no_others_with_it() {
        let problem = workload::actuator(50);
        let mut wild = problem.clone();
        wild.parameters[0].set_nominal(f64::NAN);
        let evaluator = CpuEvaluator::new(Precision::F64);
        let found = Linear::by_differences(&[problem.clone(), wild, problem], &evaluator);
        let found: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert_eq!(found, [true, false, true]);
        assert!(Linear::by_differences(&[], &evaluator).is_empty());
    }
}
