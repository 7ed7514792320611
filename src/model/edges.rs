//! The four metering edges of a spool near its null: what passes where the lands just meet.
//!
//! Between two corners, rounded by a radius r together, that stand h apart along the spool and c across it, the gap is
//! `√((h + r)² + (c + r)²) − r` where h > −r and c where they overlap: far open it is h, and where they overlap oil passes through
//! a clearance of the length −(h + r). An edge of width w passes
//!
//! ```text
//! Δp = ρ/2 (q / (Cd w gap))² + 12 ρν q length / (w c³)
//! ```
//!
//! a sharp orifice and the laminar flow through a long clearance in series (Merritt, Hydraulic Control Systems, 1967).

use super::Real;
use super::declare::Declare;
use super::four_ports::{OrificeFlows, Pressures};
use crate::model::Parameter;

/// The edges, by the ports that they connect.
const NAMES: [&str; 4] = ["pa", "at", "pb", "bt"];
/// Which of them open with a positive spool.
const OPENS_WITH: [f64; 4] = [1.0, -1.0, -1.0, 1.0];
/// What the pilot stage draws from the supply, L/min.
pub const PILOT_FLOW: &str = "pilot_flow";

/// Of the drop from P to T, the least that is left at either side of a meter between A and B.
const LEAST_SHARE: f64 = 1e-9;
/// (bar)²: keeps the root of no drop at all from having no slope.
const NO_DROP: f64 = 1e-12;

/// The parameter of edge `number`, %.
pub fn edge_name(number: usize, what: &str) -> String {
    format!("edge_{}_{what}", NAMES[number])
}

/// One edge, in % of the spool's stroke from null to full opening.
#[derive(Debug, Clone, Copy)]
struct Edge<R> {
    /// How far the spool has to move before its corners meet; below zero it is open at null.
    position: R,
    clearance: R,
    radius: R,
}

/// What an edge passes at an opening: Δp = q²/conductance + q · resistance, in bar and L/min.
#[derive(Debug, Clone, Copy)]
struct Passage<R> {
    conductance: R,
    resistance: R,
}

impl<R: Real> Passage<R> {
    /// Of two in series.
    #[inline(always)]
    fn then(self, other: Self) -> Self {
        let (one, two) = (self.conductance, other.conductance);
        Self {
            conductance: one * two / (one + two),
            resistance: self.resistance + other.resistance,
        }
    }

    /// √(resistance² + 4 |drop| / conductance)
    #[inline(always)]
    fn root(self, drop: R) -> R {
        let square = R::constant(4.0) * drop.abs() / self.conductance;
        (self.resistance * self.resistance + square + R::constant(NO_DROP)).sqrt()
    }

    /// What passes under a `drop`, L/min.
    #[inline(always)]
    fn flow(self, drop: R) -> R {
        R::constant(2.0) * drop / (self.resistance + self.root(drop))
    }

    /// How much more passes under a larger `drop`, L/min/bar.
    #[inline(always)]
    fn slope(self, drop: R) -> R {
        R::constant(1.0) / self.root(drop)
    }

    /// The drop under which `flow` passes, bar.
    #[inline(always)]
    fn drop(self, flow: R) -> R {
        flow * flow / self.conductance + flow * self.resistance
    }
}

/// Pressures and return flow of a valve whose ports A and B are blocked.
#[derive(Debug, Clone, Copy)]
pub struct Blocked<R> {
    /// At port A, bar.
    pub a: R,
    /// At port B, bar.
    pub b: R,
    /// From T, with what the pilot stage draws, L/min.
    pub return_flow: R,
}

/// The four edges of a valve.
#[derive(Debug, Clone)]
pub struct Edges<R> {
    edges: [Edge<R>; 4],
    /// (L/min)²/bar of a gap of 1 %.
    conductance: R,
    /// bar/(L/min) of a clearance of 1 % over a length of 1 %.
    resistance: R,
    pilot_flow: R,
}

impl<R: Real> Edges<R> {
    /// Those of a valve with `area` m² at full opening, a discharge `coefficient` Cd √(2/ρ), and oil of the dynamic viscosity
    /// `viscosity`, Pa s.
    #[inline(always)]
    pub fn new(area: R, coefficient: R, viscosity: R, parameters: &mut dyn Declare<R>) -> Self {
        let mut take = |declare: &dyn Fn() -> Parameter| parameters.parameter(declare);
        let edges = std::array::from_fn(|i| Edge {
            position: take(&|| Parameter::linear(&edge_name(i, "position"), "%", -30.0, 0.0, 30.0)),
            clearance: take(&|| Parameter::log(&edge_name(i, "clearance"), "%", 0.05, 0.4, 5.0)),
            radius: take(&|| Parameter::log(&edge_name(i, "radius"), "%", 0.02, 0.4, 5.0)),
        });
        let pilot_flow = take(&|| Parameter::linear(PILOT_FLOW, "L/min", 0.0, 0.0, 10.0));
        // In metres from null to full opening: how long a clearance is only shows in what passes through it.
        let stroke = take(&|| Parameter::log("stroke", "mm", 0.05, 0.5, 20.0).fixed());
        // m³/s and Pa to L/min and bar; 1 % of the stroke.
        let one = area * coefficient * R::constant(0.01 * 6e4 * 1e5f64.sqrt());
        // 12 μ (stroke/100) / ((area/stroke) (stroke/100)³) Pa s/m³, in bar/(L/min).
        let clearance = R::constant(12.0 * 1e4 / 1e-3 / 1e5 / 6e4) * viscosity;
        Self {
            edges,
            conductance: (one * one).named("edge_conductance"),
            resistance: (clearance / (area * stroke)).named("edge_resistance"),
            pilot_flow,
        }
    }

    /// What edge `number` passes where the spool is at `x` %.
    #[inline(always)]
    fn passage(&self, number: usize, x: R) -> Passage<R> {
        let zero = R::constant(0.0);
        let Edge {
            position,
            clearance,
            radius,
        } = self.edges[number];
        let ahead = x * R::constant(OPENS_WITH[number]) - position + radius;
        let (open, length) = (ahead.max(zero), (-ahead).max(zero));
        let across = clearance + radius;
        let gap = (open * open + across * across).sqrt() - radius;
        let cube = clearance * clearance * clearance;
        Passage {
            conductance: self.conductance * gap * gap,
            resistance: self.resistance * length / cube,
        }
    }

    /// What each edge passes where the spool is at `x` %.
    #[inline(always)]
    fn passages(&self, x: R) -> [Passage<R>; 4] {
        [
            self.passage(0, x),
            self.passage(1, x),
            self.passage(2, x),
            self.passage(3, x),
        ]
    }

    /// The flows for a spool at `x` %, L/min, with these pressures at all four ports.
    #[inline(always)]
    pub fn flows(&self, x: R, pressures: &Pressures<R>) -> OrificeFlows<R> {
        R::outlined(
            #[inline(always)]
            || self.flows_between(x, pressures),
        )
    }

    #[inline(always)]
    fn flows_between(&self, x: R, pressures: &Pressures<R>) -> OrificeFlows<R> {
        let [pa, at, pb, bt] = self.passages(x);
        OrificeFlows {
            pa: pa.flow(pressures.supply - pressures.a),
            at: at.flow(pressures.a - pressures.tank),
            pb: pb.flow(pressures.supply - pressures.b),
            bt: bt.flow(pressures.b - pressures.tank),
            pt: self.pilot_flow,
        }
    }

    /// The same where A and B are connected by a meter that takes no pressure: both have the one at which what enters from P
    /// leaves to T.
    #[inline(always)]
    pub fn connected_flows(&self, x: R, supply: R, tank: R) -> OrificeFlows<R> {
        R::outlined(
            #[inline(always)]
            || self.flows_through(x, supply, tank),
        )
    }

    #[inline(always)]
    fn flows_through(&self, x: R, supply: R, tank: R) -> OrificeFlows<R> {
        let [pa, at, pb, bt] = self.passages(x);
        let drop = supply - tank;
        let half = R::constant(0.5) * drop;
        let (entering, leaving) = (pa.flow(half) + pb.flow(half), at.flow(half) + bt.flow(half));
        // As if all were turbulent, and from there by Newton's method.
        let (least, most) = (R::constant(LEAST_SHARE), R::constant(1.0));
        let squares = entering * entering + leaving * leaving + R::constant(1e-20);
        let mut share = (leaving * leaving / squares).clamp(least, most);
        for _ in 0..3 {
            let (before, after) = (share * drop, drop - share * drop);
            let excess = pa.flow(before) + pb.flow(before) - at.flow(after) - bt.flow(after);
            let slope = pa.slope(before) + pb.slope(before) + at.slope(after) + bt.slope(after);
            let step = excess / (slope * (drop.abs() + R::constant(1e-9)));
            share = (share - step).clamp(least, most);
        }
        let (before, after) = (share * drop, drop - share * drop);
        OrificeFlows {
            pa: pa.flow(before),
            at: at.flow(after),
            pb: pb.flow(before),
            bt: bt.flow(after),
            pt: self.pilot_flow,
        }
    }

    /// Pressures and return flow for a spool at `x` % where A and B are blocked: what enters either port from P leaves it to T.
    #[inline(always)]
    pub fn blocked(&self, x: R, supply: R, tank: R) -> Blocked<R> {
        R::outlined(
            #[inline(always)]
            || self.behind_plugs(x, supply, tank),
        )
    }

    #[inline(always)]
    fn behind_plugs(&self, x: R, supply: R, tank: R) -> Blocked<R> {
        let [pa, at, pb, bt] = self.passages(x);
        let drop = supply - tank;
        let a = pa.then(at).flow(drop);
        let b = pb.then(bt).flow(drop);
        Blocked {
            a: (tank + at.drop(a)).named("blocked_a"),
            b: (tank + bt.drop(b)).named("blocked_b"),
            return_flow: (self.pilot_flow + a + b).named("blocked_return"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Complete;
    use crate::model::declare::{Given, Listing};
    use crate::model::valve::{Valve, ValveForm};
    use proptest::prelude::*;

    /// 0.1 cm², Cd = 0.7 and mineral oil.
    const AREA: f64 = 1e-5;

    /// Position, clearance and radius of P-A, A-T, P-B and B-T.
    fn edges(values: [[f64; 3]; 4], pilot_flow: f64) -> Edges<f64> {
        let coefficient = 0.7 * (2.0 / 850.0f64).sqrt();
        let viscosity = 850.0 * 18e-6;
        let mut listing = Listing::default();
        Edges::new(AREA, coefficient, viscosity, &mut listing);
        let mut given: Vec<f64> = values.concat();
        given.extend([pilot_flow, 0.5]);
        assert_eq!(given.len(), listing.0.len());
        let values = Complete::from_iter(given);
        Edges::new(AREA, coefficient, viscosity, &mut Given::new(&values))
    }

    #[test]
    fn four_equal_edges_leave_both_ports_midway() {
        for values in [[0.0, 0.4, 0.3], [2.0, 0.4, 0.0], [-1.0, 0.2, 1.0]] {
            let blocked = edges([values; 4], 0.2).blocked(0.0, 210.0, 10.0);
            assert!((blocked.a - 110.0).abs() < 1e-9 && (blocked.b - 110.0).abs() < 1e-9);
            assert!(blocked.return_flow > 0.2);
        }
    }

    #[test]
    fn open_edges_divide_the_pressure_as_their_areas_do() {
        // Underlapped by 3, 2, 4 and 1 % with sharp corners and hardly a clearance.
        let laps = [3.0, 2.0, 4.0, 1.0];
        let edges = edges(laps.map(|lap| [-lap, 0.001, 0.0]), 0.0);
        for x in [-0.8, 0.0, 0.5] {
            let [pa, at, pb, bt] = [laps[0] + x, laps[1] - x, laps[2] - x, laps[3] + x];
            let blocked = edges.blocked(x, 200.0, 20.0);
            let port = |inlet: f64, outlet: f64| {
                20.0 + 180.0 * inlet * inlet / (inlet * inlet + outlet * outlet)
            };
            assert!((blocked.a - port(pa, at)).abs() < 1e-3, "{x}: {blocked:?}");
            assert!((blocked.b - port(pb, bt)).abs() < 1e-3, "{x}: {blocked:?}");
            let passes = |gap: f64, drop: f64| {
                0.7 * AREA * gap / 100.0 * (2.0 / 850.0 * drop * 1e5f64).sqrt() * 6e4
            };
            let expected = passes(pa, 200.0 - port(pa, at)) + passes(pb, 200.0 - port(pb, bt));
            assert!(
                (blocked.return_flow / expected - 1.0).abs() < 1e-5,
                "{x}: {blocked:?} {expected}"
            );
        }
    }

    #[test]
    fn a_long_overlap_passes_what_a_long_clearance_does() {
        // 10 % of 0.5 mm overlapped, 0.4 % across: 50 µm and 2 µm; the width is area over stroke.
        let [pa, ..] = edges([[10.0, 0.4, 0.0]; 4], 0.0).passages(0.0);
        let expected =
            (AREA / 0.5e-3) * 2e-6f64.powi(3) * 1e5 / (12.0 * 850.0 * 18e-6 * 50e-6) * 6e4;
        assert!(
            (pa.flow(1.0) / expected - 1.0).abs() < 1e-3,
            "{} {expected}",
            pa.flow(1.0)
        );
    }

    #[test]
    fn far_from_null_the_valve_is_a_linear_one() {
        let flow = |form: &ValveForm, x: f64| {
            let mut parameters = form.parameters();
            for parameter in &mut parameters {
                let value = match parameter.name.as_str() {
                    "max_area" => 0.1,
                    "rated_drop" => 70.0,
                    _ => parameter.nominal(),
                };
                parameter.set_nominal(value);
            }
            let pressures = Pressures {
                supply: 0.0,
                tank: 0.0,
                a: 0.0,
                b: 0.0,
            };
            Valve::new(form, &mut Given::new(&Complete::nominal(&parameters))).flow(x, &pressures)
        };
        let edges = ValveForm {
            area: crate::model::valve::AreaLaw::Edges,
            ..ValveForm::linear()
        };
        for x in [-100.0, -40.0, 60.0, 100.0] {
            let linear = flow(&ValveForm::linear(), x);
            assert!(
                (flow(&edges, x) / linear - 1.0).abs() < 1e-3,
                "{x}: {linear}"
            );
        }
    }

    proptest! {
        #[test]
        fn what_enters_a_port_leaves_it(
            values in proptest::array::uniform4((-5.0..5.0f64, 0.05..2.0f64, 0.0..3.0f64)),
            x in -10.0..10.0f64,
            supply in 20.0..350.0f64,
            tank in 0.0..10.0f64,
        ) {
            let edges = edges(values.map(|(position, clearance, radius)| [position, clearance, radius]), 0.0);
            let Blocked { a, b, return_flow } = edges.blocked(x, supply, tank);
            let blocked = edges.flows(x, &Pressures { supply, tank, a, b });
            // A pressure is rounded to 1e-13 bar, and under so small a drop an open edge passes up to 5e-7 L/min.
            let same = |one: f64, other: f64| (one - other).abs() < 1e-6 * (1.0 + one);
            prop_assert!(same(blocked.pa, blocked.at), "{blocked:?}");
            prop_assert!(same(blocked.pb, blocked.bt), "{blocked:?}");
            prop_assert!(same(return_flow, blocked.at + blocked.bt), "{blocked:?}");
            let open = edges.connected_flows(x, supply, tank);
            let (enters, leaves) = (open.pa + open.pb, open.at + open.bt);
            prop_assert!((enters - leaves).abs() < 1e-3 * enters + 1e-4, "{open:?}");
        }
    }
}
