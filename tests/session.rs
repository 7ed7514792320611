//! The way from records to a page, as a program of a user's own goes it.

use crate::program::{BENCH, printed, servobee, whole_bench};
use serde_json::Value;
use servobee::Session;
use servobee::diagnose::Cut;
use servobee::evaluate::{
    Chosen, Cost, CpuEvaluator, Evaluator, Job, Loss, OwnLoss, Precision, choose,
};
use servobee::model::Real;
use servobee::record::{Channel, Record, Series};
use servobee::session::{Datasheet, effects_named};
use servobee::simulator::Setup;
use std::ops::ControlFlow;
use std::path::Path;

fn on(_: &str) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A report without what differs from run to run, and from call to call.
fn lasting(text: &str) -> Value {
    let mut document: Value = serde_json::from_str(text).unwrap();
    for field in ["seconds", "date", "arguments", "records"] {
        document.as_object_mut().unwrap().remove(field);
    }
    document
}

#[test]
fn a_session_and_the_command_come_to_the_same_report() {
    let folder = whole_bench();
    let json = printed(&servobee(
        folder.path(),
        &[
            "identify",
            "bench.csv",
            "--evaluator",
            "cpu",
            "--effects",
            "delay,null_bias",
            "--json",
        ],
    ));
    let session = Session {
        effects: effects_named("delay,null_bias").unwrap(),
        ..Session::default()
    };
    let records = session.read(&[BENCH]).unwrap();
    let mut chosen = choose(servobee::evaluate::Choice::Cpu).unwrap();
    let diagnosed = session
        .identify(&records, &[], &mut chosen, &mut on)
        .unwrap();
    assert_eq!(lasting(&diagnosed.document.to_json()), lasting(&json));
    assert_eq!(diagnosed.document.effect_names(), ["delay"]);

    let out = folder.path().join("own");
    diagnosed.write(&out, false).unwrap();
    for name in crate::program::RESULTS {
        assert!(out.join(name).is_file(), "{name}");
    }
    let again = diagnosed.write(&out, false).unwrap_err();
    assert!(again.to_string().contains("exists"), "{again}");
}

#[test]
fn a_record_without_a_response_is_refused_wherever_it_comes_from() {
    let ramp = |n: usize| (0..n).map(|k| k as f64).collect::<Vec<f64>>();
    let time = ramp(50).iter().map(|t| 0.001 * t).collect();
    let command = Series::new("V", ramp(50));
    let record = Record::new("bare", time, [(Channel::Command, command)]).unwrap();
    let error = Session::default().prepare(&[record], &[]).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("bare"), "{error}");
}

/// Huber's loss: beyond twice the noise an error costs no more than its size.
struct Huber;

impl Loss for Huber {
    fn of<R: Real>(error: R, size: R) -> R {
        let limit = R::constant(2.0) * size;
        let large = error.abs();
        let linear = limit * (R::constant(2.0) * large - limit);
        (large - limit).if_positive(linear, error * error)
    }
}

/// A record in which the converter of the spool drops out now and then: the value is that of full scale.
fn with_dropouts(setup: &Setup) -> Record {
    let record = setup.record().unwrap();
    let mut channels: Vec<(Channel, Series)> = record
        .channels()
        .map(|(channel, series)| (channel, series.clone()))
        .collect();
    for (channel, series) in &mut channels {
        if *channel == Channel::Spool {
            series
                .values
                .iter_mut()
                .skip(40)
                .step_by(83)
                .for_each(|value| *value = 10.0);
        }
    }
    Record::new("dropouts", record.time().to_vec(), channels).unwrap()
}

#[test]
fn a_diagnosis_follows_a_loss_of_ones_own() {
    let setup = Setup {
        seconds: 4.0,
        flow: false,
        ..Setup::default()
    };
    let records = [with_dropouts(&setup)];
    let off = |loss: Option<OwnLoss>| {
        let session = Session {
            loss,
            effects: Vec::new(),
            ..Session::default()
        };
        let mut chosen = choose(servobee::evaluate::Choice::Cpu).unwrap();
        let diagnosed = session
            .identify(&records, &[], &mut chosen, &mut on)
            .unwrap();
        let document = diagnosed.document;
        let said = document.warnings.iter().any(|one| one.contains("Huber"));
        assert_eq!(said, loss.is_some(), "{:?}", document.warnings);
        let named = |name: &str| document.parameters.iter().find(|one| one.name == name);
        let gain = named("gain").unwrap().value;
        (gain / setup.valve.gain - 1.0).abs()
    };
    let [squares, huber] = [off(None), off(Some(OwnLoss::of::<Huber>()))];
    println!("gain off by {squares} with squares, by {huber} with Huber's loss");
    assert!(huber < 0.5 * squares && huber < 0.02);
}

/// An evaluator whose costs are those of another candidate.
struct Shifted;

impl Evaluator for Shifted {
    fn describe(&self) -> String {
        "shifted".into()
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> servobee::Result<Vec<Vec<Cost>>> {
        let mut costs = CpuEvaluator::new(Precision::F32).costs_of(jobs)?;
        costs.iter_mut().for_each(|costs| costs.rotate_right(1));
        Ok(costs)
    }
}

#[test]
fn an_evaluator_of_ones_own_that_is_wrong_is_named_and_another_takes_over() {
    let session = Session {
        effects: Vec::new(),
        ..Session::default()
    };
    let records = session.read(&[Path::new(BENCH)]).unwrap();
    let mut chosen = Chosen::own("the shifted one", Shifted).unwrap();
    let diagnosed = session
        .identify(&records, &[], &mut chosen, &mut on)
        .unwrap();
    let document = diagnosed.document;
    assert!(
        document.warnings.iter().any(|one| one.contains("shifted")),
        "{:?}",
        document.warnings
    );
    assert!(document.evaluator.contains("CPU"), "{}", document.evaluator);
}

#[test]
fn effects_of_a_long_record_are_chosen_by_stretches_and_fitted_to_all() {
    let rows = 60_000;
    let setup = Setup {
        seconds: rows as f64 * 1e-3,
        flow: false,
        planted: vec!["null_bias=0.1".parse().unwrap()],
        ..Setup::default()
    };
    let session = Session {
        effects: effects_named("null_bias,delay").unwrap(),
        ..Session::default()
    };
    let mut chosen = choose(servobee::evaluate::Choice::Cpu).unwrap();
    let diagnosed = session
        .identify(&[setup.record().unwrap()], &[], &mut chosen, &mut on)
        .unwrap();
    let document = diagnosed.document;
    // What README says of its side: 20 000 of 42 000 fitted rows, and all of the 18 000 that are held out.
    let readme = include_str!("../README.md").replace("\n  ", " ");
    assert!(readme.contains("Effects are chosen by stretches of about 20 000 rows a side"));
    let [warning] = &document.warnings[..] else {
        panic!("{:?}", document.warnings);
    };
    let words = format!("effects are chosen by 38000 of {rows} rows, stretches all along");
    assert!(warning.starts_with(&words), "{warning}");
    assert_eq!(document.effect_names(), ["null_bias"]);
    let used = &document.records[0];
    assert_eq!((used.fitted, used.held_out), (42_000, 18_000));
    // The noise is 0.03 V, and an offset of white noise is known to so much of as many rows.
    let bias = document
        .parameters
        .iter()
        .find(|one| one.name == "null_bias");
    let known_to = |rows: f64| 2.0 * 1.96 * 0.03 / rows.sqrt();
    let width = bias.map(|bias| bias.high - bias.low).unwrap();
    println!("{width:e} V; {:e} of the stretches", known_to(20e3));
    assert!(width < 0.9 * known_to(20e3), "{width}");
}

#[test]
fn numbers_that_no_record_can_be_cut_or_scaled_by_are_refused() {
    let cut = |hold_out, rows| Session {
        cut: Cut { hold_out, rows },
        ..Session::default()
    };
    let scaled = |full_scale| Session {
        full_scale: Some(full_scale),
        ..Session::default()
    };
    for (session, words) in [
        (
            cut(2.0, 5000),
            "--hold-out-share: is 2; give a number from 0.05 to 0.9",
        ),
        (cut(f64::NAN, 5000), "--hold-out-share: is NaN"),
        (
            cut(0.3, 10),
            "--max-rows: is 10; give a whole number from 1000 on",
        ),
        (scaled(0.0), "--full-scale: is 0; give a number above zero"),
        (scaled(f64::INFINITY), "--full-scale: is inf"),
    ] {
        let error = session.check().unwrap_err().to_string();
        assert!(error.starts_with(words), "{error}");
    }
    for (drop, amplitude, words) in [
        (500.0, None, "--drop: is 500; give a number from 1 to 400"),
        (
            10.0,
            Some(0.0),
            "--amplitude: is 0; give a number above 0, at most 100",
        ),
    ] {
        let sheet = Datasheet {
            drop,
            amplitude,
            ..Datasheet::default()
        };
        let error = sheet.prepare().unwrap_err().to_string();
        assert_eq!(error, words);
    }
}
