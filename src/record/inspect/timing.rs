//! The times of a record.

use serde::Serialize;

/// An interval that is this many times the usual one is a gap.
const GAP: f64 = 1.5;

/// How the samples lie in time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timing {
    /// From the first sample to the last, in s.
    pub length: f64,
    /// The usual interval: the median, in s.
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
        let interval = *rising.select_nth_unstable_by(middle, f64::total_cmp).1;
        let regular = rising.iter().filter(|&&step| step < GAP * interval);
        let squares = regular.clone().map(|step| (step - interval).powi(2));
        let jitter = (squares.sum::<f64>() / regular.count() as f64).sqrt();
        let gap = |(after, &step): (usize, &f64)| Gap {
            after,
            time: time[after],
            missing: ((step / interval).round() as usize).saturating_sub(1),
        };
        let at = |wanted: fn(f64, f64) -> bool| {
            let steps = steps.iter().enumerate();
            steps.filter(move |(_, step)| wanted(**step, interval))
        };
        Some(Self {
            length: time[time.len() - 1] - time[0],
            interval,
            // Less is but the rounding of the times themselves.
            jitter: match jitter > 1e-6 * interval {
                true => jitter,
                false => 0.0,
            },
            gaps: at(|step, interval| step >= GAP * interval)
                .map(gap)
                .collect(),
            not_rising: at(|step, _| step <= 0.0).map(|(row, _)| row + 1).collect(),
        })
    }

    /// Samples a second.
    pub fn rate(&self) -> f64 {
        self.interval.recip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_jitter_and_repeats_are_told_apart() {
        let mut time: Vec<f64> = (0..100).map(|row| f64::from(row) * 1e-3).collect();
        time.drain(40..43);
        time[70] = time[69];
        let timing = Timing::of(&time).unwrap();
        assert!((timing.interval - 1e-3).abs() < 1e-15);
        assert_eq!(timing.jitter, 0.0);
        assert_eq!(timing.not_rising, [70]);
        let gaps: Vec<(usize, usize)> = timing.gaps.iter().map(|g| (g.after, g.missing)).collect();
        assert_eq!(gaps, [(39, 3), (70, 1)]);

        let uneven: Vec<f64> = (0..1000_u32)
            .map(|row| f64::from(row) + 0.1 * f64::from(row % 2))
            .collect();
        let timing = Timing::of(&uneven).unwrap();
        assert!((timing.jitter - 0.14).abs() < 0.02, "{timing:?}");
        assert!(timing.gaps.is_empty());
        assert_eq!(Timing::of(&[1.0, 1.0]), None);
    }
}
