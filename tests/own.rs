//! Effects and costs of a user's own, written outside the crate, on every evaluator.

use crate::common::gpu;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::diagnose::{Cut, IdentificationProblem, Options, Verdict, identify};
use servobee::evaluate::gpu::Checks;
use servobee::evaluate::problem::{Data, Sample, Series};
use servobee::evaluate::{
    CpuEvaluator, Evaluator, Loss, Population, Precision, Problem, reference, wgsl,
};
use servobee::model::effects::{
    Act, CATALOGUE, Effect, Entry, Law, Port, Scale, entry, known, register,
};
use servobee::model::valve::ValveForm;
use servobee::model::{
    Complete, Hold, Input, Output, Outputs, Pace, Parameter, Real, ServoValve, Structure,
};
use servobee::record::{self, Channel, Record};
use servobee::report::ModelFile;
use servobee::search::{Plan, refine};
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// What the catalogue's null_bias does, written by somebody else.
struct Bias<R>(R);

impl<R: Real> Act<R> for Bias<R> {
    fn command(&self, _own: &mut [R], command: R) -> R {
        command + self.0
    }
}

struct BiasLaw;

impl Law for BiasLaw {
    type Act<R: Real> = Bias<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Bias<R> {
        Bias(next())
    }
}

/// A command that is bent, with a memory of the last one: a law with a state.
struct Bent<R> {
    bend: R,
    rest: R,
}

impl<R: Real> Act<R> for Bent<R> {
    fn command(&self, own: &mut [R], command: R) -> R {
        let changed = command - own[0];
        own[0] = command;
        command + self.bend * command * command.abs() + self.rest * changed
    }
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
    }
}

struct BentLaw;

impl Law for BentLaw {
    type Act<R: Real> = Bent<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Bent<R> {
        Bent {
            bend: next(),
            rest: next(),
        }
    }
}

fn described(
    name: &'static str,
    parameters: fn(&Scale, Option<servobee::model::Output>) -> Vec<Parameter>,
) -> Entry {
    Entry {
        name,
        port: Port::Command,
        summary: "of a test",
        equation: "",
        finding: "bend the command",
        shows: "",
        confused: "",
        source: "",
        parameters,
        trials: |_, _| vec![vec![0.1]],
        imitated_by: &[],
        states: &[],
        neutral: &[],
        applies: |_| true,
        outputs: None,
        view: None,
        frequency: None,
    }
}

fn own_bias() -> Effect {
    static ONCE: std::sync::OnceLock<&'static Entry> = std::sync::OnceLock::new();
    let entry = ONCE.get_or_init(|| {
        let parameters = |scale: &Scale, _| {
            vec![Parameter::linear(
                "own_bias",
                &scale.command_unit,
                -0.1 * scale.command,
                0.0,
                0.1 * scale.command,
            )]
        };
        register::<BiasLaw>(described("own_bias", parameters)).unwrap()
    });
    Effect {
        entry,
        output: None,
    }
}

fn bent() -> Effect {
    static ONCE: std::sync::OnceLock<&'static Entry> = std::sync::OnceLock::new();
    let entry = ONCE.get_or_init(|| {
        let parameters = |_: &Scale, _| {
            vec![
                Parameter::linear("bend", "1", -0.1, 0.0, 0.1),
                Parameter::linear("rest", "1", -0.5, 0.0, 0.5),
            ]
        };
        register::<BentLaw>(Entry {
            states: &["last"],
            ..described("bent", parameters)
        })
        .unwrap()
    });
    Effect {
        entry,
        output: None,
    }
}

fn structure(effect: Effect, hold: Hold) -> Structure {
    Structure {
        hold,
        ..Structure::actuator(10.0, "V")
    }
    .with(effect)
}

/// Steps and ramps, answered by the structure with these values.
fn problem(structure: &Structure, values: &[(&str, f64)]) -> Problem {
    let mut parameters = structure.parameters();
    for (name, value) in values {
        parameters
            .iter_mut()
            .find(|p| p.name == *name)
            .unwrap()
            .set_nominal(*value);
    }
    let sample = |k: usize| Sample {
        input: Input {
            command: [0.0, 6.0, -3.0, 8.0, 1.0][k / 60 % 5] + 0.02 * (k % 60) as f64,
            time: 1e-3 * k as f64,
            ..Input::default()
        },
        weight: 1.0,
        ..Sample::default()
    };
    let mut series = Series {
        name: "own".into(),
        measured: Outputs::all(true),
        time: (0..600).map(|k| 1e-3 * k as f64).collect(),
        samples: (0..600).map(sample).collect(),
    };
    series.set_steps(structure.fastest_rate(&parameters), 1);
    let start = Complete::nominal(&parameters);
    let simulated = reference::trajectories(structure, &start, std::slice::from_ref(&series));
    for (sample, outputs) in series.samples.iter_mut().zip(&simulated[0]) {
        sample.target = *outputs;
    }
    Problem::new(structure.clone(), parameters, Data::Series(vec![series]))
}

fn candidates(problem: &Problem, count: usize) -> Population {
    let free = problem.free();
    let mut population = Population::new(free.len());
    for i in 0..count {
        let share = |j: usize| ((i * 7 + j * 3) % 11) as f64 / 10.0 - 0.5;
        let near = |(j, p): (usize, &Parameter)| {
            let width = 0.2 * (p.high - p.low).min(p.nominal().abs().max(0.1));
            p.clamp(p.nominal() + width * share(j))
        };
        population.push(&free.iter().enumerate().map(near).collect::<Vec<f64>>());
    }
    population
}

/// The costs of a population on every evaluator; the GPU's only where there is one.
fn costs(problem: &Problem, population: &Population) -> Vec<(String, Vec<f64>)> {
    let mut evaluators: Vec<(String, Box<dyn Evaluator>)> = vec![
        ("f64".into(), Box::new(CpuEvaluator::new(Precision::F64))),
        ("f32".into(), Box::new(CpuEvaluator::new(Precision::F32))),
    ];
    if let Some(gpu) = gpu(Checks::Off) {
        evaluators.push(("GPU".into(), Box::new(gpu)));
    }
    let all = |(name, mut evaluator): (String, Box<dyn Evaluator>)| {
        let costs = evaluator.costs(problem, population).unwrap();
        (name, costs.iter().map(|cost| cost.value).collect())
    };
    evaluators.into_iter().map(all).collect()
}

fn assert_equal_on_all(problem: &Problem, tolerance: f64) {
    let population = candidates(problem, 70);
    let all = costs(problem, &population);
    let truth: Vec<f64> = (0..population.len())
        .map(|i| reference::cost(problem, population.candidate(i)).unwrap())
        .collect();
    for (name, costs) in &all {
        let worst = costs
            .iter()
            .zip(&truth)
            .map(|(cost, truth)| (cost / truth - 1.0).abs())
            .fold(0.0, f64::max);
        println!("{name}: worst relative difference {worst:.1e}");
        assert!(worst < tolerance, "{name}: {worst}");
    }
}

#[test]
fn an_own_effect_is_what_the_catalogues_is() {
    for hold in [Hold::Held, Hold::Interpolated] {
        let values = [
            ("gain", 200.0),
            ("time_constant", 0.004),
            ("saturation", 2.0),
        ];
        let own = problem(
            &structure(own_bias(), hold),
            &[&values[..], &[("own_bias", 0.3)]].concat(),
        );
        let theirs: Effect = "null_bias".parse().unwrap();
        let theirs = problem(
            &structure(theirs, hold),
            &[&values[..], &[("null_bias", 0.3)]].concat(),
        );
        assert_eq!(own.data, theirs.data);
        let population = candidates(&own, 50);
        for ((name, own), (_, theirs)) in costs(&own, &population)
            .iter()
            .zip(costs(&theirs, &population))
        {
            assert_eq!(*own, theirs, "on {name}");
        }
        assert_equal_on_all(&own, 2e-4);
    }
}

#[test]
fn an_own_effect_with_a_state_is_fitted_and_written() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.004),
        ("saturation", 2.0),
    ];
    let planted = [("bend", 0.02), ("rest", -0.2)];
    let structure = structure(bent(), Hold::Held);
    let problem = problem(&structure, &[&values[..], &planted].concat());
    assert_equal_on_all(&problem, 2e-4);

    let start: Vec<f64> = problem.start().iter().map(|value| 0.8 * value).collect();
    let fit = refine(&problem, &start, &Plan::of_records(1)).unwrap();
    for (parameter, value) in fit.free.iter().zip(fit.values()) {
        assert!(
            (value / parameter.nominal() - 1.0).abs() < 1e-6,
            "{}: {value}",
            parameter.name
        );
    }
    let all = Complete::nominal(&problem.parameters);
    let text = ModelFile::to_toml(&structure, &problem.parameters, &all);
    let read = ModelFile::parse("model.toml", &text)
        .unwrap()
        .complete_structure()
        .unwrap();
    assert_eq!(read, structure);
}

/// The refusal of an entry.
fn refused(entry: Entry) -> String {
    let error = register::<BiasLaw>(entry).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

#[test]
fn a_name_that_no_shader_can_have_is_refused() {
    let parameter: fn(&Scale, _) -> _ = |_, _| vec![Parameter::linear("loop", "V", 0.0, 0.0, 1.0)];
    let of_parameter = described("looping", parameter);
    let of_state = Entry {
        states: &["loop"],
        ..described("looping", |_, _| Vec::new())
    };
    for entry in [of_parameter, of_state] {
        let error = refused(entry);
        assert!(
            error.contains("\"loop\"") && error.contains("no keyword of WGSL"),
            "{error}"
        );
    }
    assert!(entry("looping").is_none());
}

#[test]
fn a_name_is_taken_once() {
    own_bias();
    let parameters = |_: &Scale, _| Vec::new();
    for name in ["own_bias", "null_bias"] {
        let error = refused(described(name, parameters));
        assert!(error.contains("already"), "{error}");
    }
    assert!(entry("own_bias").is_some() && entry("nobody_s").is_none());
}

#[test]
fn a_parameter_has_a_name_of_its_own() {
    own_bias();
    let with = |parameters| described("twin", parameters);
    // Of the base model, of the catalogue, of another of one's own, and on two outputs.
    let everywhere = Entry {
        outputs: Some(|_, _| true),
        view: None,
        frequency: None,
        ..with(|_, _| vec![Parameter::linear("twin", "1", 0.0, 0.0, 1.0)])
    };
    for (entry, name) in [
        (
            with(|_, _| vec![Parameter::linear("gain", "1", 0.0, 0.0, 1.0)]),
            "\"gain\"",
        ),
        (
            with(|_, _| vec![Parameter::linear("sensor_lag_flow", "s", 0.0, 0.0, 1.0)]),
            "\"sensor_lag_flow\"",
        ),
        (
            with(|_, _| vec![Parameter::linear("own_bias", "V", 0.0, 0.0, 1.0)]),
            "\"own_bias\"",
        ),
        (everywhere, "\"twin\""),
    ] {
        let error = refused(entry);
        assert!(error.contains(name), "{error}");
    }
    assert!(entry("twin").is_none());
}

/// A command that comes late, which the loops have to look ahead for.
struct Late<R>(R);

impl<R: Real> Act<R> for Late<R> {
    fn delay(&self) -> Option<R> {
        Some(self.0)
    }
}

struct LateLaw;

impl Law for LateLaw {
    type Act<R: Real> = Late<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Late<R> {
        Late(next())
    }
}

#[test]
fn an_own_delay_is_refused() {
    let parameters: fn(&Scale, _) -> _ = |_, _| vec![Parameter::linear("late", "s", 0.0, 0.0, 0.1)];
    let error = register::<LateLaw>(described("late", parameters)).unwrap_err();
    assert!(error.to_string().contains("delays the command"), "{error}");
    assert!(entry("late").is_none());
}

#[test]
fn integration_steps_follow_an_own_effect_that_is_fast() {
    let rate = |name: &'static str, pace: Option<Pace>| {
        let parameter = Parameter::log(name, "s", 1e-5, 1e-4, 1e-3);
        let base = Structure::actuator(10.0, "V");
        let mut parameters = base.parameters();
        parameters.push(Parameter { pace, ..parameter });
        base.fastest_rate(&parameters)
    };
    let base = rate("slow", None);
    assert!(base < 1e4);
    assert!((rate("own_lag", Some(Pace::TimeConstant)) / 1e5 - 1.0).abs() < 1e-12);
    assert_eq!(rate("own_rate", Some(Pace::Rate)), base);
    let pole = rate("own_delay", Some(Pace::Delay)) * 1e-5;
    assert!((pole - 12.0_f64.sqrt()).abs() < 1e-12);
    // Over the shortest lag of the loop.
    let ratio = rate("own_ratio", Some(Pace::LagRatio)) * 1e-5;
    assert!((ratio * 5e-4 - 1.0).abs() < 1e-12);
}

#[test]
fn more_states_than_a_structure_has_room_for_are_refused() {
    bent();
    let alone = Entry {
        states: &["a", "b", "c", "d", "e", "f", "g"],
        ..described("long", |_, _| Vec::new())
    };
    // Three states on each of three outputs.
    let on_each = Entry {
        states: &["a", "b", "c"],
        outputs: Some(|_, _| true),
        view: None,
        frequency: None,
        ..described("wide", |_, _| Vec::new())
    };
    for entry in [alone, on_each] {
        let error = refused(entry);
        assert!(
            error.contains("states") && error.contains("of the 77"),
            "{error}"
        );
    }
    // With everything that there is nothing panics.
    let full = Structure {
        observed: vec![Output::Spool, Output::Flow, Output::Position],
        base: ServoValve::with(ValveForm::linear()).into(),
        ..Structure::actuator(10.0, "V")
    };
    let all = known().flat_map(|entry| entry.on(&full));
    let full = all.fold(full.clone(), |structure, effect| structure.with(effect));
    assert!((19..=75).contains(&full.states().len()));
    let problem = problem(&full, &[]);
    assert!(reference::cost(&problem, &problem.start()).is_some());
}

/// A current that the amplifier does not give: u - droop · u · |u|.
struct Droop<R>(R);

impl<R: Real> Act<R> for Droop<R> {
    fn command(&self, _own: &mut [R], command: R) -> R {
        command - self.0 * command * command.abs()
    }
}

struct DroopLaw;

impl Law for DroopLaw {
    type Act<R: Real> = Droop<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Droop<R> {
        Droop(next())
    }
}

#[test]
fn a_diagnosis_that_is_given_it_names_it() {
    let own = register::<DroopLaw>(Entry {
        trials: |scale, _| vec![vec![0.1 / scale.command]],
        ..described("droop", |scale, _| {
            let most = 0.5 / scale.command;
            let unit = format!("1/{}", scale.command_unit);
            vec![Parameter::linear("droop", &unit, -most, 0.0, most)]
        })
    })
    .unwrap();
    let effect = Effect {
        entry: own,
        output: None,
    };
    let planted = 0.015;
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.004),
        ("saturation", 3.0),
        ("droop", planted),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut noise = || 0.03 * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>();
    let command = |k: usize| {
        let t = 1e-3 * k as f64;
        let height = [0.0, 6.0, -3.0, 9.0, 1.0, -8.0][k / 150 % 6];
        height + (TAU * (1.0 + t) * t).sin()
    };
    let time: Vec<f64> = (0..4000).map(|k| 1e-3 * k as f64).collect();
    let commanded = record::Series::new("V", (0..4000).map(command).collect());
    let structure = Structure::actuator(10.0, "V").with(effect);
    let mut series = Series::to_simulate(
        &Record::new("own", time.clone(), [(Channel::Command, commanded.clone())]).unwrap(),
        &structure,
    )
    .unwrap();
    series.set_steps(2e4, 1);
    let values = Complete::from_iter(values.map(|(_, value)| value));
    let simulated = reference::trajectories(&structure, &values, &[series]);
    let spool = simulated[0]
        .iter()
        .map(|row| row[Output::Spool] + noise())
        .collect();
    let channels = [
        (Channel::Command, commanded),
        (Channel::Spool, record::Series::new("V", spool)),
    ];
    let record = Record::new("own", time, channels).unwrap();

    let diagnosed = |entries: &[&'static Entry]| {
        let records = std::slice::from_ref(&record);
        let problem = IdentificationProblem::of(records, &[], Cut::default()).unwrap();
        let options = Options::on(&problem.structure, entries, 2);
        let mut evaluator = CpuEvaluator::new(Precision::F32);
        let plan = Plan::of_records(1);
        let mut on = |_: &str| ControlFlow::Continue(());
        identify(problem, &mut evaluator, &plan, &options, &mut on).unwrap()
    };
    let found = diagnosed(&[CATALOGUE, &[own]].concat());
    assert_eq!(found.verdict, Verdict::Found);
    let names: Vec<Effect> = found.added.iter().map(|one| one.effect).collect();
    assert_eq!(names, [effect]);
    assert!(found.asked_all());
    let after = &found.after;
    let place = after
        .problem
        .parameters
        .iter()
        .position(|p| p.name == "droop");
    let value = after.values.as_slice()[place.unwrap()];
    println!("droop {value}, planted {planted}");
    assert!((value / planted - 1.0).abs() < 0.03, "{value}");
    // Nobody has asked for it here.
    let unnamed = diagnosed(&CATALOGUE[..3]);
    assert!(unnamed.considered.iter().all(|one| one.effect != effect));
    assert!(unnamed.added.iter().all(|one| one.effect != effect));
}

/// Huber's loss at twice the noise.
struct Huber;

impl Loss for Huber {
    fn of<R: Real>(error: R, size: R) -> R {
        let limit = R::constant(2.0) * size;
        let large = error.abs();
        let linear = limit * (R::constant(2.0) * large - limit);
        (large - limit).if_positive(linear, error * error)
    }
}

#[test]
fn an_own_cost_is_the_same_everywhere_and_forgives_outliers() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.004),
        ("saturation", 2.0),
    ];
    let mut problem = problem(&Structure::actuator(10.0, "V"), &values);
    let truth = problem.start();
    let Data::Series(mut all) = (*problem.data).clone() else {
        unreachable!("records were made")
    };
    // A little noise, and every thirtieth row is a bad one.
    for (k, sample) in all[0].samples.iter_mut().enumerate() {
        sample.target[Output::Spool] += 0.01 * ((k * 37 % 101) as f64 / 50.0 - 1.0);
        if k % 30 == 7 {
            sample.target[Output::Spool] += 4.0;
        }
    }
    problem.data = Data::Series(all).into();
    problem.scale[Output::Spool] = 0.01f64.powi(-2);
    let huber = problem.clone().with_loss::<Huber>();
    assert_equal_on_all(&huber, 2e-4);

    let off = |problem: &Problem| {
        let fit = refine(problem, &truth, &Plan::of_records(1)).unwrap();
        let errors = fit
            .values()
            .iter()
            .zip(&truth)
            .map(|(a, b)| (a / b - 1.0).abs());
        errors.fold(0.0, f64::max)
    };
    let (squares, robust) = (off(&problem), off(&huber));
    println!("parameters off by {squares:.4} with squares, {robust:.4} with Huber's loss");
    assert!(robust < 0.01 && squares > 5.0 * robust);

    // By hand, at a candidate.
    let candidate: Vec<f64> = truth.iter().map(|value| 1.1 * value).collect();
    let Data::Series(records) = &*huber.data else {
        unreachable!("records were made")
    };
    let all = Complete::from_iter(candidate.clone());
    let simulated = reference::trajectories(&huber.structure, &all, records);
    let by_hand: f64 = records[0]
        .samples
        .iter()
        .zip(&simulated[0])
        .map(|(sample, output)| {
            Huber::of(sample.target[Output::Spool] - output[Output::Spool], 0.01) / 0.01f64.powi(2)
        })
        .sum();
    let cost = reference::cost(&huber, &candidate).unwrap();
    assert!((cost / by_hand - 1.0).abs() < 1e-9, "{cost} {by_hand}");
}

/// An infinite size is no number that a shader can hold, and no cost is one.
#[test]
fn a_channel_that_counts_for_nothing_has_a_finite_size() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.004),
        ("saturation", 2.0),
    ];
    let problem = problem(&Structure::actuator(10.0, "V"), &values);
    let candidate: Vec<f64> = problem.start().iter().map(|value| 1.1 * value).collect();
    for scale in [0.0, 1e-60] {
        let mut huber = problem.clone().with_loss::<Huber>();
        huber.scale = Outputs::all(scale);
        assert!(!wgsl::physics(&huber).contains("inf"), "{scale}");
        let cost = reference::cost(&huber, &candidate).unwrap();
        assert!((0.0..1e-30).contains(&cost), "{scale}: {cost}");
    }
}
