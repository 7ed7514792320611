//! What a residual still depends on, where the noise of its channel is known.

use super::known::KnownRows;
use super::simulation::{Compared, residual};
use super::statistics::noise::Noise;
use super::statistics::residual::{Remaining, Residuals, remaining};
use crate::model::Output;
use std::collections::BTreeMap;

/// What is left beyond a channel's resolution is nothing below this share of it: that much comes of what rounding does to the
/// fit itself.
const BEYOND: f64 = 0.1;

/// Seed of what a verdict compares with chance: the same for every run, so that the seed of the search decides no verdict.
pub(super) const CHANCE: u64 = 1;

/// What the residual of each of the channels `tested` still depends on, beyond the resolution where that is the noise.
pub(super) fn left_over(
    compared: &[Compared],
    tested: &[Output],
    noise: &BTreeMap<String, Noise>,
) -> Vec<Remaining> {
    // Channels that the same records measure are looked at together.
    let same = |a: &Output, b: &Output| {
        let mut records = compared.iter().map(|one| one.series.measured);
        records.all(|measured| measured[*a] == measured[*b])
    };
    let one = |together: &[Output]| together_left_over(compared, together, noise);
    tested.chunk_by(same).flat_map(one).collect()
}

/// The same of channels that the same records measure.
fn together_left_over(
    compared: &[Compared],
    tested: &[Output],
    noise: &BTreeMap<String, Noise>,
) -> Vec<Remaining> {
    let Some(&first) = tested.first() else {
        return Vec::new();
    };
    let compared = &Compared::measuring(compared, first);
    let known = KnownRows::new(compared);
    let beyond = |output: &Output| noise[output.name()].beyond(residual(compared, *output));
    let residuals: Vec<Vec<f64>> = tested.iter().map(beyond).collect();
    let channels: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let signals: Vec<(&str, &[f64])> = known
        .signals
        .iter()
        .map(|(signal, values)| (signal.name(), values.as_slice()))
        .collect();
    let mut rest = remaining(
        &Residuals {
            channels: &channels,
            starts: &known.starts,
            time: &known.time,
            command: &known.command,
            known: &signals,
        },
        CHANCE,
    );
    for ((output, residual), rest) in tested.iter().zip(&residuals).zip(&mut rest) {
        let noise = &noise[output.name()];
        let square = residual.iter().map(|e| e * e).sum::<f64>() / residual.len().max(1) as f64;
        if noise.is_resolution() && square.sqrt() < BEYOND * noise.value {
            *rest = Remaining::nothing();
        }
        if let Some(of_inputs) = &noise.of_inputs {
            rest.leave_out(&of_inputs.shown);
        }
    }
    rest
}
