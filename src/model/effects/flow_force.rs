//! The flow pushes the spool towards null.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "flow_force",
    port: Port::Actuator,
    summary: "The steady flow force pulls the spool towards null like a spring",
    finding: "the flow force holds the spool back by {flow_force} of its opening at the rated pressure drop",
    equation: "dz/dt = K (sat(u - x, S) - flow_force h(x) dp/dp_ref), dp_ref the rated drop, or 70 bar where pressures are measured",
    shows: "a spool error in proportion to opening times pressure drop",
    confused: "dc_gain or a smaller spool gain where the pressure drop never changes; asymmetric_gain and gain_curvature, which leave the spool alone",
    source: "Merritt, Hydraulic Control Systems, 1967: F = 2 Cd Cv w x dp cos(69 deg)",
    parameters: |_, _| vec![Parameter::linear("flow_force", "1", 0.0, 0.0, 1.0)],
    trials: |_, _| vec![vec![0.03], vec![0.2]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_no_piston,
    outputs: None,
    view: Some(View::new(view::SLOW, Over::Spool, Values::Trial(1))),
    frequency: None,
};

/// The steady flow force pulls the spool towards null like a spring.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowForce<R> {
    share: R,
}

impl<R: Real> FlowForce<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for FlowForce<R> {
    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        drive - motion.gain * self.share * motion.load
    }
}

pub(super) const BEHIND: Entry = Entry {
    name: "flow_force~windup",
    summary: "The steady flow force pulls the spool towards null, and the loop's integrator makes up for it",
    finding: "the flow force holds the spool back by {flow_force_windup} of its opening at the rated pressure drop while it moves",
    equation: "dz/dt = K sat(u - x, S), T dx/dt = z - x - flow_force_windup h(x) dp/dp_ref",
    shows: "a spool that is slower at large openings and pressure drops, and at rest where it was commanded to",
    confused: "flow_force, which leaves an error at rest; sensor lags, which do not know the opening",
    parameters: |_, _| vec![Parameter::linear("flow_force_windup", "1", 0.0, 0.0, 1.0)],
    ..ENTRY
};

/// The steady flow force pulls the spool towards null behind the integrator.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowForceBehind<R> {
    share: R,
}

impl<R: Real> FlowForceBehind<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for FlowForceBehind<R> {
    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, motion: &Motion<R>) -> R {
        speed - self.share * motion.load / motion.time_constant
    }
}

pub(super) const ANGLE: Entry = Entry {
    name: "flow_force~angle",
    summary: "The steady flow force pulls the spool towards null, and less than in proportion where its jet turns with the opening",
    finding: "the flow force holds the spool back by {flow_force_near_null} of its opening near null at the rated pressure drop, and by \
              {flow_force_turn} less where its jet has turned, which takes {flow_force_span}",
    equation: "dz/dt = K (sat(u - x, S) - flow_force_near_null h(x) (1 - flow_force_turn (1 - exp(-|x|/flow_force_span))) dp/dp_ref)",
    shows: "a spool error that grows with the opening, and ever less",
    confused: "feedback_curvature, whose error does not know the pressure drop",
    source: "von Mises; Merritt, Hydraulic Control Systems, 1967: the angle of the jet turns from 21 to 69 degrees as the opening grows past \
             the radial clearance, its cosine to 0.38 of what it was",
    parameters: |scale, _| {
        vec![
            Parameter::linear("flow_force_near_null", "1", 0.0, 0.0, 1.0),
            Parameter::linear("flow_force_turn", "1", 0.0, 0.6, 0.95),
            Parameter::log(
                "flow_force_span",
                &scale.command_unit,
                0.01 * scale.command,
                0.2 * scale.command,
                scale.command,
            ),
        ]
    },
    trials: |scale, _| {
        [(0.03, 0.2), (0.2, 0.2), (0.2, 0.05), (0.2, 1.0)]
            .map(|(force, span)| vec![force, 0.6, span * scale.command])
            .to_vec()
    },
    ..ENTRY
};

/// The steady flow force, whose jet turns with the opening, pulls the spool towards null.
#[derive(Debug, Clone)]
pub(in crate::model) struct FlowForceOfAngle<R> {
    share: R,
    turn: R,
    span: R,
}

impl<R: Real> FlowForceOfAngle<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            share: next(),
            turn: next(),
            span: next(),
        }
    }
}

impl<R: Real> Act<R> for FlowForceOfAngle<R> {
    fn pulls(&self) -> bool {
        true
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        let (turned, _) = (motion.spool.abs() / self.span).caught_up();
        let left = R::constant(1.0) - self.turn * turned;
        drive - motion.gain * self.share * left * motion.load
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn past_its_span_the_jet_has_turned() {
        let mut values = [0.1, 0.5, 2.0].into_iter();
        let effect: FlowForceOfAngle<f64> = FlowForceOfAngle::new(|| values.next().unwrap());
        let force = |spool: f64| {
            let motion = Motion {
                gain: 200.0,
                time_constant: 0.003,
                spool,
                speed: 0.0,
                slip_direction: 0.0,
                load: spool,
                drop: 0.0,
            };
            -effect.drive(&[], 0.0, &motion) / 200.0
        };
        assert!((force(0.001) - 0.0001).abs() < 1e-7);
        assert!((force(-2.0) + 0.2 * (1.0 - 0.5 * (1.0 - (-1f64).exp()))).abs() < 1e-6);
        assert!((force(40.0) - 4.0 * 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_drive_loses_the_force() {
        let mut values = [0.1].into_iter();
        let effect: FlowForce<f64> = FlowForce::new(|| values.next().unwrap());
        let motion = Motion {
            gain: 200.0,
            time_constant: 0.003,
            spool: 1.0,
            speed: 0.0,
            slip_direction: 0.0,
            load: 2.0,
            drop: 0.0,
        };
        assert_eq!(effect.drive(&[], 100.0, &motion), 100.0 - 200.0 * 0.1 * 2.0);
    }

    #[test]
    fn behind_the_integrator_it_takes_of_the_lead() {
        let mut values = [0.1].into_iter();
        let effect: FlowForceBehind<f64> = FlowForceBehind::new(|| values.next().unwrap());
        let motion = Motion {
            gain: 200.0,
            time_constant: 0.002,
            spool: 1.0,
            speed: 0.0,
            slip_direction: 0.0,
            load: 2.0,
            drop: 0.0,
        };
        assert_eq!(effect.speed(&[], 300.0, &motion), 300.0 - 0.1 * 2.0 / 0.002);
        assert_eq!(effect.drive(&[], 100.0, &motion), 100.0);
    }
}
