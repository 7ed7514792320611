//! Numbers that hold: nothing breaks anywhere inside the bounds, and figures that would be the integrator's are refused.

use crate::common;
use crate::common::effects::{BASE, piston, scale};
use crate::common::{Record, cases, effects, near_bounds, on_bounds, random};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::diagnose::{
    Conditions, IdentificationProblem, Identified, Measurements, Options, PlacedJumps, Sides, Used,
    identify,
};
use servobee::evaluate::problem::{Data, Series};
use servobee::evaluate::{
    Cost, CpuEvaluator, Evaluator, Population, Precision, Problem, STATE_LIMIT, Status, reference,
};
use servobee::model::{Complete, Output};
use servobee::search::Plan;
use std::ops::ControlFlow;

/// Candidates on the bounds, every parameter alone at either end of its range, and anywhere inside.
fn anywhere(problem: &Problem, count: usize, seed: u64) -> Population {
    let mut population = random(problem, count, seed);
    let start = problem.start();
    for (i, parameter) in problem.free().iter().enumerate() {
        for end in [parameter.low, parameter.high] {
            let mut candidate = start.clone();
            candidate[i] = end;
            population.push(&candidate);
        }
    }
    on_bounds(problem)
        .iter()
        .for_each(|candidate| population.push(candidate));
    population
}

/// A candidate that diverged has a state beyond the limit, and none is ever not a number: a cost that is missing for another
/// reason would be a fault of the arithmetic.
#[test]
fn inside_the_bounds_nothing_breaks() {
    let base = cases()
        .into_iter()
        .map(|case| (case.name.to_owned(), case.problem));
    let (mut candidates, mut diverged) = (0, 0);
    for (seed, (name, mut problem)) in (1..).zip(base.chain(effects::cases())) {
        // The whole space that a search has, not the neighbourhood that the case compares evaluators in.
        let wide = problem.structure.parameters();
        for parameter in problem.parameters.iter_mut().filter(|p| !p.is_fixed()) {
            if let Some(own) = wide.iter().find(|own| own.name == parameter.name) {
                (parameter.low, parameter.high) = (own.low, own.high);
                parameter.set_nominal(parameter.clamp(parameter.nominal()));
            }
        }
        let population = anywhere(&problem, 12, seed);
        let of = |precision| -> Vec<Cost> {
            let costs = CpuEvaluator::new(precision).costs(&problem, &population);
            costs.expect("costs from the CPU")
        };
        for (single, double) in of(Precision::F32).iter().zip(of(Precision::F64)) {
            for cost in [*single, double] {
                let sound = match cost.status {
                    Status::Finished => cost.value.is_finite() && cost.value >= 0.0,
                    Status::Diverged => cost.value == f64::INFINITY,
                };
                assert!(sound, "{name}: {cost:?}");
            }
        }
        for (candidate, cost) in population.iter().zip(of(Precision::F64)) {
            candidates += 1;
            diverged += usize::from(cost.status == Status::Diverged);
            let Data::Series(records) = &*problem.data else {
                continue;
            };
            let values = problem.complete(candidate, |fixed| fixed);
            let rows = reference::trajectories(&problem.structure, &values, records);
            let largest =
                rows.iter()
                    .flatten()
                    .flat_map(|row| row.0)
                    .fold(0.0, |most: f64, value| {
                        assert!(!value.is_nan(), "{name}: {candidate:?}");
                        most.max(value.abs())
                    });
            if cost.status == Status::Finished {
                assert!(largest < STATE_LIMIT * STATE_LIMIT, "{name}: {candidate:?}");
            }
        }
    }
    println!("{candidates} candidates, {diverged} of them diverge");
    assert!(candidates > 2500);
}

/// A piston that moves fast between rows far apart, measured with noise, and cut into steps that suit `rate` (1/s). A flow force
/// acts on the spool, so that these are integration steps.
fn far_apart(rate: f64) -> servobee::Result<Identified> {
    let structure = piston().with("flow_force".parse().expect("an effect"));
    let parameters = near_bounds(&structure, &[&BASE[..], &[("flow_force", 0.1)]].concat());
    let record = Record::new(400, 8e-3, 8.0);
    let exact = common::problem(structure.clone(), parameters.clone(), vec![record]);
    let Data::Series(records) = &*exact.data else {
        unreachable!("a record was given")
    };
    let values = Complete::nominal(&parameters);
    let outputs = reference::trajectories(&structure, &values, records).remove(0);
    let mut series: Series = records[0].clone();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (sample, row) in series.samples.iter_mut().zip(&outputs) {
        let mut noise = |size: f64| size * rng.random_range(-1.0..1.0);
        sample.weight = 1.0;
        sample.target[Output::Flow] = row[Output::Flow] + noise(0.5);
        sample.target[Output::Position] = row[Output::Position] + noise(0.2);
    }
    series.set_steps(rate, 1);
    let mut held = series.clone();
    held.samples[..300]
        .iter_mut()
        .for_each(|sample| sample.weight = 0.0);
    series.time.truncate(300);
    series.samples.truncate(300);
    let problem = IdentificationProblem {
        sizes: scale(&structure),
        structure,
        parameters,
        measurements: Measurements {
            fit: vec![series],
            hold_out: vec![held],
            rows: 400,
            is_static: false,
            bench: Vec::new(),
            beginnings: Vec::new(),
            conditions: Conditions::default(),
            records: vec![Used::default()],
            of_record: Sides {
                fit: vec![0],
                hold_out: vec![0],
            },
            clocks: vec![0.0],
            input_noise: Vec::new(),
            shown_hold: None,
            placed_jumps: PlacedJumps::default(),
        },
        hold_known: true,
        loss: None,
    };
    identify(
        problem,
        &mut CpuEvaluator::new(Precision::F32),
        &Plan::of_records(1),
        &Options::default(),
        &mut |_| ControlFlow::Continue(()),
    )
}

#[test]
fn an_integration_error_above_the_noise_is_refused() {
    let fine = far_apart(2000.0).expect("a model");
    for (channel, change) in &fine.after.integration_error {
        println!(
            "{channel}: {change} beside a noise of {}",
            fine.noise[channel].value
        );
        assert!(*change > 0.0 && *change < 0.1 * fine.noise[channel].value);
    }
    let error = far_apart(1.0).expect_err("steps as long as the dynamics");
    assert_eq!(error.exit_code(), 1);
    let text = error.to_string();
    println!("{text}");
    for part in ["halving the integration steps", "noise", "--model"] {
        assert!(text.contains(part), "{text}");
    }
}
