//! Which cases there are.

use crate::diagnose::Place;
use crate::model::effects::Effect;
use crate::record::Channel;
use crate::simulator::{Form, Kind, Meter, Oddity, Supply};
use crate::{Error, Result};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// What cases have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// Nothing is planted.
    Null,
    /// One effect in its usual form.
    Single,
    /// One effect in another form than the catalogue's.
    Forms,
    /// Two effects.
    Pairs,
    /// What is in no catalogue.
    Outsiders,
    /// One effect, diagnosed with a catalogue without its cause: no name is right.
    LeftOut,
}

impl Group {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Null,
        Self::Single,
        Self::Forms,
        Self::Pairs,
        Self::Outsiders,
        Self::LeftOut,
    ];

    /// Its name in a case's.
    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Single => "single",
            Self::Forms => "forms",
            Self::Pairs => "pairs",
            Self::Outsiders => "outsiders",
            Self::LeftOut => "left_out",
        }
    }

    /// Records in it, of each kind and strength that it has.
    fn size(self) -> f64 {
        match self {
            Self::Null => 200.0,
            Self::Single => 4.0,
            Self::Forms => 2.0,
            Self::Pairs => 60.0,
            Self::Outsiders => 5.0,
            Self::LeftOut => 1.0,
        }
    }
}

impl Display for Group {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Group {
    type Err = Error;

    /// # Errors
    /// A name that is none of [`Group::ALL`].
    fn from_str(text: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|group| group.name() == text);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::input(
                format!("group {text:?}"),
                "is not known",
                format!("use some of {names}"),
            )
        })
    }
}

/// An effect to plant, without its strength.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// Which effect.
    pub kind: Kind,
    /// Its equation.
    pub form: Form,
    /// The channel that it is on, of use to measurement effects alone.
    pub channel: Channel,
}

impl Variant {
    /// Every effect in its usual form, those of a sensor on spool and on flow.
    pub fn usual() -> Vec<Self> {
        Kind::ALL
            .into_iter()
            .flat_map(|kind| Self::on_channels(kind, Form::Usual))
            .collect()
    }

    /// Every other form of an effect but a slew limit on the integrator, which is a smaller saturation; a turbine measures flow
    /// alone.
    pub fn others() -> Vec<Self> {
        let forms = |kind: Kind| kind.forms().iter().map(move |form| (kind, *form));
        Kind::ALL
            .into_iter()
            .flat_map(forms)
            .filter(|(_, form)| *form != Form::Integrator)
            .flat_map(|(kind, form)| Self::on_channels(kind, form))
            .filter(|one| one.form != Form::Turbine || one.channel == Channel::Flow)
            .collect()
    }

    fn on_channels(kind: Kind, form: Form) -> impl Iterator<Item = Self> {
        let channels: &[Channel] = match kind.has_channel() {
            true => &[Channel::Spool, Channel::Flow],
            false => &[Channel::Spool],
        };
        channels.iter().map(move |&channel| Self {
            kind,
            form,
            channel,
        })
    }

    /// What the catalogue of the model calls it.
    pub fn catalogue_name(&self) -> String {
        match self.kind {
            Kind::Compressibility | Kind::LineResonance => format!("{}.flow", self.kind),
            Kind::SensorCurvature => format!("{}.spool", self.kind),
            kind if kind.has_channel() => format!("{kind}.{}", self.channel),
            kind => kind.to_string(),
        }
    }

    /// Its entry in the catalogue of the model, in the usual form.
    pub(super) fn effect(&self) -> Effect {
        let name = self.catalogue_name();
        name.parse().expect("a name of the catalogue")
    }
}

impl Display for Variant {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        if self.form != Form::Usual {
            write!(f, "~{}", self.form.name())?;
        }
        if self.kind.has_channel() {
            write!(f, ".{}", self.channel)?;
        }
        Ok(())
    }
}

/// What is planted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// Nothing.
    Nothing,
    /// Effects of the catalogue.
    Effects(Vec<Variant>),
    /// Something that is in no catalogue.
    Outsider(Oddity),
}

impl Subject {
    /// Where it acts; `None` where nothing is planted.
    pub(super) fn place(&self) -> Option<Place> {
        match self {
            Self::Nothing => None,
            Self::Effects(effects) => {
                let all: Vec<Effect> = effects.iter().map(Variant::effect).collect();
                Place::of_all(&all)
            }
            Self::Outsider(oddity) => Some(of_outsider(*oddity)),
        }
    }

    /// Where the flow has to be measured for all of it to show.
    pub(super) fn meter(&self) -> Meter {
        match self {
            Self::Effects(effects) => {
                let meters = effects.iter().map(|effect| effect.kind.meter());
                meters.max().unwrap_or_default()
            }
            Self::Nothing | Self::Outsider(_) => Meter::default(),
        }
    }

    /// What has to feed the valve for all of it to show.
    pub(super) fn supply(&self) -> Supply {
        match self {
            Self::Effects(effects) => {
                let supplies = effects.iter().map(|effect| effect.kind.supply(effect.form));
                supplies.max().unwrap_or_default()
            }
            Self::Nothing | Self::Outsider(_) => Supply::default(),
        }
    }

    /// Whether a spool in another unit than the command's hides it: its ratio to the command is then the base model's.
    pub(super) fn is_seen_in_volts_alone(&self) -> bool {
        matches!(self, Self::Effects(effects) if effects.iter().any(|e| e.kind == Kind::DcGain))
    }
}

impl Display for Subject {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing"),
            Self::Effects(effects) => {
                let names: Vec<String> = effects.iter().map(ToString::to_string).collect();
                f.write_str(&names.join("+"))
            }
            Self::Outsider(oddity) => write!(f, "{oddity}"),
        }
    }
}

fn of_outsider(oddity: Oddity) -> Place {
    match oddity {
        Oddity::GainJump
        | Oddity::CoarseDac
        | Oddity::RateGain
        | Oddity::QuadraticDamping
        | Oddity::AmplitudeGain
        | Oddity::Detent
        | Oddity::Chatter
        | Oddity::Creep
        | Oddity::GainDrift
        | Oddity::EddyCurrent
        | Oddity::SpringPreload
        | Oddity::TorqueLimit => Place::BeforeSpool,
        Oddity::SensorDeadBand
        | Oddity::CrossTalk
        | Oddity::RangeSwitch
        | Oddity::SensorPlay
        | Oddity::MissingCodes => Place::SpoolSensor,
        Oddity::PumpRipple | Oddity::Reattachment | Oddity::SupplyHunting | Oddity::MeterStall => {
            Place::BehindSpool
        }
        Oddity::Dropout => Place::Several,
    }
}

/// One record to make and to diagnose.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its name, which with the plan's seed decides every random number.
    pub id: String,
    /// Its group.
    pub group: Group,
    /// What is planted.
    pub subject: Subject,
    /// Held-out error of the base model that each part of the subject alone should cause, in standard deviations of the
    /// noise of the channel where it is largest.
    pub targets: Vec<f64>,
}

/// Which cases are run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seed of all of it.
    pub seed: u64,
    /// Groups that are run.
    pub groups: Vec<Group>,
    /// Factor on the number of records of each group.
    pub count: f64,
    /// Only cases that plant this, where given: an effect's or outsider's name.
    pub only: Option<String>,
}

/// Errors of the base model that are aimed at, in units of the noise, by the names that they have in a case's.
const TARGETS: [(&str, f64); 3] = [("1.5x", 1.75), MIDDLE_TARGET, ("6x", 6.0)];
const MIDDLE_TARGET: (&str, f64) = ("3x", 3.0);
/// Least and largest error that an effect of a pair, or an outsider, is to cause.
const DRAWN_TARGETS: (f64, f64) = (2.1, 6.0);

impl Default for Plan {
    /// Everything, once.
    fn default() -> Self {
        Self {
            seed: 1,
            groups: Group::ALL.to_vec(),
            count: 1.0,
            only: None,
        }
    }
}

impl Plan {
    /// Its cases, group by group: of each the share that the count says, and one at least. A larger count adds cases and changes
    /// none.
    ///
    /// # Errors
    /// A count that is no positive number, or nothing that is called as [`Plan::only`] says.
    pub fn cases(&self) -> Result<Vec<Case>> {
        if !(self.count > 0.0 && self.count <= 1000.0) {
            return Err(Error::input(
                "count",
                format!("is {}", self.count),
                "give a number above 0, at most 1000",
            ));
        }
        let mut groups = self.groups.clone();
        groups.sort();
        groups.dedup();
        let cases: Vec<Case> = groups.iter().flat_map(|&group| self.group(group)).collect();
        match &self.only {
            Some(only) if cases.is_empty() => Err(Error::input(
                format!("only {only:?}"),
                "no case of these groups plants it",
                "use a name that servobee synthesize --help lists, such as delay, sensor_lag.flow or detent",
            )),
            _ => Ok(cases),
        }
    }

    /// The case of this name, also one that a small count leaves out.
    ///
    /// # Errors
    /// There is none.
    pub fn case(&self, id: &str) -> Result<Case> {
        let whole = Self {
            count: self.count.max(1.0),
            ..self.clone()
        };
        self.cases()?;
        let cases = whole.cases()?;
        let example = cases.first().map_or(String::new(), |case| case.id.clone());
        cases.into_iter().find(|case| case.id == id).ok_or_else(|| {
            Error::input(
                format!("case {id:?}"),
                "is not in the plan",
                format!("use the name from a scorecard's file, such as {example}, and its --seed and --count"),
            )
        })
    }

    /// The share of a group's cases that the count says.
    fn group(&self, group: Group) -> Vec<Case> {
        let rounds = self.count.ceil().max(1.0) * group.size();
        let plants = |case: &Case| self.only.as_ref().is_none_or(|only| case.plants(only));
        let whole = self.first(group, rounds as usize);
        let mut cases: Vec<(usize, Case)> = whole.into_iter().enumerate().collect();
        match group {
            // Of these each is drawn by its number.
            Group::Null | Group::Pairs => {
                cases.truncate(share(group.size() * self.count));
                cases.retain(|(_, case)| plants(case));
            }
            // Of few cases no two are of one kind, and which kinds they are does not follow the list of effects.
            Group::Single | Group::Forms | Group::Outsiders | Group::LeftOut => {
                cases.retain(|(_, case)| plants(case));
                let kinds = cases.len() as f64 / rounds;
                let number = share(group.size() * kinds * self.count);
                cases.sort_by_cached_key(|(_, case)| {
                    let (kind, index) = case.id.rsplit_once('/').expect("an id has an index");
                    let index: usize = index.parse().expect("a number");
                    (
                        index,
                        random(self.seed, &format!("{kind} turn")).random::<u64>(),
                    )
                });
                cases.truncate(number);
                cases.sort_by_key(|(turn, _)| *turn);
            }
        }
        cases.into_iter().map(|(_, case)| case).collect()
    }

    /// The first `number` cases of each kind in a group.
    fn first(&self, group: Group, number: usize) -> Vec<Case> {
        let strong = |variants: Vec<Variant>, targets: &[(&str, f64)]| -> Vec<Case> {
            let mut cases = Vec::new();
            for variant in variants {
                for &(name, target) in targets {
                    cases.extend((0..number).map(|index| Case {
                        id: format!("{group}/{variant}/{name}/{index}"),
                        group,
                        subject: Subject::Effects(vec![variant]),
                        targets: vec![target],
                    }));
                }
            }
            cases
        };
        match group {
            Group::Null => (0..number)
                .map(|index| Case {
                    id: format!("{group}/{index}"),
                    group,
                    subject: Subject::Nothing,
                    targets: Vec::new(),
                })
                .collect(),
            Group::Single => strong(Variant::usual(), &TARGETS),
            Group::Forms => strong(Variant::others(), &TARGETS),
            Group::LeftOut => strong(Variant::usual(), &[MIDDLE_TARGET]),
            Group::Pairs => (0..number).map(|index| self.pair(index)).collect(),
            Group::Outsiders => {
                let one = |oddity: Oddity, index: usize| {
                    let id = format!("{group}/{oddity}/{index}");
                    let target = target(&mut random(self.seed, &format!("{id} target")));
                    Case {
                        id,
                        group,
                        subject: Subject::Outsider(oddity),
                        targets: vec![target],
                    }
                };
                Oddity::ALL
                    .into_iter()
                    .flat_map(|oddity| (0..number).map(move |index| one(oddity, index)))
                    .collect()
            }
        }
    }

    /// Two effects of different kinds that are not by their equations the same.
    fn pair(&self, index: usize) -> Case {
        let mut rng = random(self.seed, &format!("pair {index}"));
        let usual = Variant::usual();
        let mut draw = || *usual.choose(&mut rng).expect("there are effects");
        let lags = |variant: &Variant| {
            variant.kind == Kind::Compressibility
                || (variant.kind == Kind::SensorLag && variant.channel == Channel::Flow)
        };
        let (mut first, mut second) = (draw(), draw());
        while first.kind == second.kind || (lags(&first) && lags(&second)) {
            (first, second) = (draw(), draw());
        }
        if first.kind > second.kind {
            (first, second) = (second, first);
        }
        let targets = vec![target(&mut rng), target(&mut rng)];
        Case {
            id: format!("{}/{first}+{second}/{index}", Group::Pairs),
            group: Group::Pairs,
            subject: Subject::Effects(vec![first, second]),
            targets,
        }
    }
}

impl Case {
    /// Whether it plants what is called so, with or without form and channel.
    fn plants(&self, name: &str) -> bool {
        match &self.subject {
            Subject::Nothing => false,
            Subject::Effects(effects) => effects.iter().any(|e| {
                [e.to_string(), e.catalogue_name(), e.kind.to_string()].contains(&name.to_owned())
            }),
            Subject::Outsider(oddity) => oddity.name() == name,
        }
    }
}

/// A number of cases: of whatever there is one at least.
fn share(cases: f64) -> usize {
    (cases.round() as usize).max(1)
}

fn target(rng: &mut ChaCha8Rng) -> f64 {
    let (low, high) = DRAWN_TARGETS;
    low * (high / low).powf(rng.random::<f64>())
}

/// Random numbers for this purpose: the seed follows from the text (FNV-1a).
pub(super) fn random(seed: u64, purpose: &str) -> ChaCha8Rng {
    let hash = purpose
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(hash);
    rng
}
