//! How strong an effect has to be for the base model to fail by so much.

use super::plan::Variant;
use crate::Result;
use crate::diagnose::{Compared, Cut, Measurements, errors};
use crate::evaluate::problem::Data;
use crate::evaluate::{Problem, parameters_for, reference, structure_for};
use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
use crate::model::{Output, Outputs, Parameter};
use crate::record::Channel;
use crate::search::polish::{PolishOptions, polish};
use crate::simulator::{
    FULL_SCALE, Form, Kind, Noise, Oddity, Outsider, Planted, Setup, SpoolUnit,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// What is planted, whose value is still open.
#[derive(Debug, Clone)]
pub(super) struct Open {
    cause: Cause,
    dial: Dial,
}

#[derive(Debug, Clone)]
enum Cause {
    Effect(Planted),
    Outsider(Oddity),
}

/// A value as a function of a strength that is 1 where the value is usual.
#[derive(Debug, Clone, Copy)]
struct Dial {
    usual: f64,
    /// The weakest and the strongest value that make sense; of some effects the small values are the strong ones.
    weakest: f64,
    strongest: f64,
    negative: bool,
    /// The value of what is absent.
    absent: f64,
}

impl Dial {
    /// A value that is absent at zero and makes sense up to `strongest`.
    fn rising(usual: f64, strongest: f64) -> Self {
        Self {
            usual,
            weakest: 1e-4 * usual,
            strongest,
            negative: false,
            absent: 0.0,
        }
    }

    /// A limit, which is stronger the smaller it is.
    fn limit(weakest: f64, usual: f64, strongest: f64) -> Self {
        Self {
            usual,
            weakest,
            strongest,
            negative: false,
            absent: 0.0,
        }
    }

    fn from(self, absent: f64) -> Self {
        Self { absent, ..self }
    }

    fn signed(self, rng: &mut ChaCha8Rng) -> Self {
        Self {
            negative: rng.random(),
            ..self
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            usual: factor * self.usual,
            weakest: factor * self.weakest,
            strongest: factor * self.strongest,
            ..self
        }
    }

    fn value(&self, strength: f64) -> f64 {
        let value = match self.strongest < self.weakest {
            true => (self.usual / strength).clamp(self.strongest, self.weakest),
            false => (self.usual * strength).clamp(self.weakest, self.strongest),
        };
        self.absent + if self.negative { -value } else { value }
    }
}

impl Open {
    /// An effect on the valve of `setup`, with further parameters and the sign drawn.
    pub(super) fn effect(variant: &Variant, setup: &Setup, rng: &mut ChaCha8Rng) -> Self {
        let Variant {
            kind,
            form,
            channel,
        } = *variant;
        let valve = setup.valve;
        let full_scale = match (channel, setup.spool_unit) {
            (Channel::Flow, _) => valve.rated_flow,
            (_, SpoolUnit::Percent) => 100.0,
            (_, SpoolUnit::Volt) => FULL_SCALE,
        };
        let mut planted = Planted::new(kind, 0.0).form(form).on(channel);
        let mut extra = |name, low: f64, high: f64| {
            let value = low * (high / low).powf(rng.random::<f64>());
            planted.extra.push((name, value));
        };
        match kind {
            Kind::Leakage => extra("width", 1.5, 8.0),
            Kind::Overlap if form == Form::Leaking => extra("closing", 0.5, 4.0),
            Kind::Overlap if form == Form::Bridge => {
                for edge in ["b_t", "p_b", "a_t"] {
                    extra(edge, 0.5, 8.0);
                }
                extra("clearance", 0.3, 3.0);
            }
            Kind::SupplyDroop => {
                extra("lag", 0.01, 0.06);
                if matches!(form, Form::Limited | Form::Accumulator) {
                    extra("pump", 0.4 * valve.rated_flow, 0.8 * valve.rated_flow);
                }
            }
            Kind::DcGain if form == Form::Heating => {
                extra("time", 0.05 * setup.seconds, 0.5 * setup.seconds)
            }
            Kind::LineResonance => {
                extra("damping", 0.05, 0.3);
                if form == Form::Share {
                    extra("share", 0.3, 0.8);
                }
            }
            Kind::SensorLag if form == Form::Turbine => {
                planted.extra.push(("at", valve.rated_flow));
                planted.extra.push(("rest", 0.05));
                planted.extra.push(("drag", rng.random_range(0.0..0.04)));
            }
            Kind::CommandHum if form == Form::Overtone => {
                extra("frequency", 8.0, 150.0);
                extra("share", 0.05, 0.5);
                extra("second", 0.05, 0.5);
            }
            Kind::PeriodicDisturbance | Kind::CommandHum => extra("frequency", 8.0, 150.0),
            Kind::DcGain if form == Form::Leaking => extra("zero", 0.2, 3.0),
            Kind::StrokeLimit if form == Form::Rail => extra("rail", 12.0, 15.0),
            Kind::NullBias if matches!(form, Form::Settling | Form::Transducer) => {
                extra("warm_up", 0.3 * setup.seconds, setup.seconds);
            }
            Kind::SpoolResonance if form == Form::Lagged => extra("damping", 0.2, 0.6),
            Kind::DeadBand if form == Form::Compensated => extra("start", 0.02, 0.2),
            Kind::SlewLimit if form == Form::Ramps => {
                let speed = valve.gain * valve.saturation;
                extra("closing", 0.3 * speed, 2.0 * speed);
            }
            Kind::FlowSaturation if form == Form::Choked => extra("negative", 50.0, 1000.0),
            Kind::DcGain if form == Form::Creeping => {
                extra("time", 0.05 * setup.seconds, 0.3 * setup.seconds)
            }
            Kind::FlowForce if form == Form::Angle => {
                extra("turn", 0.5, 0.7);
                extra("span", 0.2, 5.0);
            }
            Kind::Hysteresis if form == Form::Gradual => extra("travel", 0.2, 3.0),
            Kind::Hysteresis if form == Form::Spread => extra("widest", 0.5, 4.0),
            Kind::Hysteresis if form == Form::Loop => extra("share", 0.3, 0.9),
            Kind::IntegralAction if form == Form::Tracking => extra("tracking", 20.0, 200.0),
            Kind::IntegralAction if form == Form::Limited => extra("limit", 0.1, 1.0),
            Kind::IntegralAction if form == Form::Leaking => extra("leak", 0.5, 5.0),
            _ => {}
        }
        let may_heat = match kind {
            Kind::ViscosityDrift => form == Form::Usual,
            kind => kind == Kind::NullBias && form == Form::Drifting,
        };
        let heats = may_heat && rng.random();
        if heats {
            planted.extra.push(("heating", 15.0));
        }
        let speed = valve.gain * valve.saturation;
        let dial = match kind {
            // A loop that is later by about 1 / gain is not stable.
            Kind::Delay if form == Form::Loop => Dial::rising(0.2, 0.6).times(1.0 / valve.gain),
            Kind::CommandLag if form == Form::Loop => {
                Dial::rising(0.2, 0.9).times(1.0 / valve.gain)
            }
            Kind::Delay => Dial::rising(0.002, 0.08),
            Kind::DeadBand => Dial::rising(0.2, 2.5),
            Kind::DcGain if matches!(form, Form::Heating | Form::Leaking) => {
                Dial::limit(0.995, 0.96, 0.7)
            }
            Kind::DcGain => Dial::rising(0.03, 0.4).signed(rng).from(1.0),
            Kind::NullBias if form == Form::Supply => Dial::rising(0.03, 0.6).signed(rng),
            Kind::NullBias if heats => Dial::rising(0.02, 0.2).signed(rng),
            Kind::NullBias if form == Form::Drifting => Dial::rising(0.03, 0.4).signed(rng),
            Kind::NullBias => Dial::rising(0.3, 2.5).signed(rng),
            Kind::Hysteresis => Dial::rising(0.15, 1.8),
            Kind::CommandLag => Dial::rising(0.003, 0.1),
            Kind::CommandHum => Dial::rising(0.1, 3.0),
            Kind::FeedForward => Dial::rising(0.003, 0.1),
            Kind::PilotSupply => Dial::rising(0.5, 1.5),
            Kind::IntegralAction => Dial::rising(12.0, 0.15 * valve.gain),
            Kind::FeedbackCurvature => Dial::rising(0.2, 1.5).signed(rng),
            // Below the loop's own frequency the loop is not stable, and with a damping above 1 nothing rings.
            Kind::SpoolResonance if form == Form::Usual => {
                let own = valve.frequency();
                let fastest = 4.0 * valve.damping() * own;
                Dial::limit(0.98 * fastest, (1.4 * own).min(0.9 * fastest), 1.05 * own)
            }
            // Without the lag it would be stable down to half the strongest.
            Kind::SpoolResonance => {
                let damping = planted.key("damping").unwrap_or(1.0);
                let slowest = valve.frequency() / (2.0 * valve.damping() * damping);
                Dial::limit(10.0 * slowest, 1.5 * slowest, slowest)
            }
            Kind::SlewLimit => Dial::limit(2.0 * speed, 0.7 * speed, 0.05 * speed),
            Kind::Friction => Dial::rising(0.1, 0.8 * valve.saturation.min(3.0)),
            Kind::FlowForce => Dial::rising(0.1, 0.9),
            Kind::StrokeLimit => Dial::limit(11.0, 7.5, 1.0),
            Kind::Overlap if form == Form::Leaking => Dial::rising(2.0, 20.0),
            Kind::Overlap => Dial::rising(4.0, 40.0),
            Kind::AsymmetricGain => Dial::rising(0.05, 0.6).signed(rng),
            Kind::GainCurvature if form == Form::Laminar => Dial::rising(0.05, 0.4),
            Kind::GainCurvature if form == Form::Tanh => Dial::rising(0.1, 0.7),
            Kind::GainCurvature => Dial::rising(0.1, 0.6).signed(rng),
            Kind::FlowSaturation if form == Form::Series => Dial::limit(800.0, 200.0, 30.0),
            Kind::FlowSaturation => Dial::limit(105.0, 75.0, 10.0),
            Kind::Leakage => Dial::rising(0.025, 0.25).times(valve.rated_flow),
            Kind::SupplyDroop => Dial::rising(1.8, 8.0).times(1.0 / valve.rated_flow),
            Kind::Compressibility => Dial::rising(0.004, 0.4),
            Kind::LineResonance => Dial::limit(440.0, 150.0, 6.0),
            Kind::ViscosityDrift if heats => Dial::rising(0.005, 0.04).signed(rng),
            Kind::ViscosityDrift => Dial::rising(0.05, 0.4)
                .times(1.0 / setup.seconds)
                .signed(rng),
            Kind::SensorLag => Dial::rising(0.003, 0.4),
            Kind::SensorCurvature if form == Form::Usual => Dial::rising(0.03, 0.2).signed(rng),
            Kind::SensorCurvature => Dial::rising(0.05, 0.6).signed(rng),
            Kind::SensorOffset => Dial::rising(0.015, 0.4).times(full_scale).signed(rng),
            Kind::SensorDrift => Dial::rising(0.02, 0.4)
                .times(full_scale / setup.seconds)
                .signed(rng),
            Kind::PeriodicDisturbance => Dial::rising(0.01, 0.4).times(full_scale),
        };
        Self {
            cause: Cause::Effect(planted),
            dial,
        }
    }

    /// Something that is in no catalogue.
    pub(super) fn outsider(oddity: Oddity) -> Self {
        let strongest = match oddity {
            share if share.is_share() => 0.8,
            _ => (20.0 * oddity.typical()).min(5.0),
        };
        Self {
            cause: Cause::Outsider(oddity),
            dial: Dial::rising(oddity.typical(), strongest),
        }
    }

    /// `setup` with it at this strength.
    fn on(&self, setup: &Setup, strength: f64) -> Setup {
        let mut setup = setup.clone();
        let value = self.dial.value(strength);
        match &self.cause {
            Cause::Effect(planted) => setup.planted.push(Planted {
                value,
                ..planted.clone()
            }),
            Cause::Outsider(oddity) => setup.outsiders.push(Outsider {
                oddity: *oddity,
                value,
            }),
        }
        setup
    }

    /// `setup` with it, as strong as makes the base model's held-out error `target` times the noise on the channel
    /// where it is largest, or as near to that as it gets.
    ///
    /// # Errors
    /// The simulator refuses the setup at every strength.
    pub(super) fn planted(&self, setup: &Setup, target: f64) -> Result<Setup> {
        let wanted = (target * target - 1.0).sqrt();
        let mut base = Base::new(setup);
        let mut tried: Vec<Tried> = Vec::new();
        let mut best: Option<(f64, Setup)> = None;
        let mut failure = None;
        let mut strength = 1.0;
        for _ in 0..TRIES {
            let candidate = self.on(setup, strength);
            let missed = match base.misses(&candidate) {
                Ok(missed) => missed.max(1e-9),
                Err(error) => {
                    failure = Some(error);
                    f64::INFINITY
                }
            };
            let off = (missed / wanted).ln().abs();
            if missed.is_finite() && best.as_ref().is_none_or(|best| off < best.0) {
                best = Some((off, candidate));
            }
            tried.push(Tried { strength, missed });
            let next = next(&mut tried, wanted);
            if off < CLOSE || self.dial.value(next) == self.dial.value(strength) {
                break;
            }
            strength = next;
        }
        match (best, failure) {
            (Some((_, setup)), _) => Ok(setup),
            (None, Some(error)) => Err(error),
            (None, None) => unreachable!("something was tried"),
        }
    }
}

/// A strength, and by how much the base model then misses the record, in units of the noise.
#[derive(Debug, Clone, Copy)]
struct Tried {
    strength: f64,
    missed: f64,
}

/// The strength to try next, after some of which the last one was not right.
fn next(tried: &mut [Tried], wanted: f64) -> f64 {
    tried.sort_by(|a, b| a.strength.total_cmp(&b.strength));
    let Some(first) = tried.iter().position(|one| one.missed >= wanted) else {
        // Too weak so far: stronger. But where an effect becomes so strong that the base model takes it for its own, as
        // it takes a slew limit for saturation, what it misses has a peak: then next to that, on the wider side.
        let missed = |index: &usize| tried[*index].missed;
        let all = 0..tried.len();
        let peak = all
            .max_by(|a, b| missed(a).total_cmp(&missed(b)))
            .unwrap_or(0);
        let Tried { strength, missed } = tried[peak];
        let ratio = |stronger: usize| tried[stronger].strength / tried[stronger - 1].strength;
        return match (peak > 0, peak + 1 < tried.len()) {
            (_, false) => strength * (wanted / missed).clamp(1.2, 5.0),
            (true, true) if ratio(peak) > ratio(peak + 1) => strength / ratio(peak).sqrt(),
            (_, true) => strength * ratio(peak + 1).sqrt(),
        };
    };
    let high = tried[first];
    match first {
        0 => high.strength * (wanted / high.missed).clamp(0.2, 0.9),
        _ => between(tried[first - 1], high, wanted),
    }
}

/// A strength between a weaker and a stronger one, on the line through both in logarithms and not too near to either.
fn between(low: Tried, high: Tried, wanted: f64) -> f64 {
    let share = (wanted / low.missed).ln() / (high.missed / low.missed).ln();
    let share = if share > 0.0 {
        share.clamp(0.1, 0.9)
    } else {
        0.5
    };
    low.strength * (high.strength / low.strength).powf(share)
}

/// Strengths that are tried for one record, at most.
const TRIES: usize = 8;
/// Relative error of what the base model misses at which the strength is right.
const CLOSE: f64 = 0.07;
/// Gain and time constant are sought this factor around the true ones.
const NEAR: f64 = 5.0;

/// A polish that need not know the fourth digit.
const QUICK: PolishOptions = PolishOptions {
    max_iterations: 15,
    gradient_tolerance: 1e-5,
    step_tolerance: 1e-5,
    cost_tolerance: 1e-4,
    damping: 1e-3,
    edge_tolerance: 0.03,
};

/// The base model, which begins at the truth and goes on from its last fit.
struct Base {
    known: [(&'static str, f64); 3],
    last: Option<Vec<f64>>,
}

impl Base {
    fn new(setup: &Setup) -> Self {
        let valve = setup.valve;
        Self {
            known: [
                (GAIN, valve.gain),
                (TIME_CONSTANT, valve.time_constant),
                (SATURATION, valve.saturation),
            ],
            last: None,
        }
    }

    /// The held-out error of the base model on a record of `setup` without noise, over the noise that it would have, on
    /// the channel where that is largest.
    fn misses(&mut self, setup: &Setup) -> Result<f64> {
        let clean = Setup {
            noise: Noise::white(0.0),
            quantisation: None,
            ..setup.clone()
        };
        let records = [clean.record()?];
        let structure = structure_for(&records)?;
        let mut parameters = parameters_for(&structure, &records);
        for parameter in &mut parameters {
            self.narrow(parameter);
        }
        let rate = structure.fastest_rate(&parameters);
        let measurements = Measurements::new(&records, &[], Cut::default(), &structure, rate)?;
        let data = Data::Series(measurements.fit.clone());
        let mut problem = Problem::new(structure, parameters, data);
        let noise = |output: Output| setup.noise_std(output.channel());
        problem.scale = Outputs::from_fn(|output| match noise(output) {
            0.0 => 0.0,
            noise => noise.powi(-2),
        });
        let free = problem.free();
        // Saturation makes valleys: one lies at the truth, one where it takes over, one where the last fit ended.
        let truth = problem.start();
        let mut starts = vec![truth.clone(), truth];
        for (parameter, value) in free.iter().zip(&mut starts[1]) {
            if parameter.name == SATURATION {
                *value = parameter.clamp(*value / 5.0);
            }
        }
        starts.extend(self.last.take());
        let mut best = polish(&mut problem, &free, &starts[0], &QUICK);
        for start in &starts[1..] {
            // Some starts diverge.
            if let Ok(other) = polish(&mut problem, &free, start, &QUICK)
                && !best.as_ref().is_ok_and(|best| best.cost <= other.cost)
            {
                best = Ok(other);
            }
        }
        let found = best?.values;
        let values = problem.complete(&found, |fixed| fixed);
        let held_out = &measurements.hold_out;
        let simulated = reference::trajectories(&problem.structure, &values, held_out);
        let errors = errors(&problem.structure, &Compared::all(held_out, &simulated));
        let observed = problem.structure.observed.iter();
        let missed = observed.map(|&output| errors[output.name()].rmse / noise(output));
        self.last = Some(found);
        Ok(missed.fold(0.0, f64::max))
    }

    fn narrow(&self, parameter: &mut Parameter) {
        let known = self.known.iter().find(|known| known.0 == parameter.name);
        if let Some(&(name, value)) = known {
            // Only these two decide how fine the steps must be.
            if name != SATURATION {
                parameter.low = parameter.low.max(value / NEAR);
                parameter.high = parameter.high.min(value * NEAR);
            }
            parameter.set_nominal(parameter.clamp(value));
        }
    }
}
