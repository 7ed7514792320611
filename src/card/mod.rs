//! The valve card: the figures that a hydraulics engineer reads off a datasheet, in the terms of ISO 10770-1, computed
//! from a fitted model on a simulated test bench.
//!
//! The bench is dry of the record's sensors: effects of the measurement are left out. Where the record's pressures were
//! measured the bench has 70 bar from P to T, otherwise the model's `rated_drop`; no load.

mod bench;
mod cycle;
mod figures;
mod response;
mod step;

use crate::evaluate::Problem;
use crate::search::Fit;
use crate::search::polish::spread;
use bench::Bench;
pub use cycle::Cycle;
use figures::{Conditions, Definition, FIGURES, Tests};
use rayon::prelude::*;
pub use response::{Point, Response};
use serde::Serialize;
pub use step::Step;

/// Amplitudes of the frequency responses, % of full scale.
pub const AMPLITUDES: [f64; 3] = [5.0, 25.0, 90.0];

/// A figure of the card.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Its name in JSON, such as `rated_flow`.
    pub name: String,
    /// What it is, such as `rated flow`.
    pub label: String,
    /// Unit.
    pub unit: String,
    /// Its value; null where the model or the record does not give it.
    pub value: Option<f64>,
    /// Lower end of its 95 % interval; null where the data set none.
    pub low: Option<f64>,
    /// Upper end of its 95 % interval; null where the data set none.
    pub high: Option<f64>,
    /// Conditions, or why there is no value.
    pub note: String,
}

/// A valve's figures, and the curves that they are read off.
#[derive(Debug, Clone, PartialEq)]
pub struct Card {
    /// The figures, always the same ones in the same order.
    pub figures: Vec<Figure>,
    /// The slow cycle: flow over command where there is a valve, otherwise spool over command.
    pub cycle: Cycle,
    /// The frequency responses at [`AMPLITUDES`]; none where nothing moves the spool.
    pub responses: Vec<Response>,
    /// The step from zero to full scale.
    pub step: Option<Step>,
}

impl Card {
    /// The card of a fit. Intervals follow from all parameters together, by linear propagation ([`spread`]).
    pub fn of(problem: &Problem, fit: &Fit) -> Self {
        let bench = |free: &[f64]| {
            let values = problem.complete(free, |fixed| fixed);
            Bench::new(&problem.structure, &problem.parameters, &values)
        };
        let own = bench(fit.values());
        let conditions = Conditions::of(problem, &own);
        let tests = Tests::of(&own);
        let values = tests.values();
        let axes: Vec<Axis> = match &fit.polished {
            None => Vec::new(),
            Some((polished, uncertainty)) => spread(&fit.free, polished, uncertainty)
                .into_par_iter()
                .map(|axis| Axis {
                    ends: axis.ends.map(|free| Tests::of(&bench(&free)).values()),
                    determined: axis.determined,
                })
                .collect(),
        };
        let figure = |(i, figure): (usize, &Definition)| {
            let lack = conditions.lack(figure);
            let value = values[i].filter(|_| lack.is_none());
            let interval = match (value, &fit.polished) {
                (Some(value), Some(_)) => interval(value, i, &axes),
                _ => None,
            };
            let note = match (lack, value, interval) {
                (Some(lack), ..) => lack.into(),
                (None, None, _) => "not reached".into(),
                (None, Some(_), None) if fit.polished.is_some() => {
                    "this data does not determine it".into()
                }
                (None, Some(_), _) => conditions.note(figure),
            };
            Figure {
                name: figure.name.into(),
                label: figure.label.into(),
                unit: figure
                    .unit
                    .replace("command", &problem.structure.command_unit),
                value,
                low: interval.map(|ends| ends[0]),
                high: interval.map(|ends| ends[1]),
                note,
            }
        };
        Self {
            figures: FIGURES.iter().enumerate().map(figure).collect(),
            cycle: tests.cycle,
            responses: tests.responses,
            step: tests.step,
        }
    }
}

/// A direction of parameter space, with the figures at both ends; `None` where the valve does not have the figure.
struct Axis {
    ends: [Vec<Option<f64>>; 2],
    determined: bool,
}

/// A figure has no interval if a direction that the data do not determine changes it by more than this share.
const UNDETERMINED: f64 = 0.1;

/// The 95 % interval of figure number `i`, which is `value`.
fn interval(value: f64, i: usize, axes: &[Axis]) -> Option<[f64; 2]> {
    let (mut below, mut above) = (0.0, 0.0);
    for axis in axes {
        let [a, b] = axis.ends.each_ref().map(|end| end[i]);
        let (a, b) = (a?, b?);
        let (low, high) = ((value - a.min(b)).max(0.0), (a.max(b) - value).max(0.0));
        if !axis.determined && low.max(high) > UNDETERMINED * value.abs() {
            return None;
        }
        below += low.powi(2);
        above += high.powi(2);
    }
    Some([value - f64::sqrt(below), value + f64::sqrt(above)])
}
