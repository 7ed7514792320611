//! The times of a record.

use serde::Serialize;

/// An interval that is this many times the usual one is a gap, if the rows around it are later by it.
const GAP: f64 = 1.5;
/// So many rows before and after it show that: one whose own time is late is early for the next one.
const AROUND: usize = 4;

/// How the samples lie in time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    /// From the first sample to the last, in s.
    pub length: f64,
    /// The usual interval, in s: the mean, were nothing missing, as times that are rounded may have no usual one; the median where
    /// time does not rise throughout.
    pub interval: f64,
    /// Root mean square of how far intervals are from the usual one, gaps aside, in s.
    pub jitter: f64,
    /// Intervals in which samples seem to be missing.
    pub gaps: Vec<Gap>,
    /// The samples at which time does not rise.
    pub not_rising: Vec<usize>,
}

/// Missing samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gap {
    /// The sample before it, from 0.
    pub after: usize,
    /// When it begins, in s.
    pub time: f64,
    /// How many samples would fit into it.
    pub missing: usize,
}

impl Timing {
    /// Of times in s; `None` for fewer than two.
    pub(super) fn of(time: &[f64]) -> Option<Self> {
        let steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut rising: Vec<f64> = steps.iter().copied().filter(|&step| step > 0.0).collect();
        if rising.is_empty() {
            return None;
        }
        let middle = rising.len() / 2;
        let median = *rising.select_nth_unstable_by(middle, f64::total_cmp).1;
        let gap = |(after, _): (usize, &f64)| Gap {
            after,
            time: time[after],
            missing: missing(time, after, median),
        };
        let long = steps.iter().enumerate();
        let long = long.filter(|(_, step)| **step >= GAP * median);
        let gaps: Vec<Gap> = long.map(gap).filter(|gap| gap.missing > 0).collect();
        let length = time[time.len() - 1] - time[0];
        let missing: usize = gaps.iter().map(|gap| gap.missing).sum();
        let not_rising = steps.iter().enumerate().filter(|(_, step)| **step <= 0.0);
        let not_rising: Vec<usize> = not_rising.map(|(before, _)| before + 1).collect();
        let interval = match not_rising.is_empty() {
            true => length / (steps.len() + missing) as f64,
            false => median,
        };
        rising.retain(|&step| step < GAP * interval);
        let squares = rising.iter().map(|step| (step - interval).powi(2));
        let jitter = (squares.sum::<f64>() / rising.len() as f64).sqrt();
        Some(Self {
            length,
            interval,
            // Less is but the rounding of the times themselves.
            jitter: match jitter > 1e-6 * interval {
                true => jitter,
                false => 0.0,
            },
            gaps,
            not_rising,
        })
    }

    /// Samples a second.
    pub fn rate(&self) -> f64 {
        self.interval.recip()
    }
}

/// How many samples are missing behind the sample `after`: as many as would fit between it and the next, but no more than those
/// around it are apart by.
fn missing(time: &[f64], after: usize, interval: f64) -> usize {
    let between = |rows: usize| {
        let (first, last) = (after.checked_sub(rows)?, after + 1 + rows);
        let apart = (time.get(last)? - time[first]) / interval;
        Some(apart - (1 + 2 * rows) as f64)
    };
    let around: Vec<f64> = (1..=AROUND).map_while(between).collect();
    let own = between(0).unwrap_or_default();
    let later = match around.is_empty() {
        true => own,
        false => around.iter().sum::<f64>() / around.len() as f64,
    };
    own.min(later).round().max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn gaps_jitter_and_repeats_are_told_apart() {
        let mut time: Vec<f64> = (0..100).map(|row| f64::from(row) * 1e-3).collect();
        time.drain(40..43);
        time[70] = time[69];
        let timing = Timing::of(&time).unwrap();
        assert!((timing.interval - 1e-3).abs() < 1e-15);
        assert_eq!(timing.jitter, 0.0);
        assert_eq!(timing.not_rising, [70]);
        let gaps = |timing: &Timing| -> Vec<(usize, usize)> {
            timing.gaps.iter().map(|g| (g.after, g.missing)).collect()
        };
        // The sample whose time is that of the one before it was late by one interval: none is missing.
        assert_eq!(gaps(&timing), [(39, 3)]);

        let uneven: Vec<f64> = (0..1000_u32)
            .map(|row| f64::from(row) + 0.1 * f64::from(row % 2))
            .collect();
        let timing = Timing::of(&uneven).unwrap();
        assert!((timing.jitter - 0.1).abs() < 1e-3, "{timing:?}");
        assert!(timing.gaps.is_empty());
        assert_eq!(Timing::of(&[1.0, 1.0]), None);

        // Times that vary by more than half an interval, of which one is missing.
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut time = |row: u32| f64::from(row) + 0.6 * random.random::<f64>();
        let mut varying: Vec<f64> = (0..1000).map(&mut time).collect();
        let longest = varying.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(longest.fold(0.0, f64::max) > GAP);
        assert_eq!(gaps(&Timing::of(&varying).unwrap()), []);
        varying.remove(500);
        assert_eq!(gaps(&Timing::of(&varying).unwrap()), [(499, 1)]);
        assert_eq!(gaps(&Timing::of(&[0.0, 1.0, 2.0, 5.0]).unwrap()), [(2, 2)]);

        // 1600 Hz in steps of 0.01 ms.
        let rounded = |row: u32| (f64::from(row) * 62.5).round() / 1e5;
        let rounded: Vec<f64> = (0..1001).map(rounded).collect();
        let timing = Timing::of(&rounded).unwrap();
        assert!((timing.rate() - 1600.0).abs() < 1e-6, "{timing:?}");
    }
}
