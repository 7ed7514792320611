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
/// Bisections of the interval of two frequencies in which a limit is crossed.
const BISECTIONS: usize = 14;
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
        Some(Self {
            amplitude,
            amplitude_limit: sweep.crossing(&points, |point| point.gain - 10.0 * 0.5f64.log10()),
            phase_limit: sweep.crossing(&points, |point| point.phase + 90.0),
            points,
        })
    }
}

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
    fn crossing(&self, points: &[Point], excess: impl Fn(&Point) -> f64) -> Option<f64> {
        let after = points.iter().position(|point| excess(point) <= 0.0)?;
        let (mut low, mut high) = (points[after.checked_sub(1)?], points[after]);
        for _ in 0..BISECTIONS {
            let middle = (low.frequency * high.frequency).sqrt();
            let point = self.at(middle, 0.5 * (low.phase + high.phase));
            match excess(&point) > 0.0 {
                true => low = point,
                false => high = point,
            }
        }
        Some((low.frequency * high.frequency).sqrt())
    }
}
