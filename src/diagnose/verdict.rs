//! What a diagnosis comes to.

use serde::{Deserialize, Serialize};

/// Effects are a part of what is missing if they explain this share of what the base model leaves above the noise. Something
/// else that merely resembles an effect seldom follows it so closely.
pub(super) const EXPLAINED: f64 = 0.8;
/// And if each of them takes this share of what those before it have left above the noise, where they do not reach it. Several that
/// take a little each are the pieces of a curve that is none of theirs.
const TAKEN: f64 = 0.4;
/// No more effects than this are named of a model that leaves so many times the noise: each further one bends to what is left of a
/// law that is none of theirs.
const FEW: usize = 2;
const FAR: f64 = 3.0;
/// They are no part of what a model lacks that fails: of each channel it has to follow this share of what is held out.
const FOLLOWED: f64 = 0.5;
/// And the whole of it if the held-out error of every channel may be below this many times its noise, which itself is known
/// to a few percent, and nothing that is left depends on anything known.
pub(super) const NEAR: f64 = 1.15;

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Effects explain what the base model could not, to the noise.
    Found,
    /// Effects explain most of it, and something else is left.
    Partly,
    /// Nothing is missing that this data could show, or so little that the base model follows it nearly to its noise, and no effect
    /// explains that.
    None,
    /// Something is missing that no effect explains of those that were looked for.
    Unexplained,
    /// No effect was looked for, or not to the end: none was asked, nothing was held out to judge them by, or the run was
    /// broken off.
    NotDiagnosed,
}

impl Verdict {
    /// As reports have it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Partly => "partly",
            Self::None => "none",
            Self::Unexplained => "unexplained",
            Self::NotDiagnosed => "not_diagnosed",
        }
    }
}

/// Share of the held-out cost above the noise, in units of it, that is gone where it was one and is another.
pub(super) fn taken(before: f64, after: f64) -> f64 {
    let excess = |cost: f64| (cost - 1.0).max(0.0);
    match excess(before) {
        0.0 => 1.0,
        before => 1.0 - excess(after) / before,
    }
}

/// The share that counts of an effect: of what those before it have left, or, where that is little, of what is left without it, if
/// that is nearly all. Of two in two channels the first takes little of what both leave.
pub(super) fn counted(of_left: f64, of_left_without: impl FnOnce() -> f64) -> f64 {
    if of_left >= TAKEN {
        return of_left;
    }
    let needed = of_left_without();
    if needed >= EXPLAINED { needed } else { of_left }
}

/// The criteria of the verdict.
#[derive(Debug, Clone, Copy)]
pub(super) struct Criteria {
    /// Whether effects were looked for, to the end.
    pub(super) diagnosed: bool,
    /// Held-out cost of the base model, in units of noise.
    pub(super) before: f64,
    /// The same with the effects that were added.
    pub(super) after: f64,
    /// What share of the held-out cost above the noise a choice takes of what those before it have left, at least.
    pub(super) least_taken: f64,
    /// Whether the base model fails on held-out rows alone: the effects then rest on nothing that was fitted.
    pub(super) unseen: bool,
    /// How many choices led to the effects that were added.
    pub(super) added: usize,
    /// Whether a channel goes on swinging where the command rests, and the model with the effects does not: no free run follows
    /// that in phase, and what lowers its error is chance.
    pub(super) swings: bool,
    /// Whether too many causes do as well as one that was added.
    pub(super) undecided: bool,
    /// Whether the base model's residual has structure.
    pub(super) structured_before: bool,
    /// Whether the residual has structure with the effects.
    pub(super) structured_after: bool,
    /// What share of a held-out channel's motion the model follows at least, beside its noise, with the effects.
    pub(super) least_followed: f64,
    /// What the held-out error of every channel is at least over its noise, with the effects: the lower end of the largest 95 %
    /// interval.
    pub(super) least_ratio: f64,
    /// Whether the base model follows every channel nearly to its noise, fitted and held out.
    pub(super) near_before: bool,
}

impl Criteria {
    /// Share of the held-out cost above the noise that the effects explain.
    pub(super) fn explained(&self) -> f64 {
        taken(self.before, self.after)
    }

    /// Whether effects that do not explain everything explain enough to be named.
    fn is_part(&self) -> bool {
        let believed = self.least_ratio < NEAR || self.least_taken >= TAKEN;
        let pile = self.added > FEW && self.least_ratio >= FAR;
        let most = self.explained() >= EXPLAINED && believed && !pile;
        (most || !self.structured_after) && self.least_followed >= FOLLOWED && !self.unseen
    }

    /// The verdict.
    pub(super) fn verdict(&self) -> Verdict {
        match (self.added > 0, self.structured_before) {
            (true, _) if self.swings || self.undecided => Verdict::Unexplained,
            (true, _) if !self.structured_after && self.least_ratio < NEAR => Verdict::Found,
            (true, _) if self.is_part() => Verdict::Partly,
            _ if !self.diagnosed => Verdict::NotDiagnosed,
            (false, false) => Verdict::None,
            // What a real valve does more than a model of second order shows in enough rows, however healthy it is.
            _ if !self.swings && self.near_before => Verdict::None,
            _ => Verdict::Unexplained,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn criteria(before: f64, after: f64, structured_after: bool, least_ratio: f64) -> Criteria {
        Criteria {
            diagnosed: true,
            before,
            after,
            least_taken: 1.0,
            unseen: false,
            swings: false,
            undecided: false,
            added: 1,
            structured_before: true,
            structured_after,
            least_followed: 0.9,
            least_ratio,
            near_before: false,
        }
    }

    #[test]
    fn an_effect_counts_by_what_is_left_without_it_where_that_is_nearly_all() {
        for (of_left, without, expected) in [
            (0.5, 0.1, 0.5),
            (0.3, 0.7, 0.3),
            (0.3, 0.9, 0.9),
            (0.3, 0.8, 0.8),
        ] {
            assert_eq!(counted(of_left, || without), expected);
        }
    }

    #[test]
    fn nothing_is_named_where_the_valve_swings_and_the_model_does_not() {
        let found = criteria(100.0, 1.0, false, 0.9);
        assert_eq!(found.verdict(), Verdict::Found);
        let swings = true;
        assert_eq!(Criteria { swings, ..found }.verdict(), Verdict::Unexplained);
    }

    #[test]
    fn nothing_is_named_where_too_many_causes_do_as_well() {
        for near_before in [false, true] {
            let undecided = Criteria {
                undecided: true,
                near_before,
                ..criteria(100.0, 1.0, false, 0.9)
            };
            assert_eq!(undecided.verdict(), Verdict::Unexplained);
        }
    }

    #[test]
    fn what_lowers_the_error_a_little_where_it_is_near_the_noise_is_neither_named_nor_missed() {
        let helps = criteria(1.1, 1.06, true, 0.98);
        assert_eq!(helps.verdict(), Verdict::Unexplained);
        let near_before = true;
        let near = Criteria {
            near_before,
            ..helps
        };
        assert_eq!(near.verdict(), Verdict::None);
    }

    #[test]
    fn no_part_is_named_of_a_model_that_fails() {
        let part = criteria(1e6, 1e5, true, 300.0);
        for (least_followed, verdict) in [(0.6, Verdict::Partly), (0.4, Verdict::Unexplained)] {
            let criteria = Criteria {
                least_followed,
                ..part
            };
            assert_eq!(criteria.verdict(), verdict);
        }
    }

    #[test]
    fn what_shows_in_held_out_rows_alone_is_named_only_if_nothing_is_left() {
        for (after, verdict) in [(1.0, Verdict::Found), (1.5, Verdict::Unexplained)] {
            let criteria = Criteria {
                unseen: true,
                ..criteria(9.0, after, after > 1.0, after)
            };
            assert_eq!(criteria.verdict(), verdict);
        }
    }

    #[test]
    fn a_pile_of_effects_that_take_a_little_each_is_no_part() {
        for (least_taken, structured_after, least_ratio, verdict) in [
            (0.45, true, 1.3, Verdict::Partly),
            (0.35, true, 1.3, Verdict::Unexplained),
            (0.35, true, 1.1, Verdict::Partly),
            (0.35, false, 1.3, Verdict::Partly),
        ] {
            let criteria = Criteria {
                least_taken,
                ..criteria(9.0, 2.0, structured_after, least_ratio)
            };
            assert_eq!(criteria.verdict(), verdict);
        }
    }

    #[test]
    fn a_pile_of_many_effects_that_stays_far_from_the_noise_is_no_part() {
        for (added, least_ratio, verdict) in [
            (2, 5.7, Verdict::Partly),
            (3, 2.8, Verdict::Partly),
            (3, 5.7, Verdict::Unexplained),
        ] {
            let criteria = Criteria {
                added,
                ..criteria(975.0, 36.0, true, least_ratio)
            };
            assert_eq!(criteria.verdict(), verdict);
        }
    }

    #[test]
    fn what_reaches_the_noise_is_found_and_what_explains_most_is_a_part() {
        for (criteria, explained, verdict) in [
            (criteria(6.0, 1.0, false, 0.97), 1.0, Verdict::Found),
            (criteria(6.0, 2.5, false, 1.1), 0.7, Verdict::Found),
            (criteria(6.0, 1.5, true, 1.1), 0.9, Verdict::Partly),
            (
                criteria(400.0, 40.0, true, 6.0),
                360.0 / 399.0,
                Verdict::Partly,
            ),
            (criteria(6.0, 2.5, false, 1.3), 0.7, Verdict::Partly),
            (criteria(6.0, 2.5, true, 1.3), 0.7, Verdict::Unexplained),
            (criteria(6.0, 8.5, true, 2.9), -0.5, Verdict::Unexplained),
        ] {
            assert!(
                (criteria.explained() - explained).abs() < 1e-12,
                "{criteria:?}"
            );
            assert_eq!(criteria.verdict(), verdict, "{criteria:?}");
            // What was not looked at to the end names what it has found, and says nothing of what it has not.
            let cut_short = Criteria {
                diagnosed: false,
                ..criteria
            };
            let known = match verdict {
                Verdict::Unexplained => Verdict::NotDiagnosed,
                named => named,
            };
            assert_eq!(cut_short.verdict(), known, "{criteria:?}");
        }
        for (structured_before, near_before, verdict) in [
            (false, false, Verdict::None),
            (true, true, Verdict::None),
            (true, false, Verdict::Unexplained),
        ] {
            let nothing = Criteria {
                added: 0,
                structured_before,
                near_before,
                ..criteria(1.0, 1.0, structured_before, 1.0)
            };
            assert_eq!(nothing.verdict(), verdict);
            let cut_short = Criteria {
                diagnosed: false,
                ..nothing
            };
            assert_eq!(cut_short.verdict(), Verdict::NotDiagnosed);
            let swings = Criteria {
                swings: true,
                ..nothing
            };
            let goes_on = match verdict {
                Verdict::None if structured_before => Verdict::Unexplained,
                other => other,
            };
            assert_eq!(swings.verdict(), goes_on);
        }
    }
}
