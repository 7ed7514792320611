//! The supply gives way under flow.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port, Scale};
use crate::model::{Output, Pace, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "supply_droop",
    port: Port::Flow,
    summary: "The supply pressure falls with the flow that is drawn",
    finding: "the supply pressure falls by {supply_droop} of flow that is drawn",
    equation: "p = p0 - supply_droop q, supply_lag dq/dt + q = |Q|",
    shows: "flow missing in proportion to its square, later than the flow itself; nothing of it is left against measured pressures",
    confused: "gain_curvature, which does not lag; viscosity_drift, which does not come back",
    source: "pump and line characteristics; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        vec![
            Parameter::linear(
                "supply_droop",
                "bar/(L/min)",
                0.0,
                0.0,
                2.0 * scale.rated_drop / scale.outputs[Output::Flow],
            ),
            lag("supply_lag", scale),
        ]
    },
    trials: |scale, _| {
        [
            (0.05, 20.0),
            (0.05, 200.0),
            (0.4, 5.0),
            (0.4, 50.0),
            (0.4, 400.0),
        ]
        .map(|(share, rows)| {
            let droop = share * scale.rated_drop / scale.outputs[Output::Flow];
            vec![droop, rows * scale.interval]
        })
        .to_vec()
    },
    imitated_by: &[],
    states: &["drawn"],
    neutral: &[],
    applies: host::has_a_rated_drop,
    outputs: None,
    view: Some(View::new(
        view::triangle(9.0, 2.0, 2),
        Over::Flow,
        Values::Trial(3),
    )),
    frequency: None,
};

/// The lag with which a supply feels what is drawn from it.
fn lag(name: &str, scale: &Scale) -> Parameter {
    let interval = scale.interval;
    Parameter::log(name, "s", interval, 20.0 * interval, 2e3 * interval).paced(Pace::TimeConstant)
}

/// The supply pressure falls with the flow that is drawn.
#[derive(Debug, Clone)]
pub(in crate::model) struct SupplyDroop<R> {
    droop: R,
    lag: R,
}

impl<R: Real> SupplyDroop<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            droop: next(),
            lag: next(),
        }
    }
}

impl<R: Real> Act<R> for SupplyDroop<R> {
    #[inline(always)]
    fn supply(&self, own: &[R], supply: R) -> R {
        (supply - self.droop * own[0]).max(R::constant(0.01) * supply)
    }

    #[inline(always)]
    fn drawn(&self, own: &[R], flow: R, slope: &mut [R]) {
        slope[0] = (flow.abs() - own[0]) / self.lag;
    }

    #[inline(always)]
    fn settled_supply(&self, own: &mut [R], flow: R) {
        own[0] = flow.abs();
    }
}

pub(super) const TURBULENT: Entry = Entry {
    name: "supply_droop~turbulent",
    summary: "The supply pressure falls with the square of the flow that is drawn",
    finding: "the supply pressure falls by {supply_droop_turbulent} where the largest flow is drawn, and with its square",
    equation: "p = p0 - supply_droop_turbulent (q / supply_flow)^2, supply_lag_turbulent dq/dt + q = |Q|",
    shows: "flow missing in proportion to its cube, later than the flow itself; nothing of it is left against measured pressures",
    confused: "supply_droop, whose pressure falls with the flow; gain_curvature, which does not lag",
    source: "turbulent losses of lines and filters; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        let flow = scale.outputs[Output::Flow];
        vec![
            Parameter::linear("supply_droop_turbulent", "bar", 0.0, 0.0, scale.rated_drop),
            lag("supply_lag_turbulent", scale),
            Parameter::linear("supply_flow", "L/min", 0.0, flow, flow).fixed(),
        ]
    },
    trials: |scale, _| {
        [(0.05, 20.0), (0.3, 2.0), (0.3, 50.0), (0.3, 400.0)]
            .map(|(share, rows)| vec![share * scale.rated_drop, rows * scale.interval])
            .to_vec()
    },
    states: &["drawn_turbulent"],
    ..ENTRY
};

/// The supply pressure falls with the square of the flow that is drawn.
#[derive(Debug, Clone)]
pub(in crate::model) struct SupplyDroopTurbulent<R> {
    droop: R,
    felt: SupplyDroop<R>,
}

impl<R: Real> SupplyDroopTurbulent<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let (droop, lag, flow) = (next(), next(), next());
        Self {
            droop: droop / (flow * flow),
            felt: SupplyDroop { droop, lag },
        }
    }
}

impl<R: Real> Act<R> for SupplyDroopTurbulent<R> {
    #[inline(always)]
    fn supply(&self, own: &[R], supply: R) -> R {
        (supply - self.droop * own[0] * own[0]).max(R::constant(0.01) * supply)
    }

    #[inline(always)]
    fn drawn(&self, own: &[R], flow: R, slope: &mut [R]) {
        self.felt.drawn(own, flow, slope);
    }

    #[inline(always)]
    fn settled_supply(&self, own: &mut [R], flow: R) {
        self.felt.settled_supply(own, flow);
    }
}

pub(super) const LIMITED: Entry = Entry {
    name: "supply_droop~limited",
    summary: "The supply pressure falls with the flow that is drawn, and on and on while that is more than the pump delivers",
    finding: "the supply pressure falls by {supply_droop_limited} of flow that is drawn, and on while more than {pump_flow} is",
    equation: "p = p0 - supply_droop_limited q, supply_lag_limited dq/dt = |Q| - min(q, pump_flow)",
    shows: "flow that fades during long strokes of large openings, and comes back after them as if it were pumped up again",
    confused: "supply_droop, which comes to rest; flow_saturation, which is there at once",
    source: "a pump that delivers all it can into an accumulator: Merritt, Hydraulic Control Systems, 1967; pressure-compensated pumps",
    parameters: |scale, _| {
        of_a_pump(
            ["supply_droop_limited", "supply_lag_limited", "pump_flow"],
            scale,
        )
        .into()
    },
    trials: |scale, _| {
        let flow = scale.outputs[Output::Flow];
        // What a supply feels is half of the largest flow, or less: of a pump that delivers more nothing shows.
        [
            (0.1, 20.0, 0.7),
            (0.1, 100.0, 0.3),
            (0.4, 100.0, 0.3),
            (0.4, 100.0, 0.7),
            (0.4, 400.0, 0.3),
        ]
        .map(|(share, rows, pump)| {
            let droop = share * scale.rated_drop / flow;
            vec![droop, rows * scale.interval, pump * flow]
        })
        .to_vec()
    },
    states: &["drawn_from_pump"],
    ..ENTRY
};

/// What a supply has whose pump delivers no more: how far it falls, how late, and its pump's flow.
fn of_a_pump([droop, late, pump]: [&str; 3], scale: &Scale) -> [Parameter; 3] {
    let flow = scale.outputs[Output::Flow];
    let most = 2.0 * scale.rated_drop / flow;
    [
        Parameter::linear(droop, "bar/(L/min)", 0.0, 0.0, most),
        lag(late, scale),
        Parameter::log(pump, "L/min", 0.05 * flow, 3.0 * flow, 3.0 * flow),
    ]
}

/// The supply pressure falls on while more is drawn than its pump delivers.
#[derive(Debug, Clone)]
pub(in crate::model) struct SupplyDroopLimited<R> {
    felt: SupplyDroop<R>,
    pump: R,
}

impl<R: Real> SupplyDroopLimited<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            felt: SupplyDroop::new(&mut next),
            pump: next(),
        }
    }
}

impl<R: Real> Act<R> for SupplyDroopLimited<R> {
    #[inline(always)]
    fn supply(&self, own: &[R], supply: R) -> R {
        self.felt.supply(own, supply)
    }

    #[inline(always)]
    fn drawn(&self, own: &[R], flow: R, slope: &mut [R]) {
        slope[0] = (flow.abs() - own[0].min(self.pump)) / self.felt.lag;
    }

    #[inline(always)]
    fn settled_supply(&self, own: &mut [R], flow: R) {
        self.felt.settled_supply(own, flow);
    }
}

pub(super) const ACCUMULATOR: Entry = Entry {
    name: "supply_droop~accumulator",
    summary: "An accumulator delivers what the pump does not: its gas is the softer the lower the pressure",
    finding: "the supply pressure falls by {supply_droop_accumulator} of flow that is drawn, and on while more than {pump_flow_at_most} is, \
              ever more slowly",
    equation: "p = p0 - supply_droop_accumulator q, supply_lag_accumulator dq/dt = (|Q| - min(q, pump_flow_at_most)) (p / p0)^1.75",
    shows: "flow that fades during long strokes of large openings, and comes back the more slowly the lower the pressure has become",
    confused: "supply_droop~limited, whose volume is as stiff at any pressure; flow_saturation, which is there at once",
    source: "gas of an accumulator, p V^n constant with n = 4/3, between slow and fast, filled by a pressure-compensated pump: Merritt, \
             Hydraulic Control Systems, 1967; Murrenhoff, Grundlagen der Fluidtechnik",
    parameters: |scale, _| {
        let names = [
            "supply_droop_accumulator",
            "supply_lag_accumulator",
            "pump_flow_at_most",
        ];
        let drop = scale.rated_drop;
        let charge = Parameter::linear("charge_pressure", "bar", 0.0, drop, drop).fixed();
        of_a_pump(names, scale)
            .into_iter()
            .chain([charge])
            .collect()
    },
    trials: |scale, _| (LIMITED.trials)(scale, None),
    states: &["drawn_from_accumulator"],
    ..ENTRY
};

/// The supply pressure falls on while more is drawn than its pump delivers, and the gas of its accumulator becomes softer.
#[derive(Debug, Clone)]
pub(in crate::model) struct SupplyDroopOfAccumulator<R> {
    limited: SupplyDroopLimited<R>,
    charge: R,
}

impl<R: Real> SupplyDroopOfAccumulator<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            limited: SupplyDroopLimited::new(&mut next),
            charge: next(),
        }
    }
}

impl<R: Real> Act<R> for SupplyDroopOfAccumulator<R> {
    #[inline(always)]
    fn supply(&self, own: &[R], supply: R) -> R {
        self.limited.supply(own, supply)
    }

    #[inline(always)]
    fn drawn(&self, own: &[R], flow: R, slope: &mut [R]) {
        self.limited.drawn(own, flow, slope);
        let left = self.supply(own, self.charge) / self.charge;
        slope[0] = slope[0] * left * (left * left.sqrt()).sqrt();
    }

    #[inline(always)]
    fn settled_supply(&self, own: &mut [R], flow: R) {
        self.limited.settled_supply(own, flow);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gas_of_an_accumulator_gives_way_with_its_pressure() {
        let mut values = [0.05, 0.02, 30.0, 10.0].into_iter();
        let effect: SupplyDroopOfAccumulator<f64> =
            SupplyDroopOfAccumulator::new(|| values.next().unwrap());
        let mut slope = [0.0];
        // What p V^(4/3) = constant leaves of a volume of 1 at 10 bar: V = (p0 / p)^(3/4), dp = -4/3 p / V dV.
        effect.drawn(&[80.0], 40.0, &mut slope);
        let pressure: f64 = 10.0 - 0.05 * 80.0;
        let volume = (10.0 / pressure).powf(0.75);
        let expected = 500.0 * (pressure / volume) / 10.0;
        assert!((slope[0] - expected).abs() < 1e-9, "{slope:?} {expected}");
        assert_eq!(effect.supply(&[80.0], 10.0), pressure);
    }

    #[test]
    fn a_turbulent_loss_falls_with_the_square() {
        let mut values = [4.0, 0.02, 40.0].into_iter();
        let effect: SupplyDroopTurbulent<f64> =
            SupplyDroopTurbulent::new(|| values.next().unwrap());
        assert_eq!(effect.supply(&[40.0], 10.0), 6.0);
        assert_eq!(effect.supply(&[20.0], 10.0), 9.0);
        assert_eq!(effect.supply(&[400.0], 10.0), 0.1);
    }

    #[test]
    fn beyond_what_its_pump_delivers_the_supply_falls_on() {
        let mut values = [0.05, 0.02, 30.0].into_iter();
        let effect: SupplyDroopLimited<f64> = SupplyDroopLimited::new(|| values.next().unwrap());
        let rate = |felt: f64, flow: f64| {
            let mut slope = [0.0];
            effect.drawn(&[felt], flow, &mut slope);
            slope[0]
        };
        assert_eq!(rate(20.0, -20.0), 0.0);
        assert!((rate(80.0, 40.0) - 500.0).abs() < 1e-9);
        assert!((rate(80.0, 10.0) + 1000.0).abs() < 1e-9);
        assert_eq!(effect.supply(&[40.0], 10.0), 8.0);
    }

    #[test]
    fn the_supply_falls_with_the_flow_that_it_feels() {
        let mut values = [0.05, 0.02].into_iter();
        let effect: SupplyDroop<f64> = SupplyDroop::new(|| values.next().unwrap());
        let mut own = [0.0];
        effect.settled_supply(&mut own, -40.0);
        assert_eq!(effect.supply(&own, 10.0), 8.0);
        let rate = |flow| {
            let mut slope = [0.0];
            effect.drawn(&own, flow, &mut slope);
            slope[0]
        };
        assert_eq!(rate(-40.0), 0.0);
        assert!((rate(20.0) + 1000.0).abs() < 1e-9);
    }
}
