//! Whether a valve answers a jump of its command by the row that has it. Where a converter holds the command between two rows it
//! cannot: before that row it has not got it. Where the command went straight from row to row, or jumped somewhere between them,
//! it does.

/// Rows before a jump in which the command rests, and through which the output is continued.
const BEFORE: usize = 4;
/// A jump is at least this share of all that the command covers.
const JUMP: f64 = 0.02;
/// And the command before it stays within this share of the jump.
const REST: f64 = 0.05;
/// Rows around it are equally far apart, the longest interval less than so many times the shortest.
const EVEN: f64 = 1.2;
/// Fewest jumps that say something.
const FEWEST: usize = 6;
/// The same where two answers are to be told apart.
const FEWEST_OF_TWO: usize = 3;
/// An answer is late that in the row after the jump is less than this share of what it was to be.
const LATE: f64 = 0.25;
/// By how many standard errors the answers are sure.
const SURE: f64 = 4.5;

/// What an output does at the jumps of a command, each continued in a straight line through the rows before: summed, each
/// times its jump.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::diagnose) struct Answers {
    jumps: usize,
    /// In the row that has the jump,
    there: f64,
    /// in the row after it,
    after: f64,
    /// in the row before it,
    before: f64,
    /// and the squares of the latter.
    squares: f64,
}

impl Answers {
    /// Adds the jumps of a `command` that covers `span` in all, to whose rows, taken at these times, the `output` belongs.
    pub(in crate::diagnose) fn add(
        &mut self,
        time: &[f64],
        command: &[f64],
        output: &[f64],
        span: f64,
    ) {
        for row in BEFORE + 1..command.len() {
            let jump = command[row] - command[row - 1];
            let first = row - 1 - BEFORE;
            let (high, low) = range(&command[first..row]);
            if jump.abs() < JUMP * span || high - low > REST * jump.abs() {
                continue;
            }
            let intervals = time[first..=row].windows(2).map(|two| two[1] - two[0]);
            let (longest, shortest) = range(&intervals.collect::<Vec<f64>>());
            if longest >= EVEN * shortest {
                continue;
            }
            let off = |row: usize| jump * (output[row] - continued(&output[row - BEFORE..row], 0));
            self.jumps += 1;
            self.there += off(row);
            if let Some(after) = output.get(row + 1) {
                self.after += jump * (after - continued(&output[row - BEFORE..row], 1));
            }
            self.before += off(row - 1);
            self.squares += off(row - 1).powi(2);
        }
    }

    /// Whether they are more than what noise, and what still moves from the jump before, make of it.
    pub(in crate::diagnose) fn are_sure(&self) -> bool {
        self.jumps >= FEWEST && self.there.abs() - self.before.abs() > SURE * self.noise()
    }

    /// Whether they are `those` rather than none; `None` where there are too few, noise hides which, or all come late.
    pub(in crate::diagnose) fn are(&self, those: &Self) -> Option<bool> {
        let at_once = |one: &Self| one.there - one.before;
        let [own, expected] = [self, those].map(at_once);
        let shows = self.jumps >= FEWEST_OF_TWO && 0.5 * expected.abs() > SURE * self.noise();
        let late = self.after / those.after < LATE;
        (shows && !late).then_some(own / expected > 0.5)
    }

    /// Of two sums with as much noise each.
    fn noise(&self) -> f64 {
        (2.0 * self.squares).sqrt()
    }
}

/// The largest and the smallest of these.
pub(in crate::diagnose) fn range(values: &[f64]) -> (f64, f64) {
    let high = values.iter().copied().fold(f64::MIN, f64::max);
    (high, values.iter().copied().fold(f64::MAX, f64::min))
}

/// The value so many rows `beyond` the one behind these, on the straight line that is nearest to them.
fn continued(values: &[f64], beyond: usize) -> f64 {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let from_middle = |row: usize| row as f64 - middle;
    let products = values
        .iter()
        .enumerate()
        .map(|(row, value)| from_middle(row) * value);
    let squares: f64 = (0..values.len()).map(|row| from_middle(row).powi(2)).sum();
    mean + products.sum::<f64>() / squares * (count + beyond as f64 - middle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::white;

    #[test]
    fn a_straight_line_is_continued() {
        for (beyond, expected) in [(0, 9.0), (1, 11.0)] {
            assert!((continued(&[1.0, 3.0, 5.0, 7.0], beyond) - expected).abs() < 1e-12);
        }
    }

    /// The answers to 20 steps of ± 3 of a lag of 10 rows, whose input has come closer to the step by `share` when the row has it.
    fn answers(share: f64, settled: bool) -> Answers {
        late_answers(share, settled, 0)
    }

    /// The same, so many rows later.
    fn late_answers(share: f64, settled: bool, late: usize) -> Answers {
        let noise = white(2000, 4);
        let (mut command, mut output) = (Vec::new(), Vec::new());
        let (mut lag, mut last) = (0.0, 0.0);
        for (row, noise) in noise.iter().enumerate() {
            let long = if settled { 100 } else { 12 };
            let now = if (row / long) % 2 == 0 { -3.0 } else { 3.0 };
            lag += 0.1 * (last + share * (now - last) - lag);
            last = now;
            command.push(now);
            output.push(-lag + 0.05 * noise);
        }
        output.rotate_right(late);
        let mut answers = Answers::default();
        let time: Vec<f64> = (0..2000).map(f64::from).collect();
        answers.add(&time, &command, &output, 6.0);
        answers
    }

    #[test]
    fn only_what_a_held_command_cannot_do_is_an_answer() {
        for settled in [true, false] {
            assert!(answers(0.5, settled).are_sure());
            assert!(!answers(0.0, settled).are_sure());
        }
        assert!(!Answers::default().are_sure());
    }

    #[test]
    fn answers_are_those_or_none_where_noise_does_not_hide_them() {
        for settled in [true, false] {
            let those = answers(0.5, settled);
            assert_eq!(answers(0.6, settled).are(&those), Some(true));
            assert_eq!(answers(0.0, settled).are(&those), Some(false));
            assert_eq!(those.are(&answers(0.02, settled)), None);
            assert_eq!(late_answers(0.5, settled, 2).are(&those), None);
        }
        assert_eq!(Answers::default().are(&answers(0.5, true)), None);
    }
}
