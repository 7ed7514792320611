//! Something periodic is added to the command.

use super::host;
use super::periodic_disturbance::{Oscillation, frequency, of_tone};
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Port, Scale, Stage};
use crate::model::{Output, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "command_hum",
    port: Port::Command,
    summary: "Mains hum or another oscillation is added to the command, behind where it is measured",
    finding: "a hum of {hum_frequency} is added to the command, and moves the spool",
    equation: "sat(u + a sin(2 pi f t) + b cos(2 pi f t) - x, S)",
    shows: "a line in the spectra of all residuals, which goes on at rest and is weaker at stops and in saturation",
    confused: "periodic_disturbance, which one sensor adds and no spool follows",
    source: "ground loops and mains pick-up of the command's wires; dither: Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![
            frequency("hum_frequency", scale, None, 1.0),
            amplitude("hum_sine", scale),
            amplitude("hum_cosine", scale),
        ]
    },
    trials: |scale, _| {
        let trial = |frequency| vec![frequency, small(scale), small(scale)];
        line(scale).map(trial).into_iter().collect()
    },
    imitated_by: &[],
    states: &["time_of_hum", "row_of_hum"],
    neutral: &[],
    applies: host::moves_a_spool,
    outputs: None,
    view: Some(View::new(
        Excitation::Step { seconds: 0.1 },
        Over::Time,
        Values::Trial(0),
    )),
    frequency: Some("hum_frequency"),
};

pub(super) const OVERTONE: Entry = Entry {
    name: "command_hum~overtone",
    summary: "Mains hum or another oscillation is added to the command, behind where it is measured, with two overtones",
    finding: "a hum of {mains_frequency} and its overtones are added to the command, and move the spool",
    equation: "sat(u + a1 sin(2 pi f t) + b1 cos(2 pi f t) + a2 sin(4 pi f t) + b2 cos(4 pi f t) + a3 sin(6 pi f t) + b3 cos(6 pi f t) - x, S)",
    shows: "lines in the spectra of all residuals, at a frequency and two or three times it, which go on at rest",
    confused: "command_hum, which has one line; periodic_disturbance~overtone, which one sensor adds and no spool follows",
    source: "rectifiers of power supplies: overtones of the mains",
    parameters: |scale, _| {
        let of_hum = |name| amplitude(name, scale);
        vec![
            frequency("mains_frequency", scale, None, 1.0 / 3.0),
            of_hum("mains_sine"),
            of_hum("mains_cosine"),
            of_hum("mains_overtone_sine"),
            of_hum("mains_overtone_cosine"),
            of_hum("mains_second_overtone_sine"),
            of_hum("mains_second_overtone_cosine"),
        ]
    },
    trials: |scale, _| line(scale).map_or(Vec::new(), |line| of_tone(line, small(scale))),
    states: &["time_of_mains", "row_of_mains"],
    frequency: Some("mains_frequency"),
    ..ENTRY
};

fn amplitude(name: &str, scale: &Scale) -> Parameter {
    let most = 0.5 * scale.command;
    Parameter::linear(name, &scale.command_unit, -most, 0.0, most)
}

/// The line of the first output that has one.
fn line(scale: &Scale) -> Option<f64> {
    Output::ALL
        .into_iter()
        .find_map(|output| scale.lines[output])
}

fn small(scale: &Scale) -> f64 {
    5e-3 * scale.command
}

/// A hum is added to the command.
#[derive(Debug, Clone)]
pub(in crate::model) struct Hum<R, const TONES: usize>(Oscillation<R, TONES>);

pub(in crate::model) type CommandHum<R> = Hum<R, 1>;
pub(in crate::model) type CommandHumWithOvertones<R> = Hum<R, 3>;

impl<R: Real, const TONES: usize> Hum<R, TONES> {
    #[inline(always)]
    pub(super) fn new(next: impl FnMut() -> R) -> Self {
        Self(Oscillation::new(next))
    }
}

impl<R: Real, const TONES: usize> Act<R> for Hum<R, TONES> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], _command: R) {
        own[0] = R::constant(0.0);
        own[1] = R::constant(0.0);
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        command + self.0.at(stage.time + since_row(own, stage))
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], _command: R, _spool: R, stage: &Stage<R>) {
        own[0] = since_row(own, stage);
        own[1] = stage.time;
    }
}

/// Time since [`Stage::time`], which stands still through the steps between two rows where the command is held.
#[inline(always)]
fn since_row<R: Real>(own: &[R], stage: &Stage<R>) -> R {
    let begun = (stage.time - own[1]).if_positive(R::constant(0.0), own[0]);
    begun + stage.since
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 50 Hz in a row of 2 ms, which is gone through in two steps, from 20 ms on.
    #[test]
    fn it_goes_on_through_the_steps_of_a_row() {
        let mut values = [50.0, 0.3, 0.4].into_iter();
        let effect: CommandHum<f64> = CommandHum::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 2.0);
        let hum = |time: f64| {
            let turned = std::f64::consts::TAU * 50.0 * time;
            2.0 + 0.3 * turned.sin() + 0.4 * turned.cos()
        };
        let mut at = |time, since, remember: bool| {
            let stage = Stage {
                since,
                ..Stage::first(2.0, time)
            };
            let found = effect.reference(&own, 2.0, 0.0, &stage);
            if remember {
                effect.remember(&mut own, 2.0, 0.0, &stage);
            }
            found
        };
        for (time, since, ends, expected) in [
            (0.0, 0.0, false, 0.0),
            (0.0, 1e-3, true, 1e-3),
            (0.0, 0.5e-3, false, 1.5e-3),
            (0.0, 1e-3, true, 2e-3),
            (2e-3, 0.0, false, 2e-3),
            (2e-3, 1e-3, true, 3e-3),
            (2e-3, 1e-3, true, 4e-3),
        ] {
            let found = at(time, since, ends);
            assert!(
                (found - hum(expected)).abs() < 1e-6,
                "{time} {since}: {found}"
            );
        }
    }
}
