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
}

impl Oddity {
    /// All of them.
    pub const ALL: [Self; 13] = [
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
        let high = match self.oddity {
            Oddity::RateGain | Oddity::Reattachment | Oddity::Dropout => 0.9,
            _ => 10.0,
        };
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

/// The command that leaves an odd controller.
pub(super) fn odd_command(command: &[f64], interval: f64, outsiders: &[Outsider]) -> Vec<f64> {
    let [jump, step, rate] =
        [Oddity::GainJump, Oddity::CoarseDac, Oddity::RateGain].map(|o| strength(outsiders, o));
    let mut odd = command.to_vec();
    let half = command.len() / 2;
    odd[half..].iter_mut().for_each(|u| *u *= 1.0 + jump);
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

/// Whether the jet is attached, from whether it was and from the opening.
pub(super) fn attached(before: bool, opening: f64) -> bool {
    opening.abs() > if before { 0.2 } else { 0.5 }
}

/// What an odd spool sensor shows, V, where `rate` is [`seen_rate`].
pub(super) fn odd_sensor(outsiders: &[Outsider], mut x: f64, rate: f64) -> f64 {
    let [band, talk] = [Oddity::SensorDeadBand, Oddity::CrossTalk].map(|o| strength(outsiders, o));
    if x.abs() < band {
        x = 0.0;
    }
    x + talk * rate * rate / (1.0 + rate * rate)
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
    }
}
