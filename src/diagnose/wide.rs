//! Every effect on top of a model, from starts that owe nothing to that model's fit.
//!
//! What a fit has come to rest in may be a valley that imitates what is missing: from there no effect promises anything.

use super::evidence::{Evidence, Model, Side};
use super::sought::{around, begun, better, first_starts, least_costly};
use crate::Result;
use crate::evaluate::{Evaluator, Problem};
use crate::model::effects::Effect;
use crate::model::{Parameter, Scale};
use crate::search::{RunningSearch, Settings, Start, run_in_lockstep};
use std::ops::ControlFlow;

/// Most effects that are polished to the end.
const FOLLOWED: usize = 6;
/// Generations after which the worse half of all spaces is searched no further, and so on after each that follows.
const OPEN: usize = 3;
/// But so many are searched to the end: where few are asked for, what is right may come last for long.
const TO_THE_END: usize = 16;
/// What a model has is sought this factor around its fit: in a space that is dense, in one that is wide, and anywhere.
const AROUND: [f64; 3] = [3.0, 10.0, f64::INFINITY];
/// Anywhere where the fit leaves this cost, in squared noise: it says nothing of where to look.
const LOST: f64 = 100.0;
/// Sizes from this share of the largest on are sought alike.
const SMALLEST: f64 = 1e-4;

/// `model` with each of `effects` that lead somewhere.
pub(super) fn widely(
    evidence: &Evidence,
    model: &Model,
    effects: &[Effect],
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Vec<(Effect, Model)>> {
    let starts = |effect: &Effect| {
        let starts = first_starts(evidence, model, effect).into_iter();
        starts.map(|one| (*effect, one)).collect::<Vec<_>>()
    };
    let starts = effects.iter().flat_map(starts);
    let around = match model.loss(Side::Fit) > LOST {
        true => &AROUND[..],
        false => &AROUND[..2],
    };
    let (starts, spaces): (Vec<_>, Vec<_>) = starts
        .flat_map(|start| around.iter().map(move |&around| (start.clone(), around)))
        .map(|((effect, start), around)| {
            let problem = evidence.extended(model, effect, &start);
            let space = space(evidence, effect, &problem, start.released, around);
            ((effect, problem), evidence.seeking(&space))
        })
        .unzip();
    let method = Settings::scattered();
    let begin = |space| RunningSearch::begin(space, &method, Start::Uniform, evidence.seed);
    let mut searches = spaces.iter().map(begin).collect::<Result<Vec<_>>>()?;
    race(&mut searches, evaluator, progress)?;
    let (effects, problems): (Vec<Effect>, Vec<Problem>) = starts.into_iter().unzip();
    let found = evidence.found(problems.into_iter(), searches);
    let found = effects.into_iter().zip(found).collect();
    let led = begun(evidence, least_costly(found, usize::MAX, 1));
    Ok(better(evidence, model, least_costly(led, FOLLOWED, 1)))
}

/// Runs `searches` as [`run_in_lockstep`] does, but those that lag behind only for their first generations.
fn race(
    searches: &mut [RunningSearch],
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<()> {
    let mut running: Vec<&mut RunningSearch> = searches.iter_mut().collect();
    let mut goes_on = true;
    for generation in 0.. {
        running.retain(|one| !one.search.finished());
        if running.is_empty() || !goes_on {
            break;
        }
        let each = running.iter_mut().map(|one| &mut **one);
        run_in_lockstep(each, evaluator, &mut |_| {
            goes_on = progress(generation).is_continue();
            ControlFlow::Break(())
        })?;
        if generation + 1 >= OPEN {
            running.sort_by_key(|one| one.search.best().1);
            running.truncate(running.len().div_ceil(2).max(TO_THE_END));
        }
    }
    Ok(())
}

/// `problem` with the bounds in which it is sought: around the fit what the model has, everywhere what is new; and what imitates
/// it, if that is to be `released`.
fn space(
    evidence: &Evidence,
    effect: Effect,
    problem: &Problem,
    released: bool,
    factor: f64,
) -> Problem {
    let mut space = problem.clone();
    let own: Vec<String> = effect
        .parameters(&evidence.sizes)
        .into_iter()
        .map(|one| one.name)
        .collect();
    let free = space.parameters.iter_mut().filter(|one| !one.is_fixed());
    for parameter in free {
        let imitates = released && effect.entry.imitated_by.contains(&parameter.name.as_str());
        match own.contains(&parameter.name) {
            true => at_all_sizes(parameter),
            false if imitates => parameter.low = parameter.low.max(parameter.high / 1e3),
            false => around(parameter, factor),
        }
        parameter.set_nominal(parameter.clamp(parameter.nominal()));
    }
    space
}

/// Lets small values of what cannot be negative be tried as often as large ones.
fn at_all_sizes(parameter: &mut Parameter) {
    if parameter.scale == Scale::Linear && parameter.low == 0.0 && parameter.high > 0.0 {
        parameter.scale = Scale::Log;
        parameter.low = SMALLEST * parameter.high;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{CpuEvaluator, Precision, workload};

    #[test]
    fn what_lags_behind_is_given_up_but_not_among_few() {
        let problem = workload::actuator(50);
        let finished = |count: u64| {
            let method = Settings::scattered();
            let begin = |seed| RunningSearch::begin(&problem, &method, Start::Uniform, seed);
            let mut searches: Vec<_> = (0..count).map(|seed| begin(seed).unwrap()).collect();
            let mut evaluator = CpuEvaluator::new(Precision::F32);
            let mut generations = 0;
            race(&mut searches, &mut evaluator, &mut |done| {
                generations = done + 1;
                ControlFlow::Continue(())
            })
            .unwrap();
            assert_eq!(generations, method.itr + 1);
            searches.iter().filter(|one| one.search.finished()).count()
        };
        assert_eq!([6, TO_THE_END as u64, 50].map(finished), [6, 16, 16]);
    }

    #[test]
    fn what_is_new_is_sought_at_all_sizes_and_what_is_there_around_its_value() {
        let mut size = Parameter::linear("friction", "V", 0.0, 0.0, 3.0);
        at_all_sizes(&mut size);
        assert_eq!((size.scale, size.high), (Scale::Log, 3.0));
        assert!((size.low - 3e-4).abs() < 1e-12);
        let mut signed = Parameter::linear("null_bias", "V", -3.0, 0.0, 3.0);
        at_all_sizes(&mut signed);
        assert_eq!((signed.scale, signed.low), (Scale::Linear, -3.0));
        let mut gain = Parameter::log("gain", "1/s", 1.0, 200.0, 500.0);
        around(&mut gain, 3.0);
        assert_eq!((gain.low, gain.high), (200.0 / 3.0, 500.0));
        let mut anywhere = Parameter::log("gain", "1/s", 1.0, 200.0, 500.0);
        around(&mut anywhere, f64::INFINITY);
        assert_eq!((anywhere.low, anywhere.high), (1.0, 500.0));
        around(&mut signed, 3.0);
        assert!((signed.low + 0.3).abs() < 1e-12 && (signed.high - 0.3).abs() < 1e-12);
    }
}
