//! What goes on swinging where the command rests: no noise, but a limit cycle, or a disturbance that has a frequency.

use super::moments::mean_square;
use crate::diagnose::statistics::line::strongest_period;

/// Share of what is left in the rests that goes up and down in time, at least.
const SHARE: f64 = 0.8;
/// It is so many times the noise that neighbouring rows show, at least.
const STRONG: f64 = 5.0;
/// Periods over which it keeps its phase.
const PERIODS: f64 = 4.0;
/// Harmonics of it that count.
const HARMONICS: usize = 3;

/// A swing about what the command asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Standard deviation, in the channel's unit.
    pub deviation: f64,
    /// Hz.
    pub frequency: f64,
}

/// The swing that rests are full of; `None` where they are quiet. `noise` is the standard deviation that neighbouring rows show,
/// which are `interval` seconds apart.
pub(super) fn of(rests: &[Vec<f64>], noise: f64, interval: f64) -> Option<Swing> {
    let all = mean_square(&rests.concat());
    if all <= (STRONG * noise).powi(2) {
        return None;
    }
    let rows: usize = rests.iter().map(Vec::len).sum();
    let mut swinging = 0.0;
    let mut periods: Vec<f64> = Vec::new();
    for rest in rests {
        let Some(period) = strongest_period(rest) else {
            continue;
        };
        periods.push(period);
        let pieces = (rest.len() as f64 / (PERIODS * period)).round().max(1.0) as usize;
        let edge = |piece: usize| piece * rest.len() / pieces;
        for piece in 0..pieces {
            swinging += in_time(&rest[edge(piece)..edge(piece + 1)], period);
        }
    }
    periods.sort_by(f64::total_cmp);
    (swinging >= SHARE * all * rows as f64).then(|| Swing {
        deviation: all.sqrt(),
        frequency: 1.0 / (periods[periods.len() / 2] * interval),
    })
}

/// The sum of squares of what of some rows has this period, and its harmonics.
fn in_time(rows: &[f64], period: f64) -> f64 {
    let mut sum = 0.0;
    for harmonic in 1..=HARMONICS {
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (k, value) in rows.iter().enumerate() {
            let angle = std::f64::consts::TAU * harmonic as f64 * k as f64 / period;
            cosine += value * angle.cos();
            sine += value * angle.sin();
        }
        sum += 2.0 * (cosine * cosine + sine * sine) / rows.len() as f64;
    }
    sum
}
