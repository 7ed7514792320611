//! A sensor lags.

use super::act::lagged;
use super::second_order::SecondOrder;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Host, Moment, Port};
use super::{entry, host};
use crate::model::{Output, Parameter, Real};

/// The slowest sensor of second order, Hz.
const SLOWEST: f64 = 1.0;

pub(super) const ENTRY: Entry = Entry {
    name: "sensor_lag",
    port: Port::Measurement,
    summary: "The sensor follows what it measures with a first-order lag",
    finding: "the {output} sensor lags by {sensor_lag}",
    equation: "sensor_lag dy/dt + y = x",
    shows: "a lag of one channel, the same at all amplitudes; the other channels do not show it",
    confused: "delay and a larger time constant where no other channel is measured; compressibility on the flow",
    source: "sensor and filter data sheets; a flow meter's lag can be twenty times the valve's",
    parameters: |scale, output| {
        vec![Parameter::linear(
            &entry::on("sensor_lag", output),
            "s",
            1e-7,
            1e-7,
            1e3 * scale.interval,
        )]
    },
    trials: |scale, _| [1.0, 6.0, 40.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &["sensor"],
    neutral: &[("sensor_lag", 0.0)],
    applies: host::always,
    outputs: Some(host::any_output),
    view: Some(View::new(
        Excitation::Chirp,
        Over::OutputRate,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The sensor follows what it measures with a first-order lag.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorLag<R> {
    time_constant: R,
}

impl<R: Real> SensorLag<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time_constant: next(),
        }
    }
}

impl<R: Real> Act<R> for SensorLag<R> {
    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
    }

    #[inline(always)]
    fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
        own[0] = lagged(own[0], before, after, self.time_constant, step);
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        // Without a lag it also follows what jumps at a row.
        self.time_constant.if_positive(own[0], value)
    }
}

pub(super) const SECOND_ORDER: Entry = Entry {
    name: "sensor_lag~second_order",
    summary: "The sensor follows what it measures with a lag of second order",
    finding: "the {output} sensor follows up to {sensor_frequency}, with a lag of second order",
    equation: "y'' + 2 D w y' + w^2 y = w^2 x, w = 2 pi sensor_frequency, D = sensor_damping",
    shows: "a lag of one channel that begins more gently than one of first order, the same at all amplitudes",
    confused: "sensor_lag and delay; line_resonance, which is the same equation with a damping that rings",
    source: "data sheets of flow meters and transducers: a natural frequency and a damping of 0.6 to 0.8",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("sensor_frequency", output),
                "Hz",
                SLOWEST.min(0.05 / scale.interval),
                20.0 / scale.interval,
                20.0 / scale.interval,
            ),
            Parameter::linear(&entry::on("sensor_damping", output), "1", 0.5, 0.7, 0.98),
            Parameter::linear(&entry::on("sensor_share", output), "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.005, 0.02, 0.07, 0.2]
            .map(|share| vec![share / scale.interval, 0.7])
            .to_vec()
    },
    states: &["slow_sensor", "slow_sensor_rate"],
    neutral: &[("sensor_share", 0.0)],
    frequency: Some("sensor_frequency"),
    ..ENTRY
};

/// The sensor follows what it measures with a lag of second order.
pub(in crate::model) type SensorLagOfSecondOrder<R> = SecondOrder<R>;

pub(super) const TURBINE: Entry = Entry {
    name: "sensor_lag~turbine",
    summary: "The flow meter is a turbine, whose rotor follows the faster the more flows through it",
    finding: "the {output} meter's turbine lags by {turbine_lag} at its largest reading, and by more the less flows, down to {turbine_rest} of that rate",
    equation: "T y' = (|x| / S + turbine_rest) (x max(0, 1 - (d S / x)^2) - y), T = turbine_lag, S = turbine_span, d = turbine_drag",
    shows: "a lag of the flow alone that is long near null and short at full flow, a rotor that runs on where the flow stops, and that stands \
            still below a share turbine_drag of the largest flow where its bearings drag",
    confused: "sensor_lag, whose lag is the same at every flow; compressibility, likewise; overlap, which a rotor that stands still imitates",
    source: "momentum balance of a turbine's rotor, whose rate is proportional to the flow and its drive to the square of it: Baker, Flow \
             Measurement Handbook, 2000",
    parameters: |scale, output| {
        let span = scale.output(output);
        vec![
            Parameter::linear(
                &entry::on("turbine_lag", output),
                "s",
                0.0,
                0.0,
                1e2 * scale.interval,
            ),
            Parameter::log(&entry::on("turbine_rest", output), "1", 1e-3, 0.05, 1.0),
            Parameter::linear(&entry::on("turbine_drag", output), "1", 0.0, 0.0, 0.3),
            Parameter::linear(
                &entry::on("turbine_span", output),
                scale.unit(output),
                0.0,
                span,
                span,
            )
            .fixed(),
        ]
    },
    trials: |scale, _| {
        [0.5, 3.0, 15.0]
            .map(|n| vec![n * scale.interval, 0.05, 0.01])
            .to_vec()
    },
    states: &["turbine"],
    neutral: &[("turbine_lag", 0.0)],
    applies: host::shows_a_flow,
    outputs: Some(of_the_flow),
    ..ENTRY
};

/// A turbine measures a flow, not what is its integral.
fn of_the_flow(_: &dyn Host, output: Output) -> bool {
    output == Output::Flow
}

/// A turbine's rotor follows the flow through it at a rate that grows with the flow.
#[derive(Debug, Clone)]
pub(in crate::model) struct SensorLagOfTurbine<R> {
    time_constant: R,
    rest: R,
    drag: R,
    span: R,
}

impl<R: Real> SensorLagOfTurbine<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            time_constant: next(),
            rest: next(),
            drag: next(),
            span: next(),
        }
    }

    /// What it comes to show of a steady flow: what drives the rotor, the square of the flow, less what its bearings take.
    #[inline(always)]
    fn shown(&self, flow: R) -> R {
        let zero = R::constant(0.0);
        let still = self.drag * self.span;
        let square = flow * flow;
        let turns = flow * (square - still * still).max(zero) / square;
        square.if_positive(turns, zero)
    }
}

impl<R: Real> Act<R> for SensorLagOfTurbine<R> {
    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = self.shown(value);
    }

    /// The rate is that of the mean flow of the step.
    #[inline(always)]
    fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
        let through = R::constant(0.5) * (before.abs() + after.abs());
        let time_constant = self.time_constant * self.span / (through + self.rest * self.span);
        let (before, after) = (self.shown(before), self.shown(after));
        own[0] = lagged(own[0], before, after, time_constant, step);
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        self.time_constant.if_positive(own[0], value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turbine_comes_to_a_steady_flow_the_faster_the_larger_that_is() {
        let after = |flow: f64| {
            let mut values = [0.02, 0.1, 0.2, 50.0].into_iter();
            let effect: SensorLagOfTurbine<f64> =
                SensorLagOfTurbine::new(|| values.next().unwrap());
            let mut own = [30.0];
            for _ in 0..10 {
                effect.filter(&mut own, flow, flow, 1e-3);
            }
            own[0]
        };
        for (flow, rate) in [(45.0f64, 50.0), (-20.0, 25.0), (5.0, 10.0)] {
            let shown = flow * (1.0 - (10.0 / flow).powi(2)).max(0.0);
            let exact = shown + (30.0 - shown) * (-0.01f64 * rate).exp();
            assert!((after(flow) - exact).abs() < 1e-9, "{flow}");
        }
    }

    #[test]
    fn of_second_order_a_ramp_is_late_by_twice_the_damping_over_the_rate() {
        let mut values = [20.0, 0.7, 1.0].into_iter();
        let effect: SensorLagOfSecondOrder<f64> =
            SensorLagOfSecondOrder::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 0.0);
        for k in 0..500 {
            let now = f64::from(k) * 1e-3;
            effect.filter(&mut own, now, now + 1e-3, 1e-3);
        }
        let late = 2.0 * 0.7 / (20.0 * std::f64::consts::TAU);
        assert!((own[0] - (0.5 - late)).abs() < 1e-6 && (own[1] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_ramp_is_late_by_the_time_constant() {
        let mut values = [0.02].into_iter();
        let effect: SensorLag<f64> = SensorLag::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled(&mut own, 0.0);
        // On a ramp of 1 per second it ends 0.02 s late.
        for k in 0..40 {
            let now = f64::from(k) * 0.01;
            effect.filter(&mut own, now, now + 0.01, 0.01);
        }
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        let exact = 0.4 - 0.02 * (1.0 - (-20.0f64).exp());
        assert!((effect.measure(&own, 0.4, &moment) - exact).abs() < 1e-6);
    }
}
