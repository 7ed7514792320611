//! Lines in a residual's spectrum: the strongest of one record, and the one that all records have.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Bins to either side that a line is compared with.
const AROUND: usize = 25;
/// Periods of a line in the rows, at least: what is slower is a movement.
const FEWEST_PERIODS: usize = 3;
/// The residual is padded to this many times its length, so that a line between two bins is not lost.
const PADDING: usize = 4;

/// The frequency (Hz) of the line that stands out most from the spectrum around it, for rows `interval` seconds apart.
pub(in crate::diagnose) fn strongest_line(residual: &[f64], interval: f64) -> Option<f64> {
    let count = residual.len();
    if count < 8 * AROUND {
        return None;
    }
    let power = spectrum(residual);
    let reach = AROUND * PADDING;
    let first = FEWEST_PERIODS * PADDING;
    let stands_out = |k: usize| {
        let from = k.saturating_sub(reach).max(first);
        let mut near: Vec<f64> = power[from..(k + reach).min(power.len())].to_vec();
        let middle = near.len() / 2;
        let median = *near.select_nth_unstable_by(middle, f64::total_cmp).1;
        power[k] / median.max(f64::MIN_POSITIVE)
    };
    let peak = |&k: &usize| power[k] > power[k - 1] && power[k] >= power[k + 1];
    let mut peaks: Vec<usize> = (first + 1..power.len() - 1).filter(peak).collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    peaks.truncate(200);
    let best = peaks
        .into_iter()
        .max_by(|a, b| stands_out(*a).total_cmp(&stands_out(*b)))?;
    Some(best as f64 / ((PADDING * count) as f64 * interval))
}

/// Rows a period of what is strongest in a rest; `None` of a rest in which nothing comes to three periods.
pub(in crate::diagnose) fn strongest_period(rest: &[f64]) -> Option<f64> {
    let power = spectrum(rest);
    let first = FEWEST_PERIODS * PADDING;
    let bins = power.iter().enumerate().skip(first);
    let (best, _) = bins.max_by(|a, b| a.1.total_cmp(b.1))?;
    // What falls from there is slower still.
    (best > first).then(|| (PADDING * rest.len()) as f64 / best as f64)
}

/// How far a hum stands out in each record from the spectrum around it, at least.
const HUMS: f64 = 25.0;
/// What it is compared with: lines to either side, so many over the longest stretch's length away.
const BESIDE: Range<usize> = 3..13;

/// Rows of a record without a gap.
pub(in crate::diagnose) struct Stretch {
    /// Time of each row, s.
    pub(in crate::diagnose) time: Vec<f64>,
    /// What a model leaves in each.
    pub(in crate::diagnose) left: Vec<f64>,
    /// What its lines are compared with, in each: the command, or what a hum adds.
    pub(in crate::diagnose) beside: Vec<f64>,
}

/// A line that all records have, and their commands have not.
pub(in crate::diagnose) struct Hum {
    /// Hz.
    pub(in crate::diagnose) frequency: f64,
    /// The phase of each record less that of the first, in turns between -1/2 and 1/2.
    pub(in crate::diagnose) turns: Vec<f64>,
    /// How far it stands out from the spectrum around it, in the record where it does least.
    pub(in crate::diagnose) stands_out: f64,
}

/// The hum of `records`, each given in stretches, if all of them have one.
pub(in crate::diagnose) fn common_hum(records: &[Vec<Stretch>]) -> Option<Hum> {
    if records.len() < 2 {
        return None;
    }
    let stretches = records.iter().flatten();
    let longest = stretches.max_by_key(|one| one.left.len())?;
    let seconds = longest.time[longest.time.len() - 1] - longest.time[0];
    let interval = seconds / (longest.time.len() - 1) as f64;
    let near = strongest_line(&longest.left, interval)?;
    let left: Vec<Tapered> = records
        .iter()
        .map(|own| Tapered::new(own, |one| &one.left))
        .collect();
    let command = records
        .iter()
        .map(|own| Tapered::new(own, |one| &one.beside));
    let reach = seconds.recip();
    let span = left.iter().map(Tapered::span).fold(0.0, f64::max);
    let power = |frequency: f64| left.iter().map(|own| own.power(frequency)).sum();
    let frequency = highest(power, near, reach, 0.125 / span);
    let stands_out = left.iter().zip(command).map(|(left, command)| {
        let [left, command] = [left, &command].map(|own| own.stands_out(frequency, reach));
        if left > command { left } else { 0.0 }
    });
    let stands_out = stands_out.fold(f64::INFINITY, f64::min);
    let phases: Vec<f64> = left
        .iter()
        .map(|own| own.line(frequency).arg() / TAU)
        .collect();
    let turns = phases.iter().map(|phase| phase - phases[0]);
    (stands_out > HUMS).then(|| Hum {
        frequency,
        turns: turns.map(|turns| turns - turns.round()).collect(),
        stands_out,
    })
}

/// The rows of a record in Hann's window, each stretch in its own, with their times.
struct Tapered(Vec<(f64, f64)>);

impl Tapered {
    fn new(stretches: &[Stretch], values: impl Fn(&Stretch) -> &[f64]) -> Self {
        let rows = |one| tapered(values(one)).zip(one.time.iter().copied());
        Self(stretches.iter().flat_map(rows).collect())
    }

    /// From the first row to the last, s.
    fn span(&self) -> f64 {
        self.0[self.0.len() - 1].1 - self.0[0].1
    }

    /// The line at `frequency`.
    fn line(&self, frequency: f64) -> Complex<f64> {
        let turning =
            |(value, time): &(f64, f64)| Complex::from_polar(*value, -TAU * frequency * time);
        self.0.iter().map(turning).sum()
    }

    fn power(&self, frequency: f64) -> f64 {
        self.line(frequency).norm_sqr()
    }

    /// The line at `frequency` over the median of those beside it, which are `apart`.
    fn stands_out(&self, frequency: f64, apart: f64) -> f64 {
        self.power(frequency) / self.around(frequency, apart)
    }

    /// The median of the lines beside `frequency`, which are `apart`.
    fn around(&self, frequency: f64, apart: f64) -> f64 {
        let beside = BESIDE
            .map(|k| k as f64 * apart)
            .flat_map(|off| [frequency - off, frequency + off]);
        let mut beside: Vec<f64> = beside.map(|frequency| self.power(frequency)).collect();
        let middle = beside.len() / 2;
        let median = *beside.select_nth_unstable_by(middle, f64::total_cmp).1;
        median.max(f64::MIN_POSITIVE)
    }
}

/// How far what a hum adds stands out from what is left beside its line, at least.
const SHOWS: f64 = 25.0;
/// And the share of its line that may be missing in what was measured.
const MISSING: f64 = 0.5;

/// Whether what a hum adds ([`Stretch::beside`]) has a line of this `frequency` that was measured: it stands out from what is left around
/// it, and so little is left there that most of it must be in what was measured.
pub(in crate::diagnose) fn line_shows(stretches: &[Stretch], frequency: f64) -> bool {
    if stretches.is_empty() {
        return false;
    }
    let left = Tapered::new(stretches, |one| &one.left);
    let added = Tapered::new(stretches, |one| &one.beside);
    let apart = left.span().recip();
    let line = added.power(frequency);
    line > SHOWS * left.around(frequency, apart) && left.power(frequency) < MISSING * MISSING * line
}

/// Where `power` is highest within `reach` of `near`, its peaks being wider than `step`.
fn highest(power: impl Fn(f64) -> f64, near: f64, reach: f64, step: f64) -> f64 {
    let steps = (reach / step).ceil() as i32;
    let grid = (-steps..=steps).map(|k| near + f64::from(k) * step);
    let peak = grid.max_by(|a, b| power(*a).total_cmp(&power(*b)));
    let mut peak = peak.unwrap_or(near);
    let mut step = step;
    while step > 1e-9 * near {
        step *= 0.5;
        let three = [peak - step, peak, peak + step];
        peak = three
            .into_iter()
            .max_by(|a, b| power(*a).total_cmp(&power(*b)))
            .unwrap_or(peak);
    }
    peak
}

/// These rows less their mean, in Hann's window: a slow residual would leak over the lines without it.
fn tapered(rows: &[f64]) -> impl Iterator<Item = f64> {
    let count = rows.len() as f64;
    let mean = rows.iter().sum::<f64>() / count;
    rows.iter()
        .enumerate()
        .map(move |(k, value)| (value - mean) * (PI * k as f64 / count).sin().powi(2))
}

/// The power of some rows over frequency, in bins of one over the padded length.
fn spectrum(rows: &[f64]) -> Vec<f64> {
    let count = rows.len();
    let length = PADDING * count;
    let mut spectrum = vec![Complex::default(); length];
    for (bin, value) in spectrum.iter_mut().zip(tapered(rows)) {
        *bin = value.into();
    }
    FftPlanner::new()
        .plan_fft_forward(length)
        .process(&mut spectrum);
    spectrum[..length / 2]
        .iter()
        .map(|bin| bin.norm_sqr())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::statistics::simulated::white;

    #[test]
    fn records_that_hum_alike_are_told_how_far_they_are_apart() {
        let stretch = |phase: f64, rows: usize, seed: u64, command: fn(f64) -> f64| {
            let noise = white(rows, seed);
            let time: Vec<f64> = (0..rows).map(|k| k as f64 * 1e-3).collect();
            let hum = |time: f64| 2.0 * (TAU * (50.021 * time + phase)).cos();
            Stretch {
                left: time
                    .iter()
                    .zip(noise)
                    .map(|(&time, noise)| hum(time) + noise)
                    .collect(),
                beside: time.iter().map(|&time| command(time)).collect(),
                time,
            }
        };
        let slow = |time: f64| (9.0 * time * time).sin();
        let records = [(0.3, 4000, 5), (0.9, 3000, 6), (0.1, 5000, 7)];
        let all = records.map(|(phase, rows, seed)| vec![stretch(phase, rows, seed, slow)]);
        let hum = common_hum(&all).unwrap();
        assert!((hum.frequency - 50.021).abs() < 2e-3, "{}", hum.frequency);
        for (turns, wanted) in hum.turns.iter().zip([0.0, -0.4, -0.2]) {
            assert!((turns - wanted).abs() < 0.01, "{:?}", hum.turns);
        }
        // One that does not hum, and one whose command does.
        let silent = vec![Stretch {
            left: white(4000, 8),
            ..stretch(0.0, 4000, 8, slow)
        }];
        let [first, ..] = all;
        assert!(common_hum(&[first, silent]).is_none());
        let commanded = |time: f64| (TAU * 50.021 * time).sin();
        let all = [0.2, 0.6].map(|phase| vec![stretch(phase, 4000, 9, commanded)]);
        assert!(common_hum(&all).is_none());
    }

    #[test]
    fn a_line_between_two_bins_is_found_under_noise_and_drift() {
        let noise = white(4000, 3);
        let value = |k: usize| {
            let t = k as f64 * 1e-3;
            0.4 * (std::f64::consts::TAU * 47.3141 * t).sin() + noise[k] + 3.0 * t
        };
        let residual: Vec<f64> = (0..4000).map(value).collect();
        let found = strongest_line(&residual, 1e-3).unwrap();
        assert!((found - 47.3141).abs() < 0.05, "{found}");
    }

    #[test]
    fn a_hum_that_is_added_has_to_be_in_what_was_measured() {
        let time: Vec<f64> = (0..4000).map(|row| 1e-3 * f64::from(row)).collect();
        let hum = |size: f64| -> Vec<f64> {
            let at = |time: &f64| size * (TAU * 50.0 * time).sin();
            time.iter().map(at).collect()
        };
        let shows = |added: f64, measured: f64| {
            let noise = white(4000, 3).into_iter().zip(hum(measured - added));
            let stretch = Stretch {
                time: time.clone(),
                left: noise.map(|(noise, hum)| noise + hum).collect(),
                beside: hum(added),
            };
            line_shows(&[stretch], 50.0)
        };
        assert!(shows(0.5, 0.5) && shows(0.5, 0.4));
        // There is none, or less than half of it; and what noise hides is not seen.
        assert!(!shows(0.5, 0.0) && !shows(0.5, 0.2) && !shows(0.05, 0.05));
        assert!(!line_shows(&[], 50.0));
    }
}
