//! Where a model fails: it is cut at the measured spool, and each piece is fitted for itself.
//!
//! The piece from command to spool knows nothing of the flow, that from the *measured* spool to the flow nothing of what moved
//! it. What fails says where something is missing, also where it has no name.

use super::evidence::{QUICK, set_start};
use super::fitted::Fitted;
use super::measurements::{Measurements, starts};
use super::simulation::{Compared, residual};
use super::statistics::bootstrap::{MeanSquare, mean_square};
use super::statistics::noise::Noise;
use super::verdict::NEAR;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Interrupt, Problem, reference};
use crate::model::base::servo_valve::SPOOL_GAIN;
use crate::model::effects::{Effect, Port};
use crate::model::{Complete, Drive, Hold, Output, Outputs, Structure};
use crate::search::polish_on_data;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A part of valve and bench that a cut tells from the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Before the spool: command, actuator.
    BeforeSpool,
    /// The sensor of the spool: the flow follows the command, and neither follows what the sensor shows.
    SpoolSensor,
    /// Behind the spool: openings, flow path, supply, flow meter.
    BehindSpool,
    /// Before the spool, or at its sensor, and behind it, too.
    Several,
}

impl Place {
    /// As the end of a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::BeforeSpool => "before the spool, in command or actuator",
            Self::SpoolSensor => "at the sensor of the spool",
            Self::BehindSpool => "behind the spool, in openings, flow path, supply or flow meter",
            Self::Several => {
                "in more than one place, before the spool or at its sensor, and behind it"
            }
        }
    }
}

/// Where something is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Located {
    /// Where.
    pub place: Place,
    /// The chance that every cut is on the side of the noise on which it is taken to be, from 0 to 1.
    pub confidence: f64,
    /// Held-out error over the noise, fitted alone: of the spool for the command.
    pub spool: f64,
    /// Of the flow for the measured spool, whose noise is in it.
    pub path: f64,
    /// Of the flow for the command.
    pub chain: f64,
}

/// A piece of the model on its rows held out: its error over the noise, and the chance that this is too large.
struct Piece {
    ratio: f64,
    fails: f64,
}

/// A piece is sure to fail where the chance of that is above this, and sure to hold where it is below what this leaves.
const SURE: f64 = 0.9;

/// Where `fitted` fails; `None` where it has no two pieces, where one does not fit at all, or where none fails.
pub(super) fn located(
    fitted: &Fitted,
    measurements: &Measurements,
    noise: &BTreeMap<String, Noise>,
    interrupt: &Interrupt,
) -> Option<Located> {
    let cut = Cut::new(fitted, measurements, noise, interrupt)?;
    place_of(&cut.spool()?, &cut.path()?, &cut.chain()?)
}

/// Whether `effects` act only where `fitted` lacks nothing: all behind the spool, and it is the spool that it does not follow, or all
/// before the spool, and it is the flow.
pub(super) fn misplaced(
    fitted: &Fitted,
    measurements: &Measurements,
    noise: &BTreeMap<String, Noise>,
    interrupt: &Interrupt,
    effects: &[Effect],
) -> bool {
    let at_sensor = |effect: &Effect| effect.output == Some(Output::Spool);
    let all_before = effects.iter().all(acts_before_the_spool);
    let all_behind = !effects
        .iter()
        .any(|effect| acts_before_the_spool(effect) || at_sensor(effect));
    let Some(cut) = Cut::new(fitted, measurements, noise, interrupt) else {
        return false;
    };
    // One piece tells in most cases.
    let holds = |piece: Option<Piece>| piece.is_some_and(|piece| piece.fails < 1.0 - SURE);
    let fails = |piece: Option<Piece>| piece.is_some_and(|piece| piece.fails > SURE);
    match (all_before, all_behind) {
        (true, _) => holds(cut.spool()) && fails(cut.path()),
        (_, true) => holds(cut.path()) && fails(cut.spool()),
        _ => false,
    }
}

fn acts_before_the_spool(effect: &Effect) -> bool {
    matches!(effect.entry.port, Port::Command | Port::Actuator)
}

/// What the pieces say together.
fn place_of(spool: &Piece, path: &Piece, chain: &Piece) -> Option<Located> {
    let fails = |piece: &Piece| piece.fails > 0.5;
    let place = match (fails(spool), fails(path)) {
        (true, false) => Place::BeforeSpool,
        (false, true) => Place::BehindSpool,
        (true, true) if !fails(chain) => Place::SpoolSensor,
        (true, true) => Place::Several,
        (false, false) => return None,
    };
    let sure = |piece: &Piece| piece.fails.max(1.0 - piece.fails);
    let mut confidence = sure(spool) * sure(path);
    if fails(spool) && fails(path) {
        confidence *= sure(chain);
    }
    Some(Located {
        place,
        confidence,
        spool: spool.ratio,
        path: path.ratio,
        chain: chain.ratio,
    })
}

struct Cut<'a> {
    fitted: &'a Fitted,
    interrupt: &'a Interrupt,
    noise: Outputs<f64>,
    /// Fitted and held out.
    records: [Vec<Series>; 2],
}

impl<'a> Cut<'a> {
    /// `None` where spool and flow are not both measured, or the spool is not moved by the model.
    fn new(
        fitted: &'a Fitted,
        measurements: &Measurements,
        noise: &BTreeMap<String, Noise>,
        interrupt: &'a Interrupt,
    ) -> Option<Self> {
        let structure = &fitted.problem.structure;
        let observes_both = [Output::Spool, Output::Flow].map(|output| structure.observes(output));
        let moves = structure.servo_valve()?.drive == Drive::Actuator;
        if observes_both != [true, true] || !moves || structure.free_form.is_some() {
            return None;
        }
        let both = |records: &[Series]| -> Vec<Series> {
            let both = |one: &&Series| one.measured[Output::Spool] && one.measured[Output::Flow];
            records.iter().filter(both).cloned().collect()
        };
        Some(Self {
            fitted,
            interrupt,
            noise: Outputs::from_fn(|output| noise.get(output.name()).map_or(0.0, |one| one.value)),
            records: [both(&measurements.fit), both(&measurements.hold_out)],
        })
    }

    fn spool(&self) -> Option<Piece> {
        self.piece(Output::Spool, false, |effect| {
            acts_before_the_spool(effect) || effect.output == Some(Output::Spool)
        })
    }

    fn path(&self) -> Option<Piece> {
        self.piece(Output::Flow, true, |effect| {
            !acts_before_the_spool(effect) && effect.output != Some(Output::Spool)
        })
    }

    fn chain(&self) -> Option<Piece> {
        self.piece(Output::Flow, false, |effect| {
            effect.output != Some(Output::Spool)
        })
    }

    /// The measured spool in the unit of the command.
    fn in_command(&self, measured: f64) -> f64 {
        let parameters = self.fitted.problem.parameters.iter();
        let mut own = parameters.zip(self.fitted.values.as_slice());
        let gain = own.find(|(one, _)| one.name == SPOOL_GAIN);
        measured / gain.map_or(1.0, |(_, gain)| *gain)
    }

    /// `records` with the measured spool in the place of the command.
    fn with_the_spool_as_command(&self, mut records: Vec<Series>) -> Vec<Series> {
        for sample in records.iter_mut().flat_map(|record| &mut record.samples) {
            sample.input.command = self.in_command(sample.target[Output::Spool]);
        }
        records
    }

    /// The part of the model that gives `output` for the command, or for a spool that stands in the command's place, with the
    /// effects that it `has`: fitted to the first of these records, and judged by the second.
    fn piece(
        &self,
        output: Output,
        from_spool: bool,
        has: impl Fn(&Effect) -> bool,
    ) -> Option<Piece> {
        let records = self.records.clone();
        let [fit, hold_out] = match from_spool {
            true => records.map(|side| self.with_the_spool_as_command(side)),
            false => records,
        };
        let structure = self.structure(output, from_spool, has);
        let mut parameters = structure.parameters();
        let known = &self.fitted.problem.parameters;
        for parameter in &mut parameters {
            let mut values = known.iter().zip(self.fitted.values.as_slice());
            if let Some((other, &value)) = values.find(|(other, _)| other.name == parameter.name) {
                *parameter = other.clone();
                parameter.set_nominal(parameter.clamp(value));
            }
        }
        let mut problem = Problem::new(structure, parameters, Data::Series(fit));
        problem.scale = Outputs::from_fn(|one| match one == output {
            true => self.noise[one].powi(-2),
            false => 0.0,
        });
        let free = problem.free();
        if !free.is_empty() {
            let start = problem.start();
            let polished = polish_on_data(&problem, self.interrupt, &free, &start, &QUICK).ok()?;
            set_start(&mut problem, &polished.values);
        }
        problem.data = Arc::new(Data::Series(hold_out));
        let values = Complete::nominal(&problem.parameters);
        let Data::Series(records) = &*problem.data else {
            return None;
        };
        let simulated = reference::trajectories(&problem.structure, &values, records);
        let compared = Compared::all(records, &simulated);
        let residual = residual(&compared, output);
        let floor = match from_spool {
            true => self.noise[output].hypot(self.passed_on(&simulated, records)),
            false => self.noise[output],
        };
        let MeanSquare { mean, error } = mean_square(&residual, &starts(records));
        if !(mean.is_finite() && floor > 0.0) {
            return None;
        }
        let above = (mean - (NEAR * floor).powi(2)) / error.max(f64::MIN_POSITIVE);
        Some(Piece {
            ratio: mean.sqrt() / floor,
            fails: Normal::standard().cdf(above),
        })
    }

    /// The noise of the spool in the flow that is simulated for it.
    fn passed_on(&self, simulated: &[Vec<Outputs<f64>>], records: &[Series]) -> f64 {
        let pairs = || {
            let rows = records.iter().flat_map(|record| &record.samples);
            let spools = rows.map(|sample| sample.input.command);
            spools.zip(simulated.iter().flatten().map(|one| one[Output::Flow]))
        };
        let (product, square) = pairs().fold((0.0, 0.0), |(product, square), (spool, flow)| {
            (product + spool * flow, square + spool * spool)
        });
        let gain = if square > 0.0 { product / square } else { 0.0 };
        gain * self.in_command(self.noise[Output::Spool])
    }

    fn structure(
        &self,
        output: Output,
        from_spool: bool,
        has: impl Fn(&Effect) -> bool,
    ) -> Structure {
        let mut structure = self.fitted.problem.structure.clone();
        structure.observed = vec![output];
        structure.effects.retain(has);
        if let Some(base) = structure.servo_valve_mut() {
            if output == Output::Spool {
                base.valve = None;
            } else {
                base.spool_unit = None;
            }
            if from_spool {
                base.drive = Drive::Direct;
            }
        }
        if from_spool {
            structure.hold = Hold::Interpolated;
        }
        structure
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{Cut as Share, IdentificationProblem};
    use crate::model::Parameter;
    use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
    use crate::search::{Plan, refine};
    use crate::simulator::Setup;

    #[test]
    fn effects_are_misplaced_where_nothing_is_missing() {
        for (planted, at_home, elsewhere) in [
            ("hysteresis=0.4", "friction", "overlap"),
            ("overlap=8", "gain_curvature", "null_bias"),
        ] {
            let setup = Setup {
                seconds: 4.0,
                planted: vec![planted.parse().unwrap()],
                ..Setup::default()
            };
            let records = [setup.record().unwrap()];
            let asked = IdentificationProblem::of(&records, &[], Share::default()).unwrap();
            let problem = asked.first_fit();
            let truth = |parameter: &Parameter| match parameter.name.as_str() {
                GAIN => setup.valve.gain,
                TIME_CONSTANT => setup.valve.time_constant,
                SATURATION => setup.valve.saturation,
                _ => parameter.nominal(),
            };
            let start: Vec<f64> = problem.free().iter().map(truth).collect();
            let plan = Plan::of_records(1);
            let fit = refine(&problem, &start, &plan).unwrap();
            let measurements = &asked.measurements;
            let fitted = Fitted::new(problem, fit, measurements, None, &plan);
            let noise = fitted.noise(measurements, false);
            let misplaced = |names: &[&str]| {
                let effects: Vec<Effect> = names.iter().map(|name| name.parse().unwrap()).collect();
                let interrupt = plan.memory.interrupt();
                misplaced(&fitted, measurements, &noise, interrupt, &effects)
            };
            assert!(misplaced(&[elsewhere]), "{planted}");
            assert!(!misplaced(&[at_home]), "{planted}");
            assert!(!misplaced(&[elsewhere, at_home]), "{planted}");
            // Another sensor of the spool shows in either piece.
            assert!(!misplaced(&["sensor_lag.spool"]), "{planted}");
        }
    }
}
