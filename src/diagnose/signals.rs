//! The signals inside a model.

use super::evidence::{Evidence, Model, Side};
use crate::evaluate::reference;
use crate::model::{Output, Signal};

/// The signals over all fitted rows.
pub(super) struct Signals([Vec<f64>; 4]);

impl Signals {
    pub(super) fn new(evidence: &Evidence, base: &Model) -> Self {
        let mut structure = base.structure().clone();
        // The spool in the unit of the command, whatever is measured.
        structure.spool_unit = None;
        structure.observed = vec![Output::Spool];
        structure.valve = None;
        let actuator = structure.parameters();
        let known = &base.problem.parameters;
        let value = |name: &str| known.iter().find(|p| p.name == name).map(|p| p.start);
        let values: Vec<f64> = actuator
            .iter()
            .map(|p| value(&p.name).unwrap_or(p.start))
            .collect();
        let mut signals: [Vec<f64>; 4] = Default::default();
        let records = evidence.records(Side::Fit);
        for (record, rows) in records
            .iter()
            .zip(reference::trajectories(&structure, &values, records))
        {
            for k in 0..rows.len() {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
                let seconds = record.time[after] - record.time[before];
                let sample = &record.samples[k];
                let speed = (rows[after][0] - rows[before][0]) / seconds.max(f64::MIN_POSITIVE);
                for (signal, value) in
                    signals
                        .iter_mut()
                        .zip([sample.input[0], rows[k][0], speed, sample.input[6]])
                {
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
