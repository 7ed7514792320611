//! What records of tests with blocked ports ask of the base model, beside records of other tests of the same valve.

use super::bounds::around;
use crate::model::edges::{PILOT_FLOW, edge_name};
use crate::model::effects::Host;
use crate::model::valve::{MAX_AREA, RATED_DROP};
use crate::model::{Output, Parameter, Structure};
use crate::record::{Channel, Direction, Record, Series};
use crate::{Error, Result};

/// The gap of an edge that just meets, as a share of what is open at full stroke, from which a search begins.
const GAP_AT_NULL: f64 = 0.01;

/// The outputs that some of `records` measure with their ports blocked.
pub(super) fn observed(records: &[Record]) -> Vec<Output> {
    let measured = |output: &Output| {
        let mut records = records.iter();
        records.any(|record| record.responses().contains(&output.channel()))
    };
    let outputs = Output::ALL.into_iter();
    outputs
        .filter(|output| output.is_of_blocked_ports() && measured(output))
        .collect()
}

/// Refuses records of several tests of which some do not say under which pressure: each test has its own.
pub(super) fn check_supply(records: &[Record]) -> Result<()> {
    let blocked = records.iter().filter(|record| record.has_blocked_ports());
    let both = (1..records.len()).contains(&blocked.count());
    let lacks = |record: &&Record| record.get(Channel::SupplyPressure).is_none();
    match records.iter().find(lacks) {
        Some(record) if both => Err(Error::input(
            &record.path,
            "has no supply_pressure, and tests with open and with blocked ports are fitted together",
            "add a column \"supply_pressure [bar]\" with what the supply had in that test, or identify the tests apart",
        )),
        _ => Ok(()),
    }
}

/// How the pressure at A, less that at B, goes with the command.
pub(super) fn direction(record: &Record) -> Direction {
    let of = |channel| record.direction(channel);
    match (
        of(Channel::LoadPressure),
        of(Channel::PressureA),
        of(Channel::PressureB),
    ) {
        (Direction::Unclear, Direction::Unclear, Direction::Against) => Direction::With,
        (Direction::Unclear, Direction::Unclear, Direction::With) => Direction::Against,
        (Direction::Unclear, a, _) => a,
        (load, _, _) => load,
    }
}

/// Bounds that follow from those of `records` that have blocked ports, of a valve through which `unit_flow` L/min pass where it
/// is open by 1 cm².
pub(super) fn bound(
    structure: &Structure,
    parameters: &mut [Parameter],
    records: &[Record],
    unit_flow: f64,
) {
    let largest = |channels: &[Channel]| {
        let blocked = records.iter().filter(|record| record.has_blocked_ports());
        let series = blocked.flat_map(|record| channels.iter().filter_map(|&one| record.get(one)));
        series.map(Series::max_abs).fold(0.0, f64::max)
    };
    let returned = largest(&[Channel::ReturnFlow]);
    let supply = largest(&[
        Channel::PressureA,
        Channel::PressureB,
        Channel::LoadPressure,
    ]);
    // Where an edge meets shows in the test that has the smallest commands.
    let blocked = records.iter().filter(|record| record.has_blocked_ports());
    let reach = blocked.map(|record| record.command().max_abs() / structure.full_scale);
    let reach = 100.0 * reach.fold(f64::INFINITY, f64::min);
    let is_position = |name: &str| (0..4).any(|edge| name == edge_name(edge, "position"));
    for parameter in parameters {
        match parameter.name.as_str() {
            name if is_position(name) => {
                let most = parameter.high.min(reach);
                (parameter.low, parameter.high) = (-most, most);
            }
            MAX_AREA if structure.observes(Output::Flow) => {}
            // Both legs from P to T pass half of what returns.
            MAX_AREA if returned > 0.0 => {
                around(parameter, 0.5 * returned / unit_flow / GAP_AT_NULL)
            }
            // Only ratios of areas show in pressures.
            MAX_AREA => parameter.set_fixed(true),
            PILOT_FLOW if returned > 0.0 => {
                parameter.high = returned;
                parameter.set_nominal(0.1 * returned);
            }
            PILOT_FLOW => parameter.set_fixed(true),
            RATED_DROP if supply > 0.0 => {
                let unit = parameter.unit.clone();
                *parameter = Parameter::log(RATED_DROP, &unit, 0.3 * supply, supply, 3.0 * supply);
            }
            _ => {}
        }
    }
}

/// What is taken for granted of `records` with blocked ports, and what they leave open.
pub(super) fn remarks(structure: &Structure, records: &[Record]) -> Vec<String> {
    let taken = records.iter().filter_map(|record| {
        let blocked = record.blocked_ports()?;
        Some(format!("{}: {blocked}", record.name))
    });
    let alone = [Output::PressureA, Output::PressureB].map(|output| structure.observes(output));
    // Exchanged like that, the pressure at A is as far above the tank's as that at B was below the supply's.
    let exchanged = (structure.has_edges() && alone == [false; 2]).then(|| {
        "the pressures at A and B were not measured each by itself: the edges P-A and B-T can be exchanged, and with them A-T and \
         P-B, and nothing that was measured changes. Which is which is not determined"
            .into()
    });
    taken.chain(exchanged).collect()
}
