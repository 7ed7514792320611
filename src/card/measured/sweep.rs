//! The slow cycle as it was measured: the branches of a record whose command goes slowly from one side to the other, each as a
//! smooth curve over the same commands.

use super::reading::{Spread, median};
use crate::card::construction::{CycleFigures, line};
use crate::card::cycle::Cycle;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Share of full scale that a branch has to pass on both sides: the end of what is taken as straight, and a little more.
const REACH: f64 = 0.82;
/// Share of full scale by which a command has to go back before it has turned.
const TURN: f64 = 0.1;
/// A branch is slow that takes at least so long, s, between 80 % of both sides: the dynamics of a servo valve are then below a
/// hundredth of full scale.
const SLOW: f64 = 5.0;
/// A sweep belongs to the slowest ones if it takes at least this share of the time of the slowest.
const ALIKE: f64 = 0.67;
/// Cells of full scale on each side, and how many of them to both sides a smooth curve looks at.
const CELLS: (usize, f64) = (100, 2.5);
/// Fewest cells on which a smooth curve stands, at the ends not least.
const LEAST: usize = 5;
/// Largest part of full scale that a branch may leave without a row, in cells.
const GAP: usize = 6;
/// Draws from which the scatter of a single cycle becomes that of its figures.
const DRAWS: u64 = 200;
/// Where full scale is reached up to this share, the curve is drawn to its end.
const WHOLE: f64 = 0.98;

/// The slow cycles of a record, or of several.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sweep {
    /// Each cycle, its falling and its rising branch.
    cycles: Vec<(Branch, Branch)>,
    /// The commands at which a curve is drawn, rising.
    commands: Vec<f64>,
    /// How long a cycle took, s: the mean.
    pub(super) period: f64,
    full: f64,
    /// The figures, and how sure each is; none where the output does not follow the command.
    pub(super) figures: Option<(CycleFigures, Spread)>,
}

/// A passage of the command from one side to the other.
#[derive(Debug, Clone, PartialEq)]
struct Branch {
    rises: bool,
    /// Twice the time from one end to the other, s.
    period: f64,
    /// Mean command and output of each cell that has rows, the command rising.
    cells: Vec<[f64; 2]>,
}

impl Sweep {
    /// The slow cycles of these rows of time (s), command and output, of as many records as there are; why there is none
    /// otherwise.
    pub(super) fn of(records: &[[&[f64]; 3]], full: f64) -> Result<Self, String> {
        let mut all: Vec<Branch> = Vec::new();
        let mut fast = false;
        for record in records {
            for (from, to) in passages(record[1], full) {
                let rows = record.map(|column| &column[from..=to]);
                match Branch::of(rows, full) {
                    Some(branch) => all.push(branch),
                    None => fast = true,
                }
            }
        }
        let slowest = all.iter().map(|branch| branch.period).fold(0.0, f64::max);
        all.retain(|branch| branch.period >= ALIKE * slowest);
        let (up, down): (Vec<Branch>, Vec<Branch>) = all.iter().cloned().partition(|one| one.rises);
        match (up.len().min(down.len()), all.len(), fast) {
            (0, 0, true) => {
                return Err(
                    "the command goes through full scale too fast for a slow cycle, or in steps"
                        .into(),
                );
            }
            (0, 0, false) => {
                return Err(
                    "the command goes through no cycle of both sides up to 80 % of full scale"
                        .into(),
                );
            }
            (0, ..) => return Err("the command goes slowly in one direction only".into()),
            _ => {}
        }
        let reach = all.iter().map(|one| one.reach(full)).fold(full, f64::min);
        let reach = if reach >= WHOLE * full { full } else { reach };
        let steps = (CELLS.0 as f64 * reach / full + 1e-9).floor() as i32;
        let mut sweep = Self {
            commands: (-steps..=steps)
                .map(|k| full * f64::from(k) / CELLS.0 as f64)
                .collect(),
            period: all.iter().map(|one| one.period).sum::<f64>() / all.len() as f64,
            full,
            cycles: down.into_iter().zip(up).collect(),
            figures: None,
        };
        sweep.figures = sweep.read();
        Ok(sweep)
    }

    /// How many cycles there are.
    pub(super) fn count(&self) -> usize {
        self.cycles.len()
    }

    /// Both branches of a cycle as smooth curves over the same commands.
    fn drawn(&self, (down, up): &(Branch, Branch)) -> Cycle {
        let [mut falling, rising] = [down, up].map(|one| one.curve(&self.commands, self.full));
        falling.reverse();
        Cycle { falling, rising }
    }

    /// All cycles in one: their median where there are several.
    pub(super) fn pooled(&self) -> Cycle {
        pooled(self.cycles.iter().map(|cycle| self.drawn(cycle)).collect())
    }

    /// The figures, and what else they could have been. Of those that are the largest of many values what noise has added is
    /// taken away.
    fn read(&self) -> Option<(CycleFigures, Spread)> {
        let own = self.pooled().figures(self.full)?;
        let figures = |cycle: Cycle| cycle.figures(self.full);
        let draws = (0..DRAWS).filter_map(|seed| figures(self.disturbed(seed)));
        let cycles = self
            .cycles
            .iter()
            .filter_map(|one| figures(self.drawn(one)));
        let spread = Spread {
            draws: draws.collect(),
            cycles: cycles.collect(),
        };
        let less = |value: f64, figure: fn(&CycleFigures) -> Option<f64>| {
            value - spread.excess(value, figure)
        };
        let own = CycleFigures {
            hysteresis: less(own.hysteresis, |one| Some(one.hysteresis)),
            linearity: own.linearity.map(|value| less(value, |one| one.linearity)),
            ..own
        };
        Some((own, spread))
    }

    /// The pooled cycle with another draw of its scatter.
    fn disturbed(&self, seed: u64) -> Cycle {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let disturbed = self.cycles.iter().map(|(down, up)| {
            self.drawn(&(down.disturbed(&mut random), up.disturbed(&mut random)))
        });
        pooled(disturbed.collect())
    }
}

impl Branch {
    /// The branch of rows from one turn of the command to the next; none where it is no slow one, or has gaps.
    fn of([time, command, output]: [&[f64]; 3], full: f64) -> Option<Self> {
        let last = time.len() - 1;
        let rises = command[last] > command[0];
        let sign = if rises { 1.0 } else { -1.0 };
        let reach = 0.8 * full;
        let leaves = command.iter().rposition(|u| sign * u <= -reach)?;
        let arrives = command.iter().position(|u| sign * u >= reach)?;
        if time[arrives] - time[leaves.min(arrives)] < SLOW {
            return None;
        }
        let mut sums = vec![(0.0, [0.0; 2]); 2 * CELLS.0 + 1];
        for (&u, &y) in command.iter().zip(output) {
            let cell = (CELLS.0 as f64 * (u / full + 1.0)).round();
            if (0.0..sums.len() as f64).contains(&cell) {
                let (count, [us, ys]) = &mut sums[cell as usize];
                (*count, *us, *ys) = (*count + 1.0, *us + u, *ys + y);
            }
        }
        let filled: Vec<usize> = (0..sums.len()).filter(|&i| sums[i].0 > 0.0).collect();
        if filled.windows(2).any(|pair| pair[1] - pair[0] > GAP) {
            return None;
        }
        let mean = |&i: &usize| sums[i].1.map(|sum| sum / sums[i].0);
        Some(Self {
            rises,
            period: 2.0 * (time[last] - time[0]),
            cells: filled.iter().map(mean).collect(),
        })
    }

    /// How far the branch goes on both sides.
    fn reach(&self, full: f64) -> f64 {
        let ends = [self.cells[0][0], self.cells[self.cells.len() - 1][0]];
        // The last cell is half a cell wide at the end of the range.
        (-ends[0]).min(ends[1]) + 0.5 * full / CELLS.0 as f64
    }

    /// The output at each of `commands`, which rise: on the straight line through the cells near it.
    fn curve(&self, commands: &[f64], full: f64) -> Vec<[f64; 2]> {
        let cell = full / CELLS.0 as f64;
        let at = |&command: &f64| {
            let mut width = CELLS.1 * cell;
            loop {
                let from = self.cells.partition_point(|one| one[0] < command - width);
                let to = self.cells.partition_point(|one| one[0] <= command + width);
                if to - from >= LEAST {
                    let [start, slope] = line(self.cells[from..to].iter());
                    return [command, start + slope * command];
                }
                width *= 2.0;
            }
        };
        commands.iter().map(at).collect()
    }

    /// The branch with another draw of its scatter.
    fn disturbed(&self, random: &mut ChaCha8Rng) -> Self {
        let size = self.scatter();
        // A sum of twelve uniform numbers is near enough to a normal one.
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let cells = self.cells.iter().map(|&[u, y]| [u, y + size * normal()]);
        Self {
            cells: cells.collect(),
            ..self.clone()
        }
    }

    /// The standard deviation of a cell's mean, from how far each is off the line through its neighbours.
    fn scatter(&self) -> f64 {
        let off = self.cells.windows(3).map(|three| {
            let share = (three[1][0] - three[0][0]) / (three[2][0] - three[0][0]);
            let middle = three[0][1] + share * (three[2][1] - three[0][1]);
            let variance = 1.0 + share.powi(2) + (1.0 - share).powi(2);
            (three[1][1] - middle).powi(2) / variance
        });
        (off.sum::<f64>() / (self.cells.len() - 2).max(1) as f64).sqrt()
    }
}

/// The rows between which the command goes from beyond [`REACH`] of one side to beyond that of the other.
fn passages(command: &[f64], full: f64) -> Vec<(usize, usize)> {
    let mut turns = vec![0];
    let (mut low, mut high) = (0, 0);
    let mut rising: Option<bool> = None;
    for (i, &u) in command.iter().enumerate() {
        if u > command[high] {
            high = i;
        }
        if u < command[low] {
            low = i;
        }
        let turned_down = command[high] - u > TURN * full && rising != Some(false);
        let turned_up = u - command[low] > TURN * full && rising != Some(true);
        if turned_down || turned_up {
            turns.push(if turned_down { high } else { low });
            rising = Some(turned_up);
            (low, high) = (i, i);
        }
    }
    turns.push(match rising {
        Some(true) => high,
        Some(false) => low,
        None => 0,
    });
    let wide = |&(from, to): &(usize, usize)| {
        let ends = [command[from], command[to]];
        ends[0].min(ends[1]) <= -REACH * full && ends[0].max(ends[1]) >= REACH * full
    };
    let pairs = turns.windows(2).map(|pair| (pair[0], pair[1]));
    pairs.filter(wide).collect()
}

/// Cycles in one, point by point.
fn pooled(cycles: Vec<Cycle>) -> Cycle {
    let branch = |of: fn(&Cycle) -> &Vec<[f64; 2]>| {
        let point = |(i, point): (usize, &[f64; 2])| {
            let outputs = cycles.iter().map(|cycle| of(cycle)[i][1]);
            [point[0], median(outputs.collect())]
        };
        of(&cycles[0]).iter().enumerate().map(point).collect()
    };
    Cycle {
        falling: branch(|cycle| &cycle.falling),
        rising: branch(|cycle| &cycle.rising),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Columns of `cycles` triangles (or sines) of this period, s, at 50 rows a second, over ±`reach`, and of an output that is
    /// drawn by a formula of the command, the direction and the time, with noise of this standard deviation.
    fn record(
        cycles: f64,
        period: f64,
        reach: f64,
        sine: bool,
        noise: f64,
        seed: u64,
        output: impl Fn(f64, f64) -> f64,
    ) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = (50.0 * period * (cycles + 0.25)) as usize;
        let time: Vec<f64> = (0..count).map(|k| 0.02 * k as f64).collect();
        let command = |t: &f64| match sine {
            true => reach * (TAU * t / period).sin(),
            false => reach * (TAU * t / period).sin().asin() / (0.25 * TAU),
        };
        let direction = |t: &f64| (TAU * t / period).cos().signum();
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let outputs = time
            .iter()
            .map(|t| output(command(t), direction(t)) + noise * normal())
            .collect();
        [time.clone(), time.iter().map(command).collect(), outputs]
    }

    fn sweep(record: &[Vec<f64>; 3], full: f64) -> Result<Sweep, String> {
        Sweep::of(&[record.each_ref().map(|column| column.as_slice())], full)
    }

    /// A valve of 6 L/min per V, with a loop of 0.1 V to both sides, a dead zone of 0.2 V around 0.3 V.
    fn valve(command: f64, direction: f64) -> f64 {
        let opening = command - 0.1 * direction - 0.3;
        6.0 * (opening.abs() - 0.2).max(0.0) * opening.signum()
    }

    type Read = fn(&CycleFigures) -> Option<f64>;

    /// The figures of [`valve`].
    const VALVE: [(&str, Read, f64); 6] = [
        // As both ends are approached it is open by 9.4 and 10 V.
        ("rated", |one| one.rated, 58.2),
        ("gain", |one| Some(one.gain), 6.0),
        ("lap", |one| Some(one.lap), 4.0),
        ("asymmetry", |one| Some(one.asymmetry), 0.0),
        ("hysteresis", |one| Some(one.hysteresis), 2.0),
        ("null", |one| Some(one.null), 3.0),
    ];

    #[test]
    fn a_noisy_slow_cycle_has_the_figures_that_were_drawn() {
        for (sine, cycles) in [(false, 1.0), (true, 1.0), (false, 4.0)] {
            let record = record(cycles, 40.0, 10.0, sine, 0.3, 7, valve);
            let sweep = sweep(&record, 10.0).unwrap();
            assert_eq!(sweep.count(), cycles as usize);
            assert!((sweep.period - 40.0).abs() < 0.5, "{}", sweep.period);
            let (found, spread) = sweep.figures.unwrap();
            for (name, figure, expected) in VALVE {
                let value = figure(&found).unwrap();
                let half = spread.half_width(value, figure);
                println!("{sine} {cycles} {name}: {value} ± {half} for {expected}");
                assert!(half > 0.0 && half < 0.05 * expected.abs().max(10.0));
                assert!(
                    (value - expected).abs() < 2.0 * half,
                    "{name}: {value} ± {half}"
                );
            }
        }
    }

    #[test]
    fn intervals_of_measured_figures_hold_what_they_promise() {
        for cycles in [1.0, 4.0] {
            let found: Vec<(CycleFigures, Spread)> = (0..60)
                .map(|seed| record(cycles, 40.0, 10.0, false, 0.3, seed, valve))
                .map(|record| sweep(&record, 10.0).unwrap().figures.unwrap())
                .collect();
            for (name, figure, expected) in VALVE {
                let held = found.iter().filter(|(found, spread)| {
                    let value = figure(found).unwrap();
                    (value - expected).abs() <= spread.half_width(value, figure)
                });
                let held = held.count();
                println!("{cycles} cycles, {name}: {held} of 60");
                assert!(held >= 50, "{cycles} cycles, {name}: {held} of 60");
            }
        }
    }

    #[test]
    fn what_is_fast_partial_or_stepped_is_no_slow_cycle() {
        let reason = |record: [Vec<f64>; 3]| sweep(&record, 10.0).unwrap_err();
        let fast = reason(record(3.0, 2.0, 10.0, false, 0.0, 7, valve));
        assert!(fast.contains("too fast"), "{fast}");
        let small = reason(record(3.0, 40.0, 6.0, false, 0.0, 7, valve));
        assert!(small.contains("no cycle"), "{small}");
        let single = reason(record(0.5, 40.0, 10.0, false, 0.0, 7, valve));
        assert!(single.contains("one direction"), "{single}");
        let mut square = record(3.0, 40.0, 10.0, false, 0.0, 7, valve);
        for command in &mut square[1] {
            *command = 10.0 * command.signum();
        }
        assert!(reason(square).contains("in steps"));
    }

    #[test]
    fn the_slowest_of_several_sweeps_is_read() {
        // A meter's lag of 0.5 s, as it shows on a triangle.
        let lagging = |period: f64| {
            record(3.0, period, 10.0, false, 0.0, 7, move |u, direction| {
                6.0 * (u - direction * 0.5 * 40.0 / period)
            })
        };
        let [fast, slow] = [20.0, 200.0].map(lagging);
        let both = [&fast, &slow].map(|one| one.each_ref().map(|column| column.as_slice()));
        let sweep = Sweep::of(&both, 10.0).unwrap();
        let (found, _) = sweep.figures.clone().unwrap();
        assert!((sweep.period - 200.0).abs() < 1.0 && sweep.count() == 3);
        assert!((found.hysteresis - 2.0).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_meter_without_a_sign_gives_no_figures() {
        let unsigned = record(2.0, 40.0, 10.0, false, 0.1, 7, |u, d| valve(u, d).abs());
        assert!(sweep(&unsigned, 10.0).unwrap().figures.is_none());
    }
}
