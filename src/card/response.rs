//! The frequency response at an amplitude.

use super::bench::Bench;
use std::f64::consts::{PI, TAU};

/// Commands in a period of a sine.
const ROWS: usize = 96;
/// Periods that are correlated.
const MEASURED: usize = 2;
/// Periods that settle: at least the first, at most the third, and as many as the second of the slowest time constants.
const SETTLING: (f64, f64, f64) = (3.0, 10.0, 400.0);
/// Frequencies from the first to the second, relative to the corner of the loop.
const RANGE: (f64, f64) = (0.02, 50.0);
/// How many there are.
const POINTS: usize = 60;
/// How often a limit is sought at most between two frequencies, and the share of a frequency to which it is found.
const ROUNDS: usize = 20;
const PRECISION: f64 = 1e-6;
/// The first step from the limit of one valve to that of another, in the logarithm of the frequency.
const STEP: f64 = 0.01;
/// Gain (dB) beyond which nobody looks.
const END: f64 = -24.0;

/// The response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Amplitude of the spool over its amplitude at low frequency, dB.
    pub gain: f64,
    /// Phase against the command, degrees.
    pub phase: f64,
}

/// The spool's response to sines of one amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Amplitude of the command, % of full scale.
    pub amplitude: f64,
    /// Frequencies rising, the phase without jumps.
    pub points: Vec<Point>,
    /// The lowest frequency at which the gain has fallen by 3 dB, Hz.
    pub amplitude_limit: Option<f64>,
    /// The lowest frequency at which the phase has fallen to −90°, Hz.
    pub phase_limit: Option<f64>,
}

impl Response {
    /// The response to sines of `amplitude` % of full scale; `None` where nothing moves the spool.
    pub(super) fn of(bench: &Bench, amplitude: f64) -> Option<Self> {
        let command = 0.01 * amplitude * bench.structure.full_scale;
        let corner = corner(bench, command)?;
        let mut sweep = Sweep {
            bench,
            command,
            low: 0.0,
        };
        let ratio = RANGE.1 / RANGE.0;
        let share = |k: usize| k as f64 / (POINTS - 1) as f64;
        let frequency = |k| corner * RANGE.0 * ratio.powf(share(k));
        sweep.low = sweep.at(frequency(0), 0.0).gain;
        let mut points: Vec<Point> = Vec::new();
        for k in 0..POINTS {
            let near = points.last().map_or(0.0, |point| point.phase);
            let point = sweep.at(frequency(k), near);
            if !point.gain.is_finite() {
                break;
            }
            points.push(point);
            if point.gain < END {
                break;
            }
        }
        let [amplitude_limit, phase_limit] = LIMITS.map(|excess| sweep.crossing(&points, excess));
        Some(Self {
            amplitude,
            amplitude_limit,
            phase_limit,
            points,
        })
    }

    /// The response of a valve that differs little from this one's: its limits, sought near these, and no points.
    pub(super) fn near(&self, bench: &Bench) -> Option<Self> {
        let command = 0.01 * self.amplitude * bench.structure.full_scale;
        let corner = corner(bench, command)?;
        let mut sweep = Sweep {
            bench,
            command,
            low: 0.0,
        };
        let range = [corner * RANGE.0, corner * RANGE.1];
        sweep.low = sweep.at(range[0], 0.0).gain;
        let limit = |known: Option<f64>, excess| sweep.crossing_near(known?, range, excess);
        Some(Self {
            amplitude: self.amplitude,
            points: Vec::new(),
            amplitude_limit: limit(self.amplitude_limit, LIMITS[0]),
            phase_limit: limit(self.phase_limit, LIMITS[1]),
        })
    }
}

/// How far a point is above the limit: of the gain at −3 dB, and of the phase at −90°.
const LIMITS: [fn(&Point) -> f64; 2] = [
    |point| point.gain - HALF_POWER,
    |point| point.phase - QUARTER_TURN,
];
/// 10 log10 ½, dB.
const HALF_POWER: f64 = -10.0 * std::f64::consts::LOG10_2;
const QUARTER_TURN: f64 = -90.0;

/// Where the loop begins to fall behind a sine of this amplitude, Hz.
fn corner(bench: &Bench, command: f64) -> Option<f64> {
    let [gain, time_constant, saturation] = bench.actuator()?;
    let natural = (gain / time_constant).sqrt().min(gain);
    Some(natural.min(gain * saturation / command) / TAU)
}

/// Sines of one amplitude.
struct Sweep<'a> {
    bench: &'a Bench,
    /// Amplitude, in the unit of the command.
    command: f64,
    /// Gain at low frequency, dB.
    low: f64,
}

impl Sweep<'_> {
    /// The response at `frequency`, with the phase that is nearest to `near`.
    fn at(&self, frequency: f64, near: f64) -> Point {
        let settling = (SETTLING.1 * self.bench.slowest() * frequency).ceil();
        let settling = settling.clamp(SETTLING.0, SETTLING.2) as usize * ROWS;
        let measured = MEASURED * ROWS;
        let angle = |k: usize| TAU * (k % ROWS) as f64 / ROWS as f64;
        let commands: Vec<f64> = (0..settling + measured)
            .map(|k| self.command * angle(k).sin())
            .collect();
        let outputs = self.bench.run(&commands, 1.0 / (frequency * ROWS as f64));
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (k, output) in outputs.iter().enumerate().skip(settling) {
            sine += output[0] * angle(k).sin();
            cosine += output[0] * angle(k).cos();
        }
        let gain = 2.0 * sine.hypot(cosine) / (measured as f64 * self.command);
        // The command goes in steps: their first harmonic is smaller than the sine and half a step late.
        let half_step = PI / ROWS as f64;
        let steps = half_step.sin() / half_step;
        let phase = cosine.atan2(sine).to_degrees() + half_step.to_degrees();
        Point {
            frequency,
            gain: 20.0 * (gain / steps).log10() - self.low,
            phase: phase - 360.0 * ((phase - near) / 360.0).round(),
        }
    }

    /// The lowest frequency at which `excess` is no longer positive.
    fn crossing(&self, points: &[Point], excess: fn(&Point) -> f64) -> Option<f64> {
        let after = points.iter().position(|point| excess(point) <= 0.0)?;
        let ends = [points[after.checked_sub(1)?], points[after]];
        Some(self.between(ends, excess))
    }

    /// The frequency nearest to `known` at which `excess` is no longer positive, inside of `range`.
    fn crossing_near(&self, known: f64, range: [f64; 2], excess: fn(&Point) -> f64) -> Option<f64> {
        let mut from = self.at(known, QUARTER_TURN);
        let rises = excess(&from) > 0.0;
        let mut step = if rises { STEP } else { -STEP };
        loop {
            let next = self.at(from.frequency * f64::exp(step), from.phase);
            if !(range[0]..range[1]).contains(&next.frequency) || !next.gain.is_finite() {
                return None;
            }
            if (excess(&next) > 0.0) != rises {
                let ends = if rises { [from, next] } else { [next, from] };
                return (ends[0].gain >= END).then(|| self.between(ends, excess));
            }
            (from, step) = (next, 2.0 * step);
        }
    }

    /// Where between two points `excess` falls below zero: regula falsi over the logarithm of the frequency, in which the
    /// height of a side that stays twice in a row is halved (Illinois).
    fn between(&self, [mut low, mut high]: [Point; 2], excess: fn(&Point) -> f64) -> f64 {
        let (mut above, mut below) = (excess(&low), excess(&high));
        let mut moved_low = None;
        for _ in 0..ROUNDS {
            let width = (high.frequency / low.frequency).ln();
            if width <= PRECISION || below == 0.0 {
                break;
            }
            let share = (above / (above - below)).clamp(0.01, 0.99);
            let frequency = low.frequency * (share * width).exp();
            let point = self.at(frequency, 0.5 * (low.phase + high.phase));
            let found = excess(&point);
            let moves_low = found > 0.0;
            let shrink = if moved_low == Some(moves_low) {
                0.5
            } else {
                1.0
            };
            moved_low = Some(moves_low);
            match moves_low {
                true => (low, above, below) = (point, found, shrink * below),
                false => (high, below, above) = (point, found, shrink * above),
            }
        }
        let share = above / (above - below);
        low.frequency * (high.frequency / low.frequency).powf(share)
    }
}
