//! Problems with known answers: every structure with every kind of record, in one place.

pub(crate) mod effects;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::evaluate::gpu::{Checks, GpuEvaluator, adapters, best, describe};
use servobee::evaluate::problem::{DEGREES_PER_DECIBEL, Data, Sample, Series, Stream, Tone, Wave};
use servobee::evaluate::simulate::{SLICE, outputs, response};
use servobee::evaluate::{Population, Problem};
use servobee::model::orifice::Transition;
use servobee::model::valve::{AreaLaw, Drop, Meter, Orifices, ValveForm};
use servobee::model::{
    Complete, Drive, Hold, Initial, Input, Output, Outputs, Parameter, Piston, Plant, Polarity,
    Scale, ServoValve, Structure,
};
use std::f64::consts::TAU;

/// An evaluator on the best adapter; none where there is no adapter and the caller has allowed that.
pub(crate) fn gpu(checks: Checks) -> Option<GpuEvaluator> {
    let adapters = adapters();
    let Some(adapter) = best(&adapters) else {
        assert!(
            std::env::var("SERVOBEE_SKIP_GPU").is_ok_and(|value| value == "1"),
            "no GPU adapter: install a Vulkan driver (mesa-vulkan-drivers is one in software), or set \
             SERVOBEE_SKIP_GPU=1"
        );
        println!("SKIPPED: no GPU adapter and SERVOBEE_SKIP_GPU=1: nothing was tested on a GPU");
        return None;
    };
    println!("on {}", describe(&adapter.get_info()));
    Some(GpuEvaluator::new(adapter, checks).expect("a device"))
}

/// A problem whose targets come from its own start values, scaled and shifted so that the start's cost is 1.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) problem: Problem,
    /// Parameters that the outputs do not depend on.
    pub(crate) idle: &'static [&'static str],
    /// Pieces of the traced physics whose literals the outputs do not depend on.
    pub(crate) idle_text: Vec<&'static str>,
    /// How far costs from the GPU may lie off those of the CPU in `f32`, near the start values, relative.
    pub(crate) tolerance: f64,
}

impl Case {
    fn new(name: &'static str, problem: Problem) -> Self {
        let structure = &problem.structure;
        let mut case = Self {
            name,
            idle: &[],
            idle_text: vec![],
            tolerance: match &*problem.data {
                Data::Series(_) if integrates(structure) => POSITION_ROUNDING,
                Data::Series(_) => ROUNDING,
                Data::Tones(_) => PHASE_ROUNDING,
            },
            problem: problem.clone(),
        };
        if let Some(valve) = structure.valve() {
            if valve.transition == Transition::PressureRatio {
                case.idle = &["viscosity"];
                case.idle_text.push(LAMINAR);
            }
            if valve.drop == Drop::Rated {
                case.idle_text.push(NO_TANK);
            }
            if valve.drop != Drop::Ports && valve.meter == Meter::Load {
                case.idle_text.push(MIDDLE);
            }
        }
        case
    }
}

/// Zero tank pressure, whatever it is multiplied by.
const NO_TANK: &str = "0.0f * 100000.0f";
/// The pressure midway between supply and tank: what it adds to the load flow at one land it takes at the other.
const MIDDLE: &str = "* 0.5f) * 100000.0f";
/// The critical pressure, about a thousandth of the pressures: nothing at a drop of many bars.
const LAMINAR: &str = "* 0.5f) + 101325.0f) * 0.001f";
/// The mean pressure's share in it, where that is far below the atmosphere's.
const MEAN_PRESSURE: &str = "* 0.5f) +";
/// The stages of steps that are much finer than the motion.
const STAGES: [&str; 2] = ["step * 0.5f", "step * 1.0f"];

/// Between GPU and CPU in `f32`: measured at up to 1.6e-6 with Mesa's lavapipe. A hardware GPU rounds divisions and
/// roots a little worse and may fuse multiplication and addition: errors of the size of those between `f32` and `f64`,
/// which are measured at up to 2e-6.
const ROUNDING: f64 = 6e-6;
/// An integrated position sums many small changes: measured at up to 2.6e-6, and 1.1e-5 between `f32` and `f64`.
const POSITION_ROUNDING: f64 = 8e-6;
/// Phases in degrees, 3 off: measured at 0, and 1e-5 between `f32` and `f64`.
const PHASE_ROUNDING: f64 = 3e-5;

/// Whether the position of a piston is a state.
fn integrates(structure: &Structure) -> bool {
    structure.states().iter().any(|state| state == "position")
}

/// The inputs of one record: times and commands, tank and port pressures, temperature.
pub(crate) struct Record {
    pub(crate) time: Vec<f64>,
    pub(crate) inputs: Vec<Input<f64>>,
}

impl Record {
    /// `rows` rows `interval` s apart, their commands up to `scale`; jumps, slow and fast sines, from off zero.
    pub(crate) fn new(rows: usize, interval: f64, scale: f64) -> Self {
        Self::at((0..rows).map(|k| k as f64 * interval).collect(), scale)
    }

    /// The same at rows of uneven spacing, a gap among them.
    pub(crate) fn uneven(rows: usize, interval: f64, scale: f64) -> Self {
        let mut now = 0.0;
        let advance = |k: usize| {
            let time = now;
            now += interval * [1.0, 0.4, 2.7, 1.3, 0.1][k % 5] * if k == 40 { 30.0 } else { 1.0 };
            time
        };
        Self::at((0..rows).map(advance).collect(), scale)
    }

    fn at(time: Vec<f64>, scale: f64) -> Self {
        let input = |&t: &f64| {
            let level = [0.3, 0.95, -0.95, 0.1, -0.5, 0.0][(t / 0.09) as usize % 6];
            let wobble = (TAU * (1.0 + 5.0 * t.min(3.0)) * t).sin();
            let swing = |rate: f64| (TAU * rate * t).sin();
            Input {
                command: scale * (0.7 * level + 0.4 * wobble),
                supply: 100.0 + 10.0 * swing(3.0),
                tank: 4.0 + swing(5.0),
                a: 60.0 + 15.0 * swing(2.0),
                b: 45.0 + 15.0 * swing(7.0),
                temperature: 40.0 + 20.0 * swing(0.5),
                time: t,
            }
        };
        Self {
            inputs: time.iter().map(input).collect(),
            time,
        }
    }

    /// All pressures times `factor`.
    fn pressures_times(mut self, factor: f64) -> Self {
        for input in &mut self.inputs {
            for pressure in [
                &mut input.supply,
                &mut input.tank,
                &mut input.a,
                &mut input.b,
            ] {
                *pressure *= factor;
            }
        }
        self
    }
}

/// The parameters of `structure` with these start values; the free ones searched from 0.7 to 1.4 times the start.
pub(crate) fn near_bounds(structure: &Structure, values: &[(&str, f64)]) -> Vec<Parameter> {
    let mut parameters = with_starts(structure, values);
    for parameter in parameters.iter_mut().filter(|p| !p.is_fixed()) {
        let ends = match parameter.scale {
            Scale::Log => [0.7 * parameter.nominal(), 1.4 * parameter.nominal()],
            Scale::Linear => [0.0, 2.0 * parameter.nominal()],
        };
        parameter.low = ends[0].min(ends[1]);
        parameter.high = ends[0].max(ends[1]);
    }
    parameters
}

/// The parameters of `structure` with these start values and the default bounds.
pub(crate) fn with_starts(structure: &Structure, values: &[(&str, f64)]) -> Vec<Parameter> {
    let mut parameters = structure.parameters();
    for &(name, value) in values {
        let parameter = parameters.iter_mut().find(|p| p.name == name);
        parameter
            .unwrap_or_else(|| panic!("no parameter {name}"))
            .set_nominal(value);
    }
    parameters
}

/// A problem on `records` whose targets come from the start values of `parameters`.
pub(crate) fn problem(
    structure: Structure,
    parameters: Vec<Parameter>,
    records: Vec<Record>,
) -> Problem {
    let rate = structure.fastest_rate(&parameters);
    let truth = Complete::nominal(&parameters);
    let mut all = Vec::new();
    let mut squares = Outputs::all(0.0);
    for (number, record) in records.into_iter().enumerate() {
        let samples = record.inputs.iter().map(|&input| Sample {
            input,
            weight: 1.0,
            ..Sample::default()
        });
        let mut one = Series {
            name: format!("record {number}"),
            // Ports are open in one test and blocked in the next.
            measured: Outputs::from_fn(|output| {
                !structure.observes_blocked_ports()
                    || output.is_of_blocked_ports() == (number % 2 == 1)
            }),
            time: record.time,
            samples: samples.collect(),
        };
        // The measured position at the first row is where an integration starts.
        let integrated = integrates(&structure);
        if integrated {
            one.samples[0].target[Output::Position] = 12.0;
        }
        one.set_steps(rate, 1);
        let outputs = outputs(&structure, &truth, &one);
        let peak = |i: Output| {
            outputs
                .iter()
                .fold(0.0, |peak, row| f64::max(peak, row[i].abs()))
        };
        let peaks = Outputs::from_fn(peak);
        for (k, (sample, row)) in one.samples.iter_mut().zip(&outputs).enumerate() {
            sample.weight = [1.0, 0.5, 1.0, 2.0, 0.0, 1.0, 1.0][k % 7];
            for i in Output::ALL {
                if k > 0 || i != Output::Position || !integrated {
                    sample.target[i] = 0.9 * row[i] + 0.1 * peaks[i];
                }
                let error = sample.target[i] - row[i];
                if one.measured[i] {
                    squares[i] += sample.weight * error * error;
                }
            }
        }
        all.push(one);
    }
    let observed = squares.0.iter().filter(|&&sum| sum > 0.0).count() as f64;
    let mut problem = Problem::new(structure, parameters, Data::Series(all));
    problem.scale = Outputs(squares.0.map(|sum| {
        if sum > 0.0 {
            1.0 / (observed * sum)
        } else {
            0.0
        }
    }));
    problem
}

/// A problem on tones whose measured phases are 3° off, and whose gains, if they are measured, 0.5 dB.
fn tones(stream: Stream, gains: bool, values: &[(&str, f64)]) -> Problem {
    let structure = Structure::actuator(10.0, "V");
    let parameters = near_bounds(&structure, values);
    let rate = structure.fastest_rate(&parameters);
    let truth = Complete::nominal(&parameters);
    let points = [
        (5.0, 9.0),
        (14.0, 9.0),
        (25.0, 4.0),
        (40.0, 9.0),
        (60.0, 2.0),
    ];
    let mut tones: Vec<Tone> = points
        .iter()
        .map(|&(frequency, amplitude)| Tone::new(frequency, amplitude, 0.0, 1.0, stream, rate, 1))
        .collect();
    let wave = Wave::new(&tones);
    let plant = Plant::new(&structure, &truth);
    let count = tones.len() as f64;
    for tone in &mut tones {
        let [re, im] = response(&plant, tone, &wave, |_| false);
        tone.phase = Some(im.atan2(re).to_degrees() - 3.0);
        tone.gain = gains.then(|| 20.0 * re.hypot(im).log10() - 0.5);
        let gain = if gains {
            DEGREES_PER_DECIBEL * 0.5
        } else {
            0.0
        };
        tone.weight = 1.0 / ((9.0 + gain * gain) * count);
    }
    Problem::new(structure, parameters, Data::Tones(tones))
}

const ACTUATOR: [(&str, f64); 3] = [
    ("gain", 250.0),
    ("time_constant", 0.008),
    ("saturation", 4.0),
];
const LINEAR: [(&str, f64); 3] = [
    ("max_area", 1.5),
    ("opening_offset", 3.0),
    ("leakage_area", 0.02),
];
const OPENINGS: [f64; 6] = [0.0, 10.0, 25.0, 50.0, 80.0, 100.0];
const TABLE: [(&str, f64); 8] = [
    ("opening_offset", 3.0),
    ("leakage_area", 0.3),
    ("area_1", 0.29),
    ("area_2", 0.4),
    ("area_3", 0.9),
    ("area_4", 1.5),
    ("area_5", 1.8),
    ("area_6", 2.0),
];

const EDGES: [(&str, f64); 15] = [
    ("max_area", 1.5),
    ("opening_offset", 0.1),
    ("edge_pa_position", 0.8),
    ("edge_pa_clearance", 0.6),
    ("edge_pa_radius", 0.4),
    ("edge_at_position", -0.4),
    ("edge_at_clearance", 0.5),
    ("edge_at_radius", 0.6),
    ("edge_pb_position", 1.2),
    ("edge_pb_clearance", 0.4),
    ("edge_pb_radius", 0.2),
    ("edge_bt_position", 0.2),
    ("edge_bt_clearance", 0.6),
    ("edge_bt_radius", 0.4),
    ("pilot_flow", 0.3),
];

const SIDES: [f64; 6] = [-100.0, -50.0, -10.0, 10.0, 60.0, 100.0];
const SIGNED: [(&str, f64); 8] = [
    ("opening_offset", 3.0),
    ("leakage_area", 0.1),
    ("area_1", -2.0),
    ("area_2", -1.2),
    ("area_3", -0.5),
    ("area_4", 0.3),
    ("area_5", 1.5),
    ("area_6", 2.2),
];

/// Every structure with every kind of record.
pub(crate) fn cases() -> Vec<Case> {
    let actuator = || Structure::actuator(10.0, "V");
    // Past full scale both ways.
    let record = || Record::new(300, 4e-3, 12.0);
    // The longer a position is integrated, the more rounding hides.
    let short = || Record::new(60, 5e-3, 12.0);
    let bench = || Record::new(300, 2e-3, 120.0);
    let case = |name, structure: Structure, values: &[&[(&str, f64)]], records| {
        let parameters = near_bounds(&structure, &values.concat());
        Case::new(name, problem(structure, parameters, records))
    };
    let wide = |name, structure: Structure, values: &[&[(&str, f64)]]| {
        let parameters = with_starts(&structure, &values.concat());
        // Short: a fast and hardly damped spool that saturates early on amplifies any rounding exponentially.
        let records = vec![Record::new(200, 2e-3, 12.0)];
        let mut case = Case::new(name, problem(structure, parameters, records));
        case.idle_text.extend(STAGES);
        case
    };
    let laminar = |mut case: Case| {
        case.idle_text = vec![MEAN_PRESSURE];
        case
    };
    let with_drop = |drop| ValveForm {
        drop,
        ..ValveForm::linear()
    };
    let driven = |observed: &[Output], valve| Structure {
        observed: observed.to_vec(),
        base: ServoValve::with(valve).into(),
        ..actuator()
    };
    let position = [("piston_area", 20.0)];
    vec![
        case("actuator, held", actuator(), &[&ACTUATOR], vec![record()]),
        case(
            "actuator, interpolated",
            Structure {
                hold: Hold::Interpolated,
                ..actuator()
            },
            &[&ACTUATOR],
            vec![record()],
        ),
        case(
            "actuator, between jumps",
            Structure {
                hold: Hold::BetweenJumps,
                ..actuator()
            },
            &[&ACTUATOR],
            vec![record()],
        ),
        case(
            "actuator, uneven",
            actuator(),
            &[&ACTUATOR],
            vec![Record::uneven(300, 3e-3, 12.0)],
        ),
        case(
            "actuator, uneven and interpolated",
            Structure {
                hold: Hold::Interpolated,
                ..actuator()
            },
            &[&ACTUATOR],
            vec![Record::uneven(300, 3e-3, 12.0)],
        ),
        case(
            "actuator, at rest",
            Structure {
                initial: Initial::Rest,
                ..actuator()
            },
            &[&ACTUATOR],
            vec![record()],
        ),
        case(
            "actuator, free start",
            Structure {
                initial: Initial::Free,
                ..actuator()
            },
            &[&ACTUATOR, &[("initial_spool", -6.0)]],
            vec![Record::new(60, 4e-3, 12.0)],
        ),
        case(
            "actuator, spool in mm",
            Structure {
                base: ServoValve {
                    spool_unit: Some("mm".into()),
                    ..ServoValve::default()
                }
                .into(),
                ..actuator()
            },
            &[&ACTUATOR, &[("spool_gain", 0.3)]],
            vec![record()],
        ),
        case(
            "linear valve, negative polarity, ports measured",
            Structure {
                base: ServoValve {
                    drive: Drive::Direct,
                    polarity: Polarity::Negative,
                    ..ServoValve::with(with_drop(Drop::Ports))
                }
                .into(),
                ..Structure::flow_bench(ValveForm::linear())
            },
            &[&LINEAR],
            vec![bench()],
        ),
        {
            let structure = Structure {
                observed: vec![
                    Output::Flow,
                    Output::ReturnFlow,
                    Output::PressureA,
                    Output::PressureB,
                    Output::LoadPressure,
                ],
                ..Structure::flow_bench(ValveForm {
                    area: AreaLaw::Edges,
                    ..with_drop(Drop::Supply)
                })
            };
            // Near null, where the edges are.
            let records = vec![Record::new(300, 2e-3, 10.0), Record::new(300, 2e-3, 5.0)];
            let mut case = case(
                "four edges, open and blocked",
                structure,
                &[&EDGES],
                records,
            );
            case.idle = &["leakage_area"];
            case
        },
        wide("actuator, default bounds", actuator(), &[&ACTUATOR]),
        case(
            "linear valve, rated drop",
            Structure::flow_bench(ValveForm::linear()),
            &[&LINEAR],
            vec![bench()],
        ),
        case(
            "linear valve, supply measured",
            Structure::flow_bench(with_drop(Drop::Supply)),
            &[&LINEAR],
            vec![bench()],
        ),
        case(
            "linear valve, ports measured",
            Structure::flow_bench(with_drop(Drop::Ports)),
            &[&LINEAR],
            vec![bench()],
        ),
        case(
            "valve with a table for each side",
            Structure::flow_bench(ValveForm::signed(&SIDES)),
            &[&SIGNED],
            vec![bench(), Record::new(300, 2e-3, 100.0)],
        ),
        case(
            "table valve",
            Structure::flow_bench(ValveForm::table(&OPENINGS)),
            &[&TABLE],
            vec![bench(), Record::new(300, 2e-3, 100.0)],
        ),
        case(
            "six orifices, supply flow",
            Structure::flow_bench(ValveForm {
                orifices: Orifices::Six,
                meter: Meter::Supply,
                ..ValveForm::linear()
            }),
            &[&LINEAR],
            vec![Record::new(300, 2e-3, 10.0), bench()],
        ),
        laminar(case(
            "near the laminar flow, pressure ratio",
            Structure::flow_bench(with_drop(Drop::Ports)),
            &[&LINEAR],
            vec![bench().pressures_times(3e-5)],
        )),
        case(
            "near the laminar flow, Reynolds number",
            Structure::flow_bench(ValveForm {
                transition: Transition::Reynolds,
                ..with_drop(Drop::Ports)
            }),
            &[&LINEAR, &[("viscosity", 500.0)]],
            vec![bench().pressures_times(1e-3)],
        ),
        case(
            "actuator and table valve",
            driven(
                &[Output::Spool, Output::Flow],
                ValveForm {
                    drop: Drop::Ports,
                    ..ValveForm::table(&OPENINGS)
                },
            ),
            &[&ACTUATOR, &TABLE],
            vec![record()],
        ),
        case(
            "actuator and integrated position",
            driven(&[Output::Position], ValveForm::linear()),
            &[&ACTUATOR, &LINEAR, &position],
            vec![short()],
        ),
        case(
            "spool, flow and integrated position, interpolated",
            Structure {
                hold: Hold::Interpolated,
                ..driven(
                    &[Output::Spool, Output::Flow, Output::Position],
                    with_drop(Drop::Supply),
                )
            },
            &[&ACTUATOR, &LINEAR, &position],
            vec![short()],
        ),
        case(
            "spool, flow and integrated position, between jumps",
            Structure {
                hold: Hold::BetweenJumps,
                ..driven(
                    &[Output::Spool, Output::Flow, Output::Position],
                    with_drop(Drop::Supply),
                )
            },
            &[&ACTUATOR, &LINEAR, &position],
            vec![short()],
        ),
        case(
            "direct drive and integrated position",
            Structure {
                observed: vec![Output::Position],
                ..Structure::flow_bench(ValveForm::linear())
            },
            &[&LINEAR, &position],
            vec![Record::new(60, 5e-3, 120.0)],
        ),
        case(
            "servo position",
            Structure {
                observed: vec![Output::Position],
                base: ServoValve {
                    piston: Piston::Servo,
                    ..ServoValve::default()
                }
                .into(),
                ..actuator()
            },
            &[
                &ACTUATOR,
                &[("position_gain", 25.0), ("position_zero", 120.0)],
            ],
            vec![record()],
        ),
        case(
            "records of many lengths",
            actuator(),
            &[&ACTUATOR],
            vec![
                record(),
                Record::new(SLICE + 1000, 4e-3, 10.0),
                Record::new(128, 4e-3, 5.0),
                Record::new(SLICE, 2e-3, 7.0),
                Record::new(2, 4e-3, 10.0),
            ],
        ),
        wide(
            "actuator and valve, default bounds",
            driven(&[Output::Spool, Output::Flow], ValveForm::linear()),
            &[&ACTUATOR, &LINEAR],
        ),
        Case::new("tones, paper", tones(Stream::Paper, false, &ACTUATOR)),
        Case::new("tones, settled", tones(Stream::Settled, false, &ACTUATOR)),
        Case::new("tones with gains", tones(Stream::Settled, true, &ACTUATOR)),
    ]
}

/// The case called `name`.
pub(crate) fn case(name: &str) -> Case {
    let found = cases().into_iter().find(|case| case.name == name);
    found.unwrap_or_else(|| panic!("no case {name}"))
}

/// `count` candidates drawn inside the bounds.
pub(crate) fn random(problem: &Problem, count: usize, seed: u64) -> Population {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let free = problem.free();
    let mut population = Population::new(free.len());
    for _ in 0..count {
        let candidate: Vec<f64> = free.iter().map(|p| p.from_unit(rng.random())).collect();
        population.push(&candidate);
    }
    population
}

/// `count` candidates within 10 % of the start.
pub(crate) fn near_start(problem: &Problem, count: usize, seed: u64) -> Population {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start = problem.start();
    let mut population = Population::new(start.len());
    for _ in 0..count {
        let mut change = |value: &f64| value * (0.9 + 0.2 * rng.random::<f64>());
        let candidate: Vec<f64> = start.iter().map(&mut change).collect();
        population.push(&candidate);
    }
    population
}

/// Candidates exactly on the bounds: all low, all high, and alternating.
pub(crate) fn on_bounds(problem: &Problem) -> Population {
    let free = problem.free();
    let mut population = Population::new(free.len());
    for pattern in [0b00, 0b11, 0b01, 0b10] {
        let end = |(i, p): (usize, &Parameter)| {
            if pattern >> (i % 2) & 1 == 1 {
                p.high
            } else {
                p.low
            }
        };
        let candidate: Vec<f64> = free.iter().enumerate().map(end).collect();
        population.push(&candidate);
    }
    population
}
