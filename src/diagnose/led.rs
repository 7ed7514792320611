//! Effects of how the spool moves, sought by models that are led along the measurement first and then let go.
//!
//! A model that runs free shows from close by alone which way its parameters are off: a limit or a friction that is far off makes
//! it go ways of its own. Led, it follows the measurement with any parameters, and what each step is off by leads to the right
//! ones from nearly anywhere.

use super::evidence::{Evidence, Model};
use super::sought::{first_starts, least_costly, polished};
use crate::evaluate::{Lead, Problem};
use crate::model::effects::{Effect, Port};
use crate::model::{Output, Outputs};
use crate::search::polish::PolishOptions;
use rayon::prelude::*;

/// The share of what is off at a row by which a model is drawn back until the next one, at first.
const FIRST_SHARE: f64 = 0.3;
/// Each rate is this many times the next, and so many rates there are.
const RATES: (f64, i32) = (4.0, 7);
/// How many are led on after the first rate and after each other, and how many of the same effect.
const LED_ON: [(usize, usize); 2] = [(12, 2), (6, 1)];
/// The polish at each rate.
const LED: PolishOptions = PolishOptions {
    max_iterations: 25,
    gradient_tolerance: 1e-4,
    step_tolerance: 1e-4,
    cost_tolerance: 1e-3,
    damping: 1e-3,
};

/// `model` with each of `effects` that acts before the spool and follows the fitted rows more closely, and the candidates
/// evaluated for them. Empty where nothing shows the spool.
pub(super) fn led(
    evidence: &Evidence,
    model: &Model,
    effects: &[Effect],
) -> (Vec<(Effect, Model)>, usize) {
    let Some(lead) = lead(evidence, model) else {
        return (Vec::new(), 0);
    };
    let moves = |effect: &&Effect| matches!(effect.entry.port, Port::Command | Port::Actuator);
    let starts = effects.iter().filter(moves).flat_map(|&effect| {
        let starts = starts(evidence, model, effect);
        starts.into_iter().map(move |problem| (effect, problem))
    });
    let mut running: Vec<(Effect, Problem)> = starts.collect();
    let mut evaluations = 0;
    for k in 0..RATES.1 {
        let (most, alike) = LED_ON[usize::from(k > 0)];
        let rate = FIRST_SHARE / evidence.sizes.interval * RATES.0.powi(-k);
        let lead = Lead {
            rate,
            ..lead.clone()
        };
        let found: Vec<(f64, Effect, Problem, usize)> = running
            .into_par_iter()
            .filter_map(|(effect, problem)| {
                let (cost, problem, count) = evidence.polished_led(problem, &lead, &LED)?;
                Some((cost, effect, problem, count))
            })
            .collect();
        evaluations += found.iter().map(|(.., count)| count).sum::<usize>();
        let found = found
            .into_iter()
            .map(|(cost, effect, problem, _)| (cost, effect, problem));
        running = least_costly(found.collect(), most, alike);
    }
    let (models, more) = polished(evidence, model, running);
    (models, evaluations + more)
}

/// `model` with `effect`, as it was fitted, and with all that the base model has in the middle of its bounds: what it was fitted
/// to without the effect may say nothing of it.
fn starts(evidence: &Evidence, model: &Model, effect: Effect) -> Vec<Problem> {
    let starts = first_starts(evidence, model, &effect).into_iter();
    let mut problems: Vec<Problem> = starts
        .map(|start| evidence.extended(model, effect, &start))
        .collect();
    let mut middle = problems[0].clone();
    for parameter in &mut middle.parameters {
        let base = evidence.base.iter().any(|own| own.name == parameter.name);
        if base && !parameter.is_fixed() {
            parameter.set_nominal(parameter.from_unit(0.5));
        }
    }
    problems.push(middle);
    problems
}

/// What draws `model` along the measurement, at no rate yet; `None` where nothing shows its spool.
fn lead(evidence: &Evidence, model: &Model) -> Option<Lead> {
    let structure = model.structure();
    let states = structure.led();
    let mut per_unit = Outputs::all(0.0);
    let shows = [Output::Spool, Output::Flow];
    let shown = shows
        .into_iter()
        .find(|one| structure.observed.contains(one))?;
    per_unit[shown] = match shown {
        Output::Spool => 1.0,
        _ => evidence.sizes.command / evidence.sizes.outputs[shown],
    };
    (!states.is_empty()).then_some(Lead {
        rate: 0.0,
        per_unit,
        states,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::evidence::Side;
    use crate::diagnose::evidence::tests::{at, evidence, model, planted};
    use crate::model::Structure;
    use crate::model::effects::entry;

    #[test]
    fn a_limit_is_found_from_a_base_model_that_imitates_it() {
        let bare = Structure::actuator(10.0, "V");
        let on = |name| entry(name).unwrap().on(&bare)[0];
        let windup = on("slew_limit~windup");
        let truth = [
            at("gain", 200.0),
            at("time_constant", 0.0044),
            at("saturation", 6.0),
            at("slew_limit_windup", 120.0),
        ];
        let mut evidence = planted(&bare, windup, &truth);
        let base = evidence.problem(&bare, &[at("gain", 850.0), at("time_constant", 0.2)]);
        let base = evidence.polished(base).unwrap();
        evidence.look_at(&base);
        let effects = [on("dc_gain"), on("friction"), on("slew_limit"), windup];
        let (found, evaluations) = led(&evidence, &base, &effects);
        let loss = |(_, model): &&(Effect, Model)| model.loss(Side::Fit).sqrt();
        let best = found
            .iter()
            .min_by(|a, b| loss(a).total_cmp(&loss(b)))
            .unwrap();
        let imitated = base.loss(Side::Fit).sqrt();
        println!("{imitated} -> {} in {evaluations}", loss(&best));
        assert_eq!(best.0, windup);
        assert!(imitated > 1.0 && loss(&best) < 1e-4);
        let parameters = &best.1.problem.parameters;
        for own in &truth {
            let found = parameters.iter().find(|p| p.name == own.name).unwrap();
            assert!(
                (found.nominal() / own.nominal() - 1.0).abs() < 1e-3,
                "{own:?}"
            );
        }
    }

    #[test]
    fn what_shows_no_spool_is_not_led() {
        let bare = Structure {
            observed: vec![Output::Position],
            ..Structure::actuator(10.0, "V")
        };
        let evidence = evidence(&bare);
        assert!(lead(&evidence, &model(&evidence, &bare)).is_none());
    }
}
