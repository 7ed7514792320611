//! The frequency response as it was measured: from any command that is rich enough, by the ratio of the cross spectrum to the
//! command's own, where both are coherent.

use super::reading::{Reading, short};
use crate::card::quantity::AMPLITUDES;
use crate::card::response::Point;
use crate::model::Hold;
use crate::record::Channel;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// Points in a decade.
const POINTS: f64 = 24.0;
/// Fewest lines of the spectrum in a point: fewer are always coherent.
const LINES: usize = 8;
/// A point counts where the share of the output's power that follows the command is at least this.
const COHERENT: f64 = 0.8;
/// Share of a record over which its ends are faded out.
const FADED: f64 = 0.05;
/// The gain at low frequency has to be known so many times below a limit.
const BELOW: f64 = 4.0;
/// The amplitude of a command is one if that of no part of the record is so many times that of another.
const STEADY: (usize, f64) = (12, 2.0);
/// How far an amplitude may be from that of a figure.
const NEAR: f64 = 0.25;
/// Intervals so many times the usual one leave a gap.
const GAP: f64 = 3.0;

/// The response at one frequency, with what noise leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    frequency: f64,
    /// Output over command.
    response: Complex<f64>,
    /// Standard deviation of its magnitude, and of its phase in rad, as a share.
    deviation: f64,
}

/// The response of one record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Empirical {
    lines: Vec<Line>,
    /// Between two rows, s.
    interval: f64,
    /// Amplitude of a sine of the command's power, % of full scale.
    pub(super) amplitude: f64,
    channel: Channel,
    /// Duration, s.
    length: f64,
}

impl Empirical {
    /// The response of these columns of time, command and output; why there is none otherwise.
    pub(super) fn of(channel: Channel, columns: [&[f64]; 3], full: f64) -> Result<Self, String> {
        let [time, command, output] = columns;
        let count = time.len();
        let length = time[count - 1] - time[0];
        let interval = length / (count - 1) as f64;
        if time
            .windows(2)
            .any(|pair| pair[1] - pair[0] > GAP * interval)
        {
            return Err("the record has gaps in time, and so no spectrum".into());
        }
        let grid = |values: &[f64]| even(time, values, interval);
        let (command, output) = (grid(command), grid(output));
        let amplitude = amplitude(&command)?;
        let [u, y] = [&command, &output].map(|values| spectrum(values));
        let lines = lines(&u, &y, 1.0 / (interval * count as f64));
        if lines.is_empty() {
            return Err("the output is nowhere coherent with the command".into());
        }
        Ok(Self {
            lines,
            interval,
            amplitude: 100.0 * amplitude / full,
            channel,
            length,
        })
    }

    /// Whether the command's amplitude is near this one, %.
    pub(super) fn is_at(&self, amplitude: f64) -> bool {
        (self.amplitude - amplitude).abs() <= NEAR * amplitude
    }

    /// Why a figure of another amplitude is none of this response.
    pub(super) fn elsewhere(&self) -> String {
        match AMPLITUDES.into_iter().any(|one| self.is_at(one)) {
            true => format!(
                "the command's amplitude is {:.0} % of full scale",
                self.amplitude
            ),
            false => {
                let [a, b, c] = AMPLITUDES;
                let own = self.amplitude;
                format!(
                    "the command's amplitude is {own:.0} % of full scale, near none of {a}, {b}, {c} %"
                )
            }
        }
    }

    /// Gain relative to low frequency and phase; a command that is held between rows comes half of one late, which is not the
    /// valve's.
    pub(super) fn points(&self, hold: Hold) -> Vec<Point> {
        let low = self.lines[0].response.norm();
        // An output that falls where the command rises is that of a meter the other way round.
        let sign = self.lines[0].response.re.signum();
        let mut near = 0.0;
        let point = |line: &Line| {
            let late = PI * line.frequency * self.interval;
            let (gain, phase) = match hold {
                Hold::Held => (late / late.sin(), late),
                Hold::Interpolated | Hold::BetweenJumps => ((late / late.sin()).powi(2), 0.0),
            };
            let response = line.response * sign;
            let angle = (response.arg() + phase).to_degrees();
            let phase = angle - 360.0 * ((angle - near) / 360.0_f64).round();
            near = phase;
            Point {
                frequency: line.frequency,
                gain: 20.0 * (response.norm() * gain / low).log10(),
                phase,
            }
        };
        self.lines.iter().map(point).collect()
    }

    pub(super) fn amplitude_limit(&self, hold: Hold) -> Result<Reading, String> {
        self.crossing(
            hold,
            "-3 dB",
            |point| point.gain - 10.0 * 0.5f64.log10(),
            20.0 / 10f64.ln(),
        )
    }

    pub(super) fn phase_limit(&self, hold: Hold) -> Result<Reading, String> {
        self.crossing(hold, "-90°", |point| point.phase + 90.0, 1f64.to_degrees())
    }

    /// Where `excess` is no longer positive, between two points. `unit` is what a deviation of 1 changes it by.
    fn crossing(
        &self,
        hold: Hold,
        what: &str,
        excess: impl Fn(&Point) -> f64,
        unit: f64,
    ) -> Result<Reading, String> {
        let points = self.points(hold);
        let end = points[points.len() - 1].frequency;
        let values: Vec<f64> = points.iter().map(excess).collect();
        // Noise alone does not stay beyond the limit.
        let stays =
            |i: usize| values[i] <= 0.0 && values.get(i + 1).is_none_or(|&next| next <= 0.0);
        let after = (0..values.len()).find(|&i| stays(i)).ok_or_else(|| {
            format!(
                "the response is above {what} up to {} Hz, as far as it follows the command",
                short(end)
            )
        })?;
        let low = points[0].frequency;
        if after == 0 || points[after].frequency < BELOW * low {
            return Err(format!(
                "the response is known from {} Hz on, which is not far enough below {what}",
                short(low)
            ));
        }
        let logarithm = |i: usize| points[i].frequency.ln();
        let (x, next) = (logarithm(after - 1), logarithm(after));
        let share = values[after - 1] / (values[after - 1] - values[after]);
        let frequency = (x + share * (next - x)).exp();
        // The slope over some points: between two of them noise would decide.
        let (from, to) = (after.saturating_sub(3), (after + 2).min(points.len() - 1));
        let slope = (values[to] - values[from]) / (logarithm(to) - logarithm(from));
        let noise = unit
            * self.lines[after]
                .deviation
                .hypot(self.lines[after - 1].deviation)
                .hypot(self.lines[0].deviation);
        let half = 1.96 * frequency * noise / slope.abs();
        if !half.is_finite() || half > 0.5 * frequency {
            return Err(format!("the response is too noisy near {what}"));
        }
        let test = format!(
            "{} over command at {:.0} % of full scale, {} s",
            self.channel,
            self.amplitude,
            short(self.length)
        );
        Ok(Reading::around(frequency, half, test))
    }
}

/// `values` at even times: what lies between two rows is on the straight line.
fn even(time: &[f64], values: &[f64], interval: f64) -> Vec<f64> {
    let mut row = 0;
    (0..time.len())
        .map(|k| {
            let at = time[0] + interval * k as f64;
            while row + 2 < time.len() && time[row + 1] < at {
                row += 1;
            }
            let share = (at - time[row]) / (time[row + 1] - time[row]);
            values[row] + share.clamp(0.0, 1.0) * (values[row + 1] - values[row])
        })
        .collect()
}

/// The amplitude of a sine of as much power; an error where it changes along the record.
fn amplitude(command: &[f64]) -> Result<f64, String> {
    let mean = command.iter().sum::<f64>() / command.len() as f64;
    let power =
        |part: &[f64]| part.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / part.len() as f64;
    let parts = command.chunks(command.len().div_ceil(STEADY.0));
    let (least, most) = parts
        .map(power)
        .fold((f64::INFINITY, 0.0), |(least, most), one| {
            (one.min(least), one.max(most))
        });
    if most > STEADY.1.powi(2) * least {
        return Err(
            "the command's amplitude changes along the record: no response of one amplitude".into(),
        );
    }
    let largest = command.iter().map(|u| (u - mean).abs()).fold(0.0, f64::max);
    Ok((2.0 * power(command)).sqrt().min(largest))
}

/// The spectrum of `values` without their mean, their ends faded out.
fn spectrum(values: &[f64]) -> Vec<Complex<f64>> {
    let count = values.len();
    let mean = values.iter().sum::<f64>() / count as f64;
    let fade = |k: usize| {
        let end = k.min(count - 1 - k) as f64 / (FADED * count as f64);
        0.5 - 0.5 * (PI * end.min(1.0)).cos()
    };
    let mut all: Vec<Complex<f64>> = values
        .iter()
        .enumerate()
        .map(|(k, value)| Complex::new(fade(k) * (value - mean), 0.0))
        .collect();
    FftPlanner::new().plan_fft_forward(count).process(&mut all);
    all.truncate(count / 2);
    all
}

/// The response over bands of the spectra, from the lowest on as long as it is coherent.
fn lines(u: &[Complex<f64>], y: &[Complex<f64>], step: f64) -> Vec<Line> {
    let mut found = Vec::new();
    let mut from = 1;
    while from + LINES <= u.len() {
        let wide = (from as f64 * 10f64.powf(1.0 / POINTS)).ceil() as usize;
        let to = wide.max(from + LINES).min(u.len());
        let band = || u[from..to].iter().zip(&y[from..to]);
        let own: f64 = band().map(|(u, _)| u.norm_sqr()).sum();
        let output: f64 = band().map(|(_, y)| y.norm_sqr()).sum();
        let cross: Complex<f64> = band().map(|(u, y)| u.conj() * y).sum();
        let coherence = cross.norm_sqr() / (own * output);
        let frequency = (from..to)
            .zip(band())
            .map(|(k, (u, _))| k as f64 * u.norm_sqr())
            .sum::<f64>()
            / own;
        // A command that is strong in a few lines only is no more than those.
        let count = own.powi(2) / band().map(|(u, _)| u.norm_sqr().powi(2)).sum::<f64>();
        match coherence >= COHERENT {
            true => found.push(Line {
                frequency: step * frequency,
                response: cross / own,
                deviation: ((1.0 - coherence).max(0.0) / (2.0 * coherence * count)).sqrt(),
            }),
            // Below the command's lowest frequency nothing is coherent.
            false if found.is_empty() => {}
            false => break,
        }
        from = to;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    const RATE: f64 = 2000.0;

    /// A logarithmic chirp of this amplitude from 0.2 to 200 Hz in 20 s.
    fn chirp(amplitude: f64) -> [Vec<f64>; 2] {
        let (low, high, length) = (0.2, 200.0, 20.0);
        let ratio = f64::ln(high / low);
        let time: Vec<f64> = (0..(RATE * length) as usize)
            .map(|k| k as f64 / RATE)
            .collect();
        let phase = |t: f64| TAU * low * length / ratio * ((ratio * t / length).exp() - 1.0);
        let command = time.iter().map(|&t| amplitude * phase(t).sin()).collect();
        [time, command]
    }

    /// The answer of a first-order lag to a command that goes straight from row to row, exactly, with a delay of some rows.
    fn lag(command: &[f64], corner: f64, delay: usize, noise: f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let rate = TAU * corner / RATE;
        let decay = (-rate).exp();
        let mut state = 0.0;
        let mut last = 0.0;
        let delayed = std::iter::repeat_n(0.0, delay).chain(command.iter().copied());
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        delayed
            .take(command.len())
            .map(|u| {
                let slope = (u - last) / rate;
                state = decay * state + (1.0 - decay) * last + (u - last) - slope * (1.0 - decay);
                last = u;
                state + noise * normal()
            })
            .collect()
    }

    fn response([time, command]: &[Vec<f64>; 2], output: &[f64]) -> Result<Empirical, String> {
        Empirical::of(Channel::Spool, [time, command, output], 10.0)
    }

    #[test]
    fn a_lag_of_first_order_has_fallen_by_3_db_at_its_corner() {
        let record = chirp(2.5);
        let output = lag(&record[1], 20.0, 0, 0.02);
        let found = response(&record, &output).unwrap();
        assert!(
            found.is_at(25.0) && !found.is_at(5.0),
            "{}",
            found.amplitude
        );
        let limit = found.amplitude_limit(Hold::Interpolated).unwrap();
        println!("{limit:?}");
        assert!((limit.value - 20.0).abs() < 0.4, "{limit:?}");
        assert!(
            (limit.value - 20.0).abs() < limit.high - limit.low,
            "{limit:?}"
        );
        assert!(
            limit.low < limit.value && limit.high - limit.low < 2.0,
            "{limit:?}"
        );
        // A lag alone never gets to -90°.
        let never = found.phase_limit(Hold::Interpolated).unwrap_err();
        assert!(never.contains("above -90°"), "{never}");
    }

    #[test]
    fn a_lag_and_a_delay_are_at_90_degrees_where_both_add_up_to_it() {
        let record = chirp(2.5);
        let output = lag(&record[1], 20.0, 10, 0.02);
        let found = response(&record, &output).unwrap();
        let limit = found.phase_limit(Hold::Interpolated).unwrap();
        // atan(f / 20) + 2 π f 5 ms = π / 2.
        let (mut low, mut high) = (1.0, 100.0);
        for _ in 0..60 {
            let f: f64 = 0.5 * (low + high);
            match (f / 20.0).atan() + TAU * f * 0.005 < 0.5 * PI {
                true => low = f,
                false => high = f,
            }
        }
        println!("{limit:?} for {low}");
        assert!(
            (limit.value - low).abs() < 0.02 * low,
            "{limit:?} for {low}"
        );
        // Half a row is 0.25 ms of those 5.
        let held = found.phase_limit(Hold::Held).unwrap();
        assert!(held.value > limit.value);
    }

    #[test]
    fn what_is_not_rich_enough_gives_no_figure_but_a_reason() {
        let [time, command] = chirp(2.5);
        let slow = lag(&command, 500.0, 0, 0.02);
        let reason = response(&[time.clone(), command.clone()], &slow).unwrap();
        let reason = reason.amplitude_limit(Hold::Interpolated).unwrap_err();
        assert!(reason.contains("above -3 dB up to"), "{reason}");

        let tone: Vec<f64> = time.iter().map(|t| 2.5 * (TAU * 5.0 * t).sin()).collect();
        let answer = lag(&tone, 20.0, 0, 0.02);
        let single = response(&[time.clone(), tone], &answer);
        assert!(
            single
                .and_then(|one| one.amplitude_limit(Hold::Held))
                .is_err()
        );

        let mut random = ChaCha8Rng::seed_from_u64(5);
        let noise: Vec<f64> = time
            .iter()
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        let unrelated = response(&[time.clone(), command.clone()], &noise);
        assert!(
            unrelated
                .and_then(|one| one.amplitude_limit(Hold::Held))
                .is_err()
        );

        let swelling: Vec<f64> = command
            .iter()
            .zip(&time)
            .map(|(u, t)| u * (0.05 + t / 20.0))
            .collect();
        let reason = response(&[time.clone(), swelling.clone()], &swelling).unwrap_err();
        assert!(reason.contains("amplitude changes"), "{reason}");

        let mut gap = time;
        for time in &mut gap[20_000..] {
            *time += 1.0;
        }
        let reason = response(&[gap, command.clone()], &command).unwrap_err();
        assert!(reason.contains("gaps"), "{reason}");
    }
}
