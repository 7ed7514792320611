//! Where a model fails: it is cut at the measured spool, and each piece is fitted for itself.
//!
//! The piece from command to spool knows nothing of the flow, that from the *measured* spool to the flow nothing of what moved
//! it. What fails says where something is missing, also where it has no name.

use super::evidence::{QUICK, set_start};
use super::fitted::Fitted;
use super::measurements::{Measurements, starts};
use super::problem::IdentificationProblem;
use super::sensors::{of_a_sensor, of_sensors};
use super::simulation::{Compared, residual};
use super::statistics::bootstrap::{MeanSquare, mean_square};
use super::statistics::noise::Noise;
use super::unexcited::set_by_held_out;
use super::verdict::NEAR;
use crate::evaluate::problem::{Data, Series};
use crate::evaluate::{Interrupt, Problem, reference};
use crate::model::base::servo_valve::SPOOL_GAIN;
use crate::model::effects::{Effect, Port};
use crate::model::{Complete, Drive, Hold, Output, Outputs, Parameter, ServoValve, Structure};
use crate::search::polish_on_data;
use rayon::prelude::*;
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
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::BeforeSpool,
        Self::SpoolSensor,
        Self::BehindSpool,
        Self::Several,
    ];

    /// Where `effect` acts.
    pub fn of(effect: &Effect) -> Self {
        match effect.entry.port {
            Port::Command | Port::Actuator => Self::BeforeSpool,
            Port::Measurement if effect.output == Some(Output::Spool) => Self::SpoolSensor,
            _ => Self::BehindSpool,
        }
    }

    /// Where all of `effects` act, but for zeros, scales and lags that any bench adds beside others; `None` where there are none.
    pub(crate) fn of_all(effects: &[Effect]) -> Option<Self> {
        let causes = effects.iter().filter(|effect| !of_a_sensor(effect));
        let counting = match causes.clone().next() {
            Some(_) => causes.map(Self::of).collect(),
            None => effects.iter().map(Self::of).collect::<Vec<_>>(),
        };
        let first = *counting.first()?;
        let one = counting.iter().all(|place| *place == first);
        Some(if one { first } else { Self::Several })
    }

    /// Its name in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::BeforeSpool => "before_spool",
            Self::SpoolSensor => "spool_sensor",
            Self::BehindSpool => "behind_spool",
            Self::Several => "several",
        }
    }

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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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

/// A piece of the model on its rows held out: its error over the noise, and the chance that this is too large; and what was fitted
/// to the others.
struct Piece {
    ratio: f64,
    fails: f64,
    fitted: Vec<Parameter>,
}

/// A place is sure where the confidence in it is above this.
const SURE: f64 = 0.9;

impl Located {
    /// Whether it is sure that only what acts on one side of the spool fails.
    pub fn is_one_side(&self) -> bool {
        let one_side = matches!(self.place, Place::BeforeSpool | Place::BehindSpool);
        one_side && self.confidence > SURE
    }

    /// Whether it is sure that only what acts behind the spool fails.
    pub(super) fn is_behind_alone(&self) -> bool {
        self.is_one_side() && self.place == Place::BehindSpool
    }

    /// Whether `effect` may be what is missing. One of the spool's sensor may hide in either piece, as may one of the transducer of its
    /// loop.
    pub(super) fn admits(&self, effect: &Effect) -> bool {
        let place = Place::of(effect);
        let shows = place == Place::SpoolSensor || effect.is_shown_by_its_loop();
        !self.is_one_side() || shows || place == self.place
    }
}

/// Whether the measured spool shows `effect`, which moves it.
pub(super) fn shows_in_the_spool(effect: &Effect) -> bool {
    Place::of(effect) == Place::BeforeSpool && !effect.is_shown_by_its_loop()
}

/// Where `fitted` fails, and what the spool alone was fitted by, from there or from what was fitted to it `alone`; `None` where it has no two
/// pieces, where one does not fit at all, or where none fails. Several places are one where the others fail by what any bench adds alone.
pub(super) fn located(
    fitted: &Fitted,
    alone: Option<&Fitted>,
    measurements: &Measurements,
    noise: &BTreeMap<String, Noise>,
    interrupt: &Interrupt,
) -> Option<(Located, Vec<Parameter>)> {
    let mut cut = Cut::new(fitted, alone, measurements, noise, interrupt)?;
    let alone = cut.place()?;
    if alone.0.place != Place::Several {
        return Some(alone);
    }
    cut.sensors = true;
    cut.place().or(Some(alone))
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
    /// What moves the spool, fitted to that alone.
    alone: Option<&'a Fitted>,
    interrupt: &'a Interrupt,
    noise: Outputs<f64>,
    /// Fitted and held out.
    records: [Vec<Series>; 2],
    /// Whether each piece has what sensors add.
    sensors: bool,
}

impl<'a> Cut<'a> {
    /// `None` where spool and flow are not both measured, or the spool is not moved by the model.
    fn new(
        fitted: &'a Fitted,
        alone: Option<&'a Fitted>,
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
            alone,
            interrupt,
            noise: Outputs::from_fn(|output| noise.get(output.name()).map_or(0.0, |one| one.value)),
            records: [both(&measurements.fit), both(&measurements.hold_out)],
            sensors: false,
        })
    }

    fn place(&self) -> Option<(Located, Vec<Parameter>)> {
        let ((spool, path), chain) = rayon::join(
            || rayon::join(|| self.spool(), || self.path()),
            || self.chain(),
        );
        let spool = spool?;
        let located = place_of(&spool, &path?, &chain?)?;
        Some((located, spool.fitted))
    }

    fn spool(&self) -> Option<Piece> {
        let own = [Place::BeforeSpool, Place::SpoolSensor];
        self.piece(Output::Spool, false, &own)
    }

    fn path(&self) -> Option<Piece> {
        self.piece(Output::Flow, true, &[Place::BehindSpool])
    }

    fn chain(&self) -> Option<Piece> {
        let own = [Place::BeforeSpool, Place::BehindSpool];
        self.piece(Output::Flow, false, &own)
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
    /// effects that act at these `places`: fitted to the first of these records, and judged by the second.
    fn piece(&self, output: Output, from_spool: bool, places: &[Place]) -> Option<Piece> {
        let records = self.records.clone();
        let [fit, hold_out] = match from_spool {
            true => records.map(|side| self.with_the_spool_as_command(side)),
            false => records,
        };
        let hold_out = Arc::new(Data::Series(hold_out));
        let structure = self.structure(output, from_spool, places);
        // The fit of all that is measured may have come to rest in what is no valley of the spool.
        let alone = self.alone.filter(|_| output == Output::Spool);
        let data = Arc::new(Data::Series(fit));
        let begun = [Some(self.fitted), alone].into_par_iter().flatten();
        let fits = begun.filter_map(|begun| {
            let mut problem = Problem {
                data: data.clone(),
                ..Problem::new(
                    structure.clone(),
                    begun_by(&structure, begun),
                    Data::Series(Vec::new()),
                )
            };
            problem.scale = Outputs::from_fn(|one| match one == output {
                true => self.noise[one].powi(-2),
                false => 0.0,
            });
            let (free, start) = (problem.free(), problem.start());
            if free.is_empty() {
                return Some((0.0, problem));
            }
            let polished = polish_on_data(&problem, self.interrupt, &free, &start, &QUICK).ok()?;
            let set = set_by_held_out(
                &problem,
                self.interrupt,
                &polished.values,
                &polished.flat,
                &hold_out,
                &QUICK,
            );
            set_start(&mut problem, &set.values);
            Some((polished.cost, problem))
        });
        let (_, mut problem) = fits.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        problem.data = hold_out;
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
            fitted: problem.free(),
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

    fn structure(&self, output: Output, from_spool: bool, places: &[Place]) -> Structure {
        let mut structure = part_of(&self.fitted.problem.structure, output, places);
        if from_spool {
            structure.hold = Hold::Interpolated;
            if let Some(base) = structure.servo_valve_mut() {
                base.drive = Drive::Direct;
            }
        }
        if self.sensors {
            let own = of_sensors(&structure).into_iter();
            structure = own.fold(structure, |all, one| all.with(one));
        }
        structure
    }
}

/// The part of a `structure` that gives `output`, with the effects that act at these `places`.
fn part_of(structure: &Structure, output: Output, places: &[Place]) -> Structure {
    let mut structure = structure.clone();
    structure.observed = vec![output];
    structure
        .effects
        .retain(|effect| places.contains(&Place::of(effect)));
    if let Some(base) = structure.servo_valve_mut() {
        match output {
            Output::Spool => base.valve = None,
            _ => base.spool_unit = None,
        }
    }
    structure
}

/// The parameters of a part of the model that was `fitted`, which begin where it has come.
fn begun_by(structure: &Structure, fitted: &Fitted) -> Vec<Parameter> {
    let mut parameters = structure.parameters();
    for parameter in &mut parameters {
        let known = fitted.problem.parameters.iter();
        let mut values = known.zip(fitted.values.as_slice());
        if let Some((other, &value)) = values.find(|(other, _)| other.name == parameter.name) {
            *parameter = other.clone();
            parameter.set_nominal(parameter.clamp(value));
        }
    }
    parameters
}

/// `problem` for what moves the spool alone, where more is measured: what the model lacks behind it bends the rest.
pub(super) fn of_the_spool(problem: &IdentificationProblem) -> Option<IdentificationProblem> {
    let whole = &problem.structure;
    let moves = |base: &ServoValve| base.drive == Drive::Actuator;
    let more = whole.observed.len() > 1 && whole.observes(Output::Spool);
    if !more || !whole.servo_valve().is_some_and(moves) || whole.free_form.is_some() {
        return None;
    }
    let own = [Place::BeforeSpool, Place::SpoolSensor];
    let structure = part_of(whole, Output::Spool, &own);
    let mut parameters = structure.parameters();
    for parameter in &mut parameters {
        let mut known = problem.parameters.iter();
        if let Some(known) = known.find(|known| known.name == parameter.name) {
            *parameter = known.clone();
        }
    }
    Some(IdentificationProblem {
        structure,
        parameters,
        ..problem.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Cut as Share;
    use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
    use crate::search::{Plan, refine};
    use crate::simulator::Setup;

    #[test]
    fn zeros_and_lags_are_no_place_beside_a_cause() {
        for (effects, place) in [
            (&["friction"][..], Some(Place::BeforeSpool)),
            (&["friction", "overlap"], Some(Place::Several)),
            (&["friction", "sensor_lag.flow"], Some(Place::BeforeSpool)),
            (&["sensor_lag.flow", "null_bias"], Some(Place::Several)),
            (&["sensor_lag.spool", "overlap"], Some(Place::Several)),
            (&["dc_gain", "overlap"], Some(Place::BehindSpool)),
            (&["dc_gain"], Some(Place::BeforeSpool)),
            (&["sensor_offset.spool"], Some(Place::SpoolSensor)),
            (&[], None),
        ] {
            let named: Vec<Effect> = effects.iter().map(|one| one.parse().unwrap()).collect();
            assert_eq!(Place::of_all(&named), place, "{effects:?}");
        }
    }

    #[test]
    fn only_what_acts_where_the_model_fails_may_be_what_is_missing() {
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
            let interrupt = plan.memory.interrupt();
            let (located, _) = located(&fitted, None, measurements, &noise, interrupt).unwrap();
            let admits = |name: &str| located.admits(&name.parse().unwrap());
            assert!(!admits(elsewhere), "{planted}: {located:?}");
            assert!(admits(at_home), "{planted}: {located:?}");
            // Another sensor of the spool shows in either piece.
            assert!(admits("sensor_lag.spool"), "{planted}");
            let unsure = Located {
                confidence: 0.8,
                ..located
            };
            assert!(unsure.admits(&elsewhere.parse().unwrap()));
        }
    }
}
