//! Steps of the command from zero to full scale, as they were measured.

use super::reading::{Reading, deviation, repeated};
use crate::card::step::DONE;
use crate::record::Channel;

/// Share of full scale by which a command may be off zero or full scale and still be there.
const THERE: f64 = 0.02;
/// Fewest rows that a command stays before a step and after it.
const ROWS: (usize, usize) = (5, 30);
/// Most rows that a step takes.
const JUMP: usize = 2;
/// An answer has settled when it changes by less than this share of its way in the last half of what is seen of it.
const SETTLED: f64 = 0.02;

/// The answers to steps from zero to full scale.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Steps {
    answers: Vec<Answer>,
    channel: Channel,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Answer {
    /// Until 90 % of the way, s.
    time: f64,
    /// How far that may be off: half a row, and noise.
    time_half: f64,
    /// Beyond the end, %.
    overshoot: f64,
    /// How far that may be off.
    overshoot_half: f64,
}

impl Steps {
    /// The steps of records of time, command and this output; why there is none otherwise.
    pub(super) fn of(records: &[(Channel, [&[f64]; 3])], full: f64) -> Result<Self, String> {
        let none = || "the records have no step from zero to full scale".to_owned();
        let channel = records.first().ok_or("no spool or flow was measured")?.0;
        let own = records.iter().filter(|one| one.0 == channel);
        let mut unsettled = false;
        let mut answers = Vec::new();
        for (_, columns) in own {
            for (from, at, to) in steps(columns[1], full) {
                match Answer::of(*columns, from, at, to) {
                    Some(answer) => answers.push(answer),
                    None => unsettled = true,
                }
            }
        }
        match (answers.is_empty(), unsettled) {
            (true, true) => {
                Err("the answer to the step does not settle while the command stays".into())
            }
            (true, false) => Err(none()),
            _ => Ok(Self { answers, channel }),
        }
    }

    /// Until 90 % of the way, ms.
    pub(super) fn time(&self) -> Result<Reading, String> {
        Ok(self.reading(|one| [1e3 * one.time, 1e3 * one.time_half]))
    }

    /// Beyond the end, %.
    pub(super) fn overshoot(&self) -> Result<Reading, String> {
        let found = self.reading(|one| [one.overshoot, one.overshoot_half]);
        Ok(Reading {
            low: found.low.max(0.0),
            ..found
        })
    }

    fn reading(&self, of: impl Fn(&Answer) -> [f64; 2]) -> Reading {
        let all: Vec<[f64; 2]> = self.answers.iter().map(of).collect();
        let values: Vec<f64> = all.iter().map(|one| one[0]).collect();
        let floor = all.iter().map(|one| one[1]).fold(0.0, f64::max);
        let (value, half) = repeated(&values, floor);
        let count = match all.len() {
            1 => "a step".into(),
            several => format!("{several} steps"),
        };
        Reading::around(
            value,
            half,
            format!(
                "{} over time, {count} from zero to full scale",
                self.channel
            ),
        )
    }
}

impl Answer {
    /// The answer to a command that is zero from row `from` on, jumps before row `at` and stays until before row `to`.
    fn of([time, _, output]: [&[f64]; 3], from: usize, at: usize, to: usize) -> Option<Self> {
        let mean = |rows: &[f64]| rows.iter().sum::<f64>() / rows.len() as f64;
        let before = &output[at.saturating_sub(2 * ROWS.0).max(from)..at];
        let half = at + (to - at) / 2;
        let quarter = half + (to - half) / 2;
        let (start, end) = (mean(before), mean(&output[quarter..to]));
        let way = end - start;
        let noise = deviation(&output[quarter..to]);
        let moves = (mean(&output[half..quarter]) - end).abs() < SETTLED * way.abs();
        if !moves || noise > 0.1 * way.abs() {
            return None;
        }
        let share = |row: usize| (output[row] - start) / way;
        let reached = (at..to).find(|&row| share(row) >= DONE)?;
        let earlier = reached.max(1) - 1;
        let (low, high) = (share(earlier), share(reached));
        let inside = time[earlier] + (time[reached] - time[earlier]) * (DONE - low) / (high - low);
        let row = time[at] - time[at - 1];
        let steepness = (high - low) / (time[reached] - time[earlier]);
        let noise_share = noise / way.abs();
        let largest = (at..to).map(share).fold(0.0, f64::max);
        // The largest of many noisy rows is above all of them by some deviations: what noise can do is no overshoot.
        let beyond = 100.0 * (largest - 1.0);
        let noise_alone = 300.0 * noise_share;
        Some(Self {
            time: (inside - time[at]).max(0.0),
            time_half: f64::hypot(0.5 * row, 1.96 * noise_share / steepness),
            overshoot: if beyond > noise_alone { beyond } else { 0.0 },
            overshoot_half: noise_alone,
        })
    }
}

/// The rows at which the command has been zero since the first, has jumped to full scale of either sign at the second, and stays
/// there until the third.
fn steps(command: &[f64], full: f64) -> Vec<(usize, usize, usize)> {
    let near = |row: usize, level: f64| (command[row] - level).abs() <= THERE * full;
    let mut found = Vec::new();
    let mut row = 0;
    while row < command.len() {
        let rest = (row..command.len()).take_while(|&k| near(k, 0.0)).count();
        if rest < ROWS.0 {
            row += rest.max(1);
            continue;
        }
        let left = row + rest;
        let arrives = |level: f64| (left..command.len().min(left + JUMP)).find(|&k| near(k, level));
        if let Some((level, at)) = [full, -full]
            .into_iter()
            .find_map(|level| Some((level, arrives(level)?)))
        {
            let stays = (at..command.len()).take_while(|&k| near(k, level)).count();
            if stays >= ROWS.1 {
                found.push((row, at, at + stays));
            }
        }
        row = left;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::PI;

    /// Steps of 10 V, 0.5 s long, answered by 3 L/min per V of a formula of the time since each, with noise.
    fn record(count: usize, height: f64, noise: f64, answer: impl Fn(f64) -> f64) -> [Vec<f64>; 3] {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let time: Vec<f64> = (0..1000 * count).map(|k| 0.001 * k as f64).collect();
        let since = |t: f64| t.rem_euclid(1.0) - 0.5 + 1e-9;
        let command = time
            .iter()
            .map(|&t| if since(t) >= 0.0 { height } else { 0.0 })
            .collect();
        let output = time
            .iter()
            .map(|&t| {
                let own = if since(t) >= 0.0 {
                    answer(since(t))
                } else {
                    0.0
                };
                3.0 * height * (own + noise * normal())
            })
            .collect();
        [time, command, output]
    }

    fn read(record: &[Vec<f64>; 3]) -> Result<Steps, String> {
        let columns = record.each_ref().map(|column| column.as_slice());
        Steps::of(&[(Channel::Flow, columns)], 10.0)
    }

    #[test]
    fn a_lag_of_first_order_has_gone_nine_tenths_after_the_logarithm_of_ten() {
        for (count, height) in [(1, 10.0), (5, 10.0), (3, -10.0)] {
            let steps = read(&record(count, height, 0.004, |t| 1.0 - (-t / 0.02).exp())).unwrap();
            assert_eq!(steps.answers.len(), count);
            let time = steps.time().unwrap();
            let expected = 20.0 * 10f64.ln();
            println!("{time:?} for {expected}");
            assert!(
                (time.low..=time.high).contains(&expected),
                "{time:?} for {expected}"
            );
            assert!(time.high - time.low < 10.0);
            assert_eq!(steps.overshoot().unwrap().value, 0.0);
        }
    }

    #[test]
    fn an_oscillation_overshoots_by_what_its_damping_says() {
        let (damping, natural): (f64, f64) = (0.4, 200.0);
        let root = (1.0 - damping * damping).sqrt();
        let answer = |t: f64| {
            let phase = natural * root * t;
            1.0 - (-damping * natural * t).exp() * (phase.cos() + damping / root * phase.sin())
        };
        let overshoot = read(&record(4, 10.0, 0.002, answer))
            .unwrap()
            .overshoot()
            .unwrap();
        let expected = 100.0 * (-PI * damping / root).exp();
        println!("{overshoot:?} for {expected}");
        assert!(
            (overshoot.low..=overshoot.high).contains(&expected),
            "{overshoot:?} for {expected}"
        );
    }

    #[test]
    fn small_steps_and_answers_that_do_not_settle_are_no_test() {
        let reason = read(&record(2, 5.0, 0.0, |t| 1.0 - (-t / 0.02).exp())).unwrap_err();
        assert!(reason.contains("no step"), "{reason}");
        let reason = read(&record(2, 10.0, 0.0, |t| 1.0 - (-t / 1.0).exp())).unwrap_err();
        assert!(reason.contains("settle"), "{reason}");
    }
}
