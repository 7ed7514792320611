//! Which signal follows which, and whether one repeats itself.

use serde::Serialize;

/// Rows that are compared at most, and at least, and rows by which one may be behind the other.
const ROWS: usize = 20_000;
const FEWEST: usize = 20;
const FARTHEST: usize = 200;

/// Two commands are the same if they differ by less than this fraction of the command's range.
const SAME: f64 = 1e-3;

/// How one signal follows another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Follows {
    /// Rows by which it is behind; negative where it leads.
    pub rows: isize,
    /// The correlation at that distance, from -1 to 1.
    pub correlation: f64,
}

impl Follows {
    /// Whether the two are so much alike that one can be the response to the other.
    pub fn is_close(&self) -> bool {
        const ALIKE: f64 = 0.7;
        self.correlation.abs() >= ALIKE
    }
}

/// How `response` follows `command`: where they are most alike, as if what is not finite were the mean. `None` where one of them is
/// constant, or short.
pub(super) fn follows(command: &[f64], response: &[f64]) -> Option<Follows> {
    let rows = command.len().min(response.len()).min(ROWS);
    if rows < FEWEST {
        return None;
    }
    let (command, response) = (centred(&command[..rows])?, centred(&response[..rows])?);
    let farthest = FARTHEST.min(rows / 4) as isize;
    let at = |lag: isize| Follows {
        rows: lag,
        correlation: match lag >= 0 {
            true => correlation(&command, &response, lag as usize),
            false => correlation(&response, &command, lag.unsigned_abs()),
        },
    };
    let strength = |follows: &Follows| follows.correlation.abs();
    (-farthest..=farthest)
        .map(at)
        .max_by(|one, other| strength(one).total_cmp(&strength(other)))
}

/// The correlation of `early` with what `late` is `lag` rows later; both are about their means.
fn correlation(early: &[f64], late: &[f64], lag: usize) -> f64 {
    let pairs = || early.iter().zip(&late[lag..]);
    let sum = |of: fn((&f64, &f64)) -> f64| pairs().map(of).sum::<f64>();
    let scale = (sum(|(a, _)| a * a) * sum(|(_, b)| b * b)).sqrt();
    match scale > 0.0 {
        true => sum(|(a, b)| a * b) / scale,
        false => 0.0,
    }
}

/// The correlation of `response` with `command` where they are most alike, at lags at which the command correlates with
/// itself by more than `itself`.
pub(in crate::record) fn alike(command: &[f64], response: &[f64], itself: f64) -> Option<f64> {
    let rows = command.len().min(response.len()).min(ROWS);
    if rows < FEWEST {
        return None;
    }
    let (command, response) = (centred(&command[..rows])?, centred(&response[..rows])?);
    (0..FARTHEST.min(rows / 4))
        .take_while(|&lag| correlation(&command, &command, lag) > itself)
        .map(|lag| correlation(&command, &response, lag))
        .max_by(|one, other| one.abs().total_cmp(&other.abs()))
}

/// The values about their mean, which stands in for what is not finite; `None` where nothing is left.
fn centred(values: &[f64]) -> Option<Vec<f64>> {
    let finite = || values.iter().filter(|value| value.is_finite());
    let first = *finite().next()?;
    let mean = finite().sum::<f64>() / finite().count() as f64;
    let about = |&value: &f64| {
        if value.is_finite() { value - mean } else { 0.0 }
    };
    let varies = finite().any(|&value| value != first);
    (varies && mean.is_finite()).then(|| values.iter().map(about).collect())
}

/// The number of rows after which the whole command comes again.
pub(super) fn period(command: &[f64]) -> Option<usize> {
    const WINDOW: usize = 256;
    const SHARE: f64 = 0.99;
    let (min, max) = command
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), &value| {
            (min.min(value), max.max(value))
        });
    let same = |one: f64, other: f64| (one - other).abs() <= SAME * (max - min);
    let moves = command
        .windows(2)
        .position(|pair| !same(pair[0], pair[1]))?;
    let window = &command[moves..command.len().min(moves + WINDOW)];
    let last = command.len() / 2;
    let alike = |distance: usize| {
        let later = command.get(moves + distance..).unwrap_or_default();
        later.len() >= window.len() && window.iter().zip(later).all(|(a, b)| same(*a, *b))
    };
    let differs = (1..last).find(|&distance| !alike(distance))?;
    (differs..=last).find(|&distance| {
        let pairs = || command.iter().zip(&command[distance..]);
        let repeated = || pairs().filter(|(a, b)| same(**a, **b)).count();
        alike(distance) && repeated() as f64 >= SHARE * pairs().count() as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chirp(row: usize) -> f64 {
        let time = row as f64 * 1e-3;
        (40.0 * time * (1.0 + time)).sin()
    }

    #[test]
    fn what_is_behind_follows() {
        let command: Vec<f64> = (100..4000).map(chirp).collect();
        let late: Vec<f64> = (88..3988).map(|row| -2.0 * chirp(row) + 1.0).collect();
        let found = follows(&command, &late).unwrap();
        assert_eq!(found.rows, 12);
        assert!((found.correlation + 1.0).abs() < 1e-4, "{found:?}");
        assert_eq!(follows(&late, &command).unwrap().rows, -12);
        assert_eq!(follows(&command, &vec![1.0; 3900]), None);
    }

    #[test]
    fn repeats_are_found_but_not_in_a_chirp() {
        let once: Vec<f64> = (0..700).map(chirp).collect();
        assert_eq!(period(&once.repeat(3)), Some(700));
        let step: Vec<f64> = (0..1000).map(|row| f64::from(row / 100 % 2)).collect();
        assert_eq!(period(&step), Some(200));
        assert_eq!(period(&(0..4000).map(chirp).collect::<Vec<f64>>()), None);
        assert_eq!(period(&[1.0; 100]), None);
        assert_eq!(period(&[1.0]), None);
        let last: Vec<f64> = (0..100).map(|row| f64::from(row / 99)).collect();
        assert_eq!(period(&last), None);
    }
}
