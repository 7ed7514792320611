//! Signatures of effects: the residual of a model without it, over the signal that it depends on.

use super::added::{Added, Considered, Refit, first_causes};
use super::fitted::Fitted;
use super::known::{KnownRows, KnownSignal};
use super::simulation::{Compared, Trajectories, residual};
use super::statistics::rows::rate;
use super::verdict::Verdict;
use crate::evaluate::problem::Series;
use crate::evaluate::reference;
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

/// A model with what it gives for the fitted records.
struct Simulated {
    model: Refit,
    trajectories: Trajectories,
}

impl Simulated {
    fn new(model: &Refit, records: &[Series]) -> Self {
        Self {
            trajectories: reference::trajectories(&model.structure, &model.values(), records),
            model: model.clone(),
        }
    }
}

impl From<&Fitted> for Simulated {
    fn from(fitted: &Fitted) -> Self {
        let mut model = Refit::from(&fitted.problem);
        for (parameter, value) in model.parameters.iter_mut().zip(fitted.values.as_slice()) {
            parameter.set_nominal(*value);
        }
        Self {
            model,
            trajectories: fitted.simulated.fit.clone(),
        }
    }
}

/// The signatures of each effect of `added` that has a contest, on the fitted `records`: those of the model without it, beside
/// the result and the closest rival.
pub(super) fn of_effects(added: &[Added], records: &[Series]) -> Vec<Vec<Signature>> {
    let contests = added.iter().filter_map(|one| one.contest.as_ref());
    contests
        .map(|contest| {
            let rival = contest.rival.iter().map(|rival| &rival.refit);
            let models = std::iter::once(&contest.with).chain(rival);
            let models: Vec<Simulated> =
                models.map(|model| Simulated::new(model, records)).collect();
            signatures(&Simulated::new(&contest.without, records), &models, records)
        })
        .collect()
}

/// The signatures of what the base model leaves, beside the curve of free form, if there is one, and the effect that came
/// closest.
pub(super) fn of_residual(
    base: &Fitted,
    free_form: Option<&Fitted>,
    closest: Option<&Considered>,
    records: &[Series],
) -> Vec<Signature> {
    let mut models: Vec<Simulated> = free_form.map(Simulated::from).into_iter().collect();
    // Without a curve to compare it with, the closest effect must not choose the signal.
    if free_form.is_some() {
        let refit = closest.and_then(|one| one.refit.as_ref());
        models.extend(refit.map(|model| Simulated::new(model, records)));
    }
    signatures(&base.into(), &models, records)
}

/// Where something is missing that has no name: the effect that came closest to it as the first cause.
pub(super) fn closest(verdict: Verdict, considered: &[Considered]) -> Option<&Considered> {
    let first = first_causes(considered).into_iter();
    let mut first = first.filter(|_| verdict == Verdict::Unexplained);
    first.next().map(|(one, _)| one)
}

/// The signatures of `base` on `records`, where `models` are other fits of it: first over the signal through which the first
/// of them accounts for most of the residual (without one, over that on which the residual depends most), then over that
/// where the first two part most, if there are two.
fn signatures(base: &Simulated, models: &[Simulated], records: &[Series]) -> Vec<Signature> {
    let structure = &base.model.structure;
    let compared = Compared::all(records, &base.trajectories);
    let others: Vec<Vec<Compared>> = models
        .iter()
        .map(|model| Compared::all(records, &model.trajectories))
        .collect();
    let mut all: Vec<(f64, Signature)> = Vec::new();
    for &output in &structure.observed {
        let known = KnownRows::new(&Compared::measuring(&compared, output));
        let oscillation = models
            .first()
            .and_then(|model| oscillation(&base.model, &model.model, &known.time));
        let mut signals = signals(known, structure);
        signals.extend(oscillation);
        let simulated = |compared: &[Compared]| -> Vec<f64> {
            let rows = compared.iter().flat_map(|one| one.rows(output));
            rows.map(|(_, _, simulated)| simulated).collect()
        };
        let own = simulated(&compared);
        let residual = residual(&compared, output);
        let added: Vec<Vec<f64>> = others
            .iter()
            .map(|other| {
                let pairs = simulated(other).into_iter().zip(&own);
                pairs.map(|(with, without)| with - without).collect()
            })
            .collect();
        for signal in &signals {
            let bins = bins(&signal.values, &residual, &added);
            let square = residual.iter().map(|r| r * r).sum::<f64>();
            let means = bins.iter().map(|bin| bin.rows * bin.mean * bin.mean);
            let signature = Signature {
                output,
                signal: signal.name.into(),
                unit: signal.unit.clone(),
                explained: means.sum::<f64>() / square.max(f64::MIN_POSITIVE),
                bins,
            };
            all.push((signal.weight, signature));
        }
    }
    all.retain(|(_, one)| one.bins.len() > 1);
    // Channels of different units are compared by shares of their residual's square.
    let share = |one: &Signature, left: &dyn Fn(&Bin) -> f64| -> f64 {
        let square = |of: &dyn Fn(&Bin) -> f64| -> f64 {
            one.bins.iter().map(|bin| bin.rows * of(bin).powi(2)).sum()
        };
        let means = square(&|bin| bin.mean).max(f64::MIN_POSITIVE);
        square(left) / means * one.explained
    };
    let accounted = |one: &Signature| match models.is_empty() {
        true => one.explained,
        false => one.explained - share(one, &|bin| bin.mean - bin.mean_added[0]),
    };
    let mut found: Vec<Signature> = Vec::new();
    found.extend(largest(&mut all, &accounted));
    if models.len() > 1 {
        let apart = |one: &Signature| share(one, &|bin| bin.mean_added[0] - bin.mean_added[1]);
        found.extend(largest(&mut all, &apart));
    }
    found
}

/// Takes out the signature for which `of`, times its weight, is largest; the first of several.
fn largest(all: &mut Vec<(f64, Signature)>, of: &dyn Fn(&Signature) -> f64) -> Option<Signature> {
    let values: Vec<f64> = all.iter().map(|(weight, one)| weight * of(one)).collect();
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let first = values.iter().position(|value| *value == most)?;
    Some(all.remove(first).1)
}

/// A signal over the rows that count.
struct Signal {
    name: &'static str,
    unit: String,
    values: Vec<f64>,
    /// How much a dependence on it says.
    weight: f64,
}

impl Signal {
    fn new(name: &'static str, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Self {
            name,
            unit: unit.into(),
            values,
            weight: 1.0,
        }
    }
}

/// What a residual may depend on.
fn signals(known: KnownRows, structure: &Structure) -> Vec<Signal> {
    let command = &structure.command_unit;
    let spool = structure.unit(Output::Spool);
    let rate = |values: &[f64]| rate(values, &known.time, &known.starts);
    let command_rate = rate(&known.command);
    let mut list = vec![
        Signal::new("command", command, known.command),
        Signal::new("command rate", format!("{command}/s"), command_rate),
        Signal {
            // Whatever is slow is smooth over time: that says little of what it depends on.
            weight: 0.5,
            ..Signal::new("time", "s", known.time.clone())
        },
    ];
    for (signal, values) in known.signals {
        if signal == KnownSignal::SimulatedSpool {
            let speed = rate(&values);
            list.push(Signal::new(
                "simulated spool speed",
                format!("{spool}/s"),
                speed,
            ));
        }
        list.push(Signal::new(signal.name(), signal.unit(structure), values));
    }
    list
}

/// Where in its period the oscillation is that `model` adds to `base`, if it adds one.
fn oscillation(base: &Refit, model: &Refit, time: &[f64]) -> Option<Signal> {
    let known = &base.structure.effects;
    let mut added = model.structure.effects.iter();
    let name = added.find_map(|effect| match known.contains(effect) {
        true => None,
        false => effect.frequency(),
    })?;
    let frequency = model.parameters.iter().find(|p| p.name == name)?.nominal();
    let phase = time.iter().map(|time| (time * frequency).fract());
    Some(Signal::new(
        "phase of the oscillation",
        "periods",
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
    use crate::diagnose::statistics::simulated::white;

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
