//! What a population is evaluated on: a structure, its parameters, and the data it is compared with.

use super::arrival::JITTER;
use super::loss::{Loss, OwnLoss, SizedLoss};
use crate::model::integrate::substeps;
use crate::model::leap::STEPS_OF_A_LEAP;
use crate::model::{Hold, Input, Outputs, Parameter, Real, Structure};
use std::sync::Arc;

/// One row of a record, ready for integration.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
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
}

impl Sample {
    /// Length (s) and number of the parts into which a structure that leaps, or one that does not, cuts the interval to
    /// the next row.
    #[inline(always)]
    pub fn parts(&self, leaps: bool) -> (f64, u32) {
        match leaps {
            false => (self.step, self.substeps),
            // After the last row nothing comes.
            true if self.substeps == 0 => (0.0, 0),
            true => {
                let count = self.substeps.div_ceil(STEPS_OF_A_LEAP);
                let seconds = self.step * f64::from(self.substeps);
                (seconds / f64::from(count), count)
            }
        }
    }
}

/// A record in time, ready for integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in messages.
    pub name: String,
    /// Time of each row, s.
    pub time: Vec<f64>,
    /// The rows.
    pub samples: Vec<Sample>,
}

impl Series {
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
    }
}

/// A sine whose response is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// Least and largest size of an output's noise that an own loss is told: their squares are normal numbers of single
/// precision.
const SIZES: (f64, f64) = (1e-18, 1e18);

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
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Records in time.
    Series(Vec<Series>),
    /// Phases and gains of a sine stream.
    Tones(Vec<Tone>),
}

/// A structure, the space of its parameters, and the data.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The model's structure.
    pub structure: Structure,
    /// All parameters, in the order of [`Structure::parameters`].
    pub parameters: Vec<Parameter>,
    /// What the model is compared with.
    pub data: Arc<Data>,
    /// What one unit of squared error in each output counts for.
    pub scale: Outputs<f64>,
    /// What an error of a record's row costs, where that is not its square.
    pub loss: Option<OwnLoss>,
}

impl Problem {
    /// A problem in which every output's squared error counts as it is.
    pub fn new(structure: Structure, parameters: Vec<Parameter>, data: Data) -> Self {
        Self {
            structure,
            parameters,
            data: Arc::new(data),
            scale: Outputs::all(1.0),
            loss: None,
        }
    }

    /// The same problem with another cost of the errors of a record's rows than their squares, on every evaluator. The
    /// polish follows it, too: its residuals are the roots of the costs. Tones keep their squares.
    pub fn with_loss<L: Loss>(self) -> Self {
        Self {
            loss: Some(OwnLoss::new::<L>()),
            ..self
        }
    }

    /// What an error costs where that is not its square, and the size of each output's noise.
    #[inline(always)]
    pub(super) fn own_loss<R: Real>(&self) -> Option<SizedLoss<R>> {
        let loss = self.loss?;
        // A channel that counts for nothing has no noise that its errors could be measured by: any size serves. Beyond
        // what single precision holds, its device would compute with infinity.
        let size = |scale: f64| match scale > 0.0 {
            true => scale.sqrt().recip().clamp(SIZES.0, SIZES.1),
            false => 1.0,
        };
        Some((loss.function(), Outputs(self.scale.0.map(size))))
    }

    /// The free parameters.
    pub fn free(&self) -> Vec<Parameter> {
        self.parameters
            .iter()
            .filter(|p| !p.fixed)
            .cloned()
            .collect()
    }

    /// The free parameters' start values.
    pub fn start(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .filter(|p| !p.fixed)
            .map(|p| p.start)
            .collect()
    }

    /// The values of all parameters for a candidate's free ones. `convert` makes a number from a fixed value.
    pub fn complete<T: Copy>(&self, free: &[T], mut convert: impl FnMut(f64) -> T) -> Vec<T> {
        let mut free = free.iter();
        let mut next = || {
            *free
                .next()
                .expect("a candidate has a value for every free parameter")
        };
        self.parameters
            .iter()
            .map(|p| if p.fixed { convert(p.start) } else { next() })
            .collect()
    }

    /// The same problem with `refine` times as many integration steps.
    pub fn refined(&self, refine: u32) -> Self {
        let mut data = (*self.data).clone();
        match &mut data {
            Data::Series(all) => {
                for sample in all.iter_mut().flat_map(|series| &mut series.samples) {
                    sample.substeps *= refine;
                    sample.step /= f64::from(refine);
                }
            }
            Data::Tones(tones) => {
                for tone in tones {
                    tone.substeps *= refine.next_power_of_two();
                }
            }
        }
        Self {
            data: Arc::new(data),
            ..self.clone()
        }
    }

    /// Whether the command is interpolated between rows.
    pub fn interpolates(&self) -> bool {
        self.structure.hold == Hold::Interpolated
    }

    /// Whether the spool moves in exact leaps: see [`Structure::leaps`]. A sine is followed in integration steps.
    pub fn leaps(&self) -> bool {
        self.structure.leaps() && matches!(*self.data, Data::Series(_))
    }

    /// Whether all rows of all records are equally far apart, so that all leaps are alike.
    pub fn is_even(&self) -> bool {
        let Data::Series(all) = &*self.data else {
            return true;
        };
        let intervals = |one: &Series| one.samples.len().saturating_sub(1);
        let mut parts = all
            .iter()
            .flat_map(|one| &one.samples[..intervals(one)])
            .map(|sample| sample.parts(true));
        let first = parts.next();
        parts.all(|part| Some(part) == first)
    }

    /// Integration steps, or leaps, that one candidate takes on all the data.
    pub fn steps(&self) -> u64 {
        let leaps = self.leaps();
        match &*self.data {
            Data::Series(all) => all
                .iter()
                .flat_map(|s| &s.samples)
                .map(|s| u64::from(s.parts(leaps).1))
                .sum(),
            Data::Tones(tones) => tones
                .iter()
                .map(|t| u64::from((t.settle + t.measure) * SAMPLES_PER_PERIOD * t.substeps))
                .sum(),
        }
    }

    /// How many rows or tones count.
    pub fn rows(&self) -> usize {
        match &*self.data {
            Data::Series(all) => all
                .iter()
                .flat_map(|s| &s.samples)
                .filter(|s| s.weight > 0.0)
                .count(),
            Data::Tones(tones) => tones.len(),
        }
    }

    /// Which outputs count: the observed ones.
    pub fn observed(&self) -> Outputs<bool> {
        Outputs::from_fn(|output| self.structure.observes(output))
    }
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

impl Problem {
    /// The cost of a candidate whose weighted squared errors, summed over all records, are `squares`.
    pub fn cost_of_squares(&self, squares: Outputs<f64>) -> f64 {
        squares
            .iter()
            .map(|(output, sum)| sum * self.scale[output])
            .sum()
    }

    /// The cost of a candidate whose (in-phase, quadrature) responses to the tones are `responses`: paper eq. 8,
    /// with phases in degrees, and gains in dB of which each counts as [`DEGREES_PER_DECIBEL`].
    pub fn cost_of_responses(
        &self,
        tones: &[Tone],
        responses: impl IntoIterator<Item = [f64; 2]>,
    ) -> f64 {
        let square = |(tone, [re, im]): (&Tone, [f64; 2])| {
            let phase = tone.phase_error(im.atan2(re)).unwrap_or(0.0);
            let gain = tone.gain_error(re.hypot(im)).unwrap_or(0.0);
            tone.weight * (phase.powi(2) + (DEGREES_PER_DECIBEL * gain).powi(2))
        };
        tones.iter().zip(responses).map(square).sum()
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
