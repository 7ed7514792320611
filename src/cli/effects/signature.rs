//! The signature of an effect: what it adds to the outputs of a model that is right in all else.

use servobee::Result;
use servobee::evaluate::problem::Series;
use servobee::evaluate::simulate::outputs;
use servobee::model::effects::view::{Excitation, Over, Values, View};
use servobee::model::effects::{Effect, Entry, Scale};
use servobee::model::valve::{Drop, Meter, ValveForm};
use servobee::model::{Complete, Output, Outputs, Parameter, ServoValve, Structure};
use servobee::record::{self, Channel, Record};
use std::f64::consts::TAU;

/// Rows a second.
const RATE: f64 = 1000.0;
/// The command at full scale, V.
pub(super) const FULL_SCALE: f64 = 10.0;
/// Values of the base model's parameters: a servo valve that passes 100 L/min at its rated drop of 10 bar.
const VALVE: [(&str, f64); 5] = [
    ("gain", 200.0),
    ("time_constant", 0.003),
    ("saturation", 3.0),
    ("max_area", 0.6943),
    ("piston_area", 20.0),
];

/// How long it lasts, s.
fn seconds(command: Excitation) -> f64 {
    match command {
        Excitation::Triangle {
            period, periods, ..
        } => period * f64::from(periods),
        Excitation::Chirp => 4.0,
        Excitation::Step { seconds } => seconds,
    }
}

/// The command at a time, V.
fn at(command: Excitation, time: f64) -> f64 {
    match command {
        Excitation::Triangle { height, period, .. } => {
            let phase = (time / period + 0.25).fract();
            height * (1.0 - 4.0 * (phase - 0.5).abs())
        }
        Excitation::Chirp => 5.0 * (TAU * (0.5 * time + 0.5 * 4.5 / 4.0 * time * time)).sin(),
        Excitation::Step { seconds } if time < 0.1 * seconds => 0.0,
        Excitation::Step { .. } => 5.0,
    }
}

/// The row with which the second period starts, where that shows what goes on for ever.
fn second_period(command: Excitation) -> usize {
    match command {
        Excitation::Triangle { period, .. } => (period * RATE) as usize,
        _ => 0,
    }
}

fn describe(command: Excitation) -> String {
    match command {
        Excitation::Triangle { height, period, .. } => {
            format!("a triangle of +-{height} V every {period} s")
        }
        Excitation::Chirp => "a sine of 5 V from 0.5 to 5 Hz in 4 s".into(),
        Excitation::Step { .. } => "a step of 5 V".into(),
    }
}

/// A residual over what gives the effect away.
pub(super) struct Signature {
    /// The parameters of the effect and their values.
    pub(super) values: Vec<(Parameter, f64)>,
    /// What is commanded.
    pub(super) command: String,
    /// What the axes are.
    pub(super) names: [String; 2],
    /// Over and residual.
    pub(super) points: Vec<[f64; 2]>,
}

/// The structures that effects are shown on: spool, flow and position of a piston; and the same with the flow measured in the
/// pressure line, or with a measured supply, for what shows there alone.
fn benches() -> [Structure; 3] {
    [
        (Meter::Load, Drop::Rated),
        (Meter::Supply, Drop::Rated),
        (Meter::Load, Drop::Supply),
    ]
    .map(|(meter, drop)| Structure {
        observed: vec![Output::Spool, Output::Flow, Output::Position],
        base: ServoValve::with(ValveForm {
            meter,
            drop,
            ..ValveForm::linear()
        })
        .into(),
        ..Structure::actuator(FULL_SCALE, "V")
    })
}

/// The first of them on which `entry` acts.
fn bench(entry: &'static Entry) -> Structure {
    let [usual, others @ ..] = benches();
    let mut others = others.into_iter();
    match entry.on(&usual).is_empty() {
        true => others
            .find(|one| !entry.on(one).is_empty())
            .unwrap_or(usual),
        false => usual,
    }
}

/// The forms in which `entry` is shown.
pub(super) fn forms(entry: &'static Entry) -> Vec<Effect> {
    entry.on(&bench(entry))
}

/// How large things are on a record of so many seconds; a disturbance would be mains hum.
pub(super) fn scale(seconds: f64) -> Scale {
    let [structure, ..] = benches();
    Scale {
        command: FULL_SCALE,
        command_unit: structure.command_unit.clone(),
        outputs: Outputs::from_fn(|output| match output {
            Output::Spool => FULL_SCALE,
            _ => 100.0,
        }),
        units: Outputs::from_fn(|output| structure.unit(output).to_owned()),
        interval: 1.0 / RATE,
        length: seconds,
        temperature: false,
        pressure: false,
        rated_drop: 10.0,
        speed: 20.0 * structure.full_scale,
        lines: Outputs::all(Some(50.0)),
    }
}

/// A simulation of the bench with an effect or without it.
struct Bench {
    base: Vec<Parameter>,
    series: Series,
    bare: Structure,
    structure: Structure,
}

impl Bench {
    fn new(effect: Effect, command: Excitation) -> Result<Self> {
        let rows = (seconds(command) * RATE).round() as usize + 1;
        let time: Vec<f64> = (0..rows).map(|row| row as f64 / RATE).collect();
        let volts: Vec<f64> = time.iter().map(|&time| at(command, time)).collect();
        // The supply gives way as the valve opens.
        let pressure = |volts: &f64| 10.0 * (1.0 - 0.4 * volts.abs() / FULL_SCALE);
        let bar = volts.iter().map(pressure).collect();
        let channels = [
            (Channel::Command, record::Series::new("V", volts)),
            (Channel::SupplyPressure, record::Series::new("bar", bar)),
        ];
        let record = Record::new("bench", time, channels)?;
        let bare = bench(effect.entry);
        let structure = bare.with(effect);
        let mut series = Series::to_simulate(&record, &structure)?;
        let parameters = structure.parameters_at(&scale(seconds(command)));
        series.set_steps(structure.fastest_rate(&parameters), 1);
        let mut base = bare.parameters();
        for parameter in &mut base {
            let value = VALVE.iter().find(|(name, _)| *name == parameter.name);
            parameter.set_nominal(value.map_or(parameter.nominal(), |value| value.1));
        }
        Ok(Self {
            base,
            series,
            bare,
            structure,
        })
    }

    fn without(&self) -> Vec<Outputs<f64>> {
        let values = Complete::nominal(&self.base);
        outputs(&self.bare, &values, &self.series)
    }

    fn with(&self, own: &[f64]) -> Vec<Outputs<f64>> {
        let base = Complete::nominal(&self.base);
        let values = base.as_slice().iter().chain(own).copied().collect();
        outputs(&self.structure, &values, &self.series)
    }
}

/// Every parameter of `effect` with the value at which the effect is absent, or none where the others see to that.
pub(super) fn absent(effect: Effect) -> Result<Vec<(Parameter, Option<f64>)>> {
    let command = effect.view().excitation;
    let parameters = effect.parameters(&scale(seconds(command)));
    let start = |parameter: &Parameter| {
        let given = effect.entry.neutral.iter();
        let bare = |name: &str| match effect.output {
            Some(output) => parameter.name == format!("{name}_{}", output.name()),
            None => parameter.name == name,
        };
        let mut given = given.filter(|(name, _)| bare(name));
        given
            .next()
            .map_or(parameter.nominal(), |neutral| neutral.1)
    };
    let neutral: Vec<f64> = parameters.iter().map(start).collect();
    let bench = Bench::new(effect, command)?;
    let absent = bench.with(&neutral);
    let value = |i: usize| {
        let Parameter { low, high, .. } = parameters[i];
        let mut other = neutral.clone();
        other[i] = if neutral[i] > low { low } else { high };
        (bench.with(&other) != absent).then_some(neutral[i])
    };
    let values: Vec<Option<f64>> = (0..parameters.len()).map(value).collect();
    Ok(parameters.into_iter().zip(values).collect())
}

impl Signature {
    /// The signature of `effect` on the bench.
    pub(super) fn new(effect: Effect) -> Result<Self> {
        let View {
            excitation: command,
            over,
            values,
        } = effect.view();
        let output = effect.looked_at();
        let scale = scale(seconds(command));
        let trials = effect.trials(&scale);
        let free = match values {
            Values::Trial(index) => &trials[index.min(trials.len() - 1)],
            Values::Given(values) => values,
        };
        let mut free = free.iter().copied();
        let values: Vec<(Parameter, f64)> = effect
            .parameters(&scale)
            .into_iter()
            .map(|parameter| {
                let value = match parameter.is_fixed() {
                    true => parameter.nominal(),
                    false => free.next().unwrap_or(parameter.nominal()),
                };
                (parameter, value)
            })
            .collect();
        let bench = Bench::new(effect, command)?;
        let own: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
        let (without, with) = (bench.without(), bench.with(&own));

        let of = |output: Output| without.iter().map(|row| row[output]).collect();
        let commanded = || {
            let samples = bench.series.samples.iter();
            samples.map(|sample| sample.input.command).collect()
        };
        let unit = |output: Output| bench.structure.unit(output);
        let simulated = |output: Output| {
            let name = format!("{} [{}]", output.name(), unit(output));
            (of(output), name)
        };
        let first = match over {
            Over::Time => 0,
            _ => second_period(command),
        };
        let (over, name): (Vec<f64>, String) = match over {
            Over::Time => (bench.series.time.clone(), "time [s]".into()),
            Over::Command => (commanded(), "command [V]".into()),
            Over::CommandRate => (rate(commanded()), "rate of the command [V/s]".into()),
            Over::Spool => simulated(Output::Spool),
            Over::Flow => simulated(Output::Flow),
            Over::OutputRate => (
                rate(of(output)),
                format!("rate of the {} [{}/s]", output.name(), unit(output)),
            ),
        };
        let residual = with
            .iter()
            .zip(&without)
            .map(|(with, without)| with[output] - without[output]);
        let points = over.into_iter().zip(residual).map(|(x, y)| [x, y]);
        Ok(Self {
            values,
            command: describe(command),
            names: [
                name,
                format!("residual of the {} [{}]", output.name(), unit(output)),
            ],
            points: points.skip(first).collect(),
        })
    }
}

/// The rate of change between the neighbours of each row, 1/s.
fn rate(values: Vec<f64>) -> Vec<f64> {
    let last = values.len() - 1;
    let slope = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        (values[after] - values[before]) / (after - before) as f64 * RATE
    };
    (0..=last).map(slope).collect()
}
