//! Whether a hum of the command that a model has is one of the record. What is fast and large takes the edge off a valve's limits: a
//! model may follow a record better for that, while no channel has its line.

use super::simulation::Trajectories;
use super::statistics::line::{Stretch, line_shows};
use crate::evaluate::Problem;
use crate::evaluate::problem::Series;
use crate::model::effects::{Effect, Port, Scale};
use crate::model::{Output, Outputs, Parameter};

/// A hum has its own line, and overtones up to so many times its frequency.
const TONES: usize = 3;

/// Whether each hum that `problem` adds to the command at its start, and that is not among the `known`, shows as a line in a channel of
/// `records`, for which the model gives what `simulate` says.
pub(super) fn hums_show(
    problem: &Problem,
    known: &[Parameter],
    records: &[Series],
    sizes: &Scale,
    simulate: impl Fn(&Problem) -> Trajectories,
) -> bool {
    let effects = problem.structure.effects.iter();
    let hums = effects.filter(|effect| effect.entry.port == Port::Command);
    let hums = hums.filter_map(|effect| Some((effect, effect.frequency()?)));
    let mut hums = hums.filter(|(_, name)| known.iter().all(|one| one.name != *name));
    hums.all(|(effect, name)| {
        let value = problem.parameters.iter().find(|one| one.name == name);
        let frequency = value.map_or(0.0, |one| one.nominal());
        let [with, without] = [simulate(problem), simulate(&silent(problem, effect, sizes))];
        let mut observed = problem.structure.observed.iter();
        observed.any(|&output| {
            let stretches = stretches(records, &with, &without, output);
            (1..=TONES).any(|tone| line_shows(&stretches, tone as f64 * frequency))
        })
    })
}

/// `problem` whose hum `effect` has no amplitude.
fn silent(problem: &Problem, effect: &Effect, sizes: &Scale) -> Problem {
    let mut problem = problem.clone();
    let frequency = effect.frequency();
    for own in effect.parameters(sizes) {
        let amplitude = |name: &str| name == own.name && Some(name) != frequency.as_deref();
        let mut all = problem.parameters.iter_mut();
        if let Some(parameter) = all.find(|one| amplitude(&one.name)) {
            parameter.set_nominal(0.0);
        }
    }
    problem
}

/// What is left of `output` in each piece of the rows that count, and what the hum adds to it.
fn stretches(
    records: &[Series],
    with: &[Vec<Outputs<f64>>],
    without: &[Vec<Outputs<f64>>],
    output: Output,
) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    for ((series, with), without) in records.iter().zip(with).zip(without) {
        if !series.measured[output] {
            continue;
        }
        for rows in series.pieces() {
            let of = |value: &dyn Fn(usize) -> f64| rows.iter().map(|&row| value(row)).collect();
            let (samples, own) = (&series.samples, |row: usize| with[row][output]);
            stretches.push(Stretch {
                time: of(&|row| samples[row].input.time),
                left: of(&|row| samples[row].target[output] - own(row)),
                beside: of(&|row| own(row) - without[row][output]),
            });
        }
    }
    stretches
}
