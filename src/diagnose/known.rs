//! What is known of the rows that count: when they were taken, and the signals on which a residual may depend.

use super::measurements::starts;
use super::simulation::Compared;
use crate::model::{Input, Output, Outputs, Structure};

/// A signal other than the command and time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KnownSignal {
    SimulatedSpool,
    SquaredFlow,
    SupplyPressure,
    LoadPressure,
    SpoolTimesDrop,
    Temperature,
}

impl KnownSignal {
    const ALL: [Self; 6] = [
        Self::SimulatedSpool,
        Self::SquaredFlow,
        Self::SupplyPressure,
        Self::LoadPressure,
        Self::SpoolTimesDrop,
        Self::Temperature,
    ];

    /// What a report calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::SimulatedSpool => "simulated spool",
            Self::SquaredFlow => "flow^2",
            Self::SupplyPressure => "supply pressure",
            Self::LoadPressure => "load pressure",
            Self::SpoolTimesDrop => "spool times pressure drop",
            Self::Temperature => "temperature",
        }
    }

    /// Its unit in a model of this `structure`.
    pub(super) fn unit(self, structure: &Structure) -> String {
        let spool = structure.unit(Output::Spool);
        match self {
            Self::SimulatedSpool => spool.into(),
            Self::SquaredFlow => "(L/min)²".into(),
            Self::SupplyPressure | Self::LoadPressure => "bar".into(),
            Self::SpoolTimesDrop => format!("{spool} bar"),
            Self::Temperature => "degC".into(),
        }
    }

    /// Its value in a row.
    fn of(self, input: &Input<f64>, simulated: &Outputs<f64>) -> f64 {
        let (spool, flow) = (simulated[Output::Spool], simulated[Output::Flow]);
        match self {
            Self::SimulatedSpool => spool,
            Self::SquaredFlow => flow * flow.abs(),
            Self::SupplyPressure => input.supply,
            Self::LoadPressure => input.a - input.b,
            Self::SpoolTimesDrop => spool * (input.supply - input.tank),
            Self::Temperature => input.temperature,
        }
    }
}

/// What is known of the rows that count, one record after another.
pub(super) struct KnownRows {
    /// The row at which each record starts.
    pub(super) starts: Vec<usize>,
    /// Time of each row, s.
    pub(super) time: Vec<f64>,
    /// The command in each row.
    pub(super) command: Vec<f64>,
    /// The other signals, without those that are zero throughout because they were not measured.
    pub(super) signals: Vec<(KnownSignal, Vec<f64>)>,
}

impl KnownRows {
    /// Of records beside their simulation.
    pub(super) fn new(compared: &[Compared]) -> Self {
        let mut rows = Vec::new();
        for one in compared {
            let all = one.series.time.iter().zip(&one.series.samples);
            let counted = all
                .zip(one.simulated)
                .filter(|((_, sample), _)| sample.weight > 0.0);
            rows.extend(counted.map(|((time, sample), outputs)| (*time, sample.input, outputs)));
        }
        let values = |signal: KnownSignal| {
            let values = rows
                .iter()
                .map(|(_, input, outputs)| signal.of(input, outputs));
            (signal, values.collect::<Vec<f64>>())
        };
        let measured = |(_, values): &(_, Vec<f64>)| values.iter().any(|value| *value != 0.0);
        Self {
            starts: starts(compared.iter().map(|one| one.series)),
            time: rows.iter().map(|row| row.0).collect(),
            command: rows.iter().map(|row| row.1.command).collect(),
            signals: KnownSignal::ALL
                .map(values)
                .into_iter()
                .filter(measured)
                .collect(),
        }
    }
}
