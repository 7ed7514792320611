//! A base model from outside the crate: a flow meter of first order, alone on a bench. It is fitted on the CPU and on the
//! GPU, differentiated, diagnosed and kept in a model file, and nothing but its equations is said of it.

use crate::common::gpu as gpu_with;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::diagnose::{Cut, IdentificationProblem, Options, Verdict, identify};
use servobee::evaluate::gpu::Checks;
use servobee::evaluate::problem::{Data, Problem, Series};
use servobee::evaluate::{Cost, CpuEvaluator, Evaluator, PARITY, Precision, reference, workload};
use servobee::model::base::{
    Base, BaseModel, Equations, OwnBase, Shown, WithEquations, register_base,
};
use servobee::model::declare::Declare;
use servobee::model::effects::{CATALOGUE, Effect, Moment, Stage};
use servobee::model::{
    Complete, Initial, Input, Output, Outputs, Pace, Parameter, Ports, Real, Setting, Structure,
};
use servobee::record::{self, Channel, Record};
use servobee::report::ModelFile;
use servobee::search::Plan;
use std::ops::ControlFlow;
use std::sync::OnceLock;

/// `lag dy/dt + y = gain u`: the flow y that is shown where the voltage u stands for the true flow.
type FlowMeter = MeterOf<false>;

/// The same, or one whose state has a `BAD` name.
#[derive(Default)]
struct MeterOf<const BAD: bool>;

impl<const BAD: bool> BaseModel for MeterOf<BAD> {
    fn name(&self) -> &'static str {
        if BAD { "looping" } else { "flow_meter" }
    }

    fn parts(&self) -> Vec<&'static str> {
        vec!["the lag of the flow meter"]
    }

    fn states(&self, _: &Setting) -> Vec<&'static str> {
        vec![if BAD { "loop" } else { "shown" }]
    }

    fn unit<'a>(&'a self, setting: &Setting<'a>, output: Output) -> &'a str {
        match output {
            Output::Flow => "L/min",
            _ => setting.command_unit,
        }
    }
}

impl<const BAD: bool> WithEquations for MeterOf<BAD> {
    type Equations<R: Real> = Meter<R>;

    fn equations<R: Real>(&self, _: &Setting, parameters: &mut dyn Declare<R>) -> Meter<R> {
        let lag = || Parameter::log("meter_lag", "s", 1e-3, 0.02, 1.0).paced(Pace::TimeConstant);
        Meter {
            gain: parameters
                .parameter(&|| Parameter::linear("meter_gain", "L/min/V", 0.5, 5.0, 20.0)),
            lag: parameters.parameter(&lag),
        }
    }
}

struct Meter<R> {
    gain: R,
    lag: R,
}

impl<R: Real, P: Ports<R>> Equations<R, P> for Meter<R> {
    fn initial(&self, _: &P, state: &mut [R], input: &Input<R>, _: &Outputs<R>, initial: Initial) {
        if initial == Initial::Equilibrium {
            state[0] = self.gain * input.command;
        }
    }

    fn derivative(&self, _: &P, state: &[R], input: &Input<R>, _: &Stage<R>, slope: &mut [R]) {
        slope[0] = (self.gain * input.command - state[0]) / self.lag;
    }

    fn shown(&self, _: &P, state: &[R], input: &Input<R>, _: bool) -> Shown<R> {
        let mut outputs = Outputs::all(R::constant(0.0));
        outputs[Output::Flow] = state[0];
        Shown {
            outputs,
            moment: Moment::of(input),
            spool: input.command,
        }
    }
}

const TRUTH: [f64; 2] = [6.2, 0.035];

/// The meter, registered once in this process.
fn meter() -> Structure {
    static METER: OnceLock<OwnBase> = OnceLock::new();
    let base = *METER.get_or_init(|| register_base::<FlowMeter>().expect("a name of its own"));
    Structure {
        base: Base::Own(base),
        observed: vec![Output::Flow],
        ..Structure::actuator(10.0, "V")
    }
}

/// A record of 3 s at 1 kHz: steps and a sweep, what a meter with these `effects` shows of them, and noise of 0.05 L/min.
fn record(structure: &Structure, values: &Complete<f64>) -> Record {
    let time: Vec<f64> = (0..3000).map(|k| 1e-3 * f64::from(k)).collect();
    let command = |t: &f64| {
        let height = [2.0, 8.0, -4.0, 5.0, -9.0, 0.0][(t / 0.25) as usize % 6];
        0.8 * height + (9.0 * t * (1.0 + t)).sin()
    };
    let command = record::Series::new("V", time.iter().map(command).collect());
    let alone = Record::new("meter", time.clone(), [(Channel::Command, command.clone())]).unwrap();
    let mut series = Series::to_simulate(&alone, structure).unwrap();
    series.set_steps(2e3, 1);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut noise = || 0.05 * (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
    let rows = reference::trajectories(structure, values, &[series]);
    let flow = rows[0].iter().map(|row| row[Output::Flow] + noise());
    let flow = record::Series::new("L/min", flow.collect());
    Record::new(
        "meter",
        time,
        [(Channel::Command, command), (Channel::Flow, flow)],
    )
    .unwrap()
}

fn problem(structure: &Structure) -> Problem {
    let parameters = structure.parameters();
    let mut series =
        Series::from_record(&record(&meter(), &Complete::from_iter(TRUTH)), structure).unwrap();
    series.set_steps(structure.fastest_rate(&parameters), 1);
    Problem::new(structure.clone(), parameters, Data::Series(vec![series]))
}

#[test]
fn a_step_is_the_closed_form() {
    let structure = meter();
    assert_eq!(structure.states(), ["shown"]);
    let time: Vec<f64> = (0..200).map(|k| 1e-3 * f64::from(k)).collect();
    let command = time.iter().map(|&t| if t < 0.05 { 0.0 } else { 1.0 });
    let command = (
        Channel::Command,
        record::Series::new("V", command.collect()),
    );
    let record = Record::new("step", time.clone(), [command]).unwrap();
    let mut series = Series::to_simulate(&record, &structure).unwrap();
    series.set_steps(2e3, 1);
    let rows =
        reference::trajectories(&structure, &Complete::from_iter(TRUTH), &[series]).remove(0);
    for (t, row) in time.iter().zip(rows) {
        let expected = match *t >= 0.05 {
            true => TRUTH[0] * (1.0 - (-(t - 0.05) / TRUTH[1]).exp()),
            false => 0.0,
        };
        assert!((row[Output::Flow] - expected).abs() < 1e-6, "{t}: {row:?}");
    }
}

#[test]
fn every_evaluator_computes_the_same() {
    let bare = meter();
    let mut everything = bare.clone();
    for effect in CATALOGUE.iter().flat_map(|entry| entry.on(&bare)) {
        everything = everything.with(effect);
    }
    println!("{:?} act on a flow meter", everything.effects);
    assert!(everything.effects.len() > 5);
    for structure in [bare, everything] {
        let problem = problem(&structure);
        let population = workload::population(&problem, 200);
        let mut exact = CpuEvaluator::new(Precision::F64);
        let exact = exact.costs(&problem, &population).unwrap();
        let mut single = CpuEvaluator::new(Precision::F32);
        let single = single.costs(&problem, &population).unwrap();
        let mut pairs = vec![(single.clone(), exact)];
        if let Some(mut gpu) = gpu_with(Checks::On) {
            pairs.push((gpu.costs(&problem, &population).unwrap(), single));
        }
        for (found, expected) in pairs {
            let apart = |(a, b): (&Cost, &Cost)| (a.value / b.value - 1.0).abs();
            let mut apart: Vec<f64> = found.iter().zip(&expected).map(apart).collect();
            apart.sort_by(f64::total_cmp);
            let [most, worst] = [0.9, 1.0].map(|share| apart[(share * 199.0) as usize]);
            println!("90 % within {most:.1e}, all within {worst:.1e}");
            // The phase of a line of hundreds of hertz is rounded in f32.
            assert!(
                most < 10.0 * PARITY && worst < 1e-2,
                "{most:.1e} {worst:.1e}"
            );
        }
    }
}

#[test]
fn it_is_identified_and_what_it_lacks_is_named() {
    let diagnosed = |structure: &Structure, values: &Complete<f64>| {
        let records = [record(structure, values)];
        let structure = meter();
        let parameters = structure.parameters();
        let question =
            IdentificationProblem::new(structure, parameters, &records, &[], Cut::default());
        let question = question.unwrap();
        let options = Options::on(&question.structure, CATALOGUE, 2);
        let mut evaluator = CpuEvaluator::new(Precision::F32);
        let mut on = |_: &str| ControlFlow::Continue(());
        identify(
            question,
            &mut evaluator,
            &Plan::of_records(1),
            &options,
            &mut on,
        )
        .unwrap()
    };
    let whole = diagnosed(&meter(), &Complete::from_iter(TRUTH));
    assert_eq!(whole.verdict, Verdict::None);
    for (found, planted) in whole.after.values.as_slice().iter().zip(TRUTH) {
        assert!(
            (found / planted - 1.0).abs() < 0.01,
            "{found} for {planted}"
        );
    }
    let late: Effect = "delay".parse().unwrap();
    let lacking = diagnosed(
        &meter().with(late),
        &Complete::from_iter([TRUTH[0], TRUTH[1], 0.0123]),
    );
    assert_eq!(lacking.verdict, Verdict::Found);
    let names: Vec<Effect> = lacking.added.iter().map(|one| one.effect).collect();
    assert_eq!(names, [late]);
    let delay = lacking.after.values.as_slice().last().unwrap();
    assert!((delay / 0.0123 - 1.0).abs() < 0.05, "{delay}");
}

#[test]
fn a_model_file_keeps_it() {
    let structure = meter();
    let text = ModelFile::to_toml(
        &structure,
        &structure.parameters(),
        &Complete::from_iter(TRUTH),
    );
    assert!(text.contains("base = \"flow_meter\""), "{text}");
    let file = ModelFile::parse("model.toml", &text).unwrap();
    assert_eq!(file.complete_structure().unwrap(), structure);
    let unknown = text.replace("flow_meter", "water_meter");
    let error = ModelFile::parse("model.toml", &unknown)
        .and_then(|file| file.complete_structure())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("there is no base model \"water_meter\""),
        "{error}"
    );
}

#[test]
fn what_belongs_to_a_servo_valve_is_refused_where_it_is_none() {
    let structure = meter();
    let text = ModelFile::to_toml(
        &structure,
        &structure.parameters(),
        &Complete::from_iter(TRUTH),
    );
    for own in [
        "drive = \"direct\"",
        "spool_unit = \"mm\"",
        "valve = { area = \"linear\" }",
    ] {
        let base = "base = \"flow_meter\"\n";
        let mixed = text.replace(base, &format!("{base}{own}\n"));
        let mixed = match own.starts_with("drive") {
            true => mixed.replace("drive = \"actuator\"\n", ""),
            false => mixed,
        };
        let error = ModelFile::parse("model.toml", &mixed)
            .and_then(|file| file.complete_structure())
            .unwrap_err()
            .to_string();
        let says = error.contains("of a servo valve") && error.contains("leave them out");
        assert!(says, "{own}: {error}");
    }
}

#[test]
fn a_state_with_a_name_that_no_shader_can_have_is_refused() {
    let error = register_base::<MeterOf<true>>().unwrap_err().to_string();
    assert!(
        error.contains("\"loop\"") && error.contains("no keyword of WGSL"),
        "{error}"
    );
    assert!(Base::named("looping").is_none());
}

#[test]
fn a_name_that_is_taken_is_refused() {
    meter();
    let error = register_base::<FlowMeter>().unwrap_err().to_string();
    assert!(
        error.contains("flow_meter") && error.contains("another name"),
        "{error}"
    );
}
