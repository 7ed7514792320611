//! The interval of a parameter.

use super::coordinates::{to_search, to_value};
use crate::model::Parameter;

/// The range of values of one parameter that the data allow with 95 % confidence, in the parameter's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower limit.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
    /// The data set no lower limit: `low` is the parameter's bound.
    pub open_low: bool,
    /// The data set no upper limit: `high` is the parameter's bound.
    pub open_high: bool,
}

impl Interval {
    /// The whole range of `parameter`: the data say nothing.
    pub fn whole(parameter: &Parameter) -> Self {
        Self {
            low: parameter.low,
            high: parameter.high,
            open_low: true,
            open_high: true,
        }
    }

    /// `half_width` to both sides of `value` in search coordinates, cut at the bounds.
    pub(super) fn around(parameter: &Parameter, value: f64, half_width: f64) -> Self {
        let centre = to_search(parameter, value);
        let low = to_value(parameter, centre - half_width);
        let high = to_value(parameter, centre + half_width);
        Self {
            low,
            high,
            open_low: low <= parameter.low,
            open_high: high >= parameter.high,
        }
    }
}
