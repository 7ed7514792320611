//! The opening curves with the stroke.

use super::host;
use super::{Act, Entry, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "gain_curvature",
    port: Port::Area,
    summary: "The flow gain changes along the stroke",
    finding: "the flow gain changes along the stroke, by {gain_curvature} from its mean to its end",
    equation: "h = x + gain_curvature x (|x| - 1), x = 1 at full scale",
    shows: "an odd, static residual that grows with |x| and is zero at full scale",
    confused: "overlap, which has a corner near null; supply_droop, whose error goes with the flow squared and lags",
    source: "shaped metering edges; ISO 10770-1, linearity",
    parameters: |_, _| vec![Parameter::linear("gain_curvature", "1", -0.95, 0.0, 0.95)],
    trials: |_, _| vec![vec![0.05], vec![0.3]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_its_area,
    outputs: None,
    view: None,
    frequency: None,
};

/// The flow gain changes along the stroke.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainCurvature<R> {
    share: R,
}

impl<R: Real> GainCurvature<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for GainCurvature<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let full = R::constant(0.01);
        opening + self.share * opening * (opening.abs() * full - R::constant(1.0))
    }
}

pub(super) const KNEE: Entry = Entry {
    name: "gain_curvature~knee",
    summary: "The flow gain is another near null than beyond a knee",
    finding: "up to {knee} the flow gain is smaller by {knee_share} than beyond",
    equation: "h = x - knee_share clip(x, knee)",
    shows: "an odd, static residual with a corner on either side of null",
    confused: "gain_curvature, which has no corner; overlap, within which nothing flows",
    source: "spools of two gains, underlap of edges that open one after another; Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| {
        vec![
            Parameter::linear("knee_share", "1", -2.0, 0.0, 0.95),
            Parameter::linear("knee", "%", 1.0, 30.0, 90.0),
        ]
    },
    trials: |_, _| {
        [[0.2, 50.0], [0.2, 25.0], [-0.3, 50.0], [-0.4, 5.0]]
            .map(Vec::from)
            .to_vec()
    },
    applies: host::has_lands,
    ..ENTRY
};

/// The flow gain has a knee.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainKnee<R> {
    share: R,
    knee: R,
}

impl<R: Real> GainKnee<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            share: next(),
            knee: next(),
        }
    }
}

impl<R: Real> Act<R> for GainKnee<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening - self.share * opening.clamp(-self.knee, self.knee)
    }
}

pub(super) const SHAPED: Entry = Entry {
    name: "gain_curvature~shaped",
    summary: "The flow gain changes along the stroke as the shape of the ports has it",
    finding: "the flow gain changes along the stroke, by {cubic_share} and {quintic_share} of the third and fifth powers",
    equation: "h = x + cubic_share x (x^2 - 1) + quintic_share x (x^4 - 1), x = 1 at full scale",
    shows: "an odd, static residual without a corner, zero at full scale",
    confused: "overlap, which has a corner near null; supply_droop, whose error goes with the flow squared and lags",
    source: "round and notched ports: Merritt, Hydraulic Control Systems, 1967; ISO 10770-1, linearity",
    parameters: |_, _| {
        ["cubic_share", "quintic_share"]
            .map(|name| Parameter::linear(name, "1", -0.95, 0.0, 0.95))
            .to_vec()
    },
    trials: |_, _| {
        [[0.1, 0.0], [-0.1, 0.0], [0.3, -0.2], [-0.3, 0.2]]
            .map(Vec::from)
            .to_vec()
    },
    ..ENTRY
};

/// The opening is an odd polynomial of the spool.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainShaped<R> {
    cubic: R,
    quintic: R,
}

impl<R: Real> GainShaped<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            cubic: next(),
            quintic: next(),
        }
    }
}

impl<R: Real> Act<R> for GainShaped<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let share = opening * R::constant(0.01);
        let square = share * share;
        let less = square - R::constant(1.0);
        // x^4 - 1 = (x^2 - 1) (x^2 + 1)
        opening
            * (R::constant(1.0) + less * (self.cubic + self.quintic * (square + R::constant(1.0))))
    }
}

pub(super) const ROUND: Entry = Entry {
    name: "gain_curvature~round",
    summary: "The ports are round holes, which open gradually",
    finding: "the flow grows from null with the power 1.5 of the opening, as of round holes, in a share of {round_share}",
    equation: "h = x + round_share x (sqrt(|x|) - 1), x = 1 at full scale",
    shows: "an odd, static residual that is steepest at null, and zero there and at full scale",
    confused: "overlap, within which nothing flows; supply_droop, whose error is largest at full flow",
    source: "area of round holes near their edge: Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| vec![Parameter::linear("round_share", "1", -0.95, 0.0, 1.5)],
    ..ENTRY
};

/// The ports are round holes.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainOfRoundPorts<R> {
    share: R,
}

impl<R: Real> GainOfRoundPorts<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for GainOfRoundPorts<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        let root = (opening.abs() * R::constant(0.01)).sqrt();
        opening + self.share * opening * (root - R::constant(1.0))
    }
}

pub(super) const LAMINAR: Entry = Entry {
    name: "gain_curvature~laminar",
    summary: "The flow through small openings is laminar: they let less pass than turbulent ones",
    finding: "the flow through openings below some {laminar_opening} is laminar, and grows with their square",
    equation: "h = x |x| / sqrt(x^2 + w^2), w = laminar_opening: the discharge coefficient rises with the Reynolds number of the opening",
    shows: "flow missing near null that dies out with larger openings; none is missing at full scale",
    confused: "overlap, which takes as much of every larger opening; gain_curvature~round, whose share is felt up to full scale",
    source: "discharge coefficient of spool orifices at low Reynolds numbers: McCloy and Martin, Control of Fluid Power, 1980",
    parameters: |_, _| vec![Parameter::linear("laminar_opening", "%", 0.0, 0.0, 50.0)],
    trials: |_, _| vec![vec![1.0], vec![4.0], vec![15.0]],
    neutral: &[],
    ..ENTRY
};

/// Small openings let less pass.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainOfLaminarFlow<R> {
    square: R,
}

impl<R: Real> GainOfLaminarFlow<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let width = next();
        Self {
            square: width * width,
        }
    }
}

impl<R: Real> Act<R> for GainOfLaminarFlow<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        // At null there is nothing to divide by.
        let square = (opening * opening).max(R::constant(1e-30));
        opening / (R::constant(1.0) + self.square / square).sqrt()
    }
}

pub(super) const TANH: Entry = Entry {
    name: "gain_curvature~tanh",
    finding: "the flow through openings below some {transition_opening} is laminar: the discharge coefficient falls there as a hyperbolic tangent",
    equation: "h = x tanh(2 |x| / w), w = transition_opening: the discharge coefficient follows the flow number",
    confused: "gain_curvature~laminar, which lacks a little up to larger openings; overlap, which takes as much of every larger opening",
    source: "Cd = Cd_max tanh(2 lambda / lambda_crit), as simulators of hydraulics have it: Borutzky, Barnard, Thoma, Simulation \
             Modelling Practice and Theory 10, 2002",
    parameters: |_, _| vec![Parameter::linear("transition_opening", "%", 0.0, 0.0, 80.0)],
    trials: |_, _| vec![vec![2.0], vec![8.0], vec![25.0]],
    ..LAMINAR
};

/// Small openings let less pass, as their flow number has it.
#[derive(Debug, Clone)]
pub(in crate::model) struct GainOfFlowNumber<R> {
    half: R,
}

impl<R: Real> GainOfFlowNumber<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            half: R::constant(0.5) * next(),
        }
    }
}

impl<R: Real> Act<R> for GainOfFlowNumber<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        // Where there is no transition, at null there is nothing to divide by.
        let half = self.half.max(R::constant(1e-12));
        opening * (opening.abs() / half).rising_tanh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_number_takes_off_a_tangent_and_nothing_at_full_scale() {
        let mut values = [20.0].into_iter();
        let effect: GainOfFlowNumber<f64> = GainOfFlowNumber::new(|| values.next().unwrap());
        for x in [0.0, 0.1, 5.0, -12.0, 40.0, -100.0] {
            let expected = x * (f64::abs(x) / 10.0).tanh();
            assert!((effect.opening(x) - expected).abs() < 1e-5, "{x}");
        }
    }

    #[test]
    fn laminar_flow_grows_with_the_square_and_is_hardly_missing_at_full_scale() {
        let mut values = [3.0].into_iter();
        let effect: GainOfLaminarFlow<f64> = GainOfLaminarFlow::new(|| values.next().unwrap());
        let found = [0.0, 4.0, -4.0].map(|x| effect.opening(x));
        assert!((found[1] - 3.2).abs() < 1e-12 && found[2] == -found[1] && found[0] == 0.0);
        assert!((effect.opening(0.03) / effect.opening(0.015) - 4.0).abs() < 1e-3);
        assert!((effect.opening(100.0) - 100.0).abs() < 0.05);
    }

    #[test]
    fn round_ports_open_with_the_power_of_one_and_a_half() {
        let mut values = [1.0].into_iter();
        let effect: GainOfRoundPorts<f64> = GainOfRoundPorts::new(|| values.next().unwrap());
        let found = [0.0, 25.0, -25.0, 100.0].map(|x| effect.opening(x));
        assert_eq!(found, [0.0, 12.5, -12.5, 100.0]);
    }

    #[test]
    fn the_shape_is_that_of_the_polynomial() {
        let mut values = [0.25, -0.5].into_iter();
        let effect: GainShaped<f64> = GainShaped::new(|| values.next().unwrap());
        let found = [0.0, 50.0, -50.0, 100.0].map(|x| effect.opening(x));
        let half = 50.0 * (1.0 - 0.25 * 0.75 + 0.5 * (1.0 - 0.0625));
        assert_eq!(found, [0.0, half, -half, 100.0]);
    }

    #[test]
    fn the_gain_changes_at_the_knee() {
        let mut values = [0.25, 40.0].into_iter();
        let effect: GainKnee<f64> = GainKnee::new(|| values.next().unwrap());
        let found = [0.0, 20.0, -40.0, 100.0].map(|x| effect.opening(x));
        assert_eq!(found, [0.0, 15.0, -30.0, 90.0]);
    }

    #[test]
    fn it_bends_between_null_and_full_scale() {
        let mut values = [0.2].into_iter();
        let effect: GainCurvature<f64> = GainCurvature::new(|| values.next().unwrap());
        let found = [0.0, 50.0, -50.0, 100.0].map(|x| effect.opening(x));
        assert_eq!(found, [0.0, 45.0, -45.0, 100.0]);
    }
}
