//! What a report holds, in the units that people are told.

use super::Units;
use crate::card::Figure;
use crate::compare::{Change, Estimate};
use crate::report::{
    Batch, ComparisonDocument, Departure, Document, LimitReport, NamedValue, ParameterReport,
};
use crate::search::fitted_sheet::FittedSheet;

impl Units {
    /// Makes values of `unit` those of the unit that is told, which takes its place.
    fn convert<'a>(&self, unit: &mut String, values: impl IntoIterator<Item = &'a mut f64>) {
        let (told, factor) = self.of(unit);
        *unit = told;
        values.into_iter().for_each(|value| *value *= factor);
    }

    fn figure(&self, figure: &mut Figure) {
        let own = [&mut figure.value, &mut figure.low, &mut figure.high];
        let measured = figure.measured.iter_mut();
        let measured = measured.flat_map(|one| [&mut one.value, &mut one.low, &mut one.high]);
        let values = own.into_iter().flatten().chain(measured);
        self.convert(&mut figure.unit, values);
    }

    fn parameter(&self, parameter: &mut ParameterReport) {
        let ParameterReport {
            unit,
            value,
            low,
            high,
            before,
            ..
        } = parameter;
        self.convert(unit, [value, low, high].into_iter().chain(before));
    }

    /// The `parameters` with their values in these units.
    pub fn parameters(&self, mut parameters: Vec<ParameterReport>) -> Vec<ParameterReport> {
        parameters.iter_mut().for_each(|one| self.parameter(one));
        parameters
    }

    /// The curves of a datasheet, measured and fitted, in these units; the problem stays as it was posed.
    pub fn sheet(&self, fitted: &FittedSheet) -> FittedSheet {
        let mut told = fitted.clone();
        let parameters = told.sheet.problem.parameters.iter();
        for (parameter, value) in parameters.zip(&mut told.sheet.published) {
            self.convert(&mut parameter.unit.clone(), value);
        }
        let quantities = told
            .sheet
            .measured
            .iter_mut()
            .zip(&mut told.integration_error);
        for (i, (measured, change)) in quantities.enumerate() {
            let fits = told.fits.iter_mut().flat_map(|fit| {
                let errors = fit.errors[i].iter_mut().flatten();
                fit.simulated[i].iter_mut().chain(errors)
            });
            let own = measured.values.iter_mut().flatten();
            self.convert(&mut measured.unit, own.chain(fits).chain([change]));
        }
        told
    }

    fn limit(&self, limit: &mut LimitReport) {
        let LimitReport {
            unit,
            lower,
            upper,
            value,
            low,
            high,
            ..
        } = limit;
        let values = [lower, upper, value, low, high];
        self.convert(unit, values.into_iter().flatten());
    }

    fn change(&self, change: &mut Change) {
        fn all(one: &mut Estimate) -> impl Iterator<Item = &mut f64> {
            let Estimate { value, low, high } = one;
            std::iter::once(value)
                .chain(low.as_mut())
                .chain(high.as_mut())
        }
        let Change {
            unit,
            before,
            after,
            difference,
            low,
            high,
            ..
        } = change;
        let sides = all(before).chain(all(after));
        let ends = [low, high].into_iter().flatten();
        self.convert(unit, sides.chain([difference]).chain(ends));
    }

    fn named(&self, named: &mut NamedValue) {
        let NamedValue {
            unit,
            value,
            low,
            high,
            ..
        } = named;
        let ends = [low, high].into_iter().flatten();
        self.convert(unit, [value].into_iter().chain(ends));
    }

    fn departure(&self, departure: &mut Departure) {
        let Departure {
            unit, value, usual, ..
        } = departure;
        self.convert(unit, [value, usual]);
    }
}

impl Document {
    /// The same for people who are told these `units`: its figures, parameters and limits. Its sentences stay.
    pub fn in_units(&self, units: &Units) -> Self {
        let mut told = self.clone();
        told.card.iter_mut().for_each(|one| units.figure(one));
        told.parameters = units.parameters(told.parameters);
        told.limits.iter_mut().for_each(|one| units.limit(one));
        if let Some(form) = &mut told.free_form {
            let signals = form.curve.iter_mut().map(|knot| &mut knot.signal);
            units.convert(&mut form.signal_unit, signals);
            let values = form.curve.iter_mut().map(|knot| &mut knot.value);
            units.convert(&mut form.unit, values);
        }
        told
    }
}

impl ComparisonDocument {
    /// The same for people who are told these `units`: what changed, and limits. Its sentences stay.
    pub fn in_units(&self, units: &Units) -> Self {
        let mut told = self.clone();
        told.changes.iter_mut().for_each(|one| units.change(one));
        told.limits.iter_mut().for_each(|one| units.limit(one));
        told
    }
}

impl Batch {
    /// The same for people who are told these `units`: figures, parameters and what departs. Its sentences stay.
    pub fn in_units(&self, units: &Units) -> Self {
        let mut told = self.clone();
        for row in &mut told.rows {
            let values = row.figures.iter_mut().chain(&mut row.parameters);
            values.for_each(|one| units.named(one));
        }
        for own in told.departures.iter_mut().flatten() {
            let values = own.figures.iter_mut().chain(&mut own.parameters);
            values.for_each(|one| units.departure(one));
        }
        told
    }
}
