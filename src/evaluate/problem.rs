//! What a population is evaluated on: a structure, its parameters, and the data it is compared with.

mod data;
mod from_record;
#[doc(hidden)]
pub mod identity;
pub(super) mod loss;

pub(crate) use data::JITTER;
pub use data::{DEGREES_PER_DECIBEL, Data, SAMPLES_PER_PERIOD, Sample, Series, Stream, Tone, Wave};

use crate::model::{Complete, Outputs, Parameter, Real, Structure};
use loss::{Loss, OwnLoss, SizedLoss};
use std::sync::Arc;

/// Least and largest size of an output's noise that an own loss is told: their squares are normal numbers of single
/// precision.
const SIZES: (f64, f64) = (1e-18, 1e18);

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
            loss: Some(OwnLoss::of::<L>()),
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
            .filter(|p| !p.is_fixed())
            .cloned()
            .collect()
    }

    /// The free parameters' start values.
    pub fn start(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .filter(|p| !p.is_fixed())
            .map(|p| p.nominal())
            .collect()
    }

    /// The values of all parameters for a candidate's free ones. `constant` makes a number from a known value.
    ///
    /// # Panics
    /// If the candidate has no value for a free parameter.
    pub fn complete<R: Copy>(
        &self,
        candidate: &[R],
        constant: impl FnMut(f64) -> R,
    ) -> Complete<R> {
        Complete::with(&self.parameters, candidate, constant)
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

    /// Whether the command goes straight from row to row.
    pub fn interpolates(&self) -> bool {
        self.structure.hold.is_straight()
    }

    /// Whether the spool moves in exact steps: see [`Structure::has_exact_steps`]. A sine is followed in integration steps.
    pub fn has_exact_steps(&self) -> bool {
        self.structure.has_exact_steps() && matches!(*self.data, Data::Series(_))
    }

    /// Length (s) and number of the integration steps, or exact steps, from `sample` to the next row.
    pub fn parts(&self, sample: &Sample) -> (f64, u32) {
        sample.parts(match self.has_exact_steps() {
            true => self.structure.steps_of_an_exact_step(),
            false => 1,
        })
    }

    /// Whether all rows of all records are equally far apart, so that all exact steps are alike.
    pub fn is_even(&self) -> bool {
        let Data::Series(all) = &*self.data else {
            return true;
        };
        let intervals = |one: &Series| one.samples.len().saturating_sub(1);
        let mut parts = all
            .iter()
            .flat_map(|one| &one.samples[..intervals(one)])
            .map(|sample| self.parts(sample));
        let first = parts.next();
        parts.all(|part| Some(part) == first)
    }

    /// Integration steps, or exact steps, that one candidate takes on all the data.
    pub fn steps(&self) -> u64 {
        match &*self.data {
            Data::Series(all) => all
                .iter()
                .flat_map(|s| &s.samples)
                .map(|s| u64::from(self.parts(s).1))
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

    /// How many measured values count: in every row those of the observed outputs that its record measures.
    pub fn values(&self) -> usize {
        let Data::Series(all) = &*self.data else {
            return self.rows();
        };
        let of = |one: &Series| {
            let counting = one.samples.iter().filter(|sample| sample.weight > 0.0);
            let observed = self.structure.observed.iter();
            counting.count() * observed.filter(|&&output| one.measured[output]).count()
        };
        all.iter().map(of).sum()
    }

    /// Which outputs count: the observed ones.
    pub fn observed(&self) -> Outputs<bool> {
        Outputs::from_fn(|output| self.structure.observes(output))
    }

    /// Which outputs of `record` count for something.
    pub(super) fn compares(&self, record: &Series) -> Outputs<bool> {
        Outputs::from_fn(|output| {
            let measured = self.structure.observes(output) && record.measured[output];
            measured && self.scale[output] > 0.0
        })
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
