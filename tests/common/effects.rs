//! Structures with effects of the catalogue.

use super::{Record, problem};
use servobee::evaluate::Problem;
use servobee::model::effects::{CATALOGUE, Effect, Scale, Trial};
use servobee::model::valve::{AreaLaw, Drop, Meter, ValveForm};
use servobee::model::{Hold, Output, Outputs, Parameter, ServoValve, Structure};
use servobee::simulator::{RATED_DROP, Valve};

/// A spool and its flow at rated drop.
pub(crate) fn bench() -> Structure {
    Structure {
        observed: vec![Output::Spool, Output::Flow],
        base: ServoValve::with(ValveForm {
            area: AreaLaw::Proportional,
            ..ValveForm::linear()
        })
        .into(),
        ..Structure::actuator(10.0, "V")
    }
}

/// A piston whose position is integrated; the supply's pressure is measured.
pub(crate) fn piston() -> Structure {
    Structure {
        observed: vec![Output::Flow, Output::Position],
        base: ServoValve::with(ValveForm {
            drop: Drop::Supply,
            ..ValveForm::linear()
        })
        .into(),
        ..Structure::actuator(10.0, "V")
    }
}

/// The same as [`bench`] with the flow measured in the pressure line, and the supply's pressure.
pub(crate) fn pressure_line() -> Structure {
    Structure {
        base: ServoValve::with(ValveForm {
            drop: Drop::Supply,
            meter: Meter::Supply,
            ..ValveForm::linear()
        })
        .into(),
        ..bench()
    }
}

/// The three, with every effect in every form that it has there; in the pressure line those that show nowhere else.
pub(crate) fn everywhere() -> [(Structure, Vec<Effect>); 3] {
    let usual = all_on(&bench());
    let mut others = all_on(&pressure_line());
    others.retain(|effect| !usual.contains(effect));
    assert!(!others.is_empty());
    [
        (bench(), usual),
        (pressure_line(), others),
        (piston(), all_on(&piston())),
    ]
}

/// Values of the base parameters: a spool that is well damped, a valve of about 60 L/min.
pub(crate) const BASE: [(&str, f64); 6] = [
    ("gain", 200.0),
    ("time_constant", 0.003),
    ("saturation", 5.0),
    ("leakage_area", 1e-3),
    ("max_area", 0.416),
    ("piston_area", 20.0),
];

/// The area, cm2, at which a linear valve with these parameters passes the rated flow of the simulator's `valve`.
pub(crate) fn area_of(valve: &Valve, parameters: &[Parameter]) -> f64 {
    let start = |name: &str| {
        let parameter = parameters.iter().find(|p| p.name == name);
        parameter.expect("a parameter of the valve").nominal()
    };
    let speed = (RATED_DROP * 1e5 / start("density")).sqrt();
    valve.rated_flow / 6e4 / speed / start("discharge_coefficient") * 1e4
}

/// The size of things in the records of [`Record`], for rows 1 ms apart.
pub(crate) fn scale(structure: &Structure) -> Scale {
    let pressure = structure.valve().map(|valve| valve.drop);
    Scale {
        command: structure.full_scale,
        command_unit: structure.command_unit.clone(),
        outputs: Outputs::from_fn(|output| match output {
            Output::Spool => 10.0,
            Output::Position => 100.0,
            _ => 60.0,
        }),
        units: Outputs::from_fn(|output| structure.unit(output).to_owned()),
        interval: 1e-3,
        length: 1.0,
        temperature: false,
        pressure: pressure.is_some_and(|drop| drop != Drop::Rated),
        rated_drop: 10.0,
        speed: 20.0 * structure.full_scale,
        lines: Outputs::all(Some(37.0)),
    }
}

/// Every effect in every form that it has on `structure`.
pub(crate) fn all_on(structure: &Structure) -> Vec<Effect> {
    let on = |entry: &&'static _| servobee::model::effects::Entry::on(entry, structure);
    CATALOGUE.iter().flat_map(on).collect()
}

/// The parameters of `structure` at [`BASE`], its effects absent.
pub(crate) fn absent(structure: &Structure, scale: &Scale) -> Vec<Parameter> {
    let mut parameters = structure.parameters_at(scale);
    for parameter in &mut parameters {
        let name = parameter.name.as_str();
        let value = BASE.iter().find(|(known, _)| *known == name);
        if let Some((_, value)) = value {
            parameter.set_nominal(*value);
        }
    }
    parameters
}

/// Sets the free parameters of `effect` among `parameters` to `trial`.
pub(crate) fn plant(parameters: &mut [Parameter], effect: Effect, scale: &Scale, trial: &Trial) {
    let own = effect.parameters(scale);
    let free = own.iter().filter(|p| !p.is_fixed());
    assert_eq!(free.clone().count(), trial.len(), "{effect}");
    for (own, value) in free.zip(trial) {
        let parameter = parameters.iter_mut().find(|p| p.name == own.name);
        parameter
            .expect("a parameter of the effect")
            .set_nominal(*value);
    }
}

/// What a trial leaves absent, or too small to compare anything with.
const AUDIBLE: [(&str, f64); 30] = [
    ("compensation", 2.5),
    ("compensation_start", 2.5),
    ("stroke_limit_bottom", 1.5),
    ("rail_stop_bottom", 1.5),
    ("stiction", 0.3),
    ("stribeck_speed", 10.0),
    ("disturbance_sine_spool", 1.0),
    ("disturbance_cosine_spool", -0.7),
    ("disturbance_sine_flow", 5.0),
    ("disturbance_cosine_flow", -4.0),
    ("disturbance_sine_position", 20.0),
    ("disturbance_cosine_position", -15.0),
    ("ripple_sine_spool", 1.0),
    ("ripple_cosine_spool", 0.5),
    ("overtone_sine_spool", 0.6),
    ("overtone_cosine_spool", -0.7),
    ("second_overtone_sine_spool", 0.5),
    ("second_overtone_cosine_spool", 0.4),
    ("ripple_sine_flow", 5.0),
    ("ripple_cosine_flow", 2.5),
    ("overtone_sine_flow", 3.0),
    ("overtone_cosine_flow", -3.5),
    ("second_overtone_sine_flow", 2.5),
    ("second_overtone_cosine_flow", 2.0),
    ("ripple_sine_position", 20.0),
    ("ripple_cosine_position", 10.0),
    ("overtone_sine_position", 12.0),
    ("overtone_cosine_position", -14.0),
    ("second_overtone_sine_position", 10.0),
    ("second_overtone_cosine_position", 8.0),
];

/// `base` with `effects`, each at this one of its trials (the last where it has fewer), searched near there.
pub(crate) fn planted(
    base: &Structure,
    effects: &[Effect],
    scale: &Scale,
    trial: usize,
    records: Vec<Record>,
) -> Problem {
    let structure = effects.iter().fold(base.clone(), |s, e| s.with(*e));
    let mut parameters = absent(&structure, scale);
    for effect in effects {
        let trials = effect.trials(scale);
        let trial = &trials[trial.min(trials.len() - 1)];
        plant(&mut parameters, *effect, scale, trial);
    }
    for parameter in &mut parameters {
        let known = |(name, _): &&(&str, f64)| parameter.name == *name;
        if let Some((_, value)) = AUDIBLE.iter().find(known) {
            parameter.set_nominal(*value);
        }
    }
    problem(structure, parameters, records)
}

/// Both kinds of command between rows.
pub(crate) const HOLDS: [Hold; 2] = [Hold::Held, Hold::Interpolated];

/// A case for every effect in every form on both structures, and for effects that act together.
pub(crate) fn cases() -> Vec<(String, Problem)> {
    let mut cases = Vec::new();
    let kinds = [
        (Hold::Held, false),
        (Hold::Interpolated, false),
        (Hold::Held, true),
        (Hold::Interpolated, true),
    ];
    let record = |uneven: bool| match uneven {
        false => Record::new(200, 1e-3, 12.0),
        true => Record::uneven(150, 1e-3, 12.0),
    };
    let mut add = |base: &Structure, effects: &[Effect], scale: &Scale, number: usize, kind| {
        let (hold, uneven) = kind;
        let base = Structure {
            hold,
            ..base.clone()
        };
        let problem = planted(&base, effects, scale, number, vec![record(uneven)]);
        let names: Vec<String> = effects.iter().map(Effect::to_string).collect();
        let rows = if uneven { "uneven" } else { "even" };
        let name = format!("{}, trial {number}, {hold:?}, {rows}", names.join(" + "));
        cases.push((name, problem));
    };
    for (base, effects) in everywhere() {
        let scale = scale(&base);
        for (number, effect) in effects.into_iter().enumerate() {
            // Each trial with another kind of record, an effect that is late with all of them.
            let trials = effect.trials(&scale).len();
            let count = if effect.entry.name == "delay" {
                4
            } else {
                trials.clamp(2, 3)
            };
            for i in 0..count {
                add(&base, &[effect], &scale, i, kinds[(number + i) % 4]);
            }
        }
    }
    for (base, texts) in [
        (
            bench(),
            &["delay", "hysteresis", "overlap", "sensor_lag.flow"][..],
        ),
        (bench(), &["friction", "stroke_limit", "flow_force"]),
        (
            bench(),
            &[
                "supply_droop",
                "line_resonance.flow",
                "periodic_disturbance.spool",
                "viscosity_drift",
            ],
        ),
        // What filters the flow sees how the pressure goes between two rows.
        (
            pressure_line(),
            &["compressibility.flow", "line_resonance.flow"],
        ),
    ] {
        let effects: Vec<Effect> = texts
            .iter()
            .map(|text| text.parse().expect("an effect"))
            .collect();
        let scale = Scale {
            temperature: true,
            ..scale(&base)
        };
        for (number, kind) in kinds.into_iter().enumerate() {
            add(&base, &effects, &scale, number.min(1), kind);
        }
    }
    cases
}
