//! One case: its record, its diagnosis, its outcome.

use super::outcome::{Outcome, judge};
use super::plan::{Case, Group, Subject, random};
use super::strength::Open;
use crate::Result;
use crate::diagnose::{Cut, Fitted, IdentificationProblem, Identified, Options, Place, identify};
use crate::evaluate::{CpuEvaluator, Evaluator, Interrupt, Memory, Precision};
use crate::model::Output;
use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
use crate::model::effects::{CATALOGUE, Effect};
use crate::record::Record;
use crate::search::Plan;
use crate::simulator::{
    Command, Form, Kind, Meter, Noise, Planted, Quantisation, Setup, SpoolUnit, Supply, Valve,
};
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Instant;

/// Seed of every diagnosis: that of `servobee identify` where none is given.
const DIAGNOSIS: u64 = 1;
/// Most effects that a diagnosis may add, as `servobee identify` does where nothing is said.
const MAX_EFFECTS: usize = 4;

/// What became of a case: a line of the scorecard's file.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The case's name.
    pub case: String,
    /// Its group.
    pub group: Group,
    /// What is planted: names, joined by `+`.
    pub planted: String,
    /// The same with values, as `servobee synthesize` takes them.
    pub values: String,
    /// Valve, command and measurement in words.
    pub conditions: String,
    /// Held-out error of the base model in standard deviations of the planted noise, on the worst channel.
    pub base: f64,
    /// The same of the result.
    pub after: f64,
    /// The estimated noise floor over the planted noise, on the channel where it is furthest from 1.
    pub floor: f64,
    /// The verdict, or why the diagnosis failed.
    pub verdict: String,
    /// What is named, joined by `+`, each followed by what is tied with it behind `|`.
    pub named: String,
    /// How that compares.
    pub outcome: Outcome,
    /// Where what is planted acts; `None` where nothing is.
    pub place: Option<Place>,
    /// Where the base model fails.
    pub located: Option<Place>,
    /// Whether the 95 % intervals of K, T, S and of the effect's main parameter hold the truth. Only where exactly what
    /// is planted was added, in its usual form, and the data bound the parameter on both sides.
    pub covered: [Option<bool>; 4],
    /// Seconds of the diagnosis.
    pub seconds: f64,
}

/// The names of [`Row::covered`].
pub(super) const COVERED: [&str; 4] = ["gain", "time_constant", "saturation", "effect"];

impl Case {
    /// The simulator for its record.
    ///
    /// # Errors
    /// The simulator refuses it.
    pub fn setup(&self, seed: u64) -> Result<Setup> {
        let mut rng = random(seed, &self.id);
        let mut plain = self.conditions(&mut rng);
        if self.subject.is_seen_in_volts_alone() {
            plain.spool_unit = SpoolUnit::Volt;
        }
        plain.meter = self.subject.meter();
        plain.supply = self.subject.supply();
        let mut setup = plain.clone();
        let open = match &self.subject {
            Subject::Nothing => Vec::new(),
            Subject::Effects(effects) => effects
                .iter()
                .map(|effect| Open::effect(effect, &plain, &mut rng))
                .collect(),
            Subject::Outsider(oddity) => vec![Open::outsider(*oddity)],
        };
        // Each is made as strong as it must be alone.
        for (open, &target) in open.iter().zip(&self.targets) {
            let alone = open.planted(&plain, target)?;
            setup.planted.extend(alone.planted);
            setup.outsiders.extend(alone.outsiders);
        }
        setup.planted.sort_by_key(|planted| planted.effect);
        Ok(setup)
    }

    /// A valve on the bench, nothing planted.
    fn conditions(&self, rng: &mut ChaCha8Rng) -> Setup {
        let percent = (100.0 * rng.random_range(0.2..=0.5_f64)).round() / 100.0;
        let corner = (20.0 * 10_f64.powf(rng.random::<f64>())).round();
        let noise = match rng.random_bool(1.0 / 3.0) {
            true => Noise::coloured(percent, corner),
            false => Noise::white(percent),
        };
        let mut setup = Setup {
            name: self.id.clone(),
            valve: Valve::random(rng.random()),
            seconds: rng.random_range(50..=100) as f64 / 10.0,
            noise,
            spool_unit: match rng.random() {
                true => SpoolUnit::Volt,
                false => SpoolUnit::Percent,
            },
            seed: rng.random(),
            ..Setup::default()
        };
        if self.group == Group::Null {
            let commands = [
                Command::Bench,
                Command::Bench,
                Command::Multisine,
                Command::Chirp,
            ];
            setup.command = commands.choose(rng).expect("there are commands").clone();
            let bits = rng.random_range(10..=13);
            setup.quantisation = rng
                .random_bool(1.0 / 3.0)
                .then_some(Quantisation::Bits(bits));
        }
        setup
    }

    /// Makes the record, diagnoses it and judges that; `None` where `interrupt` has come in between.
    pub fn run(&self, seed: u64, interrupt: &Interrupt) -> Option<Row> {
        let mut evaluator = CpuEvaluator::new(Precision::F32);
        let diagnose = |setup: Setup| self.diagnose_until(interrupt, &setup, &mut evaluator);
        let result = self.setup(seed).and_then(diagnose);
        if interrupt.asked() {
            return None;
        }
        Some(match result {
            Ok((row, _)) => row,
            Err(error) => Row {
                case: self.id.clone(),
                group: self.group,
                planted: self.subject.to_string(),
                values: String::new(),
                conditions: String::new(),
                base: f64::NAN,
                after: f64::NAN,
                floor: f64::NAN,
                verdict: error.to_string().replace([',', '\n'], " "),
                named: String::new(),
                outcome: Outcome::Failed,
                place: self.subject.place(),
                located: None,
                covered: [None; 4],
                seconds: f64::NAN,
            },
        })
    }

    /// Diagnoses the record of `setup`, which is this case's, and judges that.
    ///
    /// # Errors
    /// The simulator or the diagnosis fails.
    pub fn diagnose(
        &self,
        setup: &Setup,
        evaluator: &mut dyn Evaluator,
    ) -> Result<(Row, Identified)> {
        self.diagnose_until(&Interrupt::default(), setup, evaluator)
    }

    fn diagnose_until(
        &self,
        interrupt: &Interrupt,
        setup: &Setup,
        evaluator: &mut dyn Evaluator,
    ) -> Result<(Row, Identified)> {
        let record = setup.record()?;
        let started = Instant::now();
        let left_out = match (&self.subject, self.group) {
            (Subject::Effects(effects), Group::LeftOut) => {
                let causes = effects.iter().map(|one| one.effect().entry.cause());
                causes.collect()
            }
            _ => Vec::new(),
        };
        let identified = diagnose(record, &left_out, interrupt, evaluator)?;
        let seconds = started.elapsed().as_secs_f64();
        Ok((self.row(setup, &identified, seconds), identified))
    }

    fn row(&self, setup: &Setup, identified: &Identified, seconds: f64) -> Row {
        let named: Vec<Vec<String>> = identified
            .added
            .iter()
            .map(|one| {
                let tied = one.tied_with.iter().map(Effect::cause);
                let mut names: Vec<String> = Vec::new();
                for name in std::iter::once(one.effect.cause()).chain(tied) {
                    if !names.contains(&name) {
                        names.push(name);
                    }
                }
                names
            })
            .collect();
        let effects: &[_] = match &self.subject {
            Subject::Effects(effects) if self.group != Group::LeftOut => effects,
            _ => &[],
        };
        let known: Vec<String> = effects.iter().map(|one| one.catalogue_name()).collect();
        let odd = matches!(self.subject, Subject::Outsider(_)) || self.group == Group::LeftOut;
        let verdict = identified.verdict;
        let observed = &identified.before.problem.structure.observed;
        let noise = |output: Output| setup.noise_std(output.channel());
        let worst = |fitted: &Fitted| {
            let score = |output: Output| fitted.errors.hold_out.get(output.name());
            let ratios = observed
                .iter()
                .filter_map(|&output| Some(score(output)?.rmse / noise(output)));
            ratios.fold(0.0, f64::max)
        };
        let floors = observed
            .iter()
            .map(|&output| identified.noise[output.name()].value / noise(output));
        let values = setup
            .planted
            .iter()
            .map(ToString::to_string)
            .chain(setup.outsiders.iter().map(ToString::to_string));
        let ties: Vec<String> = named.iter().map(|tie| tie.join("|")).collect();
        Row {
            case: self.id.clone(),
            group: self.group,
            planted: self.subject.to_string(),
            values: values.collect::<Vec<_>>().join("+"),
            conditions: conditions(setup),
            base: worst(&identified.before),
            after: worst(&identified.after),
            floor: floors.fold(1.0, |far: f64, one: f64| {
                if one.ln().abs() > far.ln().abs() {
                    one
                } else {
                    far
                }
            }),
            verdict: verdict.word().into(),
            named: ties.join("+"),
            outcome: judge(&known, odd, verdict, &named),
            place: self.subject.place(),
            located: identified.located_before.map(|one| one.place),
            covered: covered(setup, &known, identified),
            seconds,
        }
    }
}

/// Diagnoses a record as `servobee identify` does where nothing is said, but with a catalogue without some causes.
fn diagnose(
    record: Record,
    left_out: &[&str],
    interrupt: &Interrupt,
    evaluator: &mut dyn Evaluator,
) -> Result<Identified> {
    record.check_excited()?;
    let records = [record];
    let problem = IdentificationProblem::of(&records, &[], Cut::default())?;
    let known = CATALOGUE
        .iter()
        .copied()
        .filter(|entry| !left_out.contains(&entry.cause()));
    let known: Vec<_> = known.collect();
    let options = Options::on(&problem.structure, &known, MAX_EFFECTS);
    let plan = Plan {
        memory: Memory::default().stopped_by(interrupt.clone()),
        ..Plan::of_records(DIAGNOSIS)
    };
    identify(problem, evaluator, &plan, &options, &mut |_| {
        ControlFlow::Continue(())
    })
}

fn conditions(setup: &Setup) -> String {
    let Valve {
        gain,
        time_constant,
        saturation,
        rated_flow,
    } = setup.valve;
    let colour = match setup.noise.colour {
        Some(corner) => format!("coloured {corner} Hz"),
        None => "white".into(),
    };
    let rounded = match setup.quantisation {
        Some(Quantisation::Bits(bits)) => format!(" {bits} bits"),
        Some(Quantisation::Percent(percent)) => format!(" rounded to {percent} %"),
        None => String::new(),
    };
    format!(
        "K {gain:.1} 1/s T {:.3} ms S {saturation:.3} V {rated_flow:.2} L/min{}{} {} {:.1} s spool in {} noise {:.2} % {colour}{rounded}",
        1e3 * time_constant,
        match setup.meter {
            Meter::Load => "",
            Meter::Supply => " in the pressure line",
        },
        match setup.supply {
            Supply::Constant => "",
            Supply::Measured => " supply measured",
        },
        setup.command,
        setup.seconds,
        setup.spool_unit.name(),
        setup.noise.percent,
    )
}

/// Whether the intervals hold the truth: see [`Row::covered`].
fn covered(setup: &Setup, known: &[String], identified: &Identified) -> [Option<bool>; 4] {
    let mut added: Vec<String> = identified
        .added
        .iter()
        .map(|one| one.effect.to_string())
        .collect();
    let mut known = known.to_vec();
    added.sort();
    known.sort();
    let all_known = known.len() == setup.planted.len() && setup.outsiders.is_empty();
    let complete = all_known && added == known;
    if !complete || setup.planted.iter().any(|p| p.form != Form::Usual) {
        return [None; 4];
    }
    let valve = setup.valve;
    let main = match &setup.planted[..] {
        [one] => main_parameter(one, &valve),
        _ => None,
    };
    let truths = [
        Some((GAIN.into(), valve.gain)),
        Some((TIME_CONSTANT.into(), valve.time_constant)),
        Some((SATURATION.into(), valve.saturation)),
        main,
    ];
    let fit = &identified.after.fit;
    truths.map(|truth| {
        let (name, value): (String, f64) = truth?;
        let index = fit.free.iter().position(|p| p.name == name)?;
        let interval = fit.polished.as_ref()?.1.intervals[index];
        let bounded = !interval.open_low && !interval.open_high;
        bounded.then(|| (interval.low..=interval.high).contains(&value))
    })
}

/// What the model calls the parameter that says how strong an effect is, and its true value; of a resonance or a
/// disturbance its frequency.
fn main_parameter(planted: &Planted, valve: &Valve) -> Option<(String, f64)> {
    let kind = planted.effect;
    Some(match kind {
        Kind::LineResonance => ("line_frequency_flow".into(), planted.value),
        Kind::SpoolResonance => (
            "spool_damping".into(),
            PI * planted.value * valve.time_constant,
        ),
        Kind::Compressibility => ("compressibility_flow".into(), planted.value),
        Kind::CommandHum => ("hum_frequency".into(), planted.key("frequency")?),
        Kind::PeriodicDisturbance => (
            format!("disturbance_frequency_{}", planted.channel),
            planted.key("frequency")?,
        ),
        Kind::ViscosityDrift if planted.key("heating").is_some() => {
            ("viscosity_drift_per_kelvin".into(), planted.value)
        }
        kind if kind.has_channel() => (format!("{kind}_{}", planted.channel), planted.value),
        kind => (kind.to_string(), planted.value),
    })
}
