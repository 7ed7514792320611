//! Which effects are planted, and how they are written.

use super::meter::{Meter, Supply};
use crate::record::Channel;
use crate::{Error, Result};
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// A physical effect that a valve or its bench can have. The equations are at the places that [`Kind::place`] names;
/// several effects act in the order of [`Kind::ALL`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The command arrives θ late, exactly: u(t − θ). \[s\]
    Delay,
    /// What of the command is within ±d does nothing: u − max(−d, min(u, d)). \[V\]
    DeadBand,
    /// The loop is asked for a share g of its command: g u; of one that heats its coil, that at half of full scale in the end. \[1\]
    DcGain,
    /// The command is off by u0: u + u0; as it warms up, by u0 (1 − e^(−t/τ)). \[V\]
    NullBias,
    /// A play of half-width b on the command: y = max(u − b, min(u + b, y₋)). \[V\]
    Hysteresis,
    /// The command through a lag of this time constant. \[s\]
    CommandLag,
    /// u + a sin(2π f t + φ), f (near 50 Hz) and φ drawn unless given. \[V\]
    CommandHum,
    /// The loop has a zero: what moves spool and valve is x + T x'. \[s\]
    FeedForward,
    /// What the loop is fed back: x + s (x / full scale)² + c (x / full scale)³, c its value. \[V\]
    FeedbackCurvature,
    /// v'' + 2 D ω v' + ω² v = ω² K sat(u − x), x' = v, with D = ω T / 2 of the valve's lag T, in whose place it is. \[Hz\]
    SpoolResonance,
    /// The drive follows the root of the measured supply: it has a share s of √(Δp / Δp_rated) − 1 more. \[1\]
    PilotSupply,
    /// The loop's controller integrates, too: its drive is sat(u − x) + r ∫ sat(u − x) dt, r its value. \[1/s\]
    IntegralAction,
    /// |x'| ≤ v, a bound on the velocity as a state. \[V/s\]
    SlewLimit,
    /// Coulomb friction F on the spool: the drive sat(u − x) loses F sign(x'), and the spool sticks while x' = 0 and
    /// |drive| ≤ F. \[V\]
    Friction,
    /// A spring that grows with the pressure drop: the drive loses φ x Δp / Δp_rated. \[1\]
    FlowForce,
    /// A hard stop, |x| ≤ L, where it hits x' = 0. \[V\]
    StrokeLimit,
    /// h = sign(x) max(|x| − δ, 0), δ in % of full scale. \[%\]
    Overlap,
    /// h = x (1 + a) for x > 0, x (1 − a) for x < 0. \[1\]
    AsymmetricGain,
    /// h = x + c x (|x| − 1), x a share of full scale. \[1\]
    GainCurvature,
    /// |h| ≤ s, s in % of full scale. \[%\]
    FlowSaturation,
    /// |Q| + Q0 √(Δp / Δp_rated) / (1 + (x / w)²) in the pressure line, w the width. \[L/min\]
    Leakage,
    /// p = p0 − R |Q|, |Q| through a lag of 20 ms unless given. \[bar/(L/min)\]
    SupplyDroop,
    /// The flow through a first-order fill of this time constant. \[s\]
    Compressibility,
    /// The flow through a pole pair of this frequency, its damping 0.1 unless given. \[Hz\]
    LineResonance,
    /// Q (1 + d t); where a heating in K is given, Q (1 + d (ϑ − ϑ0)), ϑ measured. \[1/s or 1/K\]
    ViscosityDrift,
    /// A channel through a lag of this time constant. \[s\]
    SensorLag,
    /// What the spool's sensor shows in shares h of full scale: h + s h² + c h³, c its value. \[1\]
    SensorCurvature,
    /// y + b. \[unit of the channel\]
    SensorOffset,
    /// y + d t. \[unit of the channel/s\]
    SensorDrift,
    /// y + a sin(2π f t + φ), f (near 50 Hz) and φ drawn unless given. \[unit of the channel\]
    PeriodicDisturbance,
}

/// The equation by which an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Form {
    /// The usual one.
    Usual,
    /// Delay as the second-order Padé approximant.
    Pade,
    /// Hysteresis after Bouc and Wen.
    BoucWen,
    /// Hysteresis as a Preisach operator: plays of several widths.
    Preisach,
    /// Hysteresis whose branches close in exponentially, after Coleman and Hodgdon.
    Gradual,
    /// Hysteresis after Prandtl and Ishlinskii: as many plays of any width up to the widest.
    Spread,
    /// A play between the spool and what its loop is fed back.
    Feedback,
    /// A play between what the loop moves, and is fed back, and the spool.
    Linkage,
    /// A spool that nears its highest speed smoothly.
    Smooth,
    /// A limit on z' instead of x': in effect a smaller saturation S.
    Integrator,
    /// A limit, a friction or a force on z − x behind the integrator of the loop, which goes on and winds up; a controller that
    /// integrates the error itself, before that is limited.
    Windup,
    /// A resonance behind the valve's lag, with a damping of its own.
    Lagged,
    /// A delay, a lag or a dead band between what the controller of the spool's loop puts out and the valve.
    Loop,
    /// A limit of its own to either side.
    Sides,
    /// A limit on the speed of the command.
    Command,
    /// Friction after Dahl.
    Dahl,
    /// Friction after Canudas de Wit and others, LuGre.
    Lugre,
    /// A stop that only the opening and the sensor see, not the loop.
    Clipped,
    /// A stop as a spring.
    Soft,
    /// The same behind the integrator of the loop, which winds up.
    Elastic,
    /// Metering edges that are rounded, or a limit that is.
    Rounded,
    /// A limit, or a curve, that is a hyperbolic tangent.
    Tanh,
    /// A limit of what a pilot stage delivers, behind its own lag.
    Pilot,
    /// Another overlap on either side of null.
    Edges,
    /// Edges rounded by a radial clearance.
    Clearance,
    /// A gain that changes at one opening.
    Knee,
    /// Ports that are round holes.
    Round,
    /// A loss with the square of the flow.
    Turbulent,
    /// A gain that changes as an odd polynomial has it.
    Shaped,
    /// A lag of second order: two equal ones.
    SecondOrder,
    /// A drift that begins at its rate and comes to rest.
    Settling,
    /// A jump where a dead band would be.
    Compensated,
    /// A force that grows ever less.
    Angle,
    /// A meter whose lag is its value at one flow, and the shorter the more flows.
    Turbine,
    /// A part of the flow alone.
    Share,
    /// A limit of what a pilot stage delivers, of its own to either side.
    Uneven,
    /// An integral that its controller's output runs down where that is limited.
    Tracking,
    /// An integral that stands still while its controller's output is limited.
    Clamping,
    /// An integral that grows as far as a limit; a pump that delivers as much as its own.
    Limited,
    /// A share of the command that the loop goes to at once; the rest comes through a lag.
    Creeping,
    /// Ramps of the command, one away from zero and one towards it.
    Ramps,
    /// A limit that either side nears gradually.
    Choked,
    /// Orifices in series.
    Series,
    /// A saturation that is not the same to both sides.
    Saturation,
    /// A command whose coil it heats.
    Heating,
    /// A pump of limited delivery that fills an accumulator.
    Accumulator,
    /// An opening that lets less pass where its flow is laminar; its value is a share of full scale.
    Laminar,
    /// What shows the spool to its loop and to the record alike.
    Transducer,
    /// An integrator that leaks.
    Leaking,
    /// A null that moves on with time; its value is in V/s, or in V/K where a heating is given and a temperature measured.
    Drifting,
    /// A null that shifts with the supply's pressure; its value is for each tenth of the rated one.
    Supply,
    /// A stop behind which the integrator winds up to its rail.
    Rail,
    /// Four edges of which each has its own lap.
    Bridge,
    /// A line with a share of it at twice the frequency, and another at three times it.
    Overtone,
}

impl Form {
    /// Its name behind the tilde.
    pub fn name(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::Pade => "pade",
            Self::BoucWen => "bouc_wen",
            Self::Preisach => "preisach",
            Self::Gradual => "gradual",
            Self::Spread => "spread",
            Self::Accumulator => "accumulator",
            Self::Transducer => "transducer",
            Self::Leaking => "leaking",
            Self::Drifting => "drifting",
            Self::Supply => "supply",
            Self::Rail => "rail",
            Self::Bridge => "bridge",
            Self::Laminar => "laminar",
            Self::Feedback => "feedback",
            Self::Linkage => "linkage",
            Self::Smooth => "smooth",
            Self::Integrator => "integrator",
            Self::Windup => "windup",
            Self::Lagged => "lagged",
            Self::Loop => "loop",
            Self::Sides => "sides",
            Self::Command => "command",
            Self::Dahl => "dahl",
            Self::Lugre => "lugre",
            Self::Series => "series",
            Self::Saturation => "saturation",
            Self::Clipped => "clipped",
            Self::Soft => "soft",
            Self::Elastic => "elastic",
            Self::Rounded => "rounded",
            Self::Tanh => "tanh",
            Self::Pilot => "pilot",
            Self::Edges => "edges",
            Self::Clearance => "clearance",
            Self::Knee => "knee",
            Self::Round => "round",
            Self::Turbulent => "turbulent",
            Self::Shaped => "shaped",
            Self::SecondOrder => "second_order",
            Self::Settling => "settling",
            Self::Overtone => "overtone",
            Self::Compensated => "compensated",
            Self::Angle => "angle",
            Self::Turbine => "turbine",
            Self::Share => "share",
            Self::Uneven => "uneven",
            Self::Tracking => "tracking",
            Self::Clamping => "clamping",
            Self::Limited => "limited",
            Self::Creeping => "creeping",
            Self::Ramps => "ramps",
            Self::Heating => "heating",
            Self::Choked => "choked",
        }
    }
}

/// A further parameter: its name, what it is where nothing is given (NaN is drawn or derived), and the forms that have it.
type Key = (&'static str, f64, &'static [Form]);

const USUAL: &[Form] = &[Form::Usual];

/// Those of something periodic.
const HUM: &[Key] = &[
    ("frequency", f64::NAN, &[Form::Usual, Form::Overtone]),
    ("phase", f64::NAN, &[Form::Usual, Form::Overtone]),
    ("share", 0.5, &[Form::Overtone]),
    ("second", 0.0, &[Form::Overtone]),
];

/// What there is to know about an effect.
struct Entry {
    name: &'static str,
    unit: &'static str,
    place: &'static str,
    /// The values that make sense; the lower end itself only where it is neutral.
    range: (f64, f64),
    typical: f64,
    forms: &'static [Form],
    keys: &'static [Key],
}

impl Kind {
    /// All of them, in the order in which they act.
    pub const ALL: [Self; 30] = [
        Self::Delay,
        Self::DeadBand,
        Self::DcGain,
        Self::NullBias,
        Self::Hysteresis,
        Self::CommandLag,
        Self::CommandHum,
        Self::FeedForward,
        Self::FeedbackCurvature,
        Self::SpoolResonance,
        Self::PilotSupply,
        Self::IntegralAction,
        Self::SlewLimit,
        Self::Friction,
        Self::FlowForce,
        Self::StrokeLimit,
        Self::Overlap,
        Self::AsymmetricGain,
        Self::GainCurvature,
        Self::FlowSaturation,
        Self::Leakage,
        Self::SupplyDroop,
        Self::Compressibility,
        Self::LineResonance,
        Self::ViscosityDrift,
        Self::SensorLag,
        Self::SensorCurvature,
        Self::SensorOffset,
        Self::SensorDrift,
        Self::PeriodicDisturbance,
    ];

    #[rustfmt::skip]
    fn entry(self) -> Entry {
        let entry = |name, unit, place, range, typical, forms, keys| Entry {
            name, unit, place, range, typical, forms, keys,
        };
        match self {
            Self::Delay => entry("delay", "s", "electronics", (0.0, 1.0), 0.002, &[Form::Pade, Form::Loop], &[]),
            Self::DeadBand => entry("dead_band", "V", "electronics", (0.0, 5.0), 0.2,
                &[Form::Compensated, Form::Feedback, Form::Loop], &[("start", 0.06, &[Form::Compensated])]),
            Self::DcGain => entry("dc_gain", "1", "electronics", (0.1, 10.0), 0.96,
                &[Form::Creeping, Form::Heating, Form::Leaking],
                &[("time", 0.5, &[Form::Creeping, Form::Heating]), ("zero", 0.0, &[Form::Leaking])]),
            Self::NullBias => entry("null_bias", "V", "electronics", (-10.0, 10.0), 0.3,
                &[Form::Settling, Form::Transducer, Form::Pilot, Form::Supply, Form::Drifting],
                &[("warm_up", 5.0, &[Form::Settling, Form::Transducer, Form::Drifting]), ("stretch", 0.0, &[Form::Transducer]),
                    ("heating", f64::NAN, &[Form::Drifting])]),
            Self::Hysteresis => entry("hysteresis", "V", "electronics", (0.0, 5.0), 0.15,
                &[Form::BoucWen, Form::Preisach, Form::Gradual, Form::Spread, Form::Feedback, Form::Linkage, Form::Loop, Form::Transducer],
                &[("width", f64::NAN, &[Form::BoucWen]), ("travel", 0.5, &[Form::Gradual]), ("widest", 1.0, &[Form::Spread]), ("share", 0.6, &[Form::Loop])]),
            Self::CommandLag => entry("command_lag", "s", "electronics", (0.0, 1.0), 0.003, &[Form::SecondOrder, Form::Loop], &[]),
            Self::CommandHum => entry("command_hum", "V", "electronics", (0.0, 10.0), 0.2,
                &[Form::Overtone], HUM),
            Self::FeedForward => entry("feed_forward", "s", "spool", (0.0, 1.0), 0.003, &[], &[]),
            Self::FeedbackCurvature => entry("feedback_curvature", "V", "spool", (-2.0, 2.0), 0.4,
                &[], &[("square", 0.0, USUAL)]),
            Self::SpoolResonance => entry("spool_resonance", "Hz", "spool", (1.0, 2000.0), 60.0,
                &[Form::Lagged], &[("damping", 0.4, &[Form::Lagged])]),
            Self::PilotSupply => entry("pilot_supply", "1", "spool", (0.0, 2.0), 1.0, &[], &[]),
            Self::IntegralAction => entry("integral_action", "1/s", "spool", (0.0, 1000.0), 12.0,
                &[Form::Windup, Form::Tracking, Form::Clamping, Form::Limited, Form::Leaking],
                &[("tracking", 60.0, &[Form::Tracking]), ("limit", 0.5, &[Form::Limited]), ("leak", 2.0, &[Form::Leaking])]),
            Self::SlewLimit => entry("slew_limit", "V/s", "spool", (1.0, 1e5), 300.0,
                &[Form::Smooth, Form::Integrator, Form::Windup, Form::Command, Form::Rounded, Form::Tanh, Form::Pilot, Form::Sides, Form::Uneven, Form::Ramps],
                &[
                    ("bend", 0.8, &[Form::Rounded, Form::Pilot, Form::Uneven]),
                    ("negative", 1e5, &[Form::Sides, Form::Uneven]),
                    ("closing", 600.0, &[Form::Ramps]),
                ]),
            Self::Friction => entry("friction", "V", "spool", (0.0, 5.0), 0.1,
                &[Form::Dahl, Form::Lugre, Form::Windup], &[
                    ("excess", f64::NAN, &[Form::Usual, Form::Lugre, Form::Windup]),
                    ("stribeck", 5.0, &[Form::Usual, Form::Lugre]),
                    ("width", 0.05, &[Form::Dahl, Form::Lugre]),
                ]),
            Self::FlowForce => entry("flow_force", "1", "spool", (-0.5, 5.0), 0.1,
                &[Form::Windup, Form::Angle], &[("turn", 0.6, &[Form::Angle]), ("span", 2.0, &[Form::Angle])]),
            Self::StrokeLimit => entry("stroke_limit", "V", "spool", (0.1, 100.0), 7.0,
                &[Form::Clipped, Form::Soft, Form::Windup, Form::Command, Form::Elastic, Form::Sides, Form::Rail],
                &[
                    ("stiffness", 20.0, &[Form::Soft]),
                    ("rate", 1000.0, &[Form::Elastic, Form::Rail]),
                    ("negative", 100.0, &[Form::Sides, Form::Rail]),
                    ("rail", 13.0, &[Form::Rail]),
                ]),
            Self::Overlap => entry("overlap", "%", "flow", (0.0, 90.0), 4.0,
                &[Form::Rounded, Form::Edges, Form::Clearance, Form::Bridge, Form::Leaking],
                &[
                    ("closing", 1.0, &[Form::Leaking]),
                    ("width", f64::NAN, &[Form::Rounded]),
                    ("negative", 0.0, &[Form::Edges]),
                    ("clearance", 2.0, &[Form::Clearance, Form::Bridge]),
                    ("b_t", 1.0, &[Form::Bridge]),
                    ("p_b", 1.0, &[Form::Bridge]),
                    ("a_t", 4.0, &[Form::Bridge]),
                ]),
            Self::AsymmetricGain => entry("asymmetric_gain", "1", "flow", (-0.9, 0.9), 0.08,
                &[Form::Loop, Form::Pilot, Form::Saturation], &[]),
            Self::GainCurvature => entry("gain_curvature", "1", "flow", (-0.9, 0.9), 0.15,
                &[Form::Knee, Form::Shaped, Form::Round, Form::Laminar, Form::Tanh], &[("at", 40.0, &[Form::Knee]), ("fifth", 0.0, &[Form::Shaped])]),
            Self::FlowSaturation => entry("flow_saturation", "%", "flow", (1.0, 1000.0), 80.0,
                &[Form::Choked, Form::Series], &[("negative", 1000.0, &[Form::Choked])]),
            Self::Leakage => entry("leakage", "L/min", "flow", (0.0, 100.0), 1.5, &[], &[("width", 4.0, USUAL)]),
            Self::SupplyDroop => entry("supply_droop", "bar/(L/min)", "flow", (0.0, 10.0), 0.03,
                &[Form::Turbulent, Form::Limited, Form::Accumulator],
                &[
                    ("lag", 0.02, &[Form::Usual, Form::Turbulent, Form::Limited, Form::Accumulator]),
                    ("pump", 30.0, &[Form::Limited, Form::Accumulator]),
                ]),
            Self::Compressibility => entry("compressibility", "s", "flow", (0.0, 1.0), 0.004, &[], &[]),
            Self::LineResonance => entry("line_resonance", "Hz", "flow", (1.0, 2000.0), 120.0,
                &[Form::Share],
                &[("damping", 0.1, &[Form::Usual, Form::Share]), ("share", 0.5, &[Form::Share])]),
            Self::ViscosityDrift => entry("viscosity_drift", "1/s", "flow", (-1.0, 1.0), 0.01,
                &[Form::Settling],
                &[("heating", f64::NAN, USUAL), ("warm_up", 5.0, &[Form::Usual, Form::Settling])]),
            Self::SensorLag => entry("sensor_lag", "s", "sensor", (0.0, 1.0), 0.003,
                &[Form::SecondOrder, Form::Turbine],
                &[
                    ("at", 60.0, &[Form::Turbine]),
                    ("rest", 0.05, &[Form::Turbine]),
                    ("drag", 0.0, &[Form::Turbine]),
                ]),
            Self::SensorCurvature => entry("sensor_curvature", "1", "sensor", (-0.9, 0.9), -0.05,
                &[Form::Tanh], &[("square", 0.0, USUAL)]),
            Self::SensorOffset => entry("sensor_offset", "unit", "sensor", (-1e3, 1e3), 0.15, &[], &[]),
            Self::SensorDrift => entry("sensor_drift", "unit/s", "sensor", (-1e3, 1e3), 0.03,
                &[Form::Settling], &[("warm_up", 5.0, &[Form::Settling])]),
            Self::PeriodicDisturbance => entry("periodic_disturbance", "unit", "sensor", (-1e3, 1e3), 0.1,
                &[Form::Overtone], HUM),
        }
    }

    /// The name of the effect.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The unit of its value; `unit` in it is that of the channel.
    pub fn unit(self) -> &'static str {
        self.entry().unit
    }

    /// The module of the simulator that holds its equation.
    pub fn place(self) -> &'static str {
        self.entry().place
    }

    /// A value that is seen in valves.
    pub fn typical(self) -> f64 {
        self.entry().typical
    }

    /// The forms other than [`Form::Usual`].
    pub fn forms(self) -> &'static [Form] {
        self.entry().forms
    }

    /// The names of further parameters.
    pub fn keys(self) -> impl Iterator<Item = &'static str> {
        self.entry().keys.iter().map(|key| key.0)
    }

    /// Where the flow has to be measured for it to show.
    pub fn meter(self) -> Meter {
        match self {
            Self::Leakage => Meter::Supply,
            _ => Meter::Load,
        }
    }

    /// What has to feed the valve for it to show in this `form`.
    pub fn supply(self, form: Form) -> Supply {
        match (self, form) {
            (Self::PilotSupply, _) | (Self::NullBias, Form::Supply) => Supply::Measured,
            _ => Supply::Constant,
        }
    }

    /// Whether it acts on a measured channel.
    pub fn has_channel(self) -> bool {
        self.entry().place == "sensor" && self != Self::SensorCurvature
    }
}

impl Display for Kind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// An effect with its value, written `name=value`; in full `name~form.channel=value:key=value`.
///
/// `sensor_lag.flow=0.004`, `hysteresis~bouc_wen=0.2` and `leakage=1.5:width=4` are examples.
#[derive(Debug, Clone, PartialEq)]
pub struct Planted {
    /// Which effect.
    pub effect: Kind,
    /// Its equation.
    pub form: Form,
    /// The channel it acts on, [`Channel::Spool`] or [`Channel::Flow`]; of use to measurement effects alone.
    pub channel: Channel,
    /// Its value in [`Kind::unit`].
    pub value: f64,
    /// Further parameters that were given.
    pub extra: Vec<(&'static str, f64)>,
}

impl Planted {
    /// The effect in its usual form, on the spool if it has a channel.
    pub fn new(effect: Kind, value: f64) -> Self {
        Self {
            effect,
            form: Form::Usual,
            channel: Channel::Spool,
            value,
            extra: Vec::new(),
        }
    }

    /// The same in another form, a turbine on the flow.
    pub fn form(self, form: Form) -> Self {
        let channel = match form {
            Form::Turbine => Channel::Flow,
            _ => self.channel,
        };
        Self {
            form,
            channel,
            ..self
        }
    }

    /// The same on another channel.
    pub fn on(self, channel: Channel) -> Self {
        Self { channel, ..self }
    }

    /// The unit of its value: that of its kind, but for a drift, which may follow a temperature.
    pub fn unit(&self) -> &'static str {
        match (self.effect, self.key("heating")) {
            (Kind::ViscosityDrift, Some(_)) => "1/K",
            (Kind::NullBias, Some(_)) => "V/K",
            (Kind::NullBias, None) if self.form == Form::Drifting => "V/s",
            (kind, _) => kind.unit(),
        }
    }

    /// A further parameter, where it is given or has a default.
    pub(crate) fn key(&self, key: &str) -> Option<f64> {
        let given = self.extra.iter().find(|(name, _)| *name == key);
        let default = || self.own_keys().find(|(name, ..)| *name == key);
        let value = given.map_or_else(|| default().map(|key| key.1), |given| Some(given.1));
        value.filter(|value| !value.is_nan())
    }

    /// The further parameters that its form has.
    fn own_keys(&self) -> impl Iterator<Item = &'static Key> {
        let form = self.form;
        let keys = self.effect.entry().keys.iter();
        keys.filter(move |key| key.2.contains(&form))
    }

    /// The name of the further parameter written `key`.
    ///
    /// # Errors
    /// The effect, or its form, has none of that name.
    fn own_key(&self, key: &str, place: &str) -> Result<&'static str> {
        let own: Vec<&str> = self.own_keys().map(|key| key.0).collect();
        if let Some(index) = own.iter().position(|name| *name == key) {
            return Ok(own[index]);
        }
        let remedy = match own.is_empty() {
            true => "leave it away".into(),
            false => format!("use {}", own.join(", ")),
        };
        let form = match self.form {
            Form::Usual => String::new(),
            form => format!("~{}", form.name()),
        };
        let problem = format!("{}{form} has no parameter {key:?}", self.effect);
        Err(Error::input(place, problem, remedy))
    }

    /// # Errors
    /// A value out of its range, a form or channel that the effect does not have.
    pub(super) fn check(&self) -> Result<()> {
        let entry = self.effect.entry();
        let refuse = |problem: String, remedy: String| {
            Err(Error::input(format!("effect {self}"), problem, remedy))
        };
        let (low, high) = entry.range;
        if !(low..=high).contains(&self.value) {
            return refuse(
                format!("its value is not from {low} to {high} {}", entry.unit),
                "give another value".into(),
            );
        }
        if self.form != Form::Usual && !entry.forms.contains(&self.form) {
            return refuse(
                format!("{} has no form {}", entry.name, self.form.name()),
                forms_remedy(entry.forms),
            );
        }
        if !self.effect.has_channel() && self.channel != Channel::Spool {
            let problem = format!("{} acts on no channel", entry.name);
            return refuse(problem, "leave the channel away".into());
        }
        if !matches!(self.channel, Channel::Spool | Channel::Flow) {
            return refuse(
                format!("nothing is planted on {}", self.channel),
                "use spool or flow".into(),
            );
        }
        if self.form == Form::Turbine && self.channel != Channel::Flow {
            let problem = "a turbine measures flow".to_owned();
            return refuse(problem, format!("write {}~turbine.flow", entry.name));
        }
        for (key, value) in &self.extra {
            self.own_key(key, &format!("effect {self}"))?;
            // Only these can be negative, and be zero in earnest.
            let signed = [
                "phase", "heating", "excess", "stretch", "zero", "b_t", "p_b", "a_t",
            ];
            let signed = signed.contains(key);
            if !value.is_finite()
                || (!signed && *value <= 0.0)
                || (*key == "excess" && *value < 0.0)
            {
                return refuse(
                    format!("{key} cannot be {value}"),
                    "give a positive number".into(),
                );
            }
        }
        Ok(())
    }
}

fn forms_remedy(forms: &[Form]) -> String {
    if forms.is_empty() {
        return "leave the form away".into();
    }
    let names: Vec<&str> = forms.iter().map(|form| form.name()).collect();
    format!("use {} or none", names.join(", "))
}

impl Display for Planted {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.effect.name())?;
        if self.form != Form::Usual {
            write!(f, "~{}", self.form.name())?;
        }
        if self.effect.has_channel() {
            write!(f, ".{}", self.channel)?;
        }
        write!(f, "={}", self.value)?;
        self.extra
            .iter()
            .try_for_each(|(key, value)| write!(f, ":{key}={value}"))
    }
}

/// Oil that warms up, and whose temperature is measured.
#[derive(Clone, Copy)]
pub(super) struct Heating {
    kelvin: f64,
    warm_up: f64,
}

/// The oil's temperature at the start, degC.
pub(super) const COLD: f64 = 40.0;

impl Heating {
    pub(super) fn planted(planted: &[Planted]) -> Option<Self> {
        planted.iter().find_map(|p| {
            Some(Self {
                kelvin: p.key("heating")?,
                warm_up: p.key("warm_up")?,
            })
        })
    }

    /// degC.
    pub(super) fn temperature(self, time: f64) -> f64 {
        COLD - self.kelvin * (-time / self.warm_up).exp_m1()
    }
}

/// What moves with time: at its rate, or ever less.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drift {
    /// At the beginning, 1/s.
    pub(super) rate: f64,
    /// Time constant with which it comes to rest, s.
    settling: Option<f64>,
}

impl Drift {
    /// None where nothing is `planted`.
    pub(super) fn of(planted: Option<&Planted>) -> Self {
        let settles = planted.filter(|p| p.form == Form::Settling);
        Self {
            rate: planted.map_or(0.0, |p| p.value),
            settling: settles.and_then(|p| p.key("warm_up")),
        }
    }

    /// How far it has come after `time` s.
    pub(super) fn at(&self, time: f64) -> f64 {
        let gone = |constant: f64| -constant * (-time / constant).exp_m1();
        self.rate * self.settling.map_or(time, gone)
    }
}

impl FromStr for Planted {
    type Err = Error;

    /// # Errors
    /// An unknown name, form, channel or key, or a value that is no number in the effect's range.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        let place = format!("effect {text:?}");
        let mut parts = text.split(':');
        let (head, value) = assignment(parts.next().unwrap_or(""), &place)?;
        let (head, channel) = match head.split_once('.') {
            Some((head, channel)) => (head, Some(channel)),
            None => (head, None),
        };
        let (name, form) = match head.split_once('~') {
            Some((name, form)) => (name, Some(form)),
            None => (head, None),
        };
        let effect = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        let effect = effect.ok_or_else(|| {
            let names = Kind::ALL.map(Kind::name).join(", ");
            Error::input(&place, "is not known", format!("use one of {names}"))
        })?;
        let entry = effect.entry();
        let mut planted = Self::new(effect, value);
        if let Some(form) = form {
            let found = entry.forms.iter().find(|known| known.name() == form);
            planted = planted.form(*found.ok_or_else(|| {
                let problem = format!("{name} has no form {form:?}");
                Error::input(&place, problem, forms_remedy(entry.forms))
            })?);
        }
        if let Some(channel) = channel {
            if !effect.has_channel() {
                let problem = format!("{name} acts on no channel");
                return Err(Error::input(&place, problem, "leave the channel away"));
            }
            planted.channel = channel.parse()?;
        }
        for part in parts {
            let (key, value) = assignment(part, &place)?;
            let key = planted.own_key(key, &place)?;
            planted.extra.push((key, value));
        }
        planted.check()?;
        Ok(planted)
    }
}

/// `name=number` in two.
pub(super) fn assignment<'a>(text: &'a str, place: &str) -> Result<(&'a str, f64)> {
    let found = text
        .split_once('=')
        .and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
    found.ok_or_else(|| {
        Error::input(
            place,
            format!("{text:?} is no NAME=VALUE"),
            "write NAME=VALUE, such as delay=0.002",
        )
    })
}

/// The planted effect of this kind and form, unless it is neutral.
pub(super) fn find(planted: &[Planted], effect: Kind, form: Form) -> Option<&Planted> {
    planted
        .iter()
        .find(|p| p.effect == effect && p.form == form && p.value != 0.0)
}

/// The value of an effect that has one form, zero where it is not planted.
pub(super) fn value(planted: &[Planted], effect: Kind) -> f64 {
    find(planted, effect, Form::Usual).map_or(0.0, |p| p.value)
}

impl Meter {
    /// Where all of these effects show: between A and B if they do there.
    pub fn that_shows(planted: &[Planted]) -> Self {
        let meters = planted.iter().map(|one| one.effect.meter());
        meters.max().unwrap_or_default()
    }
}

impl Supply {
    /// What all of these effects show with.
    pub fn that_shows(planted: &[Planted]) -> Self {
        let supplies = planted.iter().map(|one| one.effect.supply(one.form));
        supplies.max().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_written_again() {
        for text in [
            "delay=0.002",
            "hysteresis~bouc_wen=0.2",
            "sensor_lag.flow=0.004",
            "leakage=1.5:width=4",
            "friction=0.1:excess=0.05:stribeck=2",
            "sensor_lag~second_order.spool=0.004",
        ] {
            assert_eq!(text.parse::<Planted>().unwrap().to_string(), text);
        }
        for kind in Kind::ALL {
            let text = format!("{kind}={}", kind.typical());
            assert_eq!(text.parse::<Planted>().unwrap().effect, kind);
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_what_would_be_right() {
        for (text, part) in [
            ("dealy=1", "line_resonance"),
            ("delay", "NAME=VALUE"),
            ("delay=x", "NAME=VALUE"),
            ("delay=-1", "from 0 to 1 s"),
            ("delay=nan", "from 0 to 1 s"),
            ("delay~dahl=0.1", "pade"),
            ("leakage~dahl=0.1", "leave the form"),
            ("dc_gain~dahl=0.1", "use creeping"),
            ("delay.flow=0.1", "leave the channel"),
            ("sensor_lag.temperature=0.1", "spool or flow"),
            ("sensor_lag.flw=0.1", "flw"),
            ("sensor_lag~turbine.spool=0.1", "turbine.flow"),
            ("leakage=1:depth=3", "width"),
            ("hysteresis=1:width=3", "leave it away"),
            ("friction~dahl=1:excess=1", "friction~dahl has no parameter"),
            ("leakage=1:width=0", "positive"),
        ] {
            let error = text.parse::<Planted>().unwrap_err().to_string();
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
}
