//! The model against solutions that an independent integrator made from the equations alone (tests/golden), and the
//! readings of the model against each other.

use crate::common::{Record, cases, near_start, problem, random};
use crate::golden::Golden;
use servobee::evaluate::problem::{Data, Sample, Series, Stream, Tone, Wave};
use servobee::evaluate::simulate::{outputs, response, series};
use servobee::evaluate::{CpuEvaluator, Evaluator, Precision, Problem, reference};
use servobee::model::declare::Given;
use servobee::model::orifice::{Orifice, Transition};
use servobee::model::valve::{Drop, OrificeFlows, Orifices, Pressures, Valve, ValveForm};
use servobee::model::{
    Alone, Complete, Hold, Initial, Input, Output, Outputs, Plant, ServoValve, Structure, View,
};

/// The fastest rate inside the default bounds.
fn default_rate() -> f64 {
    let structure = Structure::actuator(10.0, "V");
    structure.fastest_rate(&structure.parameters())
}

/// The slowest rate that the step rule may use for an actuator: its own.
fn own_rate([gain, time_constant, _]: [f64; 3]) -> f64 {
    (1.0 / time_constant).max((gain / time_constant).sqrt())
}

fn record(time: Vec<f64>, command: &[f64]) -> Series {
    let sample = |&command: &f64| Sample {
        input: Input {
            command,
            ..Input::default()
        },
        ..Sample::default()
    };
    Series {
        name: "golden".into(),
        measured: Outputs::all(true),
        time,
        samples: command.iter().map(sample).collect(),
    }
}

/// The largest deviation as a share of the largest reference value.
fn error(simulated: impl IntoIterator<Item = f64>, reference: &[f64]) -> f64 {
    let top = reference.iter().fold(0.0, |top: f64, v| top.max(v.abs()));
    let pairs = simulated.into_iter().zip(reference);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / top
}

/// Errors in a few characters.
fn text(errors: &[f64]) -> String {
    errors.iter().map(|error| format!("{error:.1e} ")).collect()
}

/// How many times finer the steps get in a convergence study.
const REFINED: [u32; 4] = [1, 4, 16, 64];

/// The order at which the errors of [`REFINED`] fall, from the first to the last of them.
fn order(errors: &[f64]) -> f64 {
    (errors[0] / errors[errors.len() - 1]).log2() / (2 * (errors.len() - 1)) as f64
}

#[test]
fn actuator_follows_the_independent_solutions() {
    // Whatever the length of the exact steps. Where nothing saturates the error is that of the golden files' twelve digits.
    for (name, limit) in [
        ("linear", 1e-11),
        ("linear_overdamped", 1e-11),
        ("step_origin", 1e-5),
        ("step_paper", 1e-5),
        ("step_saturated", 1e-5),
        ("random_held", 1e-5),
        ("triangle", 1e-5),
        ("chirp", 1e-5),
        ("uneven_held", 1e-5),
        ("uneven_interpolated", 1e-5),
    ] {
        let golden = Golden::read(&format!("actuator_{name}"));
        let values = ["K", "T", "S"].map(|key| golden.number(key));
        let structure = Structure {
            hold: match golden.word("input") {
                "held" => Hold::Held,
                _ => Hold::Interpolated,
            },
            initial: match golden.word("start") {
                "rest" => Initial::Rest,
                _ => Initial::Equilibrium,
            },
            ..Structure::actuator(10.0, "V")
        };
        let mut record = record(golden.column("time [s]"), &golden.column("command [V]"));
        let reference = golden.column("spool [V]");
        let mut error_at = |rate: f64, refine: u32| {
            record.set_steps(rate, refine);
            let rows = outputs(&structure, &Complete::from_iter(values), &record);
            error(rows.iter().map(|row| row[Output::Spool]), &reference)
        };
        let default = error_at(default_rate(), 1);
        let coarse = REFINED.map(|refine| error_at(own_rate(values), refine));
        println!(
            "{name:20} default exact steps {default:.1e}; longest, 4, 16, 64 times shorter {}",
            text(&coarse)
        );
        let worst = coarse.into_iter().fold(default, f64::max);
        assert!(worst < limit, "{name}: {worst:.1e}");
    }
}

/// Between jumps a command of jumps alone is held, and one without any is interpolated; a delay only makes it late.
#[test]
fn a_command_between_its_jumps_is_held_before_them_and_straight_elsewhere() {
    let row = 2e-3;
    let time = || (0..300).map(|k| row * f64::from(k)).collect::<Vec<f64>>();
    let smooth: Vec<f64> = time().iter().map(|t| 4.0 * (60.0 * t).sin()).collect();
    let steps = |k: usize| [0.0, 5.0, -3.0, 8.0][k / 40 % 4];
    let jumping: Vec<f64> = (0..300).map(steps).collect();
    let both: Vec<f64> = smooth.iter().zip(&jumping).map(|(a, b)| a + b).collect();
    // In exact steps, in integration steps, and late.
    for effect in [None, Some("integral_action"), Some("delay")] {
        let simulated = |hold: Hold, command: &[f64], late: f64| {
            let bare = Structure {
                hold,
                ..Structure::actuator(10.0, "V")
            };
            let structure = effect
                .iter()
                .fold(bare, |all, name| all.with(name.parse().unwrap()));
            let mut parameters = structure.parameters();
            for parameter in &mut parameters {
                let value = match parameter.name.as_str() {
                    "gain" => 80.0,
                    "time_constant" => 4e-3,
                    "saturation" => 3.0,
                    "delay" => late,
                    _ => continue,
                };
                parameter.set_nominal(value);
            }
            let mut record = record(time(), command);
            record.set_steps(structure.fastest_rate(&parameters), 4);
            let rows = outputs(&structure, &Complete::nominal(&parameters), &record);
            rows.iter()
                .map(|row| row[Output::Spool])
                .collect::<Vec<_>>()
        };
        let between = |command: &[f64], late| simulated(Hold::BetweenJumps, command, late);
        let held = simulated(Hold::Held, &jumping, 0.6e-3);
        assert!(error(between(&jumping, 0.6e-3), &held) < 1e-6, "{effect:?}");
        let straight = simulated(Hold::Interpolated, &smooth, 0.6e-3);
        assert!(
            error(between(&smooth, 0.6e-3), &straight) < 1e-12,
            "{effect:?}"
        );
        // Neither of them is both.
        for other in [Hold::Held, Hold::Interpolated] {
            let apart = error(between(&both, 0.6e-3), &simulated(other, &both, 0.6e-3));
            assert!(apart > 0.01, "{effect:?}, {other:?}: {apart}");
        }
        // Late by three rows it is what it was three rows before.
        if effect == Some("delay") {
            let [now, late] = [0.0, 3.0 * row].map(|late| between(&both, late));
            assert!(error(late[3..].iter().copied(), &now[..297]) < 1e-6);
        }
    }
}

#[test]
fn the_way_out_of_saturation_is_the_closed_form() {
    let golden = Golden::read("kinks");
    let structure = Structure {
        initial: Initial::Rest,
        ..Structure::actuator(10.0, "V")
    };
    for (number, case) in golden.cases() {
        let values = ["K", "T", "S"].map(|key| case.number(key));
        let rows = golden.rows_where("case", &number);
        let mut record = record(rows.column("time [s]"), &rows.column("command [V]"));
        let (spool, integrator) = (rows.column("spool [V]"), rows.column("z [V]"));
        let plant = Alone::plant(&structure, &Complete::from_iter(values));
        let mut error_at = |rate: f64, refine: u32| {
            record.set_steps(rate, refine);
            let mut states = Vec::new();
            let keep = |_: usize, state: &mut [f64; 2], _: &_| {
                states.push([state[0], state[1]]);
                true
            };
            series::<f64, 2, _>(&structure, &record, keep, &plant);
            let of = |i: usize, reference: &[f64]| error(states.iter().map(|s| s[i]), reference);
            of(0, &integrator).max(of(1, &spool))
        };
        let default = error_at(default_rate(), 1);
        let coarse = REFINED.map(|refine| error_at(own_rate(values), refine));
        println!(
            "case {number}: default exact steps {default:.1e}; longest, 4, 16, 64 times shorter {}",
            text(&coarse)
        );
        let worst = coarse.into_iter().fold(default, f64::max);
        assert!(worst < 1e-6, "case {number}: {worst:.1e}");
    }
}

#[test]
fn orifice_flow_is_exact_in_both_transitions() {
    let mut worst = 0.0f64;
    for row in Golden::read("orifice").rows() {
        let orifice = Orifice::new(transition(row.word("form")), 0.7, 850.0, 18e-6);
        let average = row.number("average_pressure [bar]");
        let drop = row.number("pressure_drop [bar]");
        let port = |share: f64| (average + share * drop) * 1e5;
        let area = row.number("area [cm2]") * 1e-4;
        let flow = orifice.flow(area, port(0.5), port(-0.5)) * 6e4;
        let reference = row.number("flow [L/min]");
        if drop == 0.0 {
            assert_eq!((flow, reference), (0.0, 0.0));
            continue;
        }
        // The golden digits, and what a small drop loses as the difference of two large pressures.
        let allowed = 1e-11 + 4e-16 * (average / drop).abs();
        let relative = (flow / reference - 1.0).abs();
        worst = worst.max(relative / allowed);
        assert!(
            relative < allowed,
            "{relative:.1e} at {average} bar, drop {drop} bar"
        );
    }
    println!("largest share of the allowed error: {worst:.2}");
}

fn transition(form: &str) -> Transition {
    match form {
        "ratio" => Transition::PressureRatio,
        _ => Transition::Reynolds,
    }
}

/// The paper's D675 areas, cm², at equal openings.
const D675: [f64; 20] = [
    0.0, 0.0, 0.0, 0.6983, 1.1992, 1.6193, 2.1000, 2.6000, 3.0724, 3.6808, 4.2893, 4.7984, 5.2496,
    5.7222, 6.0858, 6.5140, 6.8634, 7.1390, 7.4000, 7.5980,
];

/// The flows in a row of valve.csv or valve_six.csv.
fn valve_flows(row: &Golden, orifices: Orifices) -> OrificeFlows<f64> {
    let stroke = row.number("h_max [%]");
    let (area, areas) = match row.word("area") {
        "linear" if stroke == 100.0 => (ValveForm::linear(), vec![7.598]),
        // A shorter stroke is a straight table.
        "linear" => {
            let shares = [0.0, 0.25, 0.5, 1.0];
            (
                ValveForm::table(&shares.map(|s| s * stroke)),
                shares.map(|s| s * 7.598).to_vec(),
            )
        }
        _ => {
            let openings: Vec<f64> = (0..20).map(|i| f64::from(i) * 100.0 / 19.0).collect();
            (ValveForm::table(&openings), D675.to_vec())
        }
    };
    let form = ValveForm {
        orifices,
        transition: transition(row.word("form")),
        drop: Drop::Ports,
        ..area
    };
    let fixed = [0.7, 850.0, 18.0, 1e-8, row.number("x0 [%]")];
    let all = [&fixed[..], &areas].concat().into_iter().collect();
    let valve = Valve::new(&form, &mut Given::new(&all));
    let pressures = Pressures {
        supply: row.number("supply_pressure [bar]"),
        tank: row.number("return_pressure [bar]"),
        a: row.number("pressure_a [bar]"),
        b: row.number("pressure_b [bar]"),
    };
    valve.orifice_flows(row.number("spool [%]"), &pressures)
}

#[test]
fn valve_flows_are_exact_and_the_centre_path_nearly() {
    for (name, orifices) in [("valve", Orifices::Four), ("valve_six", Orifices::Six)] {
        let (mut exact, mut centre, mut supply) = (0.0f64, 0.0f64, 0.0f64);
        for row in Golden::read(name).rows() {
            let flows = valve_flows(&row, orifices);
            let each = [
                ("q_pa [L/min]", flows.pa),
                ("q_at [L/min]", flows.at),
                ("q_pb [L/min]", flows.pb),
                ("q_bt [L/min]", flows.bt),
            ];
            let mut top = 0.0f64;
            for (column, flow) in each {
                let reference = row.number(column);
                exact = exact.max((flow / reference - 1.0).abs());
                top = top.max(reference.abs());
            }
            exact = exact.max((flows.load() - row.number("load [L/min]")).abs() / top);
            let error = (flows.supply() - row.number("supply [L/min]")).abs() / top;
            match orifices {
                Orifices::Four => exact = exact.max(error),
                Orifices::Six => {
                    supply = supply.max(error);
                    centre = centre.max((flows.pt / row.number("q_pt [L/min]") - 1.0).abs());
                }
            }
        }
        println!(
            "{name}: {exact:.1e}; centre path {centre:.1e}, which makes {supply:.1e} of the largest flow"
        );
        assert!(exact < 1e-11);
        // Two orifices in series are computed as one: exact where turbulent, and the laminar transition is 2.8e-6 off.
        assert!(centre < 1e-5 && supply < 5e-6);
    }
}

#[test]
fn position_is_the_integral_of_the_flow() {
    let golden = Golden::read("position");
    let structure = Structure {
        observed: vec![Output::Spool, Output::Flow, Output::Position],
        initial: Initial::Rest,
        // The golden valve's stroke is 80 %: a straight table.
        base: ServoValve::with(ValveForm::table(&[0.0, 20.0, 40.0, 80.0])).into(),
        ..Structure::actuator(10.0, "V")
    };
    let actuator = ["K", "T", "S"].map(|key| golden.number(key));
    let valve = [0.7, 850.0, 18.0, 1e-8, 0.0, 10.0, 0.0, 0.25, 0.5, 1.0];
    let values = [&actuator[..], &valve, &[golden.number("piston_cm2")]].concat();
    let mut record = record(golden.column("time [s]"), &golden.column("command [V]"));
    let mut error_at = |rate: f64, refine: u32| {
        record.set_steps(rate, refine);
        let rows = outputs(&structure, &Complete::from_iter(values.clone()), &record);
        let of = |i, column| error(rows.iter().map(|row| row[i]), &golden.column(column));
        [
            of(Output::Spool, "spool [V]"),
            of(Output::Flow, "flow [L/min]"),
            of(Output::Position, "position [mm]"),
        ]
    };
    let default = error_at(default_rate(), 1);
    let coarse = REFINED.map(|refine| error_at(own_rate(actuator), refine)[2]);
    let order = order(&coarse);
    println!("spool, flow, position at default steps {}", text(&default));
    println!(
        "position, coarsest, 4, 16, 64 times finer {}order {order:.1}",
        text(&coarse)
    );
    assert!(default[0] < 1e-10 && default[1] < 1e-10 && default[2] < 3e-6);
    assert!(order > 1.7, "{order:.2}");
}

/// The largest error of the golden responses: of the complex gain, and of the phase in degrees where the gain is
/// above 0.1.
fn response_errors(
    file: &str,
    stream: Stream,
    columns: [&str; 2],
    rate: impl Fn([f64; 3]) -> f64,
    refine: u32,
) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for row in Golden::read(file).rows() {
        let values = ["K", "T", "S"].map(|key| row.number(key));
        let [frequency, amplitude] = ["frequency [Hz]", "amplitude [V]"].map(|key| row.number(key));
        let [phase, gain] = columns.map(|key| row.number(key));
        let tone = Tone::new(
            frequency,
            amplitude,
            phase,
            1.0,
            stream,
            rate(values),
            refine,
        );
        let plant = Plant::new(
            &Structure::actuator(10.0, "V"),
            &Complete::from_iter(values),
        );
        let [re, im] = response(&plant, &tone, &Wave::new(&[tone]), |_| false);
        let (sin, cos) = phase.to_radians().sin_cos();
        worst[0] = worst[0].max((re - gain * cos).hypot(im - gain * sin));
        if gain > 0.1 {
            worst[1] = worst[1].max(tone.phase_error(im.atan2(re)).unwrap().abs());
        }
    }
    worst
}

#[test]
fn frequency_responses_follow_the_independent_solutions() {
    for (file, stream, columns) in [
        ("response", Stream::Settled, ["phase [deg]", "gain"]),
        (
            "response_stream",
            Stream::Paper,
            ["phase_rest_sine [deg]", "gain_rest_sine"],
        ),
    ] {
        let [gain, phase] = response_errors(file, stream, columns, |_| default_rate(), 1);
        let coarse =
            REFINED.map(|refine| response_errors(file, stream, columns, own_rate, refine)[0]);
        // In the end 40 samples a period and what is left of the transient remain: 9e-6.
        let order = order(&coarse[..3]);
        println!(
            "{file}: default steps {gain:.1e} of the amplitude, {phase:.1e} deg; coarsest, 4, 16, 64 times finer {}order {order:.1}",
            text(&coarse)
        );
        assert!(gain < 2e-4, "{file}: {gain:.1e}");
        assert!(phase < 0.03, "{file}: {phase:.1e} deg");
        assert!(order > 1.5, "{file}: {order:.2}");
    }
}

/// The errors of `count` candidates that are drawn from the whole bounds, the smallest first: of `output` at any row, over its
/// largest value.
fn errors_inside_the_bounds(
    structure: &Structure,
    output: Output,
    count: usize,
    (rows, interval): (usize, f64),
) -> Vec<f64> {
    let records = vec![Record::new(rows, interval, 10.0)];
    let problem = problem(structure.clone(), structure.parameters(), records);
    let fine = problem.refined(32);
    let (Data::Series(coarse), Data::Series(fine)) = (&*problem.data, &*fine.data) else {
        unreachable!("a record")
    };
    let error_of = |candidate: &[f64]| {
        let values = problem.complete(candidate, |fixed| fixed);
        let [coarse, fine] = [&coarse[0], &fine[0]].map(|record| {
            let rows = outputs(structure, &values, record);
            rows.iter().map(|row| row[output]).collect::<Vec<_>>()
        });
        error(coarse, &fine)
    };
    let mut errors: Vec<f64> = random(&problem, count, 8).iter().map(error_of).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn every_position_inside_the_bounds_is_integrated() {
    let structure = Structure {
        observed: vec![Output::Position],
        base: ServoValve::with(ValveForm::linear()).into(),
        ..Structure::actuator(10.0, "V")
    };
    for (hold, at, limits) in [
        (Hold::Held, (300, 1e-3), [5e-6, 5e-5, 1e-4]),
        (Hold::Held, (150, 4e-3), [5e-6, 5e-5, 1e-4]),
        (Hold::Interpolated, (300, 1e-3), [5e-6, 5e-5, 1e-4]),
    ] {
        let structure = Structure {
            hold,
            ..structure.clone()
        };
        let errors = errors_inside_the_bounds(&structure, Output::Position, 600, at);
        let found = [errors[300], errors[594], errors[599]];
        println!(
            "{hold:?}, {at:?}: half, 99 % and all below {}",
            text(&found)
        );
        for (found, limit) in found.iter().zip(limits) {
            assert!(*found < limit, "{found:.1e} is not below {limit}");
        }
    }
}

#[test]
fn every_candidate_inside_the_bounds_is_exact() {
    let structure = Structure::actuator(10.0, "V");
    for (interval, rows, hold) in [
        (1e-3, 300, Hold::Held),
        (4e-3, 150, Hold::Held),
        (1e-3, 300, Hold::Interpolated),
    ] {
        let structure = Structure {
            hold,
            ..structure.clone()
        };
        let errors = errors_inside_the_bounds(&structure, Output::Spool, 3000, (rows, interval));
        println!(
            "every {interval} s, {hold:?}: median {:.1e}, 90 % below {:.1e}, 99 % below {:.1e}, worst {:.1e} of the largest",
            errors[1500], errors[2700], errors[2970], errors[2999]
        );
        assert!(errors[2970] < 5e-6);
        assert!(errors[2999] < 5e-5);
    }
}

/// A candidate's residuals, and their exact derivatives with respect to all parameters of the problem.
fn residuals(problem: &Problem, values: &[f64]) -> Vec<(f64, Vec<f64>)> {
    let mut rows = Vec::new();
    let keep = &mut |residual: f64, gradient: &[f64]| rows.push((residual, gradient.to_vec()));
    assert!(reference::residuals(problem, values, keep));
    rows
}

#[test]
fn exact_sensitivities_are_those_of_finite_differences() {
    let mut worst = (0.0, String::new());
    for case in cases() {
        if case.name == "records of many lengths" {
            continue;
        }
        let problem = &case.problem;
        // Off the start, where numbers are round and the model may sit on a breakpoint.
        let free = near_start(problem, 1, 7);
        let values = problem.complete(free.candidate(0), |fixed| fixed);
        let values = values.as_slice().to_vec();
        // Fixed ones, too.
        let mut problem = problem.clone();
        problem
            .parameters
            .iter_mut()
            .for_each(|p| p.set_fixed(false));
        let exact = residuals(&problem, &values);
        let size =
            |numbers: &mut dyn Iterator<Item = f64>| numbers.fold(0.0, |a, b| b.abs().max(a));
        for (i, parameter) in problem.parameters.iter().enumerate() {
            let nudge = 1e-6 * values[i];
            let at = |nudge: f64| {
                let mut values = values.clone();
                values[i] += nudge;
                residuals(&problem, &values)
            };
            let (above, below) = (at(nudge), at(-nudge));
            let largest = size(&mut exact.iter().map(|(_, gradient)| gradient[i] * values[i]));
            let top = size(&mut exact.iter().map(|(residual, _)| *residual));
            for ((exact, above), below) in exact.iter().zip(&above).zip(&below) {
                let difference = (above.0 - below.0) / (2.0 * nudge);
                let error = (exact.1[i] - difference).abs() * values[i].abs();
                let share = error / (largest + 1e-3 * top);
                if share > worst.0 {
                    worst = (share, format!("{}: {}", case.name, parameter.name));
                }
            }
        }
    }
    println!("{:.1e} of the largest sensitivity: {}", worst.0, worst.1);
    assert!(worst.0 < 1e-6);
}

#[test]
fn lanes_compute_bit_for_bit_what_a_single_candidate_does() {
    for case in cases() {
        let problem = &case.problem;
        let population = random(problem, 37, 9);
        let costs = CpuEvaluator::new(Precision::F64).costs(problem, &population);
        for (cost, candidate) in costs.expect("costs").iter().zip(population.iter()) {
            let alone = reference::cost(problem, candidate).unwrap_or(f64::INFINITY);
            assert_eq!(cost.value, alone, "{}", case.name);
        }
    }
}
