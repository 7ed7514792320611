//! What fits together in a structure, and what does not.

use super::ModelFile;
use crate::Result;
use crate::model::effects::Port;
use crate::model::valve::AreaLaw;
use crate::model::{FreeForm, Output, Signal, Structure};
use crate::record::{Quantity, Unit, joined, quoted};
use std::ops::RangeInclusive;

/// Full scales that a command can have, in its unit.
const FULL_SCALE: RangeInclusive<f64> = 1e-9..=1e9;

/// Where a valve's openings stand, whichever of the last two keys is there.
const OPENINGS: &[&str] = &["valve", "area", "table", "signed"];

/// Most points that a table of areas or a correction can have.
const MOST_POINTS: usize = 100;

impl ModelFile {
    /// Refuses a structure whose parts are out of range or do not fit together.
    pub(super) fn check(&self, structure: &Structure) -> Result<()> {
        let refuse = |keys: &[&str], problem: String, remedy: &str| {
            Err(self.file.error(self.find(keys), problem, remedy))
        };
        let Structure {
            full_scale,
            command_unit,
            observed,
            ..
        } = structure;
        if !FULL_SCALE.contains(full_scale) {
            return refuse(
                &["full_scale"],
                format!("full_scale is {full_scale:?}"),
                "give a positive number, from 1e-9 to 1e9: the command that asks for 100 % of the spool's stroke",
            );
        }
        for (key, unit) in [
            ("command_unit", Some(command_unit)),
            ("spool_unit", structure.spool_unit()),
        ] {
            let Some(unit) = unit else { continue };
            let kept = Quantity::Signal.unit(Some(unit), key).map(Unit::kept);
            if !kept.is_ok_and(|kept| kept == unit) {
                return refuse(
                    &[key],
                    format!("signals are not kept in {}", quoted(unit)),
                    "use V, mA, %, mm or 1, as the record does after its conversion",
                );
            }
        }
        if observed.is_empty() || !observed.is_sorted_by(|a, b| a < b) {
            let known = Output::ALL.map(|output| format!("{:?}", output.name()));
            return refuse(
                &["observed"],
                "the observed outputs are none, not in order, or there twice".into(),
                &format!("list at least one of {}, in this order", known.join(", ")),
            );
        }
        let effects = &structure.effects;
        if let Some(twice) = (1..effects.len()).find(|&i| effects[i] == effects[i - 1]) {
            return refuse(
                &["effects"],
                format!("{} is there twice", effects[twice]),
                "name each effect once",
            );
        }
        if let Some(idle) = effects.iter().find(|e| !e.entry.on(structure).contains(e)) {
            return refuse(
                &["effects"],
                format!("{idle} has nothing to act on in this structure"),
                &format!(
                    "delete it, or observe what it acts on; it shows: {}",
                    idle.entry.shows
                ),
            );
        }
        if let Some(form) = &structure.free_form {
            let rising = form.knots.len() > 1 && form.knots.is_sorted_by(|a, b| a < b);
            if !rising || form.knots.iter().any(|knot| !knot.is_finite()) {
                return refuse(
                    &["free_form", "knots"],
                    "the knots are fewer than two, not finite, or not strictly rising".into(),
                    "list values of the signal in rising order",
                );
            }
            if form.knots.len() > MOST_POINTS {
                return refuse(
                    &["free_form", "knots"],
                    format!("there are {} knots", form.knots.len()),
                    "list at most 100: each has a parameter",
                );
            }
            if !acts(form, structure) {
                return refuse(
                    &["free_form"],
                    format!(
                        "a curve of the {} has nothing to act on at the {} port of this structure",
                        form.signal.name(),
                        form.port
                    ),
                    "give port and signal as identify does: command of command; actuator of spool or speed; area of \
                     spool, with a valve; measurement of any, with an output that is observed",
                );
            }
        }
        self.check_valve(structure)
    }

    /// Refuses a valve that nothing asks for, none where one is needed, and one with openings that make no table.
    fn check_valve(&self, structure: &Structure) -> Result<()> {
        let refuse = |keys: &[&str], problem: String, remedy: &str| {
            Err(self.file.error(self.find(keys), problem, remedy))
        };
        let of_flow = structure
            .observed
            .iter()
            .filter(|&&output| structure.follows_flow(output) || output.is_of_blocked_ports())
            .map(|output| output.name().into());
        match (structure.valve(), structure.needs_valve()) {
            (None, true) => refuse(
                &["observed"],
                format!(
                    "observing {} needs a valve",
                    joined(of_flow.collect(), "and")
                ),
                "add [structure.valve] with area = \"linear\"",
            ),
            (Some(_), false) => refuse(
                &["valve"],
                "there is a valve, but nothing that is observed follows from it".into(),
                "delete [structure.valve], or observe flow",
            ),
            (Some(valve), true) => match &valve.area {
                AreaLaw::Linear
                | AreaLaw::Proportional
                | AreaLaw::Table(_)
                | AreaLaw::Signed(_)
                    if structure.observes_blocked_ports() =>
                {
                    refuse(
                        &["valve", "area"],
                        "what blocked ports show follows from the edges of the valve".into(),
                        "give area = \"edges\"",
                    )
                }
                AreaLaw::Table(openings) | AreaLaw::Signed(openings)
                    if openings.len() > MOST_POINTS =>
                {
                    refuse(
                        OPENINGS,
                        format!("there are {} openings", openings.len()),
                        "list at most 100: each has a parameter",
                    )
                }
                AreaLaw::Table(openings) | AreaLaw::Signed(openings)
                    if openings.len() < 4
                        || openings.iter().any(|opening| !opening.is_finite())
                        || !openings.is_sorted_by(|a, b| a < b) =>
                {
                    refuse(
                        OPENINGS,
                        format!("the openings {openings:?} are fewer than four or do not rise"),
                        "list at least four openings in %, strictly rising",
                    )
                }
                _ => Ok(()),
            },
            (None, false) => Ok(()),
        }
    }
}

/// Whether a correction is one of those that change something in `structure`.
fn acts(form: &FreeForm, structure: &Structure) -> bool {
    match (form.port, form.signal, form.output) {
        (Port::Command, Signal::Command, None) => true,
        (Port::Actuator, Signal::Spool | Signal::Speed, None) => structure.has(Port::Actuator),
        (Port::Area, Signal::Spool, None) => structure.has(Port::Area),
        (Port::Measurement, _, Some(output)) => structure.observes(output),
        _ => false,
    }
}
