//! The threshold as it was measured: in records whose command goes to and fro by little, and slowly.

use super::reading::{Reading, repeated, short};
use crate::card::threshold::Bend;
use crate::record::Channel;

/// The largest range of the command in such a test, and the smallest, as shares of full scale.
const RANGE: (f64, f64) = (0.3, 1e-3);
/// A command has turned that goes back by this share of its range, and a reversal goes through this share of it.
const TURNS: (f64, f64) = (0.25, 0.6);
/// Fewest reversals.
const LEAST: usize = 3;
/// The fastest command, of full scale in 1 s: the lag of a servo valve is then below a twentieth of a percent.
const FASTEST: f64 = 0.05;
/// A reversal whose bend leaves this share of the output's variance or more is not followed.
const FOLLOWS: f64 = 0.5;
/// The bend of a noisy reversal is one from this many standard deviations on.
const BENDS: f64 = 3.0;
/// A threshold beyond this share of a reversal is not its own.
const INSIDE: f64 = 0.7;

/// The thresholds of all reversals.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Thresholds {
    /// % of full scale.
    values: Vec<f64>,
    /// How far each may be off, %.
    half: f64,
    channel: Channel,
    /// How far a reversal goes, and how fast, % of full scale (in 1 s): the means.
    range: f64,
    rate: f64,
}

impl Thresholds {
    /// The thresholds in records of time, command and this output; why there is none otherwise.
    pub(super) fn of(records: &[[&[f64]; 3]], channel: Channel, full: f64) -> Result<Self, String> {
        let mut reason = "no record goes to and fro slowly within 30 % of full scale";
        let mut found = Vec::new();
        for [time, command, output] in records {
            let turns = turns(command, full);
            if turns.len() <= LEAST {
                continue;
            }
            let pairs = turns.windows(2).map(|pair| (pair[0], pair[1]));
            for (from, to) in pairs {
                let range = (command[to] - command[from]).abs();
                let rate = range / (time[to] - time[from]);
                if rate > FASTEST * full {
                    reason = "the command goes to and fro too fast for a threshold";
                    continue;
                }
                match reversal(&command[from..=to], &output[from..=to]) {
                    Some([threshold, half]) => found.push([threshold, half, range, rate]),
                    None => reason = "the output does not follow such small reversals",
                }
            }
        }
        if found.len() < LEAST {
            return Err(reason.into());
        }
        let percent = |i: usize| found.iter().map(move |one| 100.0 * one[i] / full);
        let count = found.len() as f64;
        Ok(Self {
            values: percent(0).collect(),
            half: percent(1).fold(0.0, f64::max),
            channel,
            range: percent(2).sum::<f64>() / count,
            rate: percent(3).sum::<f64>() / count,
        })
    }

    /// The threshold, where the command may be wrong by this share of itself.
    pub(super) fn reading(&self, command: f64) -> Reading {
        let (value, half) = repeated(&self.values, self.half);
        let test = format!(
            "{} over command, {} reversals of {} % at {} %/s",
            self.channel,
            self.values.len(),
            short(self.range),
            short(self.rate)
        );
        let reading = Reading::around(value, half.hypot(command * value), test);
        Reading {
            low: reading.low.max(0.0),
            ..reading
        }
    }
}

/// Threshold of a reversal and how far it may be off, in the unit of the command; none where the output does not follow.
fn reversal(command: &[f64], output: &[f64]) -> Option<[f64; 2]> {
    let rows: Vec<[f64; 2]> = command
        .iter()
        .zip(output)
        .map(|(u, y)| [(u - command[0]).abs(), *y])
        .collect();
    let bend = Bend::of(&rows)?;
    let mean = output.iter().sum::<f64>() / output.len() as f64;
    let moved: f64 = output.iter().map(|y| (y - mean).powi(2)).sum();
    let reach = rows[rows.len() - 1][0];
    if !(bend.left < FOLLOWS * moved && bend.threshold < INSIDE * reach) {
        return None;
    }
    let noise = (bend.left / (rows.len() - 3) as f64).sqrt();
    let bends = bend.straight - bend.left > (BENDS * noise).powi(2);
    let threshold = if bends { bend.threshold } else { 0.0 };
    Some([threshold, 1.96 * noise / bend.slope.abs()])
}

/// The rows at which a command of a small range turns, each of them far from the one before; none where its range is large.
fn turns(command: &[f64], full: f64) -> Vec<usize> {
    let extreme = |pick: fn(f64, f64) -> f64| command.iter().copied().fold(f64::NAN, pick);
    let range = extreme(f64::max) - extreme(f64::min);
    if !(range <= RANGE.0 * full && range >= RANGE.1 * full) {
        return Vec::new();
    }
    let mut turns: Vec<usize> = Vec::new();
    let (mut low, mut high) = (0, 0);
    let mut rising = None;
    for (row, &u) in command.iter().enumerate() {
        // The last of equal ones: at rest nothing has turned yet.
        if u >= command[high] {
            high = row;
        }
        if u <= command[low] {
            low = row;
        }
        let down = command[high] - u > TURNS.0 * range && rising != Some(false);
        let up = u - command[low] > TURNS.0 * range && rising != Some(true);
        if down || up {
            // Where it sets out for the first time it has come from nowhere.
            if rising.is_some() {
                turns.push(if down { high } else { low });
            }
            rising = Some(up);
            (low, high) = (row, row);
        }
    }
    let far = |pair: &[usize]| (command[pair[1]] - command[pair[0]]).abs() >= TURNS.1 * range;
    match turns.windows(2).all(far) {
        true => turns,
        false => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A triangle of ±`height` around 2 V, `period` s, answered by a play of this half-width and 3 L/min per V, with noise.
    fn record(height: f64, period: f64, play: f64, noise: f64) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let time: Vec<f64> = (0..6000).map(|k| 0.02 * f64::from(k)).collect();
        let triangle = |t: &f64| 2.0 + height * (1.0 - 4.0 * ((t / period).fract() - 0.5).abs());
        let command: Vec<f64> = time.iter().map(triangle).collect();
        let mut spool = command[0];
        let output = command.iter().map(|u| {
            spool = spool.clamp(u - play, u + play);
            3.0 * spool + noise * normal()
        });
        let output = output.collect();
        [time, command, output]
    }

    fn read(record: &[Vec<f64>; 3]) -> Result<Thresholds, String> {
        let columns = record.each_ref().map(|column| column.as_slice());
        Thresholds::of(&[columns], Channel::Flow, 10.0)
    }

    #[test]
    fn a_play_goes_back_by_its_width_before_the_output_follows() {
        for noise in [0.0, 0.02] {
            let found = read(&record(0.4, 20.0, 0.06, noise)).unwrap();
            let reading = found.reading(0.0);
            println!("{reading:?}");
            assert!((reading.value - 1.2).abs() < 0.05, "{reading:?}");
            assert!(reading.low <= 1.2 + 0.01 && 1.2 - 0.01 <= reading.high);
            let test = "flow over command, 10 reversals of 8 % at 0.8 %/s";
            assert_eq!(reading.test, test);
        }
        let none = read(&record(0.4, 20.0, 0.0, 0.02)).unwrap().reading(0.0);
        assert!(none.low == 0.0 && none.high < 0.1, "{none:?}");
    }

    #[test]
    fn what_is_no_threshold_test_has_none_and_says_why() {
        for (record, part) in [
            (record(8.0, 20.0, 0.06, 0.0), "within 30 %"),
            (record(0.4, 0.5, 0.06, 0.0), "too fast"),
            (record(0.4, 20.0, 0.5, 0.01), "does not follow"),
        ] {
            let reason = read(&record).unwrap_err();
            assert!(reason.contains(part), "{reason}");
        }
    }
}
