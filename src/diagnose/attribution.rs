//! Which effects the model lacks: add, exchange, drop, until nothing more is significant.

use super::added::{Added, Considered, Contest, Decision, Rival};
use super::between_rows::Jumping;
use super::evidence::{Evidence, Model, Side};
use super::hold::come_closer;
use super::led::led;
use super::located::{Located, shows_in_the_spool};
use super::preference::LEAST_OF_COST;
use super::problem::IdentificationProblem;
use super::screen::{LEVEL, Screened, Screening};
use super::sensors::{of_a_sensor, with_sensors};
use super::sought::{begun, least_costly, near, to_the_end};
use super::stage::Stage;
use super::statistics::noise::Noise;
use super::verdict::{EXPLAINED, counted, taken};
use super::wide::widely;
use crate::Result;
use crate::evaluate::{Evaluator, Problem};
use crate::model::effects::{Effect, known};
use crate::model::{Hold, Output, Parameter, Structure};
use crate::search::Method;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// The largest of so many effects as may still be added takes as large a share of what is left as each of as many equal ones, if
/// they take all of it together. One that takes less than this part of that is the first of a pile that is never named.
const LEAST_OF_AN_EQUAL_SHARE: f64 = 0.5;
/// An effect whose predicted reduction of the cost is below this share of the best one's is not refitted.
const PLAUSIBLE: f64 = 0.25;
/// Most effects that are refitted in one round, and most pairs.
const REFITTED: (usize, usize) = (8, 4);
/// Most effects that are polished to the end in a round after the first, in the place of another, or with other poles.
const FOLLOWED: usize = 6;
/// A few steps lead to this many times the cost of the model that is to be improved at most where more of them help.
const LEADS_SOMEWHERE: f64 = 1.1;
/// The same of a model that is to be outdone. Of those that were seen to do that, or to be tied with it, none ended above 1.5 times.
const IS_A_RIVAL: f64 = 2.0;
/// Where no effect that promises something brings the held-out cost below this, all are searched for: what the base model's
/// fit has come to rest in may hide what is missing.
const LEFT_OPEN: f64 = 1.3;
/// Most of them that hop from valley to valley first, best first.
const DEEPENED: usize = 2;
/// Most effects with which a selection begins again that were tied with the one that was chosen first, where something is left, or
/// that alone explain enough, where several explain everything.
const OTHER_BEGINNINGS: usize = 2;
/// Most exchanges of effects before the selection is taken to go round in circles.
const EXCHANGES: usize = 4;

/// What a selection comes to.
#[derive(Debug)]
pub(super) enum Sought {
    /// Its result.
    Found(Box<Attribution>),
    /// What was chosen shows that there is only so much noise: all is to be judged by that, from the beginning.
    Quieter(BTreeMap<String, Noise>),
    /// It shows that the command does this between its rows: all is to be sought with that, from the beginning.
    OtherHold(Hold),
    /// It shows when the command jumped between them: the same.
    Placed(Box<IdentificationProblem>),
}

/// The result of the selection.
#[derive(Debug, Clone)]
pub(super) struct Attribution {
    /// The base model with the effects.
    pub(super) model: Model,
    /// The effects, in the order in which they were added.
    pub(super) added: Vec<Added>,
    /// What the first cause may have been as well: it leads to a model that is as complete.
    as_complete: Vec<Effect>,
    /// How many effects stand before the first cause.
    given: usize,
    /// What share of what is left above the noise what the sensors add takes, if it is there, and each cause after it.
    pub(super) shares: Vec<f64>,
    /// Every effect of every round.
    pub(super) considered: Vec<Considered>,
    /// Whether something is left, and causes come closer with the other of held and interpolated.
    pub(super) closer_the_other_way: bool,
    refits: Refits,
}

/// A model with each of some effects.
type Alternatives = Vec<(Effect, Model)>;
/// What was refitted on top of which effects.
type Refits = HashMap<Vec<String>, Alternatives>;

/// A round of a selection.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    /// Its number, from 1; 0 where what was chosen is compared with its rivals.
    round: usize,
    /// Whether no cause was chosen yet.
    first: bool,
    /// How many choices may still follow, this one among them.
    room: usize,
}

/// What the model may lack.
pub(super) struct Allowed<'a> {
    /// Which effects are looked for.
    pub(super) asked: &'a [Effect],
    /// Where the base model fails.
    pub(super) located: Option<Located>,
    /// What else the command may do between its rows, where nothing says what it does.
    pub(super) other_hold: Option<Hold>,
    /// What places the command's jumps between its rows, where that may still be done.
    pub(super) jumping: Option<Jumping<'a>>,
}

impl Allowed<'_> {
    fn ever(&self, effect: &Effect) -> bool {
        self.asked.contains(effect)
    }

    /// As the first cause only what may be missing where the base model fails.
    fn in_round(&self, first: bool, effect: &Effect) -> bool {
        let admitted = || self.located.is_none_or(|one| one.admits(effect));
        self.ever(effect) && (!first || admitted())
    }
}

/// A stepwise selection of effects under way.
pub(super) struct Selection<'a, 'b> {
    pub(super) evidence: &'a Evidence,
    pub(super) evaluator: &'a mut dyn Evaluator,
    /// What searches around each trial of an effect.
    pub(super) method: &'a dyn Method,
    allowed: Allowed<'a>,
    pub(super) max_effects: usize,
    pub(super) stage: &'a mut Stage<'b>,
    /// Held-out cost of the base model above the noise.
    pub(super) excess: f64,
    /// What the sensors add, of which several were chosen at once.
    sensors: Vec<Effect>,
    /// What the first cause is added to, where that is more than the base model: what the sensors add, too.
    beneath: Option<Model>,
    /// What there is to begin again with, because of what was added to the base model.
    again: Option<Sought>,
    refits: Refits,
    considered: Vec<Considered>,
}

impl<'a, 'b> Selection<'a, 'b> {
    pub(super) fn new(
        evidence: &'a Evidence,
        base: &Model,
        evaluator: &'a mut dyn Evaluator,
        method: &'a dyn Method,
        allowed: Allowed<'a>,
        max_effects: usize,
        stage: &'a mut Stage<'b>,
    ) -> Self {
        Self {
            evidence,
            evaluator,
            method,
            allowed,
            max_effects,
            stage,
            excess: base.excess(),
            sensors: Vec::new(),
            beneath: None,
            again: None,
            refits: Refits::new(),
            considered: Vec::new(),
        }
    }

    /// Adds effects to `base` until nothing more is significant.
    pub(super) fn run(mut self, base: &Model) -> Result<Sought> {
        let (mut model, mut order) = self.grown(base, base.clone(), Vec::new(), None)?;
        if let Some(again) = self.again {
            return Ok(again);
        }
        let mut closer_the_other_way = false;
        let mut as_complete = Vec::new();
        let beneath = self.beneath.clone();
        let beneath = beneath.as_ref().unwrap_or(base);
        let causes = self.causes(beneath);
        if !self.evidence.is_followed_by(&model) {
            // What the sensors add may have stood for a cause of the same name.
            let alone = self.causes(base);
            if self.stage.goes_on() {
                let all = [&causes[..], &alone].concat();
                let closer = |other| come_closer(self.evidence, other, beneath, &all);
                closer_the_other_way = self.allowed.other_hold.is_some_and(closer);
            }
            if !closer_the_other_way {
                if self.beneath.is_some() {
                    self.begin_without_sensors(base, beneath, alone, &mut model, &mut order)?;
                }
                self.begin_otherwise(base, beneath, causes, &mut model, &mut order)?;
            }
            self.drop_superfluous(&mut model, &mut order);
        } else {
            self.drop_superfluous(&mut model, &mut order);
            as_complete = self.as_complete(base, beneath, causes, &model, &order)?;
        }
        let added = self.chain(base, &model, &order);
        Ok(Sought::Found(Box::new(Attribution {
            shares: self.shares(base, &model, &added),
            added,
            as_complete,
            given: self.given(&order).len(),
            model,
            considered: self.considered,
            closer_the_other_way,
            refits: self.refits,
        })))
    }

    /// `model`, which is `base` with the effects in `order`, with as many more as are significant; no more than one where that does not
    /// lead below the held-out cost of a `rival`.
    fn grown(
        &mut self,
        base: &Model,
        mut model: Model,
        mut order: Vec<Effect>,
        rival: Option<&Model>,
    ) -> Result<(Model, Vec<Effect>)> {
        let new = |model: &Model, order: &[Effect]| -> Vec<Effect> {
            let has = |effect: &&Effect| {
                base.structure().effects.contains(effect) || order.contains(effect)
            };
            let effects = model.structure().effects.iter();
            effects.filter(|effect| !has(effect)).copied().collect()
        };
        let mut exchanges = 0;
        let from_the_base = order.is_empty();
        let mut round = self.choices(&order);
        // Where the choices so far leave nothing that a verdict asks for, a weak effect may still be seen.
        let mut suffices = false;
        while self.choices(&order) < self.max_effects && self.stage.goes_on() {
            round += 1;
            suffices = suffices || (round > 1 && self.evidence.is_followed_by(&model));
            let room = match suffices {
                true => 1,
                false => self.max_effects - self.choices(&order),
            };
            // The first cause is the one that must not be wrong.
            let first = order.iter().all(|effect| self.sensors.contains(effect));
            let Some(next) = self.addition(&model, Round { round, first, room })? else {
                break;
            };
            let before = model.loss(Side::HoldOut);
            order.extend(new(&next, &order));
            model = self.evidence.released(&next).unwrap_or(next);
            if from_the_base {
                self.again = self.begin_again(&model, first);
                if self.again.is_some() {
                    break;
                }
            }
            if rival.is_some_and(|rival| model.loss(Side::HoldOut) >= rival.loss(Side::HoldOut)) {
                break;
            }
            while !suffices && exchanges < EXCHANGES && self.stage.goes_on() {
                let Some(better) = self.exchange(&model, &order)? else {
                    break;
                };
                exchanges += 1;
                order.retain(|effect| better.structure().effects.contains(effect));
                order.extend(new(&better, &order));
                model = better;
            }
            // What is left is shared by too many.
            let share = taken(before, model.loss(Side::HoldOut));
            if !suffices && share < LEAST_OF_AN_EQUAL_SHARE / room as f64 {
                break;
            }
        }
        Ok((model, order))
    }

    /// What all is to be begun again with, if `model`, that has the `first` cause or more, shows it.
    fn begin_again(&self, model: &Model, first: bool) -> Option<Sought> {
        if let Some(noise) = self.evidence.quieter(model) {
            return Some(Sought::Quieter(noise));
        }
        if !first {
            return None;
        }
        let jumping = self.allowed.jumping.as_ref();
        let placed = jumping.and_then(|jumping| jumping.placed_by(self.evidence, model));
        if let Some(placed) = placed {
            return Some(Sought::Placed(Box::new(placed)));
        }
        let other = self.allowed.other_hold?;
        let preferred = self.evidence.prefers(other, model);
        preferred.then_some(Sought::OtherHold(other))
    }

    /// How many choices led to the effects in `order`: what the sensors add came at once.
    fn choices(&self, order: &[Effect]) -> usize {
        let of_sensors = |effect: &&Effect| self.sensors.contains(effect);
        let at_once = order.iter().filter(of_sensors).count();
        order.len() - at_once.saturating_sub(1)
    }

    /// Those of the effects in `order` that the first cause was added to.
    fn given(&self, order: &[Effect]) -> Vec<Effect> {
        let beneath = self.beneath.iter();
        let own: Vec<Effect> = beneath
            .flat_map(|one| one.structure().effects.clone())
            .collect();
        let given = order.iter().take_while(|effect| own.contains(effect));
        given.copied().collect()
    }

    /// Others of the `causes` than the first effect of the `order` begin as well, those that it was tied with first: one that leads to a
    /// complete model, or surely to a better one, takes the place of `model`, which is not. What takes most alone may be neither of two.
    fn begin_otherwise(
        &mut self,
        base: &Model,
        beneath: &Model,
        mut causes: Vec<(Effect, Model)>,
        model: &mut Model,
        order: &mut Vec<Effect>,
    ) -> Result<()> {
        let given = self.given(order);
        let round = 1 + self.choices(&given);
        let chosen = |one: &&Considered| one.round == round && one.decision == Decision::Chosen;
        let first = self.considered.iter().find(chosen);
        let first = first.and_then(|first| self.refitted(beneath, first.effect));
        let Some(first) = first.filter(|_| self.max_effects > 1) else {
            return Ok(());
        };
        causes.retain(|(_, one)| self.worth(beneath, one));
        let (tied, others): (Vec<_>, Vec<_>) = causes
            .into_iter()
            .partition(|(_, one)| self.evidence.same(&first, one));
        let tied = other_beginnings(tied, order).map(|one| (one, true));
        let others = other_beginnings(others, order).map(|one| (one, false));
        for (beginning, tied) in tied.chain(others) {
            self.begin_with(base, &given, beginning, tied, model, order)?;
        }
        Ok(())
    }

    /// The best of the causes that stand `alone` on the base model begins as well, where it does better than all that the sensors add,
    /// which were preferred because they are simpler.
    fn begin_without_sensors(
        &mut self,
        base: &Model,
        beneath: &Model,
        mut alone: Alternatives,
        model: &mut Model,
        order: &mut Vec<Effect>,
    ) -> Result<()> {
        let enough = |one: &Model| self.max_effects > 1 && self.worth(base, one);
        let closer = |one: &Model| one.loss(Side::HoldOut) < beneath.loss(Side::HoldOut);
        alone.retain(|(_, one)| closer(one) && enough(one));
        if let Some(best) = other_beginnings(alone, &[]).next() {
            self.begin_with(base, &[], best, false, model, order)?;
        }
        Ok(())
    }

    /// An effect begins on top of those that are `given`. What grows from it takes the place of `model` where that leaves
    /// something, if it is complete or surely better; where it was not `tied` with what `model` began with, it has to be better soon.
    fn begin_with(
        &mut self,
        base: &Model,
        given: &[Effect],
        (effect, start): (Effect, Model),
        tied: bool,
        model: &mut Model,
        order: &mut Vec<Effect>,
    ) -> Result<()> {
        if !self.stage.goes_on() || self.evidence.is_followed_by(model) {
            return Ok(());
        }
        let round = 1 + self.choices(given);
        let noted = self.considered.len();
        let begun = [given, &[effect]].concat();
        let rival = (!tied).then_some(&*model);
        let (other, effects) = self.grown(base, start, begun, rival)?;
        if !self.evidence.is_followed_by(&other) && !self.evidence.outdoes(&other, model) {
            self.considered.truncate(noted);
            return Ok(());
        }
        let later = self.considered.split_off(noted);
        self.considered.retain(|one| one.round <= round);
        let of_first = |one: &&mut Considered| one.round == round;
        for one in self.considered.iter_mut().filter(of_first) {
            one.decision = match one.decision {
                _ if one.effect == effect => Decision::Chosen,
                Decision::Chosen => Decision::Outdone,
                other => other,
            };
        }
        self.considered.extend(later);
        (*model, *order) = (other, effects);
        Ok(())
    }

    /// Every effect that was refitted on top of `model`.
    fn causes(&self, model: &Model) -> Alternatives {
        let known = self.refits.get(&names(model.structure()));
        known.cloned().unwrap_or_default()
    }

    /// Where several effects make `model` complete, those of the `causes` that, in the place of the first, lead to a model of no more
    /// parameters that is as complete: what an effect takes by itself may be shared out among others.
    fn as_complete(
        &mut self,
        base: &Model,
        beneath: &Model,
        mut causes: Vec<(Effect, Model)>,
        model: &Model,
        order: &[Effect],
    ) -> Result<Vec<Effect>> {
        let mut as_complete = Vec::new();
        let given = self.given(order);
        let [first, _, ..] = &order[given.len()..] else {
            return Ok(as_complete);
        };
        let before = beneath.loss(Side::HoldOut);
        causes.retain(|(_, one)| taken(before, one.loss(Side::HoldOut)) >= EXPLAINED);
        for (effect, start) in other_beginnings(causes, order) {
            if !self.stage.goes_on() {
                break;
            }
            let noted = self.considered.len();
            let begun = [&given[..], &[effect]].concat();
            let (other, effects) = self.grown(base, start, begun, None)?;
            self.considered.truncate(noted);
            // Beside the first it stands for what came later; and it may have been exchanged itself.
            let instead =
                effects.contains(&effect) && !effects.iter().any(|one| one.is_form_of(first));
            let no_more = other.size() <= model.size();
            if instead && no_more && self.evidence.both_complete(model, &other) {
                as_complete.push(effect);
            }
        }
        Ok(as_complete)
    }

    /// The best model with one effect more, or with what the sensors add, or with a pair where none helps alone; `None` where nothing
    /// is significant.
    fn addition(&mut self, model: &Model, at: Round) -> Result<Option<Model>> {
        let Round { round, first, room } = at;
        self.stage.begins(&format!("round {round}: screening"));
        let resolved = self.evidence.resolved(model);
        let observed = &model.structure().observed;
        if observed.iter().all(|output| resolved.contains(output)) {
            return Ok(None);
        }
        let has_moved = !first && self.evidence.has_moved_the_spool(model);
        // A sensor's own effect would follow the rounding of its channel.
        let seen = |effect: &Effect| {
            let own = effect
                .output
                .is_some_and(|output| resolved.contains(&output));
            let moves = has_moved && shows_in_the_spool(effect);
            !own && !moves && self.allowed.in_round(first, effect)
        };
        let Some(screening) = Screening::new(self.evidence, model, &seen) else {
            return Ok(None);
        };
        let most = match first {
            true => f64::INFINITY,
            false => LEADS_SOMEWHERE * self.evidence.cost(&model.problem),
        };
        let mut models = self.refit(model, &screening, at, most)?;
        if !self.stage.goes_on() {
            return Ok(None);
        }
        let effects: Vec<Effect> = screening.effects.iter().map(|one| one.effect).collect();
        self.exchange_poles(&effects, &mut models);
        if let Some((sensors, all)) = self.with_sensors(model, &models, &resolved) {
            self.record(&screening, &models, &[&all], &sensors, at, model);
            self.sensors.extend(sensors);
            if first {
                self.beneath = Some(all.clone());
            }
            return Ok(Some(all));
        }
        if first {
            // Where the best so far shows how to begin again, better ones are sought then.
            let best = self.evidence.best(&self.worthy(model, &models)).cloned();
            let best = best.map(|best| self.evidence.released(&best).unwrap_or(best));
            self.again = best.and_then(|best| self.begin_again(&best, first));
            if self.again.is_some() {
                return Ok(None);
            }
            self.deepen(model, &mut models);
        }
        // What one effect leaves the next rounds look at.
        let wanted = |selection: &Self, models: &[(Effect, Model)]| {
            let (left, none) = selection.left(model, models);
            left > LEFT_OPEN && (first || none) && room > 1 && selection.stage.goes_on()
        };
        if wanted(self, &models) {
            self.lead(model, &effects, &mut models, round)?;
            if wanted(self, &models) {
                self.widen(model, &effects, &mut models, round)?;
            }
        }
        if !self.stage.goes_on() {
            return Ok(None);
        }
        // What is compared with this model later knows them, too.
        self.refits.insert(names(model.structure()), models.clone());
        let accepted = self.worthy(model, &models);
        let best = self.evidence.best(&accepted).cloned();
        let chosen = best.iter().flat_map(|best| {
            let new = |effect: &&Effect| !model.structure().effects.contains(effect);
            best.structure().effects.iter().filter(new)
        });
        let chosen: Vec<Effect> = chosen.copied().collect();
        self.record(&screening, &models, &accepted, &chosen, at, model);
        if best.is_some() || room < 2 {
            return Ok(best);
        }
        self.pair(model, &screening, round)
    }

    /// `model` with what its sensors add, where that is preferred to each of the `models` with one effect; nothing of a channel that
    /// is `resolved`.
    fn with_sensors(
        &mut self,
        model: &Model,
        models: &[(Effect, Model)],
        resolved: &[Output],
    ) -> Option<(Vec<Effect>, Model)> {
        if !self.stage.goes_on() {
            return None;
        }
        let allowed = |effect: &Effect| {
            let own = effect.output.is_some_and(|one| resolved.contains(&one));
            !own && self.allowed.ever(effect)
        };
        let lowers =
            |before: &Model, after: &Model| self.evidence.lowers(self.excess, before, after);
        let (sensors, all) = with_sensors(self.evidence, model, allowed, lowers)?;
        let worthy = self.worthy(model, models).into_iter();
        let among: Vec<&Model> = worthy.chain([&all]).collect();
        let best = self.evidence.best(&among);
        best.is_some_and(|best| std::ptr::eq(best, &all))
            .then_some((sensors, all))
    }

    /// Refits the plausible effects of a screening on top of `model`; those that cost more than `most` after a few steps no further.
    fn refit(
        &mut self,
        model: &Model,
        screening: &Screening,
        Round { round, first, .. }: Round,
        most: f64,
    ) -> Result<Vec<(Effect, Model)>> {
        let key: Vec<String> = names(model.structure());
        if let Some(known) = self.refits.get(&key) {
            return Ok(known.clone());
        }
        let best = screening
            .effects
            .first()
            .map_or(0.0, |best| best.predicted_reduction);
        let plausible: Vec<&Screened> = screening
            .effects
            .iter()
            .filter(|one| one.p_value <= LEVEL && one.predicted_reduction >= PLAUSIBLE * best)
            .take(REFITTED.0)
            .collect();
        self.stage.begins(&format!(
            "round {round}: trying {} effects",
            plausible.len()
        ));
        let begin = |one: &&Screened| self.evidence.extended(model, one.effect, &one.starts[0].0);
        let begin: Vec<Problem> = plausible.iter().map(begin).collect();
        let found = self
            .evidence
            .searched(&begin, self.method, self.evaluator, &mut |done| {
                self.stage.generation(done)
            })?;
        if !self.stage.goes_on() {
            return Ok(Vec::new());
        }
        let mut starts = Vec::new();
        for (one, found) in plausible.iter().zip(found) {
            for (start, _) in one.starts.iter().take(2) {
                starts.push((one.effect, self.evidence.extended(model, one.effect, start)));
            }
            starts.push((one.effect, found.problem));
        }
        self.stage.begins(&format!("round {round}: polishing"));
        // A few steps tell the starts of an effect apart, and in later rounds the effects.
        let begun = near(begun(self.evidence, starts), most);
        let most = if first { usize::MAX } else { FOLLOWED };
        let models = to_the_end(self.evidence, least_costly(begun, most, 1));
        // Of rivals that were not all refitted none is the best.
        if !self.stage.goes_on() {
            return Ok(Vec::new());
        }
        self.refits.insert(key, models.clone());
        Ok(models)
    }

    /// Those of `models` that are worth the effect that they have more than `model`.
    fn worthy<'m>(&self, model: &Model, models: &'m [(Effect, Model)]) -> Vec<&'m Model> {
        let models = models.iter().map(|(_, one)| one);
        models.filter(|one| self.worth(model, one)).collect()
    }

    /// The least held-out cost of `model` and of those of `models` that are worth their effect, and whether none is.
    fn left(&self, model: &Model, models: &[(Effect, Model)]) -> (f64, bool) {
        let worthy = self.worthy(model, models).into_iter();
        let least = worthy.map(|one| one.loss(Side::HoldOut)).reduce(f64::min);
        (least.unwrap_or(model.loss(Side::HoldOut)), least.is_none())
    }

    /// Where the best of the `models` leave much, they may have inherited a valley from `model`: they hop on to deeper ones.
    fn deepen(&mut self, model: &Model, models: &mut [(Effect, Model)]) {
        let (left, none) = self.left(model, models);
        if left <= LEFT_OPEN || none || !self.stage.goes_on() {
            return;
        }
        self.stage.begins("round 1: deeper valleys");
        let cost = |i: &usize| models[*i].1.loss(Side::HoldOut);
        let worthy = (0..models.len()).filter(|&i| self.worth(model, &models[i].1));
        let mut best: Vec<usize> = worthy.collect();
        best.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        for i in best.into_iter().take(DEEPENED) {
            if let Some(deeper) = self.evidence.deepened(&models[i].1) {
                models[i].1 = deeper;
            }
        }
    }

    /// Adds to the `models` those in which the loop has the poles of what it was followed by, where they are better: each began
    /// with the poles that the loop came to rest with alone, or the best one with a limit of those `effects` that it may be instead.
    fn exchange_poles(&mut self, effects: &[Effect], models: &mut Vec<(Effect, Model)>) {
        let evidence = self.evidence;
        let pairs = models.par_iter().flat_map_iter(|(effect, model)| {
            let others = models.iter().map(|(other, _)| *other);
            others.filter_map(move |other| {
                Some((other, evidence.with_poles_exchanged(model, *effect, other)?))
            })
        });
        let by_loss = |a: &&(Effect, Model), b: &&(Effect, Model)| {
            let [a, b] = [a, b].map(|one| one.1.loss(Side::HoldOut));
            a.total_cmp(&b)
        };
        let best = models.iter().min_by(by_loss);
        let limited = effects.par_iter().filter_map(|&other| {
            let (effect, model) = best?;
            Some((other, evidence.with_limit_for_loop(model, *effect, other)?))
        });
        let exchanged = least_costly(pairs.chain(limited).collect(), FOLLOWED, 1);
        let exchanged = to_the_end(evidence, exchanged);
        take_in(models, exchanged);
    }

    /// Adds to the `models` with one effect more those that were led along the measurement, where they are better.
    fn lead(
        &mut self,
        model: &Model,
        effects: &[Effect],
        models: &mut Vec<(Effect, Model)>,
        round: usize,
    ) -> Result<()> {
        self.stage
            .begins(&format!("round {round}: led along the measurement"));
        let found = led(self.evidence, model, effects, &mut |done| {
            self.stage.generation(done)
        })?;
        take_in(models, found);
        Ok(())
    }

    /// Adds to the `models` with one effect more those of a wide search, where they are better.
    fn widen(
        &mut self,
        model: &Model,
        effects: &[Effect],
        models: &mut Vec<(Effect, Model)>,
        round: usize,
    ) -> Result<()> {
        self.stage.begins(&format!(
            "round {round}: searching for {} effects",
            effects.len()
        ));
        let found = widely(self.evidence, model, effects, self.evaluator, &mut |done| {
            self.stage.generation(done)
        })?;
        take_in(models, found);
        Ok(())
    }

    /// [`Evidence::worth`] beside the base model of this selection.
    fn worth(&self, before: &Model, after: &Model) -> bool {
        self.evidence.worth(self.excess, before, after)
    }

    /// Two effects that explain together what neither does alone.
    fn pair(
        &mut self,
        model: &Model,
        screening: &Screening,
        round: usize,
    ) -> Result<Option<Model>> {
        let single = screening
            .effects
            .first()
            .map_or(0.0, |best| best.predicted_reduction);
        self.stage.begins(&format!("round {round}: pairs"));
        let pairs = screening.pairs(LEAST_OF_COST.max(1.2 * single), REFITTED.1);
        let models: Vec<Model> = pairs
            .into_par_iter()
            .filter_map(|[first, second]| {
                let evidence = self.evidence;
                let start = evidence.extended(model, first.effect, &first.starts[0].0);
                let one = model.begun_with(evidence.polished_a_little(start)?.problem);
                let both = evidence.extended(&one, second.effect, &second.starts[0].0);
                evidence.polished(both)
            })
            .collect();
        if !self.stage.goes_on() {
            return Ok(None);
        }
        let accepted: Vec<&Model> = models.iter().filter(|one| self.worth(model, one)).collect();
        Ok(self.evidence.best(&accepted).cloned())
    }

    /// A model that is surely better with one of its effects exchanged for another.
    fn exchange(&mut self, model: &Model, order: &[Effect]) -> Result<Option<Model>> {
        if let Some(better) = self.other_form(model, order) {
            return Ok(Some(better));
        }
        // The last one was chosen among all others just now, and what the sensors add together.
        let earlier = order[..order.len() - 1].iter();
        let earlier = earlier.filter(|effect| !self.sensors.contains(effect));
        for effect in earlier.copied().collect::<Vec<_>>() {
            let Some((_, rivals)) = self.rivals(model, order, effect)? else {
                continue;
            };
            for (_, other) in rivals {
                if self.evidence.outdoes(&other, model) && other.structure() != model.structure() {
                    return Ok(Some(other));
                }
            }
        }
        Ok(None)
    }

    /// A model that is surely better with one of its effects in another form, which begins where this one ended: of forms that
    /// are fitted apart from each other one may have come to rest in a valley that its own form has no part in.
    fn other_form(&mut self, model: &Model, order: &[Effect]) -> Option<Model> {
        if self.evidence.is_followed_by(model) {
            return None;
        }
        self.stage.begins("other forms");
        let all = known().flat_map(|entry| entry.on(model.structure()));
        let all: Vec<Effect> = all.filter(|form| self.allowed.ever(form)).collect();
        let changes = order.iter().flat_map(|&effect| {
            let forms = all.iter().copied();
            let forms = forms.filter(move |form| *form != effect && form.is_form_of(&effect));
            forms.map(move |form| (effect, form))
        });
        let changes: Vec<(Effect, Effect)> = changes.collect();
        if changes.is_empty() {
            return None;
        }
        let own = self.evidence.polished_a_little(model.problem.clone())?;
        let begun = changes.into_par_iter().filter_map(|(effect, form)| {
            let begun = self.evidence.handed_on(model, effect, form)?;
            (begun.cost < own.cost).then_some((form, begun))
        });
        let others = to_the_end(self.evidence, least_costly(begun.collect(), FOLLOWED, 1));
        let better: Vec<&Model> = others
            .iter()
            .map(|(_, one)| one)
            .filter(|one| self.evidence.outdoes(one, model))
            .collect();
        self.evidence.best(&better).cloned()
    }

    /// The plausible effects on top of `reduced` that come near `model`, which has another.
    fn alternatives(&mut self, reduced: &Model, model: &Model) -> Result<Alternatives> {
        if let Some(known) = self.refits.get(&names(reduced.structure())) {
            return Ok(known.clone());
        }
        if !self.stage.goes_on() {
            return Ok(Vec::new());
        }
        let allowed = |one: &Effect| self.allowed.ever(one);
        match Screening::new(self.evidence, reduced, &allowed) {
            Some(screening) => {
                let most = IS_A_RIVAL * self.evidence.cost(&model.problem);
                self.refit(reduced, &screening, Round::default(), most)
            }
            None => Ok(Vec::new()),
        }
    }

    /// `model` without `effect`, which is one of its effects in this `order`, and with each other in the place of that.
    fn rivals(
        &mut self,
        model: &Model,
        order: &[Effect],
        effect: Effect,
    ) -> Result<Option<(Model, Alternatives)>> {
        let Some(reduced) = self.evidence.without(model, effect) else {
            return Ok(None);
        };
        let mut rivals = self.alternatives(&reduced, model)?;
        take_in(&mut rivals, self.instead(model, order, effect));
        rivals.retain(|(other, _)| *other != effect);
        Ok(Some((reduced, rivals)))
    }

    /// What was refitted where `effect` was chosen, with what `model` got after it in this `order`. What leads to a rival may have
    /// been there then: without the effect the base model imitates that, and more so with what came later.
    fn instead(&self, model: &Model, order: &[Effect], effect: Effect) -> Alternatives {
        let chosen = order.iter().position(|one| *one == effect).unwrap_or(0);
        let (from, later) = (&order[chosen..], &order[chosen + 1..]);
        if later.is_empty() || !self.stage.goes_on() {
            return Vec::new();
        }
        let without = |structure: Structure, one: &Effect| structure.without(*one);
        let before = from.iter().fold(model.structure().clone(), without);
        let known = self.refits.get(&names(&before)).into_iter().flatten();
        let others = known.filter(|(other, _)| !from.contains(other));
        let starts = others.map(|(other, one)| {
            let structure = model.structure().without(effect).with(*other);
            let own = one.problem.parameters.iter();
            let start: Vec<Parameter> = own.chain(&model.problem.parameters).cloned().collect();
            (*other, self.evidence.problem(&structure, &start))
        });
        let most = IS_A_RIVAL * self.evidence.cost(&model.problem);
        let begun = near(begun(self.evidence, starts.collect()), most);
        to_the_end(self.evidence, least_costly(begun, FOLLOWED, 1))
    }

    /// Drops effects that the others have made superfluous.
    fn drop_superfluous(&mut self, model: &mut Model, order: &mut Vec<Effect>) {
        while self.stage.goes_on() {
            let spare = order.iter().find_map(|&effect| {
                let reduced = self.evidence.without(model, effect)?;
                (order.len() > 1 && !self.worth(&reduced, model)).then_some((effect, reduced))
            });
            let Some((effect, reduced)) = spare else {
                return;
            };
            order.retain(|other| *other != effect);
            *model = reduced;
        }
    }

    /// `model` with `effect` as it was refitted when that was chosen.
    fn refitted(&self, model: &Model, effect: Effect) -> Option<Model> {
        let refits = self.refits.get(&names(model.structure()))?.iter();
        let mut own = refits.filter(|(other, _)| *other == effect);
        own.next().map(|(_, model)| model.clone())
    }

    /// The chain of effects with the error at each step.
    fn chain(&self, base: &Model, model: &Model, order: &[Effect]) -> Vec<Added> {
        let mut added = Vec::new();
        let mut current = base.clone();
        for (i, &effect) in order.iter().enumerate() {
            let structure = current.structure().with(effect);
            let next = match i + 1 == order.len() {
                true => model.clone(),
                false => {
                    let problem = self.evidence.problem(&structure, &model.problem.parameters);
                    self.evidence
                        .polished(problem)
                        .or_else(|| self.refitted(&current, effect))
                        .unwrap_or_else(|| current.clone())
                }
            };
            added.push(Added {
                effect,
                tied_with: Vec::new(),
                error_before: current.loss(Side::HoldOut).sqrt(),
                error_after: next.loss(Side::HoldOut).sqrt(),
                contest: None,
            });
            current = next;
        }
        added
    }

    /// What share of what is left above the noise is taken of by what the sensors add, all together and first, and by each of the others
    /// that were `added`, or of what the others leave without it, where that is nearly all. A zero that is off may be small beside a
    /// cause that hides it.
    fn shares(&self, base: &Model, model: &Model, added: &[Added]) -> Vec<f64> {
        let order = added.iter().map(|one| one.effect);
        let (sensors, causes): (Vec<Effect>, Vec<Effect>) = order.partition(of_a_sensor);
        let first = added.iter().take_while(|one| of_a_sensor(&one.effect));
        let chain = match first.count() == sensors.len() {
            true => added.to_vec(),
            false => self.chain(base, model, &[&sensors[..], &causes].concat()),
        };
        let (sensors, causes) = chain.split_at(sensors.len());
        let joint = sensors.first().zip(sensors.last()).map(|(first, last)| {
            let [before, after] = [first.error_before, last.error_after];
            taken(before.powi(2), after.powi(2))
        });
        let own = causes.iter().map(|one| {
            counted(one.taken(), || {
                let without = self.evidence.without(model, one.effect);
                let left = without.map(|other| other.loss(Side::HoldOut));
                left.map_or(0.0, |left| taken(left, model.loss(Side::HoldOut)))
            })
        });
        // Beside causes it may be little.
        let joint = joint.map(|share| if causes.is_empty() { share } else { 1.0 });
        joint.into_iter().chain(own).collect()
    }

    /// Compares each effect of what was `found` with its rivals: what it is tied with, and the closest.
    pub(super) fn contests(mut self, found: &mut Attribution) -> Result<()> {
        self.refits = std::mem::take(&mut found.refits);
        let model = &found.model;
        let order: Vec<Effect> = found.added.iter().map(|one| one.effect).collect();
        for one in &mut found.added {
            let effect = one.effect;
            self.stage.begins(&format!("rivals of {effect}"));
            let Some((reduced, mut rivals)) = self.rivals(model, &order, effect)? else {
                continue;
            };
            rivals
                .sort_by(|(_, a), (_, b)| a.loss(Side::HoldOut).total_cmp(&b.loss(Side::HoldOut)));
            one.contest = Some(Contest {
                without: (&reduced.problem).into(),
                with: (&model.problem).into(),
                rival: rivals.first().map(|(effect, rival)| Rival {
                    effect: *effect,
                    refit: (&rival.problem).into(),
                    error: rival.loss(Side::HoldOut).sqrt(),
                }),
            });
            let ties = rivals.iter().filter(|(other, rival)| {
                // What a form has more than the one that is as good is not needed: that is no other cause.
                let richer = other.is_form_of(&effect) && rival.size() > model.size();
                !richer && self.evidence.tied(&reduced, model, rival) && self.worth(&reduced, rival)
            });
            one.tied_with = ties.map(|(other, _)| *other).collect();
        }
        if let Some(first) = found.added.get_mut(found.given) {
            let known = first.tied_with.clone();
            let others = found.as_complete.iter();
            let new = others.filter(|other| !known.contains(other));
            first.tied_with.extend(new);
        }
        Ok(())
    }

    /// Notes what became of every effect of a round.
    fn record(
        &mut self,
        screening: &Screening,
        models: &[(Effect, Model)],
        accepted: &[&Model],
        chosen: &[Effect],
        Round { round, first, .. }: Round,
        before: &Model,
    ) {
        let before = first.then(|| before.loss(Side::HoldOut).sqrt());
        for one in &screening.effects {
            let model = models.iter().find(|(effect, _)| *effect == one.effect);
            let model = model.map(|(_, model)| model);
            let worth = model.is_some_and(|m| accepted.iter().any(|a| std::ptr::eq(*a, m)));
            let decision = match model {
                _ if chosen.contains(&one.effect) => Decision::Chosen,
                Some(_) if worth => Decision::Outdone,
                Some(_) => Decision::NotEnough,
                None if one.p_value > LEVEL => Decision::NotSignificant,
                None => Decision::FarLess,
            };
            self.considered.push(Considered {
                effect: one.effect,
                round,
                predicted_reduction: 100.0 * one.predicted_reduction,
                p_value: one.p_value,
                test_ratio: one.test_ratio,
                refit: model.map(|model| (&model.problem).into()),
                error: model.map(|model| model.loss(Side::HoldOut).sqrt()),
                before_first: before,
                decision,
            });
        }
    }
}

/// Those of the `causes` that a selection may have begun with instead of with the first of this `order`, the best first: each is
/// another cause than all of that.
fn other_beginnings(
    mut causes: Vec<(Effect, Model)>,
    order: &[Effect],
) -> impl Iterator<Item = (Effect, Model)> + use<> {
    let loss = |(_, one): &(Effect, Model)| one.loss(Side::HoldOut);
    causes.sort_by(|a, b| loss(a).total_cmp(&loss(b)));
    let mut begun = order.to_vec();
    causes.retain(|(effect, _)| {
        let another = !begun.iter().any(|one| one.is_form_of(effect));
        begun.push(*effect);
        another
    });
    causes.into_iter().take(OTHER_BEGINNINGS)
}

/// Adds to the `models` those that were `found`, each in the place of one with the same effect that follows the fitted rows less
/// closely.
fn take_in(models: &mut Vec<(Effect, Model)>, found: Vec<(Effect, Model)>) {
    for (effect, one) in found {
        match models.iter_mut().find(|(other, _)| *other == effect) {
            Some((_, known)) if known.loss(Side::Fit) <= one.loss(Side::Fit) => {}
            Some((_, known)) => *known = one,
            None => models.push((effect, one)),
        }
    }
}

fn names(structure: &Structure) -> Vec<String> {
    let effects = structure.effects.iter();
    effects.map(ToString::to_string).collect()
}
