//! Which candidates each of many ranks evaluates.

use std::ops::Range;

/// Candidates of one job: its number, and which of them.
pub(super) type Slice = (usize, Range<usize>);

/// What rank `rank` of `ranks` evaluates of jobs with so many candidates: of all of them in a row its equal part, so that what
/// all ranks find, one after another, is in order. Equal and not as fast as each rank is: what a run finds then does not
/// depend on the time anything takes, nor on which of unlike devices comes first.
pub(super) fn of_rank(candidates: &[usize], rank: usize, ranks: usize) -> Vec<Slice> {
    let total: usize = candidates.iter().sum();
    // In 128 bits: a product of two counts.
    let border = |rank: usize| (total as u128 * rank as u128 / ranks as u128) as usize;
    let (low, high) = (border(rank), border(rank + 1));
    let mut slices = Vec::new();
    let mut first = 0;
    for (job, &count) in candidates.iter().enumerate() {
        let part = low.max(first)..high.min(first + count);
        if !part.is_empty() {
            slices.push((job, part.start - first..part.end - first));
        }
        first += count;
    }
    slices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_candidate_is_evaluated_once_and_in_order() {
        for candidates in [vec![], vec![0], vec![1], vec![3, 0, 5, 1], vec![1000, 1, 7]] {
            for ranks in 1..9 {
                let all = (0..ranks).flat_map(|rank| of_rank(&candidates, rank, ranks));
                let found: Vec<(usize, usize)> = all
                    .flat_map(|(job, part)| part.map(move |i| (job, i)))
                    .collect();
                let jobs = candidates.iter().enumerate();
                let expected: Vec<(usize, usize)> = jobs
                    .flat_map(|(job, &count)| (0..count).map(move |i| (job, i)))
                    .collect();
                assert_eq!(found, expected, "{candidates:?} on {ranks}");
            }
        }
    }

    #[test]
    fn no_rank_has_two_candidates_more_than_another() {
        let counts = (0..7).map(|rank| {
            let slices = of_rank(&[100, 3, 50], rank, 7);
            slices.iter().map(|(_, part)| part.len()).sum::<usize>()
        });
        assert!(counts.clone().max().unwrap() - counts.min().unwrap() <= 1);
    }
}
