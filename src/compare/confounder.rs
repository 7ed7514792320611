//! What else may differ between two benches than the valve.

use crate::diagnose::Conditions;
use crate::model::Output;
use crate::model::Structure;
use crate::model::effects::Effect;
use crate::model::valve::Drop;
use crate::record::{Channel, Record};
use crate::{Error, Result};
use serde::Serialize;

/// Pressures that differ by less than this share are the same.
const SAME_PRESSURE: f64 = 0.01;
/// And temperatures by less than this, K.
const SAME_TEMPERATURE: f64 = 2.0;

/// Refuses records that are not alike: what was observed on one side alone cannot have changed.
///
/// # Errors
/// A channel that one side alone has.
pub fn check_alike(before: &[Record], after: &[Record]) -> Result<()> {
    let all_have = |records: &[Record], channel: Channel| {
        records.iter().all(|record| record.get(channel).is_some())
    };
    for channel in Output::ALL.map(Output::channel) {
        let sides = [before, after].map(|records| all_have(records, channel));
        let (lacking, having) = match sides {
            [true, false] => (after, before),
            [false, true] => (before, after),
            _ => continue,
        };
        let lacks = lacking.iter().find(|record| record.get(channel).is_none());
        return Err(Error::input(
            &lacks.unwrap_or(&lacking[0]).path,
            format!("has no {channel}, which {} has", having[0].path),
            "compare records of the same channels: measure it on both sides, or leave the column out of the other file",
        ));
    }
    Ok(())
}

/// What can differ beside the valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// In bar.
    SupplyPressure,
    /// In °C.
    Temperature,
}

/// A condition that differs between the two sides, or may, and could be taken for a change of the valve.
#[derive(Debug, Clone, PartialEq)]
pub struct Confounder {
    /// Which.
    pub condition: Condition,
    /// Its mean before, where it was measured.
    pub before: Option<f64>,
    /// Its mean after, where it was measured.
    pub after: Option<f64>,
    /// Whether the model follows it, so that what is said of the valve is without it.
    pub modelled: bool,
}

/// What differs between the conditions before and after, or is not known, where `structure` was fitted to both.
pub(super) fn confounders(
    [before, after]: [&Conditions; 2],
    structure: &Structure,
) -> Vec<Confounder> {
    let follows_pressure = structure
        .valve()
        .is_some_and(|valve| valve.drop != Drop::Rated);
    let effects = &structure.effects;
    let follows_heat = effects.iter().any(Effect::follows_heat);
    let confounder = |condition, means: [Option<f64>; 2], within: f64, follows: bool| {
        let same = match means {
            [Some(before), Some(after)] => f64::abs(after - before) <= within,
            _ => false,
        };
        (!same).then_some(Confounder {
            condition,
            before: means[0],
            after: means[1],
            modelled: follows && means.iter().all(Option::is_some),
        })
    };
    let pressures = [before.supply_pressure, after.supply_pressure];
    let same_pressure = SAME_PRESSURE * pressures[0].unwrap_or(0.0).abs();
    let temperatures = [before.temperature, after.temperature];
    let pressure = confounder(
        Condition::SupplyPressure,
        pressures,
        same_pressure,
        follows_pressure,
    );
    let heat = confounder(
        Condition::Temperature,
        temperatures,
        SAME_TEMPERATURE,
        follows_heat,
    );
    pressure.into_iter().chain(heat).collect()
}
