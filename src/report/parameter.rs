//! The parameters of a fit, as reports tell them.

use super::number::number;
use crate::evaluate::Problem;
use crate::model::Parameter;
use crate::search::Fit;
use crate::search::polish::Unidentifiable;
use serde::Serialize;

/// A parameter of the result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// Name as in the model file.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Fitted value.
    pub value: f64,
    /// Lower end of the 95 % interval; not a number, in JSON null, where the fit was not polished to its end. It reaches to the value with
    /// another command between the rows where nothing tells which it was.
    pub low: f64,
    /// Upper end of the 95 % interval, likewise.
    pub high: f64,
    /// Whether the value sits on one of its bounds.
    pub at_bound: bool,
    /// Value in the base model; null where it has no such parameter.
    pub before: Option<f64>,
    /// Whether it was fixed; then the interval is the value.
    pub fixed: bool,
    /// Whether it moved out of its 95 % interval in the base model.
    pub moved: bool,
    /// Whether the fitted rows leave it open: from `low` to `high` it makes no difference to them.
    pub flat: bool,
}

impl ParameterReport {
    /// The 95 % interval in words, with `to` between its ends.
    pub fn interval(&self, to: &str) -> String {
        match self {
            Self { fixed: true, .. } => "fixed".into(),
            Self { low, high, .. } if low.is_nan() || high.is_nan() => "not known".into(),
            Self { low, high, .. } => format!("{} {to} {}", number(*low), number(*high)),
        }
    }

    /// The parameters of a fit, in the order of the problem's, beside those of the base model.
    pub fn beside(before: &[Self], problem: &Problem, fit: &Fit) -> Vec<Self> {
        let mut list = Self::of(problem, fit);
        for parameter in &mut list {
            let base = before.iter().find(|base| base.name == parameter.name);
            parameter.before = base.map(|base| base.value);
            parameter.moved = base.is_some_and(|base| {
                !base.fixed && (parameter.value < base.low || parameter.value > base.high)
            });
        }
        list
    }

    /// The parameters of a fit, in the order of the problem's.
    pub fn of(problem: &Problem, fit: &Fit) -> Vec<Self> {
        let mut free = 0;
        let one = |parameter: &Parameter| {
            let mut flat = false;
            let (value, low, high, at_bound) = if parameter.is_fixed() {
                let value = parameter.nominal();
                (value, value, value, false)
            } else {
                free += 1;
                let value = fit.values()[free - 1];
                match &fit.polished {
                    Some((polished, uncertainty)) => {
                        let interval = &uncertainty.intervals[free - 1];
                        flat = polished.flat.iter().any(|one| one.parameter == free - 1);
                        (
                            value,
                            interval.low,
                            interval.high,
                            polished.at_bound[free - 1].is_some(),
                        )
                    }
                    None => (
                        value,
                        f64::NAN,
                        f64::NAN,
                        value <= parameter.low || value >= parameter.high,
                    ),
                }
            };
            Self {
                name: parameter.name.clone(),
                unit: parameter.unit.clone(),
                value,
                low,
                high,
                at_bound,
                before: Some(value),
                fixed: parameter.is_fixed(),
                moved: false,
                flat,
            }
        };
        problem.parameters.iter().map(one).collect()
    }
}

/// In words, the parameters that the data of a polished fit do not determine.
pub fn not_identifiable(fit: &Fit) -> Vec<String> {
    let Some((polished, uncertainty)) = &fit.polished else {
        return Vec::new();
    };
    let is_flat = |group: &&Unidentifiable| {
        let flat = polished.flat.iter().map(|flat| [flat.parameter]);
        flat.into_iter().any(|alone| group.parameters == alone)
    };
    let flat = polished.flat.iter().map(|flat| {
        let Parameter { name, unit, .. } = &fit.free[flat.parameter];
        let (low, high) = (flat.low, flat.high);
        format!("{name}: from {low:.4} to {high:.4} {unit} it makes no difference to the data")
    });
    let groups = uncertainty.unidentifiable.iter();
    let others = groups.filter(|group| !is_flat(group));
    flat.chain(others.map(|group| group.describe(&fit.free)))
        .collect()
}
