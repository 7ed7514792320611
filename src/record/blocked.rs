//! Records of tests with the ports A and B blocked: what is measured there is how the valve answers.

use super::{Channel, Record, Unusual};
use crate::{Error, Result};

/// What only such a test measures.
const OWN: [Channel; 2] = [Channel::ReturnFlow, Channel::LoadPressure];
/// What it measures of the ports, where other tests have what drives the flow.
const PORTS: [Channel; 2] = [Channel::PressureA, Channel::PressureB];
/// What a valve with blocked ports cannot have.
const THROUGH: [Channel; 2] = [Channel::Flow, Channel::Position];

impl Record {
    /// Whether the ports A and B were blocked: there is a return flow or a load pressure, or nothing but the pressures at A and
    /// B answers the command.
    pub fn has_blocked_ports(&self) -> bool {
        self.blocked_ports().is_some()
    }

    /// The same, with what says so.
    pub(crate) fn blocked_ports(&self) -> Option<Unusual> {
        let has = |channel: &Channel| self.get(*channel).is_some();
        let moves = has(&Channel::Spool) || THROUGH.iter().any(has);
        let ports = PORTS.into_iter().filter(|_| !moves);
        let measures = OWN.into_iter().chain(ports).find(has)?;
        Some(Unusual::BlockedPorts { measures })
    }

    /// The channels that a model is fitted to. With blocked ports the pressures at A and B are among them, and their
    /// difference is not where both are there.
    pub fn responses(&self) -> Vec<Channel> {
        let blocked = self.has_blocked_ports();
        let both = PORTS.iter().all(|&port| self.get(port).is_some());
        let channels = self.channels().map(|(channel, _)| channel);
        channels
            .filter(|channel| match channel {
                Channel::LoadPressure => !both,
                channel if PORTS.contains(channel) => blocked,
                channel => Channel::RESPONSES.contains(channel),
            })
            .collect()
    }

    /// Refuses a record that measures what only blocked ports show beside a flow or a position, which blocked ports do not
    /// let through.
    ///
    /// # Errors
    /// It does.
    pub(super) fn check_one_test(&self) -> Result<()> {
        let first = |channels: [Channel; 2]| {
            let mut channels = channels.into_iter();
            channels.find(|&channel| self.get(channel).is_some())
        };
        let (Some(blocked), Some(through)) = (first(OWN), first(THROUGH)) else {
            return Ok(());
        };
        let remedy = match blocked {
            Channel::LoadPressure => {
                "leave the column out, or give pressure_a and pressure_b, from which the flow follows"
            }
            _ => {
                "leave the column out; if the meter in the return line measures what passes the load, name that one alone: \
                 --map \"COLUMN=flow [L/min]\""
            }
        };
        Err(Error::input(
            format!("{}, column \"{blocked}\"", self.path),
            format!(
                "is measured with the ports A and B blocked, and there is a {through} beside it"
            ),
            remedy,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Series;

    fn record(channels: &[Channel]) -> Record {
        let series = |unit| Series::new(unit, vec![0.0, 1.0]);
        let command = (Channel::Command, series("V"));
        let others = channels
            .iter()
            .map(|&channel| (channel, series(channel.quantity().usual().kept())));
        Record::new("bench", vec![0.0, 1.0], [command].into_iter().chain(others)).unwrap()
    }

    #[test]
    fn pressures_at_the_ports_answer_only_where_nothing_else_does() {
        use Channel::*;
        for (channels, blocked, responses) in [
            (&[Flow, PressureA, PressureB][..], false, &[Flow][..]),
            (&[Spool, PressureA, PressureB], false, &[Spool]),
            (&[PressureA, PressureB], true, &[PressureA, PressureB]),
            (&[LoadPressure], true, &[LoadPressure]),
            (
                &[PressureA, PressureB, LoadPressure],
                true,
                &[PressureA, PressureB],
            ),
            (
                &[Spool, ReturnFlow, PressureA],
                true,
                &[Spool, ReturnFlow, PressureA],
            ),
        ] {
            let record = record(channels);
            assert_eq!(record.has_blocked_ports(), blocked, "{channels:?}");
            assert_eq!(record.responses(), responses, "{channels:?}");
            assert!(record.check_response().is_ok(), "{channels:?}");
        }
    }

    #[test]
    fn a_flow_beside_what_only_blocked_ports_show_is_refused() {
        use Channel::*;
        for (channels, parts) in [
            ([Flow, LoadPressure], ["load_pressure", "pressure_a"]),
            ([Flow, ReturnFlow], ["return_flow", "--map"]),
            ([Position, ReturnFlow], ["return_flow", "position"]),
        ] {
            let text = record(&channels).check_response().unwrap_err().to_string();
            assert!(parts.iter().all(|part| text.contains(part)), "{text}");
        }
    }
}
