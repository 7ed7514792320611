//! A job array: many calls for one batch, which share nothing but its folder.

use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;
use std::str::FromStr;

/// The folder of the rows of all tasks, below that of the batch, until they are gathered.
pub(super) const TASKS: &str = "tasks";

/// One task of a job array, `3/40`: it takes every fortieth file, from the third on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Task {
    number: usize,
    of: usize,
}

impl Task {
    /// Whether the file at `index`, from 0 on, is its.
    pub fn takes(&self, index: usize) -> bool {
        index % self.of + 1 == self.number
    }

    /// The file of its rows, below the folder of the batch.
    pub(super) fn journal(&self) -> PathBuf {
        PathBuf::from(TASKS).join(format!("{}-of-{}.rows", self.number, self.of))
    }
}

impl Display for Task {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Task {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| {
            Some(Self {
                number: number.parse().ok()?,
                of: of.parse().ok()?,
            })
        });
        numbers
            .filter(|task| (1..=task.of).contains(&task.number))
            .ok_or_else(|| "give I/N, I from 1 to N, such as 3/40".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_one_tasks() {
        let tasks = ["1/3", "2/3", "3/3"].map(|text| text.parse::<Task>().unwrap());
        for index in 0..10 {
            let takers = tasks.iter().filter(|task| task.takes(index));
            assert_eq!(takers.count(), 1);
        }
        assert_eq!(tasks[1].to_string(), "2/3");
    }

    #[test]
    fn what_is_no_task_is_refused() {
        for text in [
            "0/3", "4/3", "x", "1/0", "1", "1/", "/3", "-1/3", "1/3/5", "1.5/3",
        ] {
            assert!(text.parse::<Task>().is_err(), "{text}");
        }
    }
}
