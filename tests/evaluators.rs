//! What a cost is, and that it depends on nothing but the problem and the candidate.

use crate::common::{Case, case, cases, random};
use servobee::evaluate::problem::{Data, Sample, Series};
use servobee::evaluate::{Cost, CpuEvaluator, Evaluator, Population, Precision, Problem, Status};
use servobee::model::{Drive, Initial, Input, Output, Outputs, Parameter, ServoValve, Structure};
use std::collections::{BTreeSet, HashSet};
use std::process::Command;

fn costs(problem: &Problem, population: &Population) -> Vec<Cost> {
    let costs = CpuEvaluator::new(Precision::F64).costs(problem, population);
    costs.expect("costs from the CPU")
}

fn bits(costs: &[Cost]) -> Vec<u64> {
    costs.iter().map(|cost| cost.value.to_bits()).collect()
}

/// A record of two rows, a second apart.
fn two_rows(
    structure: Structure,
    parameters: Vec<Parameter>,
    rows: [(f64, f64, f64); 2],
) -> Problem {
    let sample = |(command, spool, weight)| Sample {
        step: 1.0,
        substeps: 1,
        input: Input {
            command,
            ..Input::default()
        },
        target: Outputs::from_fn(|output| match output {
            Output::Spool => spool,
            _ => 0.0,
        }),
        weight,
        ..Sample::default()
    };
    let series = Series {
        name: "by hand".into(),
        measured: Outputs::all(true),
        time: vec![0.0, 1.0],
        samples: rows.map(sample).to_vec(),
    };
    Problem::new(structure, parameters, Data::Series(vec![series]))
}

#[test]
fn a_cost_by_hand() {
    let structure = Structure {
        initial: Initial::Rest,
        ..Structure::actuator(10.0, "V")
    };
    let parameters = structure.parameters();
    let mut problem = two_rows(structure, parameters, [(1.0, 2.0, 0.25), (7.0, 1.0, 3.0)]);
    // K = T = 1 and u = 1 from rest: x'' + x' + x = 1. The command of the last row does not act any more.
    let w = 0.75f64.sqrt();
    let x = 1.0 - (-0.5f64).exp() * (w.cos() + 0.5 / w * w.sin());
    let hand = 0.25 * 2.0f64.powi(2) + 3.0 * (1.0 - x).powi(2);
    let candidate = Population::single(&[1.0, 1.0, 10.0]);
    assert!((costs(&problem, &candidate)[0].value - hand).abs() < 1e-12);
    problem.scale = Outputs::all(100.0);
    problem.scale[Output::Spool] = 4.0;
    assert!((costs(&problem, &candidate)[0].value - 4.0 * hand).abs() < 1e-11);
}

#[test]
fn saturation_limits_the_step_by_hand() {
    let structure = Structure {
        initial: Initial::Rest,
        ..Structure::actuator(10.0, "V")
    };
    let parameters = structure.parameters();
    let problem = two_rows(structure, parameters, [(8.0, 0.0, 1.0), (8.0, 0.0, 1.0)]);
    // z = K S t, so x'' = K S - x': with K = T = 1 and S = 1/2, x = (t - 1 + exp(-t)) / 2.
    let x = 0.5 * (-1.0f64).exp();
    let cost = costs(&problem, &Population::single(&[1.0, 1.0, 0.5]))[0];
    assert!((cost.value - x * x).abs() < 1e-12);
}

#[test]
fn a_spool_that_follows_at_once_needs_no_state() {
    let structure = Structure {
        base: ServoValve {
            drive: Drive::Direct,
            spool_unit: Some("mm".into()),
            ..ServoValve::default()
        }
        .into(),
        ..Structure::actuator(10.0, "V")
    };
    let parameters = structure.parameters();
    let problem = two_rows(structure, parameters, [(2.0, 1.5, 1.0), (-4.0, -1.0, 2.0)]);
    let cost = costs(&problem, &Population::single(&[0.5]))[0];
    assert_eq!(cost.value, 0.5 * 0.5 + 2.0 * 1.0);
}

#[test]
fn a_row_of_weight_zero_does_not_count() {
    let Case { problem, .. } = case("actuator, held");
    let population = random(&problem, 5, 1);
    let with_targets = |target: f64| {
        let mut changed = problem.clone();
        let Data::Series(mut all) = (*problem.data).clone() else {
            unreachable!("a record")
        };
        let mut silent = 0;
        for sample in all.iter_mut().flat_map(|one| &mut one.samples) {
            if sample.weight == 0.0 {
                sample.target[Output::Spool] = target;
                silent += 1;
            }
        }
        assert!(silent > 0);
        changed.data = Data::Series(all).into();
        costs(&changed, &population)
    };
    assert_eq!(bits(&with_targets(0.0)), bits(&with_targets(1000.0)));
}

#[test]
fn twice_the_weight_is_twice_the_cost() {
    for name in ["actuator, held", "tones, settled"] {
        let Case { problem, .. } = case(name);
        let mut double = problem.clone();
        let mut data = (*problem.data).clone();
        match &mut data {
            Data::Series(all) => all
                .iter_mut()
                .flat_map(|one| &mut one.samples)
                .for_each(|sample| sample.weight *= 2.0),
            Data::Tones(tones) => tones.iter_mut().for_each(|tone| tone.weight *= 2.0),
        }
        double.data = data.into();
        let population = random(&problem, 5, 1);
        for (one, two) in costs(&problem, &population)
            .iter()
            .zip(costs(&double, &population))
        {
            assert_eq!(2.0 * one.value, two.value, "{name}");
        }
    }
}

#[test]
fn the_cost_of_the_start_is_what_its_targets_were_made_for() {
    for case in cases() {
        let start = Population::single(&case.problem.start());
        let cost = costs(&case.problem, &start)[0].value;
        assert!((cost - 1.0).abs() < 1e-9, "{}: {cost}", case.name);
    }
}

#[test]
fn costs_depend_neither_on_the_run_nor_on_the_threads_nor_on_the_neighbours() {
    for name in ["actuator, held", "actuator and table valve", "tones, paper"] {
        let Case { problem, .. } = case(name);
        for precision in [Precision::F32, Precision::F64] {
            // More than a batch of lanes, and not a multiple of it.
            let population = random(&problem, 203, 1);
            let of = |population: &Population| {
                let costs = CpuEvaluator::new(precision).costs(&problem, population);
                bits(&costs.expect("costs from the CPU"))
            };
            let reference = of(&population);
            assert_eq!(reference.len(), 203);
            assert_eq!(
                reference.iter().collect::<HashSet<_>>().len(),
                203,
                "{name}: costs in a wrong order would not show"
            );
            assert_eq!(of(&population), reference);
            for threads in [1, 3, 8] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let costs = pool.expect("a thread pool").install(|| of(&population));
                assert_eq!(costs, reference, "{name} on {threads} threads");
            }
            for (candidate, &cost) in population.iter().zip(&reference) {
                assert_eq!(of(&Population::single(candidate)), [cost], "{name}");
            }
        }
    }
}

#[test]
fn costs_are_ordered_and_diverged_ones_come_last() {
    let finished = Cost::finished;
    let mut costs = [
        finished(f64::NAN),
        finished(f64::MAX),
        finished(0.0),
        Cost::DIVERGED,
        finished(3.0),
        finished(f64::INFINITY),
        finished(-1.0),
    ];
    costs.sort();
    let values: Vec<f64> = costs[..4].iter().map(|cost| cost.value).collect();
    assert_eq!(values, [-1.0, 0.0, 3.0, f64::MAX]);
    for cost in &costs[4..] {
        assert_eq!((cost.status, cost.value), (Status::Diverged, f64::INFINITY));
    }
    assert_eq!(finished(2.0), finished(2.0));
    let diverged = Cost {
        value: 0.0,
        status: Status::Diverged,
    };
    assert!(finished(f64::MAX) < diverged);
}

#[test]
fn a_problem_without_free_parameters_has_a_cost() {
    let Case { mut problem, .. } = case("actuator, held");
    let searched = costs(&problem, &Population::single(&problem.start()));
    problem
        .parameters
        .iter_mut()
        .for_each(|p| p.set_fixed(true));
    let mut population = Population::new(0);
    assert!(population.is_empty());
    population.push(&[]);
    population.push(&[]);
    assert_eq!((population.len(), population.iter().len()), (2, 2));
    let fixed = costs(&problem, &population);
    assert_eq!(bits(&fixed), [searched[0].value.to_bits(); 2]);
}

#[test]
fn an_empty_population_has_no_costs() {
    for case in cases() {
        assert!(costs(&case.problem, &random(&case.problem, 0, 1)).is_empty());
    }
}

#[test]
fn vectors_are_computed_by_instructions_and_not_by_calls() {
    // What is called for a step of many candidates is inlined: a closure that is not is compiled for no vectors at all, and each of
    // its sums becomes a call through memory. Making equations ready happens once a simulation.
    let program = env!("CARGO_BIN_EXE_servobee");
    let listing = match Command::new("objdump")
        .args(["-d", "-C", "--no-show-raw-insn"])
        .arg(program)
        .output()
    {
        Ok(listing) if cfg!(target_arch = "x86_64") && listing.status.success() => listing.stdout,
        _ => {
            println!("NOT TESTED: how vectors are compiled: there is no objdump, or no x86-64");
            return;
        }
    };
    let (mut function, mut functions, mut wrong) = (String::new(), 0, BTreeSet::new());
    for line in String::from_utf8_lossy(&listing).lines() {
        if line.ends_with(">:") {
            function = line.to_owned();
            functions += usize::from(line.contains("servobee::"));
        } else if line.contains("call")
            && line.contains("core_arch::x86::")
            && function.contains("servobee::")
            && !function.contains("::equations::")
        {
            wrong.insert(function.clone());
        }
    }
    assert!(functions > 1000, "{functions} functions");
    assert!(wrong.is_empty(), "{wrong:#?}");
}
