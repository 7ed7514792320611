//! A loop settles at a share of its command.

use super::act::lagged;
use super::host;
use super::{Act, Entry, Host, Motion, Port, Stage};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "dc_gain",
    port: Port::Command,
    summary: "The loop settles at a share of its command that is not 1",
    finding: "the loop settles at {dc_gain} times its command",
    equation: "dc_gain u",
    shows: "an error in proportion to the command that stays however long the loop has to settle",
    confused: "flow_force, which pulls a spool back alike but from a saturated loop's speed, too; null_bias and sensor_offset, which do not grow with the command",
    source: "finite gain of a loop without integral action, scales of command and transducer that differ; Merritt, Hydraulic Control Systems, 1967",
    parameters: |_, _| vec![Parameter::linear("dc_gain", "1", 0.5, 1.0, 2.0)],
    trials: |_, _| vec![vec![0.97], vec![1.1]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: compares_with_its_command,
    outputs: None,
    view: None,
    frequency: None,
};

/// In another unit the ratio of loop and command is a parameter of the base model.
fn compares_with_its_command(host: &dyn Host) -> bool {
    let output = host::loop_output(host);
    output.is_some_and(|output| host.unit(output) == host.command_unit())
}

/// The loop settles at a share of its command that is not 1.
#[derive(Debug, Clone)]
pub(in crate::model) struct DcGain<R> {
    gain: R,
}

impl<R: Real> DcGain<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { gain: next() }
    }
}

impl<R: Real> Act<R> for DcGain<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        self.gain * command
    }
}

pub(super) const CREEPING: Entry = Entry {
    name: "dc_gain~creeping",
    summary: "The loop goes to a share of its command at once, and creeps the rest of the way",
    finding: "of its command the loop leaves {creep}, and creeps there with a time constant of {creep_time}",
    equation: "sat(u - creep (u - v) - x, S), creep_time dv/dt + v = u",
    shows: "a spool that stops short of its command, or past it, and creeps there",
    confused: "dc_gain, which stays short; integral_action, whose spool runs past its command; null_bias~settling, which does not go with it",
    source: "a finite gain that a slow integral makes up for, as in position controllers of proportional valves; Astrom, Hagglund, Advanced \
             PID Control, 2006",
    parameters: |scale, _| {
        let slowest = scale.length.max(100.0 * scale.interval);
        vec![
            Parameter::linear("creep", "1", -0.5, 0.0, 0.5),
            Parameter::log(
                "creep_time",
                "s",
                20.0 * scale.interval,
                0.2 * slowest,
                slowest,
            ),
        ]
    },
    trials: |scale, _| {
        [0.01, 0.05, 0.3]
            .map(|share| vec![0.03, (share * scale.length).max(20.0 * scale.interval)])
            .to_vec()
    },
    states: &["creeping_command"],
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The loop creeps to what it leaves of its command.
#[derive(Debug, Clone)]
pub(in crate::model) struct DcGainCreeping<R> {
    share: R,
    time_constant: R,
}

impl<R: Real> DcGainCreeping<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            share: next(),
            time_constant: next(),
        }
    }

    /// The command through its lag: `own` is that when the step began.
    #[inline(always)]
    fn crept(&self, own: &[R], command: R, stage: &Stage<R>) -> R {
        let lag = self.time_constant;
        lagged(own[0], stage.command, command, lag, stage.since)
    }
}

impl<R: Real> Act<R> for DcGainCreeping<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    #[inline(always)]
    fn settled(&self, own: &mut [R], command: R) {
        own[0] = command;
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        command - self.share * (command - self.crept(own, command, stage))
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, _spool: R, stage: &Stage<R>) {
        own[0] = self.crept(own, command, stage);
    }
}

pub(super) const HEATING: Entry = Entry {
    name: "dc_gain~heating",
    summary: "The coil's resistance rises as the command heats it, and what the command moves falls",
    finding: "at full scale the coil's resistance comes to rise by {coil_heating}, with a time constant of {coil_time}",
    equation: "sat(u/(1 + w) - x, S), coil_time dw/dt + w = coil_heating (u/coil_span)^2",
    shows: "a spool that stays the shorter of its command the longer that is large, on both sides",
    confused: "dc_gain, which does not change; dc_gain~creeping, which goes the other way at small commands, too; viscosity_drift",
    source: "resistance of copper, 0.39 % a kelvin, of a coil that a voltage drives; first-order heating of a body",
    parameters: |scale, _| {
        let slowest = scale.length.max(100.0 * scale.interval);
        let span = (scale.command, &scale.command_unit);
        vec![
            Parameter::linear("coil_heating", "1", 0.0, 0.0, 2.0),
            Parameter::log(
                "coil_time",
                "s",
                0.01 * slowest,
                0.2 * slowest,
                4.0 * slowest,
            ),
            Parameter::linear("coil_span", span.1, 0.0, span.0, span.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [(0.1, 0.1), (0.5, 0.1), (0.2, 0.5)]
            .map(|(heating, share)| vec![heating, share * scale.length.max(100.0 * scale.interval)])
            .to_vec()
    },
    states: &["warmth_of_coil"],
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The command heats its coil.
#[derive(Debug, Clone)]
pub(in crate::model) struct DcGainHeating<R> {
    heating: R,
    time_constant: R,
    span: R,
}

impl<R: Real> DcGainHeating<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            heating: next(),
            time_constant: next(),
            span: next(),
        }
    }

    /// What a command would heat the coil to.
    #[inline(always)]
    fn heated(&self, command: R) -> R {
        let share = command / self.span;
        self.heating * share * share
    }

    /// How warm it is: `own` is that when the step began.
    #[inline(always)]
    fn warmth(&self, own: &[R], command: R, stage: &Stage<R>) -> R {
        let before = self.heated(stage.command);
        let after = self.heated(command);
        lagged(own[0], before, after, self.time_constant, stage.since)
    }
}

impl<R: Real> Act<R> for DcGainHeating<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    /// Cold where a record begins.
    #[inline(always)]
    fn settled(&self, own: &mut [R], _command: R) {
        own[0] = R::constant(0.0);
    }

    #[inline(always)]
    fn reference(&self, own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        command / (R::constant(1.0) + self.warmth(own, command, stage))
    }

    #[inline(always)]
    fn remember(&self, own: &mut [R], command: R, _spool: R, stage: &Stage<R>) {
        own[0] = self.warmth(own, command, stage);
    }
}

pub(super) const LEAKING: Entry = Entry {
    name: "dc_gain~leaking",
    port: Port::Actuator,
    summary: "The loop's integrator leaks: the spool rests where its error makes up for that",
    finding: "the loop's integrator leaks towards {leaking_zero}, so that the loop settles at {leaking_gain} of the way from there",
    equation: "dz/dt = K (sat(u - x, S) - (1 / leaking_gain - 1) (z - leaking_zero))",
    shows: "a spool that settles beside its command, by more the further it is from where the leak leads, and that moves faster towards there than away \
            where its loop is saturated",
    confused: "dc_gain, whose loop is as fast either way; flow_force, which pulls towards null alike, but with the pressure drop",
    source: "leakage and bias current of an analogue integrator: Horowitz, Hill, The Art of Electronics, 2015",
    parameters: |scale, _| {
        let most = scale.command;
        vec![
            Parameter::linear("leaking_gain", "1", 0.5, 1.0, 1.0),
            Parameter::linear("leaking_zero", &scale.command_unit, -most, 0.0, most),
        ]
    },
    trials: |_, _| vec![vec![0.97, 0.0]],
    applies: compares_with_its_command,
    ..ENTRY
};

/// The loop's integrator leaks.
#[derive(Debug, Clone)]
pub(in crate::model) struct DcGainLeaking<R> {
    leak: R,
    zero: R,
}

impl<R: Real> DcGainLeaking<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        let one = R::constant(1.0);
        Self {
            leak: one / next() - one,
            zero: next(),
        }
    }
}

impl<R: Real> Act<R> for DcGainLeaking<R> {
    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        let integrator = motion.spool + motion.time_constant * motion.speed;
        drive - motion.gain * self.leak * (integrator - self.zero)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaking_integrator_rests_at_its_gain_and_drives_harder_towards_its_zero() {
        let mut values = [0.8, 2.0].into_iter();
        let effect: DcGainLeaking<f64> = DcGainLeaking::new(|| values.next().unwrap());
        let at = |spool, speed| Motion {
            gain: 100.0,
            time_constant: 0.005,
            spool,
            speed,
            slip_direction: 0.0,
            load: 0.0,
            drop: 0.0,
        };
        // 80 % of the way from 2 V to 7 V.
        assert!(effect.drive(&[], 100.0 * (7.0 - 6.0), &at(6.0, 0.0)).abs() < 1e-9);
        // z = 10 V is 8 V away; z = -6 V as far on the other side.
        let drives = [at(9.0, 200.0), at(-5.0, -200.0)].map(|one| effect.drive(&[], 300.0, &one));
        assert!((drives[0] - 100.0).abs() < 1e-9 && (drives[1] - 500.0).abs() < 1e-9);
    }
    use crate::model::base::servo_valve::Piston;
    use crate::model::{Output, ServoValve, Structure};

    #[test]
    fn the_loop_is_asked_for_a_share_of_the_command() {
        let mut values = [0.97].into_iter();
        let effect: DcGain<f64> = DcGain::new(|| values.next().unwrap());
        assert_eq!(effect.command(&mut [], -2.0), -1.94);
    }

    #[test]
    fn it_creeps_to_the_whole_of_the_command() {
        let mut values = [0.1, 2.0].into_iter();
        let effect: DcGainCreeping<f64> = DcGainCreeping::new(|| values.next().unwrap());
        let mut own = [0.0];
        let stage = |since| Stage {
            since,
            ..Stage::first(5.0, 0.0)
        };
        assert!((effect.reference(&own, 5.0, 0.0, &stage(0.0)) - 4.5).abs() < 1e-9);
        effect.remember(&mut own, 5.0, 0.0, &stage(2.0));
        let after = effect.reference(&own, 5.0, 0.0, &stage(0.0));
        assert!(
            (after - (5.0 - 0.5 * (-1f64).exp())).abs() < 1e-5,
            "{after}"
        );
    }

    #[test]
    fn a_warm_coil_moves_less() {
        let mut values = [0.5, 2.0, 10.0].into_iter();
        let effect: DcGainHeating<f64> = DcGainHeating::new(|| values.next().unwrap());
        let mut own = [7.0];
        effect.settled(&mut own, 5.0);
        let stage = |since| Stage {
            since,
            ..Stage::first(5.0, 0.0)
        };
        assert!((effect.reference(&own, 5.0, 0.0, &stage(0.0)) - 5.0).abs() < 1e-9);
        effect.remember(&mut own, 5.0, 0.0, &stage(2.0));
        let warm = 0.125 * (1.0 - (-1f64).exp());
        let after = effect.reference(&own, 5.0, 0.0, &stage(0.0));
        assert!((after - 5.0 / (1.0 + warm)).abs() < 1e-5, "{after}");
    }

    #[test]
    fn only_a_loop_in_the_unit_of_its_command_has_a_gain_that_should_be_1() {
        let loop_of = |command_unit: &str, output, spool_unit: Option<&str>, piston| Structure {
            observed: vec![output],
            base: ServoValve {
                spool_unit: spool_unit.map(String::from),
                piston,
                ..ServoValve::default()
            }
            .into(),
            ..Structure::actuator(10.0, command_unit)
        };
        for (structure, gain, lead) in [
            (
                loop_of("V", Output::Spool, None, Piston::Integrated),
                true,
                true,
            ),
            (
                loop_of("V", Output::Spool, Some("%"), Piston::Integrated),
                false,
                true,
            ),
            (
                loop_of("mm", Output::Position, None, Piston::Servo),
                true,
                true,
            ),
            (
                loop_of("V", Output::Position, None, Piston::Servo),
                false,
                true,
            ),
            (
                loop_of("mm", Output::Position, None, Piston::Integrated),
                false,
                false,
            ),
            (
                loop_of("V", Output::Flow, None, Piston::Integrated),
                false,
                false,
            ),
        ] {
            let known = |name| (super::super::entry(name).unwrap().applies)(&structure);
            assert_eq!(
                (known("dc_gain"), known("feed_forward")),
                (gain, lead),
                "{structure:?}"
            );
        }
    }
}
