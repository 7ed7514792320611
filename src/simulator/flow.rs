//! From the spool to the flow: opening, supply, leakage, line and oil.

use super::filter::{Lag, PolePair, runge_kutta};
use super::meter::{Meter, Supply};
use super::outsider::{self, CREEP_LAG, Oddity, Outsider, strength};
use super::planted::{COLD, Drift, Form, Heating, Kind, Planted, find, value};
use super::valve::{FULL_SCALE, RATED_DROP, Valve};

/// Exponent of the gas of an accumulator, between slow and fast.
const GAS: f64 = 4.0 / 3.0;

/// Where sensor and metering edges see the spool.
pub(super) struct Seen {
    clipped: f64,
    chatter: f64,
    creep: f64,
    slow: Lag,
    /// V.
    pub(super) position: f64,
}

impl Seen {
    pub(super) fn new(planted: &[Planted], outsiders: &[Outsider], position: f64) -> Self {
        let mut slow = Lag::new(CREEP_LAG);
        slow.rest(position);
        let clipped = find(planted, Kind::StrokeLimit, Form::Clipped);
        let mut seen = Self {
            clipped: clipped.map_or(f64::INFINITY, |p| p.value),
            chatter: strength(outsiders, Oddity::Chatter),
            creep: strength(outsiders, Oddity::Creep),
            slow,
            position,
        };
        seen.look(position, 0.0);
        seen
    }

    /// Moves on by `h` s to `time`, to where the spool is then.
    pub(super) fn advance(&mut self, spool: f64, time: f64, h: f64) {
        if self.creep != 0.0 {
            self.slow.advance(spool, h);
        }
        self.look(spool, time);
    }

    fn look(&mut self, spool: f64, time: f64) {
        let mut x = spool.clamp(-self.clipped, self.clipped);
        if self.chatter != 0.0 {
            x += outsider::chatter(self.chatter, spool, time);
        }
        self.position = x + self.creep * self.slow.value;
    }
}

/// A supply that gives way.
struct Droop {
    /// bar/(L/min).
    resistance: f64,
    /// Whether that grows with the flow: to the other at the rated one.
    turbulent: bool,
    /// |Q| as the supply feels it.
    felt: Lag,
    /// s.
    lag: f64,
    /// What its pump delivers at most, L/min: of more that is drawn the rest comes out of its volume.
    pump: f64,
    /// The volume of its accumulator's gas over that at rest.
    gas: Option<f64>,
}

impl Droop {
    /// The supply whose pressure is measured.
    fn measured(rated: f64) -> Self {
        Self {
            resistance: 0.4 * RATED_DROP / rated,
            turbulent: false,
            felt: Lag::new(0.05),
            lag: 0.05,
            pump: f64::INFINITY,
            gas: None,
        }
    }

    fn planted(planted: &[Planted]) -> Option<Self> {
        let forms = [
            Form::Usual,
            Form::Turbulent,
            Form::Limited,
            Form::Accumulator,
        ];
        let found = forms
            .into_iter()
            .find_map(|form| find(planted, Kind::SupplyDroop, form));
        found.map(|p| {
            let lag = p.key("lag").unwrap_or(1.0);
            Self {
                resistance: p.value,
                turbulent: p.form == Form::Turbulent,
                felt: Lag::new(lag),
                lag,
                pump: p.key("pump").unwrap_or(f64::INFINITY),
                gas: (p.form == Form::Accumulator).then_some(1.0),
            }
        })
    }

    /// Moves on by `h` s, in which `drawn` L/min are.
    fn advance(&mut self, drawn: f64, h: f64) {
        if let Some(volume) = self.gas {
            let (resistance, pump) = (self.resistance, self.pump);
            // What the pump is asked for by a pressure of p0 V^(-n).
            let asked = |volume: f64| (1.0 - volume.powf(-GAS)) * RATED_DROP / resistance;
            let rate = resistance / (GAS * RATED_DROP * self.lag);
            let moved = runge_kutta([volume], h, |[volume], _| {
                [rate * (drawn - asked(volume).min(pump))]
            });
            self.gas = Some(moved[0]);
            self.felt.value = asked(moved[0]);
            self.felt.jump(drawn);
            return;
        }
        if self.felt.value <= self.pump {
            self.felt.advance(drawn, h);
        } else {
            self.felt.value += h * (drawn - self.pump) / self.lag;
            self.felt.jump(drawn);
        }
    }

    /// The pressure drop as a multiple of the rated one: p = p0 − R · |Q|, or R · Q² / Q_rated where that is turbulent.
    fn left(&self, rated: f64) -> f64 {
        let more = match self.turbulent {
            true => self.felt.value / rated,
            false => 1.0,
        };
        (1.0 - self.resistance * self.felt.value * more / RATED_DROP).max(0.0)
    }
}

/// The flow where the meter is, L/min.
pub(super) struct Flow {
    rated: f64,
    opening: Opening,
    meter: Meter,
    leak: Option<Leak>,
    droop: Option<Droop>,
    fill: Option<Lag>,
    line: Option<PolePair>,
    /// How much of the flow passes through the line.
    line_share: f64,
    oil: Oil,
    ripple: f64,
    hunting: f64,
    reattachment: f64,
    attached: bool,
    /// What passes the meter, L/min.
    pub(super) value: f64,
}

/// Edges that leak from P to T at null, and ever less the further the lands cover them.
struct Leak {
    /// L/min at null and the rated drop.
    most: f64,
    /// The share of full scale by which the spool is away from null where half of it is left.
    half: f64,
}

impl Leak {
    fn planted(planted: &[Planted]) -> Option<Self> {
        find(planted, Kind::Leakage, Form::Usual).map(|p| Self {
            most: p.value,
            half: p.key("width").unwrap_or(1.0) / 100.0,
        })
    }

    /// What passes where the spool is at the share `x` of full scale, under a multiple of the rated drop.
    fn at(&self, x: f64, drop: f64) -> f64 {
        let square = self.half * self.half;
        self.most * drop.sqrt() * square / (square + x * x)
    }
}

/// h over x, both as shares of full scale.
struct Opening {
    /// h = sign(x) max(|x| − δ, 0).
    overlap: f64,
    /// That of the other side, where h < 0.
    overlap_negative: f64,
    /// The same with edges rounded over this width: h = ½ (x − δ + √((x − δ)² + w²)) + ½ (x + δ − √((x + δ)² + w²)).
    rounding: Option<f64>,
    /// The same with edges rounded by this clearance: h = sign(x) (√(max(|x| − δ, 0)² + c²) − c).
    clearance: Option<f64>,
    /// Those of P-A, B-T, P-B and A-T, and the clearance of all.
    bridge: Option<([f64; 4], f64)>,
    /// How far edges are open at null that leak where they are covered, and how slowly that ceases.
    leaking: Option<(f64, f64)>,
    /// h (1 + a sign(h)).
    asymmetry: f64,
    /// h + c h (|h| − 1).
    curvature: f64,
    /// h − c clip(h, ±k).
    knee: Option<(f64, f64)>,
    /// h + c (h³ − h) + d (h⁵ − h).
    shape: Option<(f64, f64)>,
    /// h |h| / √(h² + w²).
    laminar: f64,
    /// h tanh(2 |h| / w).
    transition: Option<f64>,
    /// h + r (sign(h) |h|^1.5 − h).
    round: f64,
    /// |h| ≤ s.
    saturation: f64,
    /// What either side nears gradually, shares of full scale.
    choked: Option<[f64; 2]>,
    /// What an orifice in series lets pass, as an opening.
    series: f64,
}

impl Opening {
    fn planted(planted: &[Planted]) -> Self {
        let rounded = find(planted, Kind::Overlap, Form::Rounded);
        let edges = find(planted, Kind::Overlap, Form::Edges);
        let clearance = find(planted, Kind::Overlap, Form::Clearance);
        let overlap = rounded
            .or(edges)
            .or(clearance)
            .map_or(value(planted, Kind::Overlap), |p| p.value);
        let negative = edges.map_or(overlap, |p| p.key("negative").unwrap_or(0.0));
        let bridge = find(planted, Kind::Overlap, Form::Bridge);
        let bridge = bridge.map(|p| {
            let [b_t, p_b, a_t, clearance] =
                ["b_t", "p_b", "a_t", "clearance"].map(|key| p.key(key).unwrap_or(1.0) / 100.0);
            ([p.value / 100.0, b_t, p_b, a_t], clearance)
        });
        let leaking = find(planted, Kind::Overlap, Form::Leaking)
            .map(|p| (p.value / 100.0, p.key("closing").unwrap_or(1.0)));
        let knee = find(planted, Kind::GainCurvature, Form::Knee);
        let shape = find(planted, Kind::GainCurvature, Form::Shaped);
        let width = |p: &Planted| p.key("width").unwrap_or(0.5 * p.value);
        Self {
            bridge,
            leaking,
            overlap: overlap / 100.0,
            overlap_negative: negative / 100.0,
            knee: knee.map(|p| (p.value, p.key("at").unwrap_or(40.0) / 100.0)),
            round: find(planted, Kind::GainCurvature, Form::Round).map_or(0.0, |p| p.value),
            laminar: find(planted, Kind::GainCurvature, Form::Laminar).map_or(0.0, |p| p.value),
            transition: find(planted, Kind::GainCurvature, Form::Tanh).map(|p| p.value),
            shape: shape.map(|p| (p.value, p.key("fifth").unwrap_or(0.0))),
            rounding: rounded.map(|p| width(p) / 100.0),
            clearance: clearance.map(|p| p.key("clearance").unwrap_or(2.0) / 100.0),
            asymmetry: value(planted, Kind::AsymmetricGain),
            curvature: value(planted, Kind::GainCurvature),
            saturation: find(planted, Kind::FlowSaturation, Form::Usual)
                .map_or(f64::INFINITY, |p| p.value / 100.0),
            choked: find(planted, Kind::FlowSaturation, Form::Choked)
                .map(|p| [p.value, p.key("negative").unwrap_or(p.value)].map(|end| end / 100.0)),
            series: find(planted, Kind::FlowSaturation, Form::Series)
                .map_or(f64::INFINITY, |p| p.value / 100.0),
        }
    }

    fn at(&self, x: f64) -> f64 {
        let h = match (self.rounding, self.clearance) {
            _ if self.leaking.is_some() => self.leaking.map_or(x, |leaking| fed(leaking, x)),
            _ if self.bridge.is_some() => self.bridge.map_or(x, |bridge| connected(bridge, x)),
            (Some(width), _) => {
                let (low, high) = (x - self.overlap, x + self.overlap);
                0.5 * (low + low.hypot(width) + high - high.hypot(width))
            }
            (None, Some(clearance)) => {
                let beyond = (x.abs() - self.overlap).max(0.0);
                x.signum() * (beyond.hypot(clearance) - clearance)
            }
            (None, None) => x - x.clamp(-self.overlap_negative, self.overlap),
        };
        let h = if h > 0.0 {
            h * (1.0 + self.asymmetry)
        } else {
            h * (1.0 - self.asymmetry)
        };
        let h = h + self.curvature * h * (h.abs() - 1.0);
        let h = self
            .knee
            .map_or(h, |(share, at)| h - share * h.clamp(-at, at));
        let h = self.shape.map_or(h, |(third, fifth)| {
            h + third * (h.powi(3) - h) + fifth * (h.powi(5) - h)
        });
        let h = h + self.round * (h.abs().powf(1.5).copysign(h) - h);
        // The tangent of the angle of which the share that passes is the sine.
        let h = match self.laminar {
            0.0 => h,
            width => h * (h.abs() / width).atan().sin(),
        };
        let h = self
            .transition
            .map_or(h, |width| h * (2.0 * h.abs() / width).tanh());
        let h = h / f64::hypot(1.0, h / self.series);
        let h = self.choked.map_or(h, |[up, down]| {
            let end = if h > 0.0 { up } else { down };
            h * (1.0 + (h / end).powi(4)).powf(-0.25)
        });
        h.clamp(-self.saturation, self.saturation)
    }
}

/// The opening of two ideal edges in series that pass as much as a bridge of four with these laps and this clearance at `x`, whose ports
/// A and B are connected: there is the pressure at which what comes from P goes to T.
fn connected((laps, clearance): ([f64; 4], f64), x: f64) -> f64 {
    let area =
        |beyond: f64| 0.5 * (beyond + (beyond * beyond + 4.0 * clearance * clearance).sqrt());
    let [p_a, b_t, p_b, a_t] = [x - laps[0], x - laps[1], -x - laps[2], -x - laps[3]].map(area);
    let (entering, leaving) = ((p_a + p_b).powi(2), (a_t + b_t).powi(2));
    let share = entering / (entering + leaving).max(1e-30);
    std::f64::consts::SQRT_2 * (p_a * (1.0 - share).sqrt() - a_t * share.sqrt())
}

/// What a port is fed by the edge to P and loses at that to T, of which one is covered by the share `x` of full scale that the other opens.
fn fed((at_null, slowly): (f64, f64), x: f64) -> f64 {
    let open = at_null + x.abs();
    let covered = at_null * at_null / (at_null + x.abs() / slowly).max(1e-30);
    (open - covered).copysign(x)
}

/// Q (1 + drift · t), t as [`Drift`] has it, or with a heating Q (1 + drift · (ϑ − ϑ0)) where the oil warms up.
struct Oil {
    drift: Drift,
    heating: Option<Heating>,
}

impl Oil {
    fn planted(planted: &[Planted]) -> Self {
        let forms = [Form::Usual, Form::Settling];
        let drift = forms
            .iter()
            .find_map(|&form| find(planted, Kind::ViscosityDrift, form));
        let heating = drift.and_then(|p| p.key("heating"));
        Self {
            drift: Drift::of(drift),
            heating: heating.and(Heating::planted(planted)),
        }
    }

    fn factor(&self, time: f64) -> f64 {
        let warmer = |heating: Heating| self.drift.rate * (heating.temperature(time) - COLD);
        1.0 + self.heating.map_or(self.drift.at(time), warmer)
    }
}

impl Flow {
    /// The flow in equilibrium with the spool at `position` V.
    pub(super) fn new(
        valve: Valve,
        (meter, supply): (Meter, Supply),
        planted: &[Planted],
        outsiders: &[Outsider],
        position: f64,
    ) -> Self {
        let usual = |kind| find(planted, kind, Form::Usual);
        let side_line = find(planted, Kind::LineResonance, Form::Share);
        let line = |p: &Planted| PolePair::new(p.value, p.key("damping").unwrap_or(1.0));
        let mut flow = Self {
            rated: valve.rated_flow,
            opening: Opening::planted(planted),
            meter,
            leak: Leak::planted(planted),
            droop: match supply {
                Supply::Measured => Some(Droop::measured(valve.rated_flow)),
                Supply::Constant => Droop::planted(planted),
            },
            fill: usual(Kind::Compressibility).map(|p| Lag::new(p.value)),
            line: usual(Kind::LineResonance).or(side_line).map(line),
            line_share: side_line.map_or(1.0, |p| p.key("share").unwrap_or(1.0)),
            oil: Oil::planted(planted),
            ripple: strength(outsiders, Oddity::PumpRipple),
            hunting: strength(outsiders, Oddity::SupplyHunting),
            reattachment: strength(outsiders, Oddity::Reattachment),
            attached: false,
            value: 0.0,
        };
        let valve = flow.through_valve(position);
        if let Some(droop) = &mut flow.droop {
            droop.felt.rest(valve.abs());
        }
        if let Some(fill) = &mut flow.fill {
            fill.rest(valve);
        }
        if let Some(line) = &mut flow.line {
            line.rest(valve);
        }
        flow.value = valve;
        flow
    }

    /// The pressure drop as a multiple of the rated one.
    pub(super) fn drop(&self) -> f64 {
        self.droop
            .as_ref()
            .map_or(1.0, |droop| droop.left(self.rated))
    }

    /// Moves on by `h` s to `time`, when the spool is seen at `position` V.
    pub(super) fn advance(&mut self, position: f64, time: f64, h: f64) {
        let mut flow = self.through_valve(position)
            * outsider::pump_ripple(self.ripple, time)
            * outsider::supply_hunting(self.hunting, time);
        if let Some(droop) = &mut self.droop {
            droop.advance(flow.abs(), h);
        }
        if let Some(fill) = &mut self.fill {
            flow = fill.advance(flow, h);
        }
        if let Some(line) = &mut self.line {
            flow += self.line_share * (line.advance(flow, h) - flow);
        }
        self.value = flow * self.oil.factor(time);
    }

    fn through_valve(&mut self, position: f64) -> f64 {
        let x = position / FULL_SCALE;
        let mut flow = self.rated * self.opening.at(x);
        if self.droop.is_some() {
            flow *= self.drop().sqrt();
        }
        if self.reattachment != 0.0 {
            self.attached = outsider::attached(self.attached, x);
            flow *= 1.0
                - if self.attached {
                    self.reattachment
                } else {
                    0.0
                };
        }
        match self.meter {
            Meter::Load => flow,
            Meter::Supply => {
                let leaks = |leak: &Leak| leak.at(x, self.drop());
                flow.abs() + self.leak.as_ref().map_or(0.0, leaks)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opening(text: &str) -> Opening {
        Opening::planted(&[text.parse().unwrap()])
    }

    #[test]
    fn edges_leak_half_at_their_width_and_with_the_root_of_the_drop() {
        let leak = Leak::planted(&["leakage=2:width=4".parse().unwrap()]).unwrap();
        for (x, drop, expected) in [(0.0, 1.0, 2.0), (-0.04, 1.0, 1.0), (0.0, 0.25, 1.0)] {
            assert!((leak.at(x, drop) - expected).abs() < 1e-12, "{x} {drop}");
        }
    }

    #[test]
    fn openings_are_those_of_their_equations() {
        let overlap = opening("overlap=5");
        assert_eq!([0.05, 0.01, -0.05].map(|x| overlap.at(x)), [0.0; 3]);
        assert!((overlap.at(0.3) - 0.25).abs() < 1e-15);
        assert!((overlap.at(-0.3) + 0.25).abs() < 1e-15);
        let rounded = opening("overlap~rounded=5");
        assert_eq!(rounded.at(0.0), 0.0);
        assert!((rounded.at(0.9) - 0.85).abs() < 1e-3);
        assert_eq!(rounded.at(0.2), -rounded.at(-0.2));
        let clear = opening("overlap~clearance=5:clearance=3");
        assert_eq!([0.05, -0.02].map(|x| clear.at(x)), [0.0; 2]);
        assert!((clear.at(-0.09) + 0.02).abs() < 1e-15);
        let shaped = opening("gain_curvature~shaped=-0.2:fifth=0.4");
        assert_eq!([0.0, 1.0, -1.0].map(|x| shaped.at(x)), [0.0, 1.0, -1.0]);
        assert!((shaped.at(0.5) - (0.5 + 0.2 * 0.375 - 0.4 * 0.46875)).abs() < 1e-15);
        let round = opening("gain_curvature~round=0.8");
        assert!((round.at(-0.25) + 0.25 * (1.0 - 0.8 * 0.5)).abs() < 1e-15);
        let asymmetric = opening("asymmetric_gain=0.1");
        assert!((asymmetric.at(0.5) - 0.55).abs() < 1e-15);
        assert!((asymmetric.at(-0.5) + 0.45).abs() < 1e-15);
        let curved = opening("gain_curvature=0.2");
        assert!((curved.at(0.5) - 0.45).abs() < 1e-15);
        assert!((curved.at(-1.0) + 1.0).abs() < 1e-15);
    }
}
