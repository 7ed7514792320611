//! The figures of a slow cycle by the construction of ISO 10770-1, the same for a simulated and for a measured one: straight
//! lines through both sides, their intercepts, and the width of the loop.

use super::cycle::Cycle;

/// Shares of full scale between which a branch is taken as straight.
pub(super) const STRAIGHT: (f64, f64) = (0.2, 0.8);
/// The output follows the command where no side's slope is below this share of the steepest one's.
const FOLLOWS: f64 = 0.02;
/// Largest share of the outputs at which hysteresis is read: at the ends a loop closes.
const READ: f64 = 0.95;
/// Smallest share: in the dead zone of an overlap there is no command that belongs to an output.
const DEAD: f64 = 0.02;
/// At how many outputs of each sign the width of the loop is read, and over how many of them to both sides it is averaged:
/// the largest of many noisy widths would be too large.
const LEVELS: (usize, usize) = (48, 3);
/// Where a cycle reaches this share of full scale, the output at full command can be read.
const WHOLE: f64 = 0.98;

impl Cycle {
    /// The figures of a cycle, both branches at the same commands, against a rated signal of `full`; none where the output
    /// does not follow the command on both sides alike: it then has no gain and no null.
    pub(super) fn figures(&self, full: f64) -> Option<CycleFigures> {
        let lines: Vec<[f64; 2]> = [&self.falling, &self.rising]
            .into_iter()
            .flat_map(|branch| [1.0, -1.0].map(|side| side_line(branch, side * full)))
            .collect();
        let [down_plus, down_minus, up_plus, up_minus] = lines[..] else {
            return None;
        };
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let gains = [
            mean(down_plus[1], up_plus[1]),
            mean(down_minus[1], up_minus[1]),
        ];
        let gain = mean(gains[0], gains[1]);
        let slopes = lines.iter().map(|line| line[1] * gain.signum());
        let (least, most) = slopes.fold((f64::INFINITY, 0.0), |(least, most), slope| {
            (slope.min(least), slope.max(most))
        });
        if !(gain.is_finite() && least > FOLLOWS * most) {
            return None;
        }
        let cross = |line: [f64; 2]| -line[0] / line[1];
        let plus = mean(cross(down_plus), cross(up_plus));
        let minus = mean(cross(down_minus), cross(up_minus));
        let percent = |value: f64| 100.0 * value / full;
        let rated = self.rated(full);
        Some(CycleFigures {
            rated,
            gain,
            lap: percent(plus - minus),
            asymmetry: 100.0 * (gains[0] - gains[1]) / gains[0].abs().max(gains[1].abs())
                * gain.signum(),
            linearity: rated.map(|rated| 100.0 * self.bend() / rated),
            hysteresis: percent(self.width(gain.signum())),
            null: percent(mean(plus, minus)),
        })
    }

    /// The output at full command, the mean of both ends as they are approached.
    fn rated(&self, full: f64) -> Option<f64> {
        let [top, bottom] = [&self.rising, &self.falling].map(|branch| branch.last().copied());
        let ([above, most], [below, least]) = (top?, bottom?);
        let whole = above >= WHOLE * full && below <= -WHOLE * full;
        whole.then(|| 0.5 * (most - least).abs())
    }

    /// The largest deviation of the curve midway between the branches from the straight line that fits it best.
    fn bend(&self) -> f64 {
        let pairs = self.falling.iter().rev().zip(&self.rising);
        let middle: Vec<[f64; 2]> = pairs
            .map(|(down, up)| [0.5 * (down[0] + up[0]), 0.5 * (down[1] + up[1])])
            .collect();
        let [start, slope] = line(middle.iter());
        let deviation = |point: &[f64; 2]| (point[1] - start - slope * point[0]).abs();
        middle.iter().map(deviation).fold(0.0, f64::max)
    }

    /// The largest difference between the commands of both branches for equal output; `sign` is that of the gain.
    fn width(&self, sign: f64) -> f64 {
        let outputs = |branch: &mut dyn Iterator<Item = &[f64; 2]>| -> Vec<[f64; 2]> {
            monotone(branch.map(|point| [point[0], sign * point[1]]).collect())
        };
        let up = outputs(&mut self.rising.iter());
        let down = outputs(&mut self.falling.iter().rev());
        let (Some(top), Some(bottom)) = (up.last(), up.first()) else {
            return 0.0;
        };
        let side = |end: f64| -> f64 {
            let share = |k: usize| DEAD + (READ - DEAD) * k as f64 / (LEVELS.0 - 1) as f64;
            let widths: Vec<f64> = (0..LEVELS.0)
                .map(|k| end * share(k))
                .map(|level| at(&up, level) - at(&down, level))
                .collect();
            let means = widths.windows(2 * LEVELS.1 + 1);
            means
                .map(|near| near.iter().sum::<f64>().abs() / near.len() as f64)
                .fold(0.0, f64::max)
        };
        side(top[1]).max(side(bottom[1]))
    }
}

/// What a cycle shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CycleFigures {
    /// Output at full command, the mean of both ends; none where the cycle does not go so far.
    pub(super) rated: Option<f64>,
    /// Output for each unit of command.
    pub(super) gain: f64,
    /// The command between where the straight parts of both sides meet zero, % of full scale.
    pub(super) lap: f64,
    /// Gain of the positive side less that of the negative one, % of the larger.
    pub(super) asymmetry: f64,
    /// Largest deviation of the mid curve from its best straight line, % of the rated output.
    pub(super) linearity: Option<f64>,
    /// Largest difference between the commands of both branches for equal output, % of full scale.
    pub(super) hysteresis: f64,
    /// The command at which the output is zero, % of full scale.
    pub(super) null: f64,
}

/// The straight line through the middle of one side of a branch, as value at zero and slope.
fn side_line(branch: &[[f64; 2]], end: f64) -> [f64; 2] {
    let share = |point: &&[f64; 2]| {
        let share = point[0] / end;
        // Rounding must not decide about a point at the limit.
        (STRAIGHT.0 - 1e-9..=STRAIGHT.1 + 1e-9).contains(&share)
    };
    line(branch.iter().filter(share))
}

/// The straight line that fits `points` best in the sense of least squares, as value at zero and slope.
pub(super) fn line<'p>(points: impl Iterator<Item = &'p [f64; 2]> + Clone) -> [f64; 2] {
    let count = points.clone().count() as f64;
    let mean = |i: usize| points.clone().map(|point| point[i]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let products = points.clone().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>();
    let squares = points.map(|p| (p[0] - x).powi(2)).sum::<f64>();
    let slope = products / squares;
    [y - slope * x, slope]
}

/// The curve that never falls and is closest to `points`: where they fall, noise has made them, and their mean stands.
fn monotone(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for point in &points {
        let (mut value, mut count) = (point[1], 1);
        while let Some(&(before, own)) = pools.last().filter(|last| last.0 > value) {
            let all = own + count;
            value = (before * own as f64 + value * count as f64) / all as f64;
            count = all;
            pools.pop();
        }
        pools.push((value, count));
    }
    let values = pools
        .into_iter()
        .flat_map(|(value, count)| std::iter::repeat_n(value, count));
    points
        .iter()
        .zip(values)
        .map(|(p, value)| [p[0], value])
        .collect()
}

/// The command at which a rising curve has this output; that of its end beyond it.
fn at(curve: &[[f64; 2]], output: f64) -> f64 {
    let after = curve.partition_point(|point| point[1] < output);
    match (after.checked_sub(1).map(|i| curve[i]), curve.get(after)) {
        (Some([x, y]), Some([next, above])) => x + (next - x) * (output - y) / (above - y),
        (Some(end), None) => end[0],
        (None, end) => end.map_or(f64::NAN, |end| end[0]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cycle of an output that has no hysteresis.
    fn cycle(output: impl Fn(f64) -> f64) -> Cycle {
        let rising: Vec<[f64; 2]> = (-100..=100)
            .map(|k| [f64::from(k), output(f64::from(k))])
            .collect();
        Cycle {
            falling: rising.iter().rev().copied().collect(),
            rising,
        }
    }

    #[test]
    fn an_output_that_does_not_follow_the_command_has_no_figures() {
        let straight = cycle(|command| -0.3 * command).figures(100.0).unwrap();
        assert!(
            (straight.rated.unwrap() - 30.0).abs() < 1e-9 && (straight.gain + 0.3).abs() < 1e-12
        );
        assert_eq!(
            (straight.hysteresis, straight.null.abs() < 1e-9),
            (0.0, true)
        );
        // The amount of the flow, one side, nothing, noise that is far below what follows.
        let others: [fn(f64) -> f64; 4] = [
            f64::abs,
            |command| command.max(0.0),
            |_| 0.0,
            |command| {
                if command > 0.0 {
                    command
                } else {
                    1e-6 * command
                }
            },
        ];
        for output in others {
            assert!(cycle(output).figures(100.0).is_none());
        }
    }

    #[test]
    fn a_curve_drawn_by_formulas_has_the_figures_of_its_formulas() {
        // Half-width of the loop 2, dead zone from -3 to 5, gains 0.3 and 0.2.
        let curve = |command: f64| {
            let above = 0.3 * (command - 5.0).max(0.0);
            above + 0.2 * (command + 3.0).min(0.0)
        };
        let branch = |shift: f64| -> Vec<[f64; 2]> {
            let command = (-100..=100).map(f64::from);
            command.map(|u| [u, curve(u - shift)]).collect()
        };
        let (rising, mut falling) = (branch(2.0), branch(-2.0));
        falling.reverse();
        let found = Cycle { rising, falling }.figures(100.0).unwrap();
        assert!((found.hysteresis - 4.0).abs() < 1e-6, "{found:?}");
        assert!((found.lap - 8.0).abs() < 1e-6, "{found:?}");
        assert!((found.null - 1.0).abs() < 1e-6, "{found:?}");
        assert!((found.asymmetry - 100.0 / 3.0).abs() < 1e-6, "{found:?}");
        assert!((found.gain - 0.25).abs() < 1e-9, "{found:?}");
        // Approached from below, the loop has taken 2 of the 100 away at both ends.
        let rated = 0.5 * (0.3 * 93.0 + 0.2 * 95.0);
        assert!((found.rated.unwrap() - rated).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_parabola_is_as_far_from_its_line_as_the_formula_says() {
        // x + x|x|/100 over ±100 around its best line, which goes through zero with slope 1 + 3/4: x = 100 is 25 away.
        let found = cycle(|x| x + x * x.abs() / 100.0).figures(100.0).unwrap();
        assert!((found.linearity.unwrap() - 12.5).abs() < 0.3, "{found:?}");
    }

    #[test]
    fn a_cycle_that_ends_before_full_scale_has_no_rated_output() {
        let mut short = cycle(|command| 0.3 * command);
        for branch in [&mut short.falling, &mut short.rising] {
            branch.retain(|point| point[0].abs() <= 85.0);
        }
        let found = short.figures(100.0).unwrap();
        assert_eq!((found.rated, found.linearity), (None, None));
        assert!((found.gain - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_curve_that_noise_bends_down_is_pooled() {
        let points = [1.0, 3.0, 2.0, 4.0, 3.0, 2.0, 5.0];
        let points: Vec<[f64; 2]> = (0..)
            .map(f64::from)
            .zip(points)
            .map(|(x, y)| [x, y])
            .collect();
        let pooled: Vec<f64> = monotone(points).iter().map(|point| point[1]).collect();
        assert_eq!(pooled, [1.0, 2.5, 2.5, 3.0, 3.0, 3.0, 5.0]);
    }
}
