//! Effects of how the spool moves, sought by models that are led along the measurement first and then let go.
//!
//! A model that runs free shows from close by alone which way its parameters are off: a limit or a friction that is far off makes
//! it go ways of its own. Led, it follows the measurement with any parameters, and what each step is off by leads to the right
//! ones from nearly anywhere.

use super::evidence::{Begun, Evidence, Model, Side, set_start};
use super::sought::{around, better, first_starts, least_costly};
use crate::Result;
use crate::evaluate::{CpuEvaluator, Lead, Precision, Problem};
use crate::model::effects::{Effect, Port};
use crate::model::{Complete, Output, Scale};
use crate::search::Settings;
use crate::search::polish::PolishOptions;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// The share of what is off at a row by which a model is drawn back until the next one, at first.
const FIRST_SHARE: f64 = 0.3;
/// So many iterations show which of the starts are led anywhere at all: so many are led to the end, and so many of the same effect.
const GLANCE: PolishOptions = PolishOptions {
    max_iterations: 5,
    ..LED
};
const LED_AT_ALL: (usize, usize) = (24, 2);
/// Each rate is this many times the next, and so many rates there are.
const RATES: (f64, i32) = (4.0, 7);
/// How many are led on after the first rate and after each other, and how many of the same effect.
const LED_ON: [(usize, usize); 2] = [(12, 2), (6, 1)];
/// Where those of the first rate cost less than this share of what all cost that are let go, a loop winds up so deep that its
/// cost has ripples, in which a polish is stuck: so many of them that cost least, and so many of the same effect, are sought
/// around this factor of where they are.
const ASTRAY: f64 = 0.1;
const CLOSE: (usize, usize) = (3, 2);
const AROUND: f64 = 1.05;
const NEARBY: Settings = Settings {
    itr: 80,
    ..Settings::scattered()
};
/// The polish at each rate.
const LED: PolishOptions = PolishOptions {
    max_iterations: 25,
    gradient_tolerance: 1e-4,
    step_tolerance: 1e-4,
    cost_tolerance: 1e-3,
    damping: 1e-3,
    edge_tolerance: 0.03,
};

/// `model` with each of `effects` that acts before the spool and follows the fitted rows more closely. Empty where nothing shows
/// the spool.
pub(super) fn led(
    evidence: &Evidence,
    model: &Model,
    effects: &[Effect],
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Vec<(Effect, Model)>> {
    let Some(lead) = lead(evidence, model) else {
        return Ok(Vec::new());
    };
    let moves = |effect: &&Effect| matches!(effect.entry.port, Port::Command | Port::Actuator);
    let starts = effects.iter().filter(moves).flat_map(|&effect| {
        let starts = starts(evidence, model, effect);
        starts.into_iter().map(move |problem| (effect, problem))
    });
    let led_at = |k: i32, starts: Vec<(Effect, Problem)>, options: &PolishOptions| {
        let lead = Lead {
            rate: FIRST_SHARE / evidence.sizes.interval * RATES.0.powi(-k),
            ..lead.clone()
        };
        let starts = starts.into_par_iter();
        let led = starts.filter_map(|(effect, problem)| {
            Some((effect, evidence.polished_led(problem, &lead, options)?))
        });
        led.collect::<Vec<(Effect, Begun)>>()
    };
    let glanced = led_at(0, starts.collect(), &GLANCE);
    let mut first = led_at(0, least_costly(glanced, LED_AT_ALL.0, LED_AT_ALL.1), &LED);
    let mut running = least_costly(first.clone(), LED_ON[0].0, LED_ON[0].1);
    for k in 1..RATES.1 {
        let found = led_at(k, running, &LED);
        running = least_costly(found, LED_ON[1].0, LED_ON[1].1);
    }
    let mut models = better(evidence, model, running);
    let free = models.iter().map(|(_, one)| evidence.cost(&one.problem));
    let free = free.fold(evidence.cost(&model.problem), f64::min);
    first.retain(|(_, one)| one.cost < ASTRAY * free);
    if !first.is_empty() {
        let close = least_costly(first, CLOSE.0, CLOSE.1);
        models.extend(nearby(evidence, model, close, progress)?);
    }
    Ok(models)
}

/// `model` with what was `found` led and is sought around there.
fn nearby(
    evidence: &Evidence,
    model: &Model,
    mut found: Vec<(Effect, Problem)>,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Vec<(Effect, Model)>> {
    let space = |(_, problem): &(Effect, Problem)| {
        let mut space = problem.clone();
        let free = space.parameters.iter_mut().filter(|one| !one.is_fixed());
        free.filter(|one| one.scale == Scale::Log)
            .for_each(|one| around(one, AROUND));
        space
    };
    let spaces: Vec<Problem> = found.iter().map(space).collect();
    // In f32 the ripples are other ones.
    let mut exact = CpuEvaluator::new(Precision::F64);
    let best = evidence.searched(&spaces, &NEARBY, &mut exact, progress)?;
    for ((_, problem), best) in found.iter_mut().zip(best) {
        set_start(problem, &best.problem.start());
    }
    Ok(better(evidence, model, found))
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

/// What draws `model` along the measurement, at no rate yet; `None` where nothing shows which way its spool is off.
fn lead(evidence: &Evidence, model: &Model) -> Option<Lead> {
    let structure = model.structure();
    let values = Complete::nominal(&model.problem.parameters);
    let first = evidence.records(Side::Fit).first()?;
    let lead = Lead {
        states: structure.led(),
        reach: structure.full_scale,
        ..Lead::default()
    };
    let shows = |&output: &Output| lead.slope(output, first, structure, &values) != 0.0;
    let shown_by = structure.observed.iter().copied().find(shows)?;
    Some(Lead {
        shown_by: Some(shown_by),
        ..lead
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::evidence::tests::{at, model, planted};
    use crate::model::effects::entry;
    use crate::model::valve::{Meter, ValveForm};
    use crate::model::{Polarity, ServoValve, Structure};

    /// A valve of which only the flow is measured, which falls where the spool rises.
    fn against() -> Structure {
        Structure {
            observed: vec![Output::Flow],
            base: ServoValve {
                polarity: Polarity::Negative,
                ..ServoValve::with(ValveForm::linear())
            }
            .into(),
            ..Structure::actuator(10.0, "V")
        }
    }

    /// A valve whose spool is measured in mm, of which 25 are 1 V.
    fn in_millimetres() -> Structure {
        Structure {
            base: ServoValve {
                spool_unit: Some("mm".into()),
                ..ServoValve::default()
            }
            .into(),
            ..Structure::actuator(10.0, "V")
        }
    }

    #[test]
    fn a_limit_is_found_from_a_base_model_that_imitates_it() {
        let truth = [
            at("gain", 200.0),
            at("time_constant", 0.0044),
            at("saturation", 6.0),
            at("slew_limit_windup", 100.0),
            at("spool_gain", 25.0),
        ];
        for bare in [against(), in_millimetres()] {
            let on = |name| entry(name).unwrap().on(&bare)[0];
            let windup = on("slew_limit~windup");
            let mut evidence = planted(&bare, windup, &truth);
            let start = [
                at("gain", 150.0),
                at("time_constant", 0.01),
                at("spool_gain", 25.0),
            ];
            let base = evidence.polished(evidence.problem(&bare, &start)).unwrap();
            evidence.look_at(&base);
            // As they are where the ranges of a record set them.
            for (name, about) in [("max_area", 0.7), ("spool_gain", 35.0)] {
                let own = evidence.base.iter_mut().filter(|own| own.name == name);
                own.for_each(|own| (own.low, own.high) = (about / 10.0, about * 10.0));
            }
            let loss = |model: &Model| model.loss(Side::Fit).sqrt();
            let free = starts(&evidence, &base, windup).into_iter();
            let free = free.filter_map(|start| Some(loss(&evidence.polished(start)?)));
            let free = free.fold(f64::INFINITY, f64::min);
            let effects = ["delay", "friction", "slew_limit", "slew_limit~windup"].map(on);
            let goes_on = &mut |_| ControlFlow::Continue(());
            let before = evidence.evaluations();
            let found = led(&evidence, &base, &effects, goes_on).unwrap();
            let evaluations = evidence.evaluations() - before;
            let best = found
                .iter()
                .min_by(|a, b| loss(&a.1).total_cmp(&loss(&b.1)));
            let (effect, model) = best.unwrap();
            let (imitated, found) = (loss(&base), loss(model));
            println!("base {imitated}, free {free}, led {found} in {evaluations}");
            assert_eq!(*effect, windup);
            assert!(imitated > 10.0 && free > 10.0 && found < 1e-4);
            for own in &truth {
                let parameters = &model.problem.parameters;
                if let Some(found) = parameters.iter().find(|p| p.name == own.name) {
                    let share = found.nominal() / own.nominal();
                    assert!((share - 1.0).abs() < 1e-3, "{own:?}: {share}");
                }
            }
        }
    }

    #[test]
    fn what_does_not_show_which_way_the_spool_is_off_does_not_lead() {
        let valve = ValveForm {
            meter: Meter::Supply,
            ..ValveForm::linear()
        };
        let without_sign = Structure {
            observed: vec![Output::Flow],
            base: ServoValve::with(valve).into(),
            ..Structure::actuator(10.0, "V")
        };
        let integrated = Structure {
            observed: vec![Output::Position],
            ..Structure::actuator(10.0, "V")
        };
        let shown_by = |structure: &Structure| {
            let delay = entry("delay").unwrap().on(structure)[0];
            let evidence = planted(structure, delay, &[at("delay", 0.01)]);
            lead(&evidence, &model(&evidence, structure))?.shown_by
        };
        for structure in [without_sign, integrated] {
            assert_eq!(shown_by(&structure), None);
        }
        assert_eq!(shown_by(&against()), Some(Output::Flow));
    }
}
