//! Small populations on the CPU, large ones on a GPU.

use crate::Result;
use crate::evaluate::evaluator::{Evaluator, Job};
use crate::evaluate::population::Cost;

/// Integration steps of all candidates of a call from which on a GPU takes it. An H100 needs a millisecond for a call and ten
/// for every new shader; 16 cores do as many steps in 30 ms, two in 200.
const LARGE: f64 = 1e8;

/// Opens an evaluator when it is needed.
type Open = Box<dyn FnOnce() -> Result<Box<dyn Evaluator>>>;

/// One evaluator for small calls, and another, opened when the first large one comes.
pub(super) struct BySize {
    small: Box<dyn Evaluator>,
    large: Option<Box<dyn Evaluator>>,
    /// Opens the large one; `None` once that was tried.
    open: Option<Open>,
    /// What the large one is called.
    name: String,
}

impl BySize {
    pub(super) fn new(small: Box<dyn Evaluator>, name: String, open: Open) -> Self {
        Self {
            small,
            large: None,
            open: Some(open),
            name,
        }
    }
}

impl Evaluator for BySize {
    /// The same before and after the first large call: a run that goes on from a checkpoint may have none.
    fn describe(&self) -> String {
        let small = self.small.describe();
        format!("{small}, from {LARGE:e} steps at once on {}", self.name)
    }

    fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
        let steps = |job: &Job<'_>| job.population.len() as f64 * job.problem.steps() as f64;
        if jobs.iter().map(steps).sum::<f64>() < LARGE {
            return self.small.costs_of(jobs);
        }
        if let Some(open) = self.open.take() {
            self.large = Some(open()?);
        }
        self.large
            .as_mut()
            .unwrap_or(&mut self.small)
            .costs_of(jobs)
    }

    fn take_warnings(&mut self) -> Vec<String> {
        let mut warnings = self.small.take_warnings();
        if let Some(large) = &mut self.large {
            warnings.extend(large.take_warnings());
        }
        warnings
    }

    fn refusals(&self) -> u32 {
        let of_large = self.large.as_ref().map_or(0, |large| large.refusals());
        self.small.refusals() + of_large
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// Counts its calls.
    struct Counting(Arc<AtomicU32>);

    impl Evaluator for Counting {
        fn describe(&self) -> String {
            "a counter".into()
        }

        fn costs_of(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Vec<Cost>>> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let costs = |job: &Job<'_>| vec![Cost::DIVERGED; job.population.len()];
            Ok(jobs.iter().map(costs).collect())
        }

        fn refusals(&self) -> u32 {
            1
        }
    }

    #[test]
    fn a_large_call_goes_to_the_other_which_is_opened_for_it() {
        let [small, large, opened] = [0; 3].map(|_| Arc::new(AtomicU32::new(0)));
        let open = {
            let (large, opened) = (large.clone(), opened.clone());
            move || {
                opened.fetch_add(1, Ordering::Relaxed);
                Ok(Box::new(Counting(large)) as Box<dyn Evaluator>)
            }
        };
        let few = Box::new(Counting(small.clone()));
        let mut both = BySize::new(few, "the other".into(), Box::new(open));
        let problem = workload::actuator(1001);
        let before = both.describe();
        assert_eq!(before, "a counter, from 1e8 steps at once on the other");
        let counts = || [&small, &large, &opened].map(|count| count.load(Ordering::Relaxed));
        for (size, expected) in [
            (99_999, [1, 0, 0]),
            (100_000, [1, 1, 1]),
            (100_000, [1, 2, 1]),
            (10, [2, 2, 1]),
        ] {
            let population = workload::population(&problem, size);
            both.costs(&problem, &population).unwrap();
            assert_eq!(counts(), expected);
            // Those of both, once there are both.
            assert_eq!(both.refusals(), 1 + expected[2]);
        }
        assert_eq!((both.describe(), both.refusals()), (before, 2));
    }
}
