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

/// Σ aₖ sin(2π k f t) + bₖ cos(2π k f t), f in Hz, of a tone and its overtones.
#[derive(Debug, Clone)]
pub(super) struct Oscillation<R, const TONES: usize> {
    frequency: R,
    sines_and_cosines: [[R; 2]; TONES],
}

impl<R: Real, const TONES: usize> Oscillation<R, TONES> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            frequency: next(),
            sines_and_cosines: std::array::from_fn(|_| [next(), next()]),
        }
    }

    /// Its value at a `time`, s.
    #[inline(always)]
    pub(super) fn at(&self, time: R) -> R {
        let once = self.frequency * time;
        let (mut turns, mut all) = (once, R::constant(0.0));
        for (k, [sine, cosine]) in self.sines_and_cosines.iter().enumerate() {
            let own = *sine * turns.sine_of_turns()
                + *cosine * (turns + R::constant(0.25)).sine_of_turns();
            all = if k == 0 { own } else { all + own };
            turns = turns + once;
        }
        all
    }
}

/// Mains hum, pump ripple or vibration is added to the measurement.
#[derive(Debug, Clone)]
pub(in crate::model) struct Disturbance<R, const TONES: usize>(Oscillation<R, TONES>);

pub(in crate::model) type PeriodicDisturbance<R> = Disturbance<R, 1>;
pub(in crate::model) type PeriodicDisturbanceWithOvertones<R> = Disturbance<R, 3>;

impl<R: Real, const TONES: usize> Disturbance<R, TONES> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(Oscillation::new(next))
    }
}

impl<R: Real, const TONES: usize> Act<R> for Disturbance<R, TONES> {
    #[inline(always)]
    fn measure(&self, _own: &[R], value: R, moment: &Moment<R>) -> R {
        value + self.0.at(moment.time)
    }
}

/// The strongest line is a tone or one of its overtones, which are as large as `small`.
pub(super) fn of_tone(line: f64, small: f64) -> Vec<Vec<f64>> {
    let of = |share: f64| vec![share * line, small, small, small, small, small, small];
    [1.0, 1.0 / 2.0, 1.0 / 3.0].map(of).into()
}

pub(super) const OVERTONE: Entry = Entry {
    name: "periodic_disturbance~overtone",
    summary: "Mains hum, pump ripple or vibration is added to the measurement, with two overtones",
    finding: "a ripple of {ripple_frequency} and its overtones are added to the measured {output}",
    equation: "y + a1 sin(2 pi f t) + b1 cos(2 pi f t) + a2 sin(4 pi f t) + b2 cos(4 pi f t) + a3 sin(6 pi f t) + b3 cos(6 pi f t)",
    shows: "lines in the residual's spectrum, at a frequency and two or three times it, which go on at rest",
    confused: "periodic_disturbance, which has one line",
    parameters: |scale, output| {
        let line = |name| amplitude(name, scale, output);
        vec![
            frequency("ripple_frequency", scale, output, 1.0 / 3.0),
            line("ripple_sine"),
            line("ripple_cosine"),
            line("overtone_sine"),
            line("overtone_cosine"),
            line("second_overtone_sine"),
            line("second_overtone_cosine"),
        ]
    },
    trials: |scale, output| {
        let line = output.and_then(|output| scale.lines[output]);
        let small = 1e-3 * scale.output(output);
        line.map_or(Vec::new(), |line| of_tone(line, small))
    },
    frequency: Some("ripple_frequency"),
    ..ENTRY
};

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
    fn overtones_turn_twice_and_three_times_as_fast() {
        let mut values = [50.125, 0.3, 0.4, 0.05, 0.07, 0.02, 0.03].into_iter();
        let effect: PeriodicDisturbanceWithOvertones<f64> =
            PeriodicDisturbanceWithOvertones::new(|| values.next().unwrap());
        // A quarter, a half and three quarters of a turn: a sine, less a cosine, less a sine.
        assert!((effect.measure(&[], 1.0, &MOMENT) - 1.21).abs() < 1e-9);
    }
}
