//! Which of two models the rows prefer, and whether surely.

use super::evidence::{Evidence, Model, Side};
use super::verdict::NEAR;
use super::{Comparison, improvement};
use crate::model::Hold;

/// An effect must take this share of the held-out cost: less is seen by nobody, whatever its significance.
pub(super) const LEAST_OF_COST: f64 = 0.02;
/// And this share of what the base model leaves above the noise: the rest may be the form of an effect already found.
const LEAST_OF_EXCESS: f64 = 0.03;
/// Unless it takes this share of what is still left above the noise: where the first effect was large, what follows is small
/// beside it, and plain.
const LEAST_OF_LEFT: f64 = 0.4;
/// Two models are told apart if their costs differ by this many standard errors.
const TOLD_APART: f64 = 3.0;
/// And by more than this share of the lower one: models of the same equation differ by what the polish leaves.
const SAME_COST: f64 = 0.003;
/// Of two models that one is no longer taken for the other whose cost is so many times as large, however few events make the
/// difference.
const ALIKE: f64 = 2.0;
/// Models that leave more than noise have come equally far if what they take differs by less than this share.
const EQUALLY_FAR: f64 = 0.01;

/// Of two models that leave nothing but noise neither is preferred whose cost is less than this many times the other's: the noise
/// itself is not known more closely.
const AS_COMPLETE: f64 = 1.1;

/// A model with this cost leaves as much beside the noise as there is of it.
const AS_MUCH_AS_NOISE: f64 = 2.0;

impl Evidence {
    /// Whether what `after` has more than `before` is worth it: it lowers the held-out error, surely and enough. `excess` is the
    /// base model's.
    pub(super) fn worth(&self, excess: f64, before: &Model, after: &Model) -> bool {
        // The little that others leave may be their own form: a cause of its own explains it to the end.
        let remainder = before.loss(Side::HoldOut) < NEAR * NEAR && before.excess() < excess;
        (!remainder || self.is_followed_by(after)) && self.lowers(excess, before, after)
    }

    /// The same, whether or not it follows others: as for zeros of sensors, which are no form of a cause.
    pub(super) fn lowers(&self, excess: f64, before: &Model, after: &Model) -> bool {
        let (old, new) = (before.loss(Side::HoldOut), after.loss(Side::HoldOut));
        let plain = (LEAST_OF_EXCESS * excess).min(LEAST_OF_LEFT * before.excess());
        let least = plain.max(LEAST_OF_COST * old);
        if old - new < least || after.loss(Side::Fit) >= before.loss(Side::Fit) {
            return false;
        }
        let weights = vec![1.0; before.hold_out.len()];
        let starts = self.starts(Side::HoldOut);
        let gain = improvement(
            &before.hold_out,
            &after.hold_out,
            &weights,
            &starts,
            self.seed,
        );
        gain.percent.low > 0.0
    }

    /// Whether the fitted rows surely prefer this `hold` to that of `model`, which leaves no more beside the noise than that: it is no
    /// longer what is missing that prefers either.
    pub(super) fn prefers(&self, hold: Hold, model: &Model) -> bool {
        if model.loss(Side::Fit) >= AS_MUCH_AS_NOISE {
            return false;
        }
        let mut problem = model.problem.clone();
        problem.structure.hold = hold;
        let other = self.polished(problem);
        other.is_some_and(|other| {
            let weights = vec![1.0; model.fit.len()];
            let starts = self.starts(Side::Fit);
            let z = Comparison::new(&other.fit, &model.fit, &weights, &starts).z;
            let costs = [&other, model].map(|one| one.loss(Side::Fit));
            z < 0.0 && surely_differ(z, costs)
        })
    }

    /// Whether the rows, fitted and held out, surely prefer the first model to the second.
    fn surely_better(&self, first: &Model, second: &Model) -> bool {
        let all = |model: &Model| -> Vec<Vec<f64>> {
            let sides = model.fit.iter().zip(&model.hold_out);
            sides
                .map(|(fit, hold)| [&fit[..], &hold[..]].concat())
                .collect()
        };
        let mut starts = self.starts(Side::Fit);
        let fitted = first.fit.first().map_or(0, Vec::len);
        let held = self.starts(Side::HoldOut);
        starts.extend(held.iter().map(|start| start + fitted));
        let weights = vec![1.0; first.fit.len()];
        let cost = |model: &Model| {
            let rows = |side| model.residuals(side).iter().flatten();
            let both = rows(Side::Fit).chain(rows(Side::HoldOut));
            both.map(|r| r * r).sum::<f64>()
        };
        let z = Comparison::new(&all(first), &all(second), &weights, &starts).z;
        z < 0.0 && surely_differ(z, [cost(first), cost(second)])
    }

    /// Whether `first` is surely better than `second`, on held-out rows as well.
    pub(super) fn outdoes(&self, first: &Model, second: &Model) -> bool {
        first.loss(Side::HoldOut) < second.loss(Side::HoldOut) && self.surely_better(first, second)
    }

    /// Whether the rows cannot tell which of two models is better.
    pub(super) fn same(&self, first: &Model, second: &Model) -> bool {
        let held_out = [first, second].map(|model| model.loss(Side::HoldOut));
        !plainly_differ(held_out)
            && !self.surely_better(first, second)
            && !self.surely_better(second, first)
    }

    /// Whether the rows cannot tell the effect by which `rival` differs from that by which `model` does, which was preferred: each
    /// was added to `reduced`. Held-out rows that show neither say nothing of a rival that does not follow the fitted ones.
    pub(super) fn tied(&self, reduced: &Model, model: &Model, rival: &Model) -> bool {
        let fitted = [model, rival].map(|one| one.loss(Side::Fit));
        !plainly_differ(fitted)
            && (self.same(rival, model)
                || equally_far(reduced, model, rival)
                || self.both_complete(model, rival))
    }

    /// Whether two models leave nothing but noise, and nearly as much of it. No law of a valve is exactly that of a model: which of
    /// two that suffice errs a little less says nothing of the cause.
    pub(super) fn both_complete(&self, model: &Model, rival: &Model) -> bool {
        rival.loss(Side::HoldOut) < AS_COMPLETE * model.loss(Side::HoldOut)
            && [rival, model]
                .into_iter()
                .all(|one| self.is_followed_by(one))
    }

    /// The model with the lowest held-out error; of those that cannot be told from it, and that leave nothing where it does not, the
    /// one with fewest parameters.
    pub(super) fn best<'m>(&self, models: &[&'m Model]) -> Option<&'m Model> {
        let loss = |model: &Model| model.loss(Side::HoldOut);
        let lowest = models.iter().min_by(|a, b| loss(a).total_cmp(&loss(b)))?;
        let complete = self.is_followed_by(lowest);
        let mut simplest = models.to_vec();
        simplest.sort_by(|a, b| a.size().cmp(&b.size()).then(loss(a).total_cmp(&loss(b))));
        simplest
            .into_iter()
            .find(|one| self.same(lowest, one) && (!complete || self.is_followed_by(one)))
            .or(Some(lowest))
    }
}

impl Model {
    /// Held-out cost above the noise.
    pub(super) fn excess(&self) -> f64 {
        (self.loss(Side::HoldOut) - 1.0).max(0.0)
    }

    /// Parameters that are fitted.
    pub(super) fn size(&self) -> usize {
        self.problem.free().len()
    }
}

/// Whether two models that leave more than noise have come equally far from `reduced`. Neither law is that of the valve then, and
/// which of them errs a little less says nothing of the cause.
fn equally_far(reduced: &Model, model: &Model, rival: &Model) -> bool {
    let [before, one, other] = [reduced, model, rival].map(Model::excess);
    one > NEAR * NEAR - 1.0 && other - one < EQUALLY_FAR * (before - one)
}

/// Whether two `costs` on the same rows, whose [`Comparison`] has this `z`, differ by more than chance and the polish make.
pub(super) fn surely_differ(z: f64, costs: [f64; 2]) -> bool {
    let (less, more) = ordered(costs);
    z.abs() > TOLD_APART && more > (1.0 + SAME_COST) * less
}

/// Whether two `costs` on the same rows differ by more than models do that may be taken for each other.
pub(super) fn plainly_differ(costs: [f64; 2]) -> bool {
    let (less, more) = ordered(costs);
    more > ALIKE * less
}

fn ordered([one, other]: [f64; 2]) -> (f64, f64) {
    (one.min(other), one.max(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::evidence::tests::{at, planted};
    use crate::diagnose::statistics::noise::{Noise, NoiseMethod};
    use crate::model::effects::entry;
    use crate::model::{Output, Structure};

    /// A limit without rounding stands for a rounded one, and others take some of the little that it leaves.
    #[test]
    fn what_follows_other_causes_near_the_noise_has_to_explain_the_rest() {
        let bare = Structure::actuator(10.0, "V");
        let form = |name| entry(name).unwrap().on(&bare)[0];
        let (sharp, rounded) = (form("slew_limit~windup"), form("slew_limit~rounded"));
        let values = [
            at("gain", 100.0),
            at("time_constant", 0.005),
            at("saturation", 6.0),
            at("slew_limit_rounded", 150.0),
            at("slew_rounding", 0.3),
        ];
        let mut evidence = planted(&bare, rounded, &values);
        let start = [&values[..3], &[at("slew_limit_windup", 120.0)]].concat();
        let polished = |evidence: &Evidence, structure: &Structure| {
            let problem = evidence.problem(structure, &start);
            evidence.polished(problem).unwrap()
        };
        let limited = bare.with(sharp);
        let square = polished(&evidence, &limited).loss(Side::HoldOut) / 1.25;
        evidence.scale[Output::Spool] = 1.0 / square;
        let noise = Noise {
            value: square.sqrt(),
            method: NoiseMethod::QuietStretches,
            sources: Vec::new(),
            swing: None,
            allowance: Vec::new(),
            of_inputs: None,
        };
        evidence.noise.insert(Output::Spool.name().into(), noise);
        let before = polished(&evidence, &limited);
        let others = [
            "command_lag",
            "feed_forward",
            "friction",
            "delay",
            "flow_force",
        ];
        let mut refused = Vec::new();
        for name in others {
            let after = polished(&evidence, &limited.with(form(name)));
            let [alone, behind] =
                [1.0, 100.0].map(|times| evidence.worth(times * before.excess(), &before, &after));
            let losses = [&before, &after].map(|model| model.loss(Side::HoldOut));
            println!("{name}: {losses:?}, alone {alone}, behind others {behind}");
            assert!(!behind || evidence.is_followed_by(&after), "{name}");
            if alone && !behind {
                let lowers = evidence.lowers(100.0 * before.excess(), &before, &after);
                assert!(lowers, "{name}");
                refused.push(name);
            }
        }
        assert!(!refused.is_empty());
    }
}
