//! The data of a problem: records in time and tones, cut into integration steps.

use crate::model::integrate::substeps;
use crate::model::{Hold, Input, Outputs};
use serde::{Deserialize, Serialize};

/// How much of an interval between rows may be taken for rounding of the time stamps.
pub(crate) const JITTER: f64 = 1e-6;

/// A jump of the command is at least this share of all that it covers,
const JUMP: f64 = 0.01;
/// and so many times what it changes by in each
const STANDS_OUT: f64 = 4.0;
/// of so many rows before it and after it.
const AROUND: usize = 2;
/// Each of the intervals within which it jumps has more than this share of that.
const PART: f64 = 0.03;

/// One row of a record, ready for integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Length of the integration steps from this row to the next, s.
    pub step: f64,
    /// How many of them there are.
    pub substeps: u32,
    /// Into how many pieces commands that arrive late can cut the interval to the next row.
    pub pieces: u32,
    /// What drives the model.
    pub input: Input<f64>,
    /// The measured outputs; zero where not observed.
    pub target: Outputs<f64>,
    /// Weight of this row's squared errors; zero where the row only runs the simulation in.
    pub weight: f64,
    /// Whether the command jumps with the next row.
    #[serde(default)]
    pub jumps: bool,
    /// Whether it is no row of the record, but stands between two; what evaluates it need not know.
    #[serde(skip)]
    pub between: bool,
}

impl Sample {
    /// What drives the model just before the `next` row, where it goes straight there.
    #[inline(always)]
    pub fn straight_to(&self, next: &Self, hold: Hold) -> Input<f64> {
        let mut input = next.input;
        if self.keeps_its_command(hold) {
            input.command = self.input.command;
        }
        input
    }

    /// Whether the command goes nowhere until it jumps.
    #[inline(always)]
    pub fn keeps_its_command(&self, hold: Hold) -> bool {
        self.jumps && hold == Hold::BetweenJumps
    }

    /// Length (s) and number of the parts into which the interval to the next row is cut, each in the place of at most so many
    /// `steps` of integration.
    #[inline(always)]
    pub fn parts(&self, steps: u32) -> (f64, u32) {
        match steps {
            1 => (self.step, self.substeps),
            // After the last row nothing comes.
            _ if self.substeps == 0 => (0.0, 0),
            _ => {
                let count = self.substeps.div_ceil(steps);
                let seconds = self.step * f64::from(self.substeps);
                (seconds / f64::from(count), count)
            }
        }
    }
}

/// A record in time, ready for integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Its name in messages.
    pub name: String,
    /// Time of each row, s.
    pub time: Vec<f64>,
    /// Which outputs it measures: what a model gives for the others is compared with nothing.
    pub measured: Outputs<bool>,
    /// The rows.
    pub samples: Vec<Sample>,
}

impl Series {
    /// The rows that count, those of weight 0 left out, piece by piece: a sample between two rows that come one after the other is none
    /// that is left out.
    pub fn pieces(&self) -> Vec<Vec<usize>> {
        let mut found: Vec<Vec<usize>> = Vec::new();
        let counting = |(_, sample): &(usize, &Sample)| sample.weight > 0.0;
        for (row, _) in self.samples.iter().enumerate().filter(counting) {
            let follows =
                |before: usize| self.samples[before + 1..row].iter().all(|one| one.between);
            match found.last_mut() {
                Some(rows) if follows(rows[rows.len() - 1]) => rows.push(row),
                _ => found.push(vec![row]),
            }
        }
        found
    }

    /// Lets time, as the model sees it, be so many `seconds` later in every row. [`Self::time`] stays as it was recorded.
    pub(crate) fn shift_clock(&mut self, seconds: f64) {
        for sample in &mut self.samples {
            sample.input.time += seconds;
        }
    }

    /// Cuts the intervals between the rows into steps that a rate of `rate` (1/s) allows, each into `refine` times as
    /// many.
    pub fn set_steps(&mut self, rate: f64, refine: u32) {
        for k in 1..self.samples.len() {
            let seconds = self.time[k] - self.time[k - 1];
            let count = substeps(seconds, rate) * refine;
            let mut step = seconds / f64::from(count);
            // Rounding of the time stamps does not make another step.
            if k > 1 && (step / self.samples[k - 2].step - 1.0).abs() < JITTER {
                step = self.samples[k - 2].step;
            }
            self.samples[k - 1].substeps = count;
            self.samples[k - 1].step = step;
        }
        self.set_pieces();
        self.set_jumps();
    }

    /// Finds the rows with which the command jumps.
    fn set_jumps(&mut self) {
        let jumps = self.jumps_within(1);
        for (sample, jumps) in self.samples.iter_mut().zip(jumps) {
            sample.jumps = jumps;
        }
    }

    /// For each row but the last whether the command jumps within so many intervals from there on, all of which have a part of that.
    pub(crate) fn jumps_within(&self, intervals: usize) -> Vec<bool> {
        let commands = || self.samples.iter().map(|sample| sample.input.command);
        let highest = commands().fold(f64::MIN, f64::max);
        let span = highest - commands().fold(f64::MAX, f64::min);
        let changes: Vec<f64> = commands()
            .zip(commands().skip(1))
            .map(|(from, to)| to - from)
            .collect();
        let jumps = |k: usize| {
            let Some(own) = changes.get(k..k + intervals) else {
                return false;
            };
            let change: f64 = own.iter().sum();
            let around = k.saturating_sub(AROUND)..(k + intervals + AROUND).min(changes.len());
            let beside = around.filter(|row| !(k..k + intervals).contains(row));
            let most = beside.fold(0.0, |most: f64, row| most.max(changes[row].abs()));
            let parts = own.iter().map(|part| part / change);
            let least = change.abs() * parts.fold(f64::INFINITY, f64::min);
            let stands_out = change.abs() > JUMP * span && change.abs() > STANDS_OUT * most;
            stands_out && least > most.max(PART * change.abs())
        };
        (0..changes.len()).map(jumps).collect()
    }

    /// Counts for each interval between rows the pieces into which commands that arrive late can cut it.
    fn set_pieces(&mut self) {
        let mut known: Vec<(f64, u32)> = Vec::new();
        for k in 1..self.samples.len() {
            let interval = (self.time[k] - self.time[k - 1]) * (1.0 - JITTER);
            let near = |(length, _): &&(f64, u32)| *length >= interval && *length < 1.1 * interval;
            let count = match known.iter().find(near) {
                Some((_, count)) => *count,
                None => {
                    let length = if known.is_empty() {
                        interval * (1.0 + 0.5 * JITTER)
                    } else {
                        1.05 * interval
                    };
                    let count = most_in_a_window(&self.time, length);
                    known.push((length, count));
                    count
                }
            };
            self.samples[k - 1].pieces = count + 1;
        }
    }
}

/// The largest number of `times` in a window of this length, its end excluded.
fn most_in_a_window(times: &[f64], length: f64) -> u32 {
    let mut first = 0;
    let mut most = 0;
    for (last, time) in times.iter().enumerate() {
        while times[first] + length <= *time {
            first += 1;
        }
        most = most.max(last - first + 1);
    }
    most as u32
}

/// A sine whose response is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tone {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Amplitude, in the unit of the command.
    pub amplitude: f64,
    /// Measured phase, degrees, where it is known.
    pub phase: Option<f64>,
    /// Measured gain, dB: the response's amplitude over the command's, where it is known.
    pub gain: Option<f64>,
    /// Weight of its squared errors.
    pub weight: f64,
    /// Periods before the correlation begins.
    pub settle: u32,
    /// Periods that are correlated.
    pub measure: u32,
    /// Integration steps between two of the samples that are correlated.
    pub substeps: u32,
}

/// Degrees of phase that an error of 1 dB counts as: both move the response by the same way in the complex plane,
/// (180 / π) · ln 10 / 20, rounded.
pub const DEGREES_PER_DECIBEL: f64 = 6.6;

/// How long the sines last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// The defaults of `frest.Sinestream`, as in the paper: four periods, the first of which settles.
    Paper,
    /// Long enough for the transient to die out.
    Settled,
}

/// Samples per period that are correlated (`frest.Sinestream`'s default).
pub const SAMPLES_PER_PERIOD: u32 = 40;

/// How long [`Stream::Settled`] lets the transient die out, s, and at least how many periods.
const SETTLE: (f64, u32) = (1.0, 6);

impl Tone {
    /// A tone of `stream` whose phase was measured, with as many steps as a rate of `rate` (1/s) asks for, `refine` times finer.
    pub fn new(
        frequency: f64,
        amplitude: f64,
        phase: f64,
        weight: f64,
        stream: Stream,
        rate: f64,
        refine: u32,
    ) -> Self {
        let (settle, measure) = match stream {
            Stream::Paper => (1, 3),
            Stream::Settled => (((frequency * SETTLE.0).ceil() as u32).max(SETTLE.1), 2),
        };
        let interval = 1.0 / (frequency * f64::from(SAMPLES_PER_PERIOD));
        // A power of two, so that every tone strides through one table of sines.
        let substeps = (substeps(interval, rate) * refine).next_power_of_two();
        Self {
            frequency,
            amplitude,
            phase: Some(phase),
            gain: None,
            weight,
            settle,
            measure,
            substeps,
        }
    }
}

/// The data of a problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Data {
    /// Records in time.
    Series(Vec<Series>),
    /// Phases and gains of a sine stream.
    Tones(Vec<Tone>),
}

/// One period of the sine stream, both ends included: sine and cosine at every half step of the finest tone.
pub struct Wave {
    /// (sin, cos), `2 · SAMPLES_PER_PERIOD · substeps + 1` of them.
    pub table: Vec<[f64; 2]>,
    /// Substeps of the finest tone.
    pub substeps: u32,
}

impl Wave {
    /// The table that serves all `tones`.
    pub fn new(tones: &[Tone]) -> Self {
        let substeps = tones.iter().map(|t| t.substeps).max().unwrap_or(1);
        let count = 2 * SAMPLES_PER_PERIOD * substeps;
        let angle = |i| std::f64::consts::TAU * f64::from(i) / f64::from(count);
        let table = (0..=count)
            .map(|i| angle(i).sin_cos())
            .map(|(sin, cos)| [sin, cos])
            .collect();
        Self { table, substeps }
    }
}

impl Tone {
    /// Measured minus simulated phase in degrees, between −180 and 180, for a simulated phase in radians.
    pub fn phase_error(&self, phase: f64) -> Option<f64> {
        let error = self.phase? - phase.to_degrees();
        Some(error - 360.0 * (error / 360.0).round())
    }

    /// Measured minus simulated gain in dB, for a simulated ratio of amplitudes.
    pub fn gain_error(&self, ratio: f64) -> Option<f64> {
        Some(self.gain? - 20.0 * ratio.log10())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_that_count_come_in_pieces() {
        let sample = |weight: &f64| Sample {
            weight: *weight,
            ..Sample::default()
        };
        let of = |weights: &[f64]| Series {
            name: String::new(),
            time: (0..weights.len()).map(|k| k as f64).collect(),
            measured: Outputs::all(true),
            samples: weights.iter().map(sample).collect(),
        };
        let mut series = of(&[0.0, 1.0, 2.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(series.pieces(), [vec![1, 2], vec![5], vec![7]]);
        assert!(of(&[0.0]).pieces().is_empty());
        // Nobody measured what is between the last two.
        series.samples[6].between = true;
        assert_eq!(series.pieces(), [vec![1, 2], vec![5, 7]]);
    }

    #[test]
    fn a_jump_stands_out_of_what_is_around_it() {
        let jumps = |commands: &[f64]| -> Vec<usize> {
            let sample = |&command: &f64| Sample {
                input: Input {
                    command,
                    ..Input::default()
                },
                ..Sample::default()
            };
            let mut series = Series {
                name: String::new(),
                time: (0..commands.len()).map(|k| k as f64).collect(),
                measured: Outputs::all(true),
                samples: commands.iter().map(sample).collect(),
            };
            series.set_steps(1.0, 1);
            let found = series.samples.iter().enumerate();
            let found = found.filter(|(_, sample)| sample.jumps);
            found.map(|(row, _)| row).collect()
        };
        // Steps from rest, from a ramp, and with the first and the last change.
        assert_eq!(jumps(&[0.0, 0.0, 0.0, 5.0, 5.0, 5.0]), [2]);
        assert_eq!(jumps(&[0.0, 1.0, 2.0, 3.0, 9.0, 10.0, 11.0]), [3]);
        assert_eq!(jumps(&[0.0, 5.0, 5.0, 5.0, 2.0]), [0, 3]);
        // Whatever moves on is none, nor is what goes back at once, nor the noise of a command that rests.
        let sine = |rows: f64| -> Vec<f64> {
            let phase = |k: i32| 0.4 + f64::from(k) * std::f64::consts::TAU / rows;
            (0..100).map(|k| phase(k).sin()).collect()
        };
        for rows in [3.0, 4.0, 6.0, 50.0] {
            assert!(jumps(&sine(rows)).is_empty(), "{rows}");
        }
        assert!(jumps(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]).is_empty());
        assert_eq!(jumps(&[0.0, 0.0, 0.001, 0.001, 0.001, 5.0, 5.0, 5.0]), [4]);
        assert!(jumps(&[1.0; 5]).is_empty());
    }
}
