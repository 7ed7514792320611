//! The two directions have different gains.

use super::host;
use super::in_loop::lag_alone;
use super::{Act, Entry, Motion, Port, Stage};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "asymmetric_gain",
    port: Port::Area,
    summary: "The valve opens more in one direction than in the other",
    finding: "the valve opens more in one direction than in the other, by {asymmetric_gain} either way",
    equation: "h = x (1 + asymmetric_gain) for x > 0, x (1 - asymmetric_gain) for x < 0",
    shows: "a residual in proportion to |x|: second harmonic, single-valued; the spool does not show it",
    confused: "sensor_offset and null_bias, which are there at null, too",
    source: "asymmetric metering edges, differential cylinders; ISO 10770-1, symmetry",
    parameters: |_, _| vec![Parameter::linear("asymmetric_gain", "1", -0.9, 0.0, 0.9)],
    trials: |_, _| vec![vec![0.05]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::shows_its_area,
    outputs: None,
    view: None,
    frequency: None,
};

/// The valve opens more in one direction than in the other.
#[derive(Debug, Clone)]
pub(in crate::model) struct AsymmetricGain<R> {
    share: R,
}

impl<R: Real> AsymmetricGain<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for AsymmetricGain<R> {
    #[inline(always)]
    fn opening(&self, opening: R) -> R {
        opening + self.share * opening.abs()
    }
}

pub(super) const LOOP: Entry = Entry {
    name: "asymmetric_gain~loop",
    port: Port::Actuator,
    summary: "The spool is driven harder to one side than to the other",
    finding: "the drive of the spool is larger to one side than to the other, by {loop_asymmetry} either way",
    equation: "T dw/dt + w = d (1 + loop_asymmetry sign(d)), d = K sat(u - x, S)",
    shows: "steps that are slower one way than the other, whatever their size, and that come to rest alike",
    confused: "slew_limit~sides and slew_limit~uneven, whose small steps are alike to both sides",
    source: "output stages of amplifiers, and nozzles that differ: Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| vec![Parameter::linear("loop_asymmetry", "1", -0.9, 0.0, 0.9)],
    trials: |_, _| vec![vec![0.1]],
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The spool is driven harder to one side than to the other.
#[derive(Debug, Clone)]
pub(in crate::model) struct AsymmetricGainOfLoop<R> {
    share: R,
}

impl<R: Real> AsymmetricGainOfLoop<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for AsymmetricGainOfLoop<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, _motion: &Motion<R>) -> R {
        drive + self.share * drive.abs()
    }
}

pub(super) const PILOT: Entry = Entry {
    name: "asymmetric_gain~pilot",
    summary: "The spool's speed is the flow of a pilot stage, which delivers more to one side than to the other",
    finding: "the pilot stage delivers more to one side than to the other, by {pilot_asymmetry} either way",
    equation: "T dw/dt + w = K sat(u - x, S), dx/dt = w (1 + pilot_asymmetry sign(w))",
    confused: "asymmetric_gain~loop, whose asymmetry the lag smooths; slew_limit~sides and slew_limit~uneven, whose small steps are \
               alike to both sides",
    source: "flow of a pilot stage to unequal areas of the spool: Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| vec![Parameter::linear("pilot_asymmetry", "1", -0.9, 0.0, 0.9)],
    ..LOOP
};

/// The pilot stage delivers more to one side than to the other.
#[derive(Debug, Clone)]
pub(in crate::model) struct AsymmetricGainOfPilot<R> {
    share: R,
}

impl<R: Real> AsymmetricGainOfPilot<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { share: next() }
    }
}

impl<R: Real> Act<R> for AsymmetricGainOfPilot<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
        lag_alone(drive, motion, self.speed(own, motion.speed, motion))
    }

    #[inline(always)]
    fn speed(&self, _own: &[R], speed: R, _motion: &Motion<R>) -> R {
        speed + self.share * speed.abs()
    }
}

pub(super) const SATURATION: Entry = Entry {
    name: "asymmetric_gain~saturation",
    summary: "What drives the spool saturates sooner to one side than to the other",
    finding: "the drive saturates later to the positive side than to the negative one, by {saturation_excess} either way",
    equation: "K sat(u - x, S) between -S + saturation_excess and S + saturation_excess",
    shows: "large steps that are slower one way than the other, and small ones that are alike",
    confused: "asymmetric_gain~loop, whose small steps are not alike, either; slew_limit~sides, whose limit has no lag before it; null_bias~pilot, \
               which rests beside its command",
    source: "limits of an amplifier or torque motor that are not adjusted alike; sat(e - b) + b: the same as a null bias and a pilot stage beside \
             its middle that cancel each other at rest",
    parameters: |scale, _| {
        let (unit, most) = (&scale.command_unit, 0.3 * scale.command);
        vec![Parameter::linear(
            "saturation_excess",
            unit,
            -most,
            0.0,
            most,
        )]
    },
    trials: |scale, _| {
        [-0.03, 0.01, 0.03]
            .map(|share| vec![share * scale.command])
            .to_vec()
    },
    ..LOOP
};

/// The drive saturates sooner to one side.
#[derive(Debug, Clone)]
pub(in crate::model) struct AsymmetricSaturation<R> {
    excess: R,
}

impl<R: Real> AsymmetricSaturation<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { excess: next() }
    }
}

impl<R: Real> Act<R> for AsymmetricSaturation<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, _spool: R, _stage: &Stage<R>) -> R {
        command - self.excess
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        drive + motion.gain * self.excess
    }
}

#[cfg(test)]
mod tests {
    use super::super::in_loop::tests::AT;
    use super::*;

    #[test]
    fn each_direction_has_its_gain() {
        let mut values = [0.25].into_iter();
        let effect: AsymmetricGain<f64> = AsymmetricGain::new(|| values.next().unwrap());
        assert_eq!([8.0, -8.0].map(|x| effect.opening(x)), [10.0, -6.0]);
    }

    #[test]
    fn a_drive_that_saturates_unevenly_is_even_where_it_does_not() {
        let effect: AsymmetricSaturation<f64> = AsymmetricSaturation::new(|| 0.5);
        // K sat(u - x, 2 V) of a spool at 1 V.
        let drive = |command| {
            let reference = effect.reference(&[], command, 1.0, &Stage::first(command, 0.0));
            let drive = AT.gain * (reference - 1.0).clamp(-2.0, 2.0);
            effect.drive(&[], drive, &AT) / AT.gain
        };
        let found = [-9.0, -0.5, 0.0, 1.0, 3.25, 9.0].map(drive);
        assert_eq!(found, [-1.5, -1.5, -1.0, 0.0, 2.25, 2.5]);
    }

    #[test]
    fn a_pilot_stage_is_driven_alike_and_a_loop_is_not() {
        let [of_loop, of_pilot] = [
            &AsymmetricGainOfLoop::new(|| 0.25) as &dyn Act<f64>,
            &AsymmetricGainOfPilot::new(|| 0.25),
        ];
        let at = |speed| Motion { speed, ..AT };
        // What w is driven by and what the spool makes of it.
        let passed = |effect: &dyn Act<f64>, [drive, speed]: [f64; 2]| {
            let led = effect.drive(&[], drive, &at(speed));
            [led, effect.speed(&[], speed, &at(speed))]
        };
        assert_eq!(passed(of_loop, [80.0, -40.0]), [100.0, -40.0]);
        // T dw/dt = 80 - 40, where the state that leads has the spool's own speed besides.
        assert_eq!(passed(of_pilot, [80.0, 40.0]), [90.0, 50.0]);
        assert_eq!(passed(of_pilot, [-80.0, -40.0]), [-70.0, -30.0]);
    }
}
