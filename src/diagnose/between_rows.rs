//! Jumps of a command between two rows: a generator does not wait for the logger. When it jumped is what the valve shows.

use super::evidence::{Evidence, Model, QUICK, set_start};
use super::placed_jumps::{Jump, PlacedJumps, opened, set};
use super::problem::IdentificationProblem;
use super::simulation::Trajectories;
use super::statistics::noise::Noise;
use super::verdict::NEAR;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Problem, reference};
use crate::model::{Complete, Hold, Output, Outputs, Structure};
use crate::search::polish::polish;
use crate::search::{Plan, Stoppable};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Jumps are placed and the model is fitted in turn, at most so many times,
const ROUNDS: usize = 20;
/// until none moves by more than this share of an interval.
const SETTLED: f64 = 0.005;
/// Steps grow less by this factor at least.
const SLOWEST: f64 = 0.95;
/// Jumps are placed in so many turns, those of each at once.
const TURNS: usize = 2;
/// Times that a place is corrected by what the valve makes of it.
const CORRECTED: usize = 2;
/// A place is known with a standard error of this share of an interval.
const KNOWN: f64 = 0.1;
/// Fewest jumps with known places that say something.
const FEWEST: usize = 4;
/// The standard deviation of places that do not come with the rows, at least; of any place it is 0.29.
const SPREAD: f64 = 0.12;
/// The share of the squared error behind the jumps that is left where they are placed, at most; and where they are placed again.
const LEFT: [f64; 2] = [0.5, 0.9];
/// And at most so many times what noise would leave: by a model that lacks more than that they are not placed.
const FOLLOWED: f64 = 4.0;
/// After the first two rounds that may still be so many times as much.
const FAR: f64 = 10.0;
/// Jumps are placed at most so many times.
const MOST: usize = 2;

/// `problem` with the jumps of its commands placed between the rows, where they did not come with them and `model`, from its start,
/// follows its rows much better so, beside this `noise`; otherwise `None`.
pub(super) fn with_jumps_placed(
    problem: &IdentificationProblem,
    model: &Problem,
    noise: &BTreeMap<String, Noise>,
    plan: &Plan,
) -> Option<IdentificationProblem> {
    if !may_be_placed(problem) {
        return None;
    }
    let measurements = &problem.measurements;
    let known = &measurements.placed_jumps;
    let times = known.times;
    let mut records = [&measurements.fit[..], &measurements.hold_out].concat();
    let mut before = simulated(model, &records);
    let mut jumps = known.of_series.clone();
    if times == 0 {
        jumps = records.iter_mut().map(opened).collect();
        for (rows, jumps) in before.iter_mut().zip(&jumps) {
            for jump in jumps {
                jump.insert_into(rows);
            }
        }
    }
    if jumps.iter().flatten().count() < FEWEST {
        return None;
    }
    let weights: Vec<(Output, f64)> = answering(&model.structure)
        .map(|output| (output, noise[output.name()].value.powi(-2)))
        .collect();
    let before = left(&records, &before, &jumps, &weights);
    let mut model = model.clone();
    model.structure.hold = Hold::BetweenJumps;
    model.scale = Outputs::default();
    for &(output, weight) in &weights {
        model.scale[output] = weight;
    }
    let rows = |one: &Jump| one.behind.len() * weights.len();
    let of_noise = jumps.iter().flatten().map(rows).sum::<usize>() as f64;
    // What noise leaves no place takes away.
    if !before.is_finite() || of_noise > LEFT[times] * before {
        return None;
    }
    let fitted = measurements.fit.len();
    let most = FOLLOWED * of_noise;
    let model = placed_in_turn(
        model,
        &mut records,
        &mut jumps,
        fitted,
        &weights,
        most,
        plan,
    )?;
    let after = left(&records, &simulated(&model, &records), &jumps, &weights);
    let misfit = (after / of_noise).max(1.0).sqrt();
    let is_known = |one: &&Jump| one.error * misfit < KNOWN;
    let known = jumps.iter().flatten().filter(is_known);
    let places: Vec<f64> = known.map(|one| one.early).collect();
    let come_anywhere = places.len() >= FEWEST && spread(&places) > SPREAD;
    let is_followed = after < LEFT[times] * before && after < most;
    (come_anywhere && is_followed).then(|| {
        let mut placed = problem.clone();
        placed.structure.hold = Hold::BetweenJumps;
        let all = &mut placed.measurements;
        all.hold_out = records.split_off(all.fit.len());
        all.fit = records;
        all.shown_hold = Some(Hold::BetweenJumps);
        all.placed_jumps = PlacedJumps {
            times: times + 1,
            of_series: jumps,
            ..all.placed_jumps
        };
        if times == 0 {
            let remark = "the command jumps between rows and not with them: its jumps are put where the valve answers them, in rows \
                          held out, too";
            all.beginnings.push(remark.into());
        }
        placed
    })
}

/// What a selection of effects places jumps by: the sooner they come when they came, the fewer causes are sought in vain.
pub(super) struct Jumping<'a> {
    /// The problem whose records they are.
    pub(super) asked: &'a IdentificationProblem,
    /// Its base model on all of their rows.
    pub(super) base: &'a Problem,
    pub(super) noise: &'a BTreeMap<String, Noise>,
    pub(super) plan: &'a Plan,
}

impl Jumping<'_> {
    /// As [`with_jumps_placed`], by a `model` that was fitted to the evidence. What does not show when a command jumped has to be followed:
    /// it bends the rest of the model.
    pub(super) fn placed_by(
        &self,
        evidence: &Evidence,
        model: &Model,
    ) -> Option<IdentificationProblem> {
        let structure = model.structure();
        let answering: Vec<Output> = answering(structure).collect();
        let beside = structure.observed.iter();
        let mut beside = beside.filter(|output| !answering.contains(output));
        if beside.any(|&output| model.left(output) > NEAR) {
            return None;
        }
        let mut problem = Problem {
            data: self.base.data.clone(),
            ..model.problem.clone()
        };
        evidence.release(&mut problem);
        with_jumps_placed(self.asked, &problem, self.noise, self.plan)
    }
}

/// Whether jumps of the commands of `problem` may still be placed.
fn may_be_placed(problem: &IdentificationProblem) -> bool {
    let between = problem.structure.hold == Hold::BetweenJumps;
    problem.measurements.placed_jumps.times < MOST && (between || !problem.hold_known)
}

/// What shows when a command has jumped. Where the spool is measured that is what answers: what follows it may be off by what the model
/// lacks behind it.
fn answering(structure: &Structure) -> impl Iterator<Item = Output> {
    let observed = &structure.observed;
    let alone = observed.contains(&Output::Spool);
    let all = observed.iter().copied();
    all.filter(move |output| !alone || *output == Output::Spool)
}

/// The `model`, fitted to the first so many of the `records`, whose jumps are placed by it; `None` where it diverges or was stopped, or
/// will hardly leave less than so much.
fn placed_in_turn(
    mut model: Problem,
    records: &mut [Series],
    jumps: &mut [Vec<Jump>],
    fitted: usize,
    weights: &[(Output, f64)],
    most: f64,
    plan: &Plan,
) -> Option<Problem> {
    let mut steps: Vec<Vec<f64>> = Vec::new();
    for _ in 0..ROUNDS {
        let mut placing = Placing {
            model: &model,
            records,
            weights,
        };
        steps.push(placing.place(jumps));
        let moved = largest(steps.last().expect("just pushed"));
        if let [first, second] = &steps[..] {
            let further = goes_on(first, second);
            for ((_, jump), step) in numbered(jumps).zip(second) {
                jump.early = (jump.early + further * step).clamp(0.0, 1.0);
            }
            let rows = placing.with(jumps);
            if left(records, &rows, jumps, weights) > FAR * most {
                return None;
            }
            steps.clear();
        }
        model = polished(model, records[..fitted].to_vec(), plan)?;
        if moved < SETTLED {
            break;
        }
    }
    Some(model)
}

/// Records with their jumps, and what is made of them.
struct Placing<'a> {
    model: &'a Problem,
    records: &'a mut [Series],
    weights: &'a [(Output, f64)],
}

impl Placing<'_> {
    /// What the model gives where the `jumps` come when they are said to.
    fn with(&mut self, jumps: &[Vec<Jump>]) -> Trajectories {
        let rate = self.model.structure.fastest_rate(&self.model.parameters);
        for (series, jumps) in self.records.iter_mut().zip(jumps) {
            for jump in jumps {
                set(series, jump, jump.early);
            }
            series.set_steps(rate, 1);
        }
        simulated(self.model, self.records)
    }

    /// Places the `jumps` where the model follows the records best; by what share of an interval each moves. Every other one at once:
    /// what the one before does is still there where the next is placed.
    fn place(&mut self, jumps: &mut [Vec<Jump>]) -> Vec<f64> {
        let targets = |series: &Series| series.samples.iter().map(|sample| sample.target).collect();
        let measured: Trajectories = self.records.iter().map(targets).collect();
        let started: Vec<f64> = jumps.iter().flatten().map(|one| one.early).collect();
        for turn in 0..TURNS {
            self.place_every_other(jumps, turn, &measured);
        }
        let moved = jumps.iter().flatten().zip(started);
        moved.map(|(one, before)| one.early - before).collect()
    }

    /// Those of the `jumps` whose `turn` it is.
    fn place_every_other(&mut self, jumps: &mut [Vec<Jump>], turn: usize, measured: &Trajectories) {
        let ends = [0.0, 1.0].map(|end| {
            let mut moved = jumps.to_vec();
            of_turn(&mut moved, turn).for_each(|(_, jump)| jump.early = end);
            self.with(&moved)
        });
        let mut rows = self.with(jumps);
        for _ in 0..=CORRECTED {
            for (number, jump) in of_turn(jumps, turn) {
                let (aim, information) = self.earlier(number, jump, &ends, measured);
                let (is, _) = self.earlier(number, jump, &ends, &rows);
                if information > 0.0 {
                    jump.early = (jump.early + aim - is).clamp(0.0, 1.0);
                    jump.error = information.sqrt().recip();
                }
            }
            rows = self.with(jumps);
        }
    }

    /// By what share of the way from the first of two `ends` to the other `rows` are there behind `jump` in record `number`, and how
    /// much information they have on it.
    fn earlier(
        &self,
        number: usize,
        jump: &Jump,
        ends: &[Trajectories; 2],
        rows: &Trajectories,
    ) -> (f64, f64) {
        let (mut information, mut slope) = (0.0, 0.0);
        let measured = self.records[number].measured;
        for &(output, weight) in self.weights.iter().filter(|(output, _)| measured[*output]) {
            for row in jump.behind.clone() {
                let [from, to] = [0, 1].map(|end| ends[end][number][row][output]);
                information += weight * (to - from) * (to - from);
                slope += weight * (to - from) * (rows[number][row][output] - from);
            }
        }
        (slope / information, information)
    }
}

/// Each of the jumps with the number of its record.
fn numbered(jumps: &mut [Vec<Jump>]) -> impl Iterator<Item = (usize, &mut Jump)> {
    let each = jumps.iter_mut().enumerate();
    each.flat_map(|(number, jumps)| jumps.iter_mut().map(move |jump| (number, jump)))
}

/// Those whose `turn` it is.
fn of_turn(jumps: &mut [Vec<Jump>], turn: usize) -> impl Iterator<Item = (usize, &mut Jump)> {
    let each = jumps.iter_mut().enumerate();
    each.flat_map(move |(number, jumps)| {
        let own = jumps.iter_mut().skip(turn).step_by(TURNS);
        own.map(move |jump| (number, jump))
    })
}

/// What `model` gives for `records`.
pub(super) fn simulated(model: &Problem, records: &[Series]) -> Trajectories {
    let values = Complete::nominal(&model.parameters);
    reference::trajectories(&model.structure, &values, records)
}

/// `model`, fitted to these records from where it is; `None` where that diverges or was stopped.
pub(super) fn polished(mut model: Problem, records: Vec<Series>, plan: &Plan) -> Option<Problem> {
    model.data = Arc::new(Data::Series(records));
    let (free, start) = (model.free(), model.start());
    if free.is_empty() {
        return Some(model);
    }
    let mut stoppable = Stoppable::new(&model, plan.memory.interrupt());
    let values = polish(&mut stoppable, &free, &start, &QUICK).ok()?.values;
    set_start(&mut model, &values);
    Some(model)
}

/// The squared errors behind the jumps, each by its channel's noise.
fn left(
    records: &[Series],
    simulated: &Trajectories,
    jumps: &[Vec<Jump>],
    weights: &[(Output, f64)],
) -> f64 {
    let mut sum = 0.0;
    for ((series, rows), jumps) in records.iter().zip(simulated).zip(jumps) {
        let measured = weights
            .iter()
            .filter(|(output, _)| series.measured[*output]);
        for &(output, weight) in measured {
            for row in jumps.iter().flat_map(|jump| jump.behind.clone()) {
                sum += weight * (series.samples[row].target[output] - rows[row][output]).powi(2);
            }
        }
    }
    sum
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// How many times the second of two steps that grow less and less, each by the same factor, is still to go (Aitken 1926).
fn goes_on(first: &[f64], second: &[f64]) -> f64 {
    let product = |other: &[f64]| first.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    let factor = product(second) / product(first);
    match (0.0..1.0).contains(&factor) {
        true => factor.min(SLOWEST) / (1.0 - factor.min(SLOWEST)),
        false => 0.0,
    }
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_shrink_alike_are_gone_to_the_end_at_once() {
        let first = [0.3, -0.1];
        assert!((goes_on(&first, &[0.24, -0.08]) - 4.0).abs() < 1e-12);
        assert!((goes_on(&first, &[0.299, -0.0997]) - 19.0).abs() < 1e-9);
        assert_eq!(goes_on(&first, &[-0.1, 0.05]), 0.0);
        assert_eq!(goes_on(&first, &[0.4, -0.2]), 0.0);
    }
}
