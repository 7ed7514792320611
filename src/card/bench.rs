//! The test bench that a fitted valve is put on: its structure without the sensors of the record, and the commands of
//! ISO 10770-1's tests.

use crate::evaluate::Problem;
use crate::evaluate::problem::{Data, Sample, Series};
use crate::evaluate::simulate::outputs;
use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
use crate::model::effects::{Host, Port};
use crate::model::valve::{AreaLaw, Drop, Meter, RATED_DROP};
use crate::model::{
    Complete, Dynamics, Hold, Initial, Input, Output, Outputs, Parameter, Plant, Structure,
};

/// Pressure from P to T where the record's was measured, bar: at which servo valves are rated.
pub(super) const DROP: f64 = 70.0;
/// Share of an interval after which an answer counts as settled.
const SETTLED: f64 = 0.99;
/// How long each command of a slow test is kept: at least this, s, and so many of the slowest time constants.
const REST: (f64, f64) = (0.2, 12.0);
/// Temperature of the oil, °C: that of ISO 10770-1's tests.
const TEMPERATURE: f64 = 40.0;

/// A valve with values for its parameters, on the bench.
#[derive(Debug, Clone)]
pub(super) struct Bench {
    pub(super) structure: Structure,
    values: Vec<(String, f64)>,
    /// Pressure from P to T, bar.
    supply: f64,
    /// That of the records with blocked ports, if there are any.
    blocked_supply: Option<f64>,
}

impl Bench {
    /// The valve of `problem`, whose parameters have these `values`. What only a sensor adds is left out.
    pub(super) fn new(problem: &Problem, values: &Complete<f64>) -> Self {
        let structure = &problem.structure;
        let mut bench = Structure {
            hold: Hold::Held,
            initial: Initial::Equilibrium,
            observed: vec![Output::Spool],
            ..structure.clone()
        };
        if bench.valve().is_some() {
            bench.observed.push(Output::Flow);
        }
        set_meter(&mut bench, Meter::Load);
        let observed = bench.observed.clone();
        bench.effects.retain(|effect| {
            let there = effect
                .output
                .is_none_or(|output| observed.contains(&output));
            effect.entry.port != Port::Measurement && there
        });
        bench.free_form = bench
            .free_form
            .filter(|form| form.port != Port::Measurement);
        let names = problem
            .parameters
            .iter()
            .map(|parameter| parameter.name.clone());
        Self {
            structure: bench,
            values: names.zip(values.as_slice().iter().copied()).collect(),
            supply: DROP,
            blocked_supply: blocked_supply(&problem.data),
        }
    }

    /// The same valve with its ports A and B blocked, at the pressure that the records of such tests had; `None` where there
    /// are none.
    pub(super) fn with_blocked_ports(&self) -> Option<Self> {
        let supply = self.blocked_supply.filter(|_| self.structure.has_edges())?;
        let mut bench = self.clone();
        bench.supply = supply;
        bench.structure.observed = vec![Output::ReturnFlow, Output::LoadPressure];
        Some(bench)
    }

    /// The same valve with its flow measured in the pressure line.
    pub(super) fn with_flow_of_supply(&self) -> Self {
        let mut bench = self.clone();
        set_meter(&mut bench.structure, Meter::Supply);
        bench
    }

    /// The value of a parameter, if there is one of this name.
    pub(super) fn value(&self, name: &str) -> Option<f64> {
        let found = self.values.iter().find(|(own, _)| own == name);
        found.map(|(_, value)| *value)
    }

    /// Whether the base model is a servo valve.
    pub(super) fn is_servo_valve(&self) -> bool {
        self.structure.servo_valve().is_some()
    }

    /// Gain, time constant and saturation, where an actuator moves the spool.
    pub(super) fn actuator(&self) -> Option<[f64; 3]> {
        let moves = self.is_servo_valve() && self.structure.has(Port::Actuator);
        moves.then(|| {
            [GAIN, TIME_CONSTANT, SATURATION]
                .map(|name| self.value(name).expect("an actuator has all three"))
        })
    }

    /// The slowest time constant of the unsaturated loop, s: that of the slower root of s² + s/T + K/T.
    pub(super) fn slowest(&self) -> f64 {
        let Some([gain, time_constant, _]) = self.actuator() else {
            return 0.0;
        };
        let rest = 1.0 - 4.0 * gain * time_constant;
        2.0 * time_constant / (1.0 - rest.max(0.0).sqrt())
    }

    /// How long a command takes to arrive, s.
    pub(super) fn delay(&self) -> f64 {
        let values = Complete::nominal(&self.parameters());
        Plant::new(&self.structure, &values).delay().unwrap_or(0.0)
    }

    /// How long a command has to be kept, s, until the valve is at rest.
    pub(super) fn rest(&self) -> f64 {
        REST.0.max(REST.1 * self.slowest()) + 2.0 * self.delay()
    }

    /// The parameters of the structure on the bench: nothing is left between their bounds but their values.
    fn parameters(&self) -> Vec<Parameter> {
        let mut parameters = self.structure.parameters();
        for parameter in &mut parameters {
            let value = self.value(&parameter.name).unwrap_or(parameter.nominal());
            (parameter.low, parameter.high) = (value, value);
            parameter.set_nominal(value);
        }
        parameters
    }

    /// The pressure from P to T, bar, where there is a valve.
    pub(super) fn drop(&self) -> Option<f64> {
        let valve = self.structure.valve()?;
        match valve.drop {
            Drop::Rated => self.value(RATED_DROP),
            Drop::Supply | Drop::Ports => Some(self.supply),
        }
    }

    /// The opening up to which both sides' areas are known, %: beyond the last of a table they are taken as constant.
    pub(super) fn reach(&self) -> f64 {
        match self.structure.valve().map(|valve| &valve.area) {
            Some(AreaLaw::Table(openings)) => openings[openings.len() - 1],
            Some(AreaLaw::Signed(openings)) => openings[openings.len() - 1].min(-openings[0]),
            Some(AreaLaw::Linear | AreaLaw::Proportional | AreaLaw::Edges) | None => f64::INFINITY,
        }
    }

    /// Spool and flow when the command is each of `commands` for `interval` seconds: what they are when it is given.
    pub(super) fn run(&self, commands: &[f64], interval: f64) -> Vec<[f64; 2]> {
        let time = (0..commands.len()).map(|k| interval * k as f64).collect();
        let rows = self.simulate(commands, time);
        rows.iter().map(spool_and_flow).collect()
    }

    /// The same, but what they are when that command has been there for nearly `interval` seconds: the answer to the command
    /// itself, of a spool that moves as of one that follows at once.
    pub(super) fn settled(&self, commands: &[f64], interval: f64) -> Vec<[f64; 2]> {
        let rows = self.settled_outputs(commands, interval);
        rows.iter().map(spool_and_flow).collect()
    }

    /// The same, with all outputs.
    pub(super) fn settled_outputs(&self, commands: &[f64], interval: f64) -> Vec<Outputs<f64>> {
        let twice: Vec<f64> = commands.iter().flat_map(|&command| [command; 2]).collect();
        let time = (0..commands.len())
            .flat_map(|k| [0.0, SETTLED].map(|share| interval * (k as f64 + share)))
            .collect();
        self.simulate(&twice, time)
            .into_iter()
            .skip(1)
            .step_by(2)
            .collect()
    }

    /// The outputs at each `time` at which one of `commands` is given.
    fn simulate(&self, commands: &[f64], time: Vec<f64>) -> Vec<Outputs<f64>> {
        let input = |command, time| Input {
            command,
            supply: self.supply,
            tank: 0.0,
            a: self.supply / 2.0,
            b: self.supply / 2.0,
            temperature: TEMPERATURE,
            time,
        };
        let sample = |(&command, &time): (&f64, &f64)| Sample {
            input: input(command, time),
            weight: 1.0,
            ..Sample::default()
        };
        let mut record = Series {
            name: "bench".into(),
            measured: Outputs::all(true),
            samples: commands.iter().zip(&time).map(sample).collect(),
            time,
        };
        let parameters = self.parameters();
        record.set_steps(self.structure.fastest_rate(&parameters), 1);
        let values = Complete::nominal(&parameters);
        outputs(&self.structure, &values, &record)
    }
}

fn spool_and_flow(row: &Outputs<f64>) -> [f64; 2] {
    [row[Output::Spool], row[Output::Flow]]
}

/// The mean pressure from P to T, bar, in the records whose ports were blocked; that of the bench where none was measured.
fn blocked_supply(data: &Data) -> Option<f64> {
    let Data::Series(records) = data else {
        return None;
    };
    let blocked = |record: &&Series| {
        let mut measured = record.measured.iter();
        measured.any(|(output, measured)| output.is_of_blocked_ports() && *measured)
    };
    let rows = records.iter().filter(blocked).flat_map(|one| &one.samples);
    let drops: Vec<f64> = rows.map(|row| row.input.supply - row.input.tank).collect();
    let mean = drops.iter().sum::<f64>() / drops.len() as f64;
    match drops.is_empty() {
        true => None,
        false if mean > 0.0 => Some(mean),
        false => Some(DROP),
    }
}

fn set_meter(structure: &mut Structure, meter: Meter) {
    let base = structure.servo_valve_mut();
    if let Some(valve) = base.and_then(|base| base.valve.as_mut()) {
        valve.meter = meter;
    }
}
