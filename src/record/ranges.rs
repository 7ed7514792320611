//! One channel from two meters: one for small values, one for large ones.

use super::column::Measured;
use super::conversion::Conversion;
use super::interval::median;
use super::table::Table;
use super::target::Target;
use super::text::{count, quoted};

/// A meter for small values of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Small {
    pub(super) target: Target,
    pub(super) index: usize,
    pub(super) conversion: Conversion,
    /// Where the meter for large values shows less, this one counts; in the unit that is kept.
    pub(super) below: f64,
}

/// Rows from this share of the limit on tell whether both meters agree there.
const NEAR: f64 = 0.7;
/// Meters disagree that are further apart there than this share of the limit.
const JUMP: f64 = 0.05;
/// A meter is at its end where it is within this share of its largest value, and that is so far below the limit.
const END: f64 = 0.02;

impl Small {
    /// Puts its `values` into those of the channel, `large`, where these are below the limit; what to say of it.
    pub(super) fn joins(&self, values: &[f64], large: &mut Measured, table: &Table) -> Vec<String> {
        let Self {
            target,
            below,
            index,
            ..
        } = *self;
        let [small_name, large_name] =
            [index, large.index].map(|index| quoted(&table.columns[index].label.text));
        let unit = large.unit;
        let rows = || large.values.iter().zip(values);
        let taken = rows().filter(|(large, _)| large.abs() < below).count();
        let mut said = vec![format!(
            "{target} is taken from {small_name} where {large_name} is below {below} {unit}, in {} of {}",
            taken,
            count(values.len(), "row")
        )];
        let near = rows().filter(|(large, _)| (NEAR * below..below).contains(&large.abs()));
        let apart: Vec<f64> = near.map(|(large, small)| small - large).collect();
        if apart.is_empty() {
            said.push(format!(
                "no row is between {} and {below} {unit}, where {small_name} gives way to {large_name}: nothing shows whether the two agree",
                NEAR * below
            ));
        } else {
            let jump = median(&apart);
            if jump.abs() > JUMP * below {
                said.push(format!(
                    "{target} jumps by {jump:.3} {unit} at {below} {unit}, where {small_name} gives way to {large_name}: one of the two is off"
                ));
            }
        }
        let most = values
            .iter()
            .fold(0.0f64, |most, small| most.max(small.abs()));
        let at_end = |large: f64, small: f64| {
            large.abs() < below && large.abs() > most && small.abs() > (1.0 - END) * most
        };
        let lost = rows()
            .filter(|(large, small)| at_end(**large, **small))
            .count();
        if most < (1.0 - END) * below && lost > 0 {
            said.push(format!(
                "{small_name} ends at {most:.3} {unit}: in {} where {large_name} shows more it stays there; say below {most:.3}",
                count(lost, "row")
            ));
        }
        for (large, small) in large.values.iter_mut().zip(values) {
            if large.abs() < below {
                *large = *small;
            }
        }
        said
    }
}

/// The share of the large meter's range that a small one has at most, and up to which share of its own both must agree.
const RANGE: (f64, f64) = (0.5, 0.8);
/// Fewest rows in which both are in range, and in which the small one is at its end.
const ROWS: usize = 20;
/// Slopes of one over the other at which they measure the same.
const SAME: std::ops::RangeInclusive<f64> = 0.9..=1.1;
/// The least share of its range to which the small one is good, beyond that it stays.
const GOOD: f64 = 0.9;

/// Up to where `small` measures the same as `large`, if it does and then stays at its end.
pub(super) fn limit(small: &[f64], large: &[f64]) -> Option<f64> {
    let most = |values: &[f64]| {
        values
            .iter()
            .fold(0.0f64, |most, value| most.max(value.abs()))
    };
    let (end, whole) = (most(small), most(large));
    if !(end > 0.0 && end < RANGE.0 * whole) {
        return None;
    }
    let rows = || small.iter().zip(large);
    let inside = || rows().filter(|(_, large)| large.abs() < RANGE.1 * end);
    let beyond = rows().filter(|(_, large)| large.abs() > end / GOOD);
    let ends = beyond.clone().filter(|(small, _)| small.abs() > GOOD * end);
    let (beyond, ends) = (beyond.count(), ends.count());
    let products: f64 = inside().map(|(small, large)| small * large).sum();
    let [own, other] = [
        inside().map(|(small, _)| small * small).sum::<f64>(),
        inside().map(|(_, large)| large * large).sum::<f64>(),
    ];
    let alike = products / (own * other).sqrt() > GOOD && SAME.contains(&(products / other));
    let known = inside().count() >= ROWS && ends >= ROWS && ends as f64 > GOOD * beyond as f64;
    // A number that is written in two digits.
    let digit = 10f64.powf((GOOD * end).log10().floor() - 1.0);
    (alike && known).then(|| (GOOD * end / digit).floor() * digit)
}
