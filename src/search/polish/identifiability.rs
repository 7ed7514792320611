//! Parameters that the data cannot tell apart, or do not depend on.

use super::Triangle;
use super::coordinates::to_search;
use super::directions::Directions;
use crate::model::Parameter;

/// A parameter takes part in a direction if its component, columns scaled to one, is at least this.
const SHARE: f64 = 0.05;

/// Why parameters are not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The simulation does not change with the parameter at all.
    NoEffect,
    /// The parameters can change together without changing the simulation.
    Combination,
    /// They can, with a change in the simulation too small against the residual.
    Weak,
}

/// Parameters that the data do not determine, alone or together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unidentifiable {
    /// Indices of the parameters, rising.
    pub parameters: Vec<usize>,
    /// Why they are not determined.
    pub kind: Kind,
}

impl Unidentifiable {
    /// In words, for a report: `gain and lag: only a combination is determined`.
    pub fn describe(&self, parameters: &[Parameter]) -> String {
        let names: Vec<&str> = self
            .parameters
            .iter()
            .map(|&j| parameters[j].name.as_str())
            .collect();
        let names = match names.as_slice() {
            [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
            _ => names.concat(),
        };
        let why = match (self.kind, self.parameters.len()) {
            (Kind::NoEffect, _) => "the data does not depend on it",
            (Kind::Combination, _) => "only a combination is determined",
            (Kind::Weak, 1) => "the data hardly depends on it",
            (Kind::Weak, _) => "the data hardly tells them apart",
        };
        format!("{names}: {why}")
    }
}

/// A parameter that moves the simulation less than this fraction of what the strongest one does, each over its whole
/// range, has no effect but rounding.
const NOISE: f64 = 1e-12;

/// Free parameters that the simulation does not depend on: their column of the Jacobian is zero, or rounding.
pub(super) fn without_effect(parameters: &[Parameter], triangle: &Triangle) -> Vec<Unidentifiable> {
    let norms = triangle.column_norms();
    let span = |p: &Parameter| to_search(p, p.high) - to_search(p, p.low);
    let effect = |j: usize| {
        let span = span(&parameters[j]);
        if span.is_finite() {
            norms[j] * span
        } else {
            norms[j]
        }
    };
    let free = || (0..parameters.len()).filter(|&j| !parameters[j].is_fixed());
    let strongest = free().map(effect).fold(0.0, f64::max);
    let alone = |j| Unidentifiable {
        parameters: vec![j],
        kind: Kind::NoEffect,
    };
    free()
        .filter(|&j| effect(j) <= NOISE * strongest)
        .map(alone)
        .collect()
}

/// Groups of parameters that undetermined directions tie together: the connected blocks of the projector onto those
/// directions, which unlike the single vectors do not depend on the basis chosen for them.
pub(super) fn combinations(directions: &Directions) -> Vec<Unidentifiable> {
    let projector = directions.undetermined_projector();
    let tied = |a: usize, b: usize| projector[(a, b)].abs() > SHARE * SHARE;
    let mut waiting: Vec<usize> = (0..projector.nrows()).filter(|&j| tied(j, j)).collect();
    let mut groups = Vec::new();
    while let Some(first) = waiting.pop() {
        let mut group = vec![first];
        let mut next = 0;
        while next < group.len() {
            let (joining, others) = waiting.into_iter().partition(|&j| tied(group[next], j));
            waiting = others;
            group.extend::<Vec<usize>>(joining);
            next += 1;
        }
        groups.push(directions.group(group, Kind::Combination));
    }
    groups.reverse();
    groups
}

/// For each weak column, the weak parameters of the direction that its uncertainty comes from.
pub(super) fn weak(
    directions: &Directions,
    columns: impl Iterator<Item = usize>,
) -> Vec<Unidentifiable> {
    let columns: Vec<usize> = columns.collect();
    let mut groups: Vec<Unidentifiable> = Vec::new();
    for &column in &columns {
        let spread = |&k: &usize| directions.spread(column, k).abs();
        let Some(&weakest) = directions
            .determined
            .iter()
            .max_by(|a, b| spread(a).total_cmp(&spread(b)))
        else {
            continue;
        };
        let takes_part = |&other: &usize| {
            other == column || directions.spectrum.vectors[(other, weakest)].abs() > SHARE
        };
        let members = columns.iter().copied().filter(takes_part).collect();
        let group = directions.group(members, Kind::Weak);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}

impl Directions {
    fn group(&self, columns: Vec<usize>, kind: Kind) -> Unidentifiable {
        let mut parameters: Vec<usize> = columns.into_iter().map(|c| self.parameters[c]).collect();
        parameters.sort_unstable();
        Unidentifiable { parameters, kind }
    }
}
