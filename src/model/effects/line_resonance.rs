//! The line to the flow meter rings.

use super::second_order::SecondOrder;
use super::view::{Excitation, Over, Values, View};
use super::{Entry, Port};
use super::{entry, host};
use crate::model::{Pace, Parameter};

/// 50 m of line, closed at its end, ring at this frequency, Hz: c / 4L.
const SLOWEST: f64 = 5.0;

pub(super) const ENTRY: Entry = Entry {
    name: "line_resonance",
    port: Port::Flow,
    summary: "The oil column in the line rings at its own frequency",
    finding: "the oil column in the line rings at {line_frequency}",
    equation: "q'' + 2 D w q' + w^2 q = w^2 Q, w = 2 pi line_frequency, D = line_damping",
    shows: "ringing at one frequency whatever the command; the spool does not show it (a damping above 0.6 would not ring)",
    confused: "compressibility, which does not ring; periodic_disturbance, which goes on at rest",
    source: "line dynamics; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("line_frequency", output),
                "Hz",
                SLOWEST.min(0.2 / scale.interval),
                0.1 / scale.interval,
                0.45 / scale.interval,
            )
            .paced(Pace::Frequency),
            Parameter::log(&entry::on("line_damping", output), "1", 0.005, 0.1, 0.6),
            Parameter::linear(&entry::on("line_share", output), "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.01, 0.02, 0.035, 0.06, 0.1, 0.17, 0.3]
            .map(|share| vec![share / scale.interval, 0.15])
            .to_vec()
    },
    imitated_by: &[],
    states: &["column", "column_rate"],
    neutral: &[("line_share", 0.0)],
    applies: host::shows_a_flow,
    outputs: Some(host::flow_outputs),
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    frequency: Some("line_frequency"),
};

/// The oil column in the line rings at its own frequency.
pub(in crate::model) type LineResonance<R> = SecondOrder<R>;

pub(super) const SHARE: Entry = Entry {
    name: "line_resonance~share",
    summary: "A part of the flow passes through a line that rings at its own frequency",
    finding: "{side_share} of the flow passes through a line that rings at {side_frequency}",
    equation: "Q + side_share (q - Q), q'' + 2 D w q' + w^2 q = w^2 Q, w = 2 pi side_frequency, D = side_damping",
    shows: "steps of the flow of which a part comes at once and the rest rings at one frequency; the spool does not show it",
    confused: "line_resonance, all of whose flow rings",
    source: "a branch, an accumulator or a hose beside a stiff line; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("side_frequency", output),
                "Hz",
                SLOWEST.min(0.2 / scale.interval),
                0.1 / scale.interval,
                0.45 / scale.interval,
            )
            .paced(Pace::Frequency),
            Parameter::log(&entry::on("side_damping", output), "1", 0.005, 0.1, 0.6),
            Parameter::linear(&entry::on("side_share", output), "1", 0.0, 0.0, 1.0),
        ]
    },
    trials: |scale, _| {
        [0.01, 0.02, 0.035, 0.06, 0.1, 0.17, 0.3]
            .map(|share| vec![share / scale.interval, 0.15, 0.5])
            .to_vec()
    },
    states: &["side_column", "side_column_rate"],
    neutral: &[("side_share", 0.0)],
    frequency: Some("side_frequency"),
    ..ENTRY
};

/// A part of the flow passes through a line that rings.
pub(in crate::model) type LineResonanceOfShare<R> = SecondOrder<R>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::{Act, Moment};

    #[test]
    fn it_rings_as_the_closed_form_says() {
        let mut values = [100.0, 0.1, 1.0].into_iter();
        let effect: LineResonance<f64> = LineResonance::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 0.0);
        for _ in 0..300 {
            effect.filter(&mut own, 1.0, 1.0, 2e-5);
        }
        let rate = 100.0 * std::f64::consts::TAU;
        let damped = rate * (1.0f64 - 0.01).sqrt();
        let t = 300.0 * 2e-5;
        let ring = (damped * t).cos() + 0.1 * rate / damped * (damped * t).sin();
        let exact = 1.0 - (-0.1 * rate * t).exp() * ring;
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        assert!((effect.measure(&own, 7.0, &moment) - exact).abs() < 1e-8);
    }
}
