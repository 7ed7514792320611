//! What the residual may depend on.

use super::spectrum::Spectrum;
use crate::diagnose::statistics::rows::{rate, standardised, stretches};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Longest lag that is looked at, as a fraction of the record and in rows.
const LONGEST_LAG: (usize, usize) = (50, 200);
/// Bins in which means are taken: a few see smooth functions best, many see ripples.
const BINS: [usize; 2] = [16, 96];
/// Fewest rows in a bin.
const BIN_ROWS: usize = 10;

/// What a fit left over in the rows that were fitted, and what is known about those rows; records one after another.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// Measured less simulated, for each channel.
    pub channels: &'a [&'a [f64]],
    /// The row at which each record starts, from 0 upwards.
    pub starts: &'a [usize],
    /// Time of each row, s; it rises within a record.
    pub time: &'a [f64],
    /// The command in each row.
    pub command: &'a [f64],
    /// Other signals and their names: simulated spool, pressures, x·Δp, squared flow, temperature.
    pub known: &'a [(&'a str, &'a [f64])],
}

/// Signals over the rows.
pub(super) struct Signals {
    /// Names and values, standardised.
    pub(super) all: Vec<(String, Vec<f64>)>,
    command: Vec<f64>,
    pub(super) rate: Vec<f64>,
    pub(super) magnitude: Vec<f64>,
    lags: usize,
    /// Bins by the values of these are taken as well.
    binned: Vec<(String, Vec<f64>)>,
    starts: Vec<usize>,
    /// Mean time between rows, s.
    pub(super) row_seconds: f64,
}

impl Signals {
    pub(super) fn new(residuals: &Residuals) -> Self {
        let Residuals {
            starts,
            time,
            command,
            known,
            ..
        } = *residuals;
        let count = command.len();
        let rate = rate(command, time, starts);
        let each =
            |f: fn(f64) -> f64, from: &[f64]| -> Vec<f64> { from.iter().map(|&v| f(v)).collect() };
        let magnitude = each(f64::abs, command);
        let derived = [
            ("command", command.to_vec()),
            ("command^2", each(|u| u * u, command)),
            ("command^3", each(|u| u * u * u, command)),
            ("|command|", magnitude.clone()),
            ("command rate", rate.clone()),
            ("|command rate|", each(f64::abs, &rate)),
            ("command direction", each(direction, &rate)),
            ("time", time.to_vec()),
        ];
        let derived = derived.map(|(name, values)| (name.to_owned(), values));
        let known = known
            .iter()
            .map(|(name, values)| ((*name).to_owned(), values.to_vec()));
        let named = |name: &str, values: &[f64]| (name.to_owned(), values.to_vec());
        let rows: Vec<f64> = (0..count).map(|k| k as f64).collect();
        let mut binned = vec![
            named("command", command),
            named("command rate", &rate),
            named("time", &rows),
        ];
        binned.extend(known.clone());
        let seconds: f64 = stretches(time, starts)
            .iter()
            .map(|time| time[time.len() - 1] - time[0])
            .sum();
        Self {
            all: derived
                .into_iter()
                .chain(known)
                .map(|(name, values)| (name, standardised(&values)))
                .collect(),
            command: command.to_vec(),
            rate,
            magnitude,
            lags: (count / LONGEST_LAG.0).clamp(1, LONGEST_LAG.1),
            binned,
            starts: starts.to_vec(),
            row_seconds: seconds / (count - starts.len()).max(1) as f64,
        }
    }

    /// All signals, two to a transform.
    pub(super) fn pairs(&self, spectrum: &Spectrum) -> Vec<Pair> {
        let zero = vec![0.0; self.command.len()];
        let pair = |pair: &[(String, Vec<f64>)]| {
            let second = pair.get(1).map_or(&zero, |second| &second.1);
            let both = pair[0].1.iter().zip(second);
            let mut packed: Vec<Complex<f64>> = both.map(|(&a, &b)| Complex::new(a, -b)).collect();
            spectrum.forward(&mut packed);
            packed.iter_mut().for_each(|value| *value = value.conj());
            Pair {
                packed,
                lags: self.lags,
            }
        };
        self.all.chunks(2).map(pair).collect()
    }

    /// Rows sorted into bins by signals, and by the command and its direction together.
    pub(super) fn bins(&self) -> Vec<Bins> {
        let count = self.command.len();
        let mut all = Vec::new();
        for (name, values) in &self.binned {
            for bins in BINS {
                let bins = bins.min(count / BIN_ROWS);
                all.push(Bins::new(name, bins, &[], values));
            }
        }
        let directions: Vec<usize> = self
            .rate
            .iter()
            .map(|&r| (direction(r) + 1.0) as usize)
            .collect();
        all.push(Bins::new(
            "command and its direction",
            BINS[0],
            &directions,
            &self.command,
        ));
        if self.starts.len() > 1 {
            let ends = stretches(&self.command, &self.starts);
            let record = ends
                .iter()
                .enumerate()
                .flat_map(|(i, rows)| vec![i; rows.len()]);
            all.push(Bins::of("record", record.collect()));
        }
        all
    }
}

fn direction(rate: f64) -> f64 {
    if rate == 0.0 { 0.0 } else { rate.signum() }
}

/// Two signals whose correlations one transform gives.
pub(super) struct Pair {
    /// conj(F(a − i b)): times the residual's spectrum, it transforms back to the correlation with a as its real part
    /// and that with b as its imaginary part.
    packed: Vec<Complex<f64>>,
    lags: usize,
}

impl Pair {
    /// The correlation coefficients of largest magnitude, with their signs, over lags up to the longest either way.
    pub(super) fn largest_correlations(
        &self,
        spectrum: &Spectrum,
        residual: &[Complex<f64>],
    ) -> [f64; 2] {
        let mut product: Vec<Complex<f64>> = self
            .packed
            .iter()
            .zip(residual)
            .map(|(s, r)| s * r)
            .collect();
        spectrum.inverse(&mut product);
        let count = product.len();
        let near = product[..=self.lags]
            .iter()
            .chain(&product[count - self.lags..]);
        let larger = |most: f64, value: f64| {
            if value.abs() > most.abs() {
                value
            } else {
                most
            }
        };
        near.fold([0.0; 2], |most, value| {
            [larger(most[0], value.re), larger(most[1], value.im)]
        })
        .map(|most| most / count as f64)
    }
}

/// Rows sorted into bins.
pub(super) struct Bins {
    pub(super) name: String,
    of_row: Vec<u16>,
    /// One over the rows in each bin; 0 for none.
    weight: Vec<f64>,
}

impl Bins {
    /// About `bins` bins of equally many rows each by `values`, equal values in one, for each of `classes` anew.
    pub(super) fn new(name: &str, bins: usize, classes: &[usize], values: &[f64]) -> Self {
        let count = values.len();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let mut of_row = vec![0; count];
        let mut first = 0;
        for rank in 0..count {
            if values[order[rank]] != values[order[first]] {
                first = rank;
            }
            let class = classes.get(order[rank]).unwrap_or(&0);
            of_row[order[rank]] = class * bins + first * bins / count;
        }
        Self::of(name, of_row)
    }

    fn of(name: &str, of_row: Vec<usize>) -> Self {
        let bins = of_row.iter().max().map_or(0, |most| most + 1);
        let mut rows = vec![0.0; bins];
        for &bin in &of_row {
            rows[bin] += 1.0;
        }
        Self {
            name: name.to_owned(),
            of_row: of_row.into_iter().map(|bin| bin as u16).collect(),
            weight: rows
                .into_iter()
                .map(|rows: f64| if rows > 0.0 { 1.0 / rows } else { 0.0 })
                .collect(),
        }
    }

    /// The share of the variance that the means in the bins explain (Pearson's correlation ratio η²), for values with
    /// mean 0 and sum of squares 1.
    pub(super) fn ratio(&self, values: &[f64]) -> f64 {
        let mut sums = vec![0.0; self.weight.len()];
        for (&bin, value) in self.of_row.iter().zip(values) {
            sums[usize::from(bin)] += value;
        }
        sums.iter()
            .zip(&self.weight)
            .map(|(sum, weight)| sum * sum * weight)
            .sum()
    }
}

/// Cells into which the range of the command is cut.
const CELLS: usize = 1024;
/// Periods in the range of the command that are looked at. Fewer are a smooth function; more fall between the cells.
const PERIODS: std::ops::Range<usize> = 8..384;

/// The spectrum of the residual over the value of the command.
pub(super) struct Pattern {
    transform: Arc<dyn Fft<f64>>,
    cell: Vec<u16>,
    range: f64,
}

impl Pattern {
    pub(super) fn new(command: &[f64]) -> Self {
        let low = command.iter().copied().fold(f64::INFINITY, f64::min);
        let high = command.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = (high - low).max(f64::MIN_POSITIVE);
        let cell = |u: &f64| (((u - low) / range * CELLS as f64) as u16).min(CELLS as u16 - 1);
        Self {
            transform: FftPlanner::new().plan_fft_forward(CELLS),
            cell: command.iter().map(cell).collect(),
            range,
        }
    }

    /// The share of the variance of `values` (mean 0, sum of squares 1) that a sine of each number of periods explains.
    pub(super) fn power(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = vec![Complex::new(0.0, 0.0); CELLS];
        for (&cell, value) in self.cell.iter().zip(values) {
            sums[usize::from(cell)] += value;
        }
        self.transform.process(&mut sums);
        let scale = 2.0 / values.len() as f64;
        PERIODS.map(|k| sums[k].norm_sqr() * scale).collect()
    }

    /// The largest power against its level, and where it is.
    pub(super) fn peak(power: &[f64], level: &[f64]) -> (f64, usize) {
        let ratio =
            |(i, (power, level)): (usize, (&f64, &f64))| (power / level.max(f64::MIN_POSITIVE), i);
        let each = power.iter().zip(level).enumerate().map(ratio);
        each.fold(
            (0.0, 0),
            |most, ratio| if ratio.0 > most.0 { ratio } else { most },
        )
    }

    pub(super) fn name(&self, period: usize) -> String {
        let step = self.range / (PERIODS.start + period) as f64;
        format!("command in steps of {step:.3}")
    }
}
