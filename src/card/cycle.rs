//! The slow cycle: what the valve does at rest for every command, and the figures that are read off it.

use super::bench::Bench;

/// Commands from zero to full scale.
const STEPS: usize = 100;
/// Shares of full scale between which a branch is taken as straight.
const STRAIGHT: (f64, f64) = (0.2, 0.8);
/// The output follows the command where no side's slope is below this share of the steepest one's.
const FOLLOWS: f64 = 1e-3;
/// Largest share of full scale at which hysteresis is read.
const READ: f64 = 0.95;
/// How long each command is kept: at least this, s, and so many of the slowest time constants.
const SETTLING: (f64, f64) = (0.2, 12.0);

/// The valve at rest, command after command.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cycle {
    /// From full scale down to minus full scale: command, and flow (L/min) or, without a valve, spool.
    pub falling: Vec<[f64; 2]>,
    /// And up again.
    pub rising: Vec<[f64; 2]>,
}

impl Cycle {
    /// Takes the valve through a cycle.
    pub(super) fn of(bench: &Bench) -> Self {
        let full = bench.structure.full_scale;
        let steps = STEPS as i32;
        let level = |k: i32| full * f64::from(k) / f64::from(steps);
        let up = (0..steps).map(level);
        let down = (-steps + 1..=steps).rev().map(level);
        let again = (-steps..=steps).map(level);
        let commands: Vec<f64> = up.chain(down).chain(again).collect();
        let interval = SETTLING.0.max(SETTLING.1 * bench.slowest()) + 2.0 * bench.delay();
        let outputs = bench.settled(&commands, interval);
        let output = usize::from(bench.structure.valve().is_some());
        let points: Vec<[f64; 2]> = commands
            .iter()
            .zip(&outputs)
            .map(|(&command, settled)| [command, settled[output]])
            .collect();
        let turn = 2 * STEPS + STEPS;
        Self {
            falling: points[STEPS..=turn].to_vec(),
            rising: points[turn..].to_vec(),
        }
    }

    /// The figures of a cycle over ±`full`; none where the output does not follow the command on both sides alike: it then
    /// has no gain and no null.
    pub(super) fn figures(&self, full: f64) -> Option<CycleFigures> {
        let lines: Vec<[f64; 2]> = [&self.falling, &self.rising]
            .into_iter()
            .flat_map(|branch| [1.0, -1.0].map(|side| line(branch, side * full)))
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
        let apart = self
            .falling
            .iter()
            .rev()
            .zip(&self.rising)
            .filter(|(down, _)| down[0].abs() <= READ * full)
            .map(|(down, up)| (down[1] - up[1]).abs());
        let ends = [self.falling[0][1], self.rising[0][1]];
        Some(CycleFigures {
            rated: 0.5 * (ends[0] - ends[1]).abs(),
            gain,
            overlap: percent(0.5 * (plus - minus)),
            asymmetry: 100.0 * (gains[0] - gains[1]) / gains[0].abs().max(gains[1].abs())
                * gain.signum(),
            hysteresis: percent(apart.fold(0.0, f64::max) / gain.abs()),
            null: mean(plus, minus),
        })
    }
}

/// What a cycle shows.
pub(super) struct CycleFigures {
    /// Output at full command, the mean of both ends.
    pub(super) rated: f64,
    /// Output for each unit of command.
    pub(super) gain: f64,
    /// Half the command between where the straight parts of both sides meet zero, % of full scale.
    pub(super) overlap: f64,
    /// Gain of the positive side less that of the negative one, % of the larger.
    pub(super) asymmetry: f64,
    /// Largest difference between the commands of both branches for equal output, % of full scale.
    pub(super) hysteresis: f64,
    /// The command at which the output is zero.
    pub(super) null: f64,
}

/// The straight line through the middle of one side of a branch, as value at zero and slope.
fn line(branch: &[[f64; 2]], end: f64) -> [f64; 2] {
    let share = |point: &&[f64; 2]| {
        let share = point[0] / end;
        // Rounding must not decide about a point at the limit.
        (STRAIGHT.0 - 1e-9..=STRAIGHT.1 + 1e-9).contains(&share)
    };
    let points: Vec<&[f64; 2]> = branch.iter().filter(share).collect();
    let count = points.len() as f64;
    let mean = |i: usize| points.iter().map(|point| point[i]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let products = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>();
    let squares = points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    let slope = products / squares;
    [y - slope * x, slope]
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
        assert!((straight.rated - 30.0).abs() < 1e-9 && (straight.gain + 0.3).abs() < 1e-12);
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
}
