//! Effects of how the spool moves, sought by models that are led along the measurement first and then let go.
//!
//! A model that runs free shows from close by alone which way its parameters are off: a limit or a friction that is far off makes
//! it go ways of its own. Led, it follows the measurement with any parameters, and what each step is off by leads to the right
//! ones from nearly anywhere.

use super::evidence::{Evidence, Model, Side, set_start};
use crate::evaluate::{Fingerprint, Interrupt, Lead, Problem, reference};
use crate::model::effects::{Effect, Port};
use crate::model::{Output, Outputs};
use crate::search::polish::{LeastSquares, PolishOptions, polish};
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
/// evaluated for them. Empty where neither spool nor flow is measured.
pub(super) fn led(
    evidence: &Evidence,
    model: &Model,
    effects: &[Effect],
) -> (Vec<(Effect, Model)>, usize) {
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
        let polished = running.into_par_iter().filter_map(|(effect, problem)| {
            let lead = lead(evidence, &problem, rate)?;
            Some((effect, polished(evidence, problem, &lead)?))
        });
        let mut polished: Vec<_> = polished.collect();
        polished.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        evaluations += polished
            .iter()
            .map(|(_, one)| one.evaluations)
            .sum::<usize>();
        let mut kept: Vec<(Effect, Problem)> = Vec::new();
        for (effect, one) in polished {
            let same = kept.iter().filter(|(other, _)| *other == effect).count();
            if same < alike && kept.len() < most {
                kept.push((effect, one.problem));
            }
        }
        running = kept;
    }
    let models: Vec<(Effect, Model)> = running
        .into_par_iter()
        .filter_map(|(effect, problem)| Some((effect, evidence.polished(problem)?)))
        .filter(|(_, one)| one.loss(Side::Fit) < model.loss(Side::Fit))
        .collect();
    evaluations += models.iter().map(|(_, one)| one.evaluations).sum::<usize>();
    (models, evaluations)
}

/// `model` with `effect`, as it was fitted, and with all that the base model has in the middle of its bounds: what it was fitted
/// to without the effect may say nothing of it.
fn starts(evidence: &Evidence, model: &Model, effect: Effect) -> Vec<Problem> {
    let starts = evidence.search_starts(model, &effect);
    let alike = starts.iter().filter(|one| one.trial == starts[0].trial);
    let mut problems: Vec<Problem> = alike
        .map(|start| evidence.extended(model, effect, start))
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

/// What draws `problem` along the measurement at `rate`; `None` where nothing shows its spool.
fn lead(evidence: &Evidence, problem: &Problem, rate: f64) -> Option<Lead> {
    let states = problem.structure.led();
    let mut per_unit = Outputs::all(0.0);
    let shows = [Output::Spool, Output::Flow];
    let shown = shows
        .into_iter()
        .find(|one| problem.structure.observed.contains(one))?;
    per_unit[shown] = match shown {
        Output::Spool => 1.0,
        _ => evidence.sizes.command / evidence.sizes.outputs[shown],
    };
    (!states.is_empty()).then_some(Lead {
        rate,
        per_unit,
        states,
    })
}

/// A problem that was polished while it was led.
struct Polished {
    problem: Problem,
    cost: f64,
    evaluations: usize,
}

/// What a polish makes of the problem's start while it is led; `None` where that diverges, or the run was stopped.
fn polished(evidence: &Evidence, mut problem: Problem, lead: &Lead) -> Option<Polished> {
    let interrupt = evidence.memory.interrupt();
    let key = || {
        let mut fingerprint = Fingerprint::default();
        let text = format!("led polish at {}", lead.rate);
        fingerprint.text(&text).problem(&problem).finish()
    };
    let found: Option<(f64, Vec<f64>, usize)> = evidence.memory.once(key, || {
        let mut led = Led {
            problem: &problem,
            lead,
            interrupt,
        };
        let found = polish(&mut led, &problem.free(), &problem.start(), &LED).ok()?;
        Some((found.cost, found.values, found.evaluations))
    });
    if interrupt.asked() {
        return None;
    }
    let (cost, values, evaluations) = found?;
    set_start(&mut problem, &values);
    Some(Polished {
        problem,
        cost,
        evaluations,
    })
}

/// A problem that is led.
struct Led<'a> {
    problem: &'a Problem,
    lead: &'a Lead,
    interrupt: &'a Interrupt,
}

impl LeastSquares for Led<'_> {
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        !self.interrupt.asked() && reference::led_residuals(self.problem, self.lead, candidate, row)
    }

    fn cost(&mut self, candidate: &[f64]) -> Option<f64> {
        self.cost_up_to(candidate, f64::INFINITY)
    }

    fn cost_up_to(&mut self, candidate: &[f64], most: f64) -> Option<f64> {
        match self.interrupt.asked() {
            true => None,
            false => reference::led_cost_up_to(self.problem, self.lead, candidate, most),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::evidence::tests::{at, planted};
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
        let of = |name: &str| {
            best.1
                .problem
                .parameters
                .iter()
                .find(|p| p.name == name)
                .unwrap()
        };
        for own in &truth {
            assert!(
                (of(&own.name).nominal() / own.nominal() - 1.0).abs() < 1e-3,
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
        let friction = entry("friction").unwrap().on(&bare)[0];
        let evidence = planted(&Structure::actuator(10.0, "V"), friction, &[]);
        assert!(lead(&evidence, &evidence.problem(&bare, &[]), 100.0).is_none());
    }
}
