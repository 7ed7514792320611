//! Whether a hum of the command that a model has is one of the record. What is fast and large takes the edge off a valve's limits: a
//! model may follow a record better for that, while no channel has its line.

use super::simulation::{Compared, Trajectories, stretches};
use super::statistics::line::line_shows;
use crate::evaluate::Problem;
use crate::evaluate::problem::Series;
use crate::model::Parameter;
use crate::model::effects::{Effect, Port, Scale};

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
        let compared = Compared::all(records, &with);
        let mut observed = problem.structure.observed.iter();
        observed.any(|&output| {
            let adds = |record: usize, row: usize| {
                with[record][row][output] - without[record][row][output]
            };
            let stretches = stretches(&compared, output, adds);
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
