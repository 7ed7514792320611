//! The flow follows the oil's temperature.

use super::host;
use super::sensor_drift::settling_time;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Parameter, Real};

/// What a temperature is counted from, degC: at which ISO 10770-1 tests.
pub(super) const REFERENCE_TEMPERATURE: f64 = 40.0;

pub(super) const ENTRY: Entry = Entry {
    name: "viscosity_drift",
    port: Port::Flow,
    summary: "Flow and leakage change as the oil warms up",
    finding: "the flow changes by {viscosity_drift} as the oil warms up",
    equation: "Q (1 + viscosity_drift t), or Q (1 + viscosity_drift_per_kelvin (temperature - 40 degC)) where temperature is measured",
    shows: "a flow error in proportion to the flow that grows with time or follows the temperature",
    confused: "sensor_drift, which is there at null, too",
    source: "viscosity and density over temperature: ISO 3448 (viscosity grades)",
    parameters: |scale, _| {
        let time = Parameter::linear(
            "viscosity_drift",
            "1/s",
            -0.5 / scale.length,
            0.0,
            0.5 / scale.length,
        );
        let heat = Parameter::linear("viscosity_drift_per_kelvin", "1/K", -0.05, 0.0, 0.05);
        match scale.temperature {
            true => vec![time.fixed(), heat],
            false => vec![time, heat.fixed()],
        }
    },
    trials: |scale, _| match scale.temperature {
        true => vec![vec![1e-3]],
        false => vec![vec![0.03 / scale.length]],
    },
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_a_flow,
    outputs: None,
    view: Some(View::new(
        view::triangle(9.0, 2.0, 4),
        Over::Time,
        Values::Trial(0),
    )),
    frequency: None,
};

/// Flow and leakage change as the oil warms up.
#[derive(Debug, Clone)]
pub(in crate::model) struct ViscosityDrift<R> {
    drift: R,
    per_kelvin: R,
}

impl<R: Real> ViscosityDrift<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            drift: next(),
            per_kelvin: next(),
        }
    }
}

impl<R: Real> Act<R> for ViscosityDrift<R> {
    #[inline(always)]
    fn flow(&self, flow: R, moment: &Moment<R>) -> R {
        let warmer = moment.temperature - R::constant(REFERENCE_TEMPERATURE);
        flow + flow * (self.drift * moment.time + self.per_kelvin * warmer)
    }
}

pub(super) const SETTLING: Entry = Entry {
    name: "viscosity_drift~settling",
    summary: "Flow and leakage change as the oil warms up, until it is warm",
    finding: "the flow changes by {viscosity_drift_settling}, with a time constant of {warm_up_time}, as the oil warms up",
    equation: "Q (1 + viscosity_drift_settling (1 - e^(-t / warm_up_time)))",
    shows: "a flow error in proportion to the flow that grows with time and levels off",
    confused: "viscosity_drift, which goes on; sensor_drift, which is there at null, too",
    source: "first-order heating of a tank; viscosity over temperature: ISO 3448 (viscosity grades)",
    parameters: |scale, _| {
        vec![
            Parameter::linear("viscosity_drift_settling", "1", -0.5, 0.0, 0.5),
            settling_time("warm_up_time", scale),
        ]
    },
    trials: |scale, _| {
        [0.3, 0.8]
            .map(|share| vec![0.03, share * scale.length])
            .to_vec()
    },
    ..ENTRY
};

/// Flow and leakage change as the oil warms up, until it is warm.
#[derive(Debug, Clone)]
pub(in crate::model) struct ViscosityDriftSettling<R> {
    amount: R,
    time: R,
}

impl<R: Real> ViscosityDriftSettling<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            amount: next(),
            time: next(),
        }
    }
}

impl<R: Real> Act<R> for ViscosityDriftSettling<R> {
    #[inline(always)]
    fn flow(&self, flow: R, moment: &Moment<R>) -> R {
        let (warm, _) = (moment.time / self.time).caught_up();
        flow + flow * (self.amount * warm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_grows_with_time_and_temperature() {
        let mut values = [0.01, 0.002].into_iter();
        let effect: ViscosityDrift<f64> = ViscosityDrift::new(|| values.next().unwrap());
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        assert!((effect.flow(30.0, &moment) - 30.0 * 1.04).abs() < 1e-12);
    }

    #[test]
    fn the_flow_no_longer_changes_once_the_oil_is_warm() {
        let mut values = [0.1, 2.0].into_iter();
        let effect: ViscosityDriftSettling<f64> =
            ViscosityDriftSettling::new(|| values.next().unwrap());
        for (time, warm) in [(0.0, 0.0), (2.0, 1.0 - (-1.0f64).exp()), (1e3, 1.0)] {
            let moment = Moment {
                time,
                temperature: 50.0,
                opening: 3.0,
                drop: 10.0,
                relative_drop: 1.0,
            };
            let expected = 30.0 * (1.0 + 0.1 * warm);
            assert!((effect.flow(30.0, &moment) - expected).abs() < 3e-4);
        }
    }
}
