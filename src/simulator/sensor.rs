//! What the sensors make of spool and flow.

use super::filter::{Lag, runge_kutta};
use super::outsider::{Oddity, Outsider, odd_meter, odd_sensor, strength};
use super::planted::{Drift, Form, Kind, Planted};
use super::valve::FULL_SCALE;
use crate::record::Channel;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// The sensor of one channel.
pub(super) struct Sensor {
    channel: Channel,
    outsiders: Vec<Outsider>,
    /// Units of the channel for each unit of what is measured.
    scale: f64,
    lags: Vec<Lag>,
    turbine: Option<Turbine>,
    curve: Option<Curve>,
    offset: f64,
    drift: Drift,
    disturbance: Option<Line>,
    /// Half-width of the play in its linkage, V.
    play: f64,
    seen: f64,
}

/// The rotor of a flow meter: lag y' = (|Q| / at + rest)(Q − slip − y), where its bearings let it slip by (drag · at)² / |Q|, and hold
/// it below drag · at.
struct Turbine {
    lag: f64,
    at: f64,
    rest: f64,
    drag: f64,
    input: f64,
    shown: f64,
}

impl Turbine {
    fn planted(planted: &Planted, value: f64) -> Option<Self> {
        (planted.form == Form::Turbine).then(|| Self {
            lag: planted.value,
            at: planted.key("at").unwrap_or(1.0),
            rest: planted.key("rest").unwrap_or(0.0),
            drag: planted.key("drag").unwrap_or(0.0),
            input: value,
            shown: value,
        })
    }

    /// Moves on by `h` s, in which the flow goes straight to `flow`.
    fn advance(&mut self, flow: f64, h: f64) -> f64 {
        let before = self.input;
        [self.shown] = runge_kutta([self.shown], h, |[shown], share| {
            let now = before + share * (flow - before);
            let slip = (self.drag * self.at).powi(2) / now.abs().max(self.drag * self.at);
            let driven = (now.abs() - slip).max(0.0).copysign(now);
            [(now.abs() / self.at + self.rest) / self.lag * (driven - shown)]
        });
        self.input = flow;
        self.shown
    }
}

/// What a sensor that is not straight shows of x, in shares h = x / full scale of the spool.
enum Curve {
    /// h + square · h² + cubic · h³.
    Cubic { square: f64, cubic: f64 },
    /// tanh(bend · h) / bend, or sinh where it shows more than there is.
    Tanh { bend: f64, more: bool },
}

impl Curve {
    fn planted(planted: &Planted) -> Self {
        match planted.form {
            // Such that its cubic term is the same.
            Form::Tanh => Self::Tanh {
                bend: match planted.value > 0.0 {
                    true => (6.0 * planted.value).sqrt(),
                    false => (-3.0 * planted.value).sqrt(),
                },
                more: planted.value > 0.0,
            },
            _ => Self::Cubic {
                square: planted.key("square").unwrap_or(0.0),
                cubic: planted.value,
            },
        }
    }

    fn at(&self, x: f64) -> f64 {
        let h = x / FULL_SCALE;
        FULL_SCALE
            * match self {
                Self::Cubic { square, cubic } => h + square * h.powi(2) + cubic * h.powi(3),
                Self::Tanh { bend, more: false } => (bend * h).tanh() / bend,
                Self::Tanh { bend, more: true } => (bend * h).sinh() / bend,
            }
    }
}

/// amplitude · (sin(2π frequency t + phase) + overtone · sin(4π frequency t + phase) + second · sin(6π frequency t + phase))
pub(super) struct Line {
    amplitude: f64,
    frequency: f64,
    phase: f64,
    overtone: f64,
    second: f64,
}

impl Line {
    /// What is not given is drawn: a frequency near 50 Hz that is no multiple of anything, and a phase.
    pub(super) fn planted(planted: &Planted, rng: &mut ChaCha8Rng) -> Self {
        let frequency = rng.random_range(43.0..57.0);
        let phase = rng.random_range(0.0..TAU);
        Self {
            amplitude: planted.value,
            frequency: planted.key("frequency").unwrap_or(frequency),
            phase: planted.key("phase").unwrap_or(phase),
            overtone: planted.key("share").unwrap_or(0.0),
            second: planted.key("second").unwrap_or(0.0),
        }
    }

    /// Its value after `time` s.
    pub(super) fn at(&self, time: f64) -> f64 {
        let turned = TAU * self.frequency * time;
        let [own, overtone, second] =
            [1.0, 2.0, 3.0].map(|times| (times * turned + self.phase).sin());
        self.amplitude * (own + self.overtone * overtone + self.second * second)
    }
}

impl Sensor {
    /// The sensor in equilibrium with `value`, which it shows as `scale * value`.
    pub(super) fn new(
        channel: Channel,
        planted: &[Planted],
        outsiders: &[Outsider],
        scale: f64,
        value: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let on = |kind| {
            let mut own = planted
                .iter()
                .filter(|p| p.channel == channel && p.value != 0.0);
            own.find(|p| p.effect == kind)
        };
        let lag = on(Kind::SensorLag);
        let turbine = lag.and_then(|p| Turbine::planted(p, value));
        let lags = lag.filter(|_| turbine.is_none());
        let lags = lags.map_or(vec![], |p| Lag::in_a_row(p.form, p.value));
        let mut sensor = Self {
            channel,
            outsiders: outsiders.to_vec(),
            scale,
            lags,
            turbine,
            curve: on(Kind::SensorCurvature).map(Curve::planted),
            offset: on(Kind::SensorOffset).map_or(0.0, |p| p.value),
            drift: Drift::of(on(Kind::SensorDrift)),
            disturbance: on(Kind::PeriodicDisturbance).map(|p| Line::planted(p, rng)),
            play: match channel {
                Channel::Spool => strength(outsiders, Oddity::SensorPlay),
                _ => 0.0,
            },
            seen: value,
        };
        sensor.lags.iter_mut().for_each(|lag| lag.rest(value));
        sensor
    }

    /// Moves on by `h` s to `value`.
    pub(super) fn advance(&mut self, value: f64, h: f64) {
        let lags = self.lags.iter_mut();
        let value = lags.fold(value, |value, lag| lag.advance(value, h));
        let turbine = self.turbine.as_mut();
        let value = turbine.map_or(value, |turbine| turbine.advance(value, h));
        self.seen = self.seen.clamp(value - self.play, value + self.play);
    }

    /// What it shows at `time` s, in the channel's unit; `rate` is the command's, as outsiders take it.
    pub(super) fn read(&self, time: f64, rate: f64) -> f64 {
        let seen = match self.channel {
            Channel::Spool => odd_sensor(&self.outsiders, self.seen, rate),
            _ => odd_meter(&self.outsiders, self.seen),
        };
        let seen = self.curve.as_ref().map_or(seen, |curve| curve.at(seen));
        let line = self.disturbance.as_ref().map_or(0.0, |line| line.at(time));
        self.scale * seen + self.offset + self.drift.at(time) + line
    }
}

/// The row that each row shows where measurements hang for a `share` of the rows, in stretches of 10 to 60 ms.
pub(super) fn hanging(share: f64, rows: usize, interval: f64, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let mut shown: Vec<usize> = (0..rows).collect();
    let wanted = (share * rows as f64) as usize;
    let mut hung = 0;
    while hung < wanted {
        let from = rng.random_range(0..rows);
        let length = (rng.random_range(0.01..0.06) / interval).ceil() as usize;
        let (until, source) = ((from + 1 + length).min(rows), shown[from]);
        let stretch = &mut shown[from + 1..until];
        hung += stretch
            .iter()
            .zip(from + 1..)
            .filter(|(shown, row)| *shown == row)
            .count();
        stretch.fill(source);
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_off_by_its_value_at_full_scale_and_a_tangent_by_less() {
        let at = |planted: &str, x: f64| Curve::planted(&planted.parse().unwrap()).at(x);
        assert!((at("sensor_curvature=-0.05:square=0.02", 10.0) - 9.7).abs() < 1e-12);
        assert!((at("sensor_curvature=-0.05:square=0.02", -10.0) + 9.3).abs() < 1e-12);
        for (value, fifth) in [(-0.05, 2.0 / 15.0 * 0.0225), (0.05, 0.09 / 120.0)] {
            let planted = format!("sensor_curvature~tanh={value}");
            let off = at(&planted, 10.0) - 10.0 * (1.0 + value + fifth);
            assert!(off.abs() < 0.01, "{value}: {off}");
            assert_eq!(at(&planted, -3.0), -at(&planted, 3.0));
        }
    }
}
