//! What is planted beside what is named.

use super::plan::Group;
use crate::diagnose::Verdict;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// How a diagnosis compares with what is planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Outcome {
    /// Named exactly; where nothing is planted: nothing found.
    Right,
    /// All that is planted is named or in a tie of at most three, nothing else is.
    Tied,
    /// The same, in a larger tie.
    TiedWide,
    /// All that is planted is named, and something that is not.
    RightPlus,
    /// Some of what is planted is named and nothing else, but something is missing.
    Partly,
    /// Something is named that is not planted, while something planted is not named.
    Wrong,
    /// Something is planted and the verdict is none.
    Missed,
    /// Something is planted and the verdict is unexplained: right for what is in no catalogue.
    Unexplained,
    /// Nothing is planted, and an effect is named.
    FalseFound,
    /// Nothing is planted, and the verdict is unexplained.
    FalseUnexplained,
    /// The diagnosis failed.
    Failed,
}

/// The largest tie that says where to look.
const NARROW: usize = 3;

impl Outcome {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Right,
        Self::Tied,
        Self::TiedWide,
        Self::RightPlus,
        Self::Partly,
        Self::Wrong,
        Self::Missed,
        Self::Unexplained,
        Self::FalseFound,
        Self::FalseUnexplained,
        Self::Failed,
    ];

    /// Its name in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Tied => "tied",
            Self::TiedWide => "tied_wide",
            Self::RightPlus => "right_plus",
            Self::Partly => "partly",
            Self::Wrong => "wrong",
            Self::Missed => "missed",
            Self::Unexplained => "unexplained",
            Self::FalseFound => "false_found",
            Self::FalseUnexplained => "false_unexplained",
            Self::Failed => "failed",
        }
    }

    /// Whether it is what one hopes for in this group.
    pub fn good(self, group: Group) -> bool {
        match group {
            Group::Outsiders | Group::LeftOut => self == Self::Unexplained,
            _ => matches!(self, Self::Right | Self::Tied),
        }
    }

    /// Whether a name is given that is not planted.
    pub fn misnames(self) -> bool {
        matches!(self, Self::RightPlus | Self::Wrong | Self::FalseFound)
    }
}

impl Display for Outcome {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Outcome {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::ALL
            .into_iter()
            .find(|one| one.name() == text)
            .ok_or(())
    }
}

/// Judges a diagnosis. `named` has one list for every effect that was added: its name, then those tied with it. `known`
/// are the names of what is planted and in the catalogue, `odd` whether something is planted that is not.
pub fn judge(known: &[String], odd: bool, verdict: Verdict, named: &[Vec<String>]) -> Outcome {
    let empty = known.is_empty() && !odd;
    match verdict {
        Verdict::None if empty => return Outcome::Right,
        Verdict::Unexplained if empty => return Outcome::FalseUnexplained,
        Verdict::Found | Verdict::Partly if empty => return Outcome::FalseFound,
        Verdict::None | Verdict::NotDiagnosed => return Outcome::Missed,
        Verdict::Unexplained => return Outcome::Unexplained,
        Verdict::Found | Verdict::Partly if odd => return Outcome::Wrong,
        Verdict::Found | Verdict::Partly => {}
    }
    let mut missing: Vec<&String> = known.iter().collect();
    let mut unclaimed: Vec<&Vec<String>> = named.iter().collect();
    let mut claim = |names: fn(&[String], &String) -> bool| {
        missing.retain(
            |name| match unclaimed.iter().position(|tie| names(tie, name)) {
                Some(index) => {
                    unclaimed.remove(index);
                    false
                }
                None => true,
            },
        );
    };
    claim(|tie, name| tie[0] == *name);
    claim(|tie, name| tie.contains(name));
    let widest = named.iter().map(Vec::len).max().unwrap_or(0);
    match (missing.is_empty(), unclaimed.is_empty()) {
        (true, true) if widest > NARROW => Outcome::TiedWide,
        (true, true) if widest > 1 => Outcome::Tied,
        (true, true) => Outcome::Right,
        (true, false) => Outcome::RightPlus,
        (false, true) => Outcome::Partly,
        (false, false) => Outcome::Wrong,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_ties_and_silence_are_told_apart() {
        let list = |text: &str| -> Vec<String> {
            text.split('|')
                .filter(|t| !t.is_empty())
                .map(Into::into)
                .collect()
        };
        let many = |text: &str| -> Vec<Vec<String>> {
            text.split('+')
                .filter(|t| !t.is_empty())
                .map(list)
                .collect()
        };
        for (known, named, expected) in [
            ("a", "a", Outcome::Right),
            ("a", "a|b", Outcome::Tied),
            ("a", "b|a|c", Outcome::Tied),
            ("a", "b|a|c|d", Outcome::TiedWide),
            ("a", "a+b", Outcome::RightPlus),
            ("a", "b|a+c", Outcome::RightPlus),
            ("a", "b", Outcome::Wrong),
            ("a|b", "b+a", Outcome::Right),
            ("a|b", "b|a+a|c", Outcome::Tied),
            ("a|b", "a|b", Outcome::Partly),
            ("a|b", "b|c+c|a", Outcome::Tied),
            ("a|b", "a+c", Outcome::Wrong),
            ("a|b", "a+b+c", Outcome::RightPlus),
            ("", "a", Outcome::FalseFound),
        ] {
            let found = judge(&list(known), false, Verdict::Found, &many(named));
            assert_eq!(found, expected, "{known} named {named}");
        }
        let known = list("a");
        assert_eq!(judge(&known, false, Verdict::None, &[]), Outcome::Missed);
        assert_eq!(
            judge(&known, false, Verdict::Unexplained, &[]),
            Outcome::Unexplained
        );
        assert_eq!(judge(&[], false, Verdict::None, &[]), Outcome::Right);
        assert_eq!(
            judge(&[], false, Verdict::Unexplained, &[]),
            Outcome::FalseUnexplained
        );
        assert_eq!(
            judge(&[], true, Verdict::Unexplained, &[]),
            Outcome::Unexplained
        );
        assert_eq!(judge(&[], true, Verdict::Found, &many("a")), Outcome::Wrong);
        assert_eq!(judge(&[], true, Verdict::None, &[]), Outcome::Missed);
    }
}
