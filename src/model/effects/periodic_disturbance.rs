//! Something periodic is added to the measurement.

use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port, Scale};
use super::{entry, host};
use crate::model::{Output, Parameter, Real};

/// A frequency below `nyquist` times the one up to which rows tell it from a lower one.
pub(super) fn frequency(
    name: &str,
    scale: &Scale,
    output: Option<Output>,
    nyquist: f64,
) -> Parameter {
    Parameter::log(
        &entry::on(name, output),
        "Hz",
        2.0 / scale.length,
        50.0_f64.min(0.2 / scale.interval).max(3.0 / scale.length),
        0.49 * nyquist / scale.interval,
    )
}

fn amplitude(name: &str, scale: &Scale, output: Option<Output>) -> Parameter {
    let most = 0.5 * scale.output(output);
    let name = entry::on(name, output);
    Parameter::linear(&name, scale.unit(output), -most, 0.0, most)
}

pub(super) const ENTRY: Entry = Entry {
    name: "periodic_disturbance",
    port: Port::Measurement,
    summary: "Mains hum, pump ripple or vibration is added to the measurement",
    finding: "a hum of {disturbance_frequency} is added to the measured {output}",
    equation: "y + a sin(2 pi f t) + b cos(2 pi f t)",
    shows: "a line in the residual's spectrum that has nothing to do with the command, and goes on at rest",
    confused: "line_resonance, which rings only when the valve moves; command_hum, which the spool and its flow follow",
    source: "pump ripple at pistons times speed; mains at 50 or 60 Hz",
    parameters: |scale, output| {
        vec![
            frequency("disturbance_frequency", scale, output, 1.0),
            amplitude("disturbance_sine", scale, output),
            amplitude("disturbance_cosine", scale, output),
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
    applies: host::always,
    outputs: Some(host::any_output),
    view: Some(View::new(
        Excitation::Step { seconds: 0.1 },
        Over::Time,
        Values::Trial(0),
    )),
    frequency: Some("disturbance_frequency"),
};

/// a sin(2π f t) + b cos(2π f t), f in Hz.
#[derive(Debug, Clone)]
pub(super) struct Oscillation<R> {
    frequency: R,
    sine: R,
    cosine: R,
}

impl<R: Real> Oscillation<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            frequency: next(),
            sine: next(),
            cosine: next(),
        }
    }

    /// Its value at a `time`, s.
    #[inline(always)]
    pub(super) fn at(&self, time: R) -> R {
        let turns = self.frequency * time;
        let sine = turns.sine_of_turns();
        let cosine = (turns + R::constant(0.25)).sine_of_turns();
        self.sine * sine + self.cosine * cosine
    }
}

/// Mains hum, pump ripple or vibration is added to the measurement.
#[derive(Debug, Clone)]
pub(in crate::model) struct PeriodicDisturbance<R>(Oscillation<R>);

impl<R: Real> PeriodicDisturbance<R> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(Oscillation::new(next))
    }
}

impl<R: Real> Act<R> for PeriodicDisturbance<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        value + self.0.at(moment.time)
    }
}

pub(super) const OVERTONE: Entry = Entry {
    name: "periodic_disturbance~overtone",
    summary: "Pump ripple or vibration is added to the measurement, with its first overtone",
    finding: "a ripple of {ripple_frequency} and its overtone are added to the measured {output}",
    equation: "y + a sin(2 pi f t) + b cos(2 pi f t) + c sin(4 pi f t) + d cos(4 pi f t)",
    shows: "two lines in the residual's spectrum, one at twice the frequency of the other, which go on at rest",
    confused: "periodic_disturbance, which has one line",
    parameters: |scale, output| {
        let line = |name| amplitude(name, scale, output);
        vec![
            frequency("ripple_frequency", scale, output, 0.5),
            line("ripple_sine"),
            line("ripple_cosine"),
            line("overtone_sine"),
            line("overtone_cosine"),
        ]
    },
    trials: |scale, output| {
        let line = output.and_then(|output| scale.lines[output]);
        let small = 1e-3 * scale.output(output);
        // The strongest line is the tone or its overtone.
        let of = |share: f64| line.map(|line| vec![share * line, small, small, small, small]);
        [1.0, 0.5].into_iter().filter_map(of).collect()
    },
    frequency: Some("ripple_frequency"),
    ..ENTRY
};

/// Pump ripple is added to the measurement, with an overtone.
#[derive(Debug, Clone)]
pub(in crate::model) struct PeriodicDisturbanceWithOvertone<R> {
    tone: Oscillation<R>,
    overtone: Oscillation<R>,
}

impl<R: Real> PeriodicDisturbanceWithOvertone<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let tone = Oscillation::new(&mut next);
        let overtone = Oscillation {
            frequency: tone.frequency + tone.frequency,
            sine: next(),
            cosine: next(),
        };
        Self { tone, overtone }
    }
}

impl<R: Real> Act<R> for PeriodicDisturbanceWithOvertone<R> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        value + self.tone.at(moment.time) + self.overtone.at(moment.time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOMENT: Moment<f64> = Moment {
        time: 2.0,
        temperature: 50.0,
        opening: 3.0,
        drop: 10.0,
        relative_drop: 1.0,
    };

    #[test]
    fn it_adds_a_sine_and_a_cosine() {
        let mut values = [50.125, 0.3, 0.4].into_iter();
        let effect: PeriodicDisturbance<f64> = PeriodicDisturbance::new(|| values.next().unwrap());
        // 100 and a quarter turns: the sine alone.
        assert!((effect.measure(&[], 1.0, &MOMENT) - 1.3).abs() < 1e-9);
    }

    #[test]
    fn the_overtone_turns_twice_as_fast() {
        let mut values = [50.125, 0.3, 0.4, 0.05, 0.07].into_iter();
        let effect: PeriodicDisturbanceWithOvertone<f64> =
            PeriodicDisturbanceWithOvertone::new(|| values.next().unwrap());
        // A quarter and a half turn: the sine of the one, and less the cosine of the other.
        assert!((effect.measure(&[], 1.0, &MOMENT) - 1.23).abs() < 1e-9);
    }
}
