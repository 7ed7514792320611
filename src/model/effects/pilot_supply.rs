//! The pilot stage is fed from the supply.

use super::host;
use super::view::{self, Over, Values, View};
use super::{Act, Entry, Motion, Port};
use crate::model::{Parameter, Real};

/// Of the mean drop, the least of which a root is taken.
const LEAST_DROP: f64 = 1e-6;

pub(super) const ENTRY: Entry = Entry {
    name: "pilot_supply",
    port: Port::Actuator,
    summary: "The pilot stage is fed from the supply whose pressure is measured, and moves the spool more slowly where that gives way",
    finding: "the loop gain follows the root of the measured pressure by a share of {pilot_supply}; 1 is a pilot stage that is fed by it alone",
    equation: "dz/dt = K sat(u - x, S) (1 + pilot_supply (sqrt(dp/pilot_pressure) - 1)), dp the measured drop from P to T, \
               pilot_pressure its mean",
    shows: "fast stretches that are the slower the lower the pressure is, at all amplitudes alike; nothing where the pressure stands still",
    confused: "slew_limit and saturation, which do not know the pressure; flow_force, whose spool is slow at large openings alone",
    source: "flow of a pilot stage through its orifices; Merritt, Hydraulic Control Systems, 1967; servo valves with internal pilot supply",
    parameters: |scale, _| {
        let mean = scale.rated_drop;
        vec![
            Parameter::linear("pilot_supply", "1", 0.0, 0.0, 2.0),
            Parameter::linear("pilot_pressure", "bar", 1e-3 * mean, mean, 10.0 * mean).fixed(),
        ]
    },
    trials: |_, _| vec![vec![0.5], vec![1.0]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::moves_a_spool_by_measured_pressure,
    outputs: None,
    view: Some(View::new(
        view::triangle(9.0, 0.5, 4),
        Over::Time,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The pilot stage is fed from the supply.
#[derive(Debug, Clone)]
pub(in crate::model) struct PilotSupply<R> {
    share: R,
    mean: R,
}

impl<R: Real> PilotSupply<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            share: next(),
            mean: next(),
        }
    }
}

impl<R: Real> Act<R> for PilotSupply<R> {
    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        let one = R::constant(1.0);
        let root = (motion.drop / self.mean)
            .max(R::constant(LEAST_DROP))
            .sqrt();
        drive * (one + self.share * (root - one))
    }
}

#[cfg(test)]
mod tests {
    use super::super::in_loop::tests::AT;
    use super::*;

    #[test]
    fn the_gain_follows_the_root_of_the_pressure_by_its_share() {
        let at = |share: f64, drop| {
            let mut values = [share, 70.0].into_iter();
            let effect = PilotSupply::new(|| values.next().unwrap());
            effect.drive(&[], 300.0, &Motion { drop, ..AT })
        };
        assert_eq!([at(0.0, 20.0), at(1.0, 70.0)], [300.0; 2]);
        assert!((at(1.0, 17.5) - 150.0).abs() < 1e-10);
        assert!((at(0.5, 17.5) - 225.0).abs() < 1e-10);
        assert!((0.0..1.0).contains(&at(1.0, -3.0)));
    }
}
