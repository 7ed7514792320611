//! What a report says of the noise: each source beside the floor, and whether they agree.

use super::number::rounded;
use crate::diagnose::{Identified, Noise, NoiseMethod, Source};
use crate::model::Output;
use serde::Serialize;

/// What one source says of a channel's noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseSource {
    /// The source, as in `noise_method`.
    pub from: &'static str,
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// Its standard error; null for the resolution, below which no noise can be, and for what a model makes of the noise of
    /// measured inputs, which is part of the floor.
    pub standard_error: Option<f64>,
}

impl NoiseSource {
    /// What every source says that there is of this `noise`.
    pub(super) fn all(noise: &Noise) -> Vec<Self> {
        let of_inputs = noise.of_inputs.iter().map(|one| Self {
            from: one.of,
            value: one.value,
            standard_error: None,
        });
        noise
            .sources
            .iter()
            .map(Self::from)
            .chain(of_inputs)
            .collect()
    }
}

impl From<&Source> for NoiseSource {
    fn from(source: &Source) -> Self {
        Self {
            from: source.method.name(),
            value: source.value,
            standard_error: source.error,
        }
    }
}

/// Where the noise floor is from, as part of a sentence.
pub(super) fn taken_from(noise: &Noise, unit: &str) -> String {
    let from = match noise.method {
        NoiseMethod::RepeatedCommand => "what differs where the command repeats itself",
        NoiseMethod::QuietStretches => "stretches in which the command rests",
        NoiseMethod::Differences => "the fast part of the residual",
        NoiseMethod::Resolution => "the steps of its values and times",
    };
    let others = noise
        .sources
        .iter()
        .filter(|one| one.method != noise.method);
    let others = others.map(|one| (one.method.name(), one.value));
    let of_inputs = noise.of_inputs.iter().map(|one| (one.of, one.value));
    let others: Vec<String> = others
        .chain(of_inputs)
        .map(|(from, value)| format!("{from} {} {unit}", rounded(value, 2)))
        .collect();
    match others.is_empty() {
        true => from.into(),
        false => format!("{from} (beside it: {})", others.join(", ")),
    }
}

/// A sentence for each channel that does not come to rest with its command.
pub(super) fn swings(identified: &Identified) -> Vec<String> {
    let structure = &identified.after.problem.structure;
    let one = |&output: &Output| {
        let swing = identified.noise.get(output.name())?.swing?;
        Some(format!(
            "the {} swings at {} Hz by ±{} {} about what the model gives where the command rests: a limit cycle, whose phase no \
             simulation follows, or a disturbance that is not in the catalogue; no effect is named by it, and it is not taken for \
             noise. Lower the gain until the valve rests, or log what drives it",
            output.name(),
            rounded(swing.frequency, 3),
            rounded(2_f64.sqrt() * swing.deviation, 2),
            structure.unit(output),
        ))
    };
    structure.observed.iter().filter_map(one).collect()
}

/// A sentence for each channel whose sources of noise do not agree.
pub(super) fn disagreements(identified: &Identified) -> Vec<String> {
    let one = |(channel, noise): (&String, &Noise)| {
        let left = identified.after.remaining.get(channel);
        let structure = &identified.after.problem.structure;
        let output = structure
            .observed
            .iter()
            .find(|one| one.name() == channel)?;
        let unit = structure.unit(*output);
        let pair = noise.disagreement(left.is_some_and(|left| left.structured))?;
        let [first, second] = pair.map(|source| {
            let error = source.error.unwrap_or(0.0);
            let (value, error) = (rounded(source.value, 3), rounded(error, 2));
            format!("{} ± {} {unit} from {}", value, error, source.method.name())
        });
        Some(format!(
            "the noise of the {channel} is {first}, but {second}: it is not the same throughout, or one of them shows \
             something else; {} {unit} from {} is taken for the verdict",
            rounded(noise.value, 3),
            noise.method.name()
        ))
    };
    identified.noise.iter().filter_map(one).collect()
}
