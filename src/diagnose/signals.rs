//! The signals inside a model.

use crate::evaluate::problem::Series;
use crate::evaluate::{Problem, reference};
use crate::model::{Complete, Output, Signal};

/// The signals over all fitted rows.
pub(super) struct Signals([Vec<f64>; 4]);

impl Signals {
    /// Those of `problem`'s model at its start, over `records`.
    pub(super) fn new(records: &[Series], problem: &Problem) -> Self {
        let mut structure = problem.structure.clone();
        // The spool in the unit of the command, whatever is measured and whatever its sensor adds.
        if let Some(base) = structure.servo_valve_mut() {
            base.spool_unit = None;
        }
        structure.observed = vec![Output::Spool];
        structure.effects.retain(|effect| effect.output.is_none());
        structure.free_form = structure.free_form.filter(|form| form.output.is_none());
        let parameters = structure.parameters();
        let known = &problem.parameters;
        let value = |name: &str| known.iter().find(|p| p.name == name).map(|p| p.nominal());
        let values: Complete<f64> = parameters
            .iter()
            .map(|p| value(&p.name).unwrap_or(p.nominal()))
            .collect();
        let mut signals: [Vec<f64>; 4] = Default::default();
        for (record, rows) in records
            .iter()
            .zip(reference::trajectories(&structure, &values, records))
        {
            for k in 0..rows.len() {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
                let seconds = record.time[after] - record.time[before];
                let sample = &record.samples[k];
                let speed = (rows[after][Output::Spool] - rows[before][Output::Spool])
                    / seconds.max(f64::MIN_POSITIVE);
                let spool = rows[k][Output::Spool];
                let values = [sample.input.command, spool, speed, sample.input.time];
                for (signal, value) in signals.iter_mut().zip(values) {
                    signal.push(value);
                }
            }
        }
        Self(signals)
    }

    pub(super) fn of(&self, signal: Signal) -> &[f64] {
        &self.0[signal as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated;
    use crate::evaluate::problem::{Data, Sample};
    use crate::model::effects::Effect;
    use crate::model::{Input, Outputs, Structure};

    #[test]
    fn what_a_known_sensor_adds_is_no_signal_of_the_valve() {
        let command = simulated::command(800);
        let time: Vec<f64> = (0..800).map(|k| 1e-3 * f64::from(k)).collect();
        let sample = |(&command, &time): (&f64, &f64)| Sample {
            input: Input {
                command,
                time,
                ..Input::default()
            },
            weight: 1.0,
            ..Sample::default()
        };
        let mut series = Series {
            name: "run".into(),
            measured: Outputs::all(true),
            samples: command.iter().zip(&time).map(sample).collect(),
            time,
        };
        let bare = Structure::actuator(10.0, "V");
        series.set_steps(bare.fastest_rate(&bare.parameters()), 1);
        let records = [series];
        let signals = |structure: Structure, values: &[(&str, f64)]| {
            let mut parameters = structure.parameters();
            for parameter in &mut parameters {
                let value = values.iter().find(|(name, _)| *name == parameter.name);
                parameter.set_nominal(value.map_or(parameter.nominal(), |(_, value)| *value));
            }
            let problem = Problem::new(structure, parameters, Data::Series(Vec::new()));
            Signals::new(&records, &problem).0
        };
        let with = |names: &[&str]| {
            let effects = names.iter().map(|name| name.parse::<Effect>().unwrap());
            effects.fold(bare.clone(), |structure, effect| structure.with(effect))
        };
        let known = signals(
            with(&["sensor_offset.spool", "sensor_drift.spool"]),
            &[("sensor_offset_spool", 0.4), ("sensor_drift_spool", 0.3)],
        );
        assert_eq!(known, signals(bare.clone(), &[]));
        // What acts on the spool itself is one.
        let biased = signals(with(&["null_bias"]), &[("null_bias", 0.4)]);
        let spool = Signal::Spool as usize;
        assert!((biased[spool][0] - known[spool][0] - 0.4).abs() < 1e-9);
    }
}
