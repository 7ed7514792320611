//! The valve card: the figures that a hydraulics engineer reads off a datasheet, in the terms of ISO 10770-1, computed
//! from a fitted model on a simulated test bench.
//!
//! The bench is dry of the record's sensors: effects of the measurement are left out. Where the record's pressures were
//! measured the bench has 70 bar from P to T, otherwise the model's `rated_drop`; no load.
//!
//! Each figure can stand there twice: [`Measured`] reads it off the records' own curves, by the same construction.

mod bench;
mod blocked;
mod construction;
mod cycle;
mod figures;
mod measured;
mod quantity;
mod response;
mod step;
mod threshold;

use crate::evaluate::Problem;
use crate::model::{Hold, Structure};
use crate::search::Fit;
use crate::search::datasheet::Sheet;
use crate::search::polish::spread;
use bench::Bench;
pub use cycle::Cycle;
use figures::{Conditions, Definition, FIGURES, Tests};
pub use measured::{Accuracy, Measured, Reading};
pub use quantity::{AMPLITUDES, Quantity};
use rayon::prelude::*;
pub use response::{Point, Response};
use serde::Serialize;
pub use step::Step;

/// A figure of the card.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is a figure of; its name in JSON.
    #[serde(rename = "name")]
    pub quantity: Quantity,
    /// What it is, such as `rated flow at 70 bar`.
    pub label: String,
    /// Unit.
    pub unit: String,
    /// Its value; null where the model, the record or the data do not give it.
    pub value: Option<f64>,
    /// Lower end of its 95 % interval; null where there is none.
    pub low: Option<f64>,
    /// Upper end of its 95 % interval; null where there is none.
    pub high: Option<f64>,
    /// Why a value has no interval; null where it has one.
    pub no_interval: Option<&'static str>,
    /// Conditions, or why there is no value.
    pub note: String,
    /// The same figure read off the measured curve, without the model; null where the records have no test of it.
    pub measured: Option<Reading>,
    /// Why it was not measured; null where it was.
    pub no_measured: Option<String>,
}

/// What every card has figures of, each with its unit where the valve is of this structure.
pub fn units(structure: &Structure) -> impl Iterator<Item = (Quantity, String)> {
    FIGURES
        .iter()
        .map(|figure| (figure.quantity, figure.unit_on(structure)))
}

/// Why a value has no interval: zero is all that the model can say.
const NONE_IN_MODEL: &str = "the model has none";
/// The same: what the model does not explain is in no interval.
const UNEXPLAINED: &str = "the model is incomplete";
/// The same: what noise there is does not show.
const NO_NOISE: &str = "as many parameters as points";
/// The same: it is no number but a direction.
const SIGN: &str = "a sign";
/// Why nothing was measured: there is no record.
const NO_RECORD: &str = "no record was given";
/// The same: it is what the parameters were set to.
const NOT_FITTED: &str = "not fitted";

/// Share of a figure below which two of them are the same.
const ARITHMETIC: f64 = 1e-3;

impl Figure {
    /// Whether it is zero because the model has nothing that causes it.
    pub fn is_none_in_model(&self) -> bool {
        self.no_interval == Some(NONE_IN_MODEL)
    }

    /// The figure of a model that does not explain its record: intervals assume that it does.
    pub fn without_interval(self) -> Self {
        let known = self.no_interval.or(self.value.map(|_| UNEXPLAINED));
        Self {
            low: None,
            high: None,
            no_interval: known,
            ..self
        }
    }

    /// Whether model and measurement differ by more than their intervals joined.
    pub fn disagrees(&self) -> bool {
        let (Some(value), Some(measured)) = (self.value, &self.measured) else {
            return false;
        };
        // Half of an interval on the side of the other value.
        let half = |low: f64, own: f64, high: f64, other: f64| match other > own {
            true => high - own,
            false => own - low,
        };
        let of_model = match (self.low, self.high) {
            (Some(low), Some(high)) => half(low, value, high, measured.value),
            _ => 0.0,
        };
        let of_measured = half(measured.low, measured.value, measured.high, value);
        let apart = (value - measured.value).abs();
        // What arithmetic leaves is no difference.
        let least = ARITHMETIC * value.abs().max(measured.value.abs());
        apart > of_model.hypot(of_measured).max(least)
    }
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
    /// What was measured of them, where there are records.
    pub measured: Option<Curves>,
}

impl Card {
    /// The card of a fit. Intervals follow from all parameters together, by linear propagation ([`spread`]).
    pub fn of(problem: &Problem, fit: &Fit) -> Self {
        let bench = |free: &[f64]| {
            let values = problem.complete(free, |fixed| fixed);
            Bench::new(problem, &values)
        };
        let own = bench(fit.values());
        let conditions = Conditions::of(problem, &own);
        let tests = Tests::of(&own);
        let values = tests.values();
        // Where there are no more points than parameters, nothing tells how large the noise is.
        let noisy = fit
            .polished
            .as_ref()
            .is_some_and(|(_, uncertainty)| uncertainty.degrees_of_freedom > 0.0);
        let axes: Vec<Axis> = match &fit.polished {
            None => Vec::new(),
            Some((polished, uncertainty)) => spread(&fit.free, polished, uncertainty)
                .into_par_iter()
                .filter(|axis| noisy || !axis.determined)
                .map(|axis| Axis {
                    ends: axis.ends.map(|free| tests.near(&bench(&free)).values()),
                    determined: axis.determined,
                })
                .collect(),
        };
        let figure = |(i, figure): (usize, &Definition)| {
            let found = match (conditions.lack(figure), values[i]) {
                (Some(lack), _) => Err(lack),
                (None, None) => Err(figure.miss().into()),
                (None, Some(value)) => interval(value, i, &axes)
                    .map(|interval| (value, interval))
                    .ok_or_else(|| "this data does not determine it".to_owned()),
            };
            let known = match found {
                Err(_) => Err(None),
                Ok(_) if fit.polished.is_none() => Err(Some(NOT_FITTED)),
                Ok(_) if figure.quantity == Quantity::Polarity => Err(Some(SIGN)),
                Ok(_) if !noisy => Err(Some(NO_NOISE)),
                Ok((_, ends)) if ends == [0.0; 2] && figure.has_a_cause_of_its_own() => {
                    Err(Some(NONE_IN_MODEL))
                }
                Ok((_, interval)) => Ok(interval),
            };
            Figure {
                quantity: figure.quantity,
                label: conditions.label(figure),
                unit: figure.unit_on(&problem.structure),
                value: found.as_ref().ok().map(|(value, _)| *value),
                low: known.ok().map(|[low, _]| low),
                high: known.ok().map(|[_, high]| high),
                no_interval: known.err().flatten(),
                note: found.err().unwrap_or_else(|| conditions.note(figure)),
                measured: None,
                no_measured: Some(NO_RECORD.into()),
            }
        };
        Self {
            figures: FIGURES.iter().enumerate().map(figure).collect(),
            cycle: tests.cycle,
            responses: tests.responses,
            step: tests.step,
            measured: None,
        }
    }

    /// The card with each figure a second time, as `measured` shows it. The accuracy of the sensors joins the intervals of both:
    /// the model was fitted to what they said. The command between two rows is as `hold` says.
    pub fn beside(mut self, measured: Measured, hold: Hold) -> Self {
        for (definition, figure) in FIGURES.iter().zip(&mut self.figures) {
            let sensors = measured.sensors_in(definition, &self.cycle);
            if let (Some(value), Some(low), Some(high)) = (figure.value, figure.low, figure.high) {
                figure.low = Some(value - sensors.hypot(value - low));
                figure.high = Some(value + sensors.hypot(high - value));
            }
            let found = measured.read(definition, hold);
            figure.no_measured = found.as_ref().err().cloned();
            figure.measured = found.ok();
        }
        self.measured = Some(Curves {
            cycle: measured.cycle(),
            responses: measured.responses(hold),
        });
        self
    }
}

impl Card {
    /// The card with each figure a second time, as the curve of the datasheet itself shows it.
    pub fn beside_sheet(mut self, sheet: &Sheet) -> Self {
        for (definition, figure) in FIGURES.iter().zip(&mut self.figures) {
            let found = measured::sheet::read(sheet, definition);
            figure.no_measured = found.as_ref().err().cloned();
            figure.measured = found.ok();
        }
        self
    }
}

/// Why a figure is not there.
const NO_FULL_SCALE: &str = "the full scale of the command is not known";

impl Card {
    /// The card where nobody has said what the full scale of the command is: what depends on it is not determined.
    pub fn without_full_scale(mut self) -> Self {
        for figure in &mut self.figures {
            if figure.quantity.needs_full_scale() {
                *figure = Figure {
                    quantity: figure.quantity,
                    label: figure.label.clone(),
                    unit: figure.unit.clone(),
                    value: None,
                    low: None,
                    high: None,
                    no_interval: None,
                    note: NO_FULL_SCALE.into(),
                    measured: None,
                    no_measured: Some(NO_FULL_SCALE.into()),
                };
            }
        }
        self
    }
}

/// The curves that were measured, beside those of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// The slow cycle.
    pub cycle: Option<Cycle>,
    /// The response of each record that has one, and the amplitude of its command, % of full scale.
    pub responses: Vec<(f64, Vec<Point>)>,
}

/// A direction of parameter space, with the figures at both ends; `None` where the valve does not have the figure.
struct Axis {
    ends: [Vec<Option<f64>>; 2],
    determined: bool,
}

/// A figure is not determined if a direction that the data do not determine changes it by more than this share.
const UNDETERMINED: f64 = 0.1;

/// The 95 % interval of figure number `i`, which is `value`; `None` where the data do not determine it.
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
