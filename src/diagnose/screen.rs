//! Screening: the reduction of the cost that is predicted for each effect, of the catalogue and of a user's own, and whether it
//! is significant.
//!
//! A score test at one value would miss effects that do nothing near their neutral value (an end stop) or have a kink
//! there (friction). Each effect is therefore simulated at several values, its trials. Linearised there, together with the
//! parameters of the model so far, it has a predicted cost (Gauss-Newton).
//!
//! The distribution of that reduction where no effect is missing comes from surrogate residuals: what the best trial leaves, in
//! blocks with random signs, which keep colour and size and no longer depend on the command (wild block bootstrap: Shao 2010, "The dependent wild
//! bootstrap"). Each effect explains of a surrogate what lies in its directions, those of the model projected out. The
//! whole screening is repeated on each surrogate, and the best effect of each makes the null distribution: its level holds
//! for the family of all effects and trials, not for each alone.

use super::evidence::{Evidence, Model, Side, Start};
use super::linear::Linear;
use super::statistics::basis::{Basis, dot};
use super::statistics::bootstrap::block_length;
use crate::evaluate::problem::{Problem, Series};
use crate::evaluate::{Fingerprint, Interrupt};
use crate::model::Output;
use crate::model::effects::{Effect, known};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Surrogates that make up the null distribution.
const SURROGATES: usize = 999;
/// Chance of a false alarm of the whole family of effects in one round.
pub(super) const LEVEL: f64 = 0.01;

/// What the screening says of one effect.
#[derive(Debug, Clone)]
pub(super) struct Screened {
    /// The effect.
    pub(super) effect: Effect,
    /// Where its search begins, with the predicted cost of each, the lowest first.
    pub(super) starts: Vec<(Start, f64)>,
    /// Share of the cost by which it is predicted to fall.
    pub(super) predicted_reduction: f64,
    /// Chance of as large a predicted reduction by any effect where none is missing.
    pub(super) p_value: f64,
    /// Its test statistic over the critical value, at which `p_value` is [`LEVEL`].
    pub(super) test_ratio: f64,
}

/// The screening of all effects that `model` could have.
#[derive(Debug)]
pub(super) struct Screening<'a> {
    evidence: &'a Evidence,
    model: &'a Model,
    /// The effects, the largest predicted reduction first.
    pub(super) effects: Vec<Screened>,
    /// Not there where the screening was remembered.
    directions: Option<Directions>,
}

/// What the effects of a screening explain together follows from these.
#[derive(Debug)]
struct Directions {
    /// Directions of each effect's best trial, without what the model spans.
    of_effects: Vec<Basis>,
    /// The residual that they are to explain, without what the model spans.
    residual: Vec<f64>,
}

/// What is remembered of an effect's screening: its number among the candidates, and the fields of [`Screened`].
type Remembered = (usize, Vec<(Start, f64)>, f64, f64, f64);

/// One trial of one effect.
struct Tried {
    effect: Effect,
    start: Start,
    cost: f64,
    directions: Basis,
}

impl<'a> Screening<'a> {
    /// Tries every effect in `allowed` that `model` does not have; `None` where the model itself diverges, or the run was
    /// stopped.
    pub(super) fn new(
        evidence: &'a Evidence,
        model: &'a Model,
        allowed: &dyn Fn(&Effect) -> bool,
    ) -> Option<Self> {
        let structure = model.structure();
        let candidates: Vec<Effect> = known()
            .flat_map(|entry| entry.on(structure))
            .filter(|effect| !structure.has_cause_of(effect) && allowed(effect))
            .collect();
        let mut directions = None;
        let mut screen = || {
            let (effects, found) = screened(evidence, model, &candidates)?;
            directions = Some(found);
            let number = |effect: &Effect| candidates.iter().position(|other| other == effect);
            let remembered = effects.into_iter().map(|one| {
                let number = number(&one.effect).expect("one of the candidates");
                (
                    number,
                    one.starts,
                    one.predicted_reduction,
                    one.p_value,
                    one.test_ratio,
                )
            });
            Some(remembered.collect())
        };
        let key = || key("screening", evidence, model, &candidates);
        let remembered: Option<Vec<Remembered>> = evidence.memory.once(key, &mut screen);
        let effects = remembered?.into_iter().map(
            |(number, starts, predicted_reduction, p_value, test_ratio)| Screened {
                effect: candidates[number],
                starts,
                predicted_reduction,
                p_value,
                test_ratio,
            },
        );
        Some(Self {
            evidence,
            model,
            effects: effects.collect(),
            directions,
        })
    }

    /// Pairs of effects that explain together more than `least` of the residual's square, one of them significant, the best
    /// first, `most` at most: two that help little alone may explain everything together.
    pub(super) fn pairs(&self, least: f64, most: usize) -> Vec<[&Screened; 2]> {
        let candidates: Vec<Effect> = self.effects.iter().map(|one| one.effect).collect();
        let key = || key("pairs", self.evidence, self.model, &candidates);
        let chosen: Vec<(usize, usize)> = self.evidence.memory.once(key, || {
            let again;
            let directions = match &self.directions {
                Some(directions) => directions,
                None => match screened(self.evidence, self.model, &candidates) {
                    Some((_, directions)) => {
                        again = directions;
                        &again
                    }
                    None => return Vec::new(),
                },
            };
            let significant = |i: usize| self.effects[i].p_value <= LEVEL;
            let good = |&((i, j), share): &((usize, usize), f64)| {
                // Two forms of one cause make up for each other.
                let of_two = !candidates[i].is_form_of(&candidates[j]);
                of_two && share > least && (significant(i) || significant(j))
            };
            let shares = directions.shares(self.evidence.memory.interrupt());
            let shares = shares.into_iter().filter(good);
            shares.take(most).map(|(pair, _)| pair).collect()
        });
        let pair = |(i, j): (usize, usize)| [&self.effects[i], &self.effects[j]];
        chosen.into_iter().map(pair).collect()
    }
}

/// Tells what is asked of `candidates` on top of `model`.
fn key(what: &str, evidence: &Evidence, model: &Model, candidates: &[Effect]) -> u64 {
    let mut fingerprint = Fingerprint::default();
    fingerprint.text(what).problem(&model.problem);
    fingerprint.text(&format!("{:?}", evidence.sizes));
    for effect in candidates {
        fingerprint.text(&effect.to_string());
    }
    fingerprint.finish()
}

impl Directions {
    /// Pairs of effects by the share of the residual's square that both explain together, the best first; where the run was
    /// stopped, not all of them.
    fn shares(&self, interrupt: &Interrupt) -> Vec<((usize, usize), f64)> {
        let total = dot(&self.residual, &self.residual);
        let numbers: Vec<(usize, usize)> = (0..self.of_effects.len())
            .flat_map(|i| (0..i).map(move |j| (j, i)))
            .collect();
        let share = |(i, j): (usize, usize)| {
            if interrupt.asked() {
                return None;
            }
            let (one, other) = (&self.of_effects[i], &self.of_effects[j]);
            let beyond = one.beyond(other.0.iter().cloned());
            let explained = one.explained(&self.residual) + beyond.explained(&self.residual);
            Some(((i, j), explained / total))
        };
        let mut shares: Vec<_> = numbers.into_par_iter().filter_map(share).collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }
}

/// Tries `candidates` on top of `model`: the largest predicted reduction first, with their directions in this order; `None` where the
/// model itself diverges, or the run was stopped.
fn screened(
    evidence: &Evidence,
    model: &Model,
    candidates: &[Effect],
) -> Option<(Vec<Screened>, Directions)> {
    let here = evidence.linear_in_long_steps(&model.problem)?;
    let base = Basis::spanning(here.columns);
    let mut residual = here.residual.clone();
    base.remove_from(&mut residual);
    let tried: Vec<Tried> = candidates
        .par_iter()
        .flat_map_iter(|&effect| tried(evidence, model, &here.residual, &base, effect))
        .collect();
    let cost = dot(&here.residual, &here.residual);
    let gains: Vec<f64> = tried.iter().map(|one| cost - one.cost).collect();
    let best = tried.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    let noise = best
        .filter(|best| best.cost < cost)
        .and_then(|best| left(evidence, model, best))
        .unwrap_or_else(|| residual.clone());
    let tests = tests(evidence, &noise, &tried, &gains)?;
    let mut effects: Vec<(Screened, Basis)> = Vec::new();
    for (one, test) in tried.into_iter().zip(tests) {
        let same = |(other, _): &&mut (Screened, Basis)| other.effect == one.effect;
        match effects.iter_mut().find(same) {
            Some((known, directions)) => {
                known.p_value = known.p_value.min(test.p_value);
                known.test_ratio = known.test_ratio.max(test.ratio);
                let better = one.cost < known.starts[0].1;
                let index = usize::from(!better) * known.starts.len();
                known.starts.insert(index, (one.start, one.cost));
                if better {
                    *directions = one.directions;
                }
            }
            None => effects.push((
                Screened {
                    effect: one.effect,
                    starts: vec![(one.start, one.cost)],
                    predicted_reduction: 0.0,
                    p_value: test.p_value,
                    test_ratio: test.ratio,
                },
                one.directions,
            )),
        }
    }
    for (effect, _) in &mut effects {
        effect.starts.sort_by(|a, b| a.1.total_cmp(&b.1));
        effect.predicted_reduction = 1.0 - effect.starts[0].1 / cost;
    }
    effects.sort_by(|(a, _), (b, _)| b.predicted_reduction.total_cmp(&a.predicted_reduction));
    let (effects, of_effects) = effects.into_iter().unzip();
    Some((
        effects,
        Directions {
            of_effects,
            residual,
        },
    ))
}

/// `effect` at each of its trials that does not diverge.
fn tried(
    evidence: &Evidence,
    model: &Model,
    residual: &[f64],
    base: &Basis,
    effect: Effect,
) -> Vec<Tried> {
    let starts = evidence.search_starts(model, &effect);
    let extended = |start: &Start| evidence.extended(model, effect, start);
    let problems: Vec<Problem> = starts.iter().map(extended).collect();
    let Some(free) = problems.first().map(Problem::free) else {
        return Vec::new();
    };
    let own: Vec<String> = effect
        .parameters(&evidence.sizes)
        .into_iter()
        .map(|p| p.name)
        .collect();
    let one = |(start, there): (Start, Option<Linear>)| {
        let there = there?;
        // What the trial changes, and what its parameters change there.
        let secant = residual.iter().zip(&there.residual).map(|(a, b)| a - b);
        let columns = free.iter().zip(&there.columns);
        let columns = columns.filter(|(parameter, _)| own.contains(&parameter.name));
        let columns = columns.map(|(_, column)| column.clone());
        let directions = base.beyond(std::iter::once(secant.collect()).chain(columns));
        let reached = Basis::spanning(there.columns);
        let cost = dot(&there.residual, &there.residual) - reached.explained(&there.residual);
        Some(Tried {
            effect,
            start,
            cost,
            directions,
        })
    };
    let there = evidence.linear_side_by_side(&problems);
    starts.into_iter().zip(there).filter_map(one).collect()
}

/// What the linearised refit of a trial leaves of the residual.
fn left(evidence: &Evidence, model: &Model, tried: &Tried) -> Option<Vec<f64>> {
    let problem = evidence.extended(model, tried.effect, &tried.start);
    let mut there = evidence.linear_in_long_steps(&problem)?;
    Basis::spanning(there.columns).remove_from(&mut there.residual);
    Some(there.residual)
}

/// The test of a trial.
struct Test {
    /// The chance that any trial explains as much of a surrogate, each in units of its own chance level.
    p_value: f64,
    /// What the trial explains, in units of what makes `p_value` equal to [`LEVEL`].
    ratio: f64,
}

/// For each trial, whose predicted reduction of the cost is that of `gains`, what trials explain of surrogates of `residual`;
/// `None` where the run was stopped.
fn tests(
    evidence: &Evidence,
    residual: &[f64],
    tried: &[Tried],
    gains: &[f64],
) -> Option<Vec<Test>> {
    let channels = |record: &Series| {
        let counts = |output: &Output| record.measured[*output] && evidence.scale[*output] > 0.0;
        Output::ALL.into_iter().filter(counts).count()
    };
    let records = evidence.records(Side::Fit);
    let lengths = records.iter().flat_map(|record| {
        let pieces = record.pieces().into_iter();
        pieces.map(|piece| piece.len() * channels(record))
    });
    let most = records.iter().map(channels).max().unwrap_or(1);
    let block = block_length(residual, &[0]).max(20 * most);
    let edges: Vec<usize> = edges(lengths, block);
    let blocks = edges.len() - 1;
    let in_block = |direction: &Vec<f64>| -> Vec<f64> {
        edges
            .windows(2)
            .map(|edge| dot(&direction[edge[0]..edge[1]], &residual[edge[0]..edge[1]]))
            .collect()
    };
    let products: Vec<Vec<Vec<f64>>> = tried
        .par_iter()
        .map(|one| one.directions.0.iter().map(in_block).collect())
        .collect();
    let explained = |signs: &[f64], products: &Vec<Vec<f64>>| -> f64 {
        products
            .iter()
            .map(|column| dot(column, signs).powi(2))
            .sum()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(evidence.seed);
    let null: Option<Vec<Vec<f64>>> = (0..SURROGATES)
        .map(|_| {
            if evidence.memory.interrupt().asked() {
                return None;
            }
            let sign = |_| if rng.random::<bool>() { 1.0 } else { -1.0 };
            let signs: Vec<f64> = (0..blocks).map(sign).collect();
            Some(products.iter().map(|one| explained(&signs, one)).collect())
        })
        .collect();
    let null = null?;
    let chance: Vec<f64> = (0..tried.len())
        .map(|i| {
            let mut values: Vec<f64> = null.iter().map(|row| row[i]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2].max(f64::MIN_POSITIVE)
        })
        .collect();
    let mut largest: Vec<f64> = null
        .iter()
        .map(|row| {
            row.iter()
                .zip(&chance)
                .map(|(v, c)| v / c)
                .fold(0.0, f64::max)
        })
        .collect();
    largest.sort_by(|a, b| b.total_cmp(a));
    // Above this one the chance is at most LEVEL.
    let limit = largest[(LEVEL * (SURROGATES + 1) as f64) as usize - 1];
    let one = |((value, chance), tried): ((&f64, &f64), &Tried)| {
        // What the model spans already reduces nothing.
        if tried.directions.0.is_empty() {
            return Test {
                p_value: 1.0,
                ratio: 0.0,
            };
        }
        let explained = value / chance;
        let as_large = largest.partition_point(|most| *most >= explained);
        Test {
            p_value: (as_large + 1) as f64 / (SURROGATES + 1) as f64,
            ratio: explained / limit,
        }
    };
    Some(gains.iter().zip(&chance).zip(tried).map(one).collect())
}

/// Ends of blocks that no end of one of the pieces of these `lengths` lies inside.
fn edges(lengths: impl IntoIterator<Item = usize>, block: usize) -> Vec<usize> {
    let mut edges = Vec::new();
    let mut start = 0;
    for length in lengths {
        edges.extend((start..start + length).step_by(block));
        start += length;
    }
    edges.push(start);
    edges
}
