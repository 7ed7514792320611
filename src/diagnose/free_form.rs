//! The shape of what no entry of the catalogue explains: a curve of one signal at one port.

use super::evidence::{Evidence, Model, Side};
use super::fitted::Fitted;
use super::signals::Signals;
use super::statistics::basis::{Basis, dot};
use crate::evaluate::{Fingerprint, Problem};
use crate::model::effects::Port;
use crate::model::{FreeForm, Signal};
use rayon::prelude::*;

/// Knots of a curve: enough for a dead band and two bends, few enough to be seen through the noise.
const KNOTS: usize = 9;
/// Most curves that are refitted.
const REFITTED: usize = 4;

/// A correction that lowers the held-out error.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundForm {
    /// Where it acts, and what it is a curve of.
    pub form: FreeForm,
    /// What it adds at each knot.
    pub values: Vec<f64>,
    /// The unit of that.
    pub unit: String,
    /// Held-out error without it, RMS in units of noise over all channels.
    pub error_before: f64,
    /// The same with it.
    pub error_after: f64,
}

/// The corrections that most lower the cost of `base` on fitted rows, refitted with it, the lowest held-out cost first. None
/// where the base model has one already.
pub(super) fn free_forms(evidence: &Evidence, base: &Model) -> Vec<Model> {
    if base.structure().free_form.is_some() {
        return Vec::new();
    }
    let problem = |form: FreeForm| {
        let mut structure = base.structure().clone();
        structure.free_form = Some(form);
        evidence.problem(&structure, &base.problem.parameters)
    };
    let predicted_cost = |problem: &Problem| {
        let key = || {
            let mut fingerprint = Fingerprint::default();
            fingerprint.text("free form").problem(problem).finish()
        };
        let cost: Option<f64> = evidence.memory.once(key, || {
            let linear = evidence.linear(problem)?;
            let spanned = Basis::spanning(linear.columns);
            Some(dot(&linear.residual, &linear.residual) - spanned.explained(&linear.residual))
        });
        cost
    };
    let mut ranked: Vec<(f64, Problem)> = candidates(evidence, base)
        .into_par_iter()
        .map(problem)
        .filter_map(|problem| Some((predicted_cost(&problem)?, problem)))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.truncate(REFITTED);
    let mut models: Vec<Model> = ranked
        .into_par_iter()
        .filter_map(|(_, problem)| evidence.polished(problem))
        .collect();
    models.sort_by(|a, b| a.loss(Side::HoldOut).total_cmp(&b.loss(Side::HoldOut)));
    models
}

/// The correction of `model`, whose last polish is `fitted`, beside the model without it.
pub(super) fn found(
    evidence: &Evidence,
    base: &Model,
    model: &Model,
    fitted: &Fitted,
) -> Option<FoundForm> {
    let form = model.structure().free_form.clone()?;
    let own = form.parameters(&evidence.sizes);
    let is_own = |name: &str| own.iter().any(|parameter| parameter.name == name);
    let parameters = fitted
        .problem
        .parameters
        .iter()
        .zip(fitted.values.as_slice());
    Some(FoundForm {
        values: parameters
            .filter(|(parameter, _)| is_own(&parameter.name))
            .map(|(_, value)| *value)
            .collect(),
        unit: own
            .first()
            .map_or(String::new(), |parameter| parameter.unit.clone()),
        form,
        error_before: base.loss(Side::HoldOut).sqrt(),
        error_after: model.loss(Side::HoldOut).sqrt(),
    })
}

/// Every port and signal where a correction could act, with knots over the range of the signal.
fn candidates(evidence: &Evidence, base: &Model) -> Vec<FreeForm> {
    let structure = base.structure();
    let mut combinations = vec![(Port::Command, Signal::Command, None)];
    if structure.has(Port::Actuator) {
        combinations.push((Port::Actuator, Signal::Spool, None));
        combinations.push((Port::Actuator, Signal::Speed, None));
    }
    if structure.has(Port::Area) {
        combinations.push((Port::Area, Signal::Spool, None));
    }
    for &output in &structure.observed {
        for signal in [Signal::Command, Signal::Spool, Signal::Speed, Signal::Time] {
            combinations.push((Port::Measurement, signal, Some(output)));
        }
    }
    let signals = Signals::new(evidence.records(Side::Fit), &base.problem);
    let form = |(port, signal, output)| {
        let mut values = signals.of(signal).to_vec();
        if port == Port::Area {
            values
                .iter_mut()
                .for_each(|value| *value *= 100.0 / structure.full_scale);
        }
        Some(FreeForm {
            port,
            signal,
            output,
            knots: knots(values)?,
        })
    };
    combinations.into_iter().filter_map(form).collect()
}

/// Equally spaced over the middle 99 % of the values.
fn knots(mut values: Vec<f64>) -> Option<Vec<f64>> {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    let (low, high) = (at(0.005), at(0.995));
    let knot = |i: usize| low + (high - low) * i as f64 / (KNOTS - 1) as f64;
    (high > low && low.is_finite() && high.is_finite()).then(|| (0..KNOTS).map(knot).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_are_equally_far_apart_and_blind_to_the_outermost_values() {
        let values: Vec<f64> = (0..=1000).rev().map(f64::from).collect();
        let found = knots(values.clone()).unwrap();
        assert_eq!(found.len(), KNOTS);
        assert_eq!((found[0], found[KNOTS - 1]), (5.0, 995.0));
        let apart = 990.0 / (KNOTS - 1) as f64;
        assert!(
            found
                .windows(2)
                .all(|pair| (pair[1] - pair[0] - apart).abs() < 1e-9),
            "{found:?}"
        );
        assert_eq!(knots(vec![3.0; 50]), None);
        assert_eq!(knots([vec![f64::NAN; 9], values].concat()), None);
    }
}
