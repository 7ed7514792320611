//! What a column holds: its range, its odd cells, and the steps in which it was measured.

use crate::record::column::{Column, Odd};
use serde::Serialize;

/// Levels that a column needs before its ends can be called clipped; with fewer it moves in steps anyway.
const LEVELS: usize = 20;

/// Rows in a row that stay at an end, for it to be clipped.
const STAYS: usize = 5;

/// The values of a column, in the file's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Values {
    /// How many cells there are.
    pub rows: usize,
    /// The smallest number, if there is one.
    pub min: Option<f64>,
    /// The largest number.
    pub max: Option<f64>,
    /// Cells without anything.
    pub empty: usize,
    /// Cells with a text.
    pub text: usize,
    /// Cells with NaN or an infinity.
    pub not_finite: usize,
    /// Different numbers.
    pub levels: usize,
    /// The quantisation step: the distance of neighbouring numbers, where all others are multiples of it.
    pub step: Option<f64>,
    /// The share of the numbers that stay at the smallest, and at the largest, where those look cut off.
    pub clipped: [Option<f64>; 2],
}

impl Values {
    pub(super) fn of(column: &Column) -> Self {
        let count = |wanted: Odd| column.odd.iter().filter(|(_, odd)| *odd == wanted).count();
        let numbers: Vec<f64> = column
            .values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .collect();
        let mut levels = numbers.clone();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        Self {
            rows: column.values.len(),
            min: levels.first().copied(),
            max: levels.last().copied(),
            empty: count(Odd::Empty),
            text: count(Odd::Text),
            not_finite: count(Odd::NotFinite),
            step: step(&levels),
            clipped: match levels[..] {
                [min, low, .., high, max] if levels.len() > LEVELS => {
                    [clipped(&numbers, min, low), clipped(&numbers, max, high)]
                }
                _ => [None; 2],
            },
            levels: levels.len(),
        }
    }

    /// Whether there is a number, and no other.
    pub fn is_constant(&self) -> bool {
        self.levels == 1
    }

    /// Whether every cell holds a finite number.
    pub fn is_complete(&self) -> bool {
        self.empty + self.text + self.not_finite == 0
    }
}

/// The step between sorted levels. The most frequent distances are one step; that of a rounded step varies a little.
fn step(levels: &[f64]) -> Option<f64> {
    const FEWEST: usize = 3;
    const ROUNDING: f64 = 0.1;
    const FAR: f64 = 10.0;
    let mut gaps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if gaps.len() < FEWEST {
        return None;
    }
    gaps.sort_by(f64::total_cmp);
    let smallest = gaps[0];
    let single = gaps.partition_point(|&gap| gap < (1.0 + 2.0 * ROUNDING) * smallest);
    let step = gaps[..single].iter().sum::<f64>() / single as f64;
    // Far apart, anything is near a multiple: too much of that shows nothing.
    let near: Vec<f64> = gaps.into_iter().filter(|&gap| gap < FAR * step).collect();
    let off = |gap: &&f64| {
        let steps = **gap / step;
        (steps - steps.round()).abs() > ROUNDING
    };
    let odd = near.iter().filter(off).count();
    (single >= FEWEST && 2 * near.len() > levels.len() && 10 * odd <= near.len()).then_some(step)
}

/// The share of the values that stay at `end`, where some stay long: far longer than at the level `inside` it, where the
/// top of a smooth wave stays at least two fifths as long.
fn clipped(values: &[f64], end: f64, inside: f64) -> Option<f64> {
    const LONGER: usize = 4;
    let at = |level: f64| values.iter().filter(|&&value| value == level).count();
    let longest = values
        .chunk_by(|one, other| one == other)
        .filter(|run| run[0] == end)
        .map(<[f64]>::len)
        .max()?;
    let stays = longest >= STAYS && at(end) > LONGER * at(inside);
    stays.then(|| at(end) as f64 / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::label::Label;

    fn of(values: impl IntoIterator<Item = f64>) -> Values {
        Values::of(&Column::of(Label::parse("x"), values.into_iter().collect()))
    }

    #[test]
    fn steps_are_found_where_there_are_some() {
        let wave = |row: u32| 9.3 * (f64::from(row) * 0.37).sin();
        let quantised = |step: f64| of((0..2000).map(|row| (wave(row) / step).round() * step));
        for step in [0.001, 20.0 / 4096.0, 0.1] {
            let found = quantised(step).step.unwrap();
            assert!((found / step - 1.0).abs() < 1e-6, "{found} for {step}");
        }
        // A step of 4.88 mV that the file rounds to 0.1 mV.
        let rounded = (0..2000).map(|row| {
            let level = (wave(row) / 0.00488281).round() * 0.00488281;
            (level * 1e4).round() / 1e4
        });
        let found = of(rounded).step.unwrap();
        assert!((found / 0.00488281 - 1.0).abs() < 0.01, "{found}");
        assert_eq!(of((0..2000).map(wave)).step, None);
    }

    #[test]
    fn ends_that_stay_are_clipped() {
        let wave = |row: u32| (f64::from(row) * 0.01).sin();
        let values = of((0..2000).map(|row| wave(row).min(0.8)));
        assert_eq!(values.clipped[0], None);
        assert!(values.clipped[1].unwrap() > 0.15, "{values:?}");
        // The top of a coarsely quantised wave stays for a while, too.
        let coarse = of((0..2000).map(|row| (wave(row) / 0.05).round() * 0.05));
        assert_eq!(coarse.clipped, [None; 2], "{coarse:?}");
        // A square wave stays at its ends because it is one.
        let square = of((0..2000).map(|row| wave(row).signum()));
        assert_eq!((square.clipped, square.levels), ([None; 2], 2));
    }
}
