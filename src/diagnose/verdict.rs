//! What a diagnosis comes to.

use serde::{Deserialize, Serialize};

/// Effects are believed if they explain this share of what the base model leaves above the noise, or everything that can be
/// seen. Something else that merely resembles an effect seldom follows it so closely.
const EXPLAINED: f64 = 0.8;

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Effects explain what the base model could not.
    Found,
    /// Nothing is missing that this data could show.
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
            Self::None => "none",
            Self::Unexplained => "unexplained",
            Self::NotDiagnosed => "not_diagnosed",
        }
    }
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
    /// Whether any effect was added.
    pub(super) added: bool,
    /// Whether the base model's residual has structure.
    pub(super) structured_before: bool,
    /// Whether the residual has structure with the effects.
    pub(super) structured_after: bool,
}

impl Criteria {
    /// Share of the held-out cost above the noise that the effects explain.
    pub(super) fn explained(&self) -> f64 {
        let excess = |cost: f64| (cost - 1.0).max(0.0);
        match excess(self.before) {
            0.0 => 1.0,
            before => 1.0 - excess(self.after) / before,
        }
    }

    /// The verdict.
    pub(super) fn verdict(&self) -> Verdict {
        match (self.added, self.structured_before) {
            (true, _) if !self.structured_after || self.explained() >= EXPLAINED => Verdict::Found,
            _ if !self.diagnosed => Verdict::NotDiagnosed,
            (false, false) => Verdict::None,
            _ => Verdict::Unexplained,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_are_believed_for_what_they_explain_or_leave_no_trace_of() {
        let criteria = |before, after, added, structured_before, structured_after| Criteria {
            diagnosed: true,
            before,
            after,
            added,
            structured_before,
            structured_after,
        };
        for (criteria, explained, verdict) in [
            (criteria(1.0, 1.0, false, false, false), 1.0, Verdict::None),
            (criteria(0.9, 0.9, false, false, false), 1.0, Verdict::None),
            (
                criteria(6.0, 6.0, false, true, true),
                0.0,
                Verdict::Unexplained,
            ),
            (
                criteria(6.0, 2.5, true, true, true),
                0.7,
                Verdict::Unexplained,
            ),
            (criteria(6.0, 2.5, true, true, false), 0.7, Verdict::Found),
            (criteria(6.0, 1.5, true, true, true), 0.9, Verdict::Found),
            (criteria(6.0, 0.5, true, true, true), 1.0, Verdict::Found),
            (
                criteria(6.0, 8.5, true, true, true),
                -0.5,
                Verdict::Unexplained,
            ),
        ] {
            assert!(
                (criteria.explained() - explained).abs() < 1e-12,
                "{criteria:?}"
            );
            assert_eq!(criteria.verdict(), verdict, "{criteria:?}");
            // What was not looked at to the end names what it has found, and says nothing of what it has not.
            let diagnosed = false;
            let cut_short = Criteria {
                diagnosed,
                ..criteria
            }
            .verdict();
            match verdict {
                Verdict::Found => assert_eq!(cut_short, Verdict::Found, "{criteria:?}"),
                _ => assert_eq!(cut_short, Verdict::NotDiagnosed, "{criteria:?}"),
            }
        }
    }
}
