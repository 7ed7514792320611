//! What the oil was at while records were made.

use crate::record::{Channel, Record};
use serde::Serialize;

/// The means over all records; none where it was not measured in all of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Conditions {
    /// Supply pressure, bar.
    pub supply_pressure: Option<f64>,
    /// Pressure in the return line, bar.
    pub return_pressure: Option<f64>,
    /// Temperature, °C.
    pub temperature: Option<f64>,
}

impl Conditions {
    /// Those of `records`.
    pub fn of(records: &[&Record]) -> Self {
        let mean = |channel: Channel| {
            let series: Option<Vec<_>> = records.iter().map(|record| record.get(channel)).collect();
            let values = || series.iter().flatten().flat_map(|one| &one.values);
            let count = values().count() as f64;
            (count > 0.0).then(|| values().sum::<f64>() / count)
        };
        Self {
            supply_pressure: mean(Channel::SupplyPressure),
            return_pressure: mean(Channel::ReturnPressure),
            temperature: mean(Channel::Temperature),
        }
    }
}
