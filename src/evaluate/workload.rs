//! Made-up problems and populations, the same for `servobee bench`, the benchmarks and tests.

use crate::evaluate::Population;
use crate::evaluate::problem::{Data, Problem, Sample, Series};
use crate::evaluate::simulation::simulate::outputs;
use crate::model::effects::entry;
use crate::model::valve::ValveForm;
use crate::model::{Complete, Input, Output, Outputs, ServoValve, Structure};

/// The actuator alone, on `samples` rows at 1 kHz.
pub fn actuator(samples: usize) -> Problem {
    planted(Structure::actuator(10.0, "V"), samples)
}

/// The actuator with a valve whose flow is observed, too.
pub fn actuator_and_valve(samples: usize) -> Problem {
    let structure = Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm::linear()).into(),
        ..Structure::actuator(10.0, "V")
    };
    planted(structure, samples)
}

/// The actuator with a valve and the effects called `names`, on every output that they can be on.
pub fn with_effects(names: &[&str], samples: usize) -> Problem {
    let base = actuator_and_valve(1).structure;
    let effects = names
        .iter()
        .flat_map(|name| entry(name).expect("an effect").on(&base));
    planted(
        effects.fold(base.clone(), |s, effect| s.with(effect)),
        samples,
    )
}

/// A step of another height every 40 samples, whose response is that of the parameters' start values moved by 1, so that no
/// cost is near zero, where relative differences mean nothing.
fn planted(structure: Structure, samples: usize) -> Problem {
    let parameters = structure.parameters();
    let sample = |k: usize| Sample {
        input: Input {
            command: 9.0 * ((k / 40) as f64 * 1.7).sin(),
            time: k as f64 * 1e-3,
            ..Input::default()
        },
        weight: 1.0,
        ..Sample::default()
    };
    let mut series = Series {
        name: "workload".into(),
        measured: Outputs::all(true),
        time: (0..samples).map(|k| k as f64 * 1e-3).collect(),
        samples: (0..samples).map(sample).collect(),
    };
    series.set_steps(structure.fastest_rate(&parameters), 1);
    let values = Complete::nominal(&parameters);
    let targets = outputs(&structure, &values, &series);
    for (sample, target) in series.samples.iter_mut().zip(targets) {
        for &output in &structure.observed {
            sample.target[output] = target[output] + 1.0;
        }
    }
    Problem::new(structure, parameters, Data::Series(vec![series]))
}

/// `size` candidates spread evenly over the problem's free parameters.
pub fn population(problem: &Problem, size: usize) -> Population {
    let free = problem.free();
    // Additive recurrence with the generalised golden ratio: even for any size, and needs no seed.
    let dimension = free.len() as i32;
    let ratio = (0..30).fold(2.0f64, |x, _| {
        (1.0 + x).powf(1.0 / f64::from(dimension + 1))
    });
    let mut population = Population::new(free.len());
    for i in 1..=size {
        let at = |j: usize| (i as f64 / ratio.powi(j as i32 + 1)).fract();
        let candidate: Vec<f64> = free
            .iter()
            .enumerate()
            .map(|(j, parameter)| parameter.from_unit(at(j)))
            .collect();
        population.push(&candidate);
    }
    population
}
