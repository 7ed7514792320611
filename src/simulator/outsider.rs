//! Effects that are in no catalogue: what a diagnosis must not call by a physical name that it knows.

use super::planted::assignment;
use super::valve::FULL_SCALE;
use crate::{Error, Result};
use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// An effect outside the catalogue. Zero is absent for each of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Oddity {
    /// The gain of the command jumps halfway through the record: u (1 + value). \[1\]
    GainJump,
    /// A DAC with this step rounds the command. \[V\]
    CoarseDac,
    /// The gain falls while the command moves: u (1 − value · w / (1 + w)), w = |u̇| / 100 V/s, u̇ seen through a lag
    /// of 10 ms. \[1\]
    RateGain,
    /// Drag with the square of the speed: T v' loses value · v |v| / (100 V/s). \[1\]
    QuadraticDamping,
    /// The loop's gain grows with the spool's deflection: K (1 + value · |x| / full scale). \[1\]
    AmplitudeGain,
    /// Notches every 2.5 V pull the spool in: the drive loses value · sin(2π x / 2.5 V). \[V\]
    Detent,
    /// The deflected spool chatters at 180 Hz: x + value · |x| / full scale · sin(2π 180 t). \[V\]
    Chatter,
    /// The spool creeps after its motion: x + value · (x through a lag of 0.5 s). \[1\]
    Creep,
    /// The pump's ripple at 37 Hz: Q (1 + value · sin(2π 37 t)). \[1\]
    PumpRipple,
    /// The flow through one land sticks to it for high openings (reattachment): Q (1 − value) while |opening| has been
    /// above 50 % and not below 20 % since. \[1\]
    Reattachment,
    /// The spool's sensor shows zero where |x| is below the value. \[V\]
    SensorDeadBand,
    /// The command's rate couples into the spool's sensor: x + value · w² / (1 + w²), w = u̇ / 100 V/s seen through a
    /// lag of 10 ms. \[V\]
    CrossTalk,
    /// The measurement of all channels hangs for stretches of 10 to 60 ms, in all for this share of the record. \[1\]
    Dropout,
    /// The amplifier's gain settles after it is switched on: u (1 + value · (1 − exp(−t / 2 s))). \[1\]
    GainDrift,
    /// Eddy currents in the coil: this share of the command comes through lags of 2, 10 and 50 ms, a third of it through
    /// each. \[1\]
    EddyCurrent,
    /// Preloaded centring springs: the drive loses value · x / √(x² + (0.1 V)²). \[V\]
    SpringPreload,
    /// The motor's torque ends: |T v'| ≤ 100 V/s / value. \[1\]
    TorqueLimit,
    /// An unloading valve lets the supply rise and fall: Q √(1 + value · w), w a triangle of 0.9 s from −1 to 1. \[1\]
    SupplyHunting,
    /// The spool's sensor has another range for large strokes: x (1 + value) where |x| > 60 % of full scale. \[1\]
    RangeSwitch,
    /// The linkage of the spool's sensor has a play of this half-width. \[V\]
    SensorPlay,
    /// The spool's converter lacks codes: less than the value above each multiple of 5 V it shows that. \[V\]
    MissingCodes,
    /// The flow meter stands still where |Q| is below the value. \[L/min\]
    MeterStall,
}

impl Oddity {
    /// All of them.
    pub const ALL: [Self; 22] = [
        Self::GainJump,
        Self::CoarseDac,
        Self::RateGain,
        Self::QuadraticDamping,
        Self::AmplitudeGain,
        Self::Detent,
        Self::Chatter,
        Self::Creep,
        Self::PumpRipple,
        Self::Reattachment,
        Self::SensorDeadBand,
        Self::CrossTalk,
        Self::Dropout,
        Self::GainDrift,
        Self::EddyCurrent,
        Self::SpringPreload,
        Self::TorqueLimit,
        Self::SupplyHunting,
        Self::RangeSwitch,
        Self::SensorPlay,
        Self::MissingCodes,
        Self::MeterStall,
    ];

    /// Name, unit, and a value that is well seen above a noise of 0.3 % of full scale.
    fn entry(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::GainJump => ("gain_jump", "1", 0.03),
            Self::CoarseDac => ("coarse_dac", "V", 0.4),
            Self::RateGain => ("rate_gain", "1", 0.1),
            Self::QuadraticDamping => ("quadratic_damping", "1", 0.1),
            Self::AmplitudeGain => ("amplitude_gain", "1", 0.4),
            Self::Detent => ("detent", "V", 0.15),
            Self::Chatter => ("chatter", "V", 0.4),
            Self::Creep => ("creep", "1", 0.15),
            Self::PumpRipple => ("pump_ripple", "1", 0.05),
            Self::Reattachment => ("reattachment", "1", 0.06),
            Self::SensorDeadBand => ("sensor_dead_band", "V", 0.6),
            Self::CrossTalk => ("cross_talk", "V", 0.3),
            Self::Dropout => ("dropout", "1", 0.03),
            Self::GainDrift => ("gain_drift", "1", 0.05),
            Self::EddyCurrent => ("eddy_current", "1", 0.2),
            Self::SpringPreload => ("spring_preload", "V", 0.15),
            Self::TorqueLimit => ("torque_limit", "1", 0.5),
            Self::SupplyHunting => ("supply_hunting", "1", 0.1),
            Self::RangeSwitch => ("range_switch", "1", 0.03),
            Self::SensorPlay => ("sensor_play", "V", 0.1),
            Self::MissingCodes => ("missing_codes", "V", 0.4),
            Self::MeterStall => ("meter_stall", "L/min", 2.0),
        }
    }

    /// The name.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// The unit of its value.
    pub fn unit(self) -> &'static str {
        self.entry().1
    }

    /// Whether its value is a share of something, below 1.
    pub(crate) fn is_share(self) -> bool {
        matches!(
            self,
            Self::RateGain
                | Self::Reattachment
                | Self::Dropout
                | Self::EddyCurrent
                | Self::SupplyHunting
        )
    }

    /// A value that is well seen.
    pub fn typical(self) -> f64 {
        self.entry().2
    }
}

impl Display for Oddity {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// An effect outside the catalogue with its strength, written `name=value`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outsider {
    /// Which one.
    pub oddity: Oddity,
    /// Its strength in [`Oddity::unit`].
    pub value: f64,
}

impl Display for Outsider {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.oddity, self.value)
    }
}

impl FromStr for Outsider {
    type Err = Error;

    /// # Errors
    /// An unknown name, or a value that is no number from 0 to 10.
    fn from_str(text: &str) -> Result<Self> {
        let place = format!("outsider {text:?}");
        let (name, value) = assignment(text.trim(), &place)?;
        let oddity = Oddity::ALL.into_iter().find(|oddity| oddity.name() == name);
        let oddity = oddity.ok_or_else(|| {
            let names = Oddity::ALL.map(Oddity::name).join(", ");
            Error::input(&place, "is not known", format!("use one of {names}"))
        })?;
        let outsider = Self { oddity, value };
        outsider.check()?;
        Ok(outsider)
    }
}

impl Outsider {
    /// # Errors
    /// A value that is not from 0 to 10, or from 0 to 0.9 where it is a share.
    pub(super) fn check(&self) -> Result<()> {
        let high = if self.oddity.is_share() { 0.9 } else { 10.0 };
        if (0.0..=high).contains(&self.value) {
            return Ok(());
        }
        Err(Error::input(
            format!("outsider {self}"),
            format!("its value is not from 0 to {high} {}", self.oddity.unit()),
            "give another value",
        ))
    }
}

/// The strength of `oddity`, zero where it is not planted.
pub(super) fn strength(outsiders: &[Outsider], oddity: Oddity) -> f64 {
    outsiders
        .iter()
        .find(|outsider| outsider.oddity == oddity)
        .map_or(0.0, |outsider| outsider.value)
}

/// The rate of a held command as a lag of 10 ms sees it, over 100 V/s.
pub(super) fn seen_rate(command: &[f64], interval: f64) -> Vec<f64> {
    let keep = (-interval / 0.01).exp();
    let mut seen = 0.0;
    let mut before = command[0];
    let rate = command.iter().map(|&u| {
        seen = keep * seen + (1.0 - keep) * (u - before) / interval / 100.0;
        before = u;
        seen
    });
    rate.collect()
}

/// Time constants of the eddy currents, s.
const EDDIES: [f64; 3] = [0.002, 0.01, 0.05];

/// The command that leaves an odd controller.
pub(super) fn odd_command(command: &[f64], interval: f64, outsiders: &[Outsider]) -> Vec<f64> {
    let [jump, drift, late, step, rate] = [
        Oddity::GainJump,
        Oddity::GainDrift,
        Oddity::EddyCurrent,
        Oddity::CoarseDac,
        Oddity::RateGain,
    ]
    .map(|o| strength(outsiders, o));
    let mut odd = command.to_vec();
    let half = command.len() / 2;
    odd[half..].iter_mut().for_each(|u| *u *= 1.0 + jump);
    for (row, u) in odd.iter_mut().enumerate() {
        *u *= 1.0 - drift * (-(row as f64) * interval / 2.0).exp_m1();
    }
    if late > 0.0 {
        let keep = EDDIES.map(|lag| (-interval / lag).exp());
        let mut eddies = [odd[0]; EDDIES.len()];
        for u in &mut odd {
            for (eddy, keep) in eddies.iter_mut().zip(keep) {
                *eddy = keep * *eddy + (1.0 - keep) * *u;
            }
            *u += late * (eddies.iter().sum::<f64>() / EDDIES.len() as f64 - *u);
        }
    }
    if step > 0.0 {
        odd.iter_mut().for_each(|u| *u = (*u / step).round() * step);
    }
    if rate > 0.0 {
        for (u, w) in odd.iter_mut().zip(seen_rate(command, interval)) {
            *u *= 1.0 - rate * w.abs() / (1.0 + w.abs());
        }
    }
    odd
}

/// What drag with the square of the speed takes from T v', V/s.
pub(super) fn quadratic_drag(strength: f64, velocity: f64) -> f64 {
    strength * velocity * velocity.abs() / 100.0
}

/// The factor of a loop gain that grows with the spool's deflection.
pub(super) fn amplitude_gain(strength: f64, spool: f64) -> f64 {
    1.0 + strength * spool.abs() / FULL_SCALE
}

/// What preloaded springs take from the drive, V.
pub(super) fn spring_preload(strength: f64, spool: f64) -> f64 {
    strength * spool / spool.hypot(0.1)
}

/// T v', V/s, as far as the torque goes.
pub(super) fn limited_torque(strength: f64, wanted: f64) -> f64 {
    let most = 100.0 / strength;
    wanted.clamp(-most, most)
}

/// What the notches take from the drive, V.
pub(super) fn detent(strength: f64, spool: f64) -> f64 {
    strength * (TAU * spool / 2.5).sin()
}

/// What chatter adds to the spool's position, V.
pub(super) fn chatter(strength: f64, spool: f64, time: f64) -> f64 {
    strength * spool.abs() / FULL_SCALE * (TAU * 180.0 * time).sin()
}

/// Time constant of creep, s.
pub(super) const CREEP_LAG: f64 = 0.5;

/// The factor that a pump's ripple puts on the flow.
pub(super) fn pump_ripple(strength: f64, time: f64) -> f64 {
    1.0 + strength * (TAU * 37.0 * time).sin()
}

/// The factor that a hunting supply puts on the flow.
pub(super) fn supply_hunting(strength: f64, time: f64) -> f64 {
    let turn = (time / 0.9 + 0.75).fract();
    (1.0 + strength * ((4.0 * turn - 2.0).abs() - 1.0)).sqrt()
}

/// Whether the jet is attached, from whether it was and from the opening.
pub(super) fn attached(before: bool, opening: f64) -> bool {
    opening.abs() > if before { 0.2 } else { 0.5 }
}

/// What an odd spool sensor shows, V, where `rate` is [`seen_rate`].
pub(super) fn odd_sensor(outsiders: &[Outsider], mut x: f64, rate: f64) -> f64 {
    let [band, range, missing, talk] = [
        Oddity::SensorDeadBand,
        Oddity::RangeSwitch,
        Oddity::MissingCodes,
        Oddity::CrossTalk,
    ]
    .map(|o| strength(outsiders, o));
    if x.abs() < band {
        x = 0.0;
    }
    if x.abs() > 0.6 * FULL_SCALE {
        x *= 1.0 + range;
    }
    let above = x.rem_euclid(5.0);
    if above < missing {
        x -= above;
    }
    x + talk * rate * rate / (1.0 + rate * rate)
}

/// What an odd flow meter shows, L/min.
pub(super) fn odd_meter(outsiders: &[Outsider], flow: f64) -> f64 {
    if flow.abs() < strength(outsiders, Oddity::MeterStall) {
        0.0
    } else {
        flow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_wrong_is_named() {
        for oddity in Oddity::ALL {
            let text = format!("{oddity}={}", oddity.typical());
            let outsider: Outsider = text.parse().unwrap();
            assert_eq!((outsider.oddity, outsider.to_string()), (oddity, text));
        }
        for (text, part) in [
            ("detend=1", "detent"),
            ("detent=-1", "from 0 to 10 V"),
            ("dropout=1", "0.9"),
        ] {
            let error = text.parse::<Outsider>().unwrap_err().to_string();
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }

    #[test]
    fn without_outsiders_nothing_changes() {
        let command = [0.0, 1.0, -3.3];
        assert_eq!(odd_command(&command, 1e-3, &[]), command);
        assert_eq!(odd_sensor(&[], -3.3, 0.7), -3.3);
        assert_eq!(odd_meter(&[], -1e-9), -1e-9);
    }

    #[test]
    fn what_is_odd_is_that_of_its_equation() {
        let odd = |text: &str| [text.parse::<Outsider>().unwrap()];
        let [settled, late] = ["gain_drift=0.5", "eddy_current=0.3"]
            .map(|text| odd_command(&vec![2.0; 20_001], 1e-3, &odd(text)));
        assert!((settled[2000] - (2.0 + 1.0 - (-1f64).exp())).abs() < 1e-12);
        assert!((settled[20_000] - 3.0).abs() < 1e-4);
        assert!(late.iter().all(|u| (u - 2.0).abs() < 1e-12));
        let mut step = vec![2.0; 3];
        step[0] = 0.0;
        let late = odd_command(&step, 1e-3, &odd("eddy_current=0.3"));
        let left = EDDIES.map(|lag| (-2e-3 / lag).exp()).iter().sum::<f64>() / 3.0;
        assert!((late[2] - 2.0 * (1.0 - 0.3 * left)).abs() < 1e-12);
        let shown = |text: &str, x| odd_sensor(&odd(text), x, 0.0);
        assert_eq!(
            [6.0, -7.0].map(|x| shown("range_switch=0.5", x)),
            [6.0, -10.5]
        );
        let codes = [5.25, 5.5, -4.75, 0.1].map(|x| shown("missing_codes=0.5", x));
        assert_eq!(codes, [5.0, 5.5, -5.0, 0.0]);
        let stalled = [-1.5, 2.5].map(|flow| odd_meter(&odd("meter_stall=2"), flow));
        assert_eq!(stalled, [0.0, 2.5]);
        let supply = [0.0, 0.225, 0.675].map(|t| supply_hunting(0.19, t).powi(2));
        for (supply, expected) in supply.into_iter().zip([1.0, 1.19, 0.81]) {
            assert!((supply - expected).abs() < 1e-9, "{supply}");
        }
    }
}
