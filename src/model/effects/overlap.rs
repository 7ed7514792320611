//! The lands overlap the ports.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "overlap",
    port: Port::Area,
    summary: "The spool must move by the overlap before the ports open",
    finding: "the spool moves by {overlap} before the ports open",
    equation: "h = sign(x) max(|x| - overlap, 0)",
    shows: "no flow near null, single-valued; odd harmonics; the spool does not show it",
    confused: "hysteresis, whose dead band depends on the direction; gain_curvature, which has no corner; and while the pressure drop \
               stays the same, a flow meter that shows too little of small flows",
    source: "Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, overlap",
    parameters: |_, _| vec![Parameter::linear("overlap", "%", 0.0, 0.0, 50.0)],
    trials: |_, _| [1.0, 3.0, 8.0, 20.0].map(|width| vec![width]).to_vec(),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::has_lands,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(3))),
    frequency: None,
};

/// The spool must move by the overlap before the ports open.
#[derive(Debug, Clone)]
pub(in crate::model) struct Overlap<R> {
    width: R,
}

impl<R: Real> Overlap<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { width: next() }
    }
}

impl<R: Real> Act<R> for Overlap<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening - opening.clamp(-self.width, self.width)
    }
}

pub(super) const ROUNDED: Entry = Entry {
    name: "overlap~rounded",
    summary: "The lands cover the ports by the overlap, negative where they leave them open, with rounded edges",
    finding: "the lands cover the ports by {overlap_rounded}, with edges rounded over {edge_rounding}",
    equation: "h = x - (r(x + d) - r(x - d))/2, r(y) = sqrt(y^2 + w^2), overlap d, rounding w",
    shows: "less flow near null, or more where the overlap is negative, which changes gradually",
    confused: "overlap, which has a corner; gain_curvature, which changes along the whole stroke",
    source: "underlap and rounded lands: Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, lap",
    parameters: |_, _| {
        vec![
            Parameter::linear("overlap_rounded", "%", -20.0, 0.0, 50.0),
            Parameter::log("edge_rounding", "%", 0.1, 2.0, 50.0),
        ]
    },
    trials: |_, _| {
        [
            [2.0, 1.0],
            [5.0, 5.0],
            [15.0, 5.0],
            [-2.0, 1.0],
            [-6.0, 3.0],
        ]
        .map(Vec::from)
        .to_vec()
    },
    ..ENTRY
};

/// Edges of an overlap, or of an underlap, that open gradually.
#[derive(Debug, Clone)]
pub(in crate::model) struct OverlapRounded<R> {
    width: R,
    rounding: R,
}

impl<R: Real> OverlapRounded<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            width: next(),
            rounding: next(),
        }
    }
}

impl<R: Real> Act<R> for OverlapRounded<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let (above, below) = (opening + self.width, opening - self.width);
        let bend = self.rounding;
        opening - R::constant(0.5) * (above.hypot(bend) - below.hypot(bend))
    }
}

pub(super) const CLEARANCE: Entry = Entry {
    name: "overlap~clearance",
    summary: "Radial clearance rounds the edges: oil flows past the closed edge as well as through the one that opens",
    finding: "the ports open {overlap_beside_clearance} from null, with edges rounded by a clearance of {radial_clearance}",
    equation: "h = sign(y) (sqrt(y^2 + c^2) - c), y = x - clip(x, d), overlap d, clearance c",
    shows: "less flow near null, where it grows with the square of the opening",
    confused: "overlap, which has a corner; gain_curvature, which changes along the whole stroke",
    source: "radial clearance of a lapped spool: Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| {
        vec![
            Parameter::linear("overlap_beside_clearance", "%", 0.0, 0.0, 50.0),
            Parameter::linear("radial_clearance", "%", 0.0, 0.0, 50.0),
        ]
    },
    trials: |_, _| {
        [[0.5, 3.0], [2.0, 1.0], [2.0, 10.0], [10.0, 3.0]]
            .map(Vec::from)
            .to_vec()
    },
    ..ENTRY
};

/// Edges with radial clearance: the area of the one that opens less that of the other.
#[derive(Debug, Clone)]
pub(in crate::model) struct OverlapWithClearance<R> {
    width: R,
    clearance: R,
}

impl<R: Real> OverlapWithClearance<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            width: next(),
            clearance: next(),
        }
    }
}

impl<R: Real> Act<R> for OverlapWithClearance<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let beyond = opening - opening.clamp(-self.width, self.width);
        (beyond.hypot(self.clearance) - self.clearance).with_sign_of(beyond)
    }
}

pub(super) const EDGES: Entry = Entry {
    name: "overlap~edges",
    summary: "The lands overlap the ports by more on one side than on the other",
    finding: "the ports open after {overlap_positive} of positive opening and {overlap_negative} of negative",
    equation: "h = max(x - overlap_positive, 0) + min(x + overlap_negative, 0)",
    shows: "no flow on one side of null, or on one side more than on the other; the spool does not show it",
    confused: "overlap beside an offset of the spool sensor, which are the same; null_bias, which the spool shows",
    source: "lap of each metering edge: ISO 10770-1; Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| {
        ["overlap_positive", "overlap_negative"]
            .map(|name| Parameter::linear(name, "%", 0.0, 0.0, 50.0))
            .to_vec()
    },
    trials: |_, _| {
        [[3.0, 0.0], [0.0, 3.0], [10.0, 2.0], [2.0, 10.0]]
            .map(Vec::from)
            .to_vec()
    },
    ..ENTRY
};

/// Each side of the spool has an overlap of its own.
#[derive(Debug, Clone)]
pub(in crate::model) struct OverlapOfEdges<R> {
    positive: R,
    negative: R,
}

impl<R: Real> OverlapOfEdges<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            positive: next(),
            negative: next(),
        }
    }
}

impl<R: Real> Act<R> for OverlapOfEdges<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening - opening.clamp(-self.negative, self.positive)
    }
}

pub(super) const BRIDGE: Entry = Entry {
    name: "overlap~bridge",
    summary: "Each of the four edges has a lap of its own, negative where it is worn, and all have a clearance",
    finding: "the edges P-A, B-T, P-B and A-T overlap by {overlap_p_a}, {overlap_b_t}, {overlap_p_b} and {overlap_a_t}, with a clearance of \
              {edge_clearance}",
    equation: "h = sqrt(2) (a1 a2 - a3 a4)/sqrt((a1 + a3)^2 + (a2 + a4)^2), a = (y + sqrt(y^2 + 4 edge_clearance^2))/2; y = x - \
               overlap_p_a of a1, x - overlap_b_t of a2, -x - overlap_p_b of a3, -x - overlap_a_t of a4",
    shows: "a flow gain near null that is neither none nor double, and not alike on both sides",
    confused: "overlap~edges and overlap~rounded, whose two edges of one side are alike; gain_curvature~knee",
    source: "a bridge of four edges between connected ports A and B: Merritt, Hydraulic Control Systems, 1967; erosion of metering edges",
    parameters: |_, _| {
        let lap = |name| Parameter::linear(name, "%", -20.0, 0.0, 50.0);
        let clearance = Parameter::linear("edge_clearance", "%", 0.0, 0.0, 20.0);
        let laps = ["overlap_p_a", "overlap_b_t", "overlap_p_b", "overlap_a_t"];
        laps.map(lap).into_iter().chain([clearance]).collect()
    },
    trials: |_, _| {
        [
            [3.0, 3.0, 3.0, 3.0, 0.5],
            [-3.0, -3.0, -3.0, -3.0, 1.0],
            [5.0, 1.0, 1.0, 5.0, 0.5],
            [1.0, 1.0, 5.0, 5.0, 0.5],
        ]
        .map(Vec::from)
        .to_vec()
    },
    ..ENTRY
};

/// Each of the four edges has a lap of its own.
#[derive(Debug, Clone)]
pub(in crate::model) struct OverlapOfBridge<R> {
    laps: [R; 4],
    clearance: R,
}

impl<R: Real> OverlapOfBridge<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            laps: [next(), next(), next(), next()],
            clearance: next(),
        }
    }

    /// The opening that passes as much as the bridge of edges with these `laps`.
    #[inline(always)]
    fn bridge(opening: R, laps: &[R; 4], clearance: R) -> R {
        let pa = area(opening - laps[0], clearance);
        let bt = area(opening - laps[1], clearance);
        let pb = area(-opening - laps[2], clearance);
        let at = area(-opening - laps[3], clearance);
        let all = (pa + pb).hypot(at + bt).max(R::constant(1e-12));
        R::constant(std::f64::consts::SQRT_2) * (pa * bt - at * pb) / all
    }
}

/// What an edge opens that is moved so far beyond its lap.
#[inline(always)]
fn area<R: Real>(beyond: R, clearance: R) -> R {
    R::constant(0.5) * (beyond + beyond.hypot(clearance + clearance))
}

impl<R: Real> Act<R> for OverlapOfBridge<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        // What is rounded in it alike where all edges are sharp and in line.
        let zero = R::constant(0.0);
        let ideal = Self::bridge(opening, &[zero; 4], zero);
        opening + (Self::bridge(opening, &self.laps, self.clearance) - ideal)
    }
}

pub(super) const LEAKING: Entry = Entry {
    name: "overlap~leaking",
    summary: "Edges that the lands cover leak all the same, the less the further they cover them",
    finding: "the edges are open by {leak_opening} at null, and leak half as much where they are covered by {leak_closing} times that",
    equation: "h = x + x leak_opening / (leak_opening leak_closing + |x|): each edge opens c + x, and where it is covered \
               c^2/(c + |x|/leak_closing), with c = leak_opening",
    shows: "a flow gain at null of about twice that far from it, to which it comes down slowly, the same on both sides",
    confused: "overlap~rounded and overlap~bridge, which are through with it at a certain opening; gain_curvature~knee; leakage, which a \
               meter between A and B does not see",
    source: "Eryilmaz and Wilson, Combining Leakage and Orifice Flows in a Hydraulic Servovalve Model, J. Dyn. Syst. Meas. Control 122, 2000",
    parameters: |_, _| {
        vec![
            Parameter::linear("leak_opening", "%", 0.0, 0.0, 20.0),
            Parameter::log("leak_closing", "1", 0.02, 1.0, 20.0),
        ]
    },
    trials: |_, _| [[0.5, 1.0], [2.0, 1.0], [6.0, 3.0]].map(Vec::from).to_vec(),
    ..ENTRY
};

/// Edges that leak where they are covered.
#[derive(Debug, Clone)]
pub(in crate::model) struct OverlapOfLeaking<R> {
    opening: R,
    closing: R,
}

impl<R: Real> OverlapOfLeaking<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            opening: next(),
            closing: next(),
        }
    }
}

impl<R: Real> Act<R> for OverlapOfLeaking<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let scale = (self.opening * self.closing + opening.abs()).max(R::constant(1e-12));
        opening + opening * (self.opening / scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covered_edges_leak_as_eryilmaz_and_wilson_have_it() {
        let at = |c: f64, closing: f64, x: f64| {
            let mut values = [c, closing].into_iter();
            let effect: OverlapOfLeaking<f64> = OverlapOfLeaking::new(|| values.next().unwrap());
            effect.opening(x)
        };
        // Each port is fed by one edge, and drained by the other.
        let edge = |c: f64, closing: f64, x: f64| match x > 0.0 {
            true => c + x,
            false => c * c / (c - x / closing),
        };
        for (c, closing, x) in [(1.0, 1.0, 0.3), (2.0, 0.4, -7.0), (0.5, 6.0, 40.0)] {
            let flow = edge(c, closing, x) - edge(c, closing, -x);
            assert!((at(c, closing, x) - flow).abs() < 1e-12, "{x}");
        }
        // What is shared out at null comes to twice the gain where both edges do it alike; without a leak it is not there.
        assert!((at(1.0, 1.0, 1e-6) - 2e-6).abs() < 1e-11);
        assert_eq!([at(0.0, 1.0, -7.3), at(0.0, 3.0, 0.0)], [-7.3, 0.0]);
    }

    #[test]
    fn a_bridge_of_edges_is_theirs() {
        let at = |laps: [f64; 4], clearance: f64, x: f64| {
            let mut values = laps.into_iter().chain([clearance]);
            let effect: OverlapOfBridge<f64> = OverlapOfBridge::new(|| values.next().unwrap());
            effect.opening(x)
        };
        // Alike they are a lap; an underlap doubles the gain near null.
        assert!((at([5.0; 4], 0.0, 30.0) - 25.0).abs() < 1e-12);
        assert!((at([-5.0; 4], 0.0, 1.0) - 2.0).abs() < 1e-12);
        assert_eq!(
            [at([5.0; 4], 0.0, 0.0), at([0.0; 4], 0.0, -7.3)],
            [0.0, -7.3]
        );
        // Two edges in series pass what 1/sqrt(1/a^2 + 1/b^2) of one does, and the others nothing.
        let series = |a: f64, b: f64| (2.0 / (a.powi(-2) + b.powi(-2))).sqrt();
        assert!((at([5.0, 2.0, 1.0, 4.0], 0.0, 30.0) - series(25.0, 28.0)).abs() < 1e-12);
        assert!((at([5.0, 2.0, 1.0, 4.0], 0.0, -30.0) + series(29.0, 26.0)).abs() < 1e-12);
        // Far away a clearance is none.
        assert!((at([0.0; 4], 1.0, 1e4) - 1e4).abs() < 1e-3);
    }

    #[test]
    fn a_clearance_rounds_the_edge_and_far_from_it_takes_itself_off() {
        let mut values = [2.0, 3.0].into_iter();
        let effect: OverlapWithClearance<f64> =
            OverlapWithClearance::new(|| values.next().unwrap());
        let found = [0.0, 2.0, -2.0, 6.0, -6.0].map(|x| effect.opening(x));
        assert_eq!(found, [0.0, 0.0, 0.0, 2.0, -2.0]);
        assert!((effect.opening(1e6) - (1e6 - 5.0)).abs() < 1e-4);
    }

    #[test]
    fn each_edge_opens_after_its_overlap() {
        let mut values = [5.0, 2.0].into_iter();
        let effect: OverlapOfEdges<f64> = OverlapOfEdges::new(|| values.next().unwrap());
        let found = [-30.0, -2.0, 2.0, 6.0].map(|x| effect.opening(x));
        assert_eq!(found, [-28.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn rounded_edges_are_square_far_away_and_an_underlap_doubles_the_gain() {
        let opening = |width: f64, rounding: f64, x: f64| {
            let mut values = [width, rounding].into_iter();
            let effect: OverlapRounded<f64> = OverlapRounded::new(|| values.next().unwrap());
            effect.opening(x)
        };
        assert!((opening(5.0, 0.1, 80.0) - 75.0).abs() < 1e-3);
        assert!(opening(5.0, 0.1, 2.0).abs() < 0.01);
        assert!((opening(-5.0, 0.1, 2.0) - 4.0).abs() < 0.01);
        assert!((opening(-5.0, 0.1, 80.0) - 85.0).abs() < 1e-3);
        assert!((opening(5.0, 5.0, 5.0) - opening(5.0, 0.1, 5.0)) > 0.5);
        assert_eq!(opening(0.0, 2.0, 7.3), 7.3);
    }

    #[test]
    fn nothing_opens_within_the_overlap() {
        let mut values = [5.0].into_iter();
        let effect: Overlap<f64> = Overlap::new(|| values.next().unwrap());
        let found = [-30.0, -5.0, 2.0, 6.0].map(|x| effect.opening(x));
        assert_eq!(found, [-25.0, 0.0, 0.0, 1.0]);
    }
}
