//! Something periodic is added to the measurement.

use super::entry;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "periodic_disturbance",
    port: Port::Measurement,
    summary: "Mains hum, pump ripple or vibration is added to the measurement",
    finding: "a hum of {disturbance_frequency} is added to the measured {output}",
    equation: "y + a sin(2 pi f t) + b cos(2 pi f t)",
    shows: "a line in the residual's spectrum that has nothing to do with the command, and goes on at rest",
    confused: "line_resonance, which rings only when the valve moves",
    source: "pump ripple at pistons times speed; mains at 50 or 60 Hz",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("disturbance_frequency", output),
                "Hz",
                2.0 / scale.length,
                50.0_f64.min(0.2 / scale.interval).max(3.0 / scale.length),
                0.49 / scale.interval,
            ),
            Parameter::linear(
                &entry::on("disturbance_sine", output),
                scale.unit(output),
                -0.5 * scale.output(output),
                0.0,
                0.5 * scale.output(output),
            ),
            Parameter::linear(
                &entry::on("disturbance_cosine", output),
                scale.unit(output),
                -0.5 * scale.output(output),
                0.0,
                0.5 * scale.output(output),
            ),
        ]
    },
    trials: |scale, output| {
        let line = output.and_then(|output| scale.lines[output]);
        let small = 1e-3 * scale.output(output);
        line.map(|frequency| vec![frequency, small, small])
            .into_iter()
            .collect()
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: entry::always,
    outputs: Some(entry::any_output),
    view: Some(View::new(
        Excitation::Step { seconds: 0.1 },
        Over::Time,
        Values::Trial(0),
    )),
    frequency: Some("disturbance_frequency"),
};

/// Mains hum, pump ripple or vibration is added to the measurement.
#[derive(Debug, Clone)]
pub(in crate::model) struct PeriodicDisturbance<R> {
    frequency: R,
    sine: R,
    cosine: R,
}

impl<R: Real> PeriodicDisturbance<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            frequency: next(),
            sine: next(),
            cosine: next(),
        }
    }
}

impl<R: Real> Act<R> for PeriodicDisturbance<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        let turns = self.frequency * moment.time;
        let sine = turns.sine_of_turns();
        let cosine = (turns + R::constant(0.25)).sine_of_turns();
        value + (self.sine * sine + self.cosine * cosine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_adds_a_sine_and_a_cosine() {
        let mut values = [50.125, 0.3, 0.4].into_iter();
        let effect: PeriodicDisturbance<f64> = PeriodicDisturbance::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        // 100 and a quarter turns: the sine alone.
        assert!((effect.measure(&[], 1.0, &moment) - 1.3).abs() < 1e-9);
    }
}
