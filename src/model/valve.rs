//! The four-way valve: paper eq. 2-3 and Simscape's "4-Way Directional Valve".

use super::declare::{Declare, Listing};
use super::edges::{Blocked, Edges};
pub use super::four_ports::{OrificeFlows, Pressures};
use super::orifice::{Orifice, Transition};
use super::{Parameter, Real};
use serde::{Deserialize, Serialize};

const PASCAL_PER_BAR: f64 = 1e5;
const SQUARE_METRES_PER_SQUARE_CENTIMETRE: f64 = 1e-4;
const SQUARE_METRES_PER_SECOND_PER_CENTISTOKES: f64 = 1e-6;
const LITRES_PER_MINUTE: f64 = 6e4;

/// Discharge coefficient of all orifices.
pub const DISCHARGE_COEFFICIENT: &str = "discharge_coefficient";
/// Density of the oil, kg/m3.
pub const DENSITY: &str = "density";
/// Kinematic viscosity of the oil, cSt.
pub const VISCOSITY: &str = "viscosity";
/// Pressure drop from P to T where none is measured, bar.
pub const RATED_DROP: &str = "rated_drop";
/// Area at full opening, cm2.
pub const MAX_AREA: &str = "max_area";
/// The parameter that is the area of a closed edge.
pub(crate) const LEAKAGE_AREA: &str = "leakage_area";
/// The parameter that is the opening at the spool's zero.
pub(crate) const OPENING_OFFSET: &str = "opening_offset";

/// The parameter that is the area at opening `number` of a table, cm2.
pub fn area_name(number: usize) -> String {
    format!("area_{}", number + 1)
}

/// How the orifice area follows from the opening.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AreaLaw {
    /// A = h · A_max / h_max for 0 < h < h_max (paper eq. 2 with the opening that it drops).
    Linear,
    /// A = h · A_max / h_max for every h > 0: a spool that passes full scale opens its ports further.
    Proportional,
    /// Linear interpolation between an area at each of these openings (% of full scale, strictly rising, at least
    /// four); beyond the ends the end value holds.
    Table(Vec<f64>),
    /// Linear interpolation between a signed area at each of these openings, which are below zero on one side: above zero it
    /// is that of P-A and B-T, below zero that of P-B and A-T. What is measured on both sides need not be the same on both.
    Signed(Vec<f64>),
    /// As [`AreaLaw::Linear`] far from null, and near it as the position, clearance and radius of each of the four edges make
    /// it: see [`edges`](super::edges). What tests with blocked ports show.
    Edges,
}

/// How many orifices the valve has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Orifices {
    /// P-A, A-T, P-B and B-T.
    #[default]
    Four,
    /// Two more, P-T1 (opening with −x) and T1-T (opening with +x), in series: the centre path of the paper's valve.
    Six,
}

/// Where the flow meter sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Meter {
    /// In the loop between A and B: the load flow, positive from A to B.
    #[default]
    Load,
    /// In the pressure line.
    Supply,
}

/// Which pressures drive the flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drop {
    /// None is measured: the parameter `rated_drop` from P to T, half of it at each land.
    #[default]
    Rated,
    /// Supply (and return) measured; A and B midway between them.
    Supply,
    /// All four ports measured.
    Ports,
}

/// What a valve consists of. Which parameters it has follows: [`ValveForm::parameters`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with the form of a valve")]
pub struct ValveForm {
    /// Area over opening.
    pub area: AreaLaw,
    /// Four or six orifices.
    #[serde(default)]
    pub orifices: Orifices,
    /// Where the flow turns laminar.
    #[serde(default)]
    pub transition: Transition,
    /// Where the flow is measured.
    #[serde(default)]
    pub meter: Meter,
    /// Which pressures are measured.
    #[serde(default)]
    pub drop: Drop,
}

impl ValveForm {
    /// A valve with linear area, four orifices and a load flow at rated pressure drop.
    pub fn linear() -> Self {
        Self {
            area: AreaLaw::Linear,
            orifices: Orifices::default(),
            transition: Transition::default(),
            meter: Meter::default(),
            drop: Drop::default(),
        }
    }

    /// The same with an area table over `openings` in %.
    pub fn table(openings: &[f64]) -> Self {
        Self {
            area: AreaLaw::Table(openings.to_vec()),
            ..Self::linear()
        }
    }

    /// The same with a table of signed areas over `openings` in %.
    pub fn signed(openings: &[f64]) -> Self {
        Self {
            area: AreaLaw::Signed(openings.to_vec()),
            ..Self::linear()
        }
    }

    /// The parameters that [`Valve::new`] declares.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut listing = Listing::default();
        Valve::new(self, &mut listing);
        listing.0
    }
}

#[derive(Debug, Clone)]
enum Areas<R> {
    Linear {
        max: R,
    },
    Proportional {
        max: R,
    },
    Edges(Edges<R>),
    /// The first area, then slope, start and width of every segment.
    Table {
        first: R,
        segments: Vec<(R, f64, f64)>,
        signed: bool,
    },
}

/// A four-way valve.
#[derive(Debug, Clone)]
pub struct Valve<R> {
    orifice: Orifice<R>,
    areas: Areas<R>,
    leakage: R,
    offset: R,
    rated_drop: Option<R>,
    drop: Drop,
    meter: Meter,
    orifices: Orifices,
}

impl<R: Real> Valve<R> {
    /// The valve of this form. Only Cd·A/√ρ can be told from flow, so the discharge coefficient and the fluid are fixed and
    /// the areas are free.
    #[inline(always)]
    pub fn new(form: &ValveForm, parameters: &mut dyn Declare<R>) -> Self {
        let mut take = |declare: &dyn Fn() -> Parameter| parameters.parameter(declare);
        let linear = Parameter::linear;
        let square_metres = R::constant(SQUARE_METRES_PER_SQUARE_CENTIMETRE);
        let discharge = take(&|| linear(DISCHARGE_COEFFICIENT, "1", 0.4, 0.7, 1.0).fixed());
        let density = take(&|| linear(DENSITY, "kg/m3", 700.0, 850.0, 1200.0).fixed());
        let viscosity = take(&|| Parameter::log(VISCOSITY, "cSt", 1.0, 18.0, 1000.0).fixed());
        let viscosity = viscosity * R::constant(SQUARE_METRES_PER_SECOND_PER_CENTISTOKES);
        let leakage = take(&|| Parameter::log(LEAKAGE_AREA, "cm2", 1e-8, 1e-8, 1e-3).fixed());
        let leakage = (leakage * square_metres).named("leakage");
        let offset = take(&|| linear(OPENING_OFFSET, "%", -20.0, 0.0, 20.0).fixed());
        let rated_drop = (form.drop == Drop::Rated)
            .then(|| take(&|| linear(RATED_DROP, "bar", 1.0, 10.0, 400.0).fixed()));
        let orifice = Orifice::new(form.transition, discharge, density, viscosity);
        let areas = match &form.area {
            AreaLaw::Edges => {
                let max = take(&|| Parameter::log(MAX_AREA, "cm2", 1e-4, 1.0, 100.0));
                let coefficient = discharge * (R::constant(2.0) / density).sqrt();
                let dynamic = density * viscosity;
                Areas::Edges(Edges::new(
                    max * square_metres,
                    coefficient,
                    dynamic,
                    parameters,
                ))
            }
            AreaLaw::Linear | AreaLaw::Proportional => {
                let max = take(&|| Parameter::log(MAX_AREA, "cm2", 1e-4, 1.0, 100.0));
                let max = (max * square_metres).named(MAX_AREA);
                match form.area {
                    AreaLaw::Linear => Areas::Linear { max },
                    _ => Areas::Proportional { max },
                }
            }
            AreaLaw::Table(openings) | AreaLaw::Signed(openings) => {
                let signed = matches!(form.area, AreaLaw::Signed(_));
                let mut area_at = |i: usize| {
                    take(&|| match signed {
                        false => linear(&area_name(i), "cm2", 0.0, 1.0, 100.0),
                        true => {
                            let start = (openings[i] / 100.0).clamp(-1.0, 1.0);
                            linear(&area_name(i), "cm2", -100.0, start, 100.0)
                        }
                    })
                };
                let first = (area_at(0) * square_metres).named("first_area");
                let mut previous = first;
                let segments = openings
                    .windows(2)
                    .enumerate()
                    .map(|(i, pair)| {
                        let area = area_at(i + 1) * square_metres;
                        let width = pair[1] - pair[0];
                        let slope = ((area - previous) / R::constant(width))
                            .named(&format!("slope_{}", i + 1));
                        previous = area;
                        (slope, pair[0], width)
                    })
                    .collect();
                Areas::Table {
                    first,
                    segments,
                    signed,
                }
            }
        };
        Self {
            orifice,
            areas,
            leakage,
            offset,
            rated_drop,
            drop: form.drop,
            meter: form.meter,
            orifices: form.orifices,
        }
    }

    /// The area in m² of an orifice that is open by `opening` %.
    #[inline(always)]
    pub fn area(&self, opening: R) -> R {
        self.curve(opening).max(self.leakage)
    }

    /// The same of an orifice that opens with −x, where the spool is at −`opening` % with the offset of its edge.
    #[inline(always)]
    fn opposite_area(&self, opening: R) -> R {
        match &self.areas {
            Areas::Table { signed: true, .. } => (-self.curve(-opening)).max(self.leakage),
            _ => self.area(opening),
        }
    }

    /// Area over opening, without the leakage that is left where it is closed.
    #[inline(always)]
    fn curve(&self, opening: R) -> R {
        let zero = R::constant(0.0);
        match &self.areas {
            // Their flows follow from pressures and opening together.
            Areas::Edges(_) => zero,
            Areas::Linear { max } => {
                *max * (opening * R::constant(0.01)).clamp(zero, R::constant(1.0))
            }
            Areas::Proportional { max } => *max * (opening * R::constant(0.01)).max(zero),
            Areas::Table {
                first, segments, ..
            } => {
                let mut area = *first;
                for &(slope, start, width) in segments {
                    area = area
                        + slope * (opening - R::constant(start)).clamp(zero, R::constant(width));
                }
                area
            }
        }
    }

    /// The flows for spool position `x` in % of full scale: P-A and B-T open with x, P-B and A-T with −x (eq. 3).
    #[inline(always)]
    pub fn orifice_flows(&self, x: R, pressures: &Pressures<R>) -> OrificeFlows<R> {
        if let Areas::Edges(edges) = &self.areas {
            return edges.flows(self.offset + x, pressures);
        }
        let pascal = R::constant(PASCAL_PER_BAR);
        let litres = R::constant(LITRES_PER_MINUTE);
        let (p, t) = (pressures.supply * pascal, pressures.tank * pascal);
        let (a, b) = (pressures.a * pascal, pressures.b * pascal);
        let forward = self.area(self.offset + x).named("forward_area");
        let backward = self.opposite_area(self.offset - x).named("backward_area");
        let orifice = &self.orifice;
        OrificeFlows {
            pa: orifice.flow(forward, p, a) * litres,
            at: orifice.flow(backward, a, t) * litres,
            pb: orifice.flow(backward, p, b) * litres,
            bt: orifice.flow(forward, b, t) * litres,
            pt: match self.orifices {
                Orifices::Four => R::constant(0.0),
                // Two turbulent orifices in series pass what one of area A1 A2 / √(A1² + A2²) does.
                Orifices::Six => {
                    let series =
                        forward * backward / (forward * forward + backward * backward).sqrt();
                    orifice.flow(series, p, t) * litres
                }
            },
        }
    }

    /// The rated drop, bar, where no pressure is measured.
    #[inline(always)]
    pub fn rated_drop(&self) -> Option<R> {
        self.rated_drop
    }

    /// The measured pressures with those of supply and tank that the flow follows from.
    #[inline(always)]
    pub fn supplied(&self, measured: &Pressures<R>) -> Pressures<R> {
        match self.rated_drop {
            Some(supply) => Pressures {
                supply,
                tank: R::constant(0.0),
                ..*measured
            },
            None => *measured,
        }
    }

    /// What the flow meter shows, L/min, for spool position `x` in % of full scale and the measured pressures in bar.
    #[inline(always)]
    pub fn flow(&self, x: R, measured: &Pressures<R>) -> R {
        let flows = self.flows_from(x, &self.supplied(measured));
        match self.meter {
            Meter::Load => flows.load(),
            Meter::Supply => flows.supply(),
        }
    }

    /// Where the flow meter sits.
    pub fn meter(&self) -> Meter {
        self.meter
    }

    /// Pressures and return flow where A and B are blocked; `None` of a valve without edges, in whose closed lands nothing moves.
    #[inline(always)]
    pub fn blocked(&self, x: R, supplied: &Pressures<R>) -> Option<Blocked<R>> {
        match &self.areas {
            Areas::Edges(edges) => {
                Some(edges.blocked(self.offset + x, supplied.supply, supplied.tank))
            }
            _ => None,
        }
    }

    /// The flows through the orifices, from the pressures of supply and tank, and of the ports where they are measured.
    #[inline(always)]
    pub fn flows_from(&self, x: R, supplied: &Pressures<R>) -> OrificeFlows<R> {
        if let (Areas::Edges(edges), Drop::Rated | Drop::Supply) = (&self.areas, self.drop) {
            return edges.connected_flows(self.offset + x, supplied.supply, supplied.tank);
        }
        let pressures = match self.drop {
            Drop::Ports => *supplied,
            Drop::Rated | Drop::Supply => {
                let middle = (supplied.supply + supplied.tank) * R::constant(0.5);
                Pressures {
                    a: middle,
                    b: middle,
                    ..*supplied
                }
            }
        };
        self.orifice_flows(x, &pressures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Complete;
    use crate::model::declare::Given;

    const RATED: Pressures<f64> = Pressures {
        supply: 0.0,
        tank: 0.0,
        a: 0.0,
        b: 0.0,
    };

    fn valve(form: &ValveForm, change: &[(&str, f64)]) -> Valve<f64> {
        let mut parameters = form.parameters();
        for (name, value) in change {
            parameters
                .iter_mut()
                .find(|p| p.name == *name)
                .expect("a parameter of the form")
                .set_nominal(*value);
        }
        let values = Complete::nominal(&parameters);
        Valve::new(form, &mut Given::new(&values))
    }

    #[test]
    fn the_load_flow_is_odd_in_the_spool_position() {
        for orifices in [Orifices::Four, Orifices::Six] {
            let valve = valve(
                &ValveForm {
                    orifices,
                    ..ValveForm::linear()
                },
                &[],
            );
            for x in [0.0, 0.3, 12.0, 99.0, 150.0] {
                assert_eq!(valve.flow(x, &RATED), -valve.flow(-x, &RATED));
            }
        }
    }

    #[test]
    fn linear_area_at_rated_drop_is_the_closed_form() {
        let valve = valve(&ValveForm::linear(), &[("max_area", 7.598)]);
        let full = 0.7 * 7.598e-4 * (2.0 / 850.0 * 5e5f64).sqrt() * 6e4;
        for x in [10.0, 50.0, 100.0, 130.0] {
            let expected = full * f64::min(x / 100.0, 1.0);
            assert!((valve.flow(x, &RATED) / expected - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_proportional_area_goes_on_growing_beyond_full_scale() {
        let values = &[("max_area", 7.598)];
        let [proportional, linear] = [AreaLaw::Proportional, AreaLaw::Linear].map(|area| {
            let form = ValveForm {
                area,
                ..ValveForm::linear()
            };
            valve(&form, values)
        });
        for x in [-100.0, -3.0, 0.0, 60.0, 100.0] {
            assert_eq!(proportional.flow(x, &RATED), linear.flow(x, &RATED), "{x}");
        }
        let ratio = proportional.flow(130.0, &RATED) / linear.flow(130.0, &RATED);
        assert!((ratio - 1.3).abs() < 1e-6, "{ratio}");
    }

    #[test]
    fn a_table_holds_its_nodes_its_ends_and_its_floor() {
        let form = ValveForm::table(&[0.0, 10.0, 40.0, 100.0]);
        let valve = valve(
            &form,
            &[
                ("area_1", 0.0),
                ("area_2", 1.0),
                ("area_3", 4.0),
                ("area_4", 5.0),
            ],
        );
        for (opening, area) in [
            (10.0, 1.0),
            (25.0, 2.5),
            (40.0, 4.0),
            (100.0, 5.0),
            (140.0, 5.0),
            (5.0, 0.5),
        ] {
            assert!(
                (valve.area(opening) - area * 1e-4).abs() < 1e-16,
                "{opening}"
            );
        }
        assert_eq!(valve.area(0.0), 1e-8 * 1e-4);
        assert_eq!(valve.area(-30.0), 1e-8 * 1e-4);
    }

    #[test]
    fn a_signed_table_opens_one_side_where_it_is_positive_and_the_other_where_it_is_negative() {
        let form = ValveForm::signed(&[-100.0, -10.0, 20.0, 100.0]);
        let areas = [
            ("area_1", -3.0),
            ("area_2", -1.0),
            ("area_3", 0.5),
            ("area_4", 4.0),
        ];
        let signed = valve(&form, &areas);
        for (x, area) in [
            (-140.0, -3.0),
            (-100.0, -3.0),
            (-55.0, -2.0),
            (-10.0, -1.0),
            (0.0, -0.5),
            (10.0, 0.0),
            (20.0, 0.5),
            (60.0, 2.25),
            (100.0, 4.0),
        ] {
            let one = valve(&ValveForm::linear(), &[("max_area", 1.0)]).flow(100.0, &RATED);
            let flow = signed.flow(x, &RATED);
            assert!((flow - area * one).abs() < 1e-6 * one, "{x}: {flow}");
        }
        // The offset opens both sides, as it does where they are alike.
        let [closed, open] = [-5.0, 5.0].map(|offset| {
            let change = [&areas[..], &[("opening_offset", offset)]].concat();
            let flows = valve(&form, &change).orifice_flows(
                10.0,
                &Pressures {
                    supply: 10.0,
                    tank: 0.0,
                    a: 5.0,
                    b: 5.0,
                },
            );
            flows.pa.min(flows.pb)
        });
        assert!(closed < 1e-5 && open > 1e-2, "{closed} {open}");
    }

    #[test]
    fn six_orifices_carry_the_same_load_flow_and_more_supply_only_with_an_open_centre() {
        let meter = Meter::Supply;
        for (offset, more) in [(0.0, false), (-5.0, false), (5.0, true)] {
            let four = ValveForm {
                meter,
                ..ValveForm::linear()
            };
            let six = ValveForm {
                orifices: Orifices::Six,
                ..four.clone()
            };
            let change = [("opening_offset", offset)];
            let (four, six) = (valve(&four, &change), valve(&six, &change));
            let at = Pressures {
                supply: 70.0,
                tank: 2.0,
                a: 40.0,
                b: 30.0,
            };
            for x in [-50.0, -3.0, 0.0, 3.0, 50.0] {
                let (few, many) = (four.orifice_flows(x, &at), six.orifice_flows(x, &at));
                assert_eq!(few.load(), many.load());
                let centre = many.supply() - few.supply();
                assert!(
                    if more && x.abs() < 5.0 {
                        centre > 1.0
                    } else {
                        centre < 1e-3
                    },
                    "{offset} {x} {centre}"
                );
            }
        }
    }

    #[test]
    fn flow_is_conserved_when_the_ports_are_symmetric() {
        let form = ValveForm {
            drop: Drop::Ports,
            ..ValveForm::linear()
        };
        let valve = valve(&form, &[]);
        let at = Pressures {
            supply: 100.0,
            tank: 0.0,
            a: 70.0,
            b: 30.0,
        };
        let flows = valve.orifice_flows(40.0, &at);
        // What enters at P and B leaves at A and T.
        assert!((flows.pa - flows.at - (flows.bt - flows.pb)).abs() < 1e-3 * flows.pa);
    }
}
