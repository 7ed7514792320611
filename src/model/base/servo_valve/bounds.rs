//! Bounds that follow from the data.

use crate::model::Parameter;

/// Bounds of what follows from the ratio of two ranges lie this factor to either side of it.
const AROUND: f64 = 100.0;

/// Sets the bounds, and the start value to their middle unless it is well inside them.
pub(super) fn bound(parameter: &mut Parameter, low: f64, high: f64) {
    (parameter.low, parameter.high) = (low, high);
    if !(0.1..0.9).contains(&parameter.to_unit(parameter.nominal())) {
        parameter.set_nominal(parameter.from_unit(0.5));
    }
}

/// Starts a logarithmic parameter at `value`, with bounds around it, unless the data gave no such value.
pub(super) fn around(parameter: &mut Parameter, value: f64) {
    if value.is_normal() {
        parameter.set_nominal(value);
        bound(parameter, value / AROUND, value * AROUND);
    }
}
