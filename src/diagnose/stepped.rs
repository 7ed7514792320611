//! Rows whose integration steps suit what is simulated on them.

use crate::evaluate::problem::{Data, Problem, Series};
use crate::model::integrate::substeps;
use crate::model::{Parameter, Structure};
use std::sync::{Arc, OnceLock};

/// How often the steps can be halved: what is faster than that no row shows.
const HALVINGS: usize = 4;

/// The same rows in steps that suit one rate, and in halves and quarters of them and so on for what is faster.
#[derive(Debug)]
pub(super) struct Stepped {
    /// The slowest rate that steps follow, 1/s.
    rate: f64,
    /// How many times longer than its own may be the steps that suit a faster rate.
    longer: f64,
    /// The longest time between two rows, s.
    longest: f64,
    whole: Arc<Data>,
    halved: [OnceLock<Arc<Data>>; HALVINGS],
}

impl Stepped {
    /// `records` for rates from this `rate`, 1/s, on, and faster ones in steps this many times `longer` than theirs.
    pub(super) fn new(records: Vec<Series>, rate: f64, longer: f64) -> Self {
        let rows = records.iter().flat_map(|record| record.time.windows(2));
        Self {
            rate,
            longer,
            longest: rows.map(|row| row[1] - row[0]).fold(0.0, f64::max),
            whole: in_steps(records, rate),
            halved: Default::default(),
        }
    }

    /// The rows in steps that suit the slowest rate.
    pub(super) fn records(&self) -> &[Series] {
        match &*self.whole {
            Data::Series(records) => records,
            Data::Tones(_) => unreachable!("these are records"),
        }
    }

    /// `problem` on these rows, in steps that suit its start.
    pub(super) fn under(&self, problem: &Problem) -> Problem {
        Problem {
            data: self.suiting(rate_at_start(problem)).clone(),
            ..problem.clone()
        }
    }

    /// The rows in steps that suit this `rate`, 1/s.
    pub(super) fn suiting(&self, rate: f64) -> &Arc<Data> {
        let faster = rate / self.longer / self.rate;
        let halvings = faster.log2().ceil().clamp(0.0, HALVINGS as f64);
        let rate = self.rate * halvings.exp2();
        if substeps(self.longest, rate) <= substeps(self.longest, self.rate) {
            return &self.whole;
        }
        self.halved[halvings as usize - 1].get_or_init(|| in_steps(self.records().to_vec(), rate))
    }
}

/// The rate that steps have to follow where `problem` starts, 1/s.
pub(super) fn rate_at_start(problem: &Problem) -> f64 {
    rate_at(&problem.structure, &problem.parameters)
}

/// The same of a `structure` at the nominal values of its `parameters`.
pub(super) fn rate_at(structure: &Structure, parameters: &[Parameter]) -> f64 {
    let mut here = parameters.to_vec();
    for parameter in &mut here {
        (parameter.low, parameter.high) = (parameter.nominal(), parameter.nominal());
    }
    structure.fastest_rate(&here)
}

fn in_steps(mut records: Vec<Series>, rate: f64) -> Arc<Data> {
    records
        .iter_mut()
        .for_each(|record| record.set_steps(rate, 1));
    Arc::new(Data::Series(records))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    #[test]
    fn steps_are_shorter_for_what_is_faster_and_no_rows_are_kept_twice() {
        let Data::Series(records) = (*workload::actuator(50).data).clone() else {
            unreachable!()
        };
        let interval = records[0].time[1] - records[0].time[0];
        let rows = Stepped::new(records, 1.2 / interval, 2.0);
        let steps = |times: f64| {
            let Data::Series(records) = &**rows.suiting(times / interval) else {
                unreachable!()
            };
            records[0].samples[0].substeps
        };
        // 0.7 of the rate's time constant at most, of those that are faster than the slowest twice that.
        assert_eq!([0.1, 2.4, 2.5, 4.9, 1e9].map(steps), [2, 2, 4, 7, 28]);
        assert!(Arc::ptr_eq(rows.suiting(3.0), rows.suiting(4.0)));
        assert_eq!(rows.records()[0].samples[0].substeps, 2);
        let slow = Stepped::new(rows.records().to_vec(), 1e-3 / interval, 1.0);
        assert!(Arc::ptr_eq(slow.suiting(0.0), slow.suiting(0.5 / interval)));
    }
}
