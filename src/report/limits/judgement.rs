//! Whether a result is inside its limits. What is not sure is not determined: a limit is met by the whole interval or not at
//! all.

use super::{Limit, LimitReport, Outcome};
use crate::card::{Figure, Quantity};
use crate::report::{Document, ParameterReport, number};
use crate::{Error, Result};

/// Why the model says nothing of a limit: its intervals assume that it explains the record.
const INCOMPLETE: &str = "the model is incomplete";

/// What is known of a value, and from where.
#[derive(Debug, Clone, Copy)]
struct Known {
    value: f64,
    low: f64,
    high: f64,
    from: &'static str,
}

impl Limit {
    /// The limit beside what `document` has.
    pub(crate) fn judge(&self, document: &Document) -> LimitReport {
        let known = match self.is_parameter {
            true => self.of_parameter(document),
            false => self.of_figure(document),
        };
        let outcome = match &known {
            Ok(known) => self.outcome(known),
            Err(_) => Outcome::NotDetermined,
        };
        let reason = match (&known, outcome) {
            (Err(reason), _) => Some(reason.clone()),
            (_, Outcome::NotDetermined) => Some("the limit lies inside the interval".into()),
            _ => None,
        };
        let known = known.ok();
        LimitReport {
            name: self.name.clone(),
            of: if self.is_parameter {
                "parameter"
            } else {
                "figure"
            },
            limit: self.text.clone(),
            unit: self.unit.clone(),
            lower: self.lower,
            upper: self.upper,
            value: known.map(|known| known.value),
            low: known.map(|known| known.low),
            high: known.map(|known| known.high),
            from: known.map(|known| known.from),
            outcome,
            reason,
        }
    }

    fn outcome(&self, known: &Known) -> Outcome {
        let (lower, upper) = (
            self.lower.unwrap_or(f64::NEG_INFINITY),
            self.upper.unwrap_or(f64::INFINITY),
        );
        if known.low >= lower && known.high <= upper {
            Outcome::Pass
        } else if known.high < lower || known.low > upper {
            Outcome::Fail
        } else {
            Outcome::NotDetermined
        }
    }

    /// What the model has of a parameter.
    fn of_parameter(&self, document: &Document) -> std::result::Result<Known, String> {
        if document.is_incomplete() {
            return Err(INCOMPLETE.into());
        }
        let mut all = document.parameters.iter();
        let parameter = all
            .find(|parameter| parameter.name == self.name)
            .ok_or("the model has no such parameter: nothing called for it")?;
        match parameter {
            ParameterReport { fixed: true, .. } => Err("it was set, not fitted".into()),
            ParameterReport { flat: true, .. } => Err("this data does not determine it".into()),
            ParameterReport { at_bound: true, .. } => Err("it sits on a bound of its range".into()),
            ParameterReport {
                value, low, high, ..
            } if low.is_finite() && high.is_finite() => Ok(Known {
                value: *value,
                low: *low,
                high: *high,
                from: "model",
            }),
            _ => Err("its interval is not known".into()),
        }
    }

    /// What the card has of a figure: the model's, or the measured curve's where the model's has no interval.
    fn of_figure(&self, document: &Document) -> std::result::Result<Known, String> {
        let mut all = document.card.iter();
        let figure = all
            .find(|figure| figure.quantity.to_string() == self.name)
            .ok_or("the card has no such figure")?;
        let modelled = modelled(figure, document);
        let measured = figure.measured.as_ref().map(|reading| Known {
            value: reading.value,
            low: reading.low,
            high: reading.high,
            from: "measured",
        });
        match (modelled, measured) {
            (Ok(model), Some(curve)) => match self.outcome(&model) == self.outcome(&curve) {
                false if figure.disagrees() => Err(format!(
                    "model and measured curve differ: {} and {} {}",
                    number(model.value),
                    number(curve.value),
                    self.unit
                )),
                _ => Ok(model),
            },
            (Ok(model), None) => Ok(model),
            (Err(_), Some(curve)) => Ok(curve),
            (Err(reason), None) => Err(reason),
        }
    }
}

/// What the model says of `figure`, or why it says nothing that can be relied on.
fn modelled(figure: &Figure, document: &Document) -> std::result::Result<Known, String> {
    let known = |value, low, high| Known {
        value,
        low,
        high,
        from: "model",
    };
    match (figure.value, figure.low, figure.high) {
        (None, ..) => Err(figure.note.clone()),
        _ if document.is_incomplete() => Err(INCOMPLETE.into()),
        (Some(value), Some(low), Some(high)) => Ok(known(value, low, high)),
        // A sign is known or not.
        (Some(value), ..) if figure.quantity == Quantity::Polarity => {
            Ok(known(value, value, value))
        }
        _ => Err(figure.no_interval.unwrap_or("it has no interval").into()),
    }
}

impl Document {
    /// Judges the `limits` by what the document has.
    pub fn judge(&mut self, limits: &[Limit]) {
        self.limits = limits.iter().map(|limit| limit.judge(self)).collect();
    }

    /// # Errors
    /// [`Error::Unmet`], unless every limit is met.
    pub fn check_limits(&self) -> Result<()> {
        let (met, all) = (met(&self.limits), self.limits.len());
        if met == all {
            return Ok(());
        }
        let named = |outcome: Outcome| {
            let those = self.limits.iter().filter(|limit| limit.outcome == outcome);
            let names: Vec<&str> = those.map(|limit| limit.name.as_str()).collect();
            match names.is_empty() {
                true => None,
                false => Some(format!("{}: {}", outcome.words(), names.join(", "))),
            }
        };
        let others = [Outcome::Fail, Outcome::NotDetermined].map(named);
        let others: Vec<String> = others.into_iter().flatten().collect();
        Err(Error::unmet(
            format!("{met} of {all} limits are met"),
            others.join("; "),
        ))
    }
}

/// How many of `limits` are met.
pub fn met(limits: &[LimitReport]) -> usize {
    let met = |limit: &&LimitReport| limit.outcome == Outcome::Pass;
    limits.iter().filter(met).count()
}
