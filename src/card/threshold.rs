//! The threshold test of ISO 10770-1: the command turns back slowly, and the threshold is how far it goes before the output
//! follows. The same construction for a simulated and for a measured reversal.

use super::bench::Bench;

/// Where the command turns on the bench, a share of full scale: the end of the part that is taken as straight.
const TURN: f64 = 0.8;
/// Steps up to near there, the last ones as small as those back, so that what sticks has come to rest on one side, and back.
const STEPS: (usize, usize, usize) = (40, 30, 120);
/// How far the command goes back, % of full scale: so many widths of the slow cycle's loop, at least the second, at most the
/// third.
const BACK: (f64, f64, f64) = (3.0, 5.0, 60.0);
/// A straight line that leaves less than so many times what a bent one does is as good for a curve without noise.
const BENT: f64 = 20.0;
/// Places at which a reversal is tried to bend, in each of two rounds, and the last of them as a share of the reversal.
const PLACES: (usize, f64) = (80, 0.8);

/// A reversal: nothing follows up to `threshold`, then the output goes along a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bend {
    /// In the unit of the command.
    pub(super) threshold: f64,
    /// Output for each unit of command behind it.
    pub(super) slope: f64,
    /// What is left of the output, summed squares.
    pub(super) left: f64,
    /// The same without a threshold.
    pub(super) straight: f64,
}

impl Bend {
    /// The bend that leaves least of a reversal: how far the command has gone back at each row, and the output; none where
    /// that has less than four rows or does not move.
    pub(super) fn of(reversal: &[[f64; 2]]) -> Option<Self> {
        let reach = reversal.iter().map(|row| row[0]).fold(0.0, f64::max);
        let (straight_slope, straight) = left(reversal, 0.0)?;
        let mut best = (0.0, straight_slope, straight);
        let mut range = (0.0, PLACES.1 * reach);
        for _ in 0..2 {
            let step = (range.1 - range.0) / PLACES.0 as f64;
            for k in 0..=PLACES.0 {
                let place = range.0 + step * k as f64;
                if let Some((slope, own)) = left(reversal, place)
                    && own < best.2
                {
                    best = (place, slope, own);
                }
            }
            range = ((best.0 - step).max(0.0), best.0 + step);
        }
        let (threshold, slope, left) = best;
        Some(Self {
            threshold,
            slope,
            left,
            straight,
        })
    }
}

/// Slope and summed squares of what is left of a reversal that bends at `place`.
fn left(reversal: &[[f64; 2]], place: f64) -> Option<(f64, f64)> {
    let count = reversal.len() as f64;
    let rows = || {
        reversal
            .iter()
            .map(|row| [(row[0] - place).max(0.0), row[1]])
    };
    let mean = |i: usize| rows().map(|row| row[i]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let squares = rows().map(|row| (row[0] - x).powi(2)).sum::<f64>();
    let products = rows().map(|row| (row[0] - x) * (row[1] - y)).sum::<f64>();
    let slope = products / squares;
    let off = rows().map(|row| (row[1] - y - slope * (row[0] - x)).powi(2));
    let known = reversal.len() > 3 && squares > 0.0;
    known.then(|| (slope, off.sum()))
}

/// The threshold of a valve on the bench, % of full scale, whose slow cycle is so wide, %.
pub(super) fn threshold(bench: &Bench, hysteresis: f64) -> Option<f64> {
    let full = bench.structure.full_scale;
    let back = 0.01 * (BACK.0 * hysteresis).clamp(BACK.1, BACK.2);
    let step = back / STEPS.2 as f64;
    let near = TURN - step * STEPS.1 as f64;
    let far = (0..STEPS.0).map(|k| near * k as f64 / STEPS.0 as f64);
    let up = (0..STEPS.1).map(|k| near + step * k as f64);
    let down = (0..=STEPS.2).map(|k| TURN - step * k as f64);
    let commands = far.chain(up).chain(down);
    let commands: Vec<f64> = commands.map(|share| full * share).collect();
    let outputs = bench.settled(&commands, bench.rest());
    let output = usize::from(bench.structure.valve().is_some());
    let rows = commands.iter().zip(&outputs).skip(STEPS.0 + STEPS.1);
    let reversal: Vec<[f64; 2]> = rows
        .map(|(command, row)| [TURN * full - command, row[output]])
        .collect();
    let bend = Bend::of(&reversal)?;
    let follows = bend.slope.is_finite() && bend.slope != 0.0;
    let bends = BENT * bend.left < bend.straight;
    follows.then_some(if bends {
        100.0 * bend.threshold / full
    } else {
        0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reversal_bends_where_its_formula_does() {
        let of = |output: fn(f64) -> f64| {
            let rows = (0..=120).map(|k| 0.05 * f64::from(k));
            Bend::of(&rows.map(|way| [way, output(way)]).collect::<Vec<_>>()).unwrap()
        };
        let play = of(|way| 40.0 - 3.0 * (way - 0.73).max(0.0));
        assert!((play.threshold - 0.73).abs() < 2e-3, "{play:?}");
        assert!((play.slope + 3.0).abs() < 1e-2, "{play:?}");
        assert!(BENT * play.left < play.straight);
        let straight = of(|way| 40.0 - 3.0 * way);
        assert!(straight.threshold == 0.0 || straight.straight < 1e-20);
        // A curve has no corner.
        let curved = of(|way| 40.0 - 3.0 * way - 0.1 * way * way);
        assert!(BENT * curved.left > curved.straight, "{curved:?}");
        assert_eq!(Bend::of(&[[0.0, 1.0], [1.0, 2.0]]), None);
    }
}
