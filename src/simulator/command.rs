//! Commands that excite a valve: rests, steps, triangles, chirps and multisines.

use super::valve::FULL_SCALE;
use crate::record::HOLD_OUT;
use crate::{Error, Result};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// What is commanded. All but [`Command::Samples`] begin with a rest, excite at several amplitudes up to 90 % of full
/// scale, and do so again, with a rest and with other amplitudes, in the part that is held out ([`HOLD_OUT`]).
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Steps, triangles both ways, chirps and multisines.
    Bench,
    /// Sines of many frequencies at once, with random phases.
    Multisine,
    /// Sines of rising frequency.
    Chirp,
    /// Steps of both signs and many sizes.
    Steps,
    /// Triangles both ways at two rates.
    Triangle,
    /// These values, V, one a sample.
    Samples(Vec<f64>),
}

impl Command {
    /// Those that are drawn.
    pub const DRAWN: [Self; 5] = [
        Self::Bench,
        Self::Multisine,
        Self::Chirp,
        Self::Steps,
        Self::Triangle,
    ];

    /// Its name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Bench => "bench",
            Self::Multisine => "multisine",
            Self::Chirp => "chirp",
            Self::Steps => "steps",
            Self::Triangle => "triangle",
            Self::Samples(_) => "samples",
        }
    }

    /// The held command in V at `rows` rows, `interval` s apart.
    pub(super) fn draw(&self, rows: usize, interval: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let fitted = (rows as f64 * (1.0 - HOLD_OUT)).round() as usize;
        let mut command = match self {
            Self::Samples(values) => return values.clone(),
            Self::Bench => [bench(), bench_again()],
            Self::Multisine => repeated(|share| Part::Multisine(share, 50.0)),
            Self::Chirp => repeated(|share| Part::Chirp(share, 1.0, 80.0 - 60.0 * share)),
            Self::Steps => repeated(|share| Part::Steps(8, share)),
            Self::Triangle => [triangles(1.0), triangles(0.8)],
        }
        .into_iter()
        .zip([fitted, rows - fitted])
        .flat_map(|(parts, rows)| block(&parts, rows, interval, rng))
        .collect::<Vec<f64>>();
        // What a controller would be told.
        command
            .iter_mut()
            .for_each(|u| *u = (*u * 1e3).round() / 1e3);
        command
    }
}

impl Display for Command {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Command {
    type Err = Error;

    /// # Errors
    /// A name that is none of [`Command::DRAWN`].
    fn from_str(text: &str) -> Result<Self> {
        let found = Self::DRAWN.into_iter().find(|c| c.name() == text);
        found.ok_or_else(|| {
            let names: Vec<&str> = Self::DRAWN.iter().map(Self::name).collect();
            Error::input(
                format!("command {text:?}"),
                "is not known",
                format!("use one of {}", names.join(", ")),
            )
        })
    }
}

/// A part of a block. Amplitudes are shares of full scale.
enum Part {
    Rest,
    /// A level that is held long enough to see the noise.
    Hold(f64),
    /// So many levels of both signs, up to this amplitude, then zero.
    Steps(usize, f64),
    /// Up, down and back; first down where the amplitude is negative.
    Triangle(f64),
    /// Amplitude, then first and last frequency in Hz.
    Chirp(f64, f64, f64),
    /// Amplitude and highest frequency in Hz.
    Multisine(f64, f64),
}

/// Seconds, of a record of 8 s, and what happens then.
type Plan = Vec<(f64, Part)>;

fn bench() -> Plan {
    vec![
        (0.6, Part::Rest),
        (1.2, Part::Steps(12, 0.9)),
        (0.7, Part::Triangle(0.5)),
        (0.35, Part::Triangle(-0.9)),
        (0.4, Part::Chirp(0.08, 2.0, 80.0)),
        (0.4, Part::Chirp(0.3, 2.0, 50.0)),
        (0.4, Part::Chirp(0.85, 2.0, 30.0)),
        (0.25, Part::Hold(0.35)),
        (0.45, Part::Multisine(0.15, 60.0)),
        (0.45, Part::Multisine(0.8, 40.0)),
        (0.4, Part::Triangle(-0.06)),
    ]
}

fn bench_again() -> Plan {
    vec![
        (0.42, Part::Rest),
        (0.5, Part::Steps(6, 0.85)),
        (0.35, Part::Triangle(-0.6)),
        (0.15, Part::Triangle(0.25)),
        (0.25, Part::Chirp(0.12, 3.0, 70.0)),
        (0.25, Part::Chirp(0.7, 3.0, 30.0)),
        (0.28, Part::Multisine(0.5, 50.0)),
        (0.2, Part::Multisine(0.12, 60.0)),
    ]
}

/// The same part at three amplitudes, and at three others.
fn repeated(part: impl Fn(f64) -> Part) -> [Plan; 2] {
    [
        (0.6, 1.65, [0.1, 0.4, 0.9]),
        (0.42, 0.66, [0.6, 0.15, 0.85]),
    ]
    .map(|(rest, each, shares)| {
        let mut plan = vec![(rest, Part::Rest)];
        plan.extend(shares.map(|share| (each, part(share))));
        plan
    })
}

fn triangles(scale: f64) -> Plan {
    let slow = [0.3, -0.9, 0.1, 0.6].map(|share| (1.0, Part::Triangle(scale * share)));
    let fast = [-0.4, 0.9].map(|share| (0.4, Part::Triangle(scale * share)));
    let mut plan = vec![(0.6, Part::Rest)];
    plan.extend(slow.into_iter().chain(fast));
    plan
}

/// The longest that a rest need be, s, and the share of a block that it may take for it.
const REST: (f64, f64) = (0.42, 0.3);

/// `rows` rows of these parts, stretched to fit. Rests are not made shorter than the noise needs.
fn block(parts: &Plan, rows: usize, interval: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let seconds = rows as f64 * interval;
    let planned: f64 = parts.iter().map(|part| part.0).sum();
    let rest = (parts[0].0 / planned * seconds).max(REST.0.min(REST.1 * seconds));
    let stretch = (seconds - rest) / (planned - parts[0].0);
    let mut values = Vec::with_capacity(rows);
    let mut end = 0.0;
    for (index, (length, part)) in parts.iter().enumerate() {
        end += if index == 0 { rest } else { length * stretch };
        let until = match index + 1 == parts.len() {
            true => rows,
            false => ((end / interval).round() as usize).min(rows),
        };
        let count = until.saturating_sub(values.len());
        values.extend(
            part.draw(count, interval, rng)
                .iter()
                .map(|u| u * FULL_SCALE),
        );
    }
    values
}

impl Part {
    /// `count` values, as shares of full scale.
    fn draw(&self, count: usize, interval: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let seconds = count as f64 * interval;
        let size = rng.random_range(0.9..=1.0);
        let sign = if rng.random() { 1.0 } else { -1.0 };
        let rows = 0..count;
        match *self {
            Self::Rest => vec![0.0; count],
            Self::Hold(level) => vec![sign * size * level; count],
            Self::Steps(levels, high) => steps(levels, size * high, sign, count, rng),
            Self::Triangle(high) => {
                let corner = |share: f64| 1.0 - (4.0 * (share - share.floor()) - 2.0).abs();
                rows.map(|k| size * high * corner(k as f64 / count as f64 + 0.25))
                    .collect()
            }
            Self::Chirp(high, from, to) => {
                let rate = (to / from).ln() / seconds;
                let angle = |t: f64| TAU * from / rate * (rate * t).exp_m1();
                rows.map(|k| sign * size * high * angle(k as f64 * interval).sin())
                    .collect()
            }
            Self::Multisine(high, to) => {
                let base = 1.0 / seconds;
                let lines = ((to / base) as usize).clamp(1, 64);
                // Where the part is long its lines are spread out, the lowest still being one period of it.
                let spread = (to / base / lines as f64).max(1.0);
                let lines: Vec<[f64; 2]> = (1..=lines)
                    .map(|i| [(i as f64 * spread).floor(), rng.random_range(0.0..TAU)])
                    .collect();
                let at = |k: usize| -> f64 {
                    let angle = TAU * k as f64 / count as f64;
                    lines
                        .iter()
                        .map(|[i, phase]| (i * angle + phase).sin())
                        .sum()
                };
                let sum: Vec<f64> = rows.map(at).collect();
                let peak = sum.iter().fold(1e-12, |peak: f64, y| peak.max(y.abs()));
                sum.iter().map(|y| size * high * y / peak).collect()
            }
        }
    }
}

/// Levels of both signs, from 5 % up to `high`, shuffled, each held for about the same time; then zero.
fn steps(levels: usize, high: f64, sign: f64, count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let low: f64 = 0.05;
    let size = |i: usize| low * (high / low).powf(i as f64 / (levels - 1) as f64);
    let mut heights: Vec<f64> = (0..levels).map(size).collect();
    for i in (1..levels).rev() {
        heights.swap(i, rng.random_range(0..=i));
    }
    let mut ends: Vec<f64> = vec![0.0];
    for _ in 0..=levels {
        ends.push(ends[ends.len() - 1] + rng.random_range(0.7..1.3));
    }
    let whole = ends[levels + 1];
    let level = |k: usize| {
        let now = k as f64 / count as f64 * whole;
        let index = ends[1..=levels].iter().filter(|end| **end <= now).count();
        let sign = if index % 2 == 0 { sign } else { -sign };
        heights.get(index).map_or(0.0, |height| sign * height)
    };
    (0..count).map(level).collect()
}
