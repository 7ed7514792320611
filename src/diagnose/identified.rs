//! The result of a diagnosis.

use super::added::{Added, Considered, first_causes};
use super::fitted::{Fitted, TOLERATED, variance};
use super::free_form::FoundForm;
use super::hold::Between;
use super::located::Located;
use super::measurements::Measurements;
use super::signature::{Signature, closest};
use super::simulation::Sides;
use super::statistics::bootstrap::Improvement;
use super::statistics::noise::Noise;
use super::verdict::Verdict;
use crate::model::Output;
use crate::model::effects::{CATALOGUE, Effect};
use crate::search::Fit;
use crate::{Error, Result};
use std::collections::BTreeMap;

/// A result with fewer effects stands if its held-out cost is larger by less than this share.
const AS_GOOD: f64 = 0.1;

/// Causes that are told where none fits.
const NEAREST: usize = 3;

/// A model with what the data say of it.
#[derive(Debug, Clone)]
pub struct Identified {
    /// What the diagnosis comes to.
    pub verdict: Verdict,
    /// The effects that were looked for.
    pub asked: Vec<Effect>,
    /// The base model.
    pub before: Fitted,
    /// The base model with what was added; the base model itself where nothing was.
    pub after: Fitted,
    /// The effects of the result, in the order in which they were added.
    pub added: Vec<Added>,
    /// An effect that would have been added if not too many others did as well.
    pub undecided: Option<Added>,
    /// Where the verdict is unexplained: the curve that best describes what is missing, if any helps.
    pub free_form: Option<FoundForm>,
    /// Held-out error of the base model: RMS in units of noise over all channels.
    pub error_before: f64,
    /// Where the base model fails; `None` where it does not, or the records do not tell.
    pub located_before: Option<Located>,
    /// Where something is missing that is not named; `None` where nothing is, or the records do not tell.
    pub located: Option<Located>,
    /// Every effect that was looked at, round by round.
    pub considered: Vec<Considered>,
    /// By how much the error fell, on fitted and on held-out rows, all channels in units of their noise.
    pub improvement: Sides<Option<Improvement>>,
    /// What gave it away: of each effect that was added and has a contest its signatures; where there is none, one list of those
    /// of the base model's residual.
    pub signatures: Vec<Vec<Signature>>,
    /// Share of the held-out error above the noise, squared, that the effects that were found explain; `None` where none was.
    pub explained: Option<f64>,
    /// The records.
    pub measurements: Measurements,
    /// Each observed channel's noise.
    pub noise: BTreeMap<String, Noise>,
    /// What was taken for the command between two rows.
    pub between: Between,
    /// The search for the base model, with each channel in units of its own deviation: the noise was not known yet.
    pub search: Fit,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// The stage in which it was broken off: everything is as far as it was known then.
    pub broken_off: Option<String>,
}

impl Identified {
    /// Whether the result is more than the base model.
    pub fn changed(&self) -> bool {
        !self.added.is_empty() || self.free_form.is_some()
    }

    /// Whether something has no name because it shows in held-out rows alone, of which nothing is learnt.
    pub fn shows_in_held_out_rows_alone(&self) -> bool {
        self.verdict == Verdict::Unexplained
            && self.before.fails_on_held_out_rows_alone(&self.noise)
    }

    /// Whether every effect of the catalogue that can act was looked for, but for those that the base model has.
    pub fn asked_all(&self) -> bool {
        let structure = &self.before.problem.structure;
        let mut all = CATALOGUE.iter().flat_map(|entry| entry.on(structure));
        all.all(|effect| structure.effects.contains(&effect) || self.asked.contains(&effect))
    }

    /// Where something is missing that has no name: the effect that came closest to it.
    pub fn closest(&self) -> Option<&Considered> {
        closest(self.verdict, &self.considered)
    }

    /// Where something is missing that has no name: the effects that come closest as the first cause, with the share of the squared
    /// held-out error above the noise, beside what the sensors add, that each alone explains, the most first; of each its best form.
    pub fn nearest(&self) -> Vec<(Effect, f64)> {
        if self.verdict != Verdict::Unexplained {
            return Vec::new();
        }
        let first = first_causes(&self.considered).into_iter();
        let mut nearest: Vec<(Effect, f64)> = Vec::new();
        for (one, share) in first.filter(|(_, share)| *share > 0.0) {
            if !nearest
                .iter()
                .any(|(other, _)| one.effect.is_form_of(other))
            {
                nearest.push((one.effect, share));
            }
        }
        nearest.truncate(NEAREST);
        nearest
    }

    /// Whether this is to be preferred to an `other` result that took the command between two rows for something else: it follows the
    /// held-out rows as well with fewer effects, or better with as many; or it is complete; or it has the same effects, and the
    /// fitted rows prefer it.
    pub(super) fn is_preferred_to(&self, other: &Self) -> bool {
        let (effects, others) = (self.added.len(), other.added.len());
        let better = || (1.0 + AS_GOOD) * self.held_out_cost() < other.held_out_cost();
        let same_and_preferred = || {
            let has = |added: &Added| other.added.iter().any(|one| one.effect == added.effect);
            let beside = other.between.other.as_ref();
            let preferred = beside.and_then(|beside| beside.preferred);
            self.added.iter().all(has) && preferred == Some(self.between.taken)
        };
        match (self.is_complete(), other.is_complete()) {
            (true, false) => true,
            (false, true) => false,
            _ if effects < others => self.is_as_good_as(other),
            _ => effects == others && (better() || same_and_preferred()),
        }
    }

    /// Whether all effects are to be tried with the other of held and interpolated. What is ahead by half an interval may be a
    /// command that went straight on between its rows; what is not followed may come closer with the other, and what has a name may
    /// prefer it.
    pub(super) fn may_be_the_other_way(&self) -> bool {
        let may = |one: &Added| one.effect.leads() || self.between.other_is_preferred();
        let left = matches!(self.verdict, Verdict::Partly | Verdict::Unexplained);
        self.added.iter().any(may) || (left && self.between.closer)
    }

    /// Whether nothing is missing, or no more than was found.
    pub(super) fn is_complete(&self) -> bool {
        matches!(self.verdict, Verdict::Found | Verdict::None)
    }

    /// Whether it follows the held-out rows as well as the `other`.
    pub(super) fn is_as_good_as(&self, other: &Self) -> bool {
        self.held_out_cost() < (1.0 + AS_GOOD) * other.held_out_cost()
    }

    /// The held-out error, squared, in units of noise and summed over all channels.
    fn held_out_cost(&self) -> f64 {
        let errors = self.after.errors.hold_out.iter();
        errors
            .map(|(name, error)| (error.rmse / self.noise[name].value).powi(2))
            .sum()
    }

    /// Refuses a model whose integrator errs by more than the noise and than the model itself: its figures would say more of
    /// the integrator. That is meant of all rows together; a few, where something touches a stop, are worth a warning. What is
    /// known of a run that was broken off is told with that warning.
    pub(super) fn check_integration(&self) -> Result<()> {
        let structure = &self.after.problem.structure;
        let allowed = |output: Output| {
            let range = variance(&self.measurements.fit, output).sqrt();
            let floor = self.noise[output.name()].value.max(TOLERATED * range);
            floor.max(self.after.errors.fit[output.name()].rmse)
        };
        let is_large =
            |&output: &Output| self.after.integration_error[output.name()] > allowed(output);
        if self.broken_off.is_some() || !structure.observed.iter().any(is_large) {
            return Ok(());
        }
        for (output, changes) in self.after.changes_of_half_steps() {
            let square = changes.iter().map(|change| change * change).sum::<f64>();
            let change = (square / changes.len() as f64).sqrt();
            let allowed = allowed(output);
            if change > allowed {
                let (name, unit) = (output.name(), structure.unit(output));
                return Err(Error::failed(
                    format!(
                        "halving the integration steps changes the {name} by {change:.3e} {unit} (RMS), which is more than noise \
                         and model leave, {allowed:.3e} {unit}"
                    ),
                    "raise the upper bound of the fastest parameter with --model: the steps follow from the bounds",
                ));
            }
        }
        Ok(())
    }
}
