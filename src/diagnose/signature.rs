//! What gives an effect away: the residual of a model without it, over the signal that it depends on.

use super::identify::Known;
use super::residual::rate;
use super::{Compared, Refit};
use crate::evaluate::problem::Series;
use crate::model::{Output, Structure};

/// Bins of a signature; each holds equally many rows.
const BINS: usize = 28;
/// Fewest rows in a bin, on average.
const BIN_ROWS: usize = 12;
/// Of the rows of a bin, these shares lie below and above what is called its spread: one standard deviation of a normal
/// distribution.
const SPREAD: (f64, f64) = (0.16, 0.84);

/// The residual of a model over one signal, beside what other models add to that model's prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// The channel whose residual it is.
    pub output: Output,
    /// The signal.
    pub signal: String,
    /// The signal's unit.
    pub unit: String,
    /// Share of the residual's square that the means of the bins make up.
    pub explained: f64,
    /// Rows that lie next to each other in the signal.
    pub bins: Vec<Bin>,
}

/// Rows of nearly the same value of a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Bin {
    /// Mean of the signal.
    pub signal: f64,
    /// Median of the residual, in the channel's unit.
    pub median: f64,
    /// Below and above it lie 16 % and 84 % of the rows.
    pub spread: (f64, f64),
    /// Median of what each other model adds to the prediction, in the channel's unit.
    pub added: Vec<f64>,
    rows: f64,
    /// Means of the residual, and of what each other model adds.
    mean: f64,
    mean_added: Vec<f64>,
}

/// The signatures of `base` on `records`, where `models` are other fits of it: first over the signal through which the first
/// of them accounts for most of the residual (without one, over that on which the residual depends most), then over that
/// where the first two part most, if there are two.
pub fn signatures(base: &Refit, models: &[&Refit], records: &[Series]) -> Vec<Signature> {
    let compared = Compared::all(&base.structure, &base.values(), records);
    let others: Vec<Vec<Compared>> = models
        .iter()
        .map(|model| Compared::all(&model.structure, &model.values(), records))
        .collect();
    let mut signals = signals(&compared, &base.structure);
    signals.extend(oscillation(base, models, &compared));
    let mut all: Vec<Signature> = Vec::new();
    for &output in &base.structure.observed {
        let simulated = |compared: &[Compared]| -> Vec<f64> {
            let rows = compared.iter().flat_map(|one| one.rows(output));
            rows.map(|(_, _, simulated)| simulated).collect()
        };
        let own = simulated(&compared);
        let rows = compared.iter().flat_map(|one| one.rows(output));
        let residual: Vec<f64> = rows.map(|row| row.1 - row.2).collect();
        let added: Vec<Vec<f64>> = others
            .iter()
            .map(|other| {
                let pairs = simulated(other).into_iter().zip(&own);
                pairs.map(|(with, without)| with - without).collect()
            })
            .collect();
        for (signal, unit, values) in &signals {
            let bins = bins(values, &residual, &added);
            let square = residual.iter().map(|r| r * r).sum::<f64>();
            let means = bins.iter().map(|bin| bin.rows * bin.mean * bin.mean);
            all.push(Signature {
                output,
                signal: (*signal).to_owned(),
                unit: unit.clone(),
                explained: means.sum::<f64>() / square.max(f64::MIN_POSITIVE),
                bins,
            });
        }
    }
    all.retain(|one| one.bins.len() > 1);
    // Channels of different units are compared by shares of their residual's square.
    let share = |one: &Signature, left: &dyn Fn(&Bin) -> f64| -> f64 {
        let square = |of: &dyn Fn(&Bin) -> f64| -> f64 {
            one.bins.iter().map(|bin| bin.rows * of(bin).powi(2)).sum()
        };
        let means = square(&|bin| bin.mean).max(f64::MIN_POSITIVE);
        square(left) / means * one.explained
    };
    // Whatever is slow is smooth over time: that says little of what it depends on.
    let weight = |one: &Signature| if one.signal == "time" { 0.5 } else { 1.0 };
    let accounted = |one: &Signature| match models.is_empty() {
        true => weight(one) * one.explained,
        false => weight(one) * (one.explained - share(one, &|bin| bin.mean - bin.mean_added[0])),
    };
    let mut found: Vec<Signature> = Vec::new();
    found.extend(largest(&mut all, &accounted));
    if models.len() > 1 {
        let apart = |one: &Signature| share(one, &|bin| bin.mean_added[0] - bin.mean_added[1]);
        let parting = |one: &Signature| weight(one) * apart(one);
        found.extend(largest(&mut all, &parting));
    }
    found
}

/// Takes out the signature for which `of` is largest; the first of several.
fn largest(all: &mut Vec<Signature>, of: &dyn Fn(&Signature) -> f64) -> Option<Signature> {
    let values: Vec<f64> = all.iter().map(of).collect();
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let place = values.iter().position(|value| *value == most)?;
    Some(all.remove(place))
}

/// Name, unit and values of what a residual may depend on, over the rows that count.
fn signals(compared: &[Compared], structure: &Structure) -> Vec<(&'static str, String, Vec<f64>)> {
    let known = Known::new(compared);
    let command = &structure.command_unit;
    let spool = structure.unit(Output::Spool);
    let command_rate = rate(&known.command, &known.time, &known.starts);
    let mut list = vec![
        ("command", command.clone(), known.command),
        ("command rate", format!("{command}/s"), command_rate),
        ("time", "s".to_owned(), known.time.clone()),
    ];
    for (name, values) in known.signals {
        let unit = match name {
            "simulated spool" => spool.to_owned(),
            "flow^2" => "(L/min)²".into(),
            "supply pressure" | "load pressure" => "bar".into(),
            "temperature" => "degC".into(),
            _ => format!("{spool} bar"),
        };
        if name == "simulated spool" {
            let speed = rate(&values, &known.time, &known.starts);
            list.push(("simulated spool speed", format!("{spool}/s"), speed));
        }
        list.push((name, unit, values));
    }
    list
}

/// Where in its period the oscillation is that the first of `models` adds to `base`, if it adds one.
fn oscillation(
    base: &Refit,
    models: &[&Refit],
    compared: &[Compared],
) -> Option<(&'static str, String, Vec<f64>)> {
    let mut own = models.first()?.parameters.iter();
    let known = |name: &str| base.parameters.iter().any(|p| p.name == name);
    let frequency = own.find(|p| p.unit == "Hz" && !known(&p.name))?.start;
    let time = Known::new(compared).time;
    let phase = time.iter().map(|time| (time * frequency).fract());
    Some((
        "phase of the oscillation",
        "periods".into(),
        phase.collect(),
    ))
}

/// Bins of equally many rows by `values`, equal values in one.
fn bins(values: &[f64], residual: &[f64], added: &[Vec<f64>]) -> Vec<Bin> {
    let count = values.len();
    let bins = BINS.min(count / BIN_ROWS).max(1);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut result = Vec::new();
    let mut from = 0;
    while from < count {
        // To the end of a share of the rows, and on over equal values.
        let share = from * bins / count + 1;
        let mut to = (share * count).div_ceil(bins).clamp(from + 1, count);
        while to < count && values[order[to]] == values[order[to - 1]] {
            to += 1;
        }
        let rows = &order[from..to];
        let mean = |of: &[f64]| rows.iter().map(|&row| of[row]).sum::<f64>() / rows.len() as f64;
        let sorted = |of: &[f64]| {
            let mut sorted: Vec<f64> = rows.iter().map(|&row| of[row]).collect();
            sorted.sort_by(f64::total_cmp);
            sorted
        };
        let at = |sorted: &[f64], share: f64| {
            sorted[((sorted.len() - 1) as f64 * share).round() as usize]
        };
        let own = sorted(residual);
        result.push(Bin {
            signal: mean(values),
            median: at(&own, 0.5),
            spread: (at(&own, SPREAD.0), at(&own, SPREAD.1)),
            added: added.iter().map(|of| at(&sorted(of), 0.5)).collect(),
            mean_added: added.iter().map(|of| mean(of)).collect(),
            rows: rows.len() as f64,
            mean: mean(residual),
        });
        from = to;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::simulated::white;

    #[test]
    fn bins_hold_equally_many_rows_and_equal_values_stay_together() {
        let values: Vec<f64> = (0..1000).map(|k| f64::from(k % 500)).collect();
        let residual = vec![1.0; 1000];
        let all = bins(&values, &residual, &[]);
        assert_eq!(all.len(), BINS);
        assert!(all.iter().all(|bin| (bin.rows - 36.0).abs() <= 2.0));
        assert_eq!(all.iter().map(|bin| bin.rows).sum::<f64>(), 1000.0);
        let at_rest = bins(&vec![0.0; 1000], &residual, &[]);
        assert_eq!(at_rest.len(), 1);
    }

    #[test]
    fn a_bin_shows_the_residual_and_what_the_models_add() {
        let values: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let noise = white(4000, 1);
        let residual: Vec<f64> = values.iter().zip(noise).map(|(x, e)| 3.0 * x + e).collect();
        let added = vec![values.iter().map(|x| 2.0 * x).collect()];
        for bin in bins(&values, &residual, &added) {
            assert!((bin.median - 3.0 * bin.signal).abs() < 0.4, "{bin:?}");
            assert!((bin.spread.1 - bin.spread.0 - 2.0).abs() < 0.7, "{bin:?}");
            assert!((bin.added[0] - 2.0 * bin.signal).abs() < 2e-3, "{bin:?}");
        }
    }
}
