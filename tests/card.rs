//! The valve card against closed forms, and its intervals against how often they hold.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::card::{Accuracy, Card, Figure, Measured};
use servobee::evaluate::problem::{Data, Sample, Series as Rows, Stream};
use servobee::evaluate::reference;
use servobee::evaluate::{Memory, Problem};
use servobee::model::valve::{Drop, Meter, ValveForm};
use servobee::model::{Complete, Hold, Input, Output, Outputs, ServoValve, Structure};
use servobee::record::{Channel, FlowCurve, Record, Series};
use servobee::search::datasheet::{Case, Sheet};
use servobee::search::{Plan, refine};
use std::f64::consts::{PI, TAU};

const FULL: f64 = 10.0;

fn actuator() -> Structure {
    Structure::actuator(FULL, "V")
}

/// Spool and flow of a valve at 70 bar.
fn valve(effects: &[&str]) -> Structure {
    Structure {
        observed: vec![Output::Spool, Output::Flow],
        effects: effects.iter().map(|name| name.parse().unwrap()).collect(),
        base: ServoValve::with(ValveForm {
            drop: Drop::Supply,
            meter: match effects.contains(&"leakage") {
                true => Meter::Supply,
                false => Meter::Load,
            },
            ..ValveForm::linear()
        })
        .into(),
        ..actuator()
    }
}

/// Steps of many heights, answered by the structure with these values and noise of this share of full scale.
fn problem(structure: &Structure, values: &[(&str, f64)], noise: f64, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut parameters = structure.parameters();
    for (name, value) in values {
        let parameter = parameters.iter_mut().find(|p| p.name == *name);
        let parameter = parameter.unwrap_or_else(|| panic!("there is a parameter {name}"));
        parameter.set_nominal(*value);
        (parameter.low, parameter.high) = (parameter.low.min(*value), parameter.high.max(*value));
    }
    let mut height = 0.0;
    let mut row = |k: usize| {
        if k.is_multiple_of(40) {
            height = FULL * random.random_range(-0.9..0.9);
        }
        Sample {
            input: Input {
                command: height,
                supply: 70.0,
                temperature: 40.0,
                time: 1e-3 * k as f64,
                ..Input::default()
            },
            weight: 1.0,
            ..Sample::default()
        }
    };
    let mut series = Rows {
        name: "steps".into(),
        measured: Outputs::all(true),
        samples: (0..2000).map(&mut row).collect(),
        time: (0..2000).map(|k| 1e-3 * k as f64).collect(),
    };
    series.set_steps(structure.fastest_rate(&parameters), 1);
    let start = Complete::nominal(&parameters);
    let simulated = reference::trajectories(structure, &start, std::slice::from_ref(&series));
    // A sum of twelve uniform numbers is near enough to a normal one.
    let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    for (sample, outputs) in series.samples.iter_mut().zip(&simulated[0]) {
        let noisy = |output| output + noise * FULL * normal();
        sample.target = Outputs(outputs.0.map(noisy));
    }
    Problem::new(structure.clone(), parameters, Data::Series(vec![series]))
}

fn card(structure: &Structure, values: &[(&str, f64)], noise: f64, seed: u64) -> Card {
    let problem = problem(structure, values, noise, seed);
    let plan = Plan {
        coloured: false,
        memory: Memory::default(),
        ..Plan::of_records(1)
    };
    let fit = refine(&problem, &problem.start(), &plan).unwrap();
    Card::of(&problem, &fit)
}

fn value(card: &Card, name: &str) -> f64 {
    let figure = card
        .figures
        .iter()
        .find(|figure| figure.quantity.to_string() == name)
        .unwrap();
    figure
        .value
        .unwrap_or_else(|| panic!("{name} has no value: {}", figure.note))
}

fn assert_near(card: &Card, name: &str, expected: f64, tolerance: f64) {
    let value = value(card, name);
    println!("{name}: {value} for {expected}");
    assert!(
        (value - expected).abs() <= tolerance,
        "{name} is {value}, not {expected}"
    );
}

/// Frequency (Hz) at which K/(T s² + s + K) has fallen by 3 dB.
fn third(gain: f64, lag: f64) -> f64 {
    // (K − T w)² + w = 2 K² in w = ω².
    let (a, b, c) = (lag * lag, 1.0 - 2.0 * gain * lag, -gain * gain);
    ((-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt() / TAU
}

#[test]
fn an_unsaturated_loop_has_the_limits_of_a_second_order_system() {
    for (gain, lag) in [(200.0, 0.002), (150.0, 0.006), (377.0, 0.002)] {
        let values = [("gain", gain), ("time_constant", lag), ("saturation", 20.0)];
        let card = card(&actuator(), &values, 0.0, 1);
        for amplitude in [5, 25, 90] {
            let natural = (gain / lag).sqrt() / TAU;
            assert_near(
                &card,
                &format!("phase_limit_{amplitude}"),
                natural,
                2e-3 * natural,
            );
            let third = third(gain, lag);
            assert_near(
                &card,
                &format!("amplitude_limit_{amplitude}"),
                third,
                2e-3 * third,
            );
        }
        let damping = 0.5 / (gain * lag).sqrt();
        let overshoot = match damping < 1.0 {
            true => 100.0 * (-PI * damping / (1.0 - damping * damping).sqrt()).exp(),
            false => 0.0,
        };
        assert_near(&card, "overshoot", overshoot, 0.02);
        assert_near(&card, "null_bias", 0.0, 1e-6);
        assert_near(&card, "hysteresis", 0.0, 1e-3);
    }
}

#[test]
fn a_saturated_step_takes_the_time_of_its_slew() {
    // The lag is short: the spool follows the integrator, which slews at K S.
    let values = [
        ("gain", 1000.0),
        ("time_constant", 5e-4),
        ("saturation", 0.1),
    ];
    let card = card(&actuator(), &values, 0.0, 1);
    let slew = 1e3 * 0.9 * FULL / (1000.0 * 0.1);
    assert_near(&card, "step_time", slew + 0.5, 0.05);
    // A triangle of the same slew begins to fall behind a sine where A ω exceeds K S.
    let begin = 1000.0 * 0.1 / (0.9 * FULL) / TAU;
    let limit = value(&card, "amplitude_limit_90");
    assert!(
        (begin..3.0 * begin).contains(&limit),
        "{limit} Hz, slewing from {begin} Hz"
    );
    assert!(value(&card, "amplitude_limit_5") > 5.0 * limit);
}

#[test]
fn the_flow_curve_shows_what_is_planted() {
    let base = [
        ("gain", 200.0),
        ("time_constant", 0.003),
        ("saturation", 3.0),
        ("max_area", 0.5),
    ];
    let planted = |effects: &[&str], values: &[(&str, f64)]| {
        card(&valve(effects), &[&base, values].concat(), 0.0, 1)
    };
    let plain = planted(&[], &[]);
    let rated = 0.7 * 0.5e-4 * (2.0 / 850.0 * 35e5f64).sqrt() * 6e4;
    assert_near(&plain, "rated_flow", rated, 1e-4 * rated);
    assert_near(&plain, "flow_gain", rated / FULL, 1e-4 * rated / FULL);
    for (name, tolerance) in [("overlap", 1e-4), ("asymmetry", 1e-4), ("hysteresis", 1e-3)] {
        assert_near(&plain, name, 0.0, tolerance);
    }
    let leakage = plain
        .figures
        .iter()
        .find(|figure| figure.quantity.to_string() == "leakage")
        .unwrap();
    assert_eq!(leakage.value, None, "nothing that leaks was fitted");

    assert_near(
        &planted(&["overlap"], &[("overlap", 3.0)]),
        "overlap",
        3.0,
        1e-3,
    );
    assert_near(
        &planted(&["hysteresis"], &[("hysteresis", 0.1)]),
        "hysteresis",
        2.0,
        0.02,
    );
    // A bias is taken back by the command that is its negative.
    assert_near(
        &planted(&["null_bias"], &[("null_bias", 0.3)]),
        "null_bias",
        -3.0,
        1e-3,
    );
    let asymmetric = planted(&["asymmetric_gain"], &[("asymmetric_gain", 0.1)]);
    assert_near(&asymmetric, "asymmetry", 100.0 * 0.2 / 1.1, 0.01);
    let leaking = planted(&["leakage"], &[("leakage", 2.0), ("leakage_width", 3.0)]);
    assert_near(&leaking, "leakage", 2.0, 0.02);
    // What leaks passes no load.
    assert_near(&leaking, "rated_flow", rated, 1e-4 * rated);
    assert_near(&leaking, "null_bias", 0.0, 1e-3);
    let late = planted(&["delay"], &[("delay", 0.005)]);
    assert_near(&late, "step_time", value(&plain, "step_time") + 5.0, 0.05);
    // The sensor's lag is no property of the valve.
    let lagging = planted(&["sensor_lag.spool"], &[("sensor_lag_spool", 0.004)]);
    let natural = value(&plain, "phase_limit_5");
    assert_near(&lagging, "phase_limit_5", natural, 1e-3 * natural);
}

#[test]
fn intervals_hold_what_they_promise() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.003),
        ("saturation", 2.0),
    ];
    let truth = card(&actuator(), &values, 0.0, 1);
    let names = ["phase_limit_5", "amplitude_limit_90", "step_time"];
    let mut held = [0; 3];
    let runs = 60;
    for seed in 1..=runs {
        let card = card(&actuator(), &values, 0.02, seed);
        for (name, held) in names.iter().zip(&mut held) {
            let figure = card
                .figures
                .iter()
                .find(|figure| figure.quantity.to_string() == *name)
                .unwrap();
            let (low, high) = (figure.low.unwrap(), figure.high.unwrap());
            assert!(low < high, "{name}: {low} .. {high}");
            *held += i32::from((low..=high).contains(&value(&truth, name)));
        }
    }
    println!("of {runs} intervals of 95 %, {names:?} held {held:?}");
    // 57 are expected; fewer than 52 or none missed in 180 are chances below one in a hundred.
    assert!(held.iter().all(|&held| held >= 52), "{held:?}");
    assert!(held.iter().sum::<i32>() < 3 * runs as i32, "{held:?}");
}

fn figure<'c>(card: &'c Card, name: &str) -> &'c Figure {
    card.figures
        .iter()
        .find(|one| one.quantity.to_string() == name)
        .unwrap()
}

#[test]
fn what_the_model_does_not_have_is_no_measured_zero() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.001),
        ("saturation", 3.0),
        ("max_area", 0.5),
    ];
    let plain = card(&valve(&[]), &values, 0.01, 1);
    for name in ["overlap", "asymmetry", "hysteresis", "null_bias"] {
        let figure = figure(&plain, name);
        assert_eq!(
            (figure.value, figure.low, figure.high),
            (Some(0.0), None, None)
        );
        assert_eq!(figure.no_interval, Some("the model has none"), "{name}");
    }
    let rated = figure(&plain, "rated_flow");
    assert_eq!(rated.label, "rated flow at 70 bar");
    assert!(rated.low < rated.value && rated.value < rated.high);
    assert_eq!(rated.no_interval, None);
    // A loop that is damped well does not overshoot: that is measured.
    let overshoot = figure(&plain, "overshoot");
    assert_eq!(
        [overshoot.value, overshoot.low, overshoot.high],
        [Some(0.0); 3]
    );

    let biased = [&values[..], &[("null_bias", 0.3)]].concat();
    let null = figure(&card(&valve(&["null_bias"]), &biased, 0.01, 1), "null_bias").clone();
    assert!(null.low < null.value && null.value < null.high && null.no_interval.is_none());

    // What an unexplained record leaves open is in no interval.
    let open = rated.clone().without_interval();
    assert_eq!((open.value, open.low, open.high), (rated.value, None, None));
    assert_eq!(open.no_interval, Some("the model is incomplete"));
    let zero = figure(&plain, "overlap").clone().without_interval();
    assert_eq!(zero.no_interval, Some("the model has none"));
}

#[test]
fn a_figure_that_the_data_do_not_determine_has_no_value() {
    // Steps of up to 9 V never reach a saturation of 19 V.
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.003),
        ("saturation", 19.0),
    ];
    let problem = problem(&actuator(), &values, 0.0, 1);
    let fit = |problem: &Problem| {
        let plan = Plan {
            coloured: false,
            memory: Memory::default(),
            ..Plan::of_records(1)
        };
        refine(problem, &problem.start(), &plan).unwrap()
    };
    // Steps of a five-hundredth of that reach none that it could have.
    let mut small = problem.clone();
    let Data::Series(mut all) = (*small.data).clone() else {
        unreachable!("a record")
    };
    for sample in all.iter_mut().flat_map(|one| &mut one.samples) {
        sample.input.command *= 0.002;
        sample.target[Output::Spool] *= 0.002;
    }
    small.data = Data::Series(all).into();
    let [large, small] = [&problem, &small].map(|problem| Card::of(problem, &fit(problem)));
    for name in ["amplitude_limit_90", "phase_limit_90", "step_time"] {
        assert!(figure(&large, name).value.is_some(), "{name}");
        let open = figure(&small, name);
        println!("{open:?}");
        assert_eq!((open.value, open.low, open.high), (None, None, None));
        assert_eq!(open.note, "this data does not determine it");
    }
}

#[test]
fn a_valve_without_an_actuator_has_the_flow_of_each_command_itself() {
    let openings = [0.0, 25.0, 50.0, 75.0, 100.0];
    let curve = FlowCurve {
        name: "linear".into(),
        opening: openings.to_vec(),
        flow: openings.map(|opening| 0.1 * opening).to_vec(),
        weight: vec![1.0; 5],
        warnings: Vec::new(),
    };
    let problem = Sheet::flow(&curve, 10.0).problem;
    let plan = Plan {
        coloured: false,
        memory: Memory::default(),
        ..Plan::of_records(1)
    };
    let card = Card::of(
        &problem,
        &refine(&problem, &problem.start(), &plan).unwrap(),
    );
    assert_near(&card, "rated_flow", 10.0, 1e-5);
    assert_near(&card, "flow_gain", 0.1, 1e-7);
    for name in ["hysteresis", "overlap", "asymmetry", "null_bias"] {
        assert_near(&card, name, 0.0, 1e-3);
    }
    assert_eq!(value(&card, "hysteresis"), 0.0);
    for [command, flow] in card.cycle.falling.iter().chain(&card.cycle.rising) {
        assert!((flow - 0.1 * command).abs() < 1e-5, "{flow} at {command}");
    }
}

#[test]
fn what_was_not_measured_has_no_value_but_a_reason() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.003),
        ("saturation", 2.0),
    ];
    let card = card(&actuator(), &values, 0.0, 1);
    for name in ["rated_flow", "flow_gain", "overlap", "asymmetry", "leakage"] {
        let figure = card
            .figures
            .iter()
            .find(|figure| figure.quantity.to_string() == name)
            .unwrap();
        assert_eq!((figure.value, figure.low, figure.high), (None, None, None));
        assert_eq!(figure.note, "no flow was measured");
    }
}

#[test]
fn the_threshold_is_what_a_command_turns_back_before_the_output_follows() {
    let base = [
        ("gain", 200.0),
        ("time_constant", 0.003),
        ("saturation", 3.0),
        ("max_area", 0.5),
    ];
    let with = |effect: &str, value: f64| {
        let own = [&base[..], &[(effect, value)]].concat();
        card(&valve(&[effect]), &own, 0.01, 1)
    };
    // A play is passed twice by half its width, a friction overcome in both directions.
    for (effect, value) in [
        ("hysteresis", 0.06),
        ("hysteresis", 0.4),
        ("friction", 0.05),
    ] {
        let card = with(effect, value);
        let expected = 100.0 * 2.0 * value / FULL;
        // What sticks comes to rest anywhere within a step of the command, here of 0.04 %.
        assert_near(&card, "threshold", expected, 0.01 * expected + 0.06);
        let one = figure(&card, "threshold");
        assert!(one.low < one.value && one.value < one.high, "{one:?}");
    }
    for (effect, value) in [("gain_curvature", 0.3), ("overlap", 3.0)] {
        let card = with(effect, value);
        let one = figure(&card, "threshold");
        assert_eq!(
            (one.value, one.no_interval),
            (Some(0.0), Some("the model has none"))
        );
    }
}

#[test]
fn a_threshold_test_stands_beside_the_threshold_of_the_model() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.001),
        ("saturation", 3.0),
        ("max_area", 0.5),
        ("hysteresis", 0.06),
    ];
    let structure = valve(&["hysteresis"]);
    let card = card(&structure, &values, 0.001, 1);
    let time: Vec<f64> = (0..6000).map(|k| 0.02 * f64::from(k)).collect();
    let triangle = |t: &f64| 0.4 * (1.0 - 4.0 * ((t / 20.0).fract() - 0.5).abs());
    let command: Vec<f64> = time.iter().map(triangle).collect();
    let mut spool = 0.0f64;
    let flow = command.iter().map(|u| {
        spool = spool.clamp(u - 0.06, u + 0.06);
        4.0 * spool
    });
    let channels = [
        (Channel::Flow, Series::new("L/min", flow.collect())),
        (
            Channel::SupplyPressure,
            Series::new("bar", vec![70.0; time.len()]),
        ),
        (Channel::Command, Series::new("V", command)),
    ];
    let record = Record::new("threshold", time, channels).unwrap();
    let beside = |accuracy: &str| {
        let accuracy = accuracy.parse().unwrap();
        let measured = Measured::of(&structure, &[&record], &accuracy);
        card.clone().beside(measured, Hold::Held)
    };
    let found = beside("command=1 %");
    let one = figure(&found, "threshold");
    let measured = one.measured.as_ref().unwrap();
    assert!((measured.value - 1.2).abs() < 0.02, "{measured:?}");
    assert!(
        measured.test.contains("10 reversals of 8 %"),
        "{measured:?}"
    );
    assert!(!one.disagrees(), "{one:?}");
    // The gain of the flow meter cancels, a hundredth of the command is a hundredth of the threshold.
    let width = measured.high - measured.low;
    assert!((0.024..0.06).contains(&width), "{measured:?}");
    // In a step and in responses the sensors cancel.
    let (plain, unsure) = (beside("flow=0.001 %"), beside("flow=5 %, command=5 %"));
    for name in [
        "step_time",
        "overshoot",
        "phase_limit_90",
        "amplitude_limit_25",
    ] {
        let [one, other] = [&plain, &unsure].map(|card| figure(card, name));
        assert_eq!((one.low, one.high), (other.low, other.high), "{name}");
    }
}

#[test]
fn the_curves_of_a_datasheet_are_read_beside_the_model() {
    let beside = |sheet: &Sheet| {
        let plan = Plan {
            coloured: false,
            memory: Memory::default(),
            ..Plan::of_records(1)
        };
        let fit = refine(&sheet.problem, &sheet.problem.start(), &plan).unwrap();
        Card::of(&sheet.problem, &fit).beside_sheet(sheet)
    };
    let measured = |card: &Card, name: &str| figure(card, name).measured.clone().unwrap().value;
    let reason = |card: &Card, name: &str| figure(card, name).no_measured.clone().unwrap();
    let near = |found: f64, expected: f64| {
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{found}, not {expected}"
        );
    };
    // A dead zone of 5 %, then 0.4 L/min for each percent: on one side, and on both.
    let opening: Vec<f64> = (0..=20).map(|k| 5.0 * f64::from(k)).collect();
    let lapped = |u: f64| 0.4 * (u.abs() - 5.0).max(0.0) * u.signum();
    let curve = |opening: Vec<f64>| FlowCurve {
        name: "lapped".into(),
        flow: opening.iter().map(|u| lapped(*u)).collect(),
        weight: vec![1.0; opening.len()],
        opening,
        warnings: Vec::new(),
    };
    let one = beside(&Sheet::flow(&curve(opening.clone()), 10.0));
    near(measured(&one, "rated_flow"), 38.0);
    near(measured(&one, "flow_gain"), 0.4);
    near(measured(&one, "overlap"), 5.0);
    assert_eq!(reason(&one, "null_bias"), "the flow curve is of one side");
    assert!(!figure(&one, "rated_flow").disagrees());
    let other = opening.iter().skip(1).rev().map(|u| -u);
    let both = beside(&Sheet::flow(
        &curve(other.chain(opening.clone()).collect()),
        10.0,
    ));
    near(measured(&both, "lap"), 10.0);
    assert!(measured(&both, "null_bias").abs() < 0.01);
    assert!(reason(&both, "hysteresis").contains("two directions"));

    let [two] = &Case::TwoAmplitude.sheets(10.0, Stream::Settled).unwrap()[..] else {
        panic!("one curve");
    };
    let two = beside(two);
    // 43 Hz at 100 % is none of the card's amplitudes.
    assert_eq!(
        reason(&two, "phase_limit_25"),
        "no response at this amplitude was given"
    );
    near(measured(&two, "phase_limit_90"), 43.0);
    assert_eq!(reason(&two, "step_time"), "no step was given");
    assert!(reason(&two, "amplitude_limit_90").contains("does not pass -3 dB"));

    let [step] = &Case::Step.sheets(10.0, Stream::Settled).unwrap()[..] else {
        panic!("one curve");
    };
    let step = beside(step);
    // 90 % of 10.04 on the way from 8.46 at 40 ms to 9.49 at 44 ms, and 10.68 of 10.04.
    let time = measured(&step, "step_time");
    assert!((42.1..42.4).contains(&time), "{time}");
    let beyond = measured(&step, "overshoot");
    assert!((5.5..7.5).contains(&beyond), "{beyond}");
}

/// A slow triangle of three cycles of 40 s on a valve that is drawn by formulas: its flow at 70 bar, measured at
/// a supply pressure that breathes.
fn slow_cycles(flow: impl Fn(f64, f64) -> f64) -> Record {
    let time: Vec<f64> = (0..6500).map(|k| 0.02 * f64::from(k)).collect();
    let angle = |t: &f64| TAU * t / 40.0;
    let command = |t: &f64| FULL * angle(t).sin().asin() / (0.5 * PI);
    let supply = |t: &f64| 90.0 + 15.0 * (0.7 * t).sin();
    let measured = |t: &f64| {
        let ripple = 0.05 * (331.0 * t).sin();
        flow(command(t), angle(t).cos().signum()) * (supply(t) / 70.0).sqrt() + ripple
    };
    let column = |of: &dyn Fn(&f64) -> f64| time.iter().map(of).collect::<Vec<f64>>();
    let channels = [
        (Channel::Command, Series::new("V", column(&command))),
        (Channel::Flow, Series::new("L/min", column(&measured))),
        (Channel::SupplyPressure, Series::new("bar", column(&supply))),
    ];
    Record::new("sweep", time.clone(), channels).unwrap()
}

#[test]
fn each_figure_stands_beside_the_one_of_the_measured_curve() {
    let values = [
        ("gain", 200.0),
        ("time_constant", 0.001),
        ("saturation", 3.0),
        ("max_area", 0.5),
        ("overlap", 2.0),
    ];
    let structure = valve(&["overlap"]);
    let card = card(&structure, &values, 0.001, 1);
    let gain = value(&card, "flow_gain");
    let lapped = move |opening: f64| gain * (opening.abs() - 0.2).max(0.0) * opening.signum();
    let beside = |record: &Record, accuracy: &str| {
        let accuracy = match accuracy {
            "" => Accuracy::default(),
            text => text.parse().unwrap(),
        };
        let measured = Measured::of(&structure, &[record], &accuracy);
        card.clone().beside(measured, Hold::Held)
    };

    // The valve that the model is: nothing to warn of.
    let same = beside(&slow_cycles(|u, _| lapped(u)), "");
    for (name, expected, tolerance) in [
        ("rated_flow", 9.8 * gain, 0.05),
        ("flow_gain", gain, 0.02),
        ("overlap", 2.0, 0.1),
        ("lap", 4.0, 0.2),
        ("asymmetry", 0.0, 0.5),
        ("hysteresis", 0.0, 0.2),
        ("null_bias", 0.0, 0.1),
        ("polarity", 1.0, 0.0),
    ] {
        let one = figure(&same, name);
        let measured = one.measured.as_ref().unwrap();
        println!("{name}: {:?} and {measured:?}", one.value);
        assert!((measured.value - expected).abs() <= tolerance, "{name}");
        let test = "flow over command, 3 cycles of 40 s, corrected to 70 bar";
        assert_eq!(
            (measured.test.as_str(), one.no_measured.as_deref()),
            (test, None)
        );
        assert!(measured.low <= measured.value && measured.value <= measured.high);
        let near = (one.value.unwrap() - measured.value).abs() <= tolerance;
        assert!(near || name == "hysteresis", "{name}");
    }
    let step = figure(&same, "step_time");
    assert_eq!(step.measured, None);
    let reason = "the records have no step from zero to full scale";
    assert_eq!(step.no_measured.as_deref(), Some(reason));

    // Another valve than the model's: a loop, a null, the ports the other way round.
    let other = beside(
        &slow_cycles(|u, direction| -lapped(u - 0.15 * direction - 0.4)),
        "",
    );
    for (name, expected) in [("hysteresis", 3.0), ("null_bias", 4.0), ("polarity", -1.0)] {
        let one = figure(&other, name);
        let measured = one.measured.as_ref().unwrap().value;
        assert!((measured - expected).abs() < 0.15, "{name}: {measured}");
        assert!(one.disagrees(), "{name}");
    }
    assert!(!figure(&other, "lap").disagrees());

    // A meter that may be off by a hundredth is as uncertain for the model that was fitted to it.
    let unsure = beside(&slow_cycles(|u, _| lapped(u)), "flow=1 %");
    let (before, after) = (figure(&same, "rated_flow"), figure(&unsure, "rated_flow"));
    let width = |low: f64, high: f64| 0.5 * (high - low);
    let model = width(after.low.unwrap(), after.high.unwrap());
    let measured = after.measured.as_ref().unwrap();
    let expected = 0.098 * gain;
    assert!((width(measured.low, measured.high) / expected - 1.0).abs() < 0.1);
    assert!(
        (model / expected - 1.0).abs() < 0.1,
        "{model} for {expected}"
    );
    assert!(width(before.low.unwrap(), before.high.unwrap()) < 0.2 * model);
    // The drop of 70 bar is 90 in the record: a hundredth of 105 bar is half of 1.17 % of the flow.
    let gauge = beside(&slow_cycles(|u, _| lapped(u)), "pressure=1 %");
    let measured = figure(&gauge, "rated_flow").measured.clone().unwrap();
    let expected = 9.8 * gain * 0.5 * 1.05 / 90.0;
    assert!((width(measured.low, measured.high) / expected - 1.0).abs() < 0.1);
}
