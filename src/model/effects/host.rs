//! What an effect is attached to.

use super::act::Port;
use crate::model::Output;
use crate::model::valve::{AreaLaw, Drop, Meter, ValveForm};

/// What a structure says of itself to an effect that may be attached to it.
pub trait Host {
    /// Whether it has this port.
    fn has(&self, port: Port) -> bool;

    /// The observed outputs, in the order of [`Output::ALL`].
    fn observed(&self) -> &[Output];

    /// Whether `output` follows from the flow of a valve, now or over time.
    fn follows_flow(&self, output: Output) -> bool;

    /// The command's unit.
    fn command_unit(&self) -> &str;

    /// The unit of `output`.
    fn unit(&self, output: Output) -> &str;

    /// The valve whose flow follows the spool, where there is one.
    fn valve(&self) -> Option<&ValveForm>;

    /// Whether `output` is observed.
    fn observes(&self, output: Output) -> bool {
        self.observed().contains(&output)
    }

    /// Whether anything that is observed follows from the flow of a valve.
    fn shows_a_flow(&self) -> bool {
        let mut observed = self.observed().iter();
        observed.any(|&output| self.follows_flow(output))
    }

    /// Whether its valve has edges of their own: see [`AreaLaw::Edges`].
    fn has_edges(&self) -> bool {
        self.valve()
            .is_some_and(|valve| valve.area == AreaLaw::Edges)
    }
}

pub(super) fn always(_: &dyn Host) -> bool {
    true
}

pub(super) fn moves_a_spool(host: &dyn Host) -> bool {
    host.has(Port::Actuator)
}

/// Whether what moves is the spool itself, not the piston of a loop that is closed around the valve.
pub(super) fn moves_no_piston(host: &dyn Host) -> bool {
    moves_a_spool(host) && loop_output(host) != Some(Output::Position)
}

/// The output that shows where a closed loop is: the spool, or a position that no flow drives.
pub(super) fn loop_output(host: &dyn Host) -> Option<Output> {
    let outputs = [Output::Spool, Output::Position].into_iter();
    let shows = |&output: &Output| host.observes(output) && !host.follows_flow(output);
    outputs.filter(shows).find(|_| host.has(Port::Actuator))
}

/// Whether something shows beside the spool what moves it: the spool alone does not tell its loop's transducer from its own sensor.
pub(super) fn shows_more_than_the_spool(host: &dyn Host) -> bool {
    let others = [Output::Flow, Output::Position];
    moves_a_spool(host) && others.iter().any(|&output| host.observes(output))
}

pub(super) fn has_a_valve(host: &dyn Host) -> bool {
    host.has(Port::Area)
}

/// A valve whose area over the opening shows: near null that of four edges is their own.
pub(super) fn shows_its_area(host: &dyn Host) -> bool {
    has_a_valve(host) && (!host.has_edges() || shows_a_flow(host))
}

/// A valve whose lands close together, where no edge has a position of its own.
pub(super) fn has_lands(host: &dyn Host) -> bool {
    has_a_valve(host) && !host.has_edges()
}

/// A valve whose flow is measured in the pressure line; what leaks near null is that of its edges where it has such.
pub(super) fn shows_what_is_delivered(host: &dyn Host) -> bool {
    let meter = host.valve().map(|valve| valve.meter);
    has_lands(host) && host.observes(Output::Flow) && meter == Some(Meter::Supply)
}

/// A valve whose flow is measured, or moves what is.
pub(super) fn shows_a_flow(host: &dyn Host) -> bool {
    has_a_valve(host) && host.shows_a_flow()
}

pub(super) fn any_output(_: &dyn Host, _: Output) -> bool {
    true
}

/// The flow, and a position that is its integral.
pub(super) fn flow_outputs(host: &dyn Host, output: Output) -> bool {
    host.follows_flow(output)
}

/// Whether a spool moves beside a valve whose supply is measured.
pub(super) fn moves_a_spool_by_measured_pressure(host: &dyn Host) -> bool {
    moves_a_spool(host) && host.valve().is_some_and(|valve| valve.drop != Drop::Rated)
}

pub(super) fn has_a_rated_drop(host: &dyn Host) -> bool {
    host.valve().is_some_and(|valve| valve.drop == Drop::Rated)
}
