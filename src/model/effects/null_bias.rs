//! The command is shifted.

use super::host;
use super::sensor_drift::settling_time;
use super::viscosity_drift::REFERENCE_TEMPERATURE;
use super::{Act, Entry, Motion, Port, Stage};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "null_bias",
    port: Port::Command,
    summary: "The valve's null does not lie at zero command",
    finding: "the valve answers as if {null_bias} were added to the command",
    equation: "u + null_bias",
    shows: "a constant spool error, even harmonics, and a dead zone that is not centred",
    confused: "sensor_offset where only the spool is measured: with flow measured a null bias moves it, too",
    source: "ISO 10770-1, null bias",
    parameters: |scale, _| {
        vec![Parameter::linear(
            "null_bias",
            &scale.command_unit,
            -0.3 * scale.command,
            0.0,
            0.3 * scale.command,
        )]
    },
    trials: |scale, _| vec![vec![0.01 * scale.command]],
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: host::always,
    outputs: None,
    view: None,
    frequency: None,
};

/// The valve's null does not lie at zero command.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBias<R> {
    bias: R,
}

impl<R: Real> NullBias<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { bias: next() }
    }
}

impl<R: Real> Act<R> for NullBias<R> {
    #[inline(always)]
    fn command(&self, _own: &mut [R], command: R) -> R {
        command + self.bias
    }
}

pub(super) const SETTLING: Entry = Entry {
    name: "null_bias~settling",
    summary: "The valve's null moves as the valve warms up, and comes to rest",
    finding: "the valve answers as if {null_shift} came to its command, with a time constant of {null_settling_time}",
    equation: "sat(u + null_shift (1 - exp(-t / null_settling_time)) - x, S)",
    shows: "a spool and a flow that move away together in a curve that levels off",
    confused: "sensor_drift~settling, with which the flow stays; null_bias, which is there from the beginning",
    source: "null shift with temperature: ISO 10770-1; first-order heating of a body",
    parameters: |scale, _| {
        let most = 0.3 * scale.command;
        vec![
            Parameter::linear("null_shift", &scale.command_unit, -most, 0.0, most),
            settling_time("null_settling_time", scale),
        ]
    },
    trials: |scale, _| {
        let amount = 0.02 * scale.command;
        [0.3, 0.8]
            .map(|share| vec![amount, share * scale.length])
            .to_vec()
    },
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The null moves as the valve warms up.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBiasSettling<R> {
    amount: R,
    time: R,
}

impl<R: Real> NullBiasSettling<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            amount: next(),
            time: next(),
        }
    }
}

impl<R: Real> Act<R> for NullBiasSettling<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let (settled, _) = (stage.time / self.time).caught_up();
        command + self.amount * settled
    }
}

pub(super) const DRIFTING: Entry = Entry {
    name: "null_bias~drifting",
    summary: "The valve's null moves on with time, or with the temperature that is measured",
    finding: "the valve answers as if {null_drift} came to its command as it warms up",
    equation: "sat(u + null_drift t - x, S), or u + first_null_bias + null_drift_per_kelvin (temperature - 40 degC) where temperature is \
               measured",
    shows: "a spool and a flow that move away together with time or with the temperature, whatever the command is",
    confused: "null_bias~settling, which comes to rest; sensor_drift, with which the other sensor stays",
    source: "null shift with temperature: ISO 10770-1, whose tests are at 40 degC",
    parameters: |scale, _| {
        let (most, unit) = (0.3 * scale.command, &scale.command_unit);
        let of = |name, per: &str, most: f64| {
            Parameter::linear(name, &format!("{unit}{per}"), -most, 0.0, most)
        };
        let time = of("null_drift", "/s", most / scale.length);
        let heat = of("null_drift_per_kelvin", "/K", 0.1 * most);
        let first = of("first_null_bias", "", most);
        match scale.temperature {
            true => vec![time.fixed(), heat, first],
            false => vec![time, heat.fixed(), first.fixed()],
        }
    },
    trials: |scale, _| {
        let amount = 0.02 * scale.command;
        match scale.temperature {
            true => vec![vec![0.1 * amount, 0.0]],
            false => vec![vec![amount / scale.length]],
        }
    },
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The null moves on with time or temperature.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBiasDrifting<R> {
    drift: R,
    per_kelvin: R,
    first: R,
}

impl<R: Real> NullBiasDrifting<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            drift: next(),
            per_kelvin: next(),
            first: next(),
        }
    }
}

impl<R: Real> Act<R> for NullBiasDrifting<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let warmer = stage.temperature - R::constant(REFERENCE_TEMPERATURE);
        command + self.first + self.drift * stage.time + self.per_kelvin * warmer
    }
}

pub(super) const PILOT: Entry = Entry {
    name: "null_bias~pilot",
    port: Port::Actuator,
    summary: "The pilot stage does not stand in its middle where nothing drives it, and is the faster to one side",
    finding: "the pilot stage goes on as if {pilot_bias} were added to what drives it, and the valve rests by as much beside its command",
    equation: "dz/dt = K (sat(u - x, S) + pilot_bias)",
    shows: "a constant spool error, and large steps that are faster one way than the other by as much",
    confused: "null_bias, whose large steps are alike to both sides; asymmetric_gain~loop, whose small steps are not, and which rests where it \
               was commanded to",
    source: "a clogged fixed orifice or nozzle on one side of a pilot stage; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, _| {
        let most = 0.3 * scale.command;
        vec![Parameter::linear(
            "pilot_bias",
            &scale.command_unit,
            -most,
            0.0,
            most,
        )]
    },
    applies: host::moves_a_spool,
    ..ENTRY
};

/// The pilot stage does not stand in its middle where nothing drives it.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBiasOfPilot<R> {
    bias: R,
}

impl<R: Real> NullBiasOfPilot<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { bias: next() }
    }
}

impl<R: Real> Act<R> for NullBiasOfPilot<R> {
    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn drive(&self, _own: &[R], drive: R, motion: &Motion<R>) -> R {
        drive + motion.gain * self.bias
    }
}

pub(super) const SUPPLY: Entry = Entry {
    name: "null_bias~supply",
    summary: "The valve's null shifts with the supply pressure that is measured",
    finding: "the valve answers as if {supply_null_shift} more were added to the command for each tenth that the measured pressure is \
              above its mean, and {mean_null_bias} where it is at that",
    equation: "sat(u + mean_null_bias + 10 supply_null_shift (dp/null_pressure - 1) - x, S), dp the measured drop from P to T, \
               null_pressure its mean",
    shows: "a spool that moves with the supply's pressure and not with the command; nothing where the pressure stands still",
    confused: "flow_force, whose spool moves with the pressure where the valve is open alone; pilot_supply, whose spool rests where it was \
               commanded to",
    source: "null shift with supply pressure: ISO 10770-1",
    parameters: |scale, _| {
        let (most, mean) = (scale.command, scale.rated_drop);
        let unit = &scale.command_unit;
        vec![
            Parameter::linear("supply_null_shift", unit, -0.1 * most, 0.0, 0.1 * most),
            Parameter::linear("mean_null_bias", unit, -0.3 * most, 0.0, 0.3 * most),
            Parameter::linear("null_pressure", "bar", 1e-3 * mean, mean, 10.0 * mean).fixed(),
        ]
    },
    trials: |scale, _| vec![vec![0.005 * scale.command, 0.0]],
    applies: host::moves_a_spool_by_measured_pressure,
    ..ENTRY
};

/// The null shifts with the supply pressure.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBiasOfSupply<R> {
    shift: R,
    bias: R,
    mean: R,
}

impl<R: Real> NullBiasOfSupply<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            shift: next(),
            bias: next(),
            mean: next(),
        }
    }
}

impl<R: Real> Act<R> for NullBiasOfSupply<R> {
    fn acts_on_the_reference(&self) -> bool {
        true
    }

    fn pulls(&self) -> bool {
        true
    }

    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, _spool: R, stage: &Stage<R>) -> R {
        let tenths = R::constant(10.0) * (stage.drop / self.mean - R::constant(1.0));
        command + self.bias + self.shift * tenths
    }
}

pub(super) const TRANSDUCER: Entry = Entry {
    name: "null_bias~transducer",
    port: Port::Actuator,
    summary: "The transducer of the loop, which is recorded, drifts as it warms up",
    finding: "the loop's transducer, which is recorded, drifts by {transducer_shift} and by {transducer_stretch} of the spool, with a time constant of {transducer_time}",
    equation: "sat(u - y, S), y = x + (transducer_shift + transducer_stretch x) (1 - exp(-t / transducer_time)); recorded is y, the ports have x",
    shows: "a flow at the same measured spool that moves away in a curve that levels off, while the spool seems to follow its command",
    confused: "null_bias~settling, with which the measured spool moves, too; viscosity_drift~settling, whose flow is in proportion to itself",
    source: "thermal zero and span shift of position transducers that close the loop: ISO 10770-1, null shift; IEC 61298-3",
    parameters: |scale, _| {
        let most = 0.3 * scale.command;
        vec![
            Parameter::linear("transducer_shift", &scale.command_unit, -most, 0.0, most),
            Parameter::linear("transducer_stretch", "1", -0.3, 0.0, 0.3),
            settling_time("transducer_time", scale),
        ]
    },
    trials: |scale, _| {
        let amount = 0.02 * scale.command;
        [0.3, 0.8]
            .map(|share| vec![amount, 0.0, share * scale.length])
            .to_vec()
    },
    applies: host::shows_more_than_the_spool,
    ..ENTRY
};

/// The transducer of the loop drifts as it warms up.
#[derive(Debug, Clone)]
pub(in crate::model) struct NullBiasOfTransducer<R> {
    shift: R,
    stretch: R,
    time: R,
}

impl<R: Real> NullBiasOfTransducer<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            shift: next(),
            stretch: next(),
            time: next(),
        }
    }

    /// By how much it shows more than where the spool is.
    #[inline(always)]
    fn off(&self, spool: R, time: R) -> R {
        let (settled, _) = (time / self.time).caught_up();
        (self.shift + self.stretch * spool) * settled
    }
}

impl<R: Real> Act<R> for NullBiasOfTransducer<R> {
    fn feels_load(&self) -> bool {
        false
    }

    #[inline(always)]
    fn reference(&self, _own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
        command - self.off(spool, stage.time)
    }

    #[inline(always)]
    fn seen(&self, _own: &[R], spool: R, time: R) -> R {
        spool + self.off(spool, time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drifting_transducer_is_at_rest_where_it_shows_the_command() {
        let mut values = [0.4, 0.05, 2.0].into_iter();
        let effect: NullBiasOfTransducer<f64> =
            NullBiasOfTransducer::new(|| values.next().unwrap());
        for (time, warm) in [(0.0, 0.0), (2.0, 1.0 - (-1.0f64).exp()), (1e3, 1.0)] {
            let shown = effect.seen(&[], 6.0, time);
            assert!((shown - 6.0 - 0.7 * warm).abs() < 2e-5, "{time}: {shown}");
            let reference = effect.reference(&[], shown, 6.0, &Stage::first(shown, time));
            assert!((reference - 6.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_shift_comes_to_rest() {
        let mut values = [0.4, 2.0].into_iter();
        let effect: NullBiasSettling<f64> = NullBiasSettling::new(|| values.next().unwrap());
        for (time, shifted) in [(0.0, 0.0), (2.0, 0.4 * (1.0 - (-1.0f64).exp())), (1e3, 0.4)] {
            let stage = Stage::first(1.0, time);
            let found = effect.reference(&[], 1.0, 0.0, &stage);
            assert!((found - 1.0 - shifted).abs() < 2e-5, "{time}: {found}");
        }
    }

    #[test]
    fn the_command_is_shifted() {
        let mut values = [0.3].into_iter();
        let effect: NullBias<f64> = NullBias::new(|| values.next().unwrap());
        assert_eq!(effect.command(&mut [], 2.0), 2.3);
    }
}
